"""Joint rates from positions, where the reported ones are missing or contradict the positions.

Once in a CELL of time a joint's position is compared with that of the cell before: its slope. The
reported rate over the same time must be about the same: then it is proven as soon as the joint
moves. One that differs (deg/s, always 0, another gear) is doubted until it agrees in motion, and
the slope takes its place.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.type_aliases import Floats, Times

# Time (ns) of a cell; a slope needs two positions at least SHORT and at most LONG (ns) apart.
CELL, SHORT, LONG = 200_000_000, 100_000_000, 2_000_000_000
# Stamps give the time between two positions if it differs by at most this (ns) from that of
# receipt.
TOGETHER = 250_000_000
# Two rates contradict each other if they differ by more than SHARE of the larger one and FLOOR
# (rad/s, m/s). Below twice the FLOOR nothing is proven.
SHARE, FLOOR = 0.5, 0.1
# A position that stands still to the last bit for so many cells, while a rate that was proven keeps
# telling of a motion (rad/s, m/s), by so much in all (rad, m), is not that of the joint.
STILL, SLOWEST, STUCK = 5, 0.05, 0.2
NEVER = -1
DOUBTED, UNPROVEN, PROVEN = -1, 0, 1


Mask = NDArray[np.bool_]


@dataclass(slots=True)
class JointRate:
    """The slope of one joint's positions, and whether its reported rate can be believed.

    `turn` is the angle (rad) after which positions may be wrapped, 0: they are not. `doubted` is
    the number of cells in which the reported rate contradicted the positions, `factor` by how much
    it last was larger (NaN: not known). Of columns, `stuck` is the largest motion (rad, m) that a
    rate told, once proven, while the position stood still, and `stuck_at` the end of it (ns).
    """

    turn: float
    cell: int = NEVER
    slope: float = math.nan
    trust: int = UNPROVEN
    doubted: int = 0
    factor: float = math.nan
    stuck: float = 0.0
    stuck_at: int = NEVER
    _proven: bool = False
    _still: dict[int, tuple[float, int]] = field(default_factory=dict)
    _time: int = NEVER
    _stamp: int = 0
    _q: float = math.nan
    _reported: float = math.nan

    def step(self, now: int, stamp: int, q: float, reported: float) -> None:
        """Take the first message of a cell that names the joint (ns; rad, rad/s; m, m/s)."""
        self.cell = now // CELL
        if not math.isfinite(q):
            self.slope = math.nan
            return
        time, apart, ticks = self._time, now - self._time, stamp - self._stamp
        way, mean = q - self._q, (reported + self._reported) / 2.0
        self._time, self._stamp, self._q, self._reported = now, stamp, q, reported
        span = ticks if abs(ticks - apart) <= TOGETHER and ticks >= SHORT else apart
        if time == NEVER or apart > LONG:
            self.slope = math.nan
        elif span >= SHORT:
            self._judge(way, span / 1e9, mean)

    def _judge(self, way: float, seconds: float, mean: float) -> None:
        plain = way / seconds
        wrapped = (way - self.turn * round(way / self.turn)) / seconds if self.turn else plain
        same = _agree(mean, wrapped)
        whole = not same and _agree(mean, plain)
        self.slope = plain if whole else wrapped
        if mean == mean:  # noqa: PLR0124 - not NaN
            if not (same or whole):
                self.trust, self.doubted = DOUBTED, self.doubted + 1
                self.factor = mean / self.slope if self.slope else math.nan
            elif max(abs(mean), abs(self.slope)) > 2.0 * FLOOR:
                self.trust = PROVEN

    def best(self, reported: float) -> tuple[float, float]:
        """Return the joint's rate (rad/s, m/s) and its speed, from what a message reports.

        The rate is as reported, unless that is missing (NaN) or doubted: then it is the slope. The
        speed is as reported only if that is proven. NaN where neither is known.
        """
        if reported != reported:  # noqa: PLR0124 - NaN
            return self.slope, self.slope
        rate = self.slope if self.trust == DOUBTED else reported
        return rate, reported if self.trust == PROVEN else self.slope

    def columns(
        self, time: Times, stamp: Times, q: Floats, reported: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Take all messages that name the joint (n,); return `best` after each, and the slope."""
        firsts = np.flatnonzero(np.diff(time // CELL, prepend=self.cell))
        slopes, trusts = self._cells(time[firsts], stamp[firsts], q[firsts], reported[firsts])
        times = np.diff(np.concatenate(([0], firsts, [len(time)])))
        slope, trust = np.repeat(slopes, times), np.repeat(trusts, times)
        told = ~np.isnan(reported)
        return (
            np.where(told & (trust != DOUBTED), reported, slope),
            np.where(told & (trust == PROVEN), reported, slope),
            slope,
        )

    def _cells(
        self, time: Times, stamp: Times, q: Floats, reported: Floats
    ) -> tuple[Floats, NDArray[np.int64]]:
        """Take the first messages of cells (n,): `slope` and `trust` (n + 1,) before and after."""
        good = np.isfinite(q)
        slopes, trusts = np.full(len(q), np.nan), np.zeros(len(q), np.int64)
        kept = np.zeros(len(q), np.bool_)
        if good.any():
            found = self._judged(time[good], stamp[good], q[good], reported[good])
            slopes[good], trusts[good], kept[good] = found
        slopes, trusts = np.append(self.slope, slopes), np.append(self.trust, trusts)
        rows = np.arange(len(slopes))
        slopes = slopes[np.maximum.accumulate(np.where(np.append(False, kept), 0, rows))]
        trusts = trusts[np.maximum.accumulate(np.where(trusts != UNPROVEN, rows, 0))]
        if len(q):
            self.cell = int(time[-1]) // CELL
            self.slope, self.trust = float(slopes[-1]), int(trusts[-1])
        return slopes, trusts

    def _judged(
        self, time: Times, stamp: Times, q: Floats, reported: Floats
    ) -> tuple[Floats, NDArray[np.int64], NDArray[np.bool_]]:
        """Return slopes (n,), what they say of reported rates, and which stay as they were."""
        times, q = np.append(self._time, time), np.append(self._q, q)
        stamp, reported = np.append(self._stamp, stamp), np.append(self._reported, reported)
        self._time, self._stamp = int(times[-1]), int(stamp[-1])
        self._q, self._reported = float(q[-1]), float(reported[-1])
        apart, ticks, way = np.diff(times), np.diff(stamp), np.diff(q)
        mean = (reported[1:] + reported[:-1]) / 2.0
        span = np.where((np.abs(ticks - apart) <= TOGETHER) & (ticks >= SHORT), ticks, apart)
        fresh = (times[:-1] == NEVER) | (apart > LONG)
        judged = ~fresh & (span >= SHORT)
        seconds = np.where(judged, span, SHORT) / 1e9
        plain = way / seconds
        turn = self.turn
        wrapped = (way - turn * np.round(way / turn)) / seconds if turn else plain
        same = _agrees(mean, wrapped)
        whole = ~same & _agrees(mean, plain)
        slope = np.where(whole, plain, wrapped)
        wrong = judged & ~(same | whole) & ~np.isnan(mean)
        right = judged & (same | whole)
        right &= np.maximum(np.abs(mean), np.abs(slope)) > 2.0 * FLOOR
        if wrong.any():
            last = int(np.flatnonzero(wrong)[-1])
            self.doubted += int(wrong.sum())
            self.factor = float(mean[last] / slope[last]) if slope[last] else math.nan
        if len(q) > 1:
            gone = np.where(fresh, np.inf, np.where(judged, way, np.nan))
            self._stand(times[1:], gone, mean, seconds, right)
        says = np.where(wrong, DOUBTED, np.where(right, PROVEN, UNPROVEN))
        return np.where(fresh, np.nan, slope), says, ~fresh & ~judged

    def _stand(self, time: Times, way: Floats, rate: Floats, seconds: Floats, right: Mask) -> None:
        """Take cells (n,): way (rad, m) in so many seconds, the mean `rate` told, if it is `right`.

        Cells that tell nothing (way NaN) neither end a standstill nor count.
        """
        proven = np.logical_or.accumulate(right) | self._proven
        self._proven = bool(proven[-1])
        stands = (way == 0.0) & proven
        for sign in (1, -1):
            still = stands & (sign * rate >= SLOWEST)
            ends = ~np.isnan(way) & ~still
            sums, cells = np.cumsum(np.where(still, sign * rate * seconds, 0.0)), np.cumsum(still)
            last = np.maximum.accumulate(np.where(ends, np.arange(len(ends)), NEVER))
            before, number = self._still.get(sign, (0.0, 0))
            sums -= np.where(last == NEVER, -before, sums[last])
            cells -= np.where(last == NEVER, -number, cells[last])
            self._still[sign] = float(sums[-1]), int(cells[-1])
            most = np.where(cells >= STILL, sums, 0.0)
            at = int(most.argmax())
            if most[at] > self.stuck:
                self.stuck, self.stuck_at = float(most[at]), int(time[at])


def _agree(a: float, b: float) -> bool:
    """Return whether two rates are about the same; False if one is not known."""
    return abs(a - b) <= SHARE * max(abs(a), abs(b)) + FLOOR


def _agrees(a: Floats, b: Floats) -> NDArray[np.bool_]:
    """Return `_agree` of many rates (n,)."""
    found: NDArray[np.bool_] = abs(a - b) <= SHARE * np.maximum(abs(a), abs(b)) + FLOOR
    return found
