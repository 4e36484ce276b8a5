"""Publishes `~/ok`: one Bool for programs, ten times a second in every state of the lifecycle."""

from typing import Any, Protocol

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Bool

from ugv_acceptance.monitoring.ok_word import OkWord
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.nodes.monitor.guarded import guarded

# Seconds between two words, and the longest that DDS is told to expect.
PERIOD, DEADLINE = 0.1, 0.2
QOS = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.VOLATILE,
    deadline=Duration(seconds=DEADLINE),
)
INACTIVE = 'the monitor is not active'


class OkNode(Protocol):
    """What the word needs of a monitor node, besides what any node has."""

    session: Session | None

    def get_logger(self) -> Any:  # noqa: ANN401 - rclpy's logger
        """Return the node's logger."""


class OkOutput:
    """Says at once that the margins are no longer known and kept; every PERIOD what is so.

    A fault in it is false. `why_not` is the reason why it was false when it was last looked at.
    """

    def __init__(self, node: Node, watcher: OkNode) -> None:
        self._watcher = watcher
        self._publisher = node.create_publisher(Bool, '~/ok', QOS)
        self._word: OkWord | None = None
        self._said = False
        self.why_not = INACTIVE
        # Steady: a frozen /clock must neither silence it nor keep an old word alive.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(PERIOD, guarded(watcher, self.ok), clock=steady)

    def ok(self) -> None:
        """Publish the word, judged at this moment."""
        try:
            if self._watcher.session is not None:
                self._watcher.session.tick()
            self.why_not = self._look()
        except Exception as error:
            self.why_not = _fault(error)
            raise
        finally:
            self._say()

    def fall(self) -> None:
        """Look again; publish that the word is false if it was true and is no longer."""
        try:
            self.why_not = self._look()
        except Exception as error:  # noqa: BLE001 - whatever it is, the word is false
            self.why_not = _fault(error)
        if self._said and self.why_not:
            self._say()

    def _look(self) -> str:
        session = self._watcher.session
        if session is None:
            self._word = None
            return INACTIVE
        if self._word is None or self._word.session is not session:
            self._word = OkWord(session)
        return self._word.why_not()

    def _say(self) -> None:
        self._said = not self.why_not
        self._publisher.publish(Bool(data=self._said))


def _fault(error: Exception) -> str:
    return f'fault of the monitor: {error!r}'
