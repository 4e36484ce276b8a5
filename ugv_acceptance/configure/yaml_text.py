"""Writes a draft as the YAML of a robot: each line ends in how sure it is and where it comes from.

Deterministic: the same draft gives the same bytes. What nobody answered is written as `unknown`.
"""

import json
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from ugv_acceptance.configure.draft import (
    ASK,
    CERTAIN,
    CHECK,
    Derived,
    DerivedContact,
    DerivedJoint,
    Draft,
)
from ugv_acceptance.configure.questions import CONTACTS, IMU, LIMITS, LOAD, MASS, TILT
from ugv_acceptance.configure.spread import assumed_of, scaled_link, uncertain_of
from ugv_acceptance.evaluation.criteria.imu_mounting import rpy_of
from ugv_acceptance.model.robot import Vector

# What YAML reads as a text without quotes; not among the words it reads as something else.
_PLAIN = re.compile(r'[A-Za-z_][A-Za-z0-9_./-]*')
_WORDS = frozenset({'y', 'n', 'yes', 'no', 'on', 'off', 'true', 'false', 'null', 'unknown'})
# A tilt of the plane of the contact points (rad) below this is not told.
LEAST_TOLD = math.radians(0.005)
# A source is cut to so many characters.
_LONGEST = 110
HEAD = '# Written by ugv-acceptance init. Each line says how sure its value is, and its source:'
_GRADES = (
    '#   certain: measured, or told by you;  check: look whether it is so;  ask: nobody told it.',
    '# docs/init.md explains it. Check it again: ugv-acceptance init --check THIS_FILE [RECORDING]',
)


def yaml_of(draft: Draft) -> str:
    """Return the YAML text of a draft; `config.load` reads it beside the draft's URDF."""
    parts: list[Iterable[str]] = [
        (HEAD, *_GRADES),
        _robot(draft),
        _topics(draft),
        _joints(draft),
        _held(draft),
        _links(draft),
        _imu(draft),
        _contacts(draft),
        _ground(draft),
        _payload(draft),
        _limits(),
        _assumed(draft),
        _uncertainty(draft),
    ]
    blocks = ['\n'.join(part) for part in parts]
    return '\n\n'.join(block for block in blocks if block) + '\n'


def _line(key: str, value: str, grade: str, source: str, depth: int = 0) -> str:
    """Return one line: indented by `depth`, with its grade and source on it."""
    text = ' '.join(''.join(c if c.isprintable() else ' ' for c in source).split())
    text = text if len(text) <= _LONGEST else f'{text[: _LONGEST - 3]}...'
    gap = ' ' if value else ''
    return f'{"  " * depth}{key}:{gap}{value}  # {grade}: {text or "not said"}'


def text_of(value: str) -> str:
    """Return a text as YAML writes it: in quotes where it would be read as something else."""
    if _PLAIN.fullmatch(value) and value.lower() not in _WORDS:
        return value
    return json.dumps(value)


def number(value: float, digits: int = 5) -> str:
    """Return a number with at most so many decimals, without a negative zero."""
    text = f'{round(value, digits) + 0.0:.{digits}f}'.rstrip('0').rstrip('.')
    return text if text not in {'', '-0'} else '0'


def _vector(values: Vector, digits: int = 5) -> str:
    return '[' + ', '.join(number(value, digits) for value in values) + ']'


def _robot(draft: Draft) -> Iterator[str]:
    yield _line('robot', '', CERTAIN, 'the name is that in the URDF', 0)
    yield _line('name', text_of(draft.name), CERTAIN, 'URDF: robot name', 1)
    yield _line('urdf', text_of(draft.urdf_path), CERTAIN, 'relative to this file')


def _topics(draft: Draft) -> Iterator[str]:
    joints, mounting = draft.joints, draft.mounting
    yield _line('topics', '', *_worst(joints.topic, mounting.topic, source='the names below'))
    listens = draft.joints.measured and joints.topic.value
    if listens:
        name = text_of(str(joints.topic.value))
        yield _line('joint_states', f'{{name: {name}}}', *_said(joints.topic), 1)
    else:
        why = 'no joint is measured, so none is listened to'
        yield _line('joint_states', 'null', CHECK, why, 1)
    if mounting.topic.value:
        frame = f', frame_id: {text_of(mounting.frame)}' if mounting.frame else ''
        value = f'{{name: {text_of(mounting.topic.value)}{frame}}}'
        yield _line('imu', value, *_said(mounting.topic), 1)
    elif IMU in draft.open:
        yield _line('imu', '{name: imu/data}', ASK, mounting.topic.source, 1)
    else:
        yield _line('imu', 'null', *_said(mounting.topic), 1)


def _said(one: Derived[Any]) -> tuple[str, str]:
    return one.grade, one.source


def _worst(*found: Derived[str], source: str) -> tuple[str, str]:
    grades = [one.grade for one in found]
    return next((g for g in (ASK, CHECK) if g in grades), CERTAIN), source


def _joints(draft: Draft) -> Iterator[str]:
    joints = draft.joints
    if not joints.measured:
        yield _line('joints', '{}', CHECK, 'no joint is measured')
        return
    told = 'the movable joints of the URDF that messages tell; sign 1, offset 0'
    yield _line('joints', '', *_worst(joints.topic, source=told))
    for joint in joints.measured:
        yield from _joint(draft, joint)


def _joint(draft: Draft, joint: DerivedJoint) -> Iterator[str]:
    of = next(one for one in draft.urdf.joints if one.name == joint.name)
    yield _line(text_of(joint.name), '', CERTAIN, f'{of.kind}, {of.parent} -> {of.child}', 1)
    topic, limit = draft.joints.topic, joint.limit
    if joint.topic_name != joint.name:
        yield _line('topic_name', text_of(joint.topic_name), *_said(topic), 2)
    for key, one in (('effort_sign', joint.effort_sign), ('effort_scale', joint.effort_scale)):
        if one is not None and one.value is not None:
            yield _line(key, number(one.value, 6), *_said(one), 2)
    if joint.passive:
        why = limit.source or 'no motor turns it'
        yield _line('passive', 'true', limit.grade, why, 2)
        return
    key = 'limit_n' if of.slides else 'limit_nm'
    if limit.grade == ASK and LIMITS in draft.open:
        yield _line(key, 'unknown', ASK, f'{limit.source}; --limit {joint.name}=50', 2)
    else:
        value = 'null' if limit.value is None else number(limit.value, 3)
        yield _line(key, value, *_said(limit), 2)


def _held(draft: Draft) -> Iterator[str]:
    if not draft.joints.held:
        return
    names = {joint.name: joint for joint in draft.urdf.joints}
    grade = _worst(*(Derived('', one.grade, '') for _, one in draft.joints.held), source='')[0]
    yield _line('held', '', grade, 'movable joints that no message tells')
    for name, one in draft.joints.held:
        unit = 'm' if names[name].slides else 'rad'
        yield _line(text_of(name), f'{number(one.value or 0.0)} {unit}', *_said(one), 1)


def _links(draft: Draft) -> Iterator[str]:
    changed = scaled_link(draft)
    if changed is None:
        return
    link, mass, own = changed
    yield _line('links', '', CERTAIN, f'the robot weighs {draft.scales:g} kg on scales')
    source = f'{own:g} kg in the URDF, and the difference to the scales, put on this link'
    yield _line(text_of(link), f'{{mass_kg: {number(mass, 3)}}}', CHECK, source, 1)


def _imu(draft: Draft) -> Iterator[str]:
    mounting = draft.mounting
    turned, grade = mounting.rotation, mounting.rotation.grade
    if mounting.topic.value is None and IMU not in draft.open:
        yield _line('imu', '', CHECK, 'without an IMU tip-over is not checked')
        yield _line('attitude', 'level', CHECK, 'without an IMU: the base is declared level', 1)
        return
    yield _line('imu', '', grade, 'how the sensor sits on the robot')
    if turned.value is None or IMU in draft.open:
        yield _line('mounting', 'unknown', ASK, mounting.question or mounting.topic.source, 1)
        return
    if mounting.frame and (mounting.joints or (draft.evidence is None and turned.grade == CHECK)):
        # Not numbers: they hold for this posture alone, or for a message that nobody has seen.
        yield _line('mounting', 'auto', CHECK, f'by the frame of its messages; {turned.source}', 1)
        return
    degrees = tuple(map(math.degrees, rpy_of(turned.value)))
    yield _line(
        'mounting_rpy_deg', _vector((degrees[0], degrees[1], degrees[2]), 3), *_said(turned), 1
    )
    if mounting.position.value is not None:
        yield _line('position_m', _vector(mounting.position.value), *_said(mounting.position), 1)


def _contacts(draft: Draft) -> Iterator[str]:
    contacts = draft.contacts
    if draft.open & {CONTACTS, TILT}:
        why = contacts.question or f'a plane tilted by {math.degrees(contacts.tilt):.2f} deg'
        yield _line('contacts', 'unknown', ASK, f'{why} (--contacts, --tilt)')
        for point in contacts.points:
            yield f'#  guess: {_point(point, 0)}'
        return
    if not contacts.points:
        yield _line('contacts', '{}', CHECK, 'no points: it stands on nothing, or is bolted down')
        return
    grade = _worst(*(Derived('', p.grade, '') for p in contacts.points), source='')[0]
    source = f'{len(contacts.points)} points'
    if contacts.tilt >= LEAST_TOLD:
        source += f', in a plane {math.degrees(contacts.tilt):.2f} deg off the root link'
    yield _line('contacts', '', grade, source)
    for point in contacts.points:
        yield _point(point, 1)


def _point(point: DerivedContact, depth: int) -> str:
    at = point.contact
    value = f'{{link: {text_of(at.link)}, position_m: {_vector(at.position)}}}'
    return _line(
        text_of(at.name),
        value,
        point.grade,
        point.source if point.on in point.source else f'{point.on}: {point.source}',
        depth,
    )


def _ground(draft: Draft) -> Iterator[str]:
    ground = draft.contacts.ground
    if ground.value is None:
        return
    yield _line('ground', '', CHECK, 'level and firm, as long as nobody says another kind')
    yield _line('height_m', number(ground.value), *_said(ground), 1)


def _payload(draft: Draft) -> Iterator[str]:
    link = draft.payload_link
    if LOAD in draft.open:
        yield _line('payload', '', ASK, link.source)
        yield _line('link', 'unknown', ASK, 'say which with --load-link', 1)
        return
    if link.value is None:
        return
    yield _line('payload', '', CERTAIN, 'no load until the topic payload tells one')
    yield _line('link', text_of(link.value), *_said(link), 1)


def _limits() -> Iterator[str]:
    yield _line('limits', '', CHECK, 'when to warn: the defaults, for you to change')
    yield _line('torque_warn', '0.8', CHECK, 'CAUTION from this share of a limit on', 1)
    yield _line('torque_error', '1', CHECK, 'DANGER at the limit', 1)
    yield _line('tip_warn_deg', '10', CHECK, 'CAUTION below so much tilt left', 1)
    yield _line('tip_error_deg', '5', CHECK, 'DANGER below so much tilt left', 1)


def _assumed(draft: Draft) -> Iterator[str]:
    found = assumed_of(draft)
    if not found:
        yield _line('assumed', '{}', CERTAIN, 'nothing')
        return
    yield _line('assumed', '', CHECK, 'nobody measured these; every text and report says so')
    for name, why in found:
        yield _line(text_of(name), json.dumps(why), CHECK, 'told in the first lines', 1)


def _uncertainty(draft: Draft) -> Iterator[str]:
    found = uncertain_of(draft)
    yield _line('uncertainty', '' if found else '{}', CHECK, 'the +/- of the numbers above')
    for name, value, why in found:
        yield _line(text_of(name), number(value, 4), CHECK, why, 1)


def open_words(draft: Draft) -> Sequence[str]:
    """Return what is written as `unknown`, and what nobody weighed, for people."""
    words = {
        MASS: 'the mass is that of the URDF',
        CONTACTS: 'contacts: unknown',
        TILT: 'contacts: unknown',
        IMU: 'imu.mounting: unknown',
        LIMITS: 'limits of joints: unknown',
        LOAD: 'payload.link: unknown',
    }
    return list(dict.fromkeys(word for key, word in words.items() if key in draft.open))
