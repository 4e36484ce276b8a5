"""Postures: at rest, random over the joints' ranges, and sweeps of one joint."""

import math
from collections.abc import Sequence

import numpy as np

from ugv_acceptance.model.robot import Robot
from ugv_acceptance.type_aliases import Floats


def rest_posture(robot: Robot) -> Floats:
    """Return the posture (j,) in rad (m) with each joint at 0, or amid a range without it."""
    found = []
    for name in robot.joint_names:
        low, high = robot.joint(name).travel()
        found.append(0.0 if low <= 0.0 <= high else (low + high) / 2.0)
    return np.array(found)


def random_postures(robot: Robot, count: int, seed: int) -> Floats:
    """Return `count` postures (count, j), each joint even over its range."""
    ranges = np.array([robot.joint(name).travel() for name in robot.joint_names])
    rng = np.random.default_rng(seed)
    found: Floats = rng.uniform(ranges[:, 0], ranges[:, 1], (count, len(ranges)))
    return found


def sweeps(robot: Robot, q: Sequence[float], count: int) -> list[Floats]:
    """Return for each joint its sweep over its range, postures (count, j); the others as in `q`."""
    found = []
    for k, name in enumerate(robot.joint_names):
        joint = robot.joint(name)
        low, high = joint.travel()
        if not math.isfinite(joint.lower) and high - low > math.pi:
            low, high = 0.0, 2.0 * math.pi  # as the paper sweeps
        postures = np.tile(np.asarray(q, dtype=np.float64), (count, 1))
        postures[:, k] = np.linspace(low, high, count)
        found.append(postures)
    return found
