"""How the IMU is mounted: what URDF and /tf_static say of its frame, held against gravity at rest.

Drivers send the axes of the sensor's link, or the robot's whatever the URDF says, or their own.
Gravity tells which of them it may be; how far they are turned about the vertical it cannot tell.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import permutations, product

from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.configure.draft import ASK, CERTAIN, CHECK, Derived, Mounting
from ugv_acceptance.configure.evidence import Evidence, SeenImu
from ugv_acceptance.configure.imu_frames import Placed, placed, rpy_of, turn_between
from ugv_acceptance.configure.imu_gravity import Up, up_of
from ugv_acceptance.evaluation.inputs.imu_placing import NO_GRAVITY
from ugv_acceptance.model.attitude import angle_between
from ugv_acceptance.model.expressions import rotate
from ugv_acceptance.model.robot import IDENTITY, Matrix, Vector
from ugv_acceptance.model.tree import plain

# A mounting fits if gravity at rest is off the vertical by at most FITS; from LEANS on it is no
# slope that the robot stands on. Two that differ by less than SAME are one. A lean above TOLD is
# told. All in rad.
FITS, SAME, LEANS, TOLD = (math.radians(d) for d in (10.0, 2.0, 45.0, 3.0))
_UPWARDS: Vector = (0.0, 0.0, 1.0)
_USUAL = 'imu/data'
_YAW = 'gravity does not show its yaw'
_AXES = ('x', 'y', 'z')


@dataclass(frozen=True, slots=True)
class _Decided:
    """How the IMU is mounted, what has to be asked ('' if nothing), and what is to be told."""

    rotation: Derived[Matrix]
    question: str = ''
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A mounting with what says so, and by how much (rad) it leaves gravity off the vertical."""

    rotation: Matrix
    says: str
    lean: float


def derive_mounting(
    urdf: Urdf, evidence: Evidence | None, posture: Mapping[str, float]
) -> Mounting:
    """Return the IMU's topic, and how it is mounted on the root link, verified by gravity at rest.

    `posture` is where the joints stand (rad, m), which matters to an IMU on a moving link.
    """
    if evidence is None:
        return _unseen(urdf, Derived(_USUAL, CHECK, 'the usual name'), posture)
    if not evidence.imus:
        return _unseen(urdf, Derived(None, ASK, f'no IMU was seen in {evidence.place}'), posture)
    imu, topic = _chosen(urdf, evidence, posture)
    place = placed(urdf, imu.frame, posture, evidence.transforms)
    up = up_of(imu)
    others = [f'{i.topic} ({i.frame})' for i in evidence.imus if i is not imu]
    remarks = [f'other IMUs: {", ".join(others)}'] if others else []
    remarks += [*place.remarks, *up.remarks]
    found = _decided(place, up, evidence)
    return Mounting(
        topic,
        imu.frame,
        place.position,
        found.rotation,
        found.question,
        (*remarks, *found.remarks),
        place.joints,
    )


def _unseen(urdf: Urdf, topic: Derived[str], posture: Mapping[str, float]) -> Mounting:
    """Return what the URDF alone says."""
    place = placed(urdf, None, posture, ())
    if place.rotation is None:
        rotation = Derived(IDENTITY, ASK, 'the URDF has no link of an IMU: assumed not turned')
        question = 'How is the IMU mounted? The URDF has no link of it, and no message was seen.'
        return Mounting(topic, '', place.position, rotation, question, place.remarks)
    grade = CHECK if topic.value else ASK
    rotation = Derived(place.rotation, grade, f'{place.source}; no message')
    question = '' if topic.value else f'On which topic is the IMU? So far {topic.source}.'
    remarks, joints = place.remarks, place.joints
    return Mounting(topic, place.link, place.position, rotation, question, remarks, joints)


def _chosen(
    urdf: Urdf, evidence: Evidence, posture: Mapping[str, float]
) -> tuple[SeenImu, Derived[str]]:
    """Return the IMU to use: beside the joint states, on a known link that nothing moves, whole."""
    beside = (evidence.joint_states or '').rpartition('/')[0]

    def worth(imu: SeenImu) -> tuple[bool, ...]:
        place = placed(urdf, imu.frame, posture, evidence.transforms)
        force = imu.specific_force
        return (
            bool(beside) and imu.topic.startswith(f'{beside}/'),
            place.sure and not place.joints,
            'camera' not in imu.topic and 'camera' not in imu.frame,
            imu.orientation is not None,
            force is not None and math.hypot(*force) >= NO_GRAVITY,
            'raw' not in imu.topic,
        )

    imus = evidence.imus
    values = [worth(imu) for imu in imus]
    best = [imu for imu, value in zip(imus, values, strict=True) if value == max(values)]
    name, where = best[0].topic.lstrip('/'), f'in {evidence.place}'
    if len(best) > 1 or (evidence.rivals and len(imus) > 1):
        return best[0], Derived(name, ASK, f'{where}, which has {len(imus)} IMUs')
    if len(imus) > 1:
        return best[0], Derived(name, CHECK, f'{where}, the most complete of {len(imus)} IMUs')
    return best[0], Derived(name, CERTAIN, where)


def _decided(place: Placed, up: Up, evidence: Evidence) -> _Decided:
    """Return the mounting that gravity at rest leaves, as far as it leaves one."""
    where = f'gravity at rest in {evidence.place}'
    rotation = IDENTITY if place.rotation is None else place.rotation
    if not up.directions:
        source = f'{place.source or "not turned"}; no gravity in {evidence.place}'
        question = 'How is the IMU mounted? Its messages do not show gravity at rest.'
        return _Decided(Derived(rotation, ASK, source), question)
    if up.apart:
        return _torn(place, up, where)
    direction = up.directions[0]
    found = list(_candidates(place, direction))
    fit = [candidate for candidate in found if candidate.lean <= FITS]
    if not fit:
        return _none_fits(found, direction, where)
    best = fit[0]
    remarks = []
    if best.lean > TOLD:
        remarks.append(
            f'gravity at rest is {math.degrees(best.lean):.1f} deg off the vertical: the ground '
            'slopes, or the mounting is off by that much'
        )
    if len(fit) > 1:
        return _several_fit(fit, where, remarks)
    source = f'{best.says}; {where} agrees, but does not show yaw'
    if best is not found[0]:
        question = (
            f'How is the IMU mounted? Gravity at rest contradicts {found[0].says} and fits '
            f'{best.says}, but {_YAW}.'
        )
        return _Decided(Derived(best.rotation, ASK, source), question, tuple(remarks))
    if best.rotation != IDENTITY:
        remarks.append(f'{_YAW}: that is as {best.says} has it')
    grade = CERTAIN if place.sure and not place.joints else CHECK
    return _Decided(Derived(best.rotation, grade, source), '', tuple(remarks))


def _candidates(place: Placed, up: Vector) -> Iterator[_Candidate]:
    """Yield the mountings that something says: of its frame first, then the robot's own axes."""
    said = [(place.rotation, place.source), (place.other, '/tf_static')]
    said.append((IDENTITY, "the robot's own axes"))
    before: list[Matrix] = []
    for rotation, says in said:
        if rotation is None or any(turn_between(rotation, b) < SAME for b in before):
            continue
        before.append(rotation)
        yield _Candidate(rotation, says, _lean(rotation, up))


def _lean(rotation: Matrix, up: Vector) -> float:
    """Return how far (rad) `up` (sensor axes) is from the root link's z axis."""
    return float(angle_between(plain(rotate(rotation, up)), _UPWARDS))


def _several_fit(fit: list[_Candidate], where: str, remarks: list[str]) -> _Decided:
    """Return the first of several mountings between which gravity cannot decide."""
    best = fit[0]
    if all(turn_between(best.rotation, other.rotation) <= FITS for other in fit):
        source = f'{best.says}; {where} agrees, but does not show yaw'
        return _Decided(Derived(best.rotation, CHECK, source), '', tuple(remarks))
    either = ' or '.join(f'{c.says} ({rpy_words(c.rotation)})' for c in fit)
    question = (
        f'In which axes are the messages of the IMU: {either}? Both fit gravity at rest, but '
        f'{_YAW}.'
    )
    source = f'{best.says}; {where} fits {fit[1].says} as well'
    return _Decided(Derived(best.rotation, ASK, source), question, tuple(remarks))


def _none_fits(found: list[_Candidate], up: Vector, where: str) -> _Decided:
    """Return the likeliest mounting where gravity denies all that something says."""
    near = min(found, key=lambda candidate: candidate.lean)
    if near.lean < LEANS:
        lean = f'{math.degrees(near.lean):.0f} deg'
        question = (
            f'Is this tilt real? At rest the robot leans by {lean} if the IMU is mounted as '
            f'{near.says} says ({rpy_words(near.rotation)}).'
        )
        source = f'{near.says}; {where} is {lean} off the vertical'
        return _Decided(Derived(near.rotation, ASK, source), question)
    axis = max(range(3), key=lambda k: abs(up[k]))
    points = f'its {_AXES[axis]} axis points {"up" if up[axis] > 0.0 else "down"}'
    upside = ' (upside down, or NED)' if axis == 2 else ''
    rotation = _quarter_turns(up, found[0].rotation)
    denied = ' and '.join(candidate.says for candidate in found)
    question = (
        f'How is the IMU mounted? At rest {points}{upside}, which contradicts {denied}. '
        f'{rpy_words(rotation)} would fit, but {_YAW}.'
    )
    return _Decided(Derived(rotation, ASK, f'{where}: {points}'), question)


def _torn(place: Placed, up: Up, where: str) -> _Decided:
    """Return a mounting where acceleration and orientation contradict each other at rest."""
    ways = [list(_candidates(place, direction)) for direction in up.directions]
    fit = [c for way in ways for c in way if c.lean <= FITS]
    best = min(fit or ways[0], key=lambda candidate: candidate.lean)
    words = f'acceleration and orientation differ by {math.degrees(up.apart):.0f} deg'
    question = f'How is the IMU mounted, and does it work? At rest its {words}.'
    return _Decided(Derived(best.rotation, ASK, f'{best.says}; {where}: {words}'), question)


def _quarter_turns(up: Vector, near: Matrix) -> Matrix:
    """Return the mounting by right angles that puts `up` upwards, and is nearest to another."""

    def off(rotation: Matrix) -> tuple[float, float]:
        return round(_lean(rotation, up), 3), turn_between(rotation, near)

    return min(_right_angles(), key=off)


def _right_angles() -> Iterator[Matrix]:
    """Yield the 24 rotations by right angles."""
    for order in permutations(range(3)):
        even = order in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
        for signs in product((1.0, -1.0), repeat=3):
            if (signs[0] * signs[1] * signs[2] > 0.0) == even:
                rows = [[0.0, 0.0, 0.0] for _ in range(3)]
                for k, axis in enumerate(order):
                    rows[k][axis] = signs[k]
                a, b, c = (plain(row) for row in rows)
                yield (a, b, c)


def rpy_words(rotation: Matrix) -> str:
    """Return a mounting as the key of a configuration, in degrees."""
    degrees = ', '.join(f'{round(math.degrees(a), 1) + 0.0:g}' for a in rpy_of(rotation))
    return f'imu.mounting_rpy_deg: [{degrees}]'
