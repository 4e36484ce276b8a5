"""From JointState messages to the robot's joints: names, signs, offsets, partial messages merged.

What cannot be a position is unknown: out of its range, beyond a turn (turns.py), an implausible
jump (leaps.py). Messages that are repeated are told apart (repeats.py), and rates are completed
from positions (joint_rates.py). joint_state_words.py says in words what is wrong.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ugv_acceptance.evaluation.alerts.state_machine import Signal
from ugv_acceptance.evaluation.inputs.joint_rates import CELL, DOUBTED, PROVEN, JointRate
from ugv_acceptance.evaluation.inputs.joint_rows import (
    NEVER,
    Indices,
    JointRows,
    Layout,
    Mask,
    Told,
)
from ugv_acceptance.evaluation.inputs.leaps import SECOND, Leaps
from ugv_acceptance.evaluation.inputs.repeats import Repeats
from ugv_acceptance.evaluation.inputs.timeouts import FOREVER, STARTUP
from ugv_acceptance.evaluation.inputs.turns import ABSURD, FULL, Turns, turning_of
from ugv_acceptance.evaluation.samples import JointStateColumns
from ugv_acceptance.evaluation.settings import Settings, Untold
from ugv_acceptance.model.robot import Joint
from ugv_acceptance.type_aliases import Floats, Times

# A position further than this (rad or m) beyond a joint's limits is not the joint's.
BEYOND = 0.1


@dataclass(slots=True)
class JointMerger:
    """Merges JointState messages: the newest position, rate and effort of every joint.

    In the robot's convention (sign and offset applied). `jump_signals` are the joints' signals for
    implausible jumps; while one has an alert, the position of its joint is unknown. `seen` (j,) is
    when each joint was last received (ns), `speed` (j,) its rate where that can be believed.
    `repeated` is for how many seconds the newest message is repeated, `repeating` how many lists of
    names have such a message. `told` is what the last batch told, `turns` what messages told,
    `rates` (j,) tell which reported rates can be believed, `layouts` the lists of names that came.

    A joint that no message told in STARTUP after the first, a harmless one at once, is taken where
    `settings.untold` says, until one tells it: its `seen` is FOREVER then. `assumed` are all that
    were taken so after STARTUP; `doubted` says that one is now of which margins may be wrong.
    """

    settings: Settings
    jump_signals: Sequence[Signal] = ()
    q: list[float] = field(init=False)
    qd: list[float] = field(init=False)
    effort: list[float] = field(init=False)
    speed: list[float] = field(init=False)
    seen: list[int] = field(init=False)
    repeated: float = 0.0
    began: int = NEVER
    repeating: int = 0
    told: Told = field(init=False)
    layouts: dict[tuple[str, ...], Layout] = field(default_factory=dict)
    turns: Turns = field(init=False)
    rates: list[JointRate] = field(init=False)
    assumed: set[int] = field(default_factory=set)
    doubted: bool = False
    _untold: dict[int, Untold] = field(init=False)
    _range: list[tuple[float, float]] = field(init=False)
    _leaps: Leaps = field(init=False)

    def __post_init__(self) -> None:
        n = len(self.settings.joints)
        self.q, self.qd, self.effort, self.speed = ([math.nan] * n for _ in range(4))
        self.seen = [NEVER] * n
        self._untold = {j: u for j, u in enumerate(self.settings.untold) if u is not None}
        robot = self.settings.robot
        joints = [robot.joint(name) for name in robot.joint_names]
        self.turns = Turns(turning_of(robot))
        self._range = [
            (-FULL, FULL) if of.limited else _believable(joint)
            for joint, of in zip(joints, self.turns.joints, strict=True)
        ]
        turns = [math.tau if joint.kind == 'continuous' else 0.0 for joint in joints]
        self._leaps = Leaps(self.jump_signals, self.turns, turns)
        self.rates = [JointRate(turn) for turn in turns]

    def layout(self, names: tuple[str, ...]) -> Layout:
        """Return where the robot's joints stand among `names`.

        A name that occurs twice in a message is ambiguous and left out.
        """
        found = self.layouts.get(names)
        if found is None:
            found = Layout(
                [
                    (j, names.index(joint.topic_name))
                    for j, joint in enumerate(self.settings.joints)
                    if names.count(joint.topic_name) == 1
                ]
            )
            if len(self.layouts) < 64:
                self.layouts[names] = found
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
        if self.began == NEVER:
            self.began = now
        layout.last, repeats = now, layout.repeats
        if repeats.seconds or (stamp == repeats.stamp and stamp):
            self._repeat(repeats, now, stamp, position)
        else:
            repeats.stamp, repeats.since, repeats.position = stamp, now, tuple(position)
            self.repeated = 0.0
        if self._untold:
            self._hear(layout)
        odd = self._take(now, stamp, layout, position, velocity, effort)
        for j in odd:
            apart, slope = now - self.seen[j], self.rates[j].slope
            known = self.turns.judge(j, self._leaps.told[j], apart, slope)
            self._place(j, now, self.turns.told[j] if known else math.nan)
        if now // SECOND != layout.second or self._leaps.busy:
            self._leaps.look(now, layout, self.q)
        if self._untold:
            self._assume(now - self.began > STARTUP)
        return True

    def _hear(self, layout: Layout) -> None:
        """Note that a message tells joints: they are no longer, or never will be, taken as held."""
        for j, _ in layout.pairs:
            if self._untold.pop(j, None) is not None and self.seen[j] == FOREVER:
                self.seen[j] = NEVER
                self.doubted = self._doubts()

    def _assume(self, late: bool) -> None:  # noqa: FBT001 - whether STARTUP is over
        """Take joints that nobody told as held: the harmless ones at once."""
        for j, untold in self._untold.items():
            if self.seen[j] == NEVER and (late or untold.harmless):
                self.q[j], self.seen[j] = untold.position, FOREVER
                self.doubted = self._doubts()
        if late:
            self.assumed.update(self._untold)

    @property
    def never_told(self) -> list[str]:
        """Names of the joints that were ever taken as held for want of messages."""
        return [self.settings.robot.joint_names[j] for j in sorted(self.assumed)]

    def _doubts(self) -> bool:
        return any(self.seen[j] == FOREVER and not of.harmless for j, of in self._untold.items())

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
        cell, told, odd = now // CELL, self.turns.told, []
        fresh, layout.cell = cell != layout.cell, cell
        before, most = self._leaps.told, self._leaps.most
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
            elif -most[j] <= q - before[j] <= most[j]:
                before[j] = self.q[j] = q
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
        self._leaps.place(j, q, now - self.seen[j])
        self.q[j], self.seen[j] = q, now

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
        self.began = int(time[0]) if n and self.began == NEVER else self.began
        rows_of = {x: np.flatnonzero(of == k) for x, k in numbers.items()}
        repeats = self._repeat_rows(time, stamp, rows_of, positions)
        raw = tables[0].copy()
        slopes = self._rate_rows(time, stamp, tables, named)
        for j, limits in enumerate(self._range):
            _believe(tables[0, j], limits)
            self._turn_rows(j, time, raw, tables[0], (named, slopes[j]))
        looked = [(self.layout(x), rows) for x, rows in rows_of.items()]
        self._leaps.columns(time, raw, tables[0], named, looked, self.seen)
        before = list(self.turns.told)
        merged, speed, seen, doubted = self._carry(time, stamp, tables, named)
        self.told = Told(*repeats, speed, merged.q, raw, named, before, seen, doubted)
        for j in range(joints * bool(n)):
            self.turns.told[j] = self.told.told_at(j, n - 1)
        return merged

    def _note_first(self, segments: Sequence[JointStateColumns]) -> None:
        for segment in segments:
            layout = self.layout(segment.names)
            if layout.first == NEVER and len(segment.log_time):
                layout.first = int(segment.log_time.min())
            for j, _ in layout.pairs if self._untold and segment.position.size else ():
                if self.seen[j] == FOREVER:  # taken as held, and told now
                    self.seen[j] = NEVER

    def _repeat_rows(
        self,
        time: Times,
        stamp: Times,
        rows_of: Mapping[tuple[str, ...], Indices],
        positions: Mapping[tuple[str, ...], Floats],
    ) -> tuple[Floats, Mask]:
        """Return for how long each message is repeated, and whether any joint's newest one is."""
        repeated, repeating = np.zeros(len(time)), np.zeros(len(time), np.bool_)
        others = [x for x in self.layouts if x not in rows_of]
        repeating |= any(self.layouts[x].repeats.seconds > 0.0 for x in others)
        for names, rows in rows_of.items():
            repeats = self.layout(names).repeats
            before = repeats.seconds > 0.0
            repeated[rows] = repeats.columns(time[rows], stamp[rows], positions[names])
            if before or (repeated[rows] > 0.0).any():
                newest = np.zeros(len(time), np.intp)
                newest[rows] = np.arange(1, len(rows) + 1)
                repeating |= np.append(before, repeated[rows] > 0.0)[np.maximum.accumulate(newest)]
        self.repeating = sum(x.repeats.seconds > 0.0 for x in self.layouts.values())
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
        if not self.turns.joints[j].limited or not (np.abs(raw[j]) > FULL).any():
            return
        rows = np.flatnonzero(named[j])
        told = np.array([self._newest(k, raw[k], named[k])[rows] for k in range(len(raw))])
        apart = np.diff(time[rows], prepend=self.seen[j])
        q[j, rows] = self.turns.columns(j, told, q[j, rows], self._leaps.told[j], apart, slope)

    def _newest(self, j: int, raw: Floats, named: Mask) -> Floats:
        """Return the newest told position of joint number j at every row."""
        newest = np.maximum.accumulate(np.where(named, np.arange(1, len(raw) + 1), 0))
        return np.append(self.turns.told[j], raw)[newest]

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
    ) -> tuple[JointRows, Floats, list[Times], Mask]:
        """Let every joint keep its newest value until the next message that names it."""
        oldest, unusable = time, np.isnan(tables[0]).any(axis=0)
        seen, doubted = [time] * len(named), np.zeros(len(time), np.bool_)
        if not named.all():
            oldest, unusable = time.copy(), np.zeros(len(time), np.bool_)
            for j in range(len(named)):
                seen[j] = self._carry_joint(j, time, tables[:, j], named[j])
                if j in self._untold:
                    doubted |= self._assume_rows(j, time, tables[0, j], seen[j])
                np.minimum(oldest, seen[j], out=oldest)
                unusable |= np.isnan(tables[0, j]) & (seen[j] != NEVER)
        if len(time):
            self.q, self.qd, self.effort, self.speed = tables[:, :, -1].tolist()
        for j in np.flatnonzero(named.any(axis=1)).tolist():
            self._untold.pop(j, None)
            self.seen[j] = int(time[len(time) - 1 - named[j, ::-1].argmax()])
        q, qd, effort, speed = (table.T for table in tables)
        return JointRows(time, stamp, q, qd, effort, oldest, unusable), speed, seen, doubted

    def _assume_rows(self, j: int, time: Times, q: Floats, seen: Times) -> Mask:
        """Take joint number j as held before the first row that names it; return where in doubt."""
        late = time - self.began > STARTUP
        rows: Mask = ((seen == NEVER) | (seen == FOREVER)) & (late | self._untold[j].harmless)
        if rows.any():
            q[rows], seen[rows] = self._untold[j].position, FOREVER
            self.seen[j] = FOREVER
        if (rows & late).any():
            self.assumed.add(j)
        return np.zeros_like(rows) if self._untold[j].harmless else rows

    def _carry_joint(self, j: int, time: Times, tables: Floats, named: Mask) -> Times:
        """Fill the rows that do not name joint number j; return when its value was received."""
        newest = np.maximum.accumulate(np.where(named, np.arange(len(time)), -1))
        known = newest >= 0
        before = (self.q[j], self.qd[j], self.effort[j], self.speed[j])
        for table, value in zip(tables, before, strict=True):
            table[:] = np.where(known, table[newest], value)
        return np.where(known, time[newest], self.seen[j])


def _believe(values: Floats, limits: tuple[float, float]) -> None:
    """Replace values outside `limits` by NaN, in place."""
    if not values.size or (values.min() >= limits[0] and values.max() <= limits[1]):
        return
    values[~((values >= limits[0]) & (values <= limits[1]))] = np.nan


def _believable(joint: Joint) -> tuple[float, float]:
    """Return the range of plausible positions of a joint: its limits plus BEYOND (rad or m)."""
    return max(joint.lower - BEYOND, -ABSURD), min(joint.upper + BEYOND, ABSURD)
