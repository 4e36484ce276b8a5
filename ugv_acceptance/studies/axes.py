"""Which two joints of a robot a map or a plan varies, and which robots have neither."""

import math
from collections.abc import Sequence

from ugv_acceptance import BadConfig
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.roles import ARM_ALONE, LEGGED, NONE, roles_of
from ugv_acceptance.studies.bilinear import why_not_alone

# What every robot has, whatever it stands on.
FOR_ALL = 'model, evaluate, monitor and console are for every robot'


def arm_axes(robot: Robot) -> tuple[str, ...]:
    """Return the two joints of the arm that move its load most, base first; none without such.

    They are the first two that lift, else others of the arm that turn.
    """
    roles = roles_of(robot)
    turning = [n for n in roles.arm if not robot.joint(n).slides]
    first = [*roles.axes, *(n for n in turning if n not in roles.axes)][:2]
    return tuple(n for n in turning if n in first) if len(first) == 2 else ()


def map_axes(robot: Robot, limits: Sequence[float]) -> tuple[str, ...]:
    """Return the two joints of a map: of the arm, else others, those with a limit first.

    `limits` (j,) are the torque limits. Left out are wheels, joints of legs, and those that a map
    cannot vary alone (bilinear.py); fewer than two where there are no more joints.
    """
    roles, first = roles_of(robot), arm_axes(robot)
    pairs = zip(robot.joint_names, limits, strict=True)
    left = {*roles.wheels, *roles.legs, *first}
    others = [(not math.isfinite(limit), name) for name, limit in pairs if name not in left]
    names = (*first, *(name for _, name in sorted(others, key=lambda pair: pair[0])))
    return tuple(name for name in names if not why_not_alone(robot, name))[:2]


def check_stands_still(robot: Robot, verb: str) -> None:
    """Raise BadConfig for a robot on legs: its joints carry it, whatever posture is asked."""
    if roles_of(robot).kind == LEGGED:
        raise BadConfig(
            f'{verb}: {robot.name} stands on legs: in most postures of its joints it stands on '
            f'nothing, and there the torques are those of legs in the air; {FOR_ALL}'
        )


def check_drives(robot: Robot, verb: str) -> None:
    """Raise BadConfig unless a robot stands on wheels or tracks."""
    check_stands_still(robot, verb)
    kind = roles_of(robot).kind
    if kind == ARM_ALONE:
        raise BadConfig(
            f'{verb}: expected a robot on wheels or tracks that is tilted and driven, '
            f'{robot.name} is an arm without contact points; {FOR_ALL}'
        )
    if kind == NONE:
        raise BadConfig(
            f'{verb}: expected contact points under contacts in the configuration of '
            f'{robot.name}, found none: what it stands on is not known'
        )
