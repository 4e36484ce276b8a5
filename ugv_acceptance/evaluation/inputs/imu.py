"""From IMU messages to gravity in `base_link`, and the faults of the IMU.

The orientation is used if the message provides one that is a valid rotation and not just a default;
else the low-passed accelerometer, which is a fault unless the message declares that it has no
orientation. Orientation and accelerometer must agree at rest, and the accelerometer must measure g:
otherwise gravity is unknown. The same steps are written for one message and for columns; a property
test holds that both give the same rows.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts.state_machine import WARN, Alert, Signal, feed
from ugv_acceptance.evaluation.inputs.frames import FrameCheck
from ugv_acceptance.evaluation.inputs.imu_cell import A, Q, W
from ugv_acceptance.evaluation.inputs.imu_grid import samples
from ugv_acceptance.evaluation.inputs.imu_motion import MotionChecks, MotionSignals
from ugv_acceptance.evaluation.inputs.imu_rest import RestChecks
from ugv_acceptance.evaluation.inputs.imu_seen import ImuSeen, rested_messages
from ugv_acceptance.evaluation.inputs.imu_turn import Raw
from ugv_acceptance.evaluation.inputs.low_pass import BELIEVABLE, NOWHERE, LowPass
from ugv_acceptance.evaluation.samples import ImuColumns
from ugv_acceptance.evaluation.settings import ImuInput, Settings
from ugv_acceptance.model.attitude import (
    UpKernels,
    angles_where,
    up_from_acceleration,
    up_from_orientation,
    up_kernels,
)
from ugv_acceptance.model.expressions import add, cross, rotate, scale
from ugv_acceptance.model.robot import Vector
from ugv_acceptance.model.row_selection import Values, blank
from ugv_acceptance.type_aliases import Floats, Times

Mask = NDArray[np.bool_]

# A unit quaternion's norm may be this far from 1 (single precision, rounding).
NORM_SLACK = 0.01
# Share of g by which the accelerometer may differ from g and still give the direction of gravity.
GRAVITY_SLACK = 0.15
# A specific force below this share of g means a fall, or is not a specific force.
FALL = 0.5
# How the orientation of a message was treated; 'told_nothing': invalid, or only a default.
ORIENTATIONS = ('used', 'not_given', 'told_nothing')


@dataclass(frozen=True, slots=True)
class ImuRows:
    """Gravity from IMU messages, one row a message: `gravity` (n, 3) m/s2 in `base_link`.

    NaN where it is unknown. `unusable` (n,) says that the message's own numbers cannot be used.
    `time` is of receipt, `stamp` of the header (ns). `gyro_trusted` (n,) is False while the gyro
    contradicts the orientation.
    """

    time: Times
    stamp: Times
    gravity: Floats
    unusable: Mask
    gyro_trusted: Mask


@dataclass(frozen=True, slots=True)
class AttitudeSignals:
    """The signals of IMU faults: foreign frame, empty orientation, wrong g, disagreement.

    `nothing`: neither orientation nor acceleration tells the tilt; `motion`: those of checks that
    work in motion.
    """

    frame: Signal
    orientation: Signal
    strange: Signal
    disagreement: Signal
    nothing: Signal
    motion: MotionSignals


@dataclass(slots=True)
class ImuTracker:
    """Turns IMU messages into gravity; holds the low-pass filter and the signals of IMU faults.

    While a fault of a level above WARN is active, gravity is unknown. `taken` counts messages by
    ORIENTATIONS; an orientation is 'not_given' if its covariance is -1 (REP-145). `motion` holds
    the checks that work in motion, `seen` what a recording showed, for its statement.
    """

    settings: Settings
    faults: AttitudeSignals
    low_pass: LowPass = field(init=False)
    taken: list[int] = field(default_factory=lambda: [0, 0, 0])
    motion: MotionChecks = field(init=False)
    seen: ImuSeen = field(default_factory=ImuSeen)
    _rest: RestChecks = field(init=False)
    _up: UpKernels = field(init=False)
    _frame: str | None = None
    _foreign: float = 0.0
    _expected: FrameCheck = field(default_factory=FrameCheck)
    _busy: bool = False

    def __post_init__(self) -> None:
        self.low_pass = LowPass(self.settings.imu.low_pass)
        self._up = up_kernels(self.settings.imu.mounting)
        self.motion = MotionChecks(self.settings, self.faults.motion)
        of = self.faults
        self._rest = RestChecks(of.strange, of.disagreement, self.settings.robot.gravity)

    @property
    def _delay(self) -> int:
        """For how long (ns) a disagreement at rest must last."""
        return int(self.settings.imu.agreement_delay * 1e9)

    @property
    def gyro_trusted(self) -> bool:
        """False while the gyro contradicts the orientation: unit, axes, or not known which."""
        return self.motion.gyro_trusted

    def adopt(self, settings: Settings) -> None:
        """Judge by other settings from now on."""
        self.settings = settings
        self.motion.adopt(settings)
        self._up = up_kernels(settings.imu.mounting)

    def step(  # noqa: PLR0913, PLR0917 - the fields of the message
        self,
        now: int,
        stamp: int,
        orientation: Sequence[float],
        covariance_0: float,
        omega: Sequence[float],
        acceleration: Sequence[float],
        frame: str = '',
        raw: Raw | None = None,
    ) -> tuple[Vector, bool]:
        """Take one message in sensor axes; return `gravity` and `unusable` as in ImuRows.

        `raw` is the message before it was turned into base axes, if it was: what holds the IMU's
        numbers against each other needs no joints.
        """
        smooth = self.low_pass.step(stamp, acceleration)
        ax, ay, az = smooth
        wx, wy, wz = omega
        size, spin = math.sqrt(ax * ax + ay * ay + az * az), math.sqrt(wx * wx + wy * wy + wz * wz)
        imu, g, up = self.settings.imu, self.settings.robot.gravity, self._up
        if frame != self._frame:
            self._take_frame(now, frame)
        x, y, z, w = orientation
        off = abs(size - g)
        still = spin <= imu.rest_rate
        rotation = covariance_0 != -1.0 and bool(_is_rotation(x, y, z, w))
        told = rotation and not (imu.attitude == 'auto' and x == y == z == 0.0)
        shown, apart = off <= GRAVITY_SLACK * g, math.nan
        by_orientation = up.orientation(x, y, z, w) if rotation else NOWHERE
        by_acceleration = up.acceleration(*smooth) if shown else NOWHERE
        if rotation and shown and still and off <= imu.rest_acceleration:
            (apart,) = up.between(*by_orientation, *by_acceleration)
        self.taken[0 if told else 1 if covariance_0 == -1.0 else 2] += 1
        empty = 0.0 if told or covariance_0 == -1.0 else _empty(rotation, apart, imu)
        strange = off / g if still else math.nan
        believable = off == off and spin <= BELIEVABLE  # noqa: PLR0124 - not NaN
        doubted = apart if told else math.nan
        of, rest, motion = self.faults, self._rest, self.motion
        # Small values cannot change quiet signals: most calls are saved.
        seen = strange >= of.strange.on or doubted >= of.disagreement.on or empty >= 0.5
        waits = self._busy or self._foreign or rest.pending
        lost = (seen or waits) and self._judge(now, empty, strange, doubted)
        motion.step(now, stamp, *(raw or (orientation, omega, acceleration)), told)
        if imu.specific_force:
            known = believable and size >= FALL * g
            down = _force(smooth, omega, imu) if known else NOWHERE
        elif not believable and imu.attitude == 'auto':
            known, down = False, NOWHERE
        else:
            ux, uy, uz = (
                by_orientation if told and imu.attitude != 'accelerometer' else by_acceleration
            )
            known, down = ux == ux, (-g * ux, -g * uy, -g * uz)  # noqa: PLR0124 - not NaN
        if not (known and of.nothing.quiet):
            of.nothing.step(now, off / g if believable and not known else 0.0)
        return NOWHERE if lost or motion.lost else down, not believable

    def _take_frame(self, now: int, frame: str) -> None:
        if self._frame is not None:
            self.motion.frame(now)
        self._frame = frame
        self._foreign = self._expected.foreign(frame, self.settings.imu.frame)

    def _judge(self, now: int, empty: float, strange: float, apart: float) -> bool:
        """Feed the fault signals with a message; return whether a fault makes gravity unknown."""
        of, lost = self.faults, False
        strange, apart = self._rest.step(now, strange, apart, self._delay)
        signals = (of.frame, of.orientation, of.strange, of.disagreement)
        for signal, value in zip(signals, (self._foreign, empty, strange, apart), strict=True):
            signal.step(now, value)
            signal.advance(now)
            lost = lost or (signal.alert is not None and signal.alert.rule.level > WARN)
        self._busy = not all(signal.quiet for signal in signals)
        return lost

    def columns(self, segments: Sequence[ImuColumns], raw: Floats | None = None) -> ImuRows:
        """Take many messages: the same rows as `step` one at a time, in order of receipt.

        `raw` (n, 10) are orientation, rate and force as of `step`, in order of receipt.
        """
        columns = [s for s in segments if len(s.log_time)]
        if not columns:
            none = np.empty(0, np.int64)
            return ImuRows(none, none, np.empty((0, 3)), none != 0, none == 0)
        time = np.concatenate([s.log_time for s in columns])
        order = np.argsort(time, kind='stable') if (np.diff(time) < 0).any() else slice(None)
        time, stamp = time[order], np.concatenate([s.stamp for s in columns])[order]
        q = _lines([s.orientation for s in columns])[:, order]
        covariance_0 = np.concatenate([s.orientation_covariance_0 for s in columns])[order]
        omega = _lines([s.angular_velocity for s in columns])[:, order]
        acceleration = _lines([s.linear_acceleration for s in columns])[:, order]
        frame = self.settings.imu.frame
        if len({s.frame_id for s in columns}) == 1:
            names = np.array([columns[0].frame_id])
            foreign = np.full(len(time), self._expected.rows(names, frame))
        else:
            lengths = [len(s.log_time) for s in columns]
            names = np.repeat([s.frame_id for s in columns], lengths)[order]
            foreign = self._expected.rows(names, frame)
        self._take_frames(time, names)
        self.seen.take(columns, omega)
        with np.errstate(all='ignore'):
            smooth = self.low_pass.columns(stamp, acceleration)
            told_by = q, covariance_0, omega, acceleration
            return self._rows(time, stamp, told_by, (smooth, raw), foreign)

    def _take_frames(self, time: Times, names: NDArray[np.str_]) -> None:
        """Take the frame that each message names, in order of receipt; the last for all after."""
        changed = np.flatnonzero(names[1:] != names[:-1]) + 1
        for k in [0, *changed.tolist()]:
            if names[k] != self._frame:
                if self._frame is not None:
                    self.motion.frame(int(time[k]))
                self._frame = str(names[k])

    def _rows(
        self,
        time: Times,
        stamp: Times,
        told_by: tuple[Floats, Floats, Floats, Floats],
        made: tuple[Floats, Floats | None],
        foreign: Floats,
    ) -> ImuRows:
        """Return the rows from `told_by` and what was `made` of it: `smooth`, and `raw` if turned.

        Orientation, covariance, rate and acceleration have shapes (4, n), (n,), (3, n) and (3, n);
        `smooth` (3, n) is the filtered acceleration, `foreign` (n,) is 1 for messages of another
        frame.
        """
        imu, g = self.settings.imu, self.settings.robot.gravity
        (q, covariance_0, omega, acceleration), (smooth, raw) = told_by, made
        size, spin = _norms(smooth), _norms(omega)
        off, still = np.abs(size - g), spin <= imu.rest_rate
        given = covariance_0 != -1.0
        rotation = given & _is_rotation(q[0], q[1], q[2], q[3])
        told = rotation & (q[:3] != 0.0).any(axis=0) if imu.attitude == 'auto' else rotation
        self._count(told, given)
        oriented = np.array(up_from_orientation(q[0], q[1], q[2], q[3], imu.mounting))
        blank(oriented, ~rotation)
        leaning = np.array(up_from_acceleration(smooth[0], smooth[1], smooth[2], imu.mounting))
        blank(leaning, ~(off <= GRAVITY_SLACK * g))
        rest = still & (off <= imu.rest_acceleration)
        rested = rested_messages(time, rest)
        self.seen.rested += rested
        apart = angles_where(rest, oriented, leaning)
        believable = (off == off) & (spin <= BELIEVABLE)  # noqa: PLR0124 - not NaN
        if imu.specific_force:
            force = np.array(_force(tuple(smooth), tuple(omega), imu))
            gravity = np.where(believable & ~(size < FALL * g), force, np.nan)
        else:
            use = told & (imu.attitude != 'accelerometer')
            gravity = -g * (oriented if use.all() else np.where(use, oriented, leaning))
            if imu.attitude == 'auto':
                blank(gravity, ~believable)
        unknown = believable & np.isnan(gravity[0])
        nothing = np.where(unknown, off / g, 0.0) if unknown.any() else np.zeros(len(time))
        strange = off / g
        blank(strange, ~still)
        faults = (foreign, np.zeros(len(time)), strange, apart)
        feed(self.faults.nothing, time, nothing)
        if not told.all():
            faults[1][:] = np.where(told | ~given, 0.0, _empty_rows(rotation, apart, imu))
            faults[3][~told] = np.nan
        self._judge_rows(time, faults, gravity)
        felt = (q, omega, acceleration) if raw is None else (raw.T[Q], raw.T[W], raw.T[A])
        table = samples(*felt, told)
        trusted = self._judge_motion(time, stamp, table, gravity)
        self._busy = True
        return ImuRows(time, stamp, gravity.T, ~believable, trusted)

    def _judge_motion(self, time: Times, stamp: Times, x: Floats, gravity: Floats) -> Mask:
        """Give samples (WIDTH, n) to the checks in motion; set gravity to NaN while one says so.

        Return where the gyro is trusted (n,).
        """
        of = self.faults.motion
        before = [(signal, signal.alert, len(signal.log)) for signal in of.all()]
        self.motion.columns(time, stamp, x)
        trusted = np.ones(len(time), np.bool_)
        for signal, alert, seen in before:
            for start, end in spans(signal, alert, seen):
                during = (time >= start) & (time < end)
                if signal.rule.level > WARN:
                    gravity[:, during] = np.nan
                if signal is of.rates or signal is of.rotation:
                    trusted[during] = False
        return trusted

    def _count(self, told: Mask, given: Mask) -> None:
        used, none = int(told.sum()), len(given) - int(given.sum())
        self.taken = [
            a + b for a, b in zip(self.taken, (used, none, len(told) - used - none), strict=True)
        ]

    def _judge_rows(self, time: Times, faults: Sequence[Floats], gravity: Floats) -> None:
        """Feed the fault signals; set gravity to NaN while one above the level WARN is active."""
        of = self.faults
        signals = (of.frame, of.orientation, of.strange, of.disagreement)
        before = [(signal, signal.alert, len(signal.log)) for signal in signals]
        foreign, empty, strange, apart = faults
        feed(of.frame, time, foreign)
        feed(of.orientation, time, empty)
        self._rest.columns(time, strange, apart, self._delay)
        for signal, alert, seen in before:
            for start, end in spans(signal, alert, seen):
                if signal.rule.level > WARN:
                    gravity[:, (time >= start) & (time < end)] = np.nan


def spans(signal: Signal, before: Alert | None, seen: int) -> Iterator[tuple[float, float]]:
    """Yield begin and end (ns) of a signal's alerts: `before`, and those after `seen` in the log.

    The log holds the alerts of other signals too. The end is infinite while an alert is active.
    """
    rule = signal.rule
    for alert in [before, *signal.log[seen:]]:
        if alert is None or alert.rule.level != rule.level:
            continue
        if (alert.rule.code, alert.rule.subject) == (rule.code, rule.subject):
            yield alert.start, math.inf if alert.end is None else alert.end


def _is_rotation(x: Values, y: Values, z: Values, w: Values) -> Values:
    return abs(x * x + y * y + z * z + w * w - 1.0) <= 2.0 * NORM_SLACK


def _empty(rotation: bool, apart: float, imu: ImuInput) -> float:  # noqa: FBT001 - as of rows
    """Return 1 if a given orientation is invalid or only a default, else 0; NaN if not known.

    A level orientation may be true: it counts as a default if the accelerometer at rest disagrees.
    """
    if imu.attitude == 'accelerometer':
        return 0.0
    if not rotation:
        return 1.0
    return math.nan if math.isnan(apart) else float(apart >= imu.agreement)


def _empty_rows(rotation: Mask, apart: Floats, imu: ImuInput) -> Floats:
    """Return `_empty` of many messages, shape (n,)."""
    if imu.attitude == 'accelerometer':
        return np.zeros(len(apart))
    denied = np.where(np.isnan(apart), np.nan, apart >= imu.agreement)
    return np.where(rotation, denied, 1.0)


def _lines(tables: Sequence[Floats]) -> Floats:
    """Concatenate tables (n, k) and return them transposed, (k, sum of n), in contiguous rows."""
    out = np.empty((tables[0].shape[1], sum(map(len, tables))))
    return np.concatenate([table.T for table in tables], axis=1, out=out)


def _norms(v: Floats) -> Floats:
    x, y, z = v
    size: Floats = np.sqrt(x * x + y * y + z * z)
    return size


def _force(smooth: Values, omega: Values, imu: ImuInput) -> Values:
    """Return minus the specific force at the origin of `base_link` (m/s2, base axes).

    `smooth` (m/s2) and `omega` (rad/s) in sensor axes; the angular acceleration is left out.
    """
    force = rotate(imu.mounting, smooth)
    spin = rotate(imu.mounting, omega)
    arm = scale(imu.position, -1.0)
    return scale(add(force, cross(spin, cross(spin, arm))), -1.0)
