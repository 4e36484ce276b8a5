"""Samples of a run at even times, never more than memory has room for, however long the run is."""

from dataclasses import dataclass, field

import numpy as np

from ugv_acceptance.evaluation.rows import Floats, MarginRows, Times

# Of more samples than this every second one is dropped, and as many fewer are taken from then on.
MOST = 40_000


@dataclass(slots=True)
class Sampler:
    """Keeps at most one row a slot of `spacing` (ns), and of more than MOST only every second.

    A row is `effort`, `torque`, `rate` and position of the joints (j each) and gravity (3).
    """

    spacing: int
    _times: list[Times] = field(default_factory=list)
    _rows: list[Floats] = field(default_factory=list)
    _count: int = 0
    _slot: int = -1

    def add(self, rows: MarginRows, *, standing: bool = False) -> None:
        """Take the next stretch of margins; with `standing` none of a robot that has tipped."""
        if not len(rows.time):
            return
        slots = rows.time // self.spacing
        picked = np.flatnonzero(np.diff(slots, prepend=self._slot))
        self._slot = int(slots[-1])
        good = rows.known[picked]
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
        if self._count > MOST:
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
