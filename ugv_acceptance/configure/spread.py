"""How uncertain a derived configuration is: its +/-, what is assumed, where scales differ."""

import math
from collections.abc import Iterator

from ugv_acceptance import BadConfig
from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.configure.draft import CERTAIN, CHECK, Draft
from ugv_acceptance.configure.questions import CONTACTS, LIMITS, SAID, TILT
from ugv_acceptance.model.robot import Link

# +/- of what only a URDF says: share of a mass, m of a centre of gravity and of a contact point,
# deg of the IMU's mounting. Of a mass on scales, shared out by the URDF: share of it.
MASS, COG, POINT, MOUNTING, WEIGHED = 0.1, 0.02, 0.005, 1.0, 0.03
# Links named: at most so many, which have this share of the mass together; the centres of gravity
# of those that have at least so much by themselves, of so many.
MOST, TOGETHER, HEAVY, HEAVIEST = 8, 0.95, 0.1, 3
# Mass that the URDF lacks may lie so far (m) from where the URDF's own lies.
ELSEWHERE = 0.15
# Scales and URDF differ by less than this share: they agree.
AGREE = 0.005
# A reason is cut to so many characters.
_LONGEST = 80
_AXES = ('x', 'y', 'z')


def heaviest(urdf: Urdf) -> list[Link]:
    """Return the heaviest links, heaviest first: most of the mass, a few of them."""
    total = math.fsum(link.mass for link in urdf.links)
    found: list[Link] = []
    for link in sorted(urdf.links, key=lambda link: (-link.mass, link.name)):
        if len(found) >= MOST or math.fsum(x.mass for x in found) >= TOGETHER * total:
            break
        if link.mass > 0.0:
            found.append(link)
    return found


def scaled_link(draft: Draft) -> tuple[str, float, float] | None:
    """Return the link that takes the difference of scales and URDF, its mass, and that before.

    It is the heaviest link that does not move against the root. None where they agree. Raises
    BadConfig where the link would be left with less than half of its mass.
    """
    own = math.fsum(link.mass for link in draft.urdf.links)
    if draft.scales is None or abs(draft.scales - own) <= AGREE * own:
        return None
    body = _rigid(draft.urdf)
    link = max((x for x in draft.urdf.links if x.name in body), key=lambda x: x.mass)
    mass = link.mass + draft.scales - own
    if mass < 0.5 * link.mass or link.mass == 0.0:
        raise BadConfig(
            f'--mass {draft.scales:g}: {abs(draft.scales - own):.2f} kg less than the URDF is more '
            f'than {link.name} ({link.mass:.2f} kg) could give: correct the masses in the URDF'
        )
    return link.name, mass, link.mass


def _rigid(urdf: Urdf) -> set[str]:
    """Return the root link and all that is fixed to it."""
    children = {joint.child for joint in urdf.joints}
    found = [link.name for link in urdf.links if link.name not in children]
    for name in found:
        found += [j.child for j in urdf.joints if j.parent == name and j.kind == 'fixed']
    return set(found)


def assumed_of(draft: Draft) -> list[tuple[str, str]]:
    """Return the numbers nobody measured (name, reason), as in the section `assumed`."""
    found = [*_assumed(draft)]
    known = {link.name for link in draft.urdf.links} | {joint.name for joint in draft.urdf.joints}
    known |= {'imu', 'contacts'}
    # A joint may have a point in its name; what comes before the first point has to be known.
    return [(name, why) for name, why in found if name.partition('.')[0] in known]


def _assumed(draft: Draft) -> Iterator[tuple[str, str]]:
    if draft.mass.grade != CERTAIN or draft.scales is None:
        for link in heaviest(draft.urdf)[:1]:
            yield f'{link.name}.mass', 'the sum of the URDF, nobody weighed the robot'
    for link in heaviest(draft.urdf)[:1]:
        yield f'{link.name}.cog', 'the number in the URDF'
    for joint in draft.joints.measured:
        if joint.limit.value is not None and joint.limit.grade == CHECK:
            yield f'{joint.name}.limit', 'the effort in the URDF'
    position = draft.mounting.position
    if draft.mounting.topic.value and position.value is not None and position.grade != CERTAIN:
        yield 'imu.position', position.source[:_LONGEST]
    if draft.contacts.points and not draft.open & {CONTACTS, TILT}:
        said = [p for p in draft.contacts.points if SAID in p.source]
        if said and draft.contacts.tilt >= math.radians(0.2):
            yield 'contacts.tilt', f'{SAID}: the robot stands tilted like that'


def uncertain_of(draft: Draft) -> list[tuple[str, float, str]]:
    """Return the +/- of a configuration (name, value, why), as in the section `uncertainty`."""
    return [
        *_of_links(draft),
        *_of_limits(draft),
        *_of_contacts(draft),
        *_of_imu(draft),
    ]


def _of_links(draft: Draft) -> Iterator[tuple[str, float, str]]:
    total = math.fsum(link.mass for link in draft.urdf.links)
    changed = scaled_link(draft)
    for link in heaviest(draft.urdf):
        mass, share, why = link.mass, MASS, "+/-10 %: only the URDF's word"
        if draft.scales is not None and link.name == _body_link(draft):
            mass = changed[1] if changed else link.mass
            share, why = WEIGHED, '+/-3 %: the robot was weighed'
        yield f'{link.name}.mass_kg', mass * share, why
    for link in heaviest(draft.urdf)[:HEAVIEST]:
        if link.mass < HEAVY * total:
            continue
        far, why = COG, "+/-2 cm: only the URDF's word"
        if changed and link.name == changed[0]:
            far += ELSEWHERE * abs(changed[1] - changed[2]) / changed[1]
            why = '+/-2 cm, and where the mass is that the URDF lacks'
        for axis in _AXES:
            yield f'{link.name}.cog_{axis}_m', far, why


def _body_link(draft: Draft) -> str:
    body = _rigid(draft.urdf)
    return max((x for x in draft.urdf.links if x.name in body), key=lambda x: x.mass).name


def _of_limits(draft: Draft) -> Iterator[tuple[str, float, str]]:
    slides = {joint.name: joint.slides for joint in draft.urdf.joints}
    for joint in draft.joints.measured:
        limit = joint.limit
        unknown = limit.grade == 'ask' and LIMITS in draft.open
        if limit.value is None or unknown or limit.grade == CERTAIN or joint.passive:
            continue
        unit = 'n' if slides[joint.name] else 'nm'
        yield f'{joint.name}.limit_{unit}', MASS * limit.value, "+/-10 %: only the URDF's word"


def _of_contacts(draft: Draft) -> Iterator[tuple[str, float, str]]:
    if draft.contacts.points and not draft.open & {CONTACTS, TILT}:
        held = {name for name, _ in draft.joints.held}
        far = max((far for name, far in draft.contacts.swivels if name in held), default=0.0)
        why = '+/-5 mm: treads, tracks and feet give way'
        if far > POINT:
            why = f'+/-{1e3 * far:.0f} mm: casters swivel, and no message tells how'
        yield 'contacts.x_m', max(far, POINT), why
        yield 'contacts.y_m', max(far, POINT), 'the same'


def _of_imu(draft: Draft) -> Iterator[tuple[str, float, str]]:
    if draft.mounting.topic.value and draft.mounting.rotation.value is not None:
        yield 'imu.roll_deg', MOUNTING, '+/-1 deg: screwed on by hand'
        yield 'imu.pitch_deg', MOUNTING, 'the same'
