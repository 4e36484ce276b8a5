"""Evaluates a running robot from Python, without ROS: numbers in, margins and alerts out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ugv_acceptance import BadSample
from ugv_acceptance.bag.cdr import ImuSample, JointStateSample
from ugv_acceptance.bag.recording import Sample
from ugv_acceptance.config import Config, load
from ugv_acceptance.evaluation.alerts.state_machine import LEVELS
from ugv_acceptance.evaluation.live import LiveEvaluator as Evaluator
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.evaluation.summary import AlertRecord, alert_record
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.monitoring.receipt_clock import ReceiptClock


@dataclass(frozen=True, slots=True)
class LiveMargins:
    """The margins of one moment, `time_ns` (since the epoch), by joint and by side.

    `static_torque` and `torque_margin` in N m (N if prismatic), `tip_angle` the tilt left in rad
    to each of front, left, rear, right: negative past tipping, infinite where it cannot tip.
    """

    time_ns: int
    static_torque: Mapping[str, float]
    torque_margin: Mapping[str, float]
    tip_angle: Mapping[str, float]


class LiveEvaluator:
    """Takes the messages of a running robot one by one; holds the newest margins and alerts.

    Times are ns since the epoch; without them this machine's steady clock is used. Call `tick`
    regularly when no messages come: only then is a silent input noticed.

    Parameters
    ----------
    config
        The robot: a configuration, its YAML file, or the name of one that ships (packbot).

    Raises
    ------
    BadConfig
        If the configuration cannot be used.

    Examples
    --------
    >>> import ugv_acceptance as ugv
    >>> live = ugv.LiveEvaluator('packbot')
    >>> live.level
    'STALE'
    >>> names = live.joint_names
    >>> live.joint_state(names, [0.0] * len(names), time_ns=1_000_000_000)
    >>> margins = live.imu((0.0, 0.0, 9.81), time_ns=1_000_000_000)
    >>> sorted(margins.tip_angle)
    ['front', 'left', 'rear', 'right']
    """

    def __init__(self, config: Config | Path | str | None = None) -> None:
        self.config = config if isinstance(config, Config) else load(config)
        self._evaluator = Evaluator(self.config.settings)
        self._clock = ReceiptClock()
        self._began: int | None = None
        self._due = 0

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The names that the robot's joints have in messages."""
        return tuple(joint.topic_name for joint in self.config.settings.joints)

    @property
    def margins(self) -> LiveMargins | None:
        """The newest margins; None while they are unknown: an input is missing or silent."""
        return self._told(self._evaluator.margins)

    @property
    def level(self) -> str:
        """The most severe level now: OK, WARN, ERROR, or STALE if margins are unknown."""
        return LEVELS[self._evaluator.level]

    @property
    def alerts(self) -> tuple[AlertRecord, ...]:
        """Every alert since the start; active ones have no `end_s`."""
        settings, began = self.config.settings, self._began or 0
        return tuple(alert_record(a, settings, began) for a in self._evaluator.watch.log)

    def joint_state(
        self,
        names: Sequence[str],
        position: Sequence[float],
        velocity: Sequence[float] = (),
        effort: Sequence[float] = (),
        *,
        time_ns: int | None = None,
        stamp_ns: int | None = None,
    ) -> LiveMargins | None:
        """Take a sensor_msgs/JointState (rad, rad/s, N m; m, m/s, N); return the newest margins.

        `stamp_ns` is that of the header, by default the time of receipt. Raises BadSample if the
        lengths do not match; the message is then ignored.
        """
        for what, values in (('position', position), ('velocity', velocity), ('effort', effort)):
            if len(values) not in ((len(names),) if what == 'position' else (0, len(names))):
                raise BadSample(f'{what}: expected {len(names)} numbers, got {len(values)}')
        now = self._now(time_ns)
        stamp = now if stamp_ns is None else stamp_ns
        taken = self._evaluator.joint_state(now, stamp, tuple(names), position, velocity, effort)
        return self._told(taken)

    def imu(
        self,
        linear_acceleration: Sequence[float],
        *,
        orientation: Sequence[float] | None = None,
        angular_velocity: Sequence[float] = (0.0, 0.0, 0.0),
        frame_id: str = '',
        time_ns: int | None = None,
        stamp_ns: int | None = None,
    ) -> LiveMargins | None:
        """Take a sensor_msgs/Imu: m/s2 (+g up at rest), quaternion x y z w or None, rad/s.

        Returns the newest margins. Raises BadSample if the lengths are wrong.
        """
        quaternion = (0.0, 0.0, 0.0, 0.0) if orientation is None else orientation
        given = (linear_acceleration, 3), (quaternion, 4), (angular_velocity, 3)
        for values, count in given:
            if len(values) != count:
                raise BadSample(f'imu: expected {count} numbers, got {len(values)}')
        now = self._now(time_ns)
        stamp = now if stamp_ns is None else stamp_ns
        unknown = -1.0 if orientation is None else 0.0
        taken = self._evaluator.imu(
            now, stamp, quaternion, unknown, angular_velocity, linear_acceleration, frame_id
        )
        return self._told(taken)

    def payload(
        self,
        mass: float,
        center_of_mass: Sequence[float] = (0.0, 0.0, 0.0),
        *,
        frame_id: str = '',
        time_ns: int | None = None,
    ) -> None:
        """Declare the payload (kg; m in the payload link), in force from the next joint state on.

        One that cannot be used raises PAYLOAD_INVALID: no margin is known until a good one comes.
        """
        self._evaluator.carry(self._now(time_ns), mass, center_of_mass, frame_id)

    def take(self, sample: Sample) -> LiveMargins | None:
        """Take a message of a recording at its log time; return the newest margins."""
        now, message = sample.time_ns, sample.message
        self._now(now)
        if isinstance(message, JointStateSample):
            rest = message.names, message.position, message.velocity, message.effort
            self._evaluator.joint_state(now, message.stamp, *rest)
        elif isinstance(message, ImuSample):
            self._evaluator.imu(
                now,
                message.stamp,
                message.orientation,
                message.orientation_covariance_0,
                message.angular_velocity,
                message.linear_acceleration,
                message.frame_id,
                message.angular_velocity_covariance_0,
            )
        elif not isinstance(message, BadSample):
            self._evaluator.carry(now, message.mass, message.com, message.frame_id)
        return self.margins

    def tick(self, time_ns: int | None = None) -> None:
        """Let time pass to `time_ns` without a message, so that silence and delays are judged."""
        self._due = 0
        self._now(time_ns)

    def _now(self, time_ns: int | None) -> int:
        now = self._clock.now() if time_ns is None else time_ns
        if self._began is None:
            self._began = now
            self._evaluator.start(now)
        if now >= self._due:
            self._evaluator.tick(now)
            self._due = now + round(self.config.settings.delays.tick * 1e9)
        return now

    def _told(self, margins: Margins | None) -> LiveMargins | None:
        if margins is None:
            return None
        settings = self.config.settings
        names, limits = settings.robot.joint_names, settings.limits.torque
        torque, angles = margins.torque, map(float, margins.angle)
        left = [limit - abs(tau) for limit, tau in zip(limits, torque, strict=True)]
        return LiveMargins(
            margins.time,
            dict(zip(names, map(float, torque), strict=True)),
            dict(zip(names, map(float, left), strict=True)),
            dict(zip(SIDES, angles, strict=True)),
        )
