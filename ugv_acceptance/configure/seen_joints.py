"""What JointState messages tell of a robot: which joints, where they rest, how far they went."""

import math
from dataclasses import dataclass, field

import numpy as np

from ugv_acceptance.bag.cdr import JointStateSample
from ugv_acceptance.configure.evidence import SeenJoint
from ugv_acceptance.evaluation.effort.rests import TURNED, find_rests
from ugv_acceptance.type_aliases import Floats, Times

# What is said of a robot whose joints move all the time.
NEVER_RESTS = 'the joints never rest: their positions are medians of all messages'
# Postures are kept this often (ns), so many at most, of so many joints.
_EVERY, _ROWS, _NAMES = 50_000_000, 4000, 500
# A joint that went further than this (rad) turns without end: where it stands is no posture.
_TURNS = math.tau
# Where no joint went further than this (rad, m) the robot rests, however rarely it is told.
_STILL = 0.01
# Larger numbers are no positions.
_ABSURD = 1e9


@dataclass(slots=True)
class _Told:
    """A joint's newest position, its range so far, and whether it has an effort."""

    newest: float = math.nan
    lowest: float = math.inf
    highest: float = -math.inf
    effort: bool = False

    def take(self, position: float, effort: float) -> None:
        if -_ABSURD < position < _ABSURD:
            self.newest = position
            self.lowest, self.highest = min(self.lowest, position), max(self.highest, position)
        self.effort = self.effort or math.isfinite(effort)


@dataclass(slots=True)
class JointsSeen:
    """Folds the messages of one topic; those that tell a part of the joints are merged.

    `joints` are the joints by name in order of their first message, `empty` counts the messages
    without names or positions.
    """

    joints: dict[str, _Told] = field(default_factory=dict)
    empty: int = 0
    _times: list[int] = field(default_factory=list)
    _rows: list[tuple[float, ...]] = field(default_factory=list)

    def take(self, now: int, sample: JointStateSample) -> None:
        """Take a message received at `now` (ns)."""
        if not sample.names or not sample.position:
            self.empty += 1
        effort = sample.effort or (math.nan,) * len(sample.names)
        position = sample.position or (math.nan,) * len(sample.names)
        for name, at, felt in zip(sample.names, position, effort, strict=True):
            told = self.joints.get(name)
            if told is None:
                if len(self.joints) >= _NAMES:
                    continue
                told = self.joints[name] = _Told()
            told.take(at, felt)
        if len(self._rows) < _ROWS and (not self._times or now - self._times[-1] >= _EVERY):
            self._times.append(now)
            self._rows.append(tuple(told.newest for told in self.joints.values()))

    @property
    def nowhere(self) -> list[str]:
        """The joints of which no message tells a position."""
        return [name for name, told in self.joints.items() if math.isnan(told.newest)]

    def seen(self) -> tuple[tuple[SeenJoint, ...], str]:
        """Return the joints that have positions, and what is doubtful about their rest, or ''."""
        names = [name for name, told in self.joints.items() if not math.isnan(told.newest)]
        if not names:
            return (), ''
        rest, doubt = self._rest()
        number = {name: k for k, name in enumerate(self.joints)}
        joints = []
        for name in names:
            told = self.joints[name]
            at = float(rest[number[name]])
            at = told.newest if math.isnan(at) else at
            joints.append(SeenJoint(name, at, told.lowest, told.highest, told.effort))
        return tuple(joints), doubt

    def _rest(self) -> tuple[Floats, str]:
        """Return the median of all joints (rad, m) in the longest rest, else of all messages."""
        time, table = np.array(self._times, np.int64), self._table()
        turning = [told.highest - told.lowest > _TURNS for told in self.joints.values()]
        everywhere = _medians(table)
        moved = [told.highest - told.lowest for told in self.joints.values()]
        if max((way for way in moved if way >= 0.0), default=0.0) <= _STILL:
            return everywhere, ''
        for used in (np.ones(len(turning), bool), ~np.array(turning)):
            found = _longest_rest(time, table[:, used]) if used.any() else None
            if found is not None:
                rest = everywhere.copy()
                rest[used] = np.where(np.isnan(found), everywhere[used], found)
                return rest, ''
        return everywhere, NEVER_RESTS

    def _table(self) -> Floats:
        """Return the kept postures (n, joints); NaN before a joint's first message."""
        table = np.full((len(self._rows), len(self.joints)), math.nan)
        for row, values in zip(table, self._rows, strict=True):
            row[: len(values)] = values
        return table


def _longest_rest(time: Times, q: Floats) -> Floats | None:
    """Return the median posture of the longest rest; None if there is none."""
    n, joints = q.shape
    nothing, down = np.full((n, joints), math.nan), np.tile((0.0, 0.0, -1.0), (n, 1))
    rests = find_rests(time, (nothing, nothing, nothing, q, down), np.full(joints, TURNED))
    if not len(rests.start):
        return None
    found: Floats = rests.q[int((rests.end - rests.start).argmax())]
    return found


def _medians(table: Floats) -> Floats:
    found = [np.median(column[np.isfinite(column)]) if np.isfinite(column).any() else math.nan
             for column in table.T]  # fmt: skip
    return np.array(found, np.float64)
