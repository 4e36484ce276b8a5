"""The gyro against the orientation's own change, in motion: units, axes, stuck, contradicting.

Rotations over half a second are compared in windows of 3 s; the orientation may come up to 1 s
late, as that of a filter does. A window counts only where something turned.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.inputs.imu_cell import COUNT, FREEDOM, KNOWN, OWN, SPREAD, TURN
from ugv_acceptance.evaluation.inputs.imu_grid import (
    BOTH,
    COMPARED,
    GYRO_2,
    OWN_2,
    QUATERNION,
    SPAN,
    TIME,
    ImuGrid,
)
from ugv_acceptance.type_aliases import Floats

# Rows of the grid: a window (3 s), and the largest delay of the orientation (1 s).
WINDOW, LATE = 30, 10
# Comparisons in a window without delay, and the fewest that are judged.
PLACES, FEWEST = WINDOW - SPAN + 1, 10
# Rate (rad/s) from which a window counts, beside the noise; and error that contradicts.
EXCITED = 0.1
# Sum of the squared rotations (rad2) of a window below which there is no gyro.
NOTHING = 1e-9
# How many standard deviations of a mean rate are noise.
NOISE = 2.5
# Fewer samples a second than this tell too little of what happened between them.
LEAST_RATE = 40.0
# Verified: cosine of rotations from, and ratio of their sizes within.
AGREES, ALIKE = 0.7, (0.5, 2.0)
# A smaller cosine contradicts; a rotation of axes must explain it by at least this cosine.
DIFFERS, EXPLAINED, EXPLAINED_UNIT = 0.5, 0.85, 0.8
# Degrees for radians, a factor of 57.3; a ratio beyond these says that one of the two stands still.
DEGREES, STUCK, IDLE = (35.0, 90.0), 5.0, 0.2

# What is wrong, worst last: with the gyro alone, or with the orientation as well.
GYRO_KINDS = (
    '',
    'they are about 57 times too large: deg/s instead of rad/s',
    'they are over 35 times too small',
    'their axes are turned against those of the orientation',
    'their axes are mirrored against those of the orientation',
)
ORIENTATION_KINDS = (
    '',
    'the orientation contradicts the rates',
    'the orientation turns although the rates do not say so',
    'the orientation hardly turns although the rates say so: it is stuck, or they are too large',
)


class RatesFound(NamedTuple):
    """What a window shows: what is wrong with the gyro and the orientation, numbers of the KINDS.

    0 where they agree, NaN where nothing turned or nothing can be said. `excited` says that
    something turned, `cosine` how well both then agree (NaN if not excited).
    """

    gyro: float = math.nan
    orientation: float = math.nan
    excited: bool = False
    cosine: float = math.nan


def rates_over(grid: ImuGrid, end: int) -> RatesFound:
    """Return what the window that ends at the row number `end` of the grid shows."""
    last, before = grid.line(end), grid.line(end - PLACES)
    count = last[COMPARED] - before[COMPARED]
    g2, o2 = last[GYRO_2] - before[GYRO_2], last[OWN_2] - before[OWN_2]
    # Most of the time nothing turns; a gyro that says nothing at all is none.
    if count < FEWEST or max(g2, o2) < count * (EXCITED * 0.1 * SPAN) ** 2 or g2 < NOTHING:
        return RatesFound()
    d = grid.over(end, WINDOW)
    rate = d[COUNT] / d[TIME]
    noise = NOISE * math.sqrt(
        max(d[SPREAD], 0.0) / max(d[FREEDOM], 1.0) / max(0.1 * SPAN * rate, 1.0)
    )
    largest = math.sqrt(max(g2, o2) / count) / (0.1 * SPAN)
    if rate < LEAST_RATE or largest <= EXCITED + noise:
        return RatesFound()
    both = last[BOTH] - before[BOTH]
    cosine, ratio = both / math.sqrt(g2 * max(o2, 0.0) + 1e-18), math.sqrt(g2 / (o2 + 1e-12))
    if cosine >= AGREES and ALIKE[0] <= ratio <= ALIKE[1]:
        return RatesFound(0.0, 0.0, True, cosine)
    # Where both differ by no more than a small rate nothing contradicts, however late one comes.
    apart = math.sqrt(max(g2 + o2 - 2.0 * both, 0.0) / count) / (0.1 * SPAN)
    if apart <= EXCITED + noise:
        return RatesFound(excited=True, cosine=cosine)
    return _window(grid.table(end, WINDOW), noise).judge()


def _window(rows: Floats, noise: float) -> 'Window':
    """Return the window of these rows of the grid (WINDOW + 1, n)."""
    d = rows[SPAN:] - rows[:-SPAN]
    known = d[:, KNOWN] == SPAN
    q = np.where(known[:, None], rows[:-SPAN, QUATERNION], (0.0, 0.0, 0.0, 1.0))
    x, y, z, w = q.T
    up = np.stack((2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w + z * z - x * x - y * y), 1)
    up /= np.einsum('ij,ij->i', q, q)[:, None]
    return Window(d[:, TURN] * known[:, None], d[:, OWN] * known[:, None], known, up, noise)


@dataclass(frozen=True, slots=True)
class Window:
    """A window in which gyro and orientation do not plainly agree: rotations (n, 3) in rad.

    `turned` of the gyro, `own` of the orientation, where it is `known` (n,); `up` (n, 3) is the
    world's z axis in sensor axes, `noise` (rad/s) that of a mean rate.
    """

    turned: Floats
    own: Floats
    known: NDArray[np.bool_]
    up: Floats
    noise: float

    def judge(self) -> RatesFound:
        """Return what is wrong with gyro and orientation."""
        pairs = [pair for late in range(LATE + 1) if (pair := self._late(late))]
        found = max(pairs, key=lambda pair: pair.cosine, default=None)
        if found is None:
            return RatesFound()
        c, s = found.cosine, found.ratio
        if c >= AGREES and ALIKE[0] <= s <= ALIKE[1]:
            return RatesFound(0.0, 0.0, True, c)
        if found.error <= EXCITED + self.noise:
            return RatesFound(excited=True, cosine=c)
        gyro = _gyro_kind(s, c, pairs)
        if gyro:
            return RatesFound(gyro, math.nan, True, c)
        return RatesFound(math.nan, self._orientation_kind(found) or math.nan, True, c)

    def _late(self, late: int) -> '_Pair | None':
        """Return the rotations with an orientation that comes `late` rows late."""
        n = len(self.turned) - late
        known = self.known[late:]
        if known.sum() < FEWEST:
            return None
        return _Pair(self.turned[:n][known], self.own[late:][known], self.up[late:][known])

    def _orientation_kind(self, found: '_Pair') -> float:
        tilt_error, tilt_cosine = found.tilt
        tilts = tilt_error > EXCITED + self.noise and tilt_cosine < DIFFERS
        if found.ratio > STUCK:
            return 3.0
        if found.ratio < IDLE and tilts:
            return 2.0
        return 1.0 if found.cosine < DIFFERS and tilts else 0.0


@dataclass(frozen=True)
class _Pair:
    """Rotations (n, 3) of gyro and orientation over the same times, and `up` in sensor axes."""

    turned: Floats
    own: Floats
    up: Floats

    @property
    def cosine(self) -> float:
        return _cosine(self.turned, self.own)

    @property
    def ratio(self) -> float:
        return math.sqrt(float((self.turned**2).sum() / ((self.own**2).sum() + 1e-12)))

    @property
    def error(self) -> float:
        """Root mean square of the difference (rad/s)."""
        return _size(self.turned - self.own)

    @property
    def tilt(self) -> tuple[float, float]:
        """Difference (rad/s) and cosine of the parts that change the tilt."""
        level = [v - (v * self.up).sum(axis=1, keepdims=True) * self.up for v in self._both()]
        return _size(level[0] - level[1]), _cosine(*level)

    def _both(self) -> tuple[Floats, Floats]:
        return self.turned, self.own

    @property
    def explained(self) -> tuple[float, float]:
        """Cosine after the best rotation of the axes, and after the best that may mirror."""
        product = self.turned.T @ self.own
        u, sizes, v = np.linalg.svd(product)
        whole = math.sqrt(float((self.turned**2).sum() * (self.own**2).sum()) + 1e-18)
        hand = 1.0 if np.linalg.det(u @ v) > 0.0 else -1.0
        return float(sizes[0] + sizes[1] + hand * sizes[2]) / whole, float(sizes.sum()) / whole


def _gyro_kind(ratio: float, cosine: float, pairs: list[_Pair]) -> float:
    """Return what is wrong with the gyro alone, number of GYRO_KINDS, 0 for nothing known."""
    turns, mirrors = np.max([pair.explained for pair in pairs[::2]], axis=0)
    if DEGREES[0] < ratio < DEGREES[1] and turns > EXPLAINED_UNIT:
        return 1.0
    if ratio < 1.0 / DEGREES[0] and turns > EXPLAINED_UNIT:
        return 2.0
    if ALIKE[0] < ratio < ALIKE[1] and cosine < DIFFERS:
        return 3.0 if turns > EXPLAINED else 4.0 if mirrors > EXPLAINED else 0.0
    return 0.0


def _cosine(a: Floats, b: Floats) -> float:
    return float((a * b).sum()) / math.sqrt(float((a * a).sum() * (b * b).sum()) + 1e-18)


def _size(v: Floats) -> float:
    return math.sqrt(float((v * v).sum()) / len(v)) / (0.1 * SPAN)
