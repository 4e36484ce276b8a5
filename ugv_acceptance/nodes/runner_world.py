"""The runner's `World` over ROS: records topics, sends commands, and freezes motion at alerts.

Motion freezes at an alert that the current step does not expect, and when the monitor is silent.
That is done on the thread that takes messages, so it does not wait for the runner.
"""

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Inertia, InertiaStamped, Twist, Vector3
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rclpy.task import Future
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from ugv_acceptance import BadSample
from ugv_acceptance.bag.cdr import joint_state_decoder
from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.config import Config
from ugv_acceptance.nodes.executor import PATIENCE
from ugv_acceptance.nodes.monitor.own_description import MOST
from ugv_acceptance.nodes.monitor.own_description import QOS as OWN
from ugv_acceptance.nodes.monitor.publishers import LATCHED
from ugv_acceptance.nodes.monitor.subscriptions import qos_of
from ugv_acceptance.plan.motions import hitch_of
from ugv_acceptance.run.actuation import OPERATOR, SIM
from ugv_acceptance.run.own_description import tell_robot
from ugv_acceptance.run.world import Brake, Commands, Positions

SIMULATOR, MONITOR = 'packbot_simulator', 'acceptance_monitor'
# Seconds in which a simulator answers, on a busy machine too.
ANSWER_WITHIN = 30.0


class RosCommands:
    """The runner's `Commands` over ROS, with joint names, signs and offsets of the driver."""

    def __init__(self, node: Node, config: Config) -> None:
        self._node, self._config = node, config
        publish = node.create_publisher
        self._trajectory = publish(JointTrajectory, 'arm_controller/joint_trajectory', 10)
        self._velocity = publish(Twist, 'cmd_vel', 10)
        self._payload = publish(InertiaStamped, config.topics.payload.name, QoSProfile(depth=10))
        self._operator = publish(DiagnosticStatus, f'{MONITOR}/operator', 10)
        self._ground = publish(Vector3, f'{SIMULATOR}/ground', 10)
        self._pull = publish(Vector3, f'{SIMULATOR}/pull', 10)
        self._load = publish(Inertia, f'{SIMULATOR}/load', 10)
        self._reset: Any = node.create_client(Trigger, f'{SIMULATOR}/reset')
        self._told = config.settings.ground.kind or ''
        self._set: Any = node.create_client(SetParameters, f'{MONITOR}/set_parameters')

    def unheard(self, mode: str) -> str:
        """Return a topic this mode needs that has no subscriber yet; empty: none.

        A command sent before a subscriber is matched is lost without notice.
        """
        needed = [self._payload, self._operator]
        if mode != OPERATOR and self._config.settings.robot.joint_names:
            needed.append(self._trajectory)
        if mode == SIM:
            needed += [self._velocity, self._ground, self._pull, self._load]
        alone = [p.topic_name for p in needed if not p.get_subscription_count()]
        if mode == SIM and not self._reset.service_is_ready():
            alone.append(self._reset.srv_name)
        return alone[0] if alone else ''

    def move(self, posture: Mapping[str, float], seconds: float) -> None:
        """Start a motion to `posture` (rad) that takes `seconds`; of no joint, none."""
        if not posture:
            return
        settings = self._config.settings
        joints = dict(zip(settings.robot.joint_names, settings.joints, strict=True))
        message = JointTrajectory(joint_names=[joints[n].topic_name for n in posture])
        positions = [(a - joints[n].offset) / joints[n].sign for n, a in posture.items()]
        point = JointTrajectoryPoint(positions=positions)
        point.time_from_start.sec = int(seconds)
        point.time_from_start.nanosec = int((seconds % 1.0) * 1e9)
        message.points = [point]
        self._trajectory.publish(message)

    def freeze(self) -> None:
        """Stop arm and tracks: an empty trajectory, speed zero."""
        self._trajectory.publish(JointTrajectory())
        self._velocity.publish(Twist())

    def drive(self, forward: float, yaw: float) -> None:
        """Drive at `forward` (m/s) and `yaw` (rad/s)."""
        message = Twist()
        message.linear.x, message.angular.z = forward, yaw
        self._velocity.publish(message)

    def declare(self, mass: float) -> None:
        """Declare to the monitor what is carried (kg)."""
        message = InertiaStamped(inertia=self._inertia(mass))
        message.header.frame_id = self._config.topics.payload.frame_id or ''
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._payload.publish(message)

    def tell_ground(self, kind: str | None) -> None:
        """Tell the monitor the kind of ground, and wait until it took it; None: as configured."""
        told = kind or self._config.settings.ground.kind or ''
        if told == self._told:
            return
        text = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=told)
        request = SetParameters.Request(parameters=[Parameter(name='ground.kind', value=text)])
        if self._set.wait_for_service(ANSWER_WITHIN) and self._done(self._set.call_async(request)):
            self._told = told

    def may_touch(self, *, allowed: bool) -> None:
        """Say to the monitor whether the arm may touch the ground from now on."""
        value = KeyValue(key='allowed', value='true' if allowed else 'false')
        told = DiagnosticStatus(name='hand_may_touch', hardware_id='run', values=[value])
        self._operator.publish(told)

    def tilt(self, tilt: float, heading: float, rate: float) -> None:
        """Tilt the ground: rad, down towards `heading` (rad), at a peak `rate` (rad/s)."""
        self._ground.publish(Vector3(x=tilt, y=heading, z=rate))

    def load(self, mass: float) -> None:
        """Put a load (kg) into the simulated gripper."""
        self._load.publish(self._inertia(mass))

    def pull(self, force: float) -> None:
        """Pull the simulated robot backwards at its hitch (N)."""
        self._pull.publish(Vector3(x=force, z=hitch_of(self._config.settings.robot)))

    def stand_up(self) -> None:
        """Reset the simulated robot to its start, and wait until that is done."""
        if self._reset.wait_for_service(ANSWER_WITHIN):
            self._done(self._reset.call_async(Trigger.Request()))

    def _done(self, future: Future) -> bool:
        """Wait for an answer; return whether it came."""
        end = time.monotonic() + ANSWER_WITHIN
        while not future.done() and time.monotonic() < end:
            time.sleep(0.01)
        return bool(future.done())

    def _inertia(self, mass: float) -> Inertia:
        message = Inertia(m=float(mass))
        message.com.x, message.com.y, message.com.z = self._config.settings.robot.payload.cog
        return message


# Seconds between checks of the watchdog; checks without a message after which the monitor is dead,
# and after which recorded data is flushed. Checks are counted, not seconds: while this process
# itself is stopped, it cannot receive, and that is not the monitor's fault.
LOOK, SILENT, FLUSH = 0.1, 15, 5
# A longer pause (s) between joint states does not count in `fed`.
GAP = 0.1


@dataclass(slots=True)
class _Recording:
    bag: BagWriter | None = None
    lock: threading.Lock = field(default_factory=threading.Lock)


class Guard(Node):
    """The runner's world as a node: it records, follows the alerts, and can freeze the robot.

    `on_stop(reason)` is called when motion is frozen, `progress(now)` while the runner waits.
    `mode` says who moves the robot, and so which subscribers a run needs.
    """

    def __init__(
        self,
        config: Config,
        on_stop: Callable[[str], None],
        progress: Callable[[float], None] = lambda _: None,
        mode: str = OPERATOR,
        **node: Any,  # noqa: ANN401 - as Node does
    ) -> None:
        super().__init__('acceptance_runner', **node)
        self.config, self._progress, self._mode = config, progress, mode
        self.positions = Positions(config)
        self._sent = RosCommands(self, config)
        self.commands: Commands = self._sent
        self.brake = Brake(self.commands.freeze, on_stop)
        self._recording = _Recording()
        self._looks = self._silent = 0
        self._fed, self._fed_at = 0.0, -1.0
        self._heard = False
        self._topics: list[tuple[str, str, Qos]] = []
        self._own = self.resolve_topic_name(config.topics.robot_description)
        self._described: dict[bytes, None] = {}
        self._subscribe()
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(LOOK, self._look, clock=steady)

    def _subscribe(self) -> None:
        topics = self.config.topics
        sensor = Qos(reliability='best_effort')
        joints, imu = topics.joint_states, topics.imu
        rows: list[tuple[Any, str, str, Any, Qos, Callable[[bytes], None]]] = [
            *([(JointState, joints.name, 'sensor_msgs/msg/JointState',
                qos_of(joints, 1000), sensor, self._on_joints())] if joints.used else []),
            *([(Imu, imu.name, 'sensor_msgs/msg/Imu', qos_of(imu, 1000), sensor,
                _nothing if joints.used else self._on_imu)] if imu.used else []),
            (InertiaStamped, topics.payload.name, 'geometry_msgs/msg/InertiaStamped',
             qos_of(topics.payload, 10), Qos(), _nothing),
            (DiagnosticArray, f'{MONITOR}/alerts', 'diagnostic_msgs/msg/DiagnosticArray',
             QoSProfile(depth=100), Qos(), self._on_alerts),
            (DiagnosticStatus, f'{MONITOR}/verdict', 'diagnostic_msgs/msg/DiagnosticStatus',
             LATCHED, Qos(durability='transient_local'), self._on_word),
        ]  # fmt: skip
        for kind, name, type_, qos, offered, take in rows:
            full = self.resolve_topic_name(name)
            self._topics.append((full, type_, offered))
            self.create_subscription(kind, name, self._recorder(full, take), qos, raw=True)
        take = self._recorder(self._own, self._on_description)
        self.create_subscription(String, self._own, take, OWN, raw=True)
        margins = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
        name = f'{MONITOR}/static_torque'
        self.create_subscription(JointState, name, self._on_word, margins, raw=True)

    # Recording

    def record(self, folder: Path) -> None:
        """Begin to record all messages into a new folder."""
        bag = BagWriter(folder, simulated=self._mode == SIM)
        for name, type_, qos in self._topics:
            bag.add_topic(name, type_, qos)
        tell_robot(bag, self.config, self.stamp(), self._own, list(self._described))
        bag.flush()  # from now on it can be read, whatever happens
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

    # Messages received

    def _on_joints(self) -> Callable[[bytes], None]:
        decode = joint_state_decoder().one

        def take(data: bytes) -> None:
            try:
                _, _, names, position, *_ = decode(data)
            except BadSample:
                return  # the monitor counts and reports it
            self.positions.take(names, position)
            self._feed()

        return take

    def _on_description(self, data: bytes) -> None:
        if len(self._described) < MOST:
            self._described[data] = None

    def _on_imu(self, _: bytes) -> None:
        """Count an IMU message of a robot that tells no joints."""
        self._feed()

    def _feed(self) -> None:
        now = time.monotonic()
        if self._fed_at >= 0.0:
            self._fed += min(now - self._fed_at, GAP)
        self._fed_at = now

    def _on_word(self, _: bytes) -> None:
        self._silent, self._heard = 0, True

    def _on_alerts(self, data: bytes) -> None:
        self._silent = 0
        for status in deserialize_message(data, DiagnosticArray).status:
            values = {v.key: v.value for v in status.values}
            alert = values.get('level', ''), values.get('code', ''), values.get('subject', '')
            if values.get('state') == 'raised':
                self.brake.raised(alert, values.get('happened', status.message))
            elif values.get('state') == 'cleared':
                self.brake.active.discard(alert)

    def _look(self) -> None:
        self._looks += 1
        self._silent += 1
        if self._looks % FLUSH == 0:
            with self._recording.lock:
                if self._recording.bag is not None:
                    self._recording.bag.flush()
        if self.brake.armed and self.dead() and not self.brake.stopped:
            silent = self._silent * LOOK
            # It may be heard again a moment later: what it did not watch is lost all the same.
            self.brake.stop(f'the monitor has published nothing for {silent:.1f} s', blind=True)

    # The world of a runner

    def missing(self) -> str:
        """Return what has not been heard, or does not listen, yet; empty when all is there."""
        if self.config.settings.hears_joints and not self.positions.now:
            return 'joint states of the robot'
        if self._fed_at < 0.0:
            return 'the IMU of the robot'
        if not self._heard:
            return 'the monitor'
        unheard = self._sent.unheard(self._mode)
        return f'a listener on {unheard}' if unheard else ''

    def dead(self) -> bool:
        """Return whether the monitor has fallen silent."""
        return self._silent >= SILENT

    def now(self) -> float:
        """Return the time (s) of the steady clock."""
        return time.monotonic()

    def fed(self) -> float:
        """Return for how long (s) joint states kept coming; stands still while they do not.

        Of a robot without joint states: its IMU.
        """
        return self._fed

    def stamp(self) -> int:
        """Return the time (ns) that a message recorded now carries."""
        return time.time_ns()

    def wait(self, seconds: float) -> None:
        """Wait `seconds` of real time."""
        time.sleep(seconds)
        self._progress(time.monotonic())


def _nothing(_: bytes) -> None:
    """Ignore a message: it is only recorded."""


@contextmanager
def spinning(guard: Guard) -> Iterator[None]:
    """Take messages on a separate thread, so that recording and brake never wait."""
    executor, over = EventsExecutor(), threading.Event()
    executor.add_node(guard)
    never: Future = Future()

    def spin() -> None:
        while not over.is_set():
            executor.spin_until_future_complete(never, timeout_sec=PATIENCE)

    thread = threading.Thread(target=spin, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        executor.remove_node(guard)
        executor.shutdown()
