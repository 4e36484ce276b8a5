"""Joint states to the robot's joints: names matched, signs and offsets undone, partial ones merged."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.samples import JointStateColumns
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Joint

Floats = NDArray[np.float64]
Times = NDArray[np.int64]

# A position this far (rad or m) beyond a joint's limits cannot be the joint's.
BEYOND = 0.1
# Larger than any position a turning joint can have gathered: the number is not an angle.
ABSURD = 1e5
NEVER = -1


@dataclass(frozen=True, slots=True)
class JointRows:
    """Merged joint states, one row a message that names one of the robot's joints.

    `q` (n, j) is NaN where a joint is unknown or its value cannot be used; `qd` and `effort` NaN
    where not reported; `oldest` (n,) is the receipt time of the oldest position in the row.
    """

    time: Times
    stamp: Times
    q: Floats
    qd: Floats
    effort: Floats
    oldest: Times
    unusable: NDArray[np.bool_]


@dataclass(slots=True)
class JointMerger:
    """Holds the newest position, rate and effort of every joint, in robot convention."""

    settings: Settings
    q: list[float] = field(init=False)
    qd: list[float] = field(init=False)
    effort: list[float] = field(init=False)
    seen: list[int] = field(init=False)
    _layouts: dict[tuple[str, ...], list[tuple[int, int]]] = field(default_factory=dict)
    _range: list[tuple[float, float]] = field(init=False)

    def __post_init__(self) -> None:
        n = len(self.settings.joints)
        self.q, self.qd, self.effort = ([math.nan] * n for _ in range(3))
        self.seen = [NEVER] * n
        robot = self.settings.robot
        self._range = [_believable(robot.joint(name)) for name in robot.joint_names]

    def layout(self, names: tuple[str, ...]) -> list[tuple[int, int]]:
        """Return (joint number, place in the message) of the robot's joints among `names`.

        A name that stands twice in a message cannot be told apart and is left out.
        """
        found = self._layouts.get(names)
        if found is None:
            found = [
                (j, names.index(joint.topic_name))
                for j, joint in enumerate(self.settings.joints)
                if names.count(joint.topic_name) == 1
            ]
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
        if not layout or len(position) != len(names):
            return False
        rates, efforts = len(velocity) == len(names), len(effort) == len(names)
        for j, k in layout:
            joint, (lower, upper) = self.settings.joints[j], self._range[j]
            q = joint.sign * position[k] + joint.offset
            self.q[j] = q if lower <= q <= upper else math.nan
            self.seen[j] = now
            self.qd[j] = joint.sign * velocity[k] if rates else math.nan
            scale = joint.effort_sign * joint.effort_scale
            self.effort[j] = scale * effort[k] if efforts else math.nan
        return True

    def merge_columns(self, segments: Sequence[JointStateColumns]) -> JointRows:
        """Take many messages: the same rows as `merge` one at a time, in order of receipt."""
        useful = [s for s in segments if self.layout(s.names) and s.position.shape[1]]
        time = np.concatenate([s.log_time for s in useful] or [np.empty(0, np.int64)])
        stamp = np.concatenate([s.stamp for s in useful] or [np.empty(0, np.int64)])
        n, joints = len(time), len(self.settings.joints)
        tables = np.full((4, n, joints), np.nan)
        first = 0
        for segment in useful:
            rows = slice(first, first + len(segment.log_time))
            self._fill(tables[:, rows], segment)
            first = rows.stop
        order = np.argsort(time, kind='stable')
        if (np.diff(order) != 1).any():
            time, stamp, tables = time[order], stamp[order], tables[:, order]
        return self._carry(time, stamp, tables)

    def _fill(self, tables: Floats, segment: JointStateColumns) -> None:
        """Write a segment's positions, rates, efforts, and (last) 1 where a joint was named."""
        for j, k in self.layout(segment.names):
            joint, (lower, upper) = self.settings.joints[j], self._range[j]
            q = joint.sign * segment.position[:, k] + joint.offset
            with np.errstate(invalid='ignore'):
                tables[0, :, j] = np.where((q >= lower) & (q <= upper), q, np.nan)
            if segment.velocity.shape[1]:
                tables[1, :, j] = joint.sign * segment.velocity[:, k]
            if segment.effort.shape[1]:
                tables[2, :, j] = joint.effort_sign * joint.effort_scale * segment.effort[:, k]
            tables[3, :, j] = 1.0

    def _carry(self, time: Times, stamp: Times, tables: Floats) -> JointRows:
        """Let every joint keep its newest value until the next message that names it."""
        named = tables[3] == 1.0
        oldest = time.copy()
        if not named.all():
            for j in range(named.shape[1]):
                self._carry_joint(j, time, tables, named[:, j], oldest)
        if len(time):
            self.q, self.qd, self.effort = (tables[k, -1].tolist() for k in range(3))
            last = time[len(time) - 1 - named[::-1].argmax(axis=0)]
            pairs = zip(named.any(axis=0), last, self.seen, strict=True)
            self.seen = [int(t) if any_ else before for any_, t, before in pairs]
        unusable = (np.isnan(tables[0]) & (tables[3] == 1.0)).any(axis=1)
        return JointRows(time, stamp, tables[0], tables[1], tables[2], oldest, unusable)

    def _carry_joint(
        self, j: int, time: Times, tables: Floats, named: NDArray[np.bool_], oldest: Times
    ) -> None:
        newest = np.maximum.accumulate(np.where(named, np.arange(len(time)), -1))
        known = newest >= 0
        before = (self.q[j], self.qd[j], self.effort[j])
        for table, value in zip(tables[:3], before, strict=True):
            table[:, j] = np.where(known, table[newest, j], value)
        seen = np.where(known, time[newest], self.seen[j])
        np.minimum(oldest, seen, out=oldest)
        tables[3, :, j] = seen != NEVER


def _believable(joint: Joint) -> tuple[float, float]:
    """Return the positions that can be this joint's: its limits and a little more."""
    return max(joint.lower - BEYOND, -ABSURD), min(joint.upper + BEYOND, ABSURD)
