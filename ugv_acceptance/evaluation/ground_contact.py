"""Whether the arm stands on the ground: then margins that leave out its support are not valid.

One message at a time (`step`) or columns of a recording (`columns`), by the same rules. Where the
hand may touch the ground (`Settings.hand_may_touch`) only torques are not known.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts.state_machine import ERROR, Rule, Signal, feed, runs
from ugv_acceptance.evaluation.criteria.statement import NotChecked, Statement
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.clearance import Face, clearance, is_fixed, lowest_part, nearness_of
from ugv_acceptance.model.mechanics import Mechanics, Triple
from ugv_acceptance.model.row_selection import Values
from ugv_acceptance.model.stability import UNKNOWN
from ugv_acceptance.type_aliases import Floats, Times

# What follows for a message: margins hold; torques are not known; no margin is known.
FREE, PERMITTED, UNSUPPORTED = range(3)
# The value of the alert's signal while the arm is off the ground, or may touch it.
GOOD = -math.inf


@dataclass(slots=True)
class GroundContact:
    """Follows the clearance of the arm; `signal` is that of the alert ARM_ON_GROUND.

    `touching` says whether the arm was on the ground at the last message: from a clearance of
    `touches` on, until it is above `clear` (model/clearance.py). `start` (ns) is when the time
    windows of `settings` begin to count.
    """

    settings: Settings
    mechanics: Mechanics
    signal: Signal
    start: int = 0
    touching: bool = False
    _limits: Rule = field(init=False)
    _q: Sequence[float] = ()
    _load: Triple = (0.0, 0.0, 0.0)
    _moved: bool = False
    _face: Face = None
    _height: float = math.inf
    _at: tuple[float, ...] = ()
    _levers: tuple[float, ...] = ()
    _spare: float = -1.0

    def __post_init__(self) -> None:
        near = nearness_of(self.mechanics)
        self._limits = Rule('', '', ERROR, -near.touches, -near.clear, 0, 0)

    @property
    def clearance(self) -> float:
        """The clearance (m) of the newest joint positions; infinite without an arm."""
        return float(
            clearance(self.mechanics, self._face, self._q, self._load) if self._q else math.inf
        )

    def stands(self, q: Sequence[float], load: Triple) -> None:
        """Take joint positions (rad, m) that are known, and where the load is in its link (m)."""
        self._q, self._moved = q, True
        if load != self._load:
            self._load, self._spare = load, -1.0

    def step(self, now: int, face: Face = None) -> int:
        """Return what follows for the message at `now` (ns) of a robot that stands on `face`."""
        if self._moved or face != self._face:
            self._look(face)
        if not self.touching and self.signal.quiet:
            return FREE
        may = self.touching and bool(self._may_touch(now))
        bad = self.touching and not may
        if bad and not self.signal.raw:
            self.signal.detail = self.words(self._q, self._load)
        self.signal.step(now, -self._height if bad else GOOD)
        return UNSUPPORTED if bad else PERMITTED if may else FREE

    def _look(self, face: Face) -> None:
        """Compute the clearance, unless the joints moved too little since to bring the arm down."""
        self._moved = False
        if self._spare > 0.0 and face == self._face:
            moved = 0.0
            for lever, x, y in zip(self._levers, self._q, self._at, strict=True):
                moved += lever * abs(x - y)
            if moved < self._spare:
                return
        self._face, self._at = face, tuple(self._q)
        self._height = height = clearance(self.mechanics, face, self._q, self._load)
        if -height >= self._limits.on:
            self.touching = True
        elif -height < self._limits.off:
            self.touching = False
        idle = not self.touching and is_fixed(self.mechanics, face)
        self._spare = height + self._limits.on if idle else -1.0
        self._levers = nearness_of(self.mechanics, self._load).levers

    def columns(
        self,
        time: Times,
        known: NDArray[np.bool_],
        height: Floats,
        of: tuple[Floats, Sequence[Values], NDArray[np.intp]],
    ) -> NDArray[np.int8]:
        """Return what follows for each message (n,) at `time` (ns) from its clearance `height` (m).

        Messages that are not `known` have no margins anyway, and are FREE. `of` are positions and
        payload (mass, x, y, z) of joint rows, and each message's row.
        """
        found = np.full(len(time), FREE, np.int8)
        rows = np.flatnonzero(known)
        values = -height[rows]
        quiet = not self.touching and self.signal.quiet
        if quiet and not (values >= self._limits.on).any():
            return found
        down = np.zeros(len(rows), np.bool_)
        for first, last, bad in runs(self._limits, values, raw=self.touching):
            down[first:last] = bad
            self.touching = bad
        may = down & self._may_touch(time[rows])
        found[rows] = np.where(down, np.where(may, PERMITTED, UNSUPPORTED), FREE)
        worse = np.where(down & ~may, values, GOOD)
        feed(self.signal, time[rows], worse, lambda k: self._words_of(int(of[2][rows[k]]), *of[:2]))
        return found

    def _words_of(self, row: int, q: Floats, load: Sequence[Values]) -> str:
        x, y, z = (float(np.broadcast_to(number, len(q))[row]) for number in load[1:])
        return self.words(q[row].tolist(), (x, y, z))

    def _may_touch(self, time: Values) -> Any:  # noqa: ANN401 - a bool, or an array of them
        """Return whether the hand may touch the ground at a time (ns), or at times (n,)."""
        seconds = (time - self.start) / 1e9
        return sum((seconds >= a) & (seconds < b) for a, b in self.settings.hand_may_touch) > 0

    def words(self, q: Sequence[float], load: Triple) -> str:
        """Return which part of the arm is lowest in a posture."""
        return f'the lowest part is {lowest_part(self.mechanics, None, q, load)}'


@dataclass(slots=True)
class TouchExamination:
    """States for how long nobody knew torques because the hand might stand on the ground."""

    touched: int = 0
    _open: tuple[int, int] | None = None

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording."""
        if not len(rows.time):
            return
        self._close(int(rows.time[0]))
        if rows.touches.any():
            held = (rows.until - rows.time)[:-1]
            self.touched += int(held[rows.touches[:-1]].sum())
            if rows.touches[-1]:
                self._open = int(rows.time[-1]), int(rows.until[-1])

    def _close(self, now: int) -> None:
        if self._open is not None:
            self.touched += max(0, min(now, self._open[1]) - self._open[0])
        self._open = None

    def statement(self, start: int, end: int) -> Statement:  # noqa: ARG002 - an Examination
        """Return what was found in the recording that ends at `end` (ns)."""
        self._close(end)
        if not self.touched:
            return Statement()
        why = 'the hand may touch the ground, which then carries a part of the arm'
        return Statement(not_checked=(NotChecked('torques', why, self.touched / 1e9),))


def blanked(
    known: NDArray[np.bool_],
    margins: tuple[Floats, NDArray[np.int8]],
    touch: NDArray[np.int8],
    torques: int,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Take margins out where the arm stands on the ground; return what is known, and PERMITTED.

    `margins` are a table of rows, the first of them `torques`, and the states (n,).
    """
    table, state = margins
    permitted, unsupported = touch == PERMITTED, touch == UNSUPPORTED
    if touch.any():
        table[:torques, permitted] = np.nan
        table[:, unsupported] = np.nan
        state[unsupported] = UNKNOWN
    return known & ~unsupported, permitted
