"""Evaluates a recording: batches of message columns in, margins and alerts out.

By the same rules as live.py: a recording gives the margins and alerts that the live stream gave.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts.rules import InputSignals, RuleSet
from ugv_acceptance.evaluation.alerts.state_machine import Signal, feed
from ugv_acceptance.evaluation.chassis.columns import ChassisColumns
from ugv_acceptance.evaluation.chassis.motion import ChassisMotion
from ugv_acceptance.evaluation.ground_contact import GroundContact, blanked
from ugv_acceptance.evaluation.inputs import joint_state_words as words
from ugv_acceptance.evaluation.inputs.frames import without_prefix
from ugv_acceptance.evaluation.inputs.imu import ORIENTATIONS, ImuRows, ImuTracker
from ugv_acceptance.evaluation.inputs.imu_mount import ImuMount, felt_by
from ugv_acceptance.evaluation.inputs.joint_rates import JointRate
from ugv_acceptance.evaluation.inputs.joint_rows import JointRows
from ugv_acceptance.evaluation.inputs.joints import JointMerger
from ugv_acceptance.evaluation.inputs.payload import (
    PayloadHistory,
    payload_fault,
    payload_from,
)
from ugv_acceptance.evaluation.inputs.timeouts import FOREVER, STARTUP, InputTimeout, clock_words
from ugv_acceptance.evaluation.lost_margins import lost_in
from ugv_acceptance.evaluation.margin_table import MarginRows, Pairs
from ugv_acceptance.evaluation.margin_watch import watch_margins
from ugv_acceptance.evaluation.rough_ground import ground_rows
from ugv_acceptance.evaluation.row_ends import newest_row, preceded, without_joints
from ugv_acceptance.evaluation.samples import Batch, PayloadColumns
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.clearance import Face, clearance
from ugv_acceptance.model.mechanics import Mechanics, mechanics_of, posture_of
from ugv_acceptance.model.reactions import carry
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.row_selection import ALL, Rows, inner, pick
from ugv_acceptance.model.stability import (
    UNKNOWN,
    Stance,
    many_stances,
    many_standing,
    stability_of,
    tip_angles_of,
)
from ugv_acceptance.type_aliases import Floats, Times

# A period of silence (ns): from when the input became stale to its next message.
Gap = tuple[int, int]
# Mass (kg) and centre of gravity (3, m) of payloads: floats, or arrays of one a joint row.
Load = tuple[Floats | float, ...]

# Time and row number that stand for "no message yet".
NEVER = -1


@dataclass(frozen=True, slots=True)
class _Newest:
    """The rows of both inputs in a batch, each preceded by the newest row of the batch before.

    `joints_until`, `imu_until` (ns) are when each row becomes stale.
    """

    joints: JointRows
    joints_until: Times
    imu: ImuRows
    imu_until: Times


@dataclass(slots=True)
class RecordedEvaluator:
    """Takes the batches of a recording in order; `watch.log` holds the alerts at the end.

    Moments, energies and ZMP are computed only with `detail`. `fresh` are the timeouts and `gaps`
    the periods of silence (ns) of joint states and IMU, `first_payload` is the first payload that
    was declared, and when (ns), `carrying` are joints (numbers) that carried; `joints` merges.
    """

    settings: Settings
    detail: bool = False
    watch: RuleSet = field(init=False)
    _mechanics: Mechanics = field(init=False)
    joints: JointMerger = field(init=False)
    mount: ImuMount = field(init=False)
    _imu: ImuTracker = field(init=False)
    _chassis: ChassisColumns = field(init=False)
    _ground: GroundContact = field(init=False)
    fresh: tuple[InputTimeout, InputTimeout] = field(init=False)
    _carry: _Newest = field(init=False)
    _payload: PayloadHistory = field(init=False)
    gaps: tuple[list[Gap], list[Gap]] = field(default_factory=lambda: ([], []))
    first_payload: tuple[int, Payload] | None = None
    carrying: set[int] = field(default_factory=set)
    _known_until: int | None = None
    _began: int = 0

    def __post_init__(self) -> None:
        self.watch = RuleSet(self.settings)
        robot = self.settings.robot
        self._mechanics = mechanics_of(robot)
        self.joints = JointMerger(self.settings, self.watch.jump_signals)
        self.mount = ImuMount(self.settings, *self.watch.mounting)
        placed = self.mount.applied(self.settings)
        self._imu = ImuTracker(placed, self.watch.attitude)
        self._chassis = ChassisColumns(ChassisMotion(placed, self.watch.chassis))
        self.mount.serve(self._imu, self._chassis.place)
        self.fresh = (InputTimeout(self.settings.delays), InputTimeout(self.settings.delays))
        self._ground = GroundContact(self.settings, self._mechanics, self.watch.ground)
        self._payload = PayloadHistory(robot.payload)
        never = np.full(1, NEVER, np.int64)
        empty = np.full((1, len(robot.joint_names)), np.nan)
        joints = JointRows(never, never, empty, empty, empty, never, never < 0)
        imu = ImuRows(never, never, np.full((1, 3), np.nan), never < 0, never < 0)
        self._carry = _Newest(joints, never, imu, never)
        if not self.settings.hears_imu:
            level = np.array([[0.0, 0.0, -robot.gravity]])
            down = ImuRows(never, never, level, never > 0, never < 0)
            self._carry = _Newest(joints, never, down, never + FOREVER)
        for fresh in self._unheard():
            fresh.last = FOREVER

    def _unheard(self) -> Iterator[InputTimeout]:
        """Yield the timeouts of inputs that are not needed: they are never stale."""
        heard = (self.settings.hears_joints, self.settings.hears_imu)
        yield from (fresh for fresh, need in zip(self.fresh, heard, strict=True) if not need)

    @property
    def orientations(self) -> dict[str, int]:
        """Number of IMU messages by how their orientation was treated, see inputs/imu.py."""
        return dict(zip(ORIENTATIONS, self._imu.taken, strict=True))

    @property
    def imu(self) -> ImuTracker:
        """The tracker of the IMU, with what its checks judged."""
        return self._imu

    @property
    def rates(self) -> list[JointRate]:
        """How far the reported rate of each joint can be believed."""
        return self.joints.rates

    def start(self, now: int) -> None:
        """Begin at the recording's start, `now` (ns): an input without messages becomes stale."""
        self._began = now
        for fresh in self.fresh:
            fresh.started = now
        self._ground.start = now
        self.watch.relax(now)

    def finish(self, now: int) -> None:
        """Finish at the recording's end, `now` (ns): judge what becomes due until then."""
        if self._known_until is not None and now > self._known_until:
            self.watch.lose(self._known_until)
        inputs = (self.watch.joints, self.watch.imu)
        for fresh, signals, gaps in zip(self.fresh, inputs, self.gaps, strict=True):
            due = fresh.deadline
            if due is not None and now > due:
                self._silent(signals.stale, due)
                gaps.append((due, now))
        for signal in self.watch.signals:
            signal.advance(now)

    def batch(self, batch: Batch) -> MarginRows:
        """Take a batch; return the margins of its messages; the last row's `until` is provisional.

        It is when an input becomes stale, unless the next batch brings a message before.
        """
        felt = batch.imu if self.settings.hears_imu else ()
        if self.settings.hears_joints:
            joints = self.joints.merge_columns(batch.joints)
            felt, imu = felt_by(self.mount, self._imu, felt, (self._carry.joints, joints))
            joint_limits = self._input(0, joints.time, joints.stamp, self.watch.joints)
            self._watch_joints(joints, joint_limits)
            until = np.where(self.joints.told.repeating, NEVER, joints.oldest + joint_limits)
        else:
            felt, imu = felt_by(self.mount, self._imu, felt, (self._carry.joints,))
            joints = without_joints(imu)
            until = joints.oldest + np.full(len(imu.time), FOREVER)
        imu_limits = self._input(1, imu.time, imu.stamp, self.watch.imu)
        feed(self.watch.imu.invalid, imu.time, imu.unusable)
        self._take_payloads(batch.payload)
        newest = _Newest(
            preceded(self._carry.joints, joints),
            np.concatenate((self._carry.joints_until, until)),
            preceded(self._carry.imu, imu),
            np.concatenate((self._carry.imu_until, imu.time + imu_limits)),
        )
        load = self._payload.at(newest.joints.time)
        rows = self._margins(newest, load)
        rows = replace(rows, ground=ground_rows(self.settings, self._began, rows, load))
        lost, self._known_until = lost_in(rows, self._known_until)
        watch_margins(self.settings, self.watch, rows, lost)
        chassis = self._chassis.take(felt, rows, load, (lost.place, lost.time))
        rows = replace(rows, chassis=chassis)
        self._carry = _Newest(
            newest_row(newest.joints),
            newest.joints_until[-1:],
            newest_row(newest.imu),
            newest.imu_until[-1:],
        )
        return rows

    def _input(self, which: int, time: Times, stamp: Times, signals: InputSignals) -> Times:
        """Judge an input's silence and clock; return each message's limit of silence (ns)."""
        fresh = self.fresh[which]
        if not len(time):
            return time
        due = fresh.deadline
        apart = np.diff(time, prepend=time[0] if fresh.last is None else fresh.last) / 1e9
        wrong = fresh.clocks(time, stamp)
        before, limits = fresh.messages(time)
        deadlines = np.append(time[0] if due is None else due, time[:-1] + before[1:])
        for k in np.flatnonzero(time > deadlines):
            self._silent(signals.stale, int(deadlines[k]))
            signals.stale.clear(int(time[k]))
            self.gaps[which].append((int(deadlines[k]), int(time[k])))
        signals.stale.clear(int(time[-1]))
        feed(signals.clock, time, wrong, lambda row: clock_words(int(time[row]), int(stamp[row])))
        feed(signals.slow, time, apart)
        return limits

    def _silent(self, stale: Signal, due: int) -> None:
        """Take that an input was silent from `due` (ns) on."""
        if stale is self.watch.joints.stale and not stale.raw:
            stale.detail = words.why_foreign(self.joints, due)
        stale.set(due, 1.0)

    def _watch_joints(self, joints: JointRows, limits: Times) -> None:
        merger, time = self.joints, joints.time
        feed(
            self.watch.joints.invalid,
            time,
            joints.unusable,
            lambda row: words.why_unusable(merger, row),
        )
        late = (joints.oldest != NEVER) | (time - merger.began > STARTUP)
        old = (late & (time - joints.oldest > limits)) | merger.told.doubted
        feed(
            self.watch.missing, time, old,
            lambda row: words.what_is_missing(merger, int(time[row]), int(limits[row]), row),
        )  # fmt: skip
        feed(self.watch.repeated, time, merger.told.repeated)
        for signal, rate in zip(self.watch.speed, merger.told.speed.T, strict=True):
            if signal.on < np.inf:
                feed(signal, joints.time, np.abs(rate))

    def _take_payloads(self, segments: Sequence[PayloadColumns]) -> None:
        messages = [(int(t), s, k) for s in segments for k, t in enumerate(s.log_time)]
        for when, s, k in sorted(messages, key=lambda message: message[0]):
            frame = without_prefix(s.frame_id, self.settings.frame_prefix)
            told = self.settings.robot, s.mass[k], s.com[k], frame
            payload = payload_from(*told)
            self.watch.declared(when, '' if payload else payload_fault(*told))
            self._payload.declare(when, payload)
            if payload:
                self.first_payload = self.first_payload or (when, payload)

    def _margins(self, newest: _Newest, load: Load) -> MarginRows:
        """Return the margins of every message of the batch (not of the preceding rows).

        `load` is the payload of each joint row.
        """
        joints, imu = newest.joints, newest.imu
        time = np.concatenate((joints.time[1:], imu.time[1:]))
        order = np.argsort(time, kind='stable')
        from_joints = order < len(joints.time) - 1
        of_joints = np.cumsum(from_joints, dtype=np.intp)
        of_imu = np.arange(1, len(order) + 1) - of_joints
        if not self.settings.hears_joints:  # only IMU messages bring margins
            order, of_joints = order[~from_joints], of_joints[~from_joints]
            of_imu = of_imu[~from_joints]
        time = time[order]
        pairs = Pairs(joints, imu, of_joints, of_imu)
        j, i = pairs.of_joints, pairs.of_imu
        fresh_until = np.minimum(newest.joints_until[j], newest.imu_until[i])
        whole = np.isfinite(joints.q.T).all(axis=0) & np.isfinite(load[0])
        known = (time <= fresh_until) & whole[j] & np.isfinite(imu.gravity[:, 0])[i]
        table, state, height = self._table(pairs, load, whole, known)
        n = len(self.settings.robot.joint_names)
        touch = self._ground.columns(time, known, height, (joints.q, load, j))
        known, permitted = blanked(known, (table, state), touch, n)
        return MarginRows(
            time=time,
            stamp=np.concatenate((joints.stamp[1:], imu.stamp[1:]))[order],
            until=np.minimum(fresh_until, np.append(time[1:], fresh_until[-1:])),
            known=known,
            torque=table[:n].T,
            angle=table[n : n + 4].T,
            state=state,
            moment=table[n + 4 : n + 8].T,
            energy=table[n + 8 : n + 12].T,
            zmp=table[n + 12 :].reshape(-1),
            pairs=pairs,
            clearance=height,
            touches=permitted,
        )

    def _table(
        self, pairs: Pairs, load: Load, whole: NDArray[np.bool_], known: NDArray[np.bool_]
    ) -> tuple[Floats, NDArray[np.int8], Floats]:
        """Return torques, angles and what `detail` adds as rows; states and clearances (n,), m.

        `load` is the payload (mass and place) of each joint row, `whole` says which joint rows have
        all positions and a known load, `known` which rows have margins.
        """
        q, n = pairs.joints.q, pairs.joints.q.shape[1]
        table = np.empty((n + (13 if self.detail else 4), len(known)))
        state = np.full(len(known), UNKNOWN, np.int8)
        height = np.full(len(known), np.nan)
        rows: Rows = ALL
        if not self.settings.hears_imu or not known.all():
            table.fill(np.nan)
        if not known.all():
            rows = np.flatnonzero(known)
        j, i = pairs.of_joints[rows], pairs.of_imu[rows]
        if not len(j):
            return table, state, height
        columns = list(q.T) if whole.all() else list(np.where(whole[:, None], q, 0.0).T)
        mass, x, y, z = (_known(number, whole) for number in load)
        posture = posture_of(self._mechanics, columns, mass, (x, y, z))
        gravity = tuple(axis[i] for axis in pairs.imu.gravity.T)
        with np.errstate(over='ignore', invalid='ignore'):
            for line, torque_gradient in zip(table, posture.torque_gradients, strict=False):
                line[rows] = _product(torque_gradient, j, gravity)
            for line, law in zip(table, posture.laws, strict=False):
                line[rows] = line[rows] - pick(law, j)
        hangs, hears = (columns, (x, y, z)), self.settings.hears_imu
        heights: dict[Face, Floats] = {}
        stances = many_stances(self._mechanics, posture, len(q))
        for some, stance in many_standing(stances, len(q), j, gravity):
            place = inner(rows, some)
            at, down = (posture, j[some], self._mechanics), pick(gravity, some)
            self.carrying.update(carry(table, place, *at, stance.points, down))
            face = stance.ground_face if hears else None
            if face not in heights:
                least = clearance(self._mechanics, face, *hangs)
                heights[face] = np.broadcast_to(least, len(q))
            height[place] = heights[face][j[some]]
            if not hears:
                continue
            found = self._stability(stance, down)
            for line, value in zip(table[n:], found, strict=False):
                line[place] = value
            state[place] = found[-1]
        return table, state, height

    def _stability(self, stance: Stance, gravity: Any) -> tuple[Any, ...]:  # noqa: ANN401 - arrays
        if not self.detail:
            angle, state = tip_angles_of(stance, gravity)
            return *angle, state
        found = stability_of(stance, gravity)
        return *found.angle, *found.moment, *found.energy, found.zmp, found.state


def _product(torque_gradient: Any, rows: NDArray[np.intp], gravity: Any) -> Floats:  # noqa: ANN401
    """Return the static torque gradient . gravity; the gradient's numbers are floats or arrays."""
    x, y, z = pick(torque_gradient, rows)
    product: Floats = x * gravity[0] + y * gravity[1] + z * gravity[2]
    return product


def _known(number: Floats | float, whole: NDArray[np.bool_]) -> Floats | float:
    """Return a number of the payload with 0 where it is not known, so that it can be computed."""
    return number if isinstance(number, float) else np.where(whole, number, 0.0)
