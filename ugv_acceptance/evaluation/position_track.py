"""Rates and accelerations of joints from their positions alone: parabolas over a short window.

Positions are put on an even grid of time and fitted, cell by cell, by a parabola through the cells
around it. Time is that of the header stamps where positions are smoother by them (a network that
delivers in bursts), else that of receipt. What noise alone would show is taken off accelerations.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.type_aliases import Floats, Times

# Length of a cell (s), and number of cells to each side of one that its parabola is fitted to.
STEP, HALF = 0.02, 5
# Positions further apart than GAP (s) leave cells unsure; further than BREAK (s) they end a track.
GAP, BREAK = 0.11, 2.0
# A position that repeats for longer than this (s) ends where it changes, not where it began.
STILL = 0.15
# Accelerations within so many standard deviations of what noise shows are none.
SIGMAS = 4.0


@dataclass(frozen=True, slots=True)
class Track:
    """Positions (n, j) and rates on an even grid of times (n,) in s.

    `row` (n,) is the message nearest before each, `sure` says where messages were dense enough.
    """

    time: Floats
    q: Floats
    rate: Floats
    row: NDArray[np.intp]
    sure: NDArray[np.bool_]

    def acceleration(self) -> Floats:
        """Return the accelerations (n, j) of the parabolas, 0 at the grid's ends and in noise."""
        cells = np.arange(-HALF, HALF + 1)
        t = cells * STEP
        square = t * t - (t * t).mean()
        bend = 2.0 * square / (square @ square)
        found, inner = np.zeros_like(self.q), slice(HALF, len(self.q) - HALF)
        for j, q in enumerate(self.q.T):
            bent = np.convolve(q, bend[::-1], 'valid')
            noise = _noise(q, np.abs(self.rate[:, j]))
            spread = SIGMAS * noise * float(np.sqrt(bend @ bend))
            found[inner, j] = np.where(np.abs(bent) > spread, bent, 0.0)
        return found


def track_of(time: Times, stamp: Times, q: Floats, turns: Sequence[float]) -> Iterator[Track]:
    """Yield the tracks of messages (n,) with positions (n, j), one between long gaps.

    `time` of receipt and `stamp` in ns; `turns` (j,) is the angle (rad) after which a joint may be
    wrapped, 0: it is not.
    """
    known = np.isfinite(q).all(axis=1)
    good = np.flatnonzero(known)
    if len(good) < 2 * HALF:
        return
    if len(good) < len(q):
        time, stamp, q = time[good], stamp[good], q[good]
    seconds, order = _clock(time, stamp, q)
    rows = good[order]
    parts = np.split(np.arange(len(rows)), np.flatnonzero(np.diff(seconds) > BREAK) + 1)
    for part in parts:
        span = seconds[part[-1]] - seconds[part[0]]
        if span > 2 * HALF * STEP:
            yield _track(seconds[part], q[order[part]], rows[part], turns)


def _clock(time: Times, stamp: Times, q: Floats) -> tuple[Floats, NDArray[np.intp]]:
    """Return increasing times (s) of messages and their order: by stamps, if these are better."""
    received = by_stamp = np.arange(len(time))
    steps = np.diff(stamp)
    ordered = bool((steps >= 0).all())
    if not ordered:
        by_stamp = np.argsort(stamp, kind='stable')
        steps = np.diff(stamp[by_stamp])
    distinct = np.count_nonzero(steps) >= 0.9 * (len(stamp) - 1)
    if distinct and (ordered or _roughness(q[by_stamp]) <= 1.001 * _roughness(q)):
        shift = int(np.median(time - stamp))
        return (stamp[by_stamp] + shift) / 1e9, by_stamp
    return time / 1e9, received


def _roughness(q: Floats) -> float:
    return float(np.abs(np.diff(q, axis=0)).sum())


def _track(seconds: Floats, q: Floats, rows: NDArray[np.intp], turns: Sequence[float]) -> Track:
    start = np.ceil(seconds[0] / STEP) * STEP
    grid = start + STEP * np.arange(int((seconds[-1] - start) / STEP) + 1)
    table = np.empty((len(grid), q.shape[1]))
    for j, turn in enumerate(turns):
        column = q[:, j]
        if turn and (np.abs(np.diff(column)) >= turn / 2.0).any():
            column = np.unwrap(column, period=turn)
        kept = _changes(seconds, column)
        table[:, j] = np.interp(grid, seconds[kept], column[kept])
    place = np.searchsorted(seconds, grid, side='right') - 1
    gaps = np.append(np.diff(seconds), 0.0)[place] > GAP
    near = np.convolve(gaps, np.ones(2 * HALF + 1), 'same') > 0.0
    return Track(grid, table, _rates(table), rows[place], ~near & _inside(len(grid)))


def _inside(n: int) -> NDArray[np.bool_]:
    inside = np.zeros(n, np.bool_)
    inside[HALF : n - HALF] = True
    return inside


def _changes(seconds: Floats, q: Floats) -> NDArray[np.bool_]:
    """Return which positions (n,) are new, and the last ones of those that stood still."""
    kept = np.append(True, q[1:] != q[:-1])
    begins = np.flatnonzero(kept)
    ends = begins[1:] - 1
    kept[ends[seconds[ends] - seconds[begins[:-1]] > STILL]] = True
    kept[-1] = True
    return kept


def _rates(table: Floats) -> Floats:
    """Return the rates (n, j) of positions on the grid, 0 at its ends."""
    t = np.arange(-HALF, HALF + 1) * STEP
    slope, rate = t / (t @ t), np.zeros_like(table)
    for j, q in enumerate(table.T):
        rate[HALF : len(table) - HALF, j] = np.convolve(q, slope[::-1], 'valid')
    return rate


def _noise(q: Floats, rate: Floats) -> float:
    """Return the standard deviation of the noise of positions (n,), while they move at `rate`.

    By the median of third differences, which no motion has but where it begins, ends or jumps.
    """
    third = np.abs(np.diff(q, n=3))
    moving = rate[: len(third)] > rate.max() / 4.0
    typical = float(np.median(third))
    if moving.any():
        typical = max(typical, float(np.median(third[moving])))
    return typical / (0.6745 * math.sqrt(20.0))
