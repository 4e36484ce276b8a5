"""Asks the monitor for what an operator wants and waits for its answer: page, `watch`, `tell`.

The commands are those of monitor/operator_desk.py. Each has an id, and is sent again until it is
answered: the monitor carries it out once.
"""

import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from uuid import uuid4

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import InertiaStamped
from rclpy.duration import Duration
from rclpy.executors import Executor
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.task import Future

from ugv_acceptance import BadSample
from ugv_acceptance.nodes.executor import Stop, ros
from ugv_acceptance.nodes.monitor.operator_desk import DEPTH, DONE, load_message
from ugv_acceptance.nodes.monitor.publishers import LATCHED, key_values

MONITOR = 'acceptance_monitor'
# Seconds after which a command without an answer is sent again.
AGAIN = 0.5
# Seconds between two looks for a monitor; seconds for a load to reach who records its topic.
_LOOK, _RECORDED = 0.05, 3.0


@dataclass(frozen=True, slots=True)
class Command:
    """What an operator wants: `do`, by whom, a note, and values such as the code of an alert."""

    do: str
    who: str
    note: str = ''
    values: Mapping[str, object] = field(default_factory=dict)

    def message(self, number: str) -> DiagnosticStatus:
        """Return it as a message with an id."""
        values = key_values({**self.values, 'id': number})
        return DiagnosticStatus(
            name=self.do, hardware_id=self.who, message=self.note, values=values
        )


@dataclass(frozen=True, slots=True)
class Answer:
    """What the monitor answered: whether it was done, what or why not, and values."""

    done: bool
    text: str
    values: dict[str, str]


class OperatorClient:
    """Sends commands to the monitor in the node's namespace, and takes its answers."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._waiting: dict[str, Future] = {}
        self._out = node.create_publisher(DiagnosticStatus, f'{MONITOR}/operator', DEPTH)
        node.create_subscription(DiagnosticStatus, f'{MONITOR}/operator_answer', self._take, DEPTH)

    @property
    def topic(self) -> str:
        """The full name of the topic that the monitor should hear."""
        return str(self._out.topic_name)

    @property
    def heard(self) -> bool:
        """Whether anybody hears the commands."""
        return bool(self._out.get_subscription_count())

    def where(self) -> str:
        """Return in words where a monitor was looked for, and where there is another one."""
        domain = os.environ.get('ROS_DOMAIN_ID') or '0'
        ending = f'/{MONITOR}/operator'
        found = [
            name.removesuffix(ending)
            for name, _ in self._node.get_topic_names_and_types()
            if name.endswith(ending) and name != self.topic and self._node.count_subscribers(name)
        ]
        named = ', '.join(name or '/' for name in found)
        others = f'; one is in the namespace {named}' if found else ''
        return f'{self.topic}, ROS domain {domain}{others}'

    def _take(self, message: DiagnosticStatus) -> None:
        values = {pair.key: pair.value for pair in message.values}
        waiting = self._waiting.pop(values.get('id', ''), None)
        if waiting is not None:
            waiting.set_result(Answer(values.get('result') == DONE, message.message, values))

    def send(self, command: Command, within: float) -> Callable[[], Answer | None]:
        """Send a command; return what gives its answer, None until that has come.

        It is to be called again and again while the node is spun, for it also sends the command
        again. It raises BadSample where no answer has come `within` so many seconds.
        """
        number, answered, again = uuid4().hex, Future(), 0.0
        message, end = command.message(number), time.monotonic() + within
        self._waiting[number] = answered

        def answer() -> Answer | None:
            nonlocal again
            now = time.monotonic()
            if answered.done():
                found: Answer = answered.result()
                return found
            if now >= end:
                self._waiting.pop(number, None)
                raise BadSample(f'{command.do}: the monitor does not answer ({self.where()})')
            if now >= again:
                again = now + AGAIN
                self._out.publish(message)
            return None

        answer()
        return answer

    def ask(
        self,
        executor: Executor,
        command: Command,
        within: float,
        stopped: Callable[[], bool] = lambda: False,
    ) -> Answer:
        """Send a command and wait for its answer, at most `within` (s), spinning the executor.

        Raises BadSample where no answer comes, or it is `stopped`.
        """
        answer = self.send(command, within)
        while (found := answer()) is None:
            if stopped():
                raise BadSample(f'{command.do}: stopped before the monitor answered')
            executor.spin_once(timeout_sec=_LOOK)
        return found


def ask_once(command: Command, args: list[str], within: float) -> Answer:
    """Send one command from a node of its own; `args` are ROS arguments.

    A monitor is looked for during `within` (s), and its answer waited for as long. A load that was
    taken is also said on its topic, for recorders and consoles. Raises BadSample where no monitor
    is found or none answers.
    """
    with ros(args) as stop:
        node, executor = Node('acceptance_tell'), EventsExecutor()
        executor.add_node(node)
        try:
            client = OperatorClient(node)
            _until(lambda: client.heard, executor, stop, within)
            if not client.heard:
                raise BadSample(
                    f'no monitor hears on {client.where()}; start `ugv-acceptance monitor`, or give'
                    ' its namespace: --ros-args -r __ns:=/NAME'
                )
            answer = client.ask(executor, command, within, lambda: stop.asked)
            if answer.done and answer.values.get('topic'):
                _say_load(node, answer.values, lambda ready: _until(ready, executor, stop, 1.0))
            return answer
        finally:
            stop.leave()
            executor.remove_node(node)
            executor.shutdown()
            node.destroy_node()


def _until(condition: Callable[[], bool], executor: Executor, stop: Stop, within: float) -> None:
    """Spin until a condition holds, the time (s) is over or the process is asked to end."""
    end = time.monotonic() + within
    while not condition() and not stop.asked and time.monotonic() < end:
        executor.spin_once(timeout_sec=_LOOK)


def _say_load(
    node: Node, values: Mapping[str, str], until: Callable[[Callable[[], bool]], None]
) -> None:
    """Publish a load that the monitor took, once, to all who hear its topic."""
    topic = values['topic']
    x, y, z = (float(place) for place in values['cog_m'].split(','))
    message = load_message(values['link'], float(values['mass_kg']), (x, y, z))
    message.header.stamp = node.get_clock().now().to_msg()
    out = node.create_publisher(InertiaStamped, topic, LATCHED)
    until(lambda: 0 < node.count_subscribers(topic) <= out.get_subscription_count())
    out.publish(message)
    out.wait_for_all_acked(Duration(seconds=_RECORDED))
