"""The arm of a drill's robot: its postures, and what tilt is left in them; numbers of a seed."""

from math import pi, radians

import numpy as np

from ugv_acceptance.drill.situation import Act
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.stability import margins
from ugv_acceptance.simulation.vehicle import gravity_on_slope

Rng = np.random.Generator
Joints = tuple[tuple[str, float], ...]
# The arm folded over the deck (rad).
FOLDED = (('turret_joint', 0.0), ('shoulder_joint', radians(115)), ('elbow_joint', radians(-140)))
FOLD = tuple(Act('joint_to', 1.5, name, at) for name, at in FOLDED)


def posture(shoulder: float, elbow: float, turret: float = 0.0) -> Joints:
    """Return the arm's posture by angles in degrees, flippers folded back along the tracks."""
    return (
        ('flipper_joint', pi),
        ('turret_joint', radians(turret)),
        ('shoulder_joint', radians(shoulder)),
        ('elbow_joint', radians(elbow)),
    )


def between(rng: Rng, low: float, high: float) -> float:
    """Return a number between two, with one decimal, so that a story can tell it."""
    return round(float(rng.uniform(low, high)), 1)


def side_of(rng: Rng) -> tuple[float, str]:
    """Return a side as its sign (left +1, right -1) and in words."""
    left = bool(rng.integers(2))
    return (1.0, 'left') if left else (-1.0, 'right')


def tilt_left(robot: Robot, arm: Joints, tilt: tuple[float, float], load: float) -> float:
    """Return the least tilt left (rad) in a posture on a slope (tilt, heading), with a load."""
    at = dict(arm)
    q = np.array([at.get(name, 0.0) for name in robot.joint_names])
    down = np.array(gravity_on_slope(robot.gravity, *tilt))
    return float(margins(robot, q, down, Payload(load, robot.payload.cog)).angle.min())
