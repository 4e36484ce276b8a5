"""What a tenth of a second of IMU messages adds to the running sums, for one cell or for many.

The formulas are written once (model/kernels.py) and run on floats live, on columns of a recording.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.model.expressions import (
    Scalar,
    Vec,
    add,
    atan2,
    copysign,
    cross,
    dot,
    scale,
    sqrt,
    subtract,
)
from ugv_acceptance.model.kernels import Kernel, compile_kernel
from ugv_acceptance.model.row_selection import Values
from ugv_acceptance.type_aliases import Floats

# Columns of a sample: orientation x y z w, rate, acceleration, whether the orientation may be used,
# squares of rate and acceleration, whether the numbers can be used, time since the start (ns).
Q, W, A, OK, W2, A2, GOOD, TAU, WIDTH = (
    slice(0, 4),
    slice(4, 7),
    slice(7, 10),
    10,
    11,
    12,
    13,
    14,
    15,
)
# Columns of the running sums: seconds of samples; acceleration (m/s), its square (m2/s3); rotation
# (rad); samples; variance of the rate times degrees of freedom, and those;
SECONDS, BODY, SQUARE, TURN, COUNT, SPREAD, FREEDOM = 0, slice(1, 4), 4, slice(5, 8), 8, 9, 10
# acceleration in the world (m/s), the orientation's own rotation (rad), seconds and steps in which
# it is known; acceleration of shocks in the world, their seconds;
WORLD, OWN, ORIENTED, KNOWN = slice(11, 14), slice(14, 17), 17, 18
SHOCKS, SHOCKED = slice(19, 22), 22
# pairs of neighbouring samples, and those between which acceleration or orientation jump.
PAIRS, FORCE_JUMPS, TURN_JUMPS, SUMS = 23, 24, 25, 26
# Square of the largest number that is summed: anything larger would drown all others.
LARGEST = 1e10
# Acceleration (m/s2) this far above g is a shock: such a sample is left out of the calm mean.
SHOCK = 20.0
# Distance of two sources: accelerations (m/s2) and quaternions; a jump is a share of it.
APART_FORCE, APART_TURN, JUMP = 1.5, 0.05, 0.75
UNTURNED = (0.0, 0.0, 0.0, 1.0)


@lru_cache(maxsize=1)
def _cell_kernel() -> Kernel:
    def formula(*v: Scalar) -> list[Scalar]:
        weight, n, ax, ay, az, square, wx, wy, wz, rate_square = v[:10]
        before, after = v[10:14], v[14:]
        force, turn = scale((ax, ay, az), weight), (wx, wy, wz)
        step, middle = _step(before, after)
        spread = rate_square - dot(turn, turn) * (1.0 / n)
        return [
            weight * n, *force, weight * square, *scale(turn, weight), n, spread, n - 1.0,
            *_rotated(middle, force), *step,
        ]  # fmt: skip

    return compile_kernel(formula, [f'v{k}' for k in range(18)])


def _step(p: Sequence[Scalar], q: Sequence[Scalar]) -> tuple[Vec, tuple[Scalar, ...]]:
    """Return the rotation (rad, body axes) from quaternion p to q, and the unit one half way.

    They may have either sign and a length other than 1; the shorter way round is taken.
    """
    u, v = (p[0], p[1], p[2]), (q[0], q[1], q[2])
    same = dot(u, v) + p[3] * q[3]
    sign = copysign(1.0, same)
    vector = scale(subtract(subtract(scale(v, p[3]), scale(u, q[3])), cross(u, v)), sign)
    # Where nothing turns both are 0, and their ratio is right.
    length = sqrt(dot(vector, vector)) + 1e-300
    angle = 2.0 * atan2(length, same * sign)
    middle = [a + b * sign for a, b in zip(p, q, strict=True)]
    size = 1.0 / sqrt(sum((m * m for m in middle), 0.0))
    return scale(vector, angle * (1.0 / length)), tuple(m * size for m in middle)


def _rotated(q: Sequence[Scalar], v: Vec) -> Vec:
    u, w = (q[0], q[1], q[2]), q[3]
    along = add(scale(v, 2.0 * w * w - 1.0), scale(u, 2.0 * dot(u, v)))
    return add(along, scale(cross(u, v), 2.0 * w))


@lru_cache(maxsize=1)
def _rotation_kernel() -> Kernel:
    def formula(*v: Scalar) -> Vec:
        _, middle = _step(v[3:7], v[7:])
        return _rotated(middle, (v[0], v[1], v[2]))

    return compile_kernel(formula, [f'v{k}' for k in range(11)])


def grown(
    weight: Values, sums: Sequence[Values], before: Sequence[Values], after: Sequence[Values]
) -> list[Values]:
    """Return what a cell adds to the first columns, up to OWN.

    `sums` are those of its samples: number, acceleration, its square, rate, its square; `weight`
    (s) is what one stands for; `before` and `after` the orientations at its ends. Floats or arrays.
    """
    return list(_cell_kernel().run(weight, *sums, *before, *after))


def grown_once(
    weight: float, sums: Sequence[float], before: Sequence[float], after: Sequence[float]
) -> list[float]:
    """Return `grown` of one cell, live."""
    return list(_cell_kernel().one(weight, *sums, *before, *after))


def in_the_world(
    force: Sequence[Values], before: Sequence[Values], after: Sequence[Values]
) -> tuple[Values, ...]:
    """Return a vector in sensor axes turned by the orientation half way between two."""
    return _rotation_kernel().run(*force, *before, *after)


def jumps(x: Sequence[float], y: Sequence[float]) -> tuple[float, float]:
    """Return whether (1, else 0) acceleration and orientation jump between two samples (WIDTH,)."""
    a, b, c = y[7] - x[7], y[8] - x[8], y[9] - x[9]
    d, e, f, g = y[0] - x[0], y[1] - x[1], y[2] - x[2], y[3] - x[3]
    force = a * a + b * b + c * c > (JUMP * APART_FORCE) ** 2
    turn = d * d + e * e + f * f + g * g > (JUMP * APART_TURN) ** 2
    return float(force), float(turn)


def jump_columns(x: Floats, y: Floats) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return `jumps` of many samples (WIDTH, n)."""
    d = y[:OK] - x[:OK]
    force, turn = (np.einsum('ji,ji->i', d[of], d[of]) for of in (A, Q))
    return force > (JUMP * APART_FORCE) ** 2, turn > (JUMP * APART_TURN) ** 2
