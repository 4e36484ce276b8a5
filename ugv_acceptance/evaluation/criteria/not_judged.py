"""What a configuration leaves out of every verdict: joints without limits, absent inputs."""

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np

from ugv_acceptance.evaluation.criteria.criteria import INCONCLUSIVE
from ugv_acceptance.evaluation.criteria.statement import NotChecked, Objection, Statement
from ugv_acceptance.evaluation.inputs.joint_words import held_words
from ugv_acceptance.evaluation.settings import CONTACTS, PAYLOAD_LINK, Settings
from ugv_acceptance.model.clearance import unread_links
from ugv_acceptance.model.mechanics import mechanics_of
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.statics import static_torque

# Random postures, each with gravity along three axes, in which a joint may carry torque.
POSTURES = 40
# A joint carries torque from this share on of the largest found, and this much (N m; N).
SHARE, LEAST = 0.01, 0.01
# From this size on (N m; N) no decimals are written.
TENS = 10.0
# Half the travel (m) of a slide without limits.
HALF_SLIDE = 0.5
# A robot with more joints is not searched: compiling its formulas would take too long.
MOST_JOINTS = 40


def absent_imu(settings: Settings, topic: str | None) -> Statement:
    """Return the objection to a recording without an IMU where the margins need one."""
    if topic is not None or not settings.hears_imu:
        return Statement()
    reason = (
        'the recording has no IMU topic (sensor_msgs/msg/Imu): record the IMU; or, for a robot '
        'without one that stands level, set topics.imu: null and imu.attitude: level'
    )
    return Statement(objections=(Objection('unseen_stretches', INCONCLUSIVE, reason),))


def kept_words(settings: Settings, *, rough: bool = False) -> str:
    """Return what it means that no limit was passed: all margins, or those that are measured.

    Where the ground is not flat (`rough`) no margin tells that the robot is far from tipping.
    """
    if not settings.judges_tilt:
        return 'all torque margins kept, tip-over not checked'
    if rough:
        return 'the robot has not begun to tip; how far it is from that is not known on this ground'
    if not settings.hears_joints:
        return 'all tip-over margins kept, no torque checked'
    return 'all margins kept'


def unknown_words(settings: Settings) -> str:
    """Return of what the configuration says `unknown`, as one sentence; '' if of nothing."""
    if not settings.unknown:
        return ''
    return f'the configuration does not know {", ".join(settings.unknown)}: no OK without it'


def left_open(settings: Settings) -> Statement:
    """Return what hangs on values the configuration does not know: not checked, and no PASS."""
    found = [(_safeguard_of(key), _hangs_on(key)) for key in settings.unknown]
    objections = (
        Objection(safeguard, INCONCLUSIVE, f'{one.what} not checked: {one.why}')
        for safeguard, one in found
    )
    return Statement(objections=tuple(objections), not_checked=tuple(one for _, one in found))


def _safeguard_of(key: str) -> str:
    return {CONTACTS: 'tipping', PAYLOAD_LINK: 'payload'}.get(key, 'torque_limit')


def _hangs_on(key: str) -> NotChecked:
    """Return what is not checked without the value of a key of `Settings.unknown`."""
    if key == CONTACTS:
        why = 'on which points the robot stands is unknown: say contacts in its configuration'
        return NotChecked('tip-over', why)
    if key == PAYLOAD_LINK:
        why = 'the link that carries it is unknown: say payload.link in the configuration'
        return NotChecked('load', why)
    joint = key.removeprefix('joints.').removesuffix('.limit')
    why = f'its limit is unknown: say {key} in the configuration (null: it is not to be judged)'
    return NotChecked(f'torque of {joint}', why)


def not_judged(settings: Settings) -> Iterator[NotChecked]:
    """Yield what no recording of this robot can tell by its configuration."""
    yield from not_judged_joints(settings)
    if settings.passive:
        why = 'declared as passive: a spring, a damper or a stop holds it, no motor'
        yield NotChecked(f'torque of {", ".join(settings.passive)}', why)
    unread = unread_links(mechanics_of(settings.robot))
    if unread:
        what = f'shape of {", ".join(unread)}'
        yield NotChecked(what, 'meshes are not read: only its joints are held above the ground')
    if not settings.hears_imu:
        yield NotChecked('tip-over', 'no IMU: the base was declared level')
    if not settings.hears_joints:
        yield NotChecked('torques', 'no joint states: the robot has no measured joints')


def untold_joints(settings: Settings, joints: Sequence[str]) -> Statement:
    """Return that joints were taken as held since no message told them, with the line to enter."""
    if not joints:
        return Statement()
    why = f'no message told it, so it was taken as held: {held_words(settings, joints)}'
    return Statement(not_checked=(NotChecked(f'position of {", ".join(joints)}', why),))


def not_judged_joints(settings: Settings) -> Iterator[NotChecked]:
    """Yield the joints that carry torque (force where prismatic) and have no limit."""
    found = [_with_size(settings.robot, *one) for one in unlimited(settings).items()]
    if found:
        why = 'no limit in the configuration, so it is not judged'
        yield NotChecked(f'torque of {", ".join(found)}', why)


def unlimited(settings: Settings) -> dict[str, float]:
    """Return the joints that carry torque and have no limit: how much (N m; N; infinite: unknown).

    Without those that are passive, and those whose limit the configuration says is unknown.
    """
    robot, limits = settings.robot, settings.limits.torque
    names = [
        name
        for name, limit in zip(robot.joint_names, limits, strict=True)
        if math.isinf(limit)
        and name not in settings.passive
        and f'joints.{name}.limit' not in settings.unknown
    ]
    few = names and len(robot.joint_names) <= MOST_JOINTS
    heavy = carried(robot) if few else {}
    return {name: heavy.get(name, math.inf) for name in names if heavy.get(name, math.inf) > 0.0}


def _with_size(robot: Robot, name: str, size: float) -> str:
    unit = robot.joint(name).units.effort
    digits = 1 if size < TENS else 0
    return f'{name} (up to {size:.{digits}f} {unit})' if math.isfinite(size) else name


@lru_cache(maxsize=16)
def carried(robot: Robot) -> dict[str, float]:
    """Return the largest torque (N m; N) that weight was found to put on each measured joint.

    With the payload, in random postures and any attitude; 0 for a joint that carries none, such as
    a wheel.
    """
    names, random = robot.joint_names, np.random.default_rng(0)
    travel = [robot.joint(name).travel(HALF_SLIDE) for name in names]
    q = np.array([random.uniform(*ends, POSTURES) for ends in travel]).T
    axes = robot.gravity * np.eye(3)
    torque = np.array([static_torque(robot, q, tuple(axis), robot.payload) for axis in axes])
    # The three axes are parts of one gravity, which may point along all of them together.
    most = np.sqrt((torque**2).sum(axis=0)).max(axis=0)
    slides = np.array([robot.joint(name).slides for name in names])
    result = {}
    for name, size, kind in zip(names, most.tolist(), slides.tolist(), strict=True):
        largest = most[slides == kind].max()
        result[name] = size if size >= max(SHARE * largest, LEAST) else 0.0
    return result
