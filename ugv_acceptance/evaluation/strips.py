"""A run as strips for charts: twenty columns a second, each the worst of its stretch of time.

Of a long run there are fewer: whenever there are more than MOST, two become one.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.rows import MarginRows
from ugv_acceptance.evaluation.settings import Settings

Floats = NDArray[np.float64]
WIDTH = 50_000_000
MOST = 150_000


@dataclass(frozen=True, slots=True)
class Strips:
    """Columns (n,) in order of time: `time` in s since the start of the recording.

    `torque` (n, j) is the largest magnitude (N m; N), `angle` (n,) the smallest tilt left (rad),
    NaN where unknown; `q` (n, j) the last posture.
    """

    time: Floats
    torque: Floats
    angle: Floats
    q: Floats


@dataclass(slots=True)
class StripRecorder:
    """Takes margins stretch by stretch; `start` is the recording's start (ns)."""

    settings: Settings
    start: int
    _parts: list[tuple[NDArray[np.int64], NDArray[np.float32]]] = field(default_factory=list)
    _count: int = 0
    _width: int = WIDTH

    def add(self, rows: MarginRows) -> None:
        """Take the next stretch of margins."""
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
        if self._count > MOST:
            self._merge()

    def _slots(self, time: NDArray[np.int64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the first and the last row of every column."""
        first = np.flatnonzero(np.diff(time // self._width, prepend=-1))
        return first, np.append(first[1:], len(time)) - 1

    def _merge(self) -> None:
        """Make columns twice as wide."""
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
        """Return what was taken."""
        n = len(self.settings.joints)
        time, held = self._all()
        table = held.astype(np.float64)
        return Strips((time - self.start) / 1e9, table[:, :n], table[:, n], table[:, n + 1 :])
