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
    """Positions (n, j), rates and accelerations on an even grid of times (n,) in s.

    `row` (n,) is the message nearest before each, `sure` says where messages were dense enough.
    """

    time: Floats
    q: Floats
    rate: Floats
    acceleration: Floats
    row: NDArray[np.intp]
    sure: NDArray[np.bool_]


def track_of(time: Times, stamp: Times, q: Floats, turns: Sequence[float]) -> Iterator[Track]:
    """Yield the tracks of messages (n,) with positions (n, j), one between long gaps.

    `time` of receipt and `stamp` in ns; `turns` (j,) is the angle (rad) after which a joint may be
    wrapped, 0: it is not.
    """
    good = np.flatnonzero(np.isfinite(q).all(axis=1))
    if len(good) < 2 * HALF:
        return
    seconds, order = _clock(time[good], stamp[good], q[good])
    rows = good[order]
    parts = np.split(np.arange(len(rows)), np.flatnonzero(np.diff(seconds) > BREAK) + 1)
    for part in parts:
        span = seconds[part[-1]] - seconds[part[0]]
        if span > 2 * HALF * STEP:
            yield _track(seconds[part], q[rows[part]], rows[part], turns)


def _clock(time: Times, stamp: Times, q: Floats) -> tuple[Floats, NDArray[np.intp]]:
    """Return increasing times (s) of messages and their order: by stamps, if these are better."""
    received = np.arange(len(time))
    by_stamp = np.argsort(stamp, kind='stable')
    distinct = np.count_nonzero(np.diff(stamp[by_stamp])) >= 0.9 * (len(stamp) - 1)
    if distinct and _roughness(q[by_stamp]) <= 1.001 * _roughness(q):
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
        column = np.unwrap(q[:, j], period=turn) if turn else q[:, j]
        kept = _changes(seconds, column)
        table[:, j] = np.interp(grid, seconds[kept], column[kept])
    place = np.searchsorted(seconds, grid, side='right') - 1
    gaps = np.append(np.diff(seconds), 0.0)[place] > GAP
    near = np.convolve(gaps, np.ones(2 * HALF + 1), 'same') > 0.0
    rate, acceleration = _fit(table)
    return Track(grid, table, rate, acceleration, rows[place], ~near & _inside(len(grid)))


def _inside(n: int) -> NDArray[np.bool_]:
    inside = np.zeros(n, np.bool_)
    inside[HALF : n - HALF] = True
    return inside


def _changes(seconds: Floats, q: Floats) -> NDArray[np.bool_]:
    """Return which positions (n,) are new, and the last ones of those that stood still."""
    new = np.append(True, np.diff(q) != 0.0)
    since = seconds[np.maximum.accumulate(np.where(new, np.arange(len(q)), 0))]
    kept = new.copy()
    kept[:-1] |= new[1:] & (seconds[:-1] - since[:-1] > STILL)
    kept[-1] = True
    return kept


def _fit(table: Floats) -> tuple[Floats, Floats]:
    """Return rates and accelerations (n, j) of positions on the grid, 0 at its ends."""
    cells = np.arange(-HALF, HALF + 1)
    t = cells * STEP
    square = t * t - (t * t).mean()
    slope, bend = t / (t @ t), 2.0 * square / (square @ square)
    rate, acceleration = np.zeros_like(table), np.zeros_like(table)
    inner = slice(HALF, len(table) - HALF)
    for j, q in enumerate(table.T):
        rate[inner, j] = np.convolve(q, slope[::-1], 'valid')
        bent = np.convolve(q, bend[::-1], 'valid')
        noise = _noise(q, np.abs(rate[:, j]))
        spread = SIGMAS * noise * float(np.sqrt(bend @ bend))
        acceleration[inner, j] = np.where(np.abs(bent) > spread, bent, 0.0)
    return rate, acceleration


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
