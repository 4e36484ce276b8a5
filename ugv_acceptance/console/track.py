"""A recording's margins at the rate of a picture: a row each 50 ms, and its worst by stretches."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts import Rule
from ugv_acceptance.evaluation.rows import Floats, MarginRows, Times
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import SIDES

# Time between rows (ns), and stretches of a timeline.
STEP = 50_000_000
STRETCHES = 400


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Rows in order of `time` (n,) ns; the others as in MarginRows, of the named `joints`.

    `heard` (n, 2) is when a row's newest joint state and IMU message came (ns; -1: none yet).
    """

    joints: tuple[str, ...]
    time: Times
    known: NDArray[np.bool_]
    q: Floats
    effort: Floats
    gravity: Floats
    torque: Floats
    angle: Floats
    state: NDArray[np.int8]
    heard: Times

    def row(self, when: int) -> int:
        """Return the newest row at `when` (ns); -1 before the first."""
        return int(np.searchsorted(self.time, when, side='right')) - 1

    def worst_of(self, rule: Rule, start: int, when: int, peak: float) -> float:
        """Return the worst value of an alert from its start to `when` (ns), at most its `peak`.

        Of what is not in the track, the peak itself.
        """
        rows = slice(max(self.row(start), 0), self.row(when) + 1)
        if rule.code == 'TIP_OVER':
            values = -self.angle[rows, SIDES.index(rule.subject)]
        elif rule.code == 'TORQUE_LIMIT':
            values = np.abs(self.torque[rows, self.joints.index(rule.subject)])
        else:
            return peak
        known = values[np.isfinite(values)]
        return min(peak, max(float(known.max()), rule.on)) if len(known) else peak


@dataclass(slots=True)
class TrackMaker:
    """Takes stretches of margins, as a sink of `judge`, of a recording from `start` to `end` (ns).

    `tilt` (rad) is the least tilt left and `use` the largest share of a torque limit in each of
    STRETCHES equal parts of the recording; infinite and 0 where nothing is known.
    """

    settings: Settings
    start: int
    end: int
    tilt: Floats = field(default_factory=lambda: np.full(STRETCHES, np.inf))
    use: Floats = field(default_factory=lambda: np.zeros(STRETCHES))
    _parts: list[tuple[NDArray[np.generic], ...]] = field(default_factory=list)

    def __call__(self, rows: MarginRows) -> None:
        """Take the next stretch."""
        if not len(rows.time):
            return
        self._see_worst(rows)
        place = rows.time // STEP
        last = np.append(place[1:] != place[:-1], True)
        pairs = rows.pairs
        heard = np.stack([pairs.joints.time[pairs.of_joints], pairs.imu.time[pairs.of_imu]], axis=1)
        columns = (rows.time, rows.known, rows.q, rows.effort, rows.gravity)
        more = (rows.torque, rows.angle, rows.state, heard)
        self._parts.append(tuple(np.asarray(c)[last].copy() for c in (*columns, *more)))

    def track(self) -> Track:
        """Return what was gathered."""
        names = self.settings.robot.joint_names
        joints = len(names)
        if not self._parts:
            none, table = np.empty(0, np.int64), np.empty((0, joints))
            vectors, angles = np.empty((0, 3)), np.empty((0, 4))
            state, heard = np.empty(0, np.int8), np.empty((0, 2), np.int64)
            known = np.empty(0, np.bool_)
            return Track(names, none, known, table, table, vectors, table, angles, state, heard)
        columns = [np.concatenate(column) for column in zip(*self._parts, strict=True)]
        return Track(names, *columns)

    def _see_worst(self, rows: MarginRows) -> None:
        known = rows.known
        if not known.any():
            return
        share = (rows.time[known] - self.start) / max(self.end - self.start, 1)
        place = np.clip((share * STRETCHES).astype(np.int64), 0, STRETCHES - 1)
        limits = np.array(self.settings.limits.torque)
        use = (np.abs(rows.torque[known]) / limits).max(axis=1)
        np.fmin.at(self.tilt, place, rows.angle[known].min(axis=1))
        np.fmax.at(self.use, place, use)
