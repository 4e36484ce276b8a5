"""The gyro against the orientation's own change, in motion: units, axes, stuck, contradicting.

Rotations over half a second are compared in windows of 3 s; the orientation may come up to 1 s
late, as that of a filter does. A window counts only where something turned. Windows in which both
do not plainly agree are looked at side by side: one live, all those of a part of a recording.
"""

import math
from collections.abc import Sequence
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
# Less than this share of a bound is below it, whatever is rounded.
CERTAIN = 1.0 - 1e-9
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


def rates_of(grid: ImuGrid, ends: Sequence[int]) -> list[RatesFound]:
    """Return what the windows that end at these row numbers of the grid show."""
    looks = [_plainly(grid, end) for end in ends]
    found = [look if isinstance(look, RatesFound) else RatesFound() for look in looks]
    noise = {k: look for k, look in enumerate(looks) if isinstance(look, float)}
    if noise:
        rows = np.stack([grid.table(ends[k], WINDOW) for k in noise])
        for k, judged in zip(noise, _closer(rows, np.array(list(noise.values()))), strict=True):
            found[k] = judged
    return found


def _plainly(grid: ImuGrid, end: int) -> RatesFound | float:
    """Return what a window plainly shows, else the noise (rad/s) of a mean rate: look closer."""
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
        return RatesFound(0.0, 0.0, excited=True, cosine=cosine)
    # Where both differ by no more than a small rate nothing contradicts, however late one comes.
    apart = math.sqrt(max(g2 + o2 - 2.0 * both, 0.0) / count) / (0.1 * SPAN)
    return RatesFound(excited=True, cosine=cosine) if apart <= EXCITED + noise else noise


def _closer(rows: Floats, noise: Floats) -> list[RatesFound]:
    """Return what windows show, given their rows of the grid (m, WINDOW + 1, n) and noise (m,)."""
    first, last = rows[:, :-SPAN], rows[:, SPAN:]
    known = last[..., KNOWN] - first[..., KNOWN] == SPAN
    q = np.where(known[..., None], first[..., QUATERNION], (0.0, 0.0, 0.0, 1.0))
    x, y, z, w = np.moveaxis(q, -1, 0)
    up = np.stack((2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w + z * z - x * x - y * y), -1)
    up /= np.einsum('ij,ij->i', q.reshape(-1, 4), q.reshape(-1, 4)).reshape(*known.shape, 1)
    turned, own = ((last[..., of] - first[..., of]) * known[..., None] for of in (TURN, OWN))
    alike: dict[bytes, list[int]] = {}
    for k, row in enumerate(known):
        alike.setdefault(row.tobytes(), []).append(k)
    found = [RatesFound()] * len(rows)
    for at in alike.values():
        windows = Windows(_Pairs(turned[at], own[at], up[at]), known[at[0]], noise[at])
        for k, judged in zip(at, windows.judge(), strict=True):
            found[k] = judged
    return found


@dataclass(frozen=True, slots=True)
class _Pairs:
    """Rotations (m, n, 3) in rad of gyro and orientation over the same times, in m windows.

    `up` is the world's z axis in sensor axes. What the properties return is of each window (m,).
    """

    turned: Floats
    own: Floats
    up: Floats

    def late(self, late: int, known: NDArray[np.bool_]) -> '_Pairs':
        """Return the rotations with an orientation that comes `late` rows late, where `known`."""
        if known.all():
            n = len(known) - late
            return _Pairs(self.turned[:, :n], self.own[:, late:], self.up[:, late:])
        of = np.flatnonzero(known[late:])
        return _Pairs(*(x.take(at, axis=1) for x, at in zip(
            (self.turned, self.own, self.up), (of, of + late, of + late), strict=True,
        )))  # fmt: skip

    def of(self, some: NDArray[np.intp]) -> '_Pairs':
        """Return those of some of the windows."""
        return _Pairs(self.turned[some], self.own[some], self.up[some])

    @property
    def products(self) -> Floats:
        """Sums of squares of the gyro's, of the orientation's, and of products of both (3, m)."""
        of = ((self.turned, self.turned), (self.own, self.own), (self.turned, self.own))
        return np.array([_dots(a, b) for a, b in of])

    @property
    def size(self) -> Floats:
        """Root of the product of both sums of squares (rad2): what a cosine is a share of."""
        turned, own, _ = self.products
        size: Floats = np.sqrt(turned * own + 1e-18)
        return size

    @property
    def error(self) -> Floats:
        """Root mean square of the difference (rad/s)."""
        return _sizes(self.turned - self.own)

    @property
    def tilt(self) -> tuple[Floats, Floats]:
        """Difference (rad/s) and cosine of the parts that change the tilt."""
        up = self.up
        a, b = (v - (v * up).sum(axis=2, keepdims=True) * up for v in (self.turned, self.own))
        return _sizes(a - b), _cosines(a, b)

    @property
    def explained(self) -> tuple[Floats, Floats]:
        """Cosine after the best rotation of the axes, and after the best that may mirror."""
        u, sizes, v = np.linalg.svd(self.product)
        hand = np.where(np.linalg.det(u @ v) > 0.0, 1.0, -1.0)
        turns = (sizes[:, 0] + sizes[:, 1] + hand * sizes[:, 2]) / self.size
        return turns, sizes.sum(axis=1) / self.size

    @property
    def product(self) -> Floats:
        """Sums of the products of each axis of the gyro with each of the orientation (m, 3, 3)."""
        found: Floats = np.matmul(self.turned.transpose(0, 2, 1), self.own)
        return found


@dataclass(frozen=True, slots=True)
class Windows:
    """Windows (m,) in which gyro and orientation do not plainly agree, judged side by side.

    The orientation is `known` (n,) at the same places of all; `noise` (m,) is that of a mean rate
    (rad/s).
    """

    pairs: _Pairs
    known: NDArray[np.bool_]
    noise: Floats

    def judge(self) -> list[RatesFound]:
        """Return what is wrong with gyro and orientation, window by window."""
        lates = [k for k in range(LATE + 1) if np.count_nonzero(self.known[k:]) >= FEWEST]
        if not lates:
            return [RatesFound()] * len(self.noise)
        pairs = [self.pairs.late(late, self.known) for late in lates]
        turned, own, both = np.stack([of.products for of in pairs], axis=1)
        whole = np.sqrt(turned * own + 1e-18)
        cosines = both / whole
        best = cosines.argmax(axis=0)
        each = best, np.arange(len(best))
        cosine, ratio = cosines[each], np.sqrt(turned[each] / (own[each] + 1e-12))
        error, kind = np.array([of.error for of in pairs])[each], np.zeros(len(best))
        agree = (cosine >= AGREES) & (ratio >= ALIKE[0]) & (ratio <= ALIKE[1])
        small = error <= EXCITED + self.noise
        gyro = _gyro_kinds((ratio, cosine, whole[::2]), pairs[::2], ~(agree | small))
        left = ~(agree | small) & (gyro == 0.0)
        for late in np.unique(best[left]):
            at = np.flatnonzero(left & (best == late))
            kind[at] = self._orientation_kinds(pairs[late].of(at), ratio[at], cosine[at], at)
        kind[agree], gyro[agree] = 0.0, 0.0
        kind[~agree & (small | (gyro > 0.0) | (kind == 0.0))] = math.nan
        gyro[~agree & (gyro == 0.0)] = math.nan
        told = zip(gyro.tolist(), kind.tolist(), cosine.tolist(), strict=True)
        return [RatesFound(a, b, excited=True, cosine=c) for a, b, c in told]

    def _orientation_kinds(
        self, found: _Pairs, ratio: Floats, cosine: Floats, at: NDArray[np.intp]
    ) -> Floats:
        """Return what is wrong with the orientation of the windows `at`, of ORIENTATION_KINDS."""
        tilt_error, tilt_cosine = found.tilt
        tilts = (tilt_error > EXCITED + self.noise[at]) & (tilt_cosine < DIFFERS)
        kind = np.where((cosine < DIFFERS) & tilts, 1.0, 0.0)
        kind[(ratio < IDLE) & tilts] = 2.0
        kind[ratio > STUCK] = 3.0
        return kind


def _gyro_kinds(
    sizes: tuple[Floats, Floats, Floats], pairs: Sequence[_Pairs], wanted: NDArray[np.bool_]
) -> Floats:
    """Return what is wrong with the gyro alone, of GYRO_KINDS, 0 for nothing known or `wanted`.

    `sizes` are ratio and cosine (m,) at the best delay, and the size (d, m) at each of `pairs`.
    """
    ratio, cosine, whole = sizes
    large = (ratio > DEGREES[0]) & (ratio < DEGREES[1])
    tiny = ratio < 1.0 / DEGREES[0]
    alike = (ratio > ALIKE[0]) & (ratio < ALIKE[1]) & (cosine < DIFFERS)
    kind = np.zeros(len(ratio))
    at = np.flatnonzero(wanted & (large | tiny | alike))
    if len(at):
        most = _most_explained(np.concatenate([of.product[at] for of in pairs]))
        most = (most.reshape(-1, len(at)) / whole[:, at]).max(axis=0)
        at = at[most > CERTAIN * min(EXPLAINED, EXPLAINED_UNIT)]
    if not len(at):
        return kind
    turns, mirrors = np.max([of.of(at).explained for of in pairs], axis=0)
    axes = np.where(turns > EXPLAINED, 3.0, np.where(mirrors > EXPLAINED, 4.0, 0.0))
    unit = np.where(large[at], 1.0, 2.0) * (turns > EXPLAINED_UNIT)
    kind[at] = np.where(alike[at], axes, unit)
    return kind


def _most_explained(rows: Floats) -> Floats:
    """Return no less than both of `explained` times the size, of products (m, 3, 3).

    The square of the sum of three numbers, here the singular values, is the sum of their squares,
    and twice that of their products: at most the square root of three times the sum of the
    products' squares, which is that of the squares of all cofactors.
    """
    cofactors = np.cross(rows, rows[:, [1, 2, 0]])
    most: Floats = np.sqrt(_dots(rows, rows) + 2.0 * np.sqrt(3.0 * _dots(cofactors, cofactors)))
    return most


def _dots(a: Floats, b: Floats) -> Floats:
    """Return the sum of products of rotations (m, n, 3), of each window (m,)."""
    found: Floats = (a * b).reshape(len(a), a.shape[1] * a.shape[2]).sum(axis=1)
    return found


def _cosines(a: Floats, b: Floats) -> Floats:
    cosine: Floats = _dots(a, b) / np.sqrt(_dots(a, a) * _dots(b, b) + 1e-18)
    return cosine


def _sizes(v: Floats) -> Floats:
    size: Floats = np.sqrt(_dots(v, v) / v.shape[1]) / (0.1 * SPAN)
    return size
