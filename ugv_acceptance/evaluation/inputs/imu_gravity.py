"""Gravity in the world frame, averaged over seconds: the orientation against the acceleration.

The mean horizontal acceleration over T cannot exceed the change of speed divided by T, so the check
needs no rest. What it cannot see is a constant tilt error below about 9 degrees.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from ugv_acceptance.evaluation.inputs.imu_cell import (
    BODY,
    COUNT,
    ORIENTED,
    SECONDS,
    SHOCKED,
    SHOCKS,
    SQUARE,
    WORLD,
)
from ugv_acceptance.evaluation.inputs.imu_grid import TIME

# Lengths of the windows in rows of the grid: 2, 5 and 10 s.
WINDOWS = (20, 50, 100)
# Highest speed (m/s) of a vehicle; speeds may change from minus to plus this within a window.
SPEED = 2.6
# Horizontal acceleration (m/s2) that bias and filters may leave.
BIAS = 0.6
# Below so many samples a second vibration may look like acceleration: BIAS counts so many times.
SPARSE, SPARSE_FACTOR = 45.0, 2.0
# Share of g below which the vertical acceleration contradicts the orientation.
LEAST_UP = 0.3
# Shares of g within which the mean acceleration must lie to be held against the orientation.
BELIEVED = (0.3, 2.0)
# Share of a window in which the orientation must be known.
ENOUGH = 0.9


class GravityFound(NamedTuple):
    """What a window shows: `across`, the horizontal acceleration (m/s2), and its `limit`.

    `angle` (rad) is how far orientation and acceleration disagree, 0 while they may agree.
    """

    across: float
    limit: float
    angle: float


def gravity_over(d: Sequence[float], rows: int, g: float) -> GravityFound | None:
    """Return what the sums `d` over a window of so many rows of the grid show, None if nothing."""
    length, oriented, seconds = d[TIME], d[ORIENTED], d[SECONDS]
    if not oriented > ENOUGH * length:
        return None
    size = _norm(*d[BODY]) / seconds
    if not BELIEVED[0] * g < size < BELIEVED[1] * g:
        return None
    x, y, up = (v / oriented for v in d[WORLD])
    across = math.hypot(x, y)
    calm = oriented - d[SHOCKED]
    if d[SHOCKED] > 0.0 and calm > 0.5 * length:
        a, b, _ = ((v - w) / calm for v, w in zip(d[WORLD], d[SHOCKS], strict=True))
        across = min(across, math.hypot(a, b))
    count = d[COUNT]
    variance = max(d[SQUARE] / seconds - x * x - y * y - up * up, 0.0)
    bias = BIAS * (SPARSE_FACTOR if count < SPARSE * length else 1.0)
    limit = 2.0 * SPEED / (0.1 * rows) + bias + 3.0 * math.sqrt(variance / count)
    wrong = across > limit or up < LEAST_UP * g
    return GravityFound(across, limit, math.atan2(across, up) if wrong else 0.0)


def _norm(x: float, y: float, z: float) -> float:
    return math.sqrt(x * x + y * y + z * z)
