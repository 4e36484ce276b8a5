"""A recording's margins reduced for display: a row each 50 ms, and the worst of each part."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.console.snapshot import Countdown
from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.monitoring.trends import LEAST, SPAN, ahead_of
from ugv_acceptance.type_aliases import Floats, Times

# Time between rows (ns), and parts of a timeline.
STEP = 50_000_000
STRETCHES = 400
# Time (ns) before a moment over which the rate of an input is taken.
WINDOW = 3_000_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Rows in order of `time` (n,) ns; other columns as in MarginRows, for the named `joints`.

    `heard` (n, 2) is when a row's newest joint state and IMU message came (ns; -1: none yet), and
    `taken` (n, 2) how many had come by then.
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
    taken: Times

    def row(self, when: int) -> int:
        """Return the index of the newest row at `when` (ns); -1 before the first."""
        return int(np.searchsorted(self.time, when, side='right')) - 1

    def worst_of(self, alert: Alert, when: int) -> tuple[float, int | None]:
        """Return an alert's worst value up to `when` (ns) and when it came (ns; None: not known).

        Of a value that is not in the track its worst of all times.
        """
        rule, peak, at = alert.rule, alert.peak, alert.worst_at
        if at is not None and at <= when:
            return peak, at
        rows = slice(max(self.row(alert.start), 0), self.row(when) + 1)
        if rule.code == 'TIP_OVER':
            values = -self.angle[rows, SIDES.index(rule.subject)]
        elif rule.code == 'TORQUE_LIMIT':
            values = np.abs(self.torque[rows, self.joints.index(rule.subject)])
        else:
            return peak, None
        known = np.isfinite(values)
        if not known.any():
            return peak, None
        k = int(np.argmax(np.where(known, values, -np.inf)))
        return min(peak, max(float(values[k]), rule.on)), int(self.time[rows][k])

    def last_known(self, k: int) -> int:
        """Return the newest row up to row `k` whose margins are known; -1 if there is none."""
        back = self.known[k::-1] if k >= 0 else self.known[:0]
        return k - int(np.argmax(back)) if back.any() else -1

    def countdown(self, settings: Settings, k: int) -> Countdown | None:
        """Return the margin that is used up first at row `k`, by the last second before it."""
        first = int(np.searchsorted(self.time, self.time[k] - SPAN, side='right'))
        if k + 1 - first < LEAST or not self.known[first : k + 1].all():
            return None
        rows = slice(first, k + 1)
        seconds = (self.time[rows] - self.time[k]) / 1e9
        tilt, torque = (table[rows].T.tolist() for table in (self.angle, self.torque))
        soon = ahead_of(settings, seconds.tolist(), tilt, torque)
        if not soon:
            return None
        return Countdown(soon[0].subject in SIDES, soon[0].subject, soon[0].seconds)


def rate_at(when: int, heard: Times, taken: Times, since: int = 0) -> float:
    """Return an input's message rate (Hz) at `when` (ns), over the WINDOW before.

    `heard` (n,) is when messages came (ns, in order; negative: none yet), `taken` (n,) how many had
    come by then. At least the last two messages count, but none before `since` (ns), when a gap
    ended. NaN after a single one; 0 after a silence of two periods.
    """
    k = int(np.searchsorted(heard, when, side='right')) - 1
    if k < 0 or heard[k] < 0:
        return 0.0
    before = int(np.searchsorted(heard, heard[k])) - 1
    window = int(np.searchsorted(heard, heard[k] - WINDOW, side='right')) - 1
    start = max(min(window, before), int(np.searchsorted(heard, since)))
    span = int(heard[k] - heard[start])
    rate = float(taken[k] - taken[start]) * 1e9 / span if span > 0 else math.nan
    return 0.0 if (when - int(heard[k])) * rate > 2e9 else rate


@dataclass(slots=True)
class TrackMaker:
    """Collects the margins of a recording from `start` to `end` (ns), as a sink of `judge`.

    `tilt` (rad) is the least tilt left and `use` the largest share of a torque limit in each of
    STRETCHES equal parts of the recording; infinite and 0 where nothing is known.
    """

    settings: Settings
    start: int
    end: int
    tilt: Floats = field(default_factory=lambda: np.full(STRETCHES, np.inf))
    use: Floats = field(default_factory=lambda: np.zeros(STRETCHES))
    _parts: list[tuple[NDArray[np.generic], ...]] = field(default_factory=list)
    _taken: Times = field(default_factory=lambda: np.zeros(2, np.int64))

    def __call__(self, rows: MarginRows) -> None:
        """Take the margins of the next part."""
        if not len(rows.time):
            return
        self._see_worst(rows)
        place = rows.time // STEP
        last = np.append(place[1:] != place[:-1], True)
        pairs = rows.pairs
        heard = np.stack([pairs.joints.time[pairs.of_joints], pairs.imu.time[pairs.of_imu]], axis=1)
        # The first rows of a part may repeat the newest of the part before.
        taken = self._taken + np.stack([pairs.of_joints, pairs.of_imu], axis=1)
        self._taken = taken[-1]
        columns = (rows.time, rows.known, rows.q, rows.effort, rows.gravity)
        more = (rows.torque, rows.angle, rows.state, heard, taken)
        self._parts.append(tuple(np.asarray(c)[last].copy() for c in (*columns, *more)))

    def track(self) -> Track:
        """Return the track of all margins taken so far."""
        names = self.settings.robot.joint_names
        joints = len(names)
        if not self._parts:
            none, table = np.empty(0, np.int64), np.empty((0, joints))
            vectors, angles = np.empty((0, 3)), np.empty((0, 4))
            state, pairs = np.empty(0, np.int8), np.empty((0, 2), np.int64)
            known, free = np.empty(0, np.bool_), (angles, state, pairs, pairs)
            return Track(names, none, known, table, table, vectors, table, *free)
        columns = [np.concatenate(column) for column in zip(*self._parts, strict=True)]
        return Track(names, *columns)

    def _see_worst(self, rows: MarginRows) -> None:
        known = rows.known
        if not known.any():
            return
        share = (rows.time[known] - self.start) / max(self.end - self.start, 1)
        place = np.clip((share * STRETCHES).astype(np.int64), 0, STRETCHES - 1)
        limits = np.array(self.settings.limits.torque)
        np.fmin.at(self.tilt, place, rows.angle[known].min(axis=1))
        if len(limits):
            np.fmax.at(self.use, place, (np.abs(rows.torque[known]) / limits).max(axis=1))
