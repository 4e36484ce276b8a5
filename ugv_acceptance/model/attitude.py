"""The direction of gravity from an orientation or from an accelerometer.

`mounting` turns sensor axes into `base_link`. `up` is the unit vector against gravity in
`base_link`; level ground gives (0, 0, 1) (REP-103, REP-145). A vector of length zero or a NaN gives
NaN.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.model.expressions import (
    Scalar,
    Vec,
    add,
    atan2,
    cross,
    dot,
    rotate,
    scale,
    sqrt,
)
from ugv_acceptance.model.kernels import Kernel, compile_kernel
from ugv_acceptance.model.robot import Matrix
from ugv_acceptance.model.row_selection import Values
from ugv_acceptance.type_aliases import Floats

# A unit quaternion's norm may be this far from 1 (single precision, rounding).
NORM_SLACK = 0.01


@lru_cache(maxsize=8)
def _orientation_kernel(mounting: Matrix) -> Kernel:
    def formula(x: Scalar, y: Scalar, z: Scalar, w: Scalar) -> Vec:
        square = x * x + y * y + z * z + w * w
        # The world's z axis in sensor axes: the last row of the quaternion's rotation matrix.
        up: Vec = (
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            w * w + z * z - x * x - y * y,
        )
        return rotate(mounting, scale(up, 1.0 / square))

    return compile_kernel(formula, ['x', 'y', 'z', 'w'])


@lru_cache(maxsize=8)
def _acceleration_kernel(mounting: Matrix) -> Kernel:
    def formula(x: Scalar, y: Scalar, z: Scalar) -> Vec:
        return rotate(mounting, scale((x, y, z), 1.0 / sqrt(x * x + y * y + z * z)))

    return compile_kernel(formula, ['x', 'y', 'z'])


@lru_cache(maxsize=1)
def _angle_kernel() -> Kernel:
    def formula(*inputs: Scalar) -> list[Scalar]:
        a, b = (inputs[0], inputs[1], inputs[2]), (inputs[3], inputs[4], inputs[5])
        n = cross(a, b)
        return [atan2(sqrt(dot(n, n)), dot(a, b))]

    return compile_kernel(formula, list('abcdef'))


@lru_cache(maxsize=1)
def _roll_pitch_kernel() -> Kernel:
    def formula(x: Scalar, y: Scalar, z: Scalar) -> list[Scalar]:
        return [atan2(y, z), atan2(-x, sqrt(y * y + z * z))]

    return compile_kernel(formula, ['x', 'y', 'z'])


def is_rotation(x: Values, y: Values, z: Values, w: Values) -> Values:
    """Return whether a quaternion's norm is within NORM_SLACK of 1; False for NaN."""
    square = x * x + y * y + z * z + w * w
    return (square >= (1.0 - NORM_SLACK) ** 2) & (square <= (1.0 + NORM_SLACK) ** 2)


def up_from_orientation(
    x: Values, y: Values, z: Values, w: Values, mounting: Matrix
) -> tuple[Any, Any, Any]:
    """Return `up` (unit, `base_link`) from a quaternion from sensor axes to a world with z up.

    Any length but zero will do; `is_rotation` tells whether the quaternion is a valid rotation.
    """
    ux, uy, uz = _orientation_kernel(mounting).run(x, y, z, w)
    return ux, uy, uz


def up_from_acceleration(x: Values, y: Values, z: Values, mounting: Matrix) -> tuple[Any, Any, Any]:
    """Return `up` (unit, `base_link`) from a specific force in sensor axes: +g upwards at rest."""
    ux, uy, uz = _acceleration_kernel(mounting).run(x, y, z)
    return ux, uy, uz


class UpKernels(NamedTuple):
    """What `up_from_orientation`, `up_from_acceleration` and `angle_between` compute, of numbers.

    For one mounting of the IMU, without a look into a table for each message.
    """

    orientation: Callable[..., tuple[float, float, float]]
    acceleration: Callable[..., tuple[float, float, float]]
    between: Callable[..., tuple[float]]


def up_kernels(mounting: Matrix) -> UpKernels:
    """Return the kernels of one mounting (rotation matrix from sensor axes to `base_link`)."""
    found: list[Any] = [_orientation_kernel(mounting), _acceleration_kernel(mounting)]
    return UpKernels(*(kernel.one for kernel in (*found, _angle_kernel())))


def rotation_of(x: float, y: float, z: float, w: float) -> Matrix:
    """Return the rotation matrix of a unit quaternion."""
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )


def angle_between(a: Sequence[Any], b: Sequence[Any]) -> Values:
    """Return the angle (rad) between two vectors, exact for small and for flat angles."""
    (angle,) = _angle_kernel().run(*a, *b)
    return angle


def angles_where(some: NDArray[np.bool_], a: Floats, b: Floats) -> Floats:
    """Return the angles (n,) in rad between directions (3, n), NaN but for `some` rows."""
    found, rows = np.full(len(some), np.nan), np.flatnonzero(some)
    if len(rows) == len(some):
        return np.asarray(angle_between(tuple(a), tuple(b)), np.float64)
    if len(rows):
        found[rows] = angle_between(*(tuple(v.take(rows, axis=1)) for v in (a, b)))
    return found


def roll_pitch(up: Sequence[Any]) -> tuple[Any, Any]:
    """Return roll and pitch (rad) of `base_link` from `up`: fixed axes x, then y (REP-103)."""
    roll, pitch = _roll_pitch_kernel().run(*up)
    return roll, pitch


def moved_specific_force(
    force: Sequence[Any], omega: Sequence[Any], alpha: Sequence[Any], arm: Sequence[Any]
) -> tuple[Any, Any, Any]:
    """Return the specific force (m/s2) at `arm` (m) from the sensor on the same rigid body.

    s + omega x (omega x r) + alpha x r, all in one set of axes; omega in rad/s, alpha in rad/s2.
    """
    s, w, a, r = (_vector(v) for v in (force, omega, alpha, arm))
    return add(s, add(cross(w, cross(w, r)), cross(a, r)))


def _vector(v: Sequence[Any]) -> tuple[Any, Any, Any]:
    x, y, z = v
    return x, y, z
