"""Finds the posture in which each joint needs the largest torque to hold the arm.

A search, so the torque found is a lower bound of the true maximum; for an arm whose pitch axes are
parallel it is exact, because all right angles are among the postures tried.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.statics import static_torque

POSTURES = 1500
# Robots with more joints are not checked: compiling their formulas would take too long.
MOST_JOINTS = 40


@dataclass(frozen=True, slots=True)
class Worst:
    """The largest |torque| found of a joint (N m; N if prismatic) and its posture (rad, m)."""

    joint: str
    torque: float
    unit: str
    posture: tuple[float, ...]


def worst_torques(robot: Robot, payload: Payload) -> tuple[Worst, ...]:
    """Return the worst posture of every measured joint on level ground; () above MOST_JOINTS."""
    if not robot.joint_names or len(robot.joint_names) > MOST_JOINTS:
        return ()
    q = postures(robot)
    torque = np.abs(static_torque(robot, q, (0.0, 0.0, -robot.gravity), payload))
    rows = torque.argmax(axis=0)
    return tuple(
        Worst(
            name, float(torque[row, j]), robot.joint(name).units.effort, tuple(map(float, q[row]))
        )
        for j, (name, row) in enumerate(zip(robot.joint_names, rows, strict=True))
    )


def postures(robot: Robot) -> NDArray[np.float64]:
    """Return the postures to try, shape (n, j): right angles, joint limits, and random ones."""
    random = np.random.default_rng(0)
    columns = []
    for name in robot.joint_names:
        joint = robot.joint(name)
        lower, upper = joint.travel()
        right = [0.0] if joint.slides else [k * math.pi / 2 for k in range(-2, 3)]
        corners = [x for x in (*right, lower, upper) if lower <= x <= upper]
        columns.append(
            np.concatenate(
                [random.choice(corners, POSTURES), random.uniform(lower, upper, POSTURES)]
            )
        )
    table = np.stack(columns, axis=-1)
    return np.vstack([np.clip(0.0, table.min(axis=0), table.max(axis=0)), table])
