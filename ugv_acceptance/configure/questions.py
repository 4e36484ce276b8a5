"""The at most five things that no file tells: asked on a terminal, options in a script."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from fnmatch import fnmatchcase

from ugv_acceptance import BadConfig
from ugv_acceptance.config.units import cut, quantity
from ugv_acceptance.config.urdf import rotation_from_rpy
from ugv_acceptance.configure.draft import (
    ASK,
    CERTAIN,
    CHECK,
    Contacts,
    Derived,
    DerivedContact,
    DerivedJoint,
    Draft,
)
from ugv_acceptance.model.robot import Vector

MASS, CONTACTS, TILT, IMU = 'mass', 'contacts', 'tilt', 'mounting'
LIMITS, LOAD = 'limit', 'load-link'
YES, NO, REAL, NOT_REAL, URDF, NONE = 'yes', 'no', 'real', 'not-real', 'urdf', 'none'
MOUNTINGS = '--mounting 180deg,-90deg,0 (roll, pitch, yaw; or yes: as found; or none: no IMU)'
NO_TILT = 'tip-over is not checked'
# Tilt (rad) of the plane of the contact points from which a person has to say whether it is real.
LEAST_TILT = math.radians(0.2)
# Scales may differ so much from the URDF, as a share of it, before the unit is doubted.
FACTOR = 3.0
SAID = 'you said so'
# Derives the contact points anew from these links alone.
Anew = Callable[[Sequence[str]], Contacts]


@dataclass(frozen=True, slots=True)
class Question:
    """A question: the option that answers it, its text, what is guessed, and what hangs on it."""

    key: str
    text: str
    option: str
    guess: str
    otherwise: str


@dataclass(frozen=True, slots=True)
class Answers:
    """Answers as texts, as on the command line; None: not answered. `limits` are JOINT=LIMIT."""

    mass: str | None = None
    contacts: str | None = None
    tilt: str | None = None
    mounting: str | None = None
    limits: tuple[str, ...] = ()
    load_link: str | None = None


def questions_of(draft: Draft) -> tuple[Question, ...]:
    """Return the questions whose answers the draft does not hold, in the order of asking."""
    stands = _contacts(draft) or _tilt(draft)
    asked = (_mass(draft), stands, _mounting(draft), _limits(draft), _load(draft))
    return tuple(question for question in asked if question is not None)


def _mass(draft: Draft) -> Question | None:
    if draft.mass.grade == CERTAIN:
        return None
    total = draft.mass.value or 0.0
    text = (
        f'What does the robot weigh on scales, without a load? Its URDF adds up to {total:.2f} kg'
    )
    return Question(
        MASS, text, '--mass 68kg (or urdf)', URDF, 'every margin hangs on the masses of the URDF'
    )


def _contacts(draft: Draft) -> Question | None:
    if not draft.contacts.question:
        return None
    text = (
        f'Do these touch the ground: {_list(carriers(draft.contacts))}? {draft.contacts.question}'
    )
    guess = YES if len(draft.contacts.points) >= 3 else ''
    option = '--contacts yes (or no; or LINK,LINK,...; or none: it is bolted down, and level)'
    return Question(CONTACTS, text, option, guess, NO_TILT)


def _tilt(draft: Draft) -> Question | None:
    contacts = draft.contacts
    if contacts.tilt < LEAST_TILT or _is_said(contacts) or len(contacts.points) < 3:
        return None
    degrees = math.degrees(contacts.tilt)
    text = (
        f'The contact points lie in a plane that is {degrees:.2f} deg off the '
        f'{draft_root(draft)} axes: does the robot really stand tilted like that?'
    )
    return Question(TILT, text, '--tilt real (or not-real)', NOT_REAL, 'tip-over is not checked')


def _mounting(draft: Draft) -> Question | None:
    mounting = draft.mounting
    if mounting.topic.value is None and mounting.topic.grade == ASK:
        guess = NONE if not draft.contacts.points else ''
        text = f'Has the robot an IMU, and how is it mounted? {mounting.topic.source}'
        return Question(IMU, text, MOUNTINGS, guess, NO_TILT)
    if not mounting.question:
        return None
    return Question(IMU, mounting.question, MOUNTINGS, '', NO_TILT)


def _limits(draft: Draft) -> Question | None:
    doubtful = [joint for joint in draft.joints.measured if joint.limit.grade == ASK]
    if not doubtful:
        return None
    units = {joint.name: joint.units.effort for joint in draft.urdf.joints}
    said = _list([f'{j.name} {_limit_text(j)} {units[j.name]}' for j in doubtful])
    text = f'What torque can these joints hold? The URDF is in doubt: {said}'
    option = f'--limit {doubtful[0].name}=50 (or =none, or =urdf; a pattern such as "*=urdf")'
    return Question(LIMITS, text, option, '', 'their torque is not judged')


def _limit_text(joint: DerivedJoint) -> str:
    return 'no limit' if joint.limit.value is None else f'{joint.limit.value:g}'


def _load(draft: Draft) -> Question | None:
    if draft.payload_link.grade != ASK:
        return None
    text = f'Which link carries the load? {draft.payload_link.source}'
    guess = draft.payload_link.value or NONE
    return Question(LOAD, text, '--load-link LINK (or none)', guess, 'a load is not counted')


def draft_root(draft: Draft) -> str:
    """Return the name of the root link: its axes are the robot's."""
    children = {joint.child for joint in draft.urdf.joints}
    return next(link.name for link in draft.urdf.links if link.name not in children)


def carriers(contacts: Contacts) -> list[str]:
    """Return what carries, for people, each once."""
    return list(dict.fromkeys(point.on for point in contacts.points))


def _is_said(contacts: Contacts) -> bool:
    return any(SAID in point.source for point in contacts.points) and not contacts.question


def _list(words: Sequence[str]) -> str:
    return (
        ', '.join(words[:8]) + (f' and {len(words) - 8} more' if len(words) > 8 else '') or 'none'
    )


def answered(draft: Draft, answers: Answers, anew: Anew) -> Draft:
    """Return the draft with the answers in it; BadConfig for one that cannot be.

    Whatever is asked and not answered stands in `open`.
    """
    takes = (_with_mass, _with_contacts, _with_tilt, _with_mounting, _with_limits, _with_load)
    for take in takes:
        draft = take(draft, answers, anew)
    return replace(draft, open=frozenset(question.key for question in questions_of(draft)))


def _with_mass(draft: Draft, answers: Answers, _: Anew) -> Draft:
    if answers.mass is None:
        return draft
    own = draft.mass.value or 0.0
    if answers.mass == URDF:
        return replace(draft, mass=Derived(own, CERTAIN, f'{SAID}: as in the URDF'))
    mass = quantity(answers.mass, 'mass', '--mass')
    if not own / FACTOR < mass < own * FACTOR:
        raise BadConfig(
            f'--mass: expected kg near the {own:.2f} kg of the URDF, got {mass:g} kg: is the unit '
            'right, and is this the URDF of this robot?'
        )
    return replace(draft, scales=mass, mass=Derived(mass, CERTAIN, f'{SAID}: on scales'))


def _with_contacts(draft: Draft, answers: Answers, anew: Anew) -> Draft:
    said, contacts = answers.contacts, draft.contacts
    if said is None:
        return draft
    if said == NO:
        return replace(draft, contacts=_refused(contacts))
    if said == NONE:
        return _bolted(draft, answers)
    if said != YES:
        links = [name.strip() for name in said.split(',') if name.strip()]
        _check_links(draft, links, '--contacts')
        contacts = anew(links)
    if len(contacts.points) < 3:
        raise BadConfig(
            f'--contacts {cut(said)}: expected links that give at least three points, got '
            f'{len(contacts.points)}: name the links that touch the ground'
        )
    points = tuple(_said(point) for point in contacts.points)
    return replace(draft, contacts=replace(contacts, points=points, question=''))


def _bolted(draft: Draft, answers: Answers) -> Draft:
    """Return the draft of a robot that stands on nothing: it cannot tip, and needs no IMU."""
    if answers.mounting not in {None, NONE}:
        raise BadConfig(
            f'--contacts {NONE}: expected no --mounting beside it: what is bolted down and level '
            'is judged without an IMU'
        )
    why = f'{SAID}: it is bolted down, and level'
    none: Derived[str] = Derived(None, CERTAIN, why)
    contacts = replace(draft.contacts, points=(), question='', ground=Derived(None, CERTAIN, why))
    return replace(
        draft, contacts=contacts, mounting=replace(draft.mounting, topic=none, question='')
    )


def _refused(contacts: Contacts) -> Contacts:
    """Return contacts of which somebody said that they are wrong: which are right is open."""
    return replace(contacts, points=(), question='You said that the links found do not.')


def _said(point: DerivedContact) -> DerivedContact:
    return replace(point, grade=CERTAIN, source=f'{SAID}; {point.source}')


def _check_links(draft: Draft, links: Sequence[str], option: str) -> None:
    known = [link.name for link in draft.urdf.links]
    for name in links:
        if name not in known:
            near = get_close_matches(name, known, 1, 0.4)
            hint = f'; did you mean {near[0]}?' if near else ''
            raise BadConfig(f'{option}: the URDF has no link {cut(name)}{hint}')


def _with_tilt(draft: Draft, answers: Answers, _: Anew) -> Draft:
    contacts = draft.contacts
    asked = _tilt(draft) is not None or 'this tilt real' in contacts.question
    if answers.tilt not in {None, REAL, NOT_REAL}:
        raise BadConfig(f'--tilt: expected {REAL} or {NOT_REAL}, got {cut(str(answers.tilt))}')
    if answers.tilt is None or not asked:
        return draft
    if answers.tilt == NOT_REAL:
        # The points are wrong then, and nobody knows which: what hangs on them is not checked.
        words = 'You said that the tilt of their plane is not real: which of them is wrong?'
        return replace(draft, contacts=replace(contacts, question=words))
    points = tuple(_said(point) for point in contacts.points)
    return replace(draft, contacts=replace(contacts, points=points, question=''))


def _with_mounting(draft: Draft, answers: Answers, _: Anew) -> Draft:
    said, mounting = answers.mounting, draft.mounting
    if said is None:
        return draft
    if said == NONE:
        none: Derived[str] = Derived(None, CERTAIN, f'{SAID}: it has no IMU')
        return replace(draft, mounting=replace(mounting, topic=none, question=''))
    topic = mounting.topic
    if topic.value is None:
        topic = Derived('imu/data', CHECK, 'the usual name: none was seen')
    if said == YES:
        if mounting.rotation.value is None:
            raise BadConfig(f'--mounting {YES}: there is no guess: say {MOUNTINGS}')
        rotation = Derived(mounting.rotation.value, CERTAIN, f'{SAID}; {mounting.rotation.source}')
    else:
        rotation = Derived(rotation_from_rpy(_angles(said)), CERTAIN, SAID)
    return replace(draft, mounting=replace(mounting, topic=topic, rotation=rotation, question=''))


def _angles(said: str) -> Vector:
    parts = said.split(',')
    if len(parts) != 3:
        raise BadConfig(f'--mounting: expected roll,pitch,yaw as in {MOUNTINGS}, got {cut(said)}')
    roll, pitch, yaw = (quantity(part, 'angle', f'--mounting {said}') for part in parts)
    return (roll, pitch, yaw)


def _with_limits(draft: Draft, answers: Answers, _: Anew) -> Draft:
    found = {joint.name: joint for joint in draft.joints.measured}
    for said in answers.limits:
        pattern, equals, value = said.rpartition('=')
        names = [name for name in found if fnmatchcase(name, pattern)]
        if not equals or not names:
            near = get_close_matches(pattern, found, 1, 0.4)
            hint = f'; did you mean {near[0]}?' if near else f'; it has {_list(list(found))}'
            raise BadConfig(
                f'--limit: expected JOINT=50 of a measured joint, got {cut(said)}{hint}'
            )
        for name in names:
            if pattern == name or (
                found[name].limit.grade == ASK and (value != URDF or _has_effort(draft, name))
            ):
                found[name] = replace(found[name], limit=_limit(draft, found[name], value))
    joints = replace(draft.joints, measured=tuple(found.values()))
    return replace(draft, joints=joints)


def _has_effort(draft: Draft, name: str) -> bool:
    return any(one.name == name and math.isfinite(one.effort) for one in draft.urdf.joints)


def _limit(draft: Draft, joint: DerivedJoint, value: str) -> Derived[float]:
    of = next(one for one in draft.urdf.joints if one.name == joint.name)
    if value == NONE:
        return Derived(None, CERTAIN, f'{SAID}: not to be judged')
    if value == URDF:
        if not math.isfinite(of.effort):
            raise BadConfig(f'--limit {joint.name}=urdf: the URDF has no effort of this joint')
        return Derived(of.effort, CHECK, f'{SAID}: as in the URDF')
    limit = quantity(value, 'force' if of.slides else 'torque', f'--limit {joint.name}')
    if limit <= 0.0:
        raise BadConfig(f'--limit {joint.name}: expected a limit above 0, got {limit:g}')
    return Derived(limit, CERTAIN, SAID)


def _with_load(draft: Draft, answers: Answers, _: Anew) -> Draft:
    said = answers.load_link
    if said is None:
        return draft
    if said == NONE:
        return replace(draft, payload_link=Derived(None, CERTAIN, f'{SAID}: it carries none'))
    _check_links(draft, [said], '--load-link')
    return replace(draft, payload_link=Derived(said, CERTAIN, SAID))


def ask(question: Question, say: Callable[[str, str], str]) -> Answers:
    """Ask a question by `say` (text, guess -> answer); no answer is the guess."""
    form = question.option.partition(' ')[2]
    text = say(f'{question.text}\n  {form}', question.guess).strip() or question.guess
    if not text:
        return Answers()
    if question.key == LIMITS:
        return Answers(limits=tuple(part.strip() for part in text.split(',') if part.strip()))
    fields = {
        MASS: Answers(mass=text),
        CONTACTS: Answers(contacts=text),
        TILT: Answers(tilt=text),
        IMU: Answers(mounting=text),
        LOAD: Answers(load_link=text),
    }
    return fields[question.key]
