"""Robots and planned motions for tests: one joint on a base, and the tracked robot with its arm."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from robots import tracked

from ugv_acceptance.evaluation.planned_motion import Conditions, Trajectory
from ugv_acceptance.evaluation.settings import ImuInput, JointInput, Limits, Settings
from ugv_acceptance.model.robot import Contact, Joint, Link, Payload, Robot

LEVEL = (0.0, 0.0, -9.81)
EMPTY = Payload(0.0, (0.0, 0.0, 0.0))
# Of the robot with one joint: mass and half length and width of its base, height of the joint, mass
# of the point at the end of its arm, and how far that is from the joint.
BASE, HALF, WIDE, HIGH, MASS, LONG = 20.0, 0.4, 0.3, 0.5, 2.0, 0.6


def one_joint(axis: tuple[float, float, float] = (0.0, -1.0, 0.0)) -> Robot:
    """Return a box on four feet with one joint above its middle, and a point mass on its arm.

    At 0 the arm points ahead; a positive angle lifts it.
    """
    feet = [(x, y) for x in (HALF, -HALF) for y in (WIDE, -WIDE)]
    return Robot(
        'one',
        (
            Link('base', BASE, (0.0, 0.0, 0.2)), Link('arm', MASS, (LONG, 0.0, 0.0)), Link('hand'),
        ),
        (
            Joint(
                'lift', 'revolute', 'base', 'arm', (0.0, 0.0, HIGH), axis=axis,
                lower=-1.0, upper=2.5, effort=40.0, velocity=3.0,
            ),
            Joint('wrist', 'fixed', 'arm', 'hand', (LONG, 0.0, 0.0)),
        ),
        ('lift',),
        tuple(Contact(f'foot{k}', 'base', (x, y, 0.0)) for k, (x, y) in enumerate(feet)),
        payload_link='hand',
        payload=EMPTY,
    )  # fmt: skip


def settings_of(robot: Robot, torque: float = 40.0, **limits: Any) -> Settings:
    """Return settings of a robot whose messages call each joint as it does, with `_m` behind."""
    names = robot.joint_names
    given = Limits((torque,) * len(names), **({'tip_error': 0.0, 'tip_warn': 0.0} | limits))
    return Settings(robot, tuple(JointInput(f'{name}_m') for name in names), ImuInput(), given)


def way(
    points: Sequence[float], times: Sequence[float], rates: Any = None, more: Any = None
) -> Trajectory:
    """Return a trajectory of the one joint."""
    tables = [None if x is None else np.array(x, np.float64)[:, None] for x in (rates, more)]
    return Trajectory(('lift_m',), np.array(times, np.float64), np.array(points)[:, None], *tables)


def level(*posture: float, payload: Payload = EMPTY, **more: Any) -> Conditions:
    """Return level ground, no load, and the joints at a posture."""
    return replace(Conditions(LEVEL, payload, None, posture), **more)


def arm_settings(**limits: Any) -> Settings:
    """Return settings of the tracked robot with an arm; its flippers are folded back."""
    return settings_of(tracked(), 60.0, **limits)


FOLDED = math.pi
