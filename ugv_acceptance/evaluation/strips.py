"""A run as strips for charts: twenty columns a second, each the worst of its stretch of time."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.rows import MarginRows
from ugv_acceptance.evaluation.settings import Settings

Floats = NDArray[np.float64]
WIDTH = 50_000_000


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

    def add(self, rows: MarginRows) -> None:
        """Take the next stretch of margins."""
        if not len(rows.time):
            return
        slots = rows.time // WIDTH
        first = np.flatnonzero(np.diff(slots, prepend=-1))
        last = np.append(first[1:], len(slots)) - 1
        size = np.abs(rows.torque)
        torque = [np.fmax.reduceat(column, first) for column in size.T]
        angle = np.fmin.reduceat(np.fmin.reduce(rows.angle, axis=1), first)
        q = rows.pairs.joints.q[rows.pairs.of_joints[last]]
        gone = ~np.logical_or.reduceat(rows.known, first)
        table = np.column_stack((*torque, np.where(gone, np.nan, angle), q))
        self._parts.append((rows.time[first], table.astype(np.float32)))

    def strips(self) -> Strips:
        """Return what was taken."""
        n = len(self.settings.joints)
        empty = (np.empty(0, np.int64), np.empty((0, 2 * n + 1), np.float32))
        parts = self._parts or [empty]
        time = np.concatenate([t for t, _ in parts])
        table = np.concatenate([x for _, x in parts]).astype(np.float64)
        return Strips((time - self.start) / 1e9, table[:, :n], table[:, n], table[:, n + 1 :])
