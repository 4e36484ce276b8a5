"""Implausible jumps of joint positions: another unit, another joint, or two robots.

Once a second every joint's position is compared with that of the second before: one that moved
faster than the joint can has another unit or belongs to another joint, and is unknown. So is one
that jumps back and forth between messages: two robots publish the same joint.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ugv_acceptance.evaluation.alerts.state_machine import Signal
from ugv_acceptance.evaluation.inputs.joint_rows import NEVER, Indices, Layout, Mask
from ugv_acceptance.evaluation.inputs.turns import ABSURD, Turns, beyond
from ugv_acceptance.model.row_selection import Values
from ugv_acceptance.type_aliases import Floats, Times

# Positions are compared once in every SECOND (ns), if at least APART (ns) lies between them.
SECOND, APART = 1_000_000_000, 500_000_000
# Two messages may hold positions measured up to SHORTEST (ns) further apart than their receipt: one
# was late, or overtook the other. A joint that was homed jumps once, a wrong reading twice (there
# and back); MANY jumps within a second mean two publishers.
SHORTEST, MANY = 10_000_000, 3


@dataclass(slots=True)
class Leaps:
    """Finds implausible jumps. `signals` (j,) are those of the joints (empty: none is looked for).

    `turn` (j,) is the angle (rad) after which positions may be wrapped, 0: they are not. `told`
    (j,) are the newest positions that were believed, `most` (j,) is how far (rad, m) a joint can
    move between two messages received at the same time, `busy` says that a signal is not quiet.
    """

    signals: Sequence[Signal]
    turns: Turns
    turn: list[float]
    told: list[float] = field(init=False)
    most: list[float] = field(init=False)
    busy: bool = False
    _before: list[tuple[int, float]] = field(init=False)
    _jumps: list[int] = field(init=False)

    def __post_init__(self) -> None:
        n = len(self.turn)
        self._before = [(NEVER, math.nan)] * n
        self.told, self._jumps = [math.nan] * n, [0] * n
        self.most = [s.rule.on * SHORTEST / SECOND for s in self.signals] or [math.inf] * n

    def place(self, j: int, q: float, apart: int) -> None:
        """Take the position of joint j (NaN: unknown), `apart` (ns) after the one before."""
        way = abs(q - self.told[j])
        if way > self.most[j] and self._jumped(j, way, apart):
            self._jumps[j] += 1
        self.told[j] = q

    def look(self, now: int, layout: Layout, q: list[float]) -> None:
        """Check the joints that a message named for jumps; `q` (j,) becomes NaN where one is."""
        if now // SECOND != layout.second:
            layout.second = now // SECOND
            for j, _ in layout.pairs:
                self._compare(j, now, self._seen_at(j, self.turns.told[j], q[j]))
        for j, _ in layout.pairs:
            if self.signals:
                self.signals[j].advance(now)
                if self.signals[j].alert is not None:
                    q[j] = math.nan
        self.busy = not all(signal.quiet for signal in self.signals)

    def _seen_at(self, j: int, told: float, q: float) -> float:
        """Return the position of joint j that is compared with others: also beyond a turn."""
        return told if self.turns.joints[j].limited and abs(told) <= ABSURD else q

    def _compare(self, j: int, now: int, q: float) -> None:
        """Compare joint j's position with that of the second before; a full turn may be wrapped."""
        then, before = self._before[j]
        if not self.signals or math.isnan(q) or (then != NEVER and now - then < APART):
            return
        self._before[j] = now, q
        jumps, self._jumps[j] = self._jumps[j], 0
        if then != NEVER:
            way = abs(q - before)
            rate = min(way, abs(way - self.turn[j])) / (now - then) * SECOND
            rate = beyond(self.signals[j], rate, self.turns.joints[j], q)
            self.signals[j].step(now, max(rate, self.signals[j].on if jumps >= MANY else 0.0))

    def _jumped(self, j: int, way: Values, apart: Values) -> Values:
        """Return whether joint j cannot have moved by `way` (rad, m; wrapped) in `apart` (ns)."""
        way = np.minimum(way, abs(way - self.turn[j]))
        return way > self.most[j] * np.maximum(apart / SHORTEST, 1.0)

    def columns(
        self,
        time: Times,
        raw: Floats,
        q: Floats,
        named: Mask,
        rows_of: Sequence[tuple[Layout, Indices]],
        seen: Sequence[int],
    ) -> None:
        """Check the positions (j, n) for implausible jumps, as `look` does for each message.

        Positions with a jump become NaN in place. `raw` (j, n) are they as told, `named` says by
        which messages; `rows_of` pairs each layout with its rows; `seen` (j,) is when each joint
        was told before (ns).
        """
        jumps = [self._rows(j, time, q[j], named[j], seen[j]) for j in range(len(q))]
        if not self.signals or not len(time):
            return
        before, logged = [s.alert for s in self.signals], len(self.signals[0].log)
        looks: list[tuple[int, int]] = []
        for layout, rows in rows_of:
            seconds = time[rows] // SECOND
            firsts = rows[np.flatnonzero(np.diff(seconds, prepend=layout.second))]
            layout.second = int(seconds[-1])
            looks += [(row, j) for row in firsts.tolist() for j, _ in layout.pairs]
        for row, j in sorted(looks):
            if len(jumps[j]):
                count = int(np.searchsorted(jumps[j], row, 'right'))
                self._jumps[j], jumps[j] = self._jumps[j] + count, jumps[j][count:]
            at = self._seen_at(j, float(raw[j, row]), float(q[j, row]))
            self._compare(j, int(time[row]), at)
        for j, signal in enumerate(self.signals):
            self._jumps[j] += len(jumps[j])
            signal.advance(int(time[-1]))
            for alert in [before[j], *signal.log[logged:]]:
                if alert is not None and alert.rule is signal.rule:
                    end = np.inf if alert.end is None else alert.end
                    q[j, (time >= alert.start) & (time < end)] = np.nan
        self.busy = not all(signal.quiet for signal in self.signals)

    def _rows(self, j: int, time: Times, q: Floats, named: Mask, seen: int) -> Indices:
        """Return the rows at which joint number j jumps, as `place` counts them."""
        rows = np.arange(len(q)) if named.all() else np.flatnonzero(named)
        if not len(rows):
            return rows
        told = q if len(rows) == len(q) else q[rows]
        newest, self.told[j] = self.told[j], float(told[-1])
        if self.most[j] == math.inf:
            return rows[:0]
        far = np.flatnonzero(np.abs(told[1:] - told[:-1]) > self.most[j]) + 1
        if abs(told[0] - newest) > self.most[j]:
            far = np.concatenate(([0], far))
        before = np.where(far > 0, told[far - 1], newest)
        apart = time[rows[far]] - np.where(far > 0, time[rows[far - 1]], seen)
        return rows[far[self._jumped(j, np.abs(told[far] - before), apart)]]
