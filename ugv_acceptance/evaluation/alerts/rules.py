"""The rules of alerts: which value is watched against which limit, live and recorded alike."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from operator import neg

from ugv_acceptance.evaluation.alerts.prediction import Prediction, foresight_of
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, STALE, WARN, Alert, Rule, Signal
from ugv_acceptance.evaluation.alerts.tipping_watch import LEAST_VALUE, TippingWatch
from ugv_acceptance.evaluation.chassis.motion import CALM, CAUTION, LIFT, LOW, ChassisSignals
from ugv_acceptance.evaluation.inputs.imu import AttitudeSignals
from ugv_acceptance.evaluation.inputs.imu_motion import MotionSignals
from ugv_acceptance.evaluation.inputs.repeats import ALLOWED as REPEATS_ALLOWED
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.permitted_limits import names_of, relaxed
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import SIDES

# Alerts of level ERROR with these codes are failures of the robot; all others are input faults.
FAILURES = ('TORQUE_LIMIT', 'TIP_OVER', 'TIP_MOVING', 'TIP_TREND', 'NO_SUPPORT')
# A tilt swings, so these alerts end later than others.
SWINGING = ('TIP_OVER', 'TIP_TREND')
# Share of g by which the acceleration at rest may differ from g.
STRANGE = 0.15
# Margin (rad) of a moving robot from which DANGER ends.
MARGIN_BACK = 0.01745
# An input is slow if SLOW (s) or more pass between its messages, one after the other for SLOW_FOR.
SLOW, SLOW_FOR = 0.3, 2.0
# No arm is this far (m) from the ground.
FAR = 1e6
# /tf_static, which may tell where the IMU is, takes so long (s) to arrive.
UNPLACED = 2.0
# An implausible jump is found by positions up to this (ns) before.
LEAP_REACH = 2_000_000_000
# A joint that moves faster than this many times its maximum speed reports another unit or joint.
LEAP = 10.0
# What confirms a fault of the IMU takes so long (s), and makes as much doubtful: identical values;
# two windows of rates, two of the unit, one of two sources, each a second late at most.
FROZEN, TURNED, UNIT, SOURCES = 1.0, 5.0, 4.0, 3.0


def urgency(code: str, level: int) -> int:
    """Return how urgent an alert is among those of its level: the larger, the sooner it is told.

    What contradicts the IMU, or margins as such, comes before a tip-over that was drawn from them,
    and that before others.
    """
    if (code.startswith('IMU_') and level > WARN) or code == 'ARM_ON_GROUND':
        return 2
    return 1 if code in ('TIP_OVER', 'TIP_TREND', 'NO_SUPPORT') else 0


@dataclass(slots=True)
class RuleSet:
    """The signals of all alert rules of a robot; `log` receives every alert that is raised.

    One signal per rule, a pair (WARN, ERROR) if a rule has two levels. `torque` and `speed` are in
    order of `robot.joint_names`, `tip` in order of SIDES; `signals` are all, in a fixed order.
    """

    settings: Settings
    log: list[Alert] = field(default_factory=list)
    torque: list[tuple[Signal, Signal]] = field(init=False)
    speed: list[Signal] = field(init=False)
    tip: list[tuple[Signal, Signal]] = field(init=False)
    support: Signal = field(init=False)
    ground: Signal = field(init=False)
    chassis: ChassisSignals = field(init=False)
    joints: 'InputSignals' = field(init=False)
    imu: 'InputSignals' = field(init=False)
    payload: Signal = field(init=False)
    missing: Signal = field(init=False)
    repeated: Signal = field(init=False)
    jump_signals: list[Signal] = field(init=False)
    attitude: AttitudeSignals = field(init=False)
    placing: Signal = field(init=False)
    prediction: Prediction = field(init=False)
    slide: Signal = field(init=False)
    trend: TippingWatch = field(init=False)
    relaxed: dict[str, Signal] = field(init=False)
    signals: tuple[Signal, ...] = field(init=False)
    _told: Settings | None = None
    _first: tuple[tuple[float, ...], float] = field(init=False)

    def __post_init__(self) -> None:
        limits, names = self.settings.limits, self.settings.robot.joint_names
        speeds = limits.speed or (float('inf'),) * len(names)
        delay = self.settings.delays.tip_on
        self.torque = [
            (
                self._torque(name, WARN, limits.torque_warn * limit),
                self._torque(name, ERROR, limits.torque_error * limit),
            )
            for name, limit in zip(names, limits.torque, strict=True)
        ]
        self.speed = [
            self._signal('STATIC_MODEL', name, WARN, (speed, 0.9 * speed), delay)
            for name, speed in zip(names, speeds, strict=True)
        ]
        self.tip = [
            (self._tip(side, WARN, limits.tip_warn), self._tip(side, ERROR, limits.tip_error))
            for side in SIDES
        ]
        self.support = self._fault('NO_SUPPORT', 'robot', ERROR, self.settings.delays.tip_on)
        # Its value is minus the clearance (m), evaluation/ground_contact.py decides what is bad.
        off, delay = (-FAR, -FAR), self.settings.delays.fault_on
        self.ground = self._signal('ARM_ON_GROUND', 'arm', ERROR, off, delay)
        self.chassis = self._chassis()
        self.joints, self.imu = self._input('joint_states'), self._input('imu')
        self.missing = self._fault('INPUT_INCOMPLETE', 'joint_states', STALE)
        self.repeated = _reaching(
            self._fault('JOINTS_REPEATED', 'joint_states', STALE, 0.0), REPEATS_ALLOWED
        )
        self.payload = self._fault('PAYLOAD_INVALID', 'payload', ERROR)
        self.jump_signals = [self._jump_signal(name) for name in names]
        self.attitude = self._attitude()
        self.placing = self._fault('IMU_MOUNTING_UNKNOWN', 'imu', STALE, UNPLACED)
        self.prediction = foresight_of(self.settings, self._warning)
        self.slide = self._slide()
        self.trend = TippingWatch(self.settings, self._trend())
        self.relaxed = {name: self._relaxed(name) for name in names_of(self.settings)}
        self.signals = self._all()
        self._first = self._first_limits()

    def adopt(self, settings: Settings) -> None:
        """Judge by other settings from now on; an active alert keeps the rule it was raised by."""
        self.settings = settings
        self.trend.adopt(settings)
        for signal, other in zip(self.signals, RuleSet(settings).signals, strict=True):
            signal.judge_by(other.rule)
        self._first = self._first_limits()

    def _first_limits(self) -> tuple[tuple[float, ...], float]:
        """Return the torques (N m; N) and the tip angle (rad) at which the first alerts begin."""
        return tuple([warn.on for warn, _ in self.torque]), -min(warn.on for warn, _ in self.tip)

    def is_small(self, torque: Sequence[float], angle: Sequence[float]) -> bool:
        """Return whether torques (j,) and tip angles (4,) are far from any limit, or not known."""
        most, least = self._first
        for tau, limit in zip(torque, most, strict=True):
            if tau >= limit or tau <= -limit:
                return False
        # Not by the least of them: that of a NaN and a number may be the NaN.
        for left in angle:  # noqa: SIM110 - every message would pay for a generator
            if left <= least:
                return False
        return True

    def step(self, now: int, torque: Sequence[float], angle: Sequence[float]) -> bool:
        """Take static torques (j,) and tip angles (4,; none: not judged) of a message at `now`.

        Return whether any of their signals is not quiet now.
        """
        # A torque that is not known is not too much; a tilt that is not known changes nothing.
        loads = [-math.inf if tau != tau else abs(tau) for tau in torque]  # noqa: PLR0124 - NaN
        loud = False
        for signals, values in ((self.torque, loads), (self.tip, map(neg, angle))):
            for (warn, error), value in zip(signals, values, strict=False):
                if value >= warn.on or not (warn.quiet and error.quiet):
                    warn.step(now, value)
                    error.step(now, value)
                    loud = loud or not (warn.quiet and error.quiet)
        return loud

    def relax(self, now: int) -> None:
        """Raise a warning for each limit that is relaxed at `now` (ns), and end the others."""
        if self._told is not self.settings:
            self._told = self.settings
            found = {breach.name for breach in relaxed(self.settings)}
            for name, signal in self.relaxed.items():
                signal.step(now, 1.0 if name in found else 0.0)

    def declared(self, now: int, fault: str) -> None:
        """Take a declared payload at `now` (ns); `fault` says why it cannot be used; '': it can."""
        if fault:
            self.payload.detail = fault
        self.payload.step(now, 1.0 if fault else 0.0)

    def predict(self) -> None:
        """Judge the live samples kept for the prediction; call it before time passes."""
        self.prediction.judge(self.settings.limits.torque)
        self.trend.judge()

    def predict_rows(self, rows: MarginRows) -> None:
        """Judge the prediction rules on the next part of a recording."""
        self.prediction.rows(rows, self.settings.limits.torque)
        self.trend.rows(rows)

    def _warning(self, code: str, subject: str, at: tuple[float, float], delay: float) -> Signal:
        return self._signal(code, subject, WARN, at, delay)

    def _signal(
        self,
        code: str,
        subject: str,
        level: int,
        at: tuple[float, float],
        on_delay: float,
        reach: float = 0.0,
    ) -> Signal:
        delays = self.settings.delays
        off = int((delays.tip_off if code in SWINGING else delays.off) * 1e9)
        # A warning does not make margins doubtful.
        back = int(reach * 1e9) if level > WARN else 0
        rule = Rule(code, subject, level, *at, int(on_delay * 1e9), off, reach=back)
        return Signal(rule, self.log)

    def _torque(self, joint: str, level: int, limit: float) -> Signal:
        at = (limit, limit - min(self.settings.limits.torque_deadband, limit / 2.0))
        return self._signal('TORQUE_LIMIT', joint, level, at, self.settings.delays.torque_on)

    def _tip(self, side: str, level: int, angle: float) -> Signal:
        """Return a tip-over signal; its value is minus the tilt left (rad): larger is worse."""
        at = (-angle, -angle - self.settings.limits.tip_deadband)
        return self._signal('TIP_OVER', side, level, at, self.settings.delays.tip_on)

    def _chassis(self) -> ChassisSignals:
        """Return the signals of a chassis in motion: without delay, a tip takes no longer."""

        def at(code: str, level: int, on: float, off: float) -> list[Signal]:
            return [self._signal(code, side, level, (on, off), 0.0) for side in SIDES]

        return ChassisSignals(
            at('TIP_MOVING', WARN, -CAUTION, -CALM),
            at('TIP_MOVING', ERROR, 0.0, -MARGIN_BACK),
            at('ACCELERATION', WARN, 0.0, -LOW),
            at('TRACK_LIFT', WARN, LIFT, LIFT),
        )

    def _slide(self) -> Signal:
        """Return the sliding signal; its value is minus the slope left (rad), see slides_first."""
        limits, delay = self.settings.limits, self.settings.delays.tip_on
        known = limits.friction < float('inf')
        on = -limits.tip_warn if known else float('inf')
        return self._warning('SLIDE', 'robot', (on, on - limits.tip_deadband), delay)

    def _trend(self) -> tuple[Signal, Signal]:
        """Return the signals of a robot that begins to tip; their value is minus the time (s)."""
        at, delay = (LEAST_VALUE, LEAST_VALUE), self.settings.delays.tip_on
        warn, error = (self._signal('TIP_TREND', 'robot', n, at, delay) for n in (WARN, ERROR))
        return warn, error

    def _fault(self, code: str, subject: str, level: int, on_delay: float | None = None) -> Signal:
        """Return the signal of a fault, whose value is 1 (there) or 0 (not there)."""
        delay = self.settings.delays.fault_on if on_delay is None else on_delay
        return self._signal(code, subject, level, (0.5, 0.5), delay)

    def _relaxed(self, name: str) -> Signal:
        """Return the signal of a relaxed limit: without delays, active while it is in force."""
        return Signal(Rule('LIMITS_RELAXED', name, WARN, 0.5, 0.5, 0, 0), self.log)

    def _jump_signal(self, joint: str) -> Signal:
        limit = LEAP * self.settings.robot.joint(joint).velocity
        delay = self.settings.delays.fault_on
        leap = self._signal('POSITION_LEAP', joint, ERROR, (limit, limit), delay)
        return _reaching(leap, LEAP_REACH + leap.rule.on_delay)

    def _attitude(self) -> AttitudeSignals:
        imu = self.settings.imu
        delay = imu.agreement_delay
        apart = (imu.agreement, imu.agreement / 2)
        # With attitude 'orientation' this is a warning only: margins do not need the accelerometer.
        level = WARN if imu.attitude == 'orientation' and not imu.specific_force else ERROR
        # inputs/imu_rest.py lets what is seen at rest last, and says how far back it reaches.
        return AttitudeSignals(
            self._fault('IMU_FRAME', 'imu', ERROR),
            self._fault('IMU_ORIENTATION', 'imu', WARN, delay),
            self._signal('IMU_GRAVITY', 'imu', level, (STRANGE, STRANGE), 0.0),
            self._signal('IMU_INCONSISTENT', 'imu', ERROR, apart, 0.0),
            self._signal(
                'IMU_NO_GRAVITY', 'imu', ERROR, (STRANGE, STRANGE), self.settings.delays.fault_on
            ),
            self._motion(level),
        )

    def _motion(self, force_level: int) -> MotionSignals:
        """Return the signals of the checks in motion; their windows are their delays.

        A check of a source that is not used is a warning only, as is one of the gyro alone.
        """
        turn_level = WARN if self.settings.imu.attitude == 'accelerometer' else ERROR

        def kind(code: str, level: int, reach: float, on: float = 0.5) -> Signal:
            return self._signal(code, 'imu', level, (on, on), 0.0, reach)

        return MotionSignals(
            frozen=kind('IMU_FROZEN', ERROR, FROZEN),
            contradiction=kind('IMU_CONTRADICTION', turn_level, 0.0, 1e-6),
            rates=kind('IMU_RATES', WARN, 0.0),
            rotation=kind('IMU_ROTATION', turn_level, TURNED),
            mounting=kind('IMU_MOUNTING', ERROR, 0.0),
            unit=kind('IMU_UNIT', force_level, UNIT),
            sources=kind('IMU_TWO_SOURCES', ERROR, SOURCES),
        )

    def _input(self, subject: str) -> 'InputSignals':
        return InputSignals(
            self._fault('INPUT_STALE', subject, STALE, 0.0),
            self._fault('INPUT_INVALID', subject, ERROR),
            self._fault('CLOCK', subject, WARN),
            self._warning('INPUT_SLOW', subject, (SLOW, SLOW), SLOW_FOR),
        )

    @property
    def mounting(self) -> tuple[Signal, Signal]:
        """The signals of an IMU's mounting that is not known, and of one that gravity denies."""
        return self.placing, self.attitude.motion.mounting

    @property
    def active(self) -> list[Alert]:
        """Alerts that are active now, the most severe first."""
        found = [signal.alert for signal in self.signals if signal.alert is not None]
        return sorted(found, key=lambda alert: -alert.rule.level)

    def lose(self, when: int) -> None:
        """Take that margins are unknown from `when` (ns) on: nothing is raised or held by them."""
        of_margins = [s for pair in (*self.torque, *self.tip) for s in pair]
        chassis = chain.from_iterable(self.chassis.all())
        for signal in (*of_margins, *chassis, self.support, self.slide):
            if not signal.quiet:
                signal.clear(when)

    def advance(self, now: int) -> None:
        """Let time pass to `now` (ns) for the signals that are not quiet: no other can change."""
        for signal in self.signals:
            if not signal.quiet:
                signal.advance(now)

    def _all(self) -> tuple[Signal, ...]:
        pairs = [s for pair in (*self.torque, *self.tip) for s in pair]
        inputs = [s for i in (self.joints, self.imu) for s in (i.stale, i.invalid, i.clock, i.slow)]
        of = self.attitude
        attitude = [
            of.frame, of.orientation, of.strange, of.disagreement, of.nothing, *of.motion.all()
        ]  # fmt: skip
        faults = [self.support, self.ground, self.payload, self.missing, self.repeated, *attitude]
        faults.append(self.placing)
        return (
            *pairs,
            *self.speed,
            *self.jump_signals,
            *inputs,
            *faults,
            *chain.from_iterable(self.chassis.all()),
            self.slide,
            *self.trend.signals,
            *self.prediction.signals(),
            *self.relaxed.values(),
        )


def _reaching(signal: Signal, reach: int) -> Signal:
    """Return the signal with a rule that reaches back by so much (ns)."""
    signal.judge_by(replace(signal.rule, reach=reach))
    return signal


@dataclass(frozen=True, slots=True)
class InputSignals:
    """The signals of one input: silence, unusable content, header clock off, too few messages."""

    stale: Signal
    invalid: Signal
    clock: Signal
    slow: Signal
