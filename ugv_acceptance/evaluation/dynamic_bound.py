"""How much torque the motion of the joints added to the static torques, at most.

The margins are those of a robot at rest. Rates and accelerations are estimated from the positions
alone, by parabolas fitted to 0.2 s; the Newton-Euler recursion makes torques of them. Where the
static torque and the sizes of both parts together pass the limit of a joint, the run may have
needed more than the joint can hold: it is not known.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.criteria.criteria import INCONCLUSIVE
from ugv_acceptance.evaluation.criteria.statement import NotChecked, Objection, Statement
from ugv_acceptance.evaluation.inputs.turns import turning_of
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.position_steps import AROUND, PositionStep, steps_in
from ugv_acceptance.evaluation.position_track import STEP, Track, track_of
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.statics import inverse_dynamics
from ugv_acceptance.type_aliases import Floats, Json, Times

# Joints slower than this (rad/s, m/s) are slow: the paper's typical 7 deg/s and its starts and
# stops belong to the static model.
FAST = 0.2
# Between two looks a fast joint moves at QUICK of that rate at least.
QUICK = 0.75
# Positions are looked at once in so many ns to find fast ones, and so much (ns) is kept for the
# next part of the recording.
COARSE, KEPT = 100_000_000, 1_000_000_000
# Accelerations that last 0.1 s are this much larger than a parabola over twice that time shows.
SMOOTHED = 1.25
# Steps that are told of one by one.
MOST = 3
NO_GRAVITY = np.zeros(3)


@dataclass(slots=True)
class Worst:
    """The moment at which motion brought a joint nearest to its limit, or furthest past it.

    `static` and `added` are torques (N m; N), `left` what they leave of the limit, `at` the time
    (ns); rates and accelerations (j,) are those of all joints. `longest` is the longest time (s)
    past the limit.
    """

    left: float = math.inf
    at: int = 0
    static: float = 0.0
    added: float = 0.0
    rate: Floats = field(default_factory=lambda: np.zeros(0))
    acceleration: Floats = field(default_factory=lambda: np.zeros(0))
    longest: float = 0.0


@dataclass(frozen=True, slots=True)
class _Rows:
    """Joint messages (n,) of a recording: time, stamp (ns), positions and torques (n, j)."""

    time: Times
    stamp: Times
    q: Floats
    torque: Floats
    known: NDArray[np.bool_]

    def after(self, other: '_Rows | None') -> '_Rows':
        """Return these rows with those of `other` before them."""
        if other is None:
            return self
        return _Rows(
            np.concatenate((other.time, self.time)), np.concatenate((other.stamp, self.stamp)),
            np.concatenate((other.q, self.q)), np.concatenate((other.torque, self.torque)),
            np.concatenate((other.known, self.known)),
        )  # fmt: skip

    def since(self, time: int) -> '_Rows':
        """Return the rows received at `time` (ns) or later."""
        late: Any = self.time >= time
        if late[late.argmax() :].all():
            late = slice(late.argmax(), None)  # which copies nothing
        return _Rows(
            self.time[late], self.stamp[late], self.q[late], self.torque[late], self.known[late]
        )


@dataclass(slots=True)
class DynamicBound:
    """Bounds the dynamic torques of a run: the examination of the safeguard `static_model`.

    `payload_at` returns the payload in force at a time (ns).
    """

    settings: Settings
    payload_at: Callable[[int], Payload]
    fast: float = 0.0
    unknown: float = 0.0
    worst: list[Worst] = field(init=False)
    steps: list[PositionStep] = field(default_factory=list)
    _turns: list[float] = field(init=False)
    _moves: NDArray[np.bool_] = field(init=False)
    _fastest: list[float] = field(init=False)
    _before: _Rows | None = None
    _done: float = -math.inf

    def __post_init__(self) -> None:
        robot = self.settings.robot
        joints = [robot.joint(name) for name in robot.joint_names]
        self.worst = [Worst() for _ in joints]
        self._turns = [math.tau if joint.kind == 'continuous' else 0.0 for joint in joints]
        turning = turning_of(robot)
        self._moves = np.array([of.moves for of in turning], np.bool_)
        self._fastest = [2.0 * of.fastest if of.moves else math.inf for of in turning]

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording."""
        of = rows.pairs.of_joints
        at = np.flatnonzero(np.diff(of, prepend=0))
        if not len(at):
            return
        joints, row = rows.pairs.joints, of[at]
        new = _Rows(
            joints.time[row], joints.stamp[row], joints.q[row], rows.torque[at], rows.weighed[at]
        )
        held = new.after(self._before)
        self._before = held.since(int(held.time[-1]) - KEPT)
        if not self._any_fast(held):
            return
        held = self._stepped(held)
        for track in track_of(held.time, held.stamp, held.q, self._turns):
            self._judge(track, held)

    def _stepped(self, rows: _Rows) -> _Rows:
        """Return rows without what is around steps of positions, which are no motion."""
        found = steps_in(rows.time, rows.q, self._turns, self._fastest)
        self.steps += [step for step in found if step not in self.steps]
        known = rows.known.copy()
        for step in found:
            known &= np.abs(rows.time - step.time) > AROUND
        return _Rows(rows.time, rows.stamp, rows.q, rows.torque, known)

    def _any_fast(self, rows: _Rows) -> bool:
        firsts = np.flatnonzero(np.diff(rows.time // COARSE, prepend=-1))
        seconds = np.maximum(np.diff(rows.time[firsts]) / 1e9, COARSE / 2e9)
        way = np.abs(np.diff(rows.q[firsts], axis=0))
        turns = np.array(self._turns)
        way = np.minimum(way, np.where(turns > 0.0, np.abs(way - turns), np.inf))
        return bool((way[:, self._moves] > QUICK * FAST * seconds[:, np.newaxis]).any())

    def _judge(self, track: Track, rows: _Rows) -> None:
        """Judge the part of a track that was not judged before."""
        rate = np.where(self._moves, track.rate, 0.0)
        quick = (np.abs(rate) > FAST).any(axis=1) & (track.time > self._done)
        self._done = max(self._done, float(track.time[-1]))
        self.unknown += STEP * float((quick & ~track.sure).sum())
        quick &= track.sure & rows.known[track.row]
        self.fast += STEP * float(quick.sum())
        cells = np.flatnonzero(quick)
        if not len(cells):
            return
        acceleration = np.where(self._moves, track.acceleration(), 0.0)
        static = rows.torque[track.row[cells]]
        added = np.empty_like(static)
        for some, payload in self._payloads(rows.time[track.row[cells]]):
            moving = (track.q[cells[some]], rate[cells[some]], acceleration[cells[some]])
            added[some] = self._added(*moving, payload, static[some])
        limit = np.array(self.settings.limits.torque) * self.settings.limits.torque_error
        left = limit - np.abs(static) - added
        self._runs(cells, (left < 0.0) & (np.abs(static) <= limit))
        left = np.where(np.abs(static) <= limit, left, np.inf)
        for j in np.flatnonzero(np.isfinite(limit)).tolist():
            k = int(left[:, j].argmin())
            if left[k, j] < self.worst[j].left:
                longest = self.worst[j].longest
                self.worst[j] = Worst(
                    float(left[k, j]), int(rows.time[track.row[cells[k]]]), float(static[k, j]),
                    float(added[k, j]), rate[cells[k]], acceleration[cells[k]], longest,
                )  # fmt: skip

    def _added(
        self, q: Floats, rate: Floats, acceleration: Floats, payload: Payload, static: Floats
    ) -> Floats:
        """Return the most (n, j) that rates and accelerations add to `static` torques (N m; N)."""
        robot, rest = self.settings.robot, np.zeros_like(rate)
        parts = (
            inverse_dynamics(robot, q, rate, rest, NO_GRAVITY, payload),
            inverse_dynamics(robot, q, rest, acceleration, NO_GRAVITY, payload),
        )
        needed = np.abs(static + parts[0] + SMOOTHED * parts[1])
        added: Floats = np.maximum(needed - np.abs(static), 0.0)
        return added

    def _payloads(self, times: Times) -> Iterator[tuple[NDArray[np.intp], Payload]]:
        """Yield which of the moments had which payload."""
        ends = [self.payload_at(int(t)) for t in times[[0, -1]]]
        if ends[0] == ends[1]:
            yield np.arange(len(times)), ends[0]
            return
        every = [self.payload_at(int(t)) for t in times]
        for payload in dict.fromkeys(every):
            yield np.flatnonzero([p == payload for p in every]), payload

    def _runs(self, cells: NDArray[np.intp], past: NDArray[np.bool_]) -> None:
        """Measure how long joints are past their limits without a break (cells of a track)."""
        breaks = np.diff(cells, prepend=cells[0]) > 1
        for j, of in enumerate(self.worst):
            ends = np.flatnonzero(~past[:, j] | breaks)
            edges = np.concatenate(([-1], ends, [len(cells)]))
            of.longest = max(of.longest, STEP * float(np.diff(edges).max() - 1))

    def statement(self, start: int, end: int) -> Statement:
        """Return what motion added at most, and which joints it may have brought past a limit."""
        del end
        names = self.settings.robot.joint_names
        found = [(name, w) for name, w in zip(names, self.worst, strict=True) if w.left < math.inf]
        objections = tuple(self._objection(name, w, start) for name, w in found if w.left < 0.0)
        result: Json = {
            'fast_s': self.fast,
            'joints': {name: self._result(name, w, start) for name, w in found},
        }
        unchecked: tuple[NotChecked, ...] = ()
        if self.unknown > 0.0:
            why = 'joint states come too seldom, or too irregularly, to tell accelerations'
            unchecked = (NotChecked('dynamic torques of fast joints', why, self.unknown),)
        stepped = tuple(self._stepping(step, start) for step in self.steps[:MOST])
        return Statement({'dynamic_torque': result}, objections + stepped, unchecked)

    def _stepping(self, step: PositionStep, start: int) -> Objection:
        joint = self.settings.robot.joint(self.settings.robot.joint_names[step.joint])
        way = f'{step.way:.3f} m' if joint.slides else f'{math.degrees(step.way):.1f} deg'
        reason = (
            f'at {(step.time - start) / 1e9:.2f} s: the position of {joint.name} jumps by {way} '
            'from one message to the next: homed? Its positions before or after are wrong'
        )
        return Objection('joint_positions', INCONCLUSIVE, reason)

    def _objection(self, name: str, worst: Worst, start: int) -> Objection:
        robot = self.settings.robot
        unit = robot.joint(name).units.effort
        k = int(np.abs(worst.rate).argmax())
        mover = robot.joint(robot.joint_names[k])
        limit = worst.left + abs(worst.static) + worst.added
        reason = (
            f'at {(worst.at - start) / 1e9:.2f} s: {name} needs {abs(worst.static):.1f} {unit} at '
            f'rest, and its motion up to {worst.added:.1f} {unit} more; its limit is '
            f'{limit:.1f} {unit} ({_motion(mover.name, mover.slides, worst, k)})'
        )
        return Objection('static_model', INCONCLUSIVE, reason)

    def _result(self, name: str, worst: Worst, start: int) -> Json:
        return {
            'unit': self.settings.robot.joint(name).units.effort,
            'static': abs(worst.static),
            'added': worst.added,
            'left': worst.left,
            'time_s': (worst.at - start) / 1e9,
            'longest_past_limit_s': worst.longest,
        }


def _motion(name: str, slides: bool, worst: Worst, k: int) -> str:  # noqa: FBT001 - of a joint
    rate, acceleration = abs(worst.rate[k]), abs(worst.acceleration[k])
    if slides:
        return f'{name} at {rate:.2f} m/s and {acceleration:.1f} m/s2'
    return f'{name} at {math.degrees(rate):.0f} deg/s and {acceleration:.1f} rad/s2'
