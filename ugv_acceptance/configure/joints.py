"""Which joints messages tell, how far their limits can be trusted, and where others are held."""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.configure.draft import ASK, CERTAIN, CHECK, Derived, DerivedJoint, Joints
from ugv_acceptance.configure.evidence import Evidence, SeenJoint
from ugv_acceptance.configure.names import Matched, match_names
from ugv_acceptance.configure.seen_joints import NEVER_RESTS
from ugv_acceptance.evaluation.inputs.joint_names import names_words
from ugv_acceptance.model.robot import Joint

# Words in the names of joints that no motor holds, and what such a joint is called.
_PASSIVE = {
    'caster': 'caster',
    'castor': 'caster',
    'suspension': 'suspension',
    'shock': 'suspension',
}
# A centre of gravity so close to its joint's axis (m) is balanced.
_BALANCED = 0.005
# A URDF's effort limit from here on (N m, N) is a placeholder; so is one value on so many joints.
_PLACEHOLDER, _SEVERAL = 1000.0, 3
# A joint that stands further outside its limits (rad, m) is told in another unit, or otherwise.
_OUTSIDE = 0.1
# The name of the topic where nothing was seen.
_USUAL = 'joint_states'


@dataclass(frozen=True, slots=True)
class _Known:
    """The movable joints of a URDF that follow no other, and what was seen of them by name.

    `spinning` are the names of wheels, `assumed` says that all are taken as told.
    """

    joints: tuple[Joint, ...]
    matched: Matched
    told: dict[str, SeenJoint]
    spinning: frozenset[str]
    assumed: bool

    @property
    def measured(self) -> list[Joint]:
        return [j for j in self.joints if j.name in self.told or self.assumed]

    @property
    def untold(self) -> list[Joint]:
        return [j for j in self.joints if j.name not in self.told and not self.assumed]


def derive_joints(urdf: Urdf, evidence: Evidence | None) -> Joints:
    """Return the measured joints with their limits, and where the others are held.

    Without joint states all joints are taken as told under their own names, but of a robot that was
    seen and has nothing but wheels: these are held, since their angles change nothing.
    """
    known = _known(urdf, evidence)
    same = _one_value([j for j in known.measured if j.name not in known.spinning])
    affix = known.matched.affix
    return Joints(
        tuple(
            DerivedJoint(
                joint.name,
                known.matched.told.get(joint.name, joint.name),
                _limit(joint, known, same),
                passive=bool(_passive(joint)),
            )
            for joint in known.measured
        ),
        tuple((joint.name, _held(joint, known)) for joint in known.untold),
        _topic(known, evidence),
        affix.text if affix is not None and affix.front and affix.added else '',
        tuple(_remarks(urdf, known, evidence)),
        _question(known, evidence),
    )


def rest_posture(urdf: Urdf, evidence: Evidence | None) -> dict[str, Derived[float]]:
    """Return where each movable joint (rad, m) stands when the robot rests; mimics left out.

    As messages tell it; else 0, or the middle of its range where that leaves 0 out.
    """
    known = _known(urdf, evidence)
    found = {}
    for joint in known.joints:
        told = known.told.get(joint.name)
        odd = '' if told is None else _odd(joint, told, known)
        if told is None or odd or evidence is None or joint.name in known.spinning:
            held = _held(joint, known)
            found[joint.name] = Derived(held.value, ASK if odd else held.grade, odd or held.source)
            continue
        moves = any(doubt.endswith(NEVER_RESTS) for doubt in evidence.doubts)
        at = math.remainder(told.at_rest, math.tau) if joint.kind == 'continuous' else told.at_rest
        source = f'{"median" if moves else "at rest"} in {evidence.place}'
        found[joint.name] = Derived(at, CHECK if moves else CERTAIN, source)
    return found


def _known(urdf: Urdf, evidence: Evidence | None) -> _Known:
    follow = {mimic.joint for mimic in urdf.mimics}
    joints = tuple(j for j in urdf.joints if j.kind != 'fixed' and j.name not in follow)
    seen = evidence.joints if evidence is not None else ()
    matched = match_names([joint.name for joint in joints], [joint.topic_name for joint in seen])
    by_topic = {joint.topic_name: joint for joint in seen}
    told = {name: by_topic[other] for name, other in matched.told.items()}
    spinning = frozenset(joint.name for joint in joints if _spins(urdf, joint))
    wheels = evidence is not None and len(spinning) == len(joints)
    return _Known(joints, matched, told, spinning, assumed=not seen and not wheels)


def _spins(urdf: Urdf, joint: Joint) -> bool:
    """Return whether a joint turns a wheel: without end, balanced, and carrying no other joint."""
    if joint.kind != 'continuous':
        return False
    links = [joint.child]
    for name in links:
        on = [other for other in urdf.joints if other.parent == name]
        if any(other.kind != 'fixed' for other in on):
            return False
        links += [other.child for other in on]
    link = next(link for link in urdf.links if link.name == joint.child)
    along = sum(c * a for c, a in zip(link.cog, joint.axis, strict=True))
    off = [c - along * a for c, a in zip(link.cog, joint.axis, strict=True)]
    return link.mass == 0.0 or math.hypot(*off) <= _BALANCED


def _passive(joint: Joint) -> str:
    """Return what a joint is called that no motor holds, by its name; '' for others."""
    return next((kind for word, kind in _PASSIVE.items() if word in joint.name.casefold()), '')


def _held(joint: Joint, known: _Known) -> Derived[float]:
    """Return where a joint is held of which nothing is told."""
    if joint.name in known.spinning:
        return Derived(0.0, CERTAIN, 'a balanced wheel: its angle changes nothing')
    if joint.lower <= 0.0 <= joint.upper:
        return Derived(0.0, CHECK, 'in no message: its zero position')
    return Derived(
        0.5 * (joint.lower + joint.upper), CHECK, 'in no message: the middle of its range'
    )


def _one_value(joints: Sequence[Joint]) -> float | None:
    """Return the effort limit that all joints have in common, None if they have several or few."""
    efforts = {joint.effort for joint in joints}
    return efforts.pop() if len(efforts) == 1 and len(joints) >= _SEVERAL else None


def _limit(joint: Joint, known: _Known, same: float | None) -> Derived[float]:
    """Return the limit of a joint as the URDF gives it, with how far that can be trusted."""
    says = f'the URDF says {joint.effort:g} {joint.units.effort}'
    if _passive(joint):
        return Derived(None, CERTAIN, 'passive: no motor')
    if joint.name in known.spinning:
        return Derived(None, CERTAIN, 'a wheel: its torque is not judged')
    if math.isinf(joint.effort):
        return Derived(None, ASK, 'the URDF gives no effort limit, or 0')
    if joint.effort >= _PLACEHOLDER:
        return Derived(joint.effort, ASK, f'{says}: probably a placeholder')
    if joint.effort == same:
        return Derived(joint.effort, ASK, f'{says} for every joint: probably a placeholder')
    return Derived(joint.effort, CHECK, says)


def _topic(known: _Known, evidence: Evidence | None) -> Derived[str]:
    if evidence is None:
        return Derived(_USUAL, CHECK, 'the usual name')
    if evidence.joint_states is None:
        if not known.assumed:
            return Derived(None, CHECK, f'no joint states in {evidence.place}: nothing but wheels')
        return Derived(_USUAL, ASK, f'no joint states in {evidence.place}: the usual name')
    name = evidence.joint_states.lstrip('/')
    if evidence.rivals:
        others = ', '.join(evidence.rivals)
        return Derived(name, ASK, f'in {evidence.place}; {others} fits as well')
    if not known.told:
        return Derived(name, ASK, f'in {evidence.place}, but it has no joint of the URDF')
    return Derived(name, CERTAIN, f'in {evidence.place}')


def _remarks(urdf: Urdf, known: _Known, evidence: Evidence | None) -> Iterator[str]:
    for mimic in urdf.mimics:
        yield f'{mimic.joint} follows {mimic.follows}, as the URDF says'
    if known.assumed and known.joints:
        yield from _assumed(known)
    if evidence is None or not evidence.joints:
        return
    if known.told:
        how = f' with {known.matched.affix.words}' if known.matched.affix else ''
        number = f'{len(known.told)} of {len(known.joints)}'
        yield f'{number} joints of the URDF are in the messages{how}'
    for name in known.matched.spelt:
        yield f'{name} is called {known.matched.told[name]} in the messages'
    yield from _untold(known)
    used = {*known.matched.told.values(), *(mimic.joint for mimic in urdf.mimics)}
    foreign = [j.topic_name for j in evidence.joints if j.topic_name not in used]
    if foreign:
        names = names_words(foreign)
        yield f'{evidence.joint_states} has names that the URDF does not have: {names}'
    for joint in known.joints:
        if joint.name in known.told and (odd := _odd(joint, known.told[joint.name], known)):
            yield f'{joint.name} {odd}'


def _assumed(known: _Known) -> Iterator[str]:
    yield f'no joint states were seen: all {len(known.joints)} joints are assumed to be published'
    passive = [joint.name for joint in known.joints if _passive(joint)]
    if passive:
        listed = names_words(passive)
        yield f'passive joints are often not published; hold those that are not: {listed}'


def _untold(known: _Known) -> Iterator[str]:
    """Yield in one line which joints nobody tells, and where they are held."""
    if not known.untold:
        return
    wheel = dict.fromkeys(known.spinning, 'wheel')
    kinds = Counter(_passive(j) or wheel.get(j.name, '') for j in known.untold)
    parts = [f'{n} {kind} joint{"s" if n > 1 else ""}' for kind, n in kinds.items() if kind]
    named = [joint.name for joint in known.untold if not _passive(joint)]
    named = [name for name in named if name not in known.spinning]
    parts += [names_words(named)] if named else []
    at = {_held(joint, known).value: None for joint in known.untold}
    where = '0' if list(at) == [0.0] else '0, or the middle of the range'
    verb = 'is' if len(known.untold) == 1 else 'are'
    yield f'{" and ".join(parts)} {verb} in no message: held at {where}'


def _odd(joint: Joint, told: SeenJoint, known: _Known) -> str:
    """Return what is odd with where a joint is said to stand, '' if nothing is."""
    if joint.name in known.spinning:
        return ''
    free = math.isinf(joint.lower) and not joint.slides
    lower, upper = (-math.tau, math.tau) if free else (joint.lower, joint.upper)
    at = told.at_rest
    if lower - _OUTSIDE <= at <= upper + _OUTSIDE:
        return ''
    turns = free and told.highest - told.lowest > math.tau
    if turns and joint.kind == 'continuous':
        return ''
    odd = f'is said to stand at {at:.4g} {joint.units.position}, outside of '
    odd += f'{lower:.4g} to {upper:.4g}'
    if not joint.slides and lower - _OUTSIDE <= math.radians(at) <= upper + _OUTSIDE:
        odd += ': are degrees sent in place of radians?'
    return odd


def _question(known: _Known, evidence: Evidence | None) -> str:
    """Return what a person has to say before names and topic can be used; '' if nothing."""
    if evidence is None or evidence.joint_states is None:
        return ''
    if evidence.rivals:
        named = ' or '.join((evidence.joint_states, *evidence.rivals))
        return f'Which topic has the joint states of this robot: {named}?'
    if known.matched.rivals:
        words = ' or '.join(affix.words for affix in known.matched.rivals)
        return f'Which names belong to this robot: those with {words}?'
    if known.joints and not known.told:
        listed = names_words([joint.topic_name for joint in evidence.joints])
        return f'Is it this robot? {evidence.joint_states} has none of its joints, but {listed}'
    return ''
