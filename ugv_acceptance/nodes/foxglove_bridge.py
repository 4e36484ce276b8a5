"""Serves the live topics to Foxglove by WebSocket: read only, for this machine only.

Messages pass through as the bytes they came in, with the definitions of their types. A topic is
subscribed only while somebody watches it, to spare the robot's network.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from ugv_acceptance import AcceptanceError, BadBag, pip_install
from ugv_acceptance.bag.writer import definition_of
from ugv_acceptance.nodes.bag_player import message_type

if TYPE_CHECKING:
    from rclpy.subscription import Subscription

# No other address: from afar use a tunnel (ssh -L), which authenticates.
HOST, PORT = '127.0.0.1', 8765
# Seconds between checks of the watchers, and of the topics.
LOOK, TOPICS = 0.1, 1.0
# Messages that are held for a slow client; then the oldest go. The robot never waits.
BACKLOG, DEPTH = 256, 100


@dataclass(slots=True)
class _Topic:
    """An offered topic: its type, its channel, and its subscription while it is watched."""

    kind: str
    channel: Any
    subscription: 'Subscription | None' = None


class _Listener:
    """Counts how many clients watch each topic; called on the server's threads."""

    def __init__(self) -> None:
        self.heard: SimpleQueue[tuple[str, int]] = SimpleQueue()

    def on_subscribe(self, _client: object, channel: Any) -> None:  # noqa: ANN401 - foxglove's view
        """Count one more client that watches a topic."""
        self.heard.put((channel.topic, 1))

    def on_unsubscribe(self, _client: object, channel: Any) -> None:  # noqa: ANN401
        """Count one less client that watches a topic."""
        self.heard.put((channel.topic, -1))


class Bridge(Node):
    """Offers all published topics of standard types. Raises AcceptanceError if no server starts."""

    def __init__(self, port: int = PORT) -> None:
        super().__init__('foxglove_bridge')
        self._foxglove = _foxglove()
        self._listener, self._sinks = _Listener(), self._foxglove.Context()
        self._watching: dict[str, int] = {}
        self.offered: dict[str, _Topic] = {}
        try:
            self._server = self._foxglove.start_server(
                name='ugv_acceptance',
                host=HOST,
                port=port,
                # None: no publishing, no parameters, no services, no files.
                capabilities=[],
                server_listener=self._listener,
                context=self._sinks,
                message_backlog_size=BACKLOG,
            )
        except (OSError, RuntimeError) as error:
            self.destroy_node()
            raise AcceptanceError(f'{HOST}:{port}: cannot be listened on: {error}') from None
        self.port: int = self._server.port
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(TOPICS, self.look_for_topics, clock=steady)
        self.create_timer(LOOK, self._look_for_watchers, clock=steady)
        self.look_for_topics()

    def look_for_topics(self) -> None:
        """Add channels of newly published topics, and remove those no longer published."""
        there = {
            name: kinds[0]
            for name, kinds in self.get_topic_names_and_types()
            if self.count_publishers(name)
        }
        for name in [n for n, topic in self.offered.items() if there.get(n) != topic.kind]:
            topic = self.offered.pop(name)
            self._leave(topic)
            topic.channel.close()
        for name, kind in there.items():
            if name not in self.offered and (channel := self._channel(name, kind)) is not None:
                self.offered[name] = _Topic(kind, channel)

    def _channel(self, name: str, kind: str) -> Any:  # noqa: ANN401 - foxglove's channel
        """Return a new channel; None for a type that is not one of ROS's own or not installed."""
        try:
            text, _ = definition_of(kind)
        except BadBag:
            return None
        if message_type(kind) is None:
            return None
        schema = self._foxglove.Schema(name=kind, encoding='ros2msg', data=text.encode())
        return self._foxglove.Channel(
            name, schema=schema, message_encoding='cdr', context=self._sinks
        )

    def _look_for_watchers(self) -> None:
        try:
            while True:
                name, more = self._listener.heard.get_nowait()
                self._watching[name] = max(self._watching.get(name, 0) + more, 0)
        except Empty:
            pass
        for name, topic in self.offered.items():
            if not self._watching.get(name):
                self._leave(topic)
            elif topic.subscription is None:
                topic.subscription = self.create_subscription(
                    message_type(topic.kind),
                    name,
                    _relay(topic.channel),
                    self._qos(name),
                    raw=True,
                )

    def _leave(self, topic: _Topic) -> None:
        if topic.subscription is not None:
            self.destroy_subscription(topic.subscription)
            topic.subscription = None

    def _qos(self, name: str) -> QoSProfile:
        """Return a QoS that matches every publisher; latched if all of them are."""
        offers = [info.qos_profile for info in self.get_publishers_info_by_topic(name)]
        latched = all(o.durability == DurabilityPolicy.TRANSIENT_LOCAL for o in offers)
        reliable = all(o.reliability == ReliabilityPolicy.RELIABLE for o in offers)
        return QoSProfile(
            depth=DEPTH,
            reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        )

    def destroy_node(self) -> None:
        """Close the server and destroy the node."""
        if hasattr(self, '_server'):
            self._server.stop()
        super().destroy_node()


def _relay(channel: Any) -> Callable[[Any], None]:  # noqa: ANN401
    def relay(data: bytes) -> None:
        channel.log(bytes(data), log_time=time.time_ns())

    return relay


def _foxglove() -> Any:  # noqa: ANN401 - a module
    try:
        import foxglove  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise AcceptanceError(
            f'no Foxglove: expected its SDK ({pip_install("foxglove")}), got: {error}'
        ) from None
    return foxglove
