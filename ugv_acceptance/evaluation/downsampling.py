"""Thins a run to a bounded number of samples (Sampler) or of intervals for a chart (Strips)."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.type_aliases import Floats, Times

# Above this number of samples every second one is dropped, and the spacing is doubled.
MOST_SAMPLES = 40_000


@dataclass(slots=True)
class Sampler:
    """Keeps at most one known row per `spacing` (ns) and at most MOST_SAMPLES rows in all.

    A row is effort, torque, rate and position of the joints (j each) and gravity (3).
    """

    spacing: int
    _times: list[Times] = field(default_factory=list)
    _rows: list[Floats] = field(default_factory=list)
    _count: int = 0
    _slot: int = -1

    def add(self, rows: MarginRows, *, standing: bool = False) -> None:
        """Take the margins of the next part of the recording; `standing` skips a tipped robot."""
        if not len(rows.time):
            return
        slots = rows.time // self.spacing
        picked = np.flatnonzero(np.diff(slots, prepend=self._slot))
        self._slot = int(slots[-1])
        good = rows.weighed[picked]
        if standing:
            with np.errstate(invalid='ignore'):
                good &= ~(rows.angle[picked].min(axis=1) <= 0.0)
        picked = picked[good]
        if not len(picked):
            return
        joints, of = rows.pairs.joints, rows.pairs.of_joints[picked]
        gravity = rows.pairs.imu.gravity[rows.pairs.of_imu[picked]]
        parts = (joints.effort[of], rows.torque[picked], joints.qd[of], joints.q[of], gravity)
        self._times.append(rows.time[picked])
        self._rows.append(np.hstack(parts))
        self._count += len(picked)
        if self._count > MOST_SAMPLES:
            self._thin()

    def _thin(self) -> None:
        self._times = [np.concatenate(self._times)[::2].copy()]
        self._rows = [np.concatenate(self._rows)[::2].copy()]
        self._count, self.spacing = len(self._times[0]), 2 * self.spacing
        self._slot //= 2

    def samples(self, joints: int) -> tuple[Times, tuple[Floats, Floats, Floats, Floats, Floats]]:
        """Return times (n,) in ns and effort, torque, rate, position (n, j) and gravity (n, 3)."""
        empty = np.empty((0, 4 * joints + 3))
        time = np.concatenate([np.empty(0, np.int64), *self._times])
        table = np.concatenate([empty, *self._rows])
        effort, torque, rate, q, gravity = np.hsplit(table, [k * joints for k in range(1, 5)])
        return time, (effort, torque, rate, q, gravity)


WIDTH = 50_000_000
MOST_STRIPS = 150_000


@dataclass(frozen=True, slots=True)
class Strips:
    """A recording summed up in n short intervals, for charts: the worst margins of each.

    `time` (n,) in s since the start of the recording; `torque` (n, j) is the largest magnitude
    (N m; N), `angle` (n,) the smallest tilt left (rad), NaN where unknown; `q` (n, j) the last
    posture.
    """

    time: Floats
    torque: Floats
    angle: Floats
    q: Floats


@dataclass(slots=True)
class StripRecorder:
    """Builds Strips while a recording is read; `start` is the recording's start (ns).

    Intervals are 50 ms (WIDTH) long, and twice as long whenever there are over MOST_STRIPS.
    """

    settings: Settings
    start: int
    _parts: list[tuple[NDArray[np.int64], NDArray[np.float32]]] = field(default_factory=list)
    _count: int = 0
    _width: int = WIDTH

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording."""
        if not len(rows.time):
            return
        first, last = self._slots(rows.time)
        size = np.abs(rows.torque)
        torque = [np.fmax.reduceat(column, first) for column in size.T]
        angle = np.fmin.reduceat(np.fmin.reduce(rows.angle, axis=1), first)
        q = rows.pairs.joints.q[rows.pairs.of_joints[last]]
        gone = ~np.logical_or.reduceat(rows.known, first)
        table = np.column_stack((*torque, np.where(gone, np.nan, angle), q))
        self._parts.append((rows.time[first], table.astype(np.float32)))
        self._count += len(first)
        if self._count > MOST_STRIPS:
            self._merge()

    def _slots(self, time: NDArray[np.int64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the first and the last row of every interval."""
        first = np.flatnonzero(np.diff(time // self._width, prepend=-1))
        return first, np.append(first[1:], len(time)) - 1

    def _merge(self) -> None:
        """Make the intervals twice as long."""
        self._width *= 2
        n = len(self.settings.joints)
        time, table = self._all()
        first, last = self._slots(time)
        torque = np.fmax.reduceat(table[:, :n], first, axis=0)
        angle = np.fmin.reduceat(table[:, n], first)
        wide = np.column_stack((torque, angle, table[last, n + 1 :]))
        self._parts, self._count = [(time[first], wide)], len(first)

    def _all(self) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        none = (np.empty(0, np.int64), np.empty((0, 2 * len(self.settings.joints) + 1), np.float32))
        parts = self._parts or [none]
        return np.concatenate([t for t, _ in parts]), np.concatenate([x for _, x in parts])

    def strips(self) -> Strips:
        """Return the intervals recorded so far."""
        n = len(self.settings.joints)
        time, held = self._all()
        table = held.astype(np.float64)
        return Strips((time - self.start) / 1e9, table[:, :n], table[:, n], table[:, n + 1 :])
