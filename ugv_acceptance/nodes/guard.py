"""The runner's ears and its brake: records all, hears the monitor, freezes motion at once.

What freezes: an alert that the step in hand does not expect, and a monitor that has gone silent.
It runs on the thread that takes messages, so it does not wait for anything the runner does.
"""

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import InertiaStamped, Twist
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu, JointState
from trajectory_msgs.msg import JointTrajectory

from ugv_acceptance import BadSample
from ugv_acceptance.bag.cdr import joint_state_decoder
from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.config import Config
from ugv_acceptance.nodes.inputs import qos_of
from ugv_acceptance.nodes.outputs import LATCHED
from ugv_acceptance.plan.plan import matches

MONITOR = 'acceptance_monitor'
# A monitor that said nothing for this long (s) is taken for dead.
SILENCE = 1.0
# Seconds between two looks of the watchdog, and of recorded data handed to the system.
LOOK = 0.1
_FLUSH = 5
Active = set[tuple[str, str, str]]


@dataclass(slots=True)
class Watched:
    """What is unwanted now: alert patterns; `stopped` says why motion was frozen."""

    unwanted: tuple[str, ...] = ()
    armed: bool = False
    stopped: str = ''
    dead: bool = False


@dataclass(slots=True)
class _Recording:
    bag: BagWriter | None = None
    lock: threading.Lock = field(default_factory=threading.Lock)


class Guard(Node):
    """A node that records the robot's topics and the alerts, and can freeze the robot.

    `position` holds the newest joint positions by the robot's joint names (rad), `active` the
    monitor's active alerts as (level, code, subject).
    """

    def __init__(self, config: Config, on_stop: Callable[[str], None], **node: Any) -> None:  # noqa: ANN401 - as Node does
        super().__init__('acceptance_runner', **node)
        self.config = config
        self.watched = Watched()
        self.position: dict[str, float] = {}
        self.position_at = 0.0
        self.active: Active = set()
        self.heard = self.heard_margin = 0.0
        self._on_stop = on_stop
        self._recording = _Recording()
        self._looks = 0
        self._topics: list[tuple[str, str, Qos]] = []
        self._subscribe()
        self.trajectory = self.create_publisher(
            JointTrajectory, 'arm_controller/joint_trajectory', 10
        )
        self.velocity = self.create_publisher(Twist, 'cmd_vel', 10)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(LOOK, self._look, clock=steady)

    def _subscribe(self) -> None:
        topics = self.config.topics
        sensor = Qos(reliability='best_effort')
        rows: list[tuple[Any, str, str, Any, Qos, Callable[[bytes], None]]] = [
            (JointState, topics.joint_states.name, 'sensor_msgs/msg/JointState',
             qos_of(topics.joint_states, 1000), sensor, self._on_joints()),
            (Imu, topics.imu.name, 'sensor_msgs/msg/Imu',
             qos_of(topics.imu, 1000), sensor, _nothing),
            (InertiaStamped, topics.payload.name, 'geometry_msgs/msg/InertiaStamped',
             qos_of(topics.payload, 10), Qos(), _nothing),
            (DiagnosticArray, f'{MONITOR}/alerts', 'diagnostic_msgs/msg/DiagnosticArray',
             QoSProfile(depth=100), Qos(), self._on_alerts),
            (DiagnosticStatus, f'{MONITOR}/verdict', 'diagnostic_msgs/msg/DiagnosticStatus',
             LATCHED, Qos(durability='transient_local'), self._on_verdict),
        ]  # fmt: skip
        for kind, name, type_, qos, offered, take in rows:
            full = self.resolve_topic_name(name)
            self._topics.append((full, type_, offered))
            self.create_subscription(kind, name, self._recorder(full, take), qos, raw=True)
        margins = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
        self.create_subscription(
            JointState, f'{MONITOR}/static_torque', self._on_margin, margins, raw=True
        )

    # Recording

    def record(self, folder: Path) -> None:
        """Record into a new folder from now on."""
        bag = BagWriter(folder)
        for name, type_, qos in self._topics:
            bag.add_topic(name, type_, qos)
        with self._recording.lock:
            self._recording.bag = bag

    def stop_recording(self) -> None:
        """Close the recording, if there is one."""
        with self._recording.lock:
            bag, self._recording.bag = self._recording.bag, None
        if bag is not None:
            bag.close()

    def _recorder(self, topic: str, take: Callable[[bytes], None]) -> Callable[[bytes], None]:
        recording = self._recording

        def received(data: bytes) -> None:
            now = time.time_ns()
            with recording.lock:
                if recording.bag is not None:
                    recording.bag.write(topic, now, data)
            take(data)

        return received

    # What is heard

    def _on_joints(self) -> Callable[[bytes], None]:
        decode = joint_state_decoder().one
        settings = self.config.settings
        known = {
            j.topic_name: (name, j)
            for j, name in zip(settings.joints, settings.robot.joint_names, strict=True)
        }

        def take(data: bytes) -> None:
            try:
                _, _, names, position, *_ = decode(data)
            except BadSample:
                return  # the monitor counts and tells it
            for told, value in zip(names, position, strict=False):
                if told in known and math.isfinite(value):
                    name, joint = known[told]
                    self.position[name] = joint.sign * value + joint.offset
            self.position_at = time.monotonic()

        return take

    def _on_verdict(self, _: bytes) -> None:
        self.heard = time.monotonic()

    def _on_margin(self, _: bytes) -> None:
        self.heard = self.heard_margin = time.monotonic()

    def _on_alerts(self, data: bytes) -> None:
        self.heard = time.monotonic()
        for status in deserialize_message(data, DiagnosticArray).status:
            values = {v.key: v.value for v in status.values}
            alert = values.get('level', ''), values.get('code', ''), values.get('subject', '')
            if values.get('state') == 'raised':
                self.active.add(alert)
                if self.watched.armed and self.unwanted(alert):
                    self.stop(f'{" ".join(alert)}: {status.message}')
            elif values.get('state') == 'cleared':
                self.active.discard(alert)

    # The brake

    def unwanted(self, alert: tuple[str, str, str]) -> bool:
        """Return whether an alert stops the step in hand: ERROR or STALE, and not expected."""
        level, code, subject = alert
        return level in {'ERROR', 'STALE'} and any(
            matches(pattern, level, code, subject) for pattern in self.watched.unwanted
        )

    def arm(self, unwanted: tuple[str, ...]) -> None:
        """Watch from now on; what freezes is named by alert patterns."""
        self.watched.unwanted, self.watched.stopped = unwanted, ''
        self.watched.armed = True

    def disarm(self) -> None:
        """Let everything pass, as while a person changes the set-up."""
        self.watched.armed = False

    def stop(self, reason: str) -> None:
        """Freeze all motion now and say why; only the first reason of a step counts."""
        self.freeze()
        if not self.watched.stopped:
            self.watched.stopped = reason
            self._on_stop(reason)

    def freeze(self) -> None:
        """Tell arm and tracks to hold still: an empty trajectory, no speed."""
        self.trajectory.publish(JointTrajectory())
        self.velocity.publish(Twist())

    def _look(self) -> None:
        self._looks += 1
        if self._looks % _FLUSH == 0:
            with self._recording.lock:
                if self._recording.bag is not None:
                    self._recording.bag.flush()
        silent = time.monotonic() - self.heard
        self.watched.dead = silent > SILENCE
        if self.watched.armed and self.watched.dead and not self.watched.stopped:
            self.stop(f'the monitor has said nothing for {silent:.1f} s')


def _nothing(_: bytes) -> None:
    """Take a message that is only recorded."""
