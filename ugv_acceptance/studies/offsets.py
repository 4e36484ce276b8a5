"""Reproduces the paper's Table 2 by link centres of gravity that lie away from mid-link.

With both centres of gravity at mid-link the static and the dynamic model agree at rest, so that the
reference error at 1 deg/s is nearly zero and F grows as the fourth power of speed. The printed
Table 2 implies a reference error of 1.0 N m, which offset centres of gravity explain. For each
offset of link 2 the cells bound the offset of link 1 in closed form, because the mean square at
rest is a quadratic of it.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ugv_acceptance.studies.planar import (
    PAPER,
    PlanarArm,
    arm_robot,
    planar_dynamics,
    planar_torque,
)
from ugv_acceptance.studies.validity import (
    PAPER_SAMPLES,
    PAPER_SPEEDS_DEG_S,
    SpeedError,
    paper_sweep,
    speed_error,
)
from ugv_acceptance.type_aliases import Floats

# Table 2 as printed: F of the first joint; that of the second is 1.0 throughout.
TABLE_2 = (1.0, 1.0, 1.0, 1.2, 5.1, 22.0, 67.6, 163.9)
THETA1 = math.pi / 6.0
# The offsets (m) that the paper page uses: near the middle of the family.
OFFSET1, OFFSET2 = 0.04728, -0.00228
# Half the last printed digit: a cell agrees if it rounds to what is printed.
_HALF = 0.05


@dataclass(frozen=True, slots=True)
class Family:
    """All offsets (m) that reproduce Table 2: for each `offset2` (n,) two intervals of offset1.

    `positive` and `negative` (n, 2) are the intervals' ends, smaller magnitude first.
    """

    offset2: Floats
    positive: Floats
    negative: Floats


def table_error(offset1: float, offset2: float, arm: PlanarArm = PAPER) -> SpeedError:
    """Return the error of the mid-link static model against the arm with those offsets (m)."""
    moved = replace(arm, offset1=offset1, offset2=offset2)
    return speed_error(arm_robot(moved), paper_sweep(THETA1), 1, static=arm_robot(arm))


def table_2(offset1: float = OFFSET1, offset2: float = OFFSET2) -> Floats:
    """Return F (8, 2) at the paper's eight speeds for both joints, offsets in m."""
    return table_error(offset1, offset2).f_value(np.radians(PAPER_SPEEDS_DEG_S))


def matches(found: Floats) -> Floats:
    """Return which of the 16 cells (8, 2) are Table 2's to the printed digit."""
    printed = np.stack([TABLE_2, np.ones(len(TABLE_2))], axis=-1)
    same: Floats = np.abs(np.round(found, 1) - printed) < 1e-9
    return same


def offset_family(offset2: Floats, arm: PlanarArm = PAPER) -> Family:
    """Return the offsets of link 1 that reproduce Table 2, for each `offset2` (m) that has any."""
    rows = [(d2, *ends) for d2 in offset2 if (ends := _ends(float(d2), arm)) is not None]
    table = np.array(rows).reshape(-1, 5)
    return Family(table[:, 0], table[:, 1:3], table[:, 3:5])


def _ends(offset2: float, arm: PlanarArm) -> tuple[float, float, float, float] | None:
    low, high = _rest_bounds(offset2, arm)
    if low >= high or offset2 == 0.0:  # without an offset joint 2 has no error at all: 0 / 0
        return None
    small, large = _offset1(low, offset2, arm), _offset1(high, offset2, arm)
    return None if small is None or large is None else (small[0], large[0], small[1], large[1])


def _rest_bounds(offset2: float, arm: PlanarArm) -> tuple[float, float]:
    """Return the bounds of the mean square at rest (N2 m2) within which joint 1 matches Table 2."""
    moved, q, n = replace(arm, offset2=offset2), paper_sweep(THETA1), PAPER_SAMPLES - 1
    rest = planar_torque(moved, q[:, 0], q[:, 1])[0]
    motion = planar_dynamics(moved, q, (0.0, 1.0), (0.0, 0.0))[0] - rest
    mixed = float(motion @ (rest - planar_torque(arm, q[:, 0], q[:, 1])[0])) / n
    moving = float(motion @ motion) / n
    squares = np.radians(PAPER_SPEEDS_DEG_S) ** 2
    extra = 2.0 * squares * mixed + squares**2 * moving
    low, high = 0.0, math.inf
    for value, printed in zip(extra[1:] - extra[0], TABLE_2[1:], strict=True):
        # F - 1 = value / (rest + extra at 1 deg/s) lies between printed - 1 -/+ half a digit.
        bounds = [printed - 1.0 - _HALF, printed - 1.0 + _HALF]
        if value < 0.0:
            bounds = [-bounds[1], -bounds[0]]
        low = max(low, abs(value) / bounds[1] - extra[0])
        high = min(high, abs(value) / bounds[0] - extra[0] if bounds[0] > 0.0 else math.inf)
    return low, high


def _offset1(rest: float, offset2: float, arm: PlanarArm) -> tuple[float, float] | None:
    """Return the two offsets of link 1 (positive first) that give that mean square at rest."""
    n = PAPER_SAMPLES
    c, s = math.cos(THETA1), math.sin(THETA1)
    b = arm.mass2 * arm.gravity * offset2
    # Sums over a turn with both ends counted: cos 1, cos^2 (n + 1) / 2, sin^2 (n - 1) / 2.
    own = b * b * (c * c * (n + 1) + s * s * (n - 1)) / 2.0
    root = (b * c) ** 2 - n * (own - rest * (n - 1))
    if root < 0.0:
        return None
    scale = n * arm.mass1 * arm.gravity * c
    return (-b * c + math.sqrt(root)) / scale, (-b * c - math.sqrt(root)) / scale
