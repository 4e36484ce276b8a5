"""Asks the running monitor whether the arm may move so: `ugv-acceptance check FILE --live`."""

import time
from dataclasses import dataclass, field

from builtin_interfaces.msg import Duration
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.executors import Executor
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.serialization import serialize_message
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from ugv_acceptance import BadSample
from ugv_acceptance.bag.trajectory import NS, trajectory_from
from ugv_acceptance.evaluation.planned_motion import Trajectory
from ugv_acceptance.nodes.executor import Stop, ros
from ugv_acceptance.nodes.operator_client import MONITOR

# Seconds after which a question without an answer is asked again; seconds between two looks.
AGAIN, LOOK = 1.0, 0.05
# Answers to a question; what comes later takes a permission back.
RESULTS = ('permitted', 'refused', 'not_known')
DEPTH = 50


@dataclass(frozen=True, slots=True)
class LiveAnswer:
    """What the monitor answered: `result`, a sentence, the values. A CAUTION is `cautious`.

    Where nobody answers, the result is 'not_known' and there are no values.
    """

    result: str
    text: str
    cautious: bool = False
    values: dict[str, str] = field(default_factory=dict)


class CheckClient:
    """Asks the monitor in a node's namespace; `answers` are those about what was asked last."""

    def __init__(self, node: Node) -> None:
        self._name = ''
        self.answers: list[LiveAnswer] = []
        self._out = node.create_publisher(JointTrajectory, f'{MONITOR}/check', DEPTH)
        self._in = node.create_subscription(
            DiagnosticStatus, f'{MONITOR}/check_result', self._take, DEPTH
        )
        self._node = node

    @property
    def topic(self) -> str:
        """The full name of the topic that the monitor should hear."""
        return str(self._out.topic_name)

    @property
    def heard(self) -> bool:
        """Whether a monitor hears the questions, and its answers are heard here."""
        return bool(
            self._out.get_subscription_count() and self._node.count_publishers(self._in.topic_name)
        )

    def ask(self, message: JointTrajectory) -> None:
        """Ask once."""
        self._name = name_of(message)
        self._out.publish(message)

    def _take(self, status: DiagnosticStatus) -> None:
        values = {pair.key: pair.value for pair in status.values}
        result = values.get('result', '')
        if values.get('trajectory_sha256') == self._name and result in RESULTS:
            cautious = status.level == DiagnosticStatus.WARN
            self.answers.append(LiveAnswer(result, status.message, cautious, values))


def ask_live(trajectory: Trajectory, args: list[str], within: float) -> LiveAnswer:
    """Ask the running monitor from a node of its own; `args` are ROS arguments.

    A monitor is looked for during `within` (s), and its answer waited for as long.
    """
    message = message_of(trajectory)
    with ros(args) as stop:
        node, executor = Node('acceptance_check'), EventsExecutor()
        executor.add_node(node)
        try:
            return _answer(CheckClient(node), message, executor, stop, within)
        finally:
            stop.leave()
            executor.remove_node(node)
            executor.shutdown()
            node.destroy_node()


def _answer(
    client: CheckClient, message: JointTrajectory, executor: Executor, stop: Stop, within: float
) -> LiveAnswer:
    end = time.monotonic() + within
    while not client.heard and not stop.asked and time.monotonic() < end:
        executor.spin_once(timeout_sec=LOOK)
    if not client.heard:
        return LiveAnswer(
            RESULTS[2],
            f'nobody answered: no monitor hears on {client.topic}; start `ugv-acceptance monitor`, '
            'or give its namespace: --ros-args -r __ns:=/NAME',
        )
    end, again = time.monotonic() + within, 0.0
    while not client.answers and not stop.asked and time.monotonic() < end:
        if time.monotonic() >= again:
            client.ask(message)
            again = time.monotonic() + AGAIN
        executor.spin_once(timeout_sec=LOOK)
    if not client.answers:
        return LiveAnswer(RESULTS[2], f'nobody answered on {client.topic} in {within:g} s')
    return client.answers[0]


def name_of(message: JointTrajectory) -> str:
    """Return what names a trajectory in the answers; '' if the monitor cannot read it."""
    try:
        return trajectory_from(serialize_message(message)).sha256
    except BadSample:
        return ''


def message_of(trajectory: Trajectory) -> JointTrajectory:
    """Return a trajectory as a message that begins at once."""
    message = JointTrajectory(joint_names=list(trajectory.names))
    tables = (trajectory.velocities, trajectory.accelerations)
    for k, (at, row) in enumerate(zip(trajectory.times, trajectory.positions, strict=True)):
        sec, nanosec = divmod(round(float(at) * NS), NS)
        more = [[] if t is None or (t[k] != t[k]).all() else t[k].tolist() for t in tables]
        point = JointTrajectoryPoint(
            positions=row.tolist(),
            velocities=more[0],
            accelerations=more[1],
            time_from_start=Duration(sec=sec, nanosec=nanosec),
        )
        message.points.append(point)
    return message
