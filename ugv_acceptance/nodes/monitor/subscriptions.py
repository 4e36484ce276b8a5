"""The monitor's subscriptions: passes serialised messages to the session; watches publishers."""

from collections.abc import Callable, Sequence
from inspect import Parameter, Signature
from typing import Any

from geometry_msgs.msg import InertiaStamped
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_policy_name_from_kind
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from sensor_msgs.msg import Imu, JointState

from ugv_acceptance.config import Topic, Topics
from ugv_acceptance.monitoring.publisher_identity import Publisher, Voices
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.nodes.monitor.static_transforms import StaticTransforms

_RELIABILITY = {
    'best_effort': ReliabilityPolicy.BEST_EFFORT,
    'reliable': ReliabilityPolicy.RELIABLE,
}
_DURABILITY = {
    'volatile': DurabilityPolicy.VOLATILE,
    'transient_local': DurabilityPolicy.TRANSIENT_LOCAL,
}
# ROS's placeholder for a node whose name is not known yet.
_UNKNOWN = 'NODE_NAME_UNKNOWN'
# After a publisher came or went: seconds between checks, their number, ns to wait for a name.
_SOON, _LOOKS, _NAMED = 0.1, 10, 1_000_000_000


def qos_of(topic: Topic, depth: int) -> QoSProfile:
    """Return the QoS of an input; no deadline, which would exclude publishers without one."""
    return QoSProfile(
        depth=max(depth, topic.depth),
        reliability=_RELIABILITY[topic.reliability],
        durability=_DURABILITY[topic.durability],
    )


class Inputs:
    """The subscriptions of an active monitor. `publishers` are the nodes that publish each input.

    `voices` tells them apart: a driver that was restarted counts as one node.
    """

    def __init__(self, node: Node, topics: Topics, session: Session, depth: int) -> None:
        self._node = node
        self._session = session
        self._allowed: frozenset[str] = frozenset()
        self._looks = 0
        self._unnamed: dict[str, int] = {}
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._soon: Timer = node.create_timer(_SOON, self._look, clock=steady)
        self.publishers: dict[str, list[str]] = {}
        every: dict[str, tuple[Any, Callable[[bytes], None]]] = {
            'joint_states': (JointState, session.take_joint_state),
            'imu': (Imu, session.take_imu),
            'payload': (InertiaStamped, session.take_payload),
        }
        rows = [(name, topic, *every[name]) for name, topic in topics.used.items()]
        self.voices = {name: Voices() for name, _, _, _ in rows}
        self.subscriptions: dict[str, Subscription] = {
            name: node.create_subscription(
                kind,
                topic.name,
                numbered(take, self.voices[name]),
                qos_of(topic, depth),
                event_callbacks=self._events(name),
                raw=True,
            )
            for name, topic, kind, take in rows
        }
        self._malformed = dict.fromkeys(self.subscriptions, 0)
        self.transforms = StaticTransforms(node, session)

    def _events(self, name: str) -> SubscriptionEventCallbacks:
        session = self._session

        def mismatch(event: object) -> None:
            policy = qos_policy_name_from_kind(event.last_policy_kind)  # type: ignore[attr-defined]
            session.faults.set(session.clock.now(), 'INPUT_QOS', name, 1.0, policy)

        def lost(event: object) -> None:
            session.counts[name].lost = event.total_count  # type: ignore[attr-defined]
            count = float(session.counts[name].lost)
            session.faults.set(session.clock.now(), 'MESSAGES_LOST', name, count)

        def matched(_: object) -> None:
            # The event may come after its subscription was destroyed.
            if self.subscriptions:
                self._look_soon()

        return SubscriptionEventCallbacks(
            incompatible_qos=mismatch, message_lost=lost, matched=matched
        )

    def _look_soon(self) -> None:
        """Look for publishers several times in the next second, because one has come or gone."""
        self._looks = 0
        self._soon.reset()

    def _look(self) -> None:
        # Its turn may have come before the timer was destroyed.
        if not self.subscriptions:
            return
        self._looks += 1
        if self._looks >= _LOOKS:
            self._soon.cancel()
        try:
            self._see_publishers(self._session.clock.now())
        except Exception as error:  # noqa: BLE001 - a fault in our code must not end the watch
            self._session.fail('publishers', error)

    def look_around(self, allowed: Sequence[str]) -> None:
        """Update publishers, and clear faults that are over; to be called once a second."""
        self._allowed = frozenset(node for node in allowed if node)
        now, faults = self._session.clock.now(), self._session.faults
        self.transforms.look()
        self._see_publishers(now)
        for name in self.subscriptions:
            count = self._session.counts[name]
            if count.malformed == self._malformed[name]:
                faults.clear(now, 'INPUT_MALFORMED', name)
                faults.clear(now, 'MONITOR_FAULT', name)
            self._malformed[name] = count.malformed
        self._look_at_the_clock(now)

    def _see_publishers(self, now: int) -> None:
        for name, subscription in self.subscriptions.items():
            known = listed_publishers(self._node, subscription.topic_name)
            if self._nameless(name, now, [publisher.node for publisher in known]):
                continue
            nodes = self.publishers[name] = self.voices[name].present(now, known)
            foreign = [node for node in nodes if self._allowed and node not in self._allowed]
            several = nodes if len(nodes) > 1 else []
            self._tell(now, 'SECOND_PUBLISHER', name, several, float(len(nodes)))
            self._tell(now, 'FOREIGN_PUBLISHER', name, foreign, 1.0)

    def _nameless(self, name: str, now: int, nodes: Sequence[str]) -> bool:
        """Return whether to wait for a node's name, which DDS delivers a little later."""
        if not any(_UNKNOWN in node for node in nodes):
            self._unnamed.pop(name, None)
            return False
        return now - self._unnamed.setdefault(name, now) < _NAMED

    def _tell(self, now: int, code: str, name: str, nodes: Sequence[str], count: float) -> None:
        if nodes:
            self._session.faults.set(now, code, name, count, ', '.join(nodes))
        else:
            self._session.faults.clear(now, code, name)

    def _look_at_the_clock(self, now: int) -> None:
        if self._session.stamps.simulated and not self._node.get_clock().now().nanoseconds:
            self._session.faults.set(now, 'NO_CLOCK', 'clock', 1.0)
        else:
            self._session.faults.clear(now, 'NO_CLOCK', 'clock')

    def destroy(self) -> None:
        """Unsubscribe from all inputs."""
        self._node.destroy_timer(self._soon)
        self.transforms.destroy()
        for subscription in self.subscriptions.values():
            self._node.destroy_subscription(subscription)
        self.subscriptions = {}


def numbered(take: Callable[[bytes], None], voices: Voices) -> Callable[..., None]:
    """Return a subscription's callback that gives `voices` the number of each message."""
    hear = voices.hear

    # An executor hands message and information on as two arguments, the events executor as a pair.
    def callback(*given: Any) -> None:  # noqa: ANN401 - bytes and a dict, or both as a tuple
        data, information = given if len(given) == 2 else given[0]
        hear(information.get('publication_sequence_number'))
        take(data)

    # By its signature rclpy knows that the information is wanted.
    both = [Parameter(name, Parameter.POSITIONAL_ONLY) for name in ('data', 'information')]
    callback.__signature__ = Signature(both)  # type: ignore[attr-defined]
    return callback


def listed_publishers(node: Node, topic: str) -> list[Publisher]:
    """Return the publishers of a topic, by its full name, that ROS knows now."""
    return [
        Publisher(
            _node_name(i.node_namespace, i.node_name),
            bytes(i.endpoint_gid),
            named=_UNKNOWN not in i.node_name,
        )
        for i in node.get_publishers_info_by_topic(topic)
    ]


def _node_name(namespace: str, name: str) -> str:
    return f'{namespace.rstrip("/")}/{name}'
