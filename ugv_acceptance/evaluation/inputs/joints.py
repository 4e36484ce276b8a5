"""From JointState messages to the robot's joints: names, signs, offsets, partial messages merged.

Implausible jumps are found as well. Once a second every joint's position is compared with that of
the second before: one that moved faster than the joint can has another unit or belongs to another
joint, and is unknown. So is one that jumps back and forth between messages: two robots publish the
same joint.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts.state_machine import Signal
from ugv_acceptance.evaluation.samples import JointStateColumns
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Joint
from ugv_acceptance.model.row_selection import Values
from ugv_acceptance.type_aliases import Floats, Times

Mask = NDArray[np.bool_]
Indices = NDArray[np.intp]

# A position further than this (rad or m) beyond a joint's limits is not the joint's.
BEYOND = 0.1
# Larger than any angle (rad) a continuous joint can have reached: the number is not an angle.
ABSURD = 1e5
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
    positions were checked for jumps.
    """

    pairs: list[tuple[int, int]]
    second: int = NEVER


@dataclass(slots=True)
class JointMerger:
    """Merges JointState messages: the newest position, rate and effort of every joint.

    In the robot's convention (sign and offset applied). `jump_signals` are the joints' signals for
    implausible jumps; while one has an alert, the position of its joint is unknown. `seen` (j,) is
    when each joint was last received (ns).
    """

    settings: Settings
    jump_signals: Sequence[Signal] = ()
    q: list[float] = field(init=False)
    qd: list[float] = field(init=False)
    effort: list[float] = field(init=False)
    seen: list[int] = field(init=False)
    _layouts: dict[tuple[str, ...], Layout] = field(default_factory=dict)
    _range: list[tuple[float, float]] = field(init=False)
    _before: list[tuple[int, float]] = field(init=False)
    _told: list[float] = field(init=False)
    _jumps: list[int] = field(init=False)
    _most: list[float] = field(init=False)
    _turn: list[float] = field(init=False)
    _has_jumped: bool = False

    def __post_init__(self) -> None:
        n = len(self.settings.joints)
        self.q, self.qd, self.effort = ([math.nan] * n for _ in range(3))
        self.seen = [NEVER] * n
        robot = self.settings.robot
        joints = [robot.joint(name) for name in robot.joint_names]
        self._range = list(map(_believable, joints))
        self._before = [(NEVER, math.nan)] * n
        self._told, self._jumps = [math.nan] * n, [0] * n
        # The most a joint can move (rad, m) between two messages received at the same time.
        self._most = [s.rule.on * SHORTEST / SECOND for s in self.jump_signals] or [math.inf] * n
        self._turn = [math.tau if joint.kind == 'continuous' else 0.0 for joint in joints]

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
    ) -> bool:
        """Take one message; return whether it carries a position of one of the robot's joints."""
        layout = self.layout(names)
        pairs = layout.pairs
        if not pairs or len(position) != len(names):
            return False
        rates, efforts = len(velocity) == len(names), len(effort) == len(names)
        for j, k in pairs:
            joint, (lower, upper) = self.settings.joints[j], self._range[j]
            q = joint.sign * position[k] + joint.offset
            self.q[j] = q = q if lower <= q <= upper else math.nan
            way = abs(q - self._told[j])
            if way > self._most[j] and self._jumped(j, way, now - self.seen[j]):
                self._jumps[j] += 1
            self._told[j] = q
            self.seen[j] = now
            qd = joint.sign * velocity[k] if rates else math.nan
            self.qd[j] = qd if -ABSURD <= qd <= ABSURD else math.nan
            scale = joint.effort_sign * joint.effort_scale
            self.effort[j] = scale * effort[k] if efforts else math.nan
        if now // SECOND != layout.second or self._has_jumped:
            self._look(now, layout)
        return True

    def _look(self, now: int, layout: Layout) -> None:
        """Check the joints that a message named for implausible jumps; drop positions with one."""
        if now // SECOND != layout.second:
            layout.second = now // SECOND
            for j, _ in layout.pairs:
                self._compare(j, now, self.q[j])
        for j, _ in layout.pairs:
            if self.jump_signals:
                self.jump_signals[j].advance(now)
                if self.jump_signals[j].alert is not None:
                    self.q[j] = math.nan
        self._has_jumped = not all(signal.quiet for signal in self.jump_signals)

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
            self.jump_signals[j].step(
                now, max(rate, self.jump_signals[j].on if jumps >= MANY else 0.0)
            )

    def _jumped(self, j: int, way: Values, apart: Values) -> Values:
        """Return whether joint j cannot have moved by `way` (rad, m; wrapped) in `apart` (ns)."""
        way = np.minimum(way, abs(way - self._turn[j]))
        return way > self._most[j] * np.maximum(apart / SHORTEST, 1.0)

    def merge_columns(self, segments: Sequence[JointStateColumns]) -> JointRows:
        """Take many messages: the same rows as `merge` one at a time, in order of receipt."""
        useful = [s for s in segments if self.layout(s.names).pairs and s.position.size]
        time = np.concatenate([s.log_time for s in useful] or [np.empty(0, np.int64)])
        stamp = np.concatenate([s.stamp for s in useful] or [np.empty(0, np.int64)])
        joints, n = len(self.settings.joints), len(time)
        tables, named = np.empty((3, joints, n)), np.empty((joints, n), np.bool_)
        first, of = 0, np.zeros(n, np.intp)
        numbers = {names: k for k, names in enumerate(dict.fromkeys(s.names for s in useful))}
        for segment in useful:
            rows = slice(first, first + len(segment.log_time))
            self._fill(tables[:, :, rows], named[:, rows], segment)
            of[rows] = numbers[segment.names]
            first = rows.stop
        for j, limits in enumerate(self._range):
            _believe(tables[0, j], limits)
        _believe(tables[1], (-ABSURD, ABSURD))
        if len(useful) > 1 and (np.diff(time) < 0).any():
            order = np.argsort(time, kind='stable')
            time, stamp = time[order], stamp[order]
            tables, named, of = tables[:, :, order], named[:, order], of[order]
        if self.jump_signals and n:
            rows_of = [(self.layout(x), np.flatnonzero(of == k)) for x, k in numbers.items()]
            self._look_at(time, tables[0], named, rows_of)
        return self._carry(time, stamp, tables, named)

    def _look_at(
        self, time: Times, q: Floats, named: Mask, rows_of: Sequence[tuple[Layout, Indices]]
    ) -> None:
        """Check the positions (j, n) for implausible jumps, as `_look` does for each message.

        Positions with a jump become NaN in place. `rows_of` pairs each layout with its rows.
        """
        before, seen = [signal.alert for signal in self.jump_signals], len(self.jump_signals[0].log)
        looks: list[tuple[int, int]] = []
        for layout, rows in rows_of:
            seconds = time[rows] // SECOND
            firsts = rows[np.flatnonzero(np.diff(seconds, prepend=layout.second))]
            layout.second = int(seconds[-1])
            looks += [(row, j) for row in firsts.tolist() for j, _ in layout.pairs]
        jumps = [self._jump_rows(j, time, q[j], named[j]) for j in range(len(q))]
        for row, j in sorted(looks):
            if len(jumps[j]):
                count = int(np.searchsorted(jumps[j], row, 'right'))
                self._jumps[j], jumps[j] = self._jumps[j] + count, jumps[j][count:]
            self._compare(j, int(time[row]), float(q[j, row]))
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
        if not len(rows) or self._most[j] == math.inf:
            return rows[:0]
        told = q if len(rows) == len(q) else q[rows]
        far = np.flatnonzero(np.abs(told[1:] - told[:-1]) > self._most[j]) + 1
        if abs(told[0] - self._told[j]) > self._most[j]:
            far = np.concatenate(([0], far))
        before = np.where(far > 0, told[far - 1], self._told[j])
        apart = time[rows[far]] - np.where(far > 0, time[rows[far - 1]], self.seen[j])
        self._told[j] = float(told[-1])
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
                q, qd, effort = tables[:, j]
                np.add(joint.sign * segment.position[:, k], joint.offset, out=q)
                if segment.velocity.shape[1]:
                    np.multiply(joint.sign, segment.velocity[:, k], out=qd)
                if segment.effort.shape[1]:
                    np.multiply(scale, segment.effort[:, k], out=effort)
            named[j] = True

    def _carry(self, time: Times, stamp: Times, tables: Floats, named: Mask) -> JointRows:
        """Let every joint keep its newest value until the next message that names it."""
        oldest, unusable = time, np.isnan(tables[0]).any(axis=0)
        if not named.all():
            oldest, unusable = time.copy(), np.zeros(len(time), np.bool_)
            for j in range(len(named)):
                seen = self._carry_joint(j, time, tables[:, j], named[j])
                np.minimum(oldest, seen, out=oldest)
                unusable |= np.isnan(tables[0, j]) & (seen != NEVER)
        if len(time):
            self.q, self.qd, self.effort = tables[:, :, -1].tolist()
        for j in np.flatnonzero(named.any(axis=1)).tolist():
            self.seen[j] = int(time[len(time) - 1 - named[j, ::-1].argmax()])
        q, qd, effort = (table.T for table in tables)
        return JointRows(time, stamp, q, qd, effort, oldest, unusable)

    def _carry_joint(self, j: int, time: Times, tables: Floats, named: Mask) -> Times:
        """Fill the rows that do not name joint number j; return when its value was received."""
        newest = np.maximum.accumulate(np.where(named, np.arange(len(time)), -1))
        known = newest >= 0
        before = (self.q[j], self.qd[j], self.effort[j])
        for table, value in zip(tables, before, strict=True):
            table[:] = np.where(known, table[newest], value)
        return np.where(known, time[newest], self.seen[j])


def _believe(values: Floats, limits: tuple[float, float]) -> None:
    """Replace values outside `limits` by NaN, in place."""
    inside = (values >= limits[0]) & (values <= limits[1])
    if not inside.all():
        values[~inside] = np.nan


def _believable(joint: Joint) -> tuple[float, float]:
    """Return the range of plausible positions of a joint: its limits plus BEYOND (rad or m)."""
    return max(joint.lower - BEYOND, -ABSURD), min(joint.upper + BEYOND, ABSURD)
