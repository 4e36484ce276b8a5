"""Sets of postures: random over the joints' ranges, and sweeps of one joint."""

import math
from collections.abc import Sequence

import numpy as np

from ugv_acceptance.model.robot import Robot
from ugv_acceptance.type_aliases import Floats


def joint_range(robot: Robot, name: str) -> tuple[float, float]:
    """Return a joint's range (rad, m): its limits; -pi to pi without any, or 0 if prismatic."""
    joint = robot.joint(name)
    widest = 0.0 if joint.kind == 'prismatic' else math.pi
    low = joint.lower if math.isfinite(joint.lower) else -widest
    high = joint.upper if math.isfinite(joint.upper) else widest
    return low, high


def random_postures(robot: Robot, count: int, seed: int) -> Floats:
    """Return random postures (count, j), each joint uniform over its range (rad, m)."""
    ranges = np.array([joint_range(robot, name) for name in robot.joint_names])
    rng = np.random.default_rng(seed)
    found: Floats = rng.uniform(ranges[:, 0], ranges[:, 1], (count, len(ranges)))
    return found


def sweeps(robot: Robot, q: Sequence[float], count: int) -> list[Floats]:
    """Return for each joint its sweep over its range, postures (count, j); the others as in `q`."""
    found = []
    for k, name in enumerate(robot.joint_names):
        low, high = joint_range(robot, name)
        if not math.isfinite(robot.joint(name).lower) and high - low > math.pi:
            low, high = 0.0, 2.0 * math.pi  # as the paper sweeps
        postures = np.tile(np.asarray(q, dtype=np.float64), (count, 1))
        postures[:, k] = np.linspace(low, high, count)
        found.append(postures)
    return found
