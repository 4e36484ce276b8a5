"""One monitoring session: serialised messages in, margins and alerts out, no ROS.

The three `take_*` are the hot path. Bytes are decoded by the decoder that reads bags, so no message
object is made; whatever they hold, the worst that can happen is that they count as malformed.
"""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any

from ugv_acceptance import BadSample
from ugv_acceptance.bag.cdr import imu_decoder, joint_state_decoder, payload_decoder
from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.criteria.uncertainty import Source
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.permitted_limits import Breach, limits_hash, relaxed
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.monitoring.advisory import Advisory
from ugv_acceptance.monitoring.alarm_tracker import AlarmTracker
from ugv_acceptance.monitoring.background import one_thread
from ugv_acceptance.monitoring.certainty import CODE, Certainty
from ugv_acceptance.monitoring.faults import Faults
from ugv_acceptance.monitoring.receipt_clock import Clock, ReceiptClock, StampShift
from ugv_acceptance.monitoring.trends import Trends

# Fields of a sample that the evaluator takes after time and stamp.
JOINT_FIELDS = attrgetter('names', 'position', 'velocity', 'effort')
IMU_FIELDS = attrgetter(
    'orientation',
    'orientation_covariance_0',
    'angular_velocity',
    'linear_acceleration',
    'frame_id',
    'angular_velocity_covariance_0',
)
INPUTS = ('joint_states', 'imu', 'payload')
# Measurements, one a second, over which a rate is averaged, so that bursts are evened out.
_MEASUREMENTS = 4


@dataclass(slots=True)
class InputCount:
    """Counts of one input's messages: `taken`, `malformed`, `lost`; `last` is the newest's (ns).

    `reason` says why the last malformed message could not be decoded.
    """

    taken: int = 0
    malformed: int = 0
    lost: int = 0
    last: int = 0
    reason: str = ''
    _before: int = 0
    _past: deque[tuple[int, int]] = field(default_factory=lambda: deque(maxlen=_MEASUREMENTS))

    def rate(self, now: int, known: float | None) -> float | None:
        """Return the rate (Hz) at `now` (ns), given the rate `known` before; None if not known.

        To be called once a second. Measured between messages, so that one message a second is 1 Hz
        even if a second has none or two. 0 Hz after two periods of silence.
        """
        came, self._before = self.taken - self._before, self.taken
        if came:
            self._past.append((self.taken, self.last))
            (first, since), (taken, until) = self._past[0], self._past[-1]
            return (taken - first) * 1e9 / (until - since) if until > since else (known or None)
        if known and (now - self.last) * known > 2e9:
            self._past.clear()
            return 0.0
        return known


@dataclass(slots=True)
class Session:
    """One session of monitoring a running robot: decodes, evaluates, counts and tracks alarms.

    `on_margins(stamp, margins)` is called for every message that gave margins without doubt, with
    its own header stamp (ns); `on_change()` when alerts or level changed; `on_problem(text)` for
    the log. `clock` dates what comes in, `stamps` converts header stamps to its time; `sources` are
    of uncertainty: a margin that is kept by less than its bound is told. `pool` computes what takes
    longer than a message: a thread, unless simulated time has to wait for it. `relaxed` are the
    limits in force that are wider than permitted. `take_joint_state`, `take_imu` and `take_payload`
    take a serialised message and never raise.
    """

    settings: Settings
    on_margins: Callable[[int, Margins], None]
    on_change: Callable[[], None]
    on_problem: Callable[[str], None]
    clock: Clock = field(default_factory=ReceiptClock)
    stamps: StampShift = field(default_factory=StampShift)
    sources: tuple[Source, ...] = ()
    pool: Executor = field(default_factory=one_thread)
    evaluator: LiveEvaluator = field(init=False)
    faults: Faults = field(init=False)
    alarm_tracker: AlarmTracker = field(init=False)
    counts: dict[str, InputCount] = field(init=False)
    _counts: dict[str, InputCount] = field(init=False)
    take_joint_state: Callable[[bytes], None] = field(init=False)
    take_imu: Callable[[bytes], None] = field(init=False)
    take_payload: Callable[[bytes], None] = field(init=False)
    trends: Trends = field(init=False)
    advisory: Advisory = field(init=False)
    certainty: Certainty = field(init=False)
    rates: dict[str, float] = field(default_factory=dict)
    limits_hash: str = field(init=False)
    relaxed: tuple[Breach, ...] = field(init=False)
    _known: bool = False

    def __post_init__(self) -> None:
        self.evaluator = LiveEvaluator(self.settings)
        self._tell_limits()
        log = self.evaluator.watch.log
        self.faults, self.alarm_tracker = Faults(log), AlarmTracker(log)
        self.trends = Trends(self.settings)
        self.advisory = Advisory(self.evaluator, self.trends, self.on_problem, pool=self.pool)
        self.certainty = Certainty(self.settings, self.sources, self.pool)
        heard = {'joint_states': self.settings.hears_joints, 'imu': self.settings.hears_imu}
        self._counts = {name: InputCount() for name in INPUTS}
        self.counts = {n: count for n, count in self._counts.items() if heard.get(n, True)}
        self.evaluator.start(self.clock.now())
        decode, evaluator = joint_state_decoder().one, self.evaluator
        take = self._evaluating('joint_states', decode, JOINT_FIELDS, evaluator.joint_state)
        self.take_joint_state = self._guard('joint_states', take)
        take = self._evaluating('imu', imu_decoder().one, IMU_FIELDS, evaluator.imu)
        self.take_imu = self._guard('imu', take)
        self.take_payload = self._guard('payload', self._payload())

    @property
    def active(self) -> list[Alert]:
        """Alerts that are active now, of the robot, its inputs and the monitor itself."""
        return [*self.evaluator.watch.active, *self.faults.active]

    @property
    def level(self) -> int:
        """The most severe level now, as a number of state_machine.LEVELS."""
        return max([self.evaluator.level, *(a.rule.level for a in self.faults.active)])

    def tick(self) -> None:
        """Let time pass: judge silence and delays, and clear faults that are over."""
        now = self.clock.now()
        self.evaluator.tick(now)
        if self.sources and now >= self.certainty.due:
            self._doubt(now)
        self.faults.advance(now)
        self._look()

    def _doubt(self, now: int) -> None:
        """Report the margins that are kept by less than their uncertainty."""
        before = self.certainty.told
        self.certainty.look(now, self.evaluator.margins, self.evaluator.payload)
        for subject in before.keys() - self.certainty.told.keys():
            self.faults.clear(now, CODE, subject)
        for subject, doubt in self.certainty.told.items():
            self.faults.set(now, CODE, subject, 1.0, doubt.sentence)

    def feel(self) -> None:
        """Check payload and sign of efforts by the measured ones; to be called once a second."""
        self.advisory.feel()
        now, found = self.clock.now(), self.advisory.estimate
        if found is None:
            self.faults.clear(now, 'PAYLOAD_DIFFERS', 'payload')
        else:
            more = abs(found.mass - found.declared)
            self.faults.set(now, 'PAYLOAD_DIFFERS', 'payload', more, found.sentence)
        opposed = {joint.joint for joint in self.advisory.opposed}
        for name in self.settings.robot.joint_names:
            if name in opposed:
                self.faults.set(now, 'EFFORT_SIGN', name, 1.0)
            else:
                self.faults.clear(now, 'EFFORT_SIGN', name)

    def measure_rates(self) -> None:
        """Measure the `rates` (Hz) of the inputs; to be called once a second."""
        now = self.clock.now()
        rates = {name: c.rate(now, self.rates.get(name)) for name, c in self.counts.items()}
        self.rates = {name: rate for name, rate in rates.items() if rate is not None}

    def adopt(self, settings: Settings) -> None:
        """Judge by other limits and delays from now on; learnt periods and active alerts stay."""
        self.settings = self.trends.settings = self.certainty.settings = settings
        self._tell_limits()
        self.evaluator.adopt(settings)
        self.tick()

    def _tell_limits(self) -> None:
        self.limits_hash = limits_hash(self.settings)
        self.relaxed = tuple(relaxed(self.settings))

    def _look(self) -> None:
        known = self.evaluator.margins is not None
        if known is not self._known or self.alarm_tracker.changed():
            self._known = known
            self.on_change()

    def _evaluating(
        self,
        name: str,
        decode: Callable[[bytes], Any],
        fields: Callable[[Any], tuple[Any, ...]],
        evaluate: Callable[..., Margins | None],
    ) -> Callable[[bytes], None]:
        """Return a function that decodes a message of input `name` and evaluates its `fields`."""
        count, alarm_tracker, stamps = self._counts[name], self.alarm_tracker, self.stamps
        receipt, see = self.clock.now, self.trends.see

        def take(data: bytes) -> None:
            now = receipt()
            sample = decode(data)
            stamp = sample.stamp
            count.taken += 1
            count.last = now
            local = stamps.stamp(now, stamp) if stamps.simulated else stamp
            margins = evaluate(now, local, *fields(sample))
            if margins is not None:
                see(margins)
                if not self.evaluator.joints.doubted:
                    self.on_margins(stamp, margins)
            if (margins is not None) is not self._known or alarm_tracker.changed():
                self._look()

        return take

    def _payload(self) -> Callable[[bytes], None]:
        decode, count = payload_decoder().one, self.counts['payload']

        def take(data: bytes) -> None:
            now = self.clock.now()
            _, frame, mass, com = decode(data)
            count.taken += 1
            count.last = now
            self.evaluator.carry(now, mass, com, frame)
            self._look()

        return take

    def _guard(self, name: str, take: Callable[[bytes], None]) -> Callable[[bytes], None]:
        """Wrap `take` so that no message can raise: errors are counted and reported."""

        def guarded(data: bytes) -> None:
            try:
                take(data)
            except BadSample as error:
                self._malformed(name, error)
            except Exception as error:  # noqa: BLE001 - a fault in our code must not end the watch
                self.fail(name, error)

        return guarded

    def fail(self, where: str, error: Exception) -> None:
        """Report that our own code failed: margins become unknown, so the level is never OK."""
        self.evaluator.margins = None
        self.faults.set(self.clock.now(), 'MONITOR_FAULT', where, 1.0, repr(error))
        self.on_problem(f'{where}: fault of the monitor: {error!r}')
        self._look()

    def _malformed(self, name: str, error: BadSample) -> None:
        count = self._counts[name]
        count.malformed += 1
        count.reason = str(error)
        now = self.clock.now()
        self.faults.set(now, 'INPUT_MALFORMED', name, float(count.malformed), count.reason)
        self.on_problem(f'{name}: malformed message ignored: {error}')
        self._look()
