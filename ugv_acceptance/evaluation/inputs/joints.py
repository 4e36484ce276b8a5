"""From JointState messages to the robot's joints: names, signs, offsets, partial messages merged.

Implausible jumps are found as well. Once a second every joint's position is compared with that of
the second before: one that moved faster than the joint can has another unit or belongs to another
joint, and is unknown. So is one that jumps back and forth between messages: two robots publish the
same joint.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts.state_machine import Signal
from ugv_acceptance.evaluation.inputs.joint_rates import CELL, DOUBTED, PROVEN, JointRate
from ugv_acceptance.evaluation.inputs.joint_words import (
    foreign_words,
    missing_words,
    unusable_words,
)
from ugv_acceptance.evaluation.inputs.repeats import Repeats
from ugv_acceptance.evaluation.inputs.turns import ABSURD, FULL, Turns, beyond, turning_of
from ugv_acceptance.evaluation.samples import JointStateColumns
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Joint
from ugv_acceptance.model.row_selection import Values
from ugv_acceptance.type_aliases import Floats, Times

Mask = NDArray[np.bool_]
Indices = NDArray[np.intp]

# A position further than this (rad or m) beyond a joint's limits is not the joint's.
BEYOND = 0.1
NEVER = -1
# Positions are compared once in every SECOND (ns), if at least APART (ns) lies between them.
SECOND, APART = 1_000_000_000, 500_000_000
# Two messages may hold positions measured up to SHORTEST (ns) further apart than their receipt: one
# was late, or overtook the other. A joint that was homed jumps once, a wrong reading twice (there
# and back); MANY jumps within a second mean two publishers.
SHORTEST, MANY = 10_000_000, 3


@dataclass(frozen=True, slots=True)
class JointRows:
    """Merged joint states, one row a message that names at least one of the robot's joints.

    `q` (n, j) in rad (m) is NaN where a joint is unknown or its value unusable; `qd` in rad/s (m/s)
    and `effort` in N m (N) where not reported or implausible; `oldest` (n,) is the receipt time
    (ns) of the oldest position in the row; `unusable` (n,) marks a value that cannot be used.
    Rates that are not reported, or contradict the positions, are those of the positions.
    """

    time: Times
    stamp: Times
    q: Floats
    qd: Floats
    effort: Floats
    oldest: Times
    unusable: Mask


@dataclass(slots=True)
class Layout:
    """Where the robot's joints stand in messages with one list of names.

    `pairs` are (joint number, place in the message); `second` is the last second in which their
    positions were checked for jumps, `cell` the last cell of time (joint_rates.py) with a message,
    `first` when such a message first came (ns).
    """

    pairs: list[tuple[int, int]]
    second: int = NEVER
    cell: int = NEVER
    first: int = NEVER
    repeats: Repeats = field(default_factory=Repeats)


@dataclass(frozen=True, slots=True)
class Told:
    """What messages (n,) of a batch told, beside their JointRows.

    `repeated` (n,) are the seconds for which the message is repeated (0: it is new), `repeating`
    says that some joint's newest message is; `speed` (n, j) are rates to be believed, NaN where
    unknown. The rest is for words: positions (n, j), and as told (j, n), which were named, those
    told before the batch, and when each was received.
    """

    repeated: Floats
    repeating: Mask
    speed: Floats
    q: Floats
    raw: Floats
    named: Mask
    before: list[float]
    seen: list[Times]


@dataclass(slots=True)
class JointMerger:
    """Merges JointState messages: the newest position, rate and effort of every joint.

    In the robot's convention (sign and offset applied). `jump_signals` are the joints' signals for
    implausible jumps; while one has an alert, the position of its joint is unknown. `seen` (j,) is
    when each joint was last received (ns), `speed` (j,) its rate where that can be believed.
    `repeated` is for how many seconds the newest message is repeated, `repeating` how many lists of
    names have such a message. `told` is what the last batch told, `rates` (j,) tell which reported
    rates can be believed.
    """

    settings: Settings
    jump_signals: Sequence[Signal] = ()
    q: list[float] = field(init=False)
    qd: list[float] = field(init=False)
    effort: list[float] = field(init=False)
    speed: list[float] = field(init=False)
    seen: list[int] = field(init=False)
    repeated: float = 0.0
    repeating: int = 0
    told: Told = field(init=False)
    _layouts: dict[tuple[str, ...], Layout] = field(default_factory=dict)
    _range: list[tuple[float, float]] = field(init=False)
    _before: list[tuple[int, float]] = field(init=False)
    _told: list[float] = field(init=False)
    _jumps: list[int] = field(init=False)
    _most: list[float] = field(init=False)
    _turn: list[float] = field(init=False)
    _turns: Turns = field(init=False)
    rates: list[JointRate] = field(init=False)
    _has_jumped: bool = False

    def __post_init__(self) -> None:
        n = len(self.settings.joints)
        self.q, self.qd, self.effort, self.speed = ([math.nan] * n for _ in range(4))
        self.seen = [NEVER] * n
        robot = self.settings.robot
        joints = [robot.joint(name) for name in robot.joint_names]
        self._turns = Turns(turning_of(robot))
        self._range = [
            (-FULL, FULL) if of.limited else _believable(joint)
            for joint, of in zip(joints, self._turns.joints, strict=True)
        ]
        self._before = [(NEVER, math.nan)] * n
        self._told, self._jumps = [math.nan] * n, [0] * n
        # The most a joint can move (rad, m) between two messages received at the same time.
        self._most = [s.rule.on * SHORTEST / SECOND for s in self.jump_signals] or [math.inf] * n
        self._turn = [math.tau if joint.kind == 'continuous' else 0.0 for joint in joints]
        self.rates = [JointRate(turn) for turn in self._turn]

    def layout(self, names: tuple[str, ...]) -> Layout:
        """Return where the robot's joints stand among `names`.

        A name that occurs twice in a message is ambiguous and left out.
        """
        found = self._layouts.get(names)
        if found is None:
            found = Layout(
                [
                    (j, names.index(joint.topic_name))
                    for j, joint in enumerate(self.settings.joints)
                    if names.count(joint.topic_name) == 1
                ]
            )
            if len(self._layouts) < 64:
                self._layouts[names] = found
        return found

    def merge(
        self,
        now: int,
        names: tuple[str, ...],
        position: Sequence[float],
        velocity: Sequence[float],
        effort: Sequence[float],
        stamp: int = 0,
    ) -> bool:
        """Take one message; return whether it carries a position of one of the robot's joints.

        `stamp` is that of its header (ns), 0 if it has none.
        """
        layout = self.layout(names)
        pairs = layout.pairs
        if layout.first == NEVER:
            layout.first = now
        if not pairs or len(position) != len(names):
            return False
        repeats = layout.repeats
        if repeats.seconds or (stamp == repeats.stamp and stamp):
            self._repeat(repeats, now, stamp, position)
        else:
            repeats.stamp, repeats.since, repeats.position = stamp, now, tuple(position)
            self.repeated = 0.0
        odd = self._take(now, stamp, layout, position, velocity, effort)
        for j in odd:
            apart, slope = now - self.seen[j], self.rates[j].slope
            known = self._turns.judge(j, self._told[j], apart, slope)
            self._place(j, now, self._turns.told[j] if known else math.nan)
        if now // SECOND != layout.second or self._has_jumped:
            self._look(now, layout)
        return True

    def _take(
        self,
        now: int,
        stamp: int,
        layout: Layout,
        position: Sequence[float],
        velocity: Sequence[float],
        effort: Sequence[float],
    ) -> list[int]:
        """Take the numbers of a message; return the joints whose positions are out of range."""
        rates, efforts = len(velocity) == len(position), len(effort) == len(position)
        cell, told, odd = now // CELL, self._turns.told, []
        fresh, layout.cell = cell != layout.cell, cell
        for j, k in layout.pairs:
            joint, (lower, upper), rate = self.settings.joints[j], self._range[j], self.rates[j]
            told[j] = q = joint.sign * position[k] + joint.offset
            qd = joint.sign * velocity[k] if rates else math.nan
            qd = qd if -ABSURD <= qd <= ABSURD else math.nan
            if fresh and rate.cell != cell:
                rate.step(now, stamp, q if -ABSURD <= q <= ABSURD else math.nan, qd)
            # As JointRate.best, without a call.
            if qd == qd:  # noqa: PLR0124 - not NaN
                self.qd[j] = rate.slope if rate.trust == DOUBTED else qd
                self.speed[j] = qd if rate.trust == PROVEN else rate.slope
            else:
                self.qd[j] = self.speed[j] = rate.slope
            scale = joint.effort_sign * joint.effort_scale
            self.effort[j] = scale * effort[k] if efforts else math.nan
            if not lower <= q <= upper:
                odd.append(j)
            elif -self._most[j] <= q - self._told[j] <= self._most[j]:
                self._told[j] = self.q[j] = q
                self.seen[j] = now
            else:
                self._place(j, now, q)
        return odd

    def _repeat(self, repeats: Repeats, now: int, stamp: int, position: Sequence[float]) -> None:
        """Note whether a message repeats the one before of the same names."""
        before = repeats.seconds > 0.0
        self.repeated = repeats.step(now, stamp, position)
        self.repeating += (self.repeated > 0.0) - before

    def _place(self, j: int, now: int, q: float) -> None:
        """Take the position of joint j (NaN: unknown); count if it jumped there."""
        way = abs(q - self._told[j])
        if way > self._most[j] and self._jumped(j, way, now - self.seen[j]):
            self._jumps[j] += 1
        self._told[j] = self.q[j] = q
        self.seen[j] = now

    def _look(self, now: int, layout: Layout) -> None:
        """Check the joints that a message named for implausible jumps; drop positions with one."""
        if now // SECOND != layout.second:
            layout.second = now // SECOND
            for j, _ in layout.pairs:
                self._compare(j, now, self._seen_at(j, self._turns.told[j], self.q[j]))
        for j, _ in layout.pairs:
            if self.jump_signals:
                self.jump_signals[j].advance(now)
                if self.jump_signals[j].alert is not None:
                    self.q[j] = math.nan
        self._has_jumped = not all(signal.quiet for signal in self.jump_signals)

    def _seen_at(self, j: int, told: float, q: float) -> float:
        """Return the position of joint j that is compared with others: also beyond a turn."""
        return told if self._turns.joints[j].limited and abs(told) <= ABSURD else q

    def _compare(self, j: int, now: int, q: float) -> None:
        """Compare joint j's position with that of the second before; a full turn may be wrapped."""
        then, before = self._before[j]
        if not self.jump_signals or math.isnan(q) or (then != NEVER and now - then < APART):
            return
        self._before[j] = now, q
        jumps, self._jumps[j] = self._jumps[j], 0
        if then != NEVER:
            way = abs(q - before)
            rate = min(way, abs(way - self._turn[j])) / (now - then) * SECOND
            rate = beyond(self.jump_signals[j], rate, self._turns.joints[j], q)
            self.jump_signals[j].step(
                now, max(rate, self.jump_signals[j].on if jumps >= MANY else 0.0)
            )

    def _jumped(self, j: int, way: Values, apart: Values) -> Values:
        """Return whether joint j cannot have moved by `way` (rad, m; wrapped) in `apart` (ns)."""
        way = np.minimum(way, abs(way - self._turn[j]))
        return way > self._most[j] * np.maximum(apart / SHORTEST, 1.0)

    def merge_columns(self, segments: Sequence[JointStateColumns]) -> JointRows:
        """Take many messages: the same rows as `merge` one at a time, in order of receipt."""
        self._note_first(segments)
        useful = [s for s in segments if self.layout(s.names).pairs and s.position.size]
        time = np.concatenate([s.log_time for s in useful] or [np.empty(0, np.int64)])
        stamp = np.concatenate([s.stamp for s in useful] or [np.empty(0, np.int64)])
        joints, n = len(self.settings.joints), len(time)
        tables, named = np.empty((4, joints, n)), np.empty((joints, n), np.bool_)
        first, of = 0, np.zeros(n, np.intp)
        numbers = {names: k for k, names in enumerate(dict.fromkeys(s.names for s in useful))}
        for segment in useful:
            rows = slice(first, first + len(segment.log_time))
            self._fill(tables[:, :, rows], named[:, rows], segment)
            of[rows] = numbers[segment.names]
            first = rows.stop
        positions = {
            x: np.concatenate([s.position for s in useful if s.names == x]) for x in numbers
        }
        if len(useful) > 1 and (np.diff(time) < 0).any():
            order = np.argsort(time, kind='stable')
            place = np.empty(n, np.intp)
            for x, k in numbers.items():
                place[of == k] = np.arange(len(positions[x]))
            time, stamp, place = time[order], stamp[order], place[order]
            tables, named, of = tables[:, :, order], named[:, order], of[order]
            positions = {x: positions[x][place[of == k]] for x, k in numbers.items()}
        rows_of = {x: np.flatnonzero(of == k) for x, k in numbers.items()}
        repeats = self._repeat_rows(time, stamp, rows_of, positions)
        raw = tables[0].copy()
        slopes = self._rate_rows(time, stamp, tables, named)
        for j, limits in enumerate(self._range):
            _believe(tables[0, j], limits)
            self._turn_rows(j, time, raw, tables[0], (named, slopes[j]))
        looked = [(self.layout(x), rows) for x, rows in rows_of.items()]
        self._look_at(time, raw, tables[0], named, looked)
        before = list(self._turns.told)
        merged, speed, seen = self._carry(time, stamp, tables, named)
        self.told = Told(*repeats, speed, merged.q, raw, named, before, seen)
        for j in range(joints * bool(n)):
            self._turns.told[j] = self._told_at(j, n - 1)
        return merged

    def _note_first(self, segments: Sequence[JointStateColumns]) -> None:
        for segment in segments:
            layout = self.layout(segment.names)
            if layout.first == NEVER and len(segment.log_time):
                layout.first = int(segment.log_time.min())

    def _repeat_rows(
        self,
        time: Times,
        stamp: Times,
        rows_of: Mapping[tuple[str, ...], Indices],
        positions: Mapping[tuple[str, ...], Floats],
    ) -> tuple[Floats, Mask]:
        """Return for how long each message is repeated, and whether any joint's newest one is."""
        repeated, repeating = np.zeros(len(time)), np.zeros(len(time), np.bool_)
        others = [x for x in self._layouts if x not in rows_of]
        repeating |= any(self._layouts[x].repeats.seconds > 0.0 for x in others)
        for names, rows in rows_of.items():
            repeats = self.layout(names).repeats
            before = repeats.seconds > 0.0
            repeated[rows] = repeats.columns(time[rows], stamp[rows], positions[names])
            if before or (repeated[rows] > 0.0).any():
                newest = np.zeros(len(time), np.intp)
                newest[rows] = np.arange(1, len(rows) + 1)
                repeating |= np.append(before, repeated[rows] > 0.0)[np.maximum.accumulate(newest)]
        self.repeating = sum(x.repeats.seconds > 0.0 for x in self._layouts.values())
        return repeated, repeating

    def _rate_rows(self, time: Times, stamp: Times, tables: Floats, named: Mask) -> list[Floats]:
        """Complete the rates (row 1 of `tables`), fill in speeds (row 3); return each slope."""
        _believe(tables[1], (-ABSURD, ABSURD))
        tables[3] = np.nan
        slopes = []
        for j, rate in enumerate(self.rates):
            rows = slice(None) if named[j].all() else np.flatnonzero(named[j])
            q = np.where(np.abs(tables[0, j, rows]) <= ABSURD, tables[0, j, rows], np.nan)
            found = rate.columns(time[rows], stamp[rows], q, tables[1, j, rows])
            tables[1, j, rows], tables[3, j, rows], slope = found
            slopes.append(slope)
        return slopes

    def _turn_rows(
        self, j: int, time: Times, raw: Floats, q: Floats, of: tuple[Mask, Floats]
    ) -> None:
        """Judge the positions of joint number j that are beyond a turn, as `merge` does.

        `of` says which messages (j, n) name a joint, and how fast this one turns at its own.
        """
        named, slope = of
        if not self._turns.joints[j].limited or not (np.abs(raw[j]) > FULL).any():
            return
        rows = np.flatnonzero(named[j])
        told = np.array([self._newest(k, raw[k], named[k])[rows] for k in range(len(raw))])
        apart = np.diff(time[rows], prepend=self.seen[j])
        q[j, rows] = self._turns.columns(j, told, q[j, rows], self._told[j], apart, slope)

    def _newest(self, j: int, raw: Floats, named: Mask) -> Floats:
        """Return the newest told position of joint number j at every row."""
        newest = np.maximum.accumulate(np.where(named, np.arange(1, len(raw) + 1), 0))
        return np.append(self._turns.told[j], raw)[newest]

    def _look_at(
        self,
        time: Times,
        raw: Floats,
        q: Floats,
        named: Mask,
        rows_of: Sequence[tuple[Layout, Indices]],
    ) -> None:
        """Check the positions (j, n) for implausible jumps, as `_look` does for each message.

        Positions with a jump become NaN in place. `raw` (j, n) are they as told; `rows_of` pairs
        each layout with its rows.
        """
        jumps = [self._jump_rows(j, time, q[j], named[j]) for j in range(len(q))]
        if not self.jump_signals or not len(time):
            return
        before, seen = [signal.alert for signal in self.jump_signals], len(self.jump_signals[0].log)
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
        for j, signal in enumerate(self.jump_signals):
            self._jumps[j] += len(jumps[j])
            signal.advance(int(time[-1]))
            for alert in [before[j], *signal.log[seen:]]:
                if alert is not None and alert.rule is signal.rule:
                    end = np.inf if alert.end is None else alert.end
                    q[j, (time >= alert.start) & (time < end)] = np.nan
        self._has_jumped = not all(signal.quiet for signal in self.jump_signals)

    def _jump_rows(self, j: int, time: Times, q: Floats, named: Mask) -> Indices:
        """Return the rows at which joint number j jumps, as `merge` counts them."""
        rows = np.arange(len(q)) if named.all() else np.flatnonzero(named)
        if not len(rows):
            return rows
        told = q if len(rows) == len(q) else q[rows]
        newest, self._told[j] = self._told[j], float(told[-1])
        if self._most[j] == math.inf:
            return rows[:0]
        far = np.flatnonzero(np.abs(told[1:] - told[:-1]) > self._most[j]) + 1
        if abs(told[0] - newest) > self._most[j]:
            far = np.concatenate(([0], far))
        before = np.where(far > 0, told[far - 1], newest)
        apart = time[rows[far]] - np.where(far > 0, time[rows[far - 1]], self.seen[j])
        return rows[far[self._jumped(j, np.abs(told[far] - before), apart)]]

    def _fill(self, tables: Floats, named: Mask, segment: JointStateColumns) -> None:
        """Write a segment's positions, rates and efforts, and which joints it names."""
        layout = self.layout(segment.names).pairs
        if len(layout) < len(named) or not (segment.velocity.size and segment.effort.size):
            tables.fill(np.nan)
            named[:] = False
        for j, k in layout:
            joint = self.settings.joints[j]
            scale = joint.effort_sign * joint.effort_scale
            with np.errstate(all='ignore'):
                q, qd, effort, _ = tables[:, j]
                np.add(joint.sign * segment.position[:, k], joint.offset, out=q)
                if segment.velocity.shape[1]:
                    np.multiply(joint.sign, segment.velocity[:, k], out=qd)
                if segment.effort.shape[1]:
                    np.multiply(scale, segment.effort[:, k], out=effort)
            named[j] = True

    def _carry(
        self, time: Times, stamp: Times, tables: Floats, named: Mask
    ) -> tuple[JointRows, Floats, list[Times]]:
        """Let every joint keep its newest value until the next message that names it."""
        oldest, unusable = time, np.isnan(tables[0]).any(axis=0)
        seen = [time] * len(named)
        if not named.all():
            oldest, unusable = time.copy(), np.zeros(len(time), np.bool_)
            for j in range(len(named)):
                seen[j] = self._carry_joint(j, time, tables[:, j], named[j])
                np.minimum(oldest, seen[j], out=oldest)
                unusable |= np.isnan(tables[0, j]) & (seen[j] != NEVER)
        if len(time):
            self.q, self.qd, self.effort, self.speed = tables[:, :, -1].tolist()
        for j in np.flatnonzero(named.any(axis=1)).tolist():
            self.seen[j] = int(time[len(time) - 1 - named[j, ::-1].argmax()])
        q, qd, effort, speed = (table.T for table in tables)
        return JointRows(time, stamp, q, qd, effort, oldest, unusable), speed, seen

    def _carry_joint(self, j: int, time: Times, tables: Floats, named: Mask) -> Times:
        """Fill the rows that do not name joint number j; return when its value was received."""
        newest = np.maximum.accumulate(np.where(named, np.arange(len(time)), -1))
        known = newest >= 0
        before = (self.q[j], self.qd[j], self.effort[j], self.speed[j])
        for table, value in zip(tables, before, strict=True):
            table[:] = np.where(known, table[newest], value)
        return np.where(known, time[newest], self.seen[j])

    def _told_at(self, j: int, row: int) -> float:
        """Return the position of joint number j that was told last at a row of the batch."""
        rows = np.flatnonzero(self.told.named[j, : row + 1])
        return float(self.told.raw[j, rows[-1]]) if len(rows) else self.told.before[j]

    def unusable_words(self, row: int | None = None) -> str:
        """Return why positions cannot be used: now, or at a row of the last batch."""
        joints = range(len(self.q))
        if row is None:
            unknown = [j for j in joints if math.isnan(self.q[j]) and self.seen[j] != NEVER]
            return unusable_words(self.settings, self._turns.told, unknown)
        told = [self._told_at(j, row) for j in joints]
        q = self.told.q[row].tolist()
        unknown = [j for j in joints if math.isnan(q[j]) and self.told.seen[j][row] != NEVER]
        return unusable_words(self.settings, told, unknown)

    def missing_words(self, now: int, limit: int, row: int | None = None) -> str:
        """Return which joints were told longer ago than `limit` (ns), as `unusable_words`."""
        seen = self.seen if row is None else [int(times[row]) for times in self.told.seen]
        ages = [
            None if now - at <= limit else math.inf if at == NEVER else (now - at) / 1e9
            for at in seen
        ]
        return missing_words(self.settings, ages, self._names(now))

    def foreign_words(self, until: int) -> str:
        """Return why no message until then (ns) was of this robot; '' if none came, or one was."""
        came = [layout for layout in self._layouts.values() if NEVER != layout.first <= until]
        if not came or any(layout.pairs for layout in came):
            return ''
        return foreign_words(self.settings, self._names(until))

    def _names(self, until: int) -> Iterable[str]:
        """Return all names that messages told until then (ns)."""
        layouts = self._layouts.items()
        return {x for names, layout in layouts if NEVER != layout.first <= until for x in names}


def _believe(values: Floats, limits: tuple[float, float]) -> None:
    """Replace values outside `limits` by NaN, in place."""
    inside = (values >= limits[0]) & (values <= limits[1])
    if not inside.all():
        values[~inside] = np.nan


def _believable(joint: Joint) -> tuple[float, float]:
    """Return the range of plausible positions of a joint: its limits plus BEYOND (rad or m)."""
    return max(joint.lower - BEYOND, -ABSURD), min(joint.upper + BEYOND, ABSURD)
