"""The monitor's subscriptions: raw bytes into the session, and who publishes on the topics."""

from collections.abc import Sequence

from geometry_msgs.msg import InertiaStamped
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_policy_name_from_kind
from rclpy.subscription import Subscription
from sensor_msgs.msg import Imu, JointState

from ugv_acceptance.config import Topic, Topics
from ugv_acceptance.nodes.session import Session

_RELIABILITY = {
    'best_effort': ReliabilityPolicy.BEST_EFFORT,
    'reliable': ReliabilityPolicy.RELIABLE,
}
_DURABILITY = {
    'volatile': DurabilityPolicy.VOLATILE,
    'transient_local': DurabilityPolicy.TRANSIENT_LOCAL,
}


def qos_of(topic: Topic, depth: int) -> QoSProfile:
    """Return the QoS of an input: no deadline, for publishers without one would not match."""
    return QoSProfile(
        depth=max(depth, topic.depth),
        reliability=_RELIABILITY[topic.reliability],
        durability=_DURABILITY[topic.durability],
    )


class Inputs:
    """The subscriptions of an active monitor. `publishers` are the nodes seen on each input."""

    def __init__(self, node: Node, topics: Topics, session: Session, depth: int) -> None:
        self._node = node
        self._session = session
        self.publishers: dict[str, list[str]] = {}
        rows = (
            ('joint_states', JointState, topics.joint_states, session.take_joint_state),
            ('imu', Imu, topics.imu, session.take_imu),
            ('payload', InertiaStamped, topics.payload, session.take_payload),
        )
        self.subscriptions: dict[str, Subscription] = {
            name: node.create_subscription(
                kind,
                topic.name,
                take,
                qos_of(topic, depth),
                event_callbacks=self._events(name),
                raw=True,
            )
            for name, kind, topic, take in rows
        }
        self._malformed = dict.fromkeys(self.subscriptions, 0)

    def _events(self, name: str) -> SubscriptionEventCallbacks:
        session = self._session

        def mismatch(event: object) -> None:
            policy = qos_policy_name_from_kind(event.last_policy_kind)  # type: ignore[attr-defined]
            session.faults.set(session.clock.now(), 'INPUT_QOS', name, 1.0, policy)

        def lost(event: object) -> None:
            session.counts[name].lost = event.total_count  # type: ignore[attr-defined]
            count = float(session.counts[name].lost)
            session.faults.set(session.clock.now(), 'MESSAGES_LOST', name, count)

        return SubscriptionEventCallbacks(incompatible_qos=mismatch, message_lost=lost)

    def look_around(self, allowed: Sequence[str]) -> None:
        """See who publishes the inputs, and which faults are over. To be called once a second."""
        now, faults = self._session.clock.now(), self._session.faults
        for name, subscription in self.subscriptions.items():
            infos = self._node.get_publishers_info_by_topic(subscription.topic_name)
            nodes = sorted(_node_name(info.node_namespace, info.node_name) for info in infos)
            self.publishers[name] = nodes
            known = {node for node in allowed if node}
            foreign = [node for node in nodes if known and node not in known]
            if len(nodes) > 1:
                faults.set(now, 'SECOND_PUBLISHER', name, float(len(nodes)), ', '.join(nodes))
            else:
                faults.clear(now, 'SECOND_PUBLISHER', name)
            if foreign:
                faults.set(now, 'FOREIGN_PUBLISHER', name, 1.0, ', '.join(foreign))
            else:
                faults.clear(now, 'FOREIGN_PUBLISHER', name)
            count = self._session.counts[name]
            if count.malformed == self._malformed[name]:
                faults.clear(now, 'INPUT_MALFORMED', name)
                faults.clear(now, 'MONITOR_FAULT', name)
            self._malformed[name] = count.malformed
        self._look_at_the_clock(now)

    def _look_at_the_clock(self, now: int) -> None:
        clock = self._session.clock
        if clock.simulated and not self._node.get_clock().now().nanoseconds:
            self._session.faults.set(now, 'NO_CLOCK', 'clock', 1.0)
        else:
            self._session.faults.clear(now, 'NO_CLOCK', 'clock')

    def destroy(self) -> None:
        """Stop listening."""
        for subscription in self.subscriptions.values():
            self._node.destroy_subscription(subscription)


def _node_name(namespace: str, name: str) -> str:
    return f'{namespace.rstrip("/")}/{name}'
