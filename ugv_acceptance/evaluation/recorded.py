"""The evaluation of a recording: batches of columns in, blocks of margins out, same rules as live."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts import feed
from ugv_acceptance.evaluation.freshness import Freshness
from ugv_acceptance.evaluation.imu import ImuRows, ImuTracker
from ugv_acceptance.evaluation.joints import JointMerger, JointRows
from ugv_acceptance.evaluation.samples import Batch, PayloadColumns
from ugv_acceptance.evaluation.payload import payload_from
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.evaluation.watch import InputSignals, Watch
from ugv_acceptance.model.mechanics import Mechanics, mechanics_of, posture_of, take
from ugv_acceptance.model.stability import NO_CONTACT, stability_of, stances_of, take_stance
from ugv_acceptance.model.statics import torque_of

Floats = NDArray[np.float64]
Times = NDArray[np.int64]

# A stretch of silence (ns): from when the input was stale to its next message.
Gap = tuple[int, int]

UNKNOWN = -1


@dataclass(frozen=True, slots=True)
class MarginRows:
    """Margins of a stretch of a recording, one row a message of either input, in order of receipt.

    `until` (ns) is how long a row holds: to the next message or until an input is stale; `known`
    says which rows have margins, the others are NaN. `joints` and `imu` number the pair's messages
    in the arrays of this stretch, whose row 0 is the newest message of the stretch before.
    Torques (n, j) in N m (N), their levers' measured counterpart in `effort`; angles (n, 4) rad to
    SIDES, moments N m, energies J, ZMP distance m.
    """

    time: Times
    stamp: Times
    until: Times
    known: NDArray[np.bool_]
    q: Floats
    qd: Floats
    effort: Floats
    gravity: Floats
    torque: Floats
    angle: Floats
    moment: Floats
    energy: Floats
    zmp: Floats
    state: NDArray[np.int8]


@dataclass(frozen=True, slots=True)
class _Newest:
    """Rows of both inputs of a stretch, each led by the newest row of the stretch before."""

    joints: JointRows
    joints_until: Times
    imu: ImuRows
    imu_until: Times


@dataclass(slots=True)
class RecordedEvaluator:
    """Takes the batches of a recording in order; `watch.log` holds the alerts at the end."""

    settings: Settings
    watch: Watch = field(init=False)
    _mechanics: Mechanics = field(init=False)
    _joints: JointMerger = field(init=False)
    _imu: ImuTracker = field(init=False)
    fresh: tuple[Freshness, Freshness] = field(init=False)
    _carry: _Newest = field(init=False)
    _payload: tuple[float, float, float, float] = field(init=False)
    gaps: tuple[list[Gap], list[Gap]] = field(default_factory=lambda: ([], []))

    def __post_init__(self) -> None:
        self.watch = Watch(self.settings)
        robot = self.settings.robot
        self._mechanics = mechanics_of(robot)
        self._joints = JointMerger(self.settings)
        self._imu = ImuTracker(self.settings, self.watch.disagreement)
        self.fresh = (Freshness(self.settings.delays), Freshness(self.settings.delays))
        self._payload = (robot.payload.mass, *robot.payload.cog)
        never = np.full(1, UNKNOWN, np.int64)
        empty = np.full((1, len(robot.joint_names)), np.nan)
        nothing = np.full(1, np.nan)
        joints = JointRows(never, never, empty, empty, empty, never, never < 0)
        imu = ImuRows(never, never, np.full((1, 3), np.nan), nothing, nothing)
        self._carry = _Newest(joints, never, imu, never)

    def start(self, now: int) -> None:
        """Say when the recording began: an input that never comes is stale from then on."""
        for fresh in self.fresh:
            fresh.started = now

    def finish(self, now: int) -> None:
        """Say when the recording ended: what fell due until then is judged."""
        inputs = (self.watch.joints, self.watch.imu)
        for fresh, signals, gaps in zip(self.fresh, inputs, self.gaps, strict=True):
            due = fresh.deadline
            if due is not None and now > due:
                signals.stale.set(due, 1.0)
                gaps.append((due, now))
        for signal in self.watch.signals():
            signal.advance(now)

    def batch(self, batch: Batch) -> MarginRows:
        """Take a batch; return the margins of its messages (all but `until` of the last known)."""
        joints = self._joints.merge_columns(batch.joints)
        imu = self._imu.columns(batch.imu)
        joint_limits = self._input(0, joints.time, joints.stamp, self.watch.joints)
        imu_limits = self._input(1, imu.time, imu.stamp, self.watch.imu)
        self._watch_inputs(joints, joint_limits, imu)
        newest = _Newest(
            _lead(self._carry.joints, joints),
            np.concatenate((self._carry.joints_until, joints.oldest + joint_limits)),
            _lead(self._carry.imu, imu),
            np.concatenate((self._carry.imu_until, imu.time + imu_limits)),
        )
        rows = self._margins(newest, self._payload_of(newest.joints.time, batch.payload))
        self._watch_pairs(rows)
        self._carry = _Newest(
            _last(newest.joints), newest.joints_until[-1:], _last(newest.imu), newest.imu_until[-1:]
        )
        return rows

    def _input(self, which: int, time: Times, stamp: Times, signals: InputSignals) -> Times:
        """Judge an input's silence and clock; return each message's limit of silence (ns)."""
        fresh = self.fresh[which]
        if not len(time):
            return time
        due = fresh.deadline
        wrong = fresh.clocks(time, stamp)
        before, limits = fresh.messages(time)
        deadlines = np.append(time[0] + 1 if due is None else due, time[:-1] + before[1:])
        for k in np.flatnonzero(time > deadlines):
            signals.stale.set(int(deadlines[k]), 1.0)
            signals.stale.clear(int(time[k]))
            self.gaps[which].append((int(deadlines[k]), int(time[k])))
        signals.stale.clear(int(time[-1]))
        feed(signals.clock, time, wrong)
        return limits

    def _watch_inputs(self, joints: JointRows, limits: Times, imu: ImuRows) -> None:
        feed(self.watch.joints.invalid, joints.time, joints.unusable.astype(np.float64))
        late = (joints.time - joints.oldest > limits).astype(np.float64)
        feed(self.watch.missing, joints.time, late)
        for signal, rate in zip(self.watch.speed, joints.qd.T, strict=True):
            feed(signal, joints.time, np.abs(rate))
        feed(self.watch.strange, imu.time, imu.strange)
        invalid = np.isnan(imu.gravity[:, 0]).astype(np.float64)
        feed(self.watch.imu.invalid, imu.time, invalid)

    def _payload_of(self, times: Times, segments: Sequence[PayloadColumns]) -> list[Floats]:
        """Return payload mass and centre of gravity (4 arrays) in force at each joint state."""
        known = [self._payload]
        since = [UNKNOWN - 1]
        for segment in segments:
            for k, when in enumerate(segment.log_time.tolist()):
                payload = payload_from(
                    self.settings.robot, segment.mass[k], segment.com[k], segment.frame_id
                )
                self.watch.payload.step(when, 0.0 if payload else 1.0)
                if payload:
                    known.append((payload.mass, *payload.cog))
                    since.append(when)
        self._payload = known[-1]
        newest = np.searchsorted(np.array(since), times, side='right') - 1
        return list(np.array(known)[newest].T)

    def _margins(self, newest: _Newest, payload: list[Floats]) -> MarginRows:
        """Return the margins of every message after the leading rows."""
        joints, imu = newest.joints, newest.imu
        time = np.concatenate((joints.time[1:], imu.time[1:]))
        order = np.argsort(time, kind='stable')
        of_joints = order < len(joints.time) - 1
        j, i = np.cumsum(of_joints), np.cumsum(~of_joints)
        fresh_until = np.minimum(newest.joints_until[j], newest.imu_until[i])
        time = time[order]
        gravity = imu.gravity[i]
        whole = np.isfinite(joints.q).all(axis=1)
        known = (time <= fresh_until) & whole[j] & np.isfinite(gravity[:, 0])
        table = self._table(joints.q, whole, payload, j, gravity, known)
        n = len(self.settings.robot.joint_names)
        return MarginRows(
            time=time,
            stamp=np.concatenate((joints.stamp[1:], imu.stamp[1:]))[order],
            until=np.minimum(fresh_until, np.append(time[1:], fresh_until[-1:])),
            known=known,
            q=joints.q[j],
            qd=joints.qd[j],
            effort=joints.effort[j],
            gravity=gravity,
            torque=table[:n].T,
            angle=table[n : n + 4].T,
            moment=table[n + 4 : n + 8].T,
            energy=table[n + 8 : n + 12].T,
            zmp=table[n + 12],
            state=table[n + 13].astype(np.int8),
        )

    def _table(
        self,
        q: Floats,
        whole: NDArray[np.bool_],
        payload: list[Floats],
        j: NDArray[np.intp],
        gravity: Floats,
        known: NDArray[np.bool_],
    ) -> Floats:
        """Return torques, angles, moments, energies, ZMP and state (rows) of the known messages."""
        n = q.shape[1]
        table = np.full((n + 14, len(j)), np.nan)
        table[n + 13] = UNKNOWN
        rows = np.flatnonzero(known)
        if not len(rows):
            return table
        columns = np.where(whole[:, None], q, 0.0).T
        mass, x, y, z = payload
        posture = posture_of(self._mechanics, list(columns), mass, (x, y, z))
        g = tuple(gravity[rows].T)
        torque = torque_of(take(posture, j[rows]), (g[0], g[1], g[2]))
        for line, value in zip(table, torque, strict=False):
            line[rows] = value
        place = np.full(len(q), UNKNOWN)
        for of, stance in stances_of(self._mechanics, posture, len(q)):
            place[:] = UNKNOWN
            place[of] = np.arange(len(place[of]))
            at = place[j[rows]]
            some = rows[at >= 0]
            taken = take_stance(stance, at[at >= 0])
            found = stability_of(taken, tuple(gravity[some].T))
            values = (*found.angle, *found.moment, *found.energy, found.zmp, found.state)
            for line, value in zip(table[n:], values, strict=True):
                line[some] = value
        return table

    def _watch_pairs(self, rows: MarginRows) -> None:
        time = rows.time[rows.known]
        for (warn, error), torque in zip(self.watch.torque, rows.torque.T, strict=True):
            load = np.abs(torque[rows.known])
            feed(warn, time, load)
            feed(error, time, load)
        for (warn, error), angle in zip(self.watch.tip, rows.angle.T, strict=True):
            less = -angle[rows.known]
            feed(warn, time, less)
            feed(error, time, less)
        feed(self.watch.support, time, (rows.state[rows.known] >= NO_CONTACT).astype(np.float64))


def _lead(before: Any, rows: Any) -> Any:  # noqa: ANN401 - JointRows or ImuRows
    """Return `rows` led by the newest row of the stretch before."""
    names = [f.name for f in fields(rows)]
    return type(rows)(*(np.concatenate((getattr(before, n), getattr(rows, n))) for n in names))


def _last(rows: Any) -> Any:  # noqa: ANN401 - JointRows or ImuRows
    return type(rows)(*(getattr(rows, f.name)[-1:] for f in fields(rows)))
