"""A monitor and a robot's driver in one test process, joined by real DDS, spun by hand."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import ok, try_shutdown
from sensor_msgs.msg import Imu, JointState

from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.monitoring.diagnostics import Status
from ugv_acceptance.nodes.executor import end, take_one
from ugv_acceptance.nodes.monitor.node import Monitor
from ugv_acceptance.nodes.monitor.publishers import LATCHED

NAMES = ('turret_joint', 'shoulder_joint', 'elbow_joint', 'flipper_joint')
FOLDED = (0.0, 2.0, -2.5, 2.0)
# Seconds in which whatever is waited for comes, on a busy machine too. ROS forgets a process that
# was killed, with its publishers, after twenty.
PATIENCE = 60.0
OK, WARN, ERROR, STALE = range(4)


def joints(q: tuple[float, ...] = FOLDED, stamp: int | None = None) -> bytes:
    """Return a serialised JointState."""
    return joint_state_cdr(time.time_ns() if stamp is None else stamp, '', NAMES, q)


def imu(roll: float = 0.0, stamp: int | None = None) -> bytes:
    """Return a serialised Imu of a robot at rest that leans to its right by `roll` (rad)."""
    when = time.time_ns() if stamp is None else stamp
    orientation = (math.sin(roll / 2), 0.0, 0.0, math.cos(roll / 2))
    force = (0.0, 9.81 * math.sin(roll), 9.81 * math.cos(roll))
    return imu_cdr(when, 'imu_link', orientation, (0.0, 0.0, 0.0), force)


def parameter(name: str, value: Any) -> Parameter:
    """Return a parameter; `__` in a name stands for a dot, so that it can be a keyword."""
    make: Any = Parameter
    made: Parameter = make(name.replace('__', '.'), value=value)
    return made


class Driver(Node):
    """A robot's driver: publishes both inputs, hears what the monitor says."""

    def __init__(self, name: str = 'driver', namespace: str = '') -> None:
        super().__init__(name, namespace=namespace)
        self.joints = self.create_publisher(JointState, 'joint_states', 100)
        self.imu = self.create_publisher(Imu, 'imu/data', 100)
        self.verdicts: list[DiagnosticStatus] = []
        self.diagnostics: dict[str, DiagnosticStatus] = {}
        self.alerts: list[DiagnosticStatus] = []
        at = 'acceptance_monitor'
        self.hand = self.create_publisher(DiagnosticStatus, f'{at}/operator', 10)
        self.create_subscription(DiagnosticStatus, f'{at}/verdict', self.verdicts.append, LATCHED)
        self.create_subscription(DiagnosticArray, f'{at}/alerts', self._take_alerts, 50)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._take_diagnostics, 50)

    def _take_alerts(self, message: DiagnosticArray) -> None:
        self.alerts += message.status

    def _take_diagnostics(self, message: DiagnosticArray) -> None:
        self.diagnostics |= {status.name: status for status in message.status}

    def send(self, q: tuple[float, ...] = FOLDED, roll: float = 0.0) -> None:
        """Publish one message of each input."""
        self.joints.publish(joints(q))
        self.imu.publish(imu(roll))

    def operate(self, do: str, who: str, note: str = '', **values: str) -> None:
        """Do as an operator does on a console."""
        pairs = [KeyValue(key=key, value=value) for key, value in values.items()]
        message = DiagnosticStatus(name=do, hardware_id=who, message=note, values=pairs)
        self.hand.publish(message)

    def connected(self) -> bool:
        """Return whether the monitor hears both inputs."""
        return bool(self.joints.get_subscription_count() and self.imu.get_subscription_count())


@dataclass
class Live:
    """Nodes on one executor. `heard` is what the monitor's listener was told."""

    executor: Any
    nodes: list[Node] = field(default_factory=list)
    heard: list[tuple[str, Status]] = field(default_factory=list)

    def add(self, node: Any) -> Any:
        """Take a node in."""
        self.executor.add_node(node)
        self.nodes.append(node)
        return node

    def monitor(
        self, *, up: bool = True, arguments: tuple[str, ...] = (), **values: Any
    ) -> Monitor:
        """Return a monitor, brought up unless `up` is false, with parameter `values`."""
        node: Monitor = self.add(
            Monitor(
                lambda kind, status: self.heard.append((kind, status)),
                parameter_overrides=[parameter(k, v) for k, v in values.items()],
                cli_args=['--ros-args', *arguments] if arguments else None,
            )
        )
        if up:
            node.bring_up()
        return node

    def driver(self, name: str = 'driver', namespace: str = '') -> Driver:
        """Return a driver."""
        node: Driver = self.add(Driver(name, namespace))
        return node

    def until(
        self, condition: Callable[[], Any], meanwhile: Callable[[], Any] = lambda: None
    ) -> None:
        """Spin until `condition` holds; `meanwhile` is called a hundred times a second."""
        end = time.monotonic() + PATIENCE
        following = 0.0
        while not condition():
            now = time.monotonic()
            assert now < end, 'expected this to come true, it did not'
            if now >= following:
                meanwhile()
                following = now + 0.01
            take_one(self.executor, 0.01)

    def spin(self, seconds: float, meanwhile: Callable[[], Any] = lambda: None) -> None:
        """Spin for a while."""
        end = time.monotonic() + seconds
        self.until(lambda: time.monotonic() >= end, meanwhile)

    def running(self, **values: Any) -> tuple[Monitor, Driver]:
        """Return a monitor that has margins, and the driver that gives it its input."""
        monitor, driver = self.monitor(**values), self.driver()
        self.until(lambda: session_of(monitor).evaluator.margins is not None, driver.send)
        return monitor, driver

    def alone(self) -> None:
        """Wait until nobody is known to publish an input: who was killed stays known a while."""
        node = self.add(rclpy.create_node(f'lonely_{len(self.nodes)}'))
        topics = ('joint_states', 'imu/data')
        self.until(lambda: not any(map(node.count_publishers, topics)))

    def call(self, kind: Any, name: str, request: Any = None) -> Any:
        """Call a service and return its answer.

        An answer is lost if the service has not met its new client yet: then it is asked again.
        """
        node = self.add(rclpy.create_node(f'client_{len(self.nodes)}'))
        client = node.create_client(kind, name)
        self.until(client.service_is_ready)
        answers: list[Any] = []
        again = 0.0

        def answered() -> bool:
            nonlocal again
            if time.monotonic() >= again:
                again = time.monotonic() + PATIENCE / 4
                answers.append(client.call_async(request or kind.Request()))
            return any(answer.done() for answer in answers)

        self.until(answered)
        return next(answer.result() for answer in answers if answer.done())


def session_of(monitor: Monitor) -> Any:
    """Return the session of an active monitor."""
    assert monitor.session is not None
    return monitor.session


def levels(driver: Driver) -> list[int]:
    """Return the levels of all verdicts heard."""
    return [verdict.level[0] for verdict in driver.verdicts]


@contextmanager
def ros_context() -> Iterator[None]:
    """Initialise rclpy for a while, unless somebody has."""
    if ok():
        yield
        return
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        yield
    finally:
        try_shutdown()


@contextmanager
def live_nodes() -> Iterator[Live]:
    """Give an executor, and take all nodes down at the end."""
    executor = EventsExecutor()
    live = Live(executor)
    try:
        yield live
    finally:
        for node in live.nodes:
            executor.remove_node(node)
            end(node)
        executor.shutdown()
