"""Hears the commands on `~/operator`, and finds out which node sent each."""

from collections import deque
from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.timer import Timer
from rclpy.utilities import get_rmw_implementation_identifier

from ugv_acceptance.monitoring.senders import Sender, sender_of
from ugv_acceptance.nodes.monitor.sender_subscription import SenderSubscription
from ugv_acceptance.nodes.monitor.subscriptions import listed_publishers

# Seconds between two looks for a sender's name, which DDS delivers a little later than its
# messages, and ns after which it is not waited for.
_LOOK, _WAIT = 0.05, 1_000_000_000
# Commands that wait for the names of their senders at most.
_MOST = 50


class OperatorTopic:
    """Calls `take` with each command and its sender, in the order in which they came.

    A command waits up to a second for its sender's name. When too many wait the oldest is taken
    without it.
    """

    def __init__(
        self, node: Node, depth: int, take: Callable[[DiagnosticStatus, Sender], None]
    ) -> None:
        self._node, self._take = node, take
        # Of other middleware it is not known that both identities of a publisher are the same.
        self._comparable = get_rmw_implementation_identifier().startswith('rmw_fastrtps')
        self._waiting: deque[tuple[int, DiagnosticStatus, bytes | None]] = deque()
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._again: Timer = node.create_timer(_LOOK, self._work, clock=self._steady)
        self._again.cancel()
        self._topic = SenderSubscription(
            node, DiagnosticStatus, '~/operator', QoSProfile(depth=depth), self._hear
        )

    def _hear(self, message: DiagnosticStatus, gid: bytes | None) -> None:
        self._waiting.append((self._steady.now().nanoseconds + _WAIT, message, gid))
        self._work()

    def _work(self) -> None:
        """Hand on every command whose sender is known or not waited for any longer."""
        self._again.cancel()
        while self._waiting:
            until, message, gid = self._waiting[0]
            publishers = listed_publishers(self._node, self._topic.topic_name)
            sender = sender_of(gid, publishers, comparable=self._comparable)
            late = self._steady.now().nanoseconds >= until or len(self._waiting) > _MOST
            if not sender.settled and not late:
                self._again.reset()
                return
            self._waiting.popleft()
            self._take(message, sender)

    def destroy(self) -> None:
        """Unsubscribe; commands that wait are dropped."""
        self._waiting.clear()
        self._node.destroy_timer(self._again)
        self._topic.destroy()
