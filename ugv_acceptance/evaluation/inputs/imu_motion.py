"""Checks of an IMU that work in motion, live and recorded alike, and their alerts.

Messages are gathered on a grid (imu_grid.py); every second of them is judged by the same functions,
live as well as of a recording: gravity in the world, rates against the orientation, unit, mounting,
two sources. Only the check for frozen values looks at every message at once.
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ugv_acceptance.evaluation.alerts.state_machine import WARN, Signal
from ugv_acceptance.evaluation.inputs.imu_cell import (
    APART_FORCE,
    APART_TURN,
    FORCE_JUMPS,
    LARGEST,
    OK,
    PAIRS,
    TAU,
    TURN_JUMPS,
    WIDTH,
    A,
    Q,
)
from ugv_acceptance.evaluation.inputs.imu_frozen import FrozenCheck
from ugv_acceptance.evaluation.inputs.imu_gravity import WINDOWS, gravity_over
from ugv_acceptance.evaluation.inputs.imu_grid import GRID, HOP, LONGEST, ImuGrid
from ugv_acceptance.evaluation.inputs.imu_placing import WINDOW as PLACING
from ugv_acceptance.evaluation.inputs.imu_placing import Mounting, unit_over
from ugv_acceptance.evaluation.inputs.imu_rates import WINDOW as TURNING
from ugv_acceptance.evaluation.inputs.imu_rates import RatesFound, rates_of
from ugv_acceptance.evaluation.inputs.imu_sources import same_sign, suspected, two_sources
from ugv_acceptance.evaluation.inputs.imu_tally import Tally
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.type_aliases import Floats, Times

# Length of a hop (ns), and of a window that is searched for two sources (rows).
HOP_TIME = HOP * GRID
SOURCES = 20
# The number of mixed frame_ids among SOURCE_KINDS.
MIXED_FRAMES = 3.0
SOURCE_KINDS = (
    '',
    'its accelerations jump between two values',
    'its orientations jump between two values',
    'messages of two frame_ids alternate',
)
# A time (ns) before any message.
LONG_AGO = -(10**18)
# A stamp (ns) after any other: the first message of all begins a grid.
NO_STAMP = 2**62
# What a check reaches back beyond its window (ns): windows end only at hops.
SLACK = HOP_TIME
# So many hops in a row without a turn, in which acceleration and orientation agree, and an earlier
# contradiction of the rates is over: the robot may have been set up anew.
CALM = 5


@dataclass(frozen=True, slots=True)
class MotionSignals:
    """The signals of the checks; their values are numbers of kinds, that of gravity an angle (rad).

    `frozen`; `contradiction`: orientation against the mean acceleration; `rates`: the gyro's unit
    or axes; `rotation`: the orientation against the rates; `mounting`, `unit`, `sources`.
    """

    frozen: Signal
    contradiction: Signal
    rates: Signal
    rotation: Signal
    mounting: Signal
    unit: Signal
    sources: Signal

    def all(self) -> tuple[Signal, ...]:
        """Return the signals in order."""
        return (
            self.frozen, self.contradiction, self.rates, self.rotation, self.mounting, self.unit,
            self.sources,
        )  # fmt: skip


class Hop(NamedTuple):
    """What the windows show that end at a `row` of the grid: the sums of WINDOWS, and the rates.

    Of windows as long as the grid so far.
    """

    row: int
    sums: tuple[Sequence[float], ...]
    rates: RatesFound


def hops_of(grid: ImuGrid, rows: Sequence[int]) -> list[Hop]:
    """Return the hops that end at these rows of the grid, in order."""
    sums: list[tuple[Sequence[float], ...]] = [()] * len(rows)
    for length in WINDOWS:
        late = bisect_left(rows, length)
        for k, found in enumerate(grid.windows(rows[late:], length), late):
            sums[k] = (*sums[k], found)
    late = bisect_left(rows, TURNING)
    rates = [RatesFound()] * late + rates_of(grid, rows[late:])
    return list(map(Hop, rows, sums, rates))


@dataclass(slots=True)
class MotionChecks:
    """Takes the messages of an IMU; `lost` says that a fault makes gravity unknown now.

    `gyro_trusted` is False while the gyro contradicts the orientation. `tally` counts what was
    judged.
    """

    settings: Settings
    faults: MotionSignals
    lost: bool = False
    gyro_trusted: bool = True
    tally: Tally | None = None
    frozen: FrozenCheck = field(init=False)
    mounting: Mounting = field(init=False)
    _grid: ImuGrid = field(init=False)
    _window: list[Sequence[float]] = field(default_factory=list)
    _cell: list[float] = field(default_factory=list)
    _kept: Floats = field(default_factory=lambda: np.empty((WIDTH, 0)))
    _row_at: int = 0
    _tau: int = 0
    _due: int = GRID
    _time: int = LONG_AGO
    _stamp: int = NO_STAMP
    _began: int = LONG_AGO
    _busy: bool = False
    _varies: bool = True
    _frames: list[int] = field(default_factory=list)
    _before: list[float] = field(default_factory=lambda: [math.nan] * 3)
    _agrees: bool = False
    _calm: int = 0

    def __post_init__(self) -> None:
        self.frozen = FrozenCheck(self.faults.frozen)
        self.mounting = Mounting(self.settings.imu)
        self._varies = not self.settings.imu.noise_free
        self._grid = ImuGrid(self.settings.robot.gravity)

    def step(
        self,
        now: int,
        stamp: int,
        q: Sequence[float],
        w: Sequence[float],
        a: Sequence[float],
        told: bool,  # noqa: FBT001 - one of the values of a message
    ) -> None:
        """Take a message; `told` says whether its orientation is one that may be used."""
        passed = stamp - self._stamp
        if not 0 < passed <= LONGEST:
            passed = now - self._time
            if not 0 <= passed <= LONGEST:
                self._restart(now)
                passed = 0
        self._stamp, self._time = stamp, now
        self._tau = tau = self._tau + passed
        if self._varies:
            _, old_w, old_a = self.frozen.last
            if a != old_a or w != old_w:
                self.frozen.change(now, q, w, a)
            else:
                self.frozen.step(now, q, w, a)
                self._busy = self._busy or not self.faults.frozen.quiet
        x, y, z = w
        w2 = x * x + y * y + z * z
        x, y, z = a
        a2 = x * x + y * y + z * z
        if w2 < LARGEST and a2 < LARGEST:
            sample = (*q, *w, *a, told, w2, a2, 1.0, tau)
        else:
            sample = (*q, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, told, 0.0, 0.0, 0.0, tau)
        if tau >= self._due:
            self._close(now, sample)
        self._cell += sample
        if self._busy:
            self._look(now)

    def _close(self, now: int, sample: Sequence[float]) -> None:
        """Close the cell before a message, and judge the hops that end with it."""
        grid = self._grid
        last = grid.row
        grid.close(self._cell, sample)
        self._window.append(self._cell)
        self._cell = []
        row = grid.row
        self._due = (row + 1) * GRID
        for hop in hops_of(grid, range(last // HOP * HOP + HOP, row + 1, HOP)):
            self._judge(hop, now, self._recent)
            if hop.row % SOURCES == 0:
                self._window.clear()
        grid.trim()

    def _recent(self) -> Floats:
        """Return the samples of the newest window of two sources (n, WIDTH)."""
        return np.concatenate([np.array(cell) for cell in self._window]).reshape(-1, WIDTH)

    def frame(self, now: int) -> None:
        """Take that from `now` (ns) on the messages name another frame than before."""
        self._frames.append(now)

    def adopt(self, settings: Settings) -> None:
        """Judge by other settings from now on."""
        self.settings = settings
        self.mounting.imu = settings.imu
        self._varies = not settings.imu.noise_free

    def columns(self, time: Times, stamp: Times, x: Floats) -> None:
        """Take many messages in order of receipt, as `step` one at a time.

        `x` (WIDTH, n) are samples of imu_grid.py; their time is filled in here.
        """
        if self.tally is None:
            self.tally = Tally()
        if self._varies:
            self.frozen.columns(time, x[:OK])
        passed = np.diff(stamp, prepend=self._stamp)
        received = np.diff(time, prepend=self._time)
        passed = np.where((passed > 0) & (passed <= LONGEST), passed, received)
        starts = np.flatnonzero((passed < 0) | (passed > LONGEST)).tolist()
        places = [0, *starts, len(time)] if not starts or starts[0] else [*starts, len(time)]
        for a, b in pairwise(places):
            if a in starts:
                self._restart(int(time[a]))
                passed[a] = 0
            self._part(time[a:b], passed[a:b], x[:, a:b])
        self._stamp, self._time = int(stamp[-1]), int(time[-1])
        self._look(self._time)

    def _part(self, time: Times, passed: Times, x: Floats) -> None:
        """Take samples of one grid: judge all hops that end with one of them, keep the rest."""
        tau = self._tau + np.cumsum(passed)
        x[TAU] = tau
        self._tau = int(tau[-1])
        grid, at = self._grid, tau // GRID
        self._kept = np.concatenate((self._kept, x), axis=1)
        if at[-1] == grid.row:
            return
        last = grid.row
        # Up to the message that begins the newest row.
        end = self._kept.shape[1] - len(tau) + int(np.searchsorted(at, at[-1]))
        grid.extend(self._kept[:, self._row_at : end + 1])
        times = self._kept[TAU]
        rows = range(last // HOP * HOP + HOP, grid.row + 1, HOP)
        closed = time[np.searchsorted(tau, np.array(rows) * GRID)].tolist()
        for hop, now in zip(hops_of(grid, rows), closed, strict=True):
            self._judge(hop, now, partial(_part_of, self._kept, times, hop.row))
        grid.trim()
        self._due = (grid.row + 1) * GRID
        begins = np.searchsorted(times, grid.row // SOURCES * SOURCES * GRID)
        self._kept, self._row_at = self._kept[:, begins:], end - int(begins)

    def _restart(self, now: int) -> None:
        """Begin a grid anew, at a message after a gap at `now` (ns)."""
        if self._began == LONG_AGO:
            self._began = now
        self._grid = ImuGrid(self.settings.robot.gravity)
        self._kept, self._row_at = self._kept[:, :0], 0
        self._window.clear()
        self._cell.clear()
        self._tau, self._due = 0, GRID
        self._before = [math.nan] * 3

    def _judge(self, hop: Hop, now: int, recent: Callable[[], Floats]) -> None:
        """Judge a hop that ends at `now` (ns).

        `recent` gives the samples of the window that is searched for two sources.
        """
        of, tally, row, rates = self.faults, self.tally, hop.row, hop.rates
        unit = self._gravity(hop, now)
        source = self._sources(hop, now, recent)
        if tally:
            tally.others(unit, source)
            if row >= TURNING:
                tally.rates(rates)
        self._tell(of.unit, now, self._twice(0, unit))
        self._tell(of.rates, now, self._twice(1, rates.gyro))
        turn = self._twice(2, rates.orientation)
        calm = math.isnan(turn) and self._agrees
        self._calm = self._calm + 1 if calm else 0
        self._tell(of.rotation, now, 0.0 if self._calm >= CALM else turn)
        self._tell(of.sources, now, source)
        if row >= PLACING and (self.mounting.kind != 0.0 or not of.mounting.quiet):
            found = self.mounting.judge(self._grid, row, now)
            self._tell(of.mounting, now, found, now - self._began)

    def _gravity(self, hop: Hop, now: int) -> float:
        """Tell where orientation and mean acceleration differ; return the unit of the latter.

        Of windows of several lengths the shortest is told.
        """
        unit = angle = math.nan
        reach, g = 0, self._grid.g
        for rows, d in zip(WINDOWS, hop.sums, strict=False):
            if rows == PLACING:
                unit = unit_over(d, g)
            found = gravity_over(d, rows, g)
            if found is None:
                continue
            if self.tally:
                self.tally.gravity[rows].add(found)
            if found.angle > 0.0 and not angle > 0.0:
                reach = rows * GRID + SLACK
            angle = found.angle if not angle > found.angle else angle
        self._tell(self.faults.contradiction, now, angle, reach)
        self._agrees = angle == 0.0
        return unit

    def _sources(self, hop: Hop, now: int, recent: Callable[[], Floats]) -> float:
        """Return the number of SOURCE_KINDS; NaN where two sources were not looked for."""
        found = math.nan
        if hop.row % SOURCES == 0:
            d = hop.sums[WINDOWS.index(SOURCES)]
            found = 0.0
            if suspected(d[PAIRS], d[FORCE_JUMPS]):
                found = 1.0 if two_sources(recent()[:, A], APART_FORCE) else 0.0
            if found == 0.0 and suspected(d[PAIRS], d[TURN_JUMPS]):
                x = recent()
                told = bool((x[:, OK] != 0.0).all())
                found = 2.0 if told and two_sources(same_sign(x[:, Q]), APART_TURN) else 0.0
        last = bisect_right(self._frames, now)
        if last > 1 and self._frames[last - 2] > now - SOURCES * GRID:
            found = MIXED_FRAMES
        if last > 2:
            del self._frames[: last - 2]
        return found

    def _twice(self, which: int, kind: float) -> float:
        """Return the kind of a fault if the hop before showed one as well; 0 counts at once."""
        before, self._before[which] = self._before[which], kind
        return math.nan if kind > 0.0 and not before > 0.0 else kind

    def _tell(self, signal: Signal, now: int, value: float, reach: int | None = None) -> None:
        """Give a signal the value of a hop; an alert reaches back as far as `reach` (ns)."""
        if signal.quiet and not value > 0.0:
            return
        if reach and value > 0.0 and signal.alert is None and signal.rule.level > WARN:
            signal.judge_by(replace(signal.rule, reach=reach))
        signal.step(now, value)
        self._busy = True

    def _look(self, now: int) -> None:
        """Let time pass for the signals, and see which faults there are."""
        lost, busy = False, False
        for signal in self.faults.all():
            signal.advance(now)
            busy = busy or not signal.quiet
            lost = lost or (signal.alert is not None and signal.alert.rule.level > WARN)
        self.lost, self._busy = lost, busy
        self.gyro_trusted = self.faults.rates.alert is None and self.faults.rotation.alert is None


def _part_of(x: Floats, times: Floats, row: int) -> Floats:
    """Return the samples (n, WIDTH) of the window of two sources that ends at a row of the grid.

    `x` (WIDTH, n) are samples at `times` (n,).
    """
    start, end = np.searchsorted(times, ((row - SOURCES) * GRID, row * GRID))
    return np.ascontiguousarray(x[:, start:end].T)
