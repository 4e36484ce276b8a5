"""Unit and mounting of an IMU: the size of its mean acceleration, and which way is up at the start.

Robots start upright. One that leans over 45 degrees from its first message on tells how the IMU is
mounted, not how the robot stands.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ugv_acceptance.evaluation.inputs.imu_cell import BODY, ORIENTED, SECONDS, SQUARE
from ugv_acceptance.evaluation.inputs.imu_grid import QUATERNION, TIME, ImuGrid
from ugv_acceptance.evaluation.settings import GIVEN, ImuInput
from ugv_acceptance.model.robot import Vector

# Rows of the grid over which unit and lean are averaged (2 s), and the parts of it (0.5 s).
WINDOW, PART = 20, 5
# Units by the size of gravity in them, as a share of that in m/s2, and how far a size may be off.
UNITS = ((1.0, 0.0), (1.0 / 9.80665, 1.0), (1.0 / 0.3048, 2.0), (101.0, 3.0))
UNIT_SLACK = 0.18
# Mean acceleration (m/s2, or any unit) below which there is no gravity in it.
NO_GRAVITY, NONE = 0.3, 4.0
UNIT_KINDS = (
    '',
    'it is in g',
    'it is in ft/s2',
    'it is in cm/s2 or mg',
    'gravity is subtracted from it, or it is always 0',
)
# Lean (cosine) from which an IMU is mounted otherwise than configured.
LEANS = math.cos(math.radians(45.0))
# Share of g within which a mean acceleration tells a lean.
GRAVITY_SLACK = 0.25
# The square of a unit quaternion's norm may be this far from 1.
NORM_SLACK = 0.02
# By the sensor axis that points up: x, -x, y, -y, z, -z.
MOUNTING_KINDS = (
    '',
    'its x axis points up: imu.mounting_rpy_deg: [0, -90, 0]',
    'its x axis points down: imu.mounting_rpy_deg: [0, 90, 0]',
    'its y axis points up: imu.mounting_rpy_deg: [90, 0, 0]',
    'its y axis points down: imu.mounting_rpy_deg: [-90, 0, 0]',
    'its z axis points up as it sends it: imu.mounting_rpy_deg: [0, 0, 0]',
    'its z axis points down (upside down, or NED): imu.mounting_rpy_deg: [180, 0, 0]',
)


def unit_over(d: Sequence[float], g: float) -> float:
    """Return the number of UNIT_KINDS of the sums `d` over a window: 0 m/s2, NaN not known.

    The size of the mean and the root mean square must say the same: only one of them does where the
    sensor turns or shakes.
    """
    seconds = d[SECONDS]
    if not seconds > 0.5 * d[TIME]:
        return math.nan
    x, y, z = d[BODY]
    mean, square = (
        (x * x + y * y + z * z) / (seconds * seconds * g * g),
        d[SQUARE] / (seconds * g * g),
    )
    if _M_S2[0] < mean < _M_S2[1] and _M_S2[0] < square < _M_S2[1]:
        return 0.0
    one, other = _unit(mean, g), _unit(square, g)
    return one if one == other else math.nan


_M_S2 = math.exp(-2.0 * UNIT_SLACK), math.exp(2.0 * UNIT_SLACK)


def _unit(square: float, g: float) -> float:
    size = math.sqrt(square) if square > 0.0 else 0.0
    if size < NO_GRAVITY / g:
        return NONE
    found = [kind for of, kind in UNITS if abs(math.log(size / of)) < UNIT_SLACK]
    return found[0] if found else math.nan


@dataclass(slots=True)
class Mounting:
    """Whether the IMU is mounted as configured, judged from its first two seconds on.

    `kind` is None until that is known, 0 if it is so, else the number in MOUNTING_KINDS of how it
    looks mounted; it is so again once the lean is below 45 degrees. `raised(now)` is the base's z
    in the sensor's axes if a joint moves the IMU.
    """

    imu: ImuInput
    kind: float | None = None
    raised: Callable[[int], Vector] | None = None
    _z: Vector = (0.0, 0.0, 1.0)

    def judge(self, grid: ImuGrid, end: int, now: int) -> float:
        """Take the window that ends at the row `end` of the grid and at `now` (ns).

        Return `kind`, NaN for None.
        """
        self._z = self.raised(now) if self.raised else self.imu.mounting[2]
        if self.imu.placed != GIVEN or math.isnan(self._z[0]):
            return math.nan
        if self.kind == 0.0:
            return 0.0
        if self.kind is None:
            parts = range(end - WINDOW + PART, end + 1, PART)
            ups = [self._up(grid, part, PART) for part in parts]
            known = [up for up in ups if up is not None]
            if len(known) < len(ups):
                return math.nan
            self.kind = _upward(known[-1]) if all(map(self._leans, known)) else 0.0
        else:
            up = self._up(grid, end, WINDOW)
            if up is not None and not self._leans(up):
                self.kind = 0.0
        return self.kind

    def _height(self, up: Vector) -> float:
        """Return the cosine of the lean."""
        (x, y, z), (a, b, c) = self._z, up
        return x * a + y * b + z * c

    def _leans(self, up: Vector) -> bool:
        return self._height(up) < LEANS

    def _up(self, grid: ImuGrid, end: int, rows: int) -> Vector | None:
        """Return which way is up in sensor axes in a window, None where neither source tells.

        Where both tell, the one that leans less: that they differ is another fault.
        """
        d = grid.over(end, rows)
        found: list[Vector] = []
        if d[SECONDS] > 0.5 * d[TIME]:
            x, y, z = (v / d[SECONDS] for v in d[BODY])
            size = math.sqrt(x * x + y * y + z * z)
            if abs(size - grid.g) <= GRAVITY_SLACK * grid.g:
                found.append((x / size, y / size, z / size))
        if d[ORIENTED] > 0.5 * d[TIME] and self.imu.attitude != 'accelerometer':
            x, y, z, w = grid.line(end)[QUATERNION]
            square = x * x + y * y + z * z + w * w
            up = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w + z * z - x * x - y * y
            # The newest may be one that is no rotation.
            if abs(square - 1.0) <= NORM_SLACK:
                found.append((up[0] / square, up[1] / square, up[2] / square))
        return max(found, key=self._height, default=None)


def _upward(up: Vector) -> float:
    """Return the number in MOUNTING_KINDS of the sensor axis nearest to upwards."""
    axis = max(range(3), key=lambda k: abs(up[k]))
    return 1.0 + 2.0 * axis + float(up[axis] < 0.0)
