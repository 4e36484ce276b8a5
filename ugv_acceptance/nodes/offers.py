"""What publishers offer, and what a subscriber has to ask for to hear all of them."""

from collections.abc import Iterable, Sequence
from typing import Literal

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from rclpy.topic_endpoint_info import TopicEndpointInfo

from ugv_acceptance.bag.writer import Qos

# A longer time (ns) is no limit.
_NEVER = 9_000_000_000 * 1_000_000_000
_WORDS = {'best_effort': 'best effort', 'transient_local': 'transient local'}


def offer_of(info: TopicEndpointInfo) -> Qos:
    """Return what a publisher offers."""
    qos = info.qos_profile
    best_effort = qos.reliability == ReliabilityPolicy.BEST_EFFORT
    latched = qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
    manual = qos.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC
    return Qos(
        'best_effort' if best_effort else 'reliable',
        'transient_local' if latched else 'volatile',
        _limit(qos.deadline),
        _limit(qos.lifespan),
        'manual_by_topic' if manual else 'automatic',
        _limit(qos.liveliness_lease_duration),
    )


def _limit(duration: Duration) -> int | None:
    """Return a time in ns; None where there is no limit: DDS says so by 0 or its longest time."""
    time = int(duration.nanoseconds)
    return time if 0 < time < _NEVER else None


def requests_for(offers: Sequence[Qos]) -> tuple[Qos, ...]:
    """Return what to ask for so that every publisher is heard, with what it keeps for late ones.

    One request is enough unless only some publishers keep messages: then two.
    """
    kept = [offer for offer in offers if offer.durability == 'transient_local']
    found = [Qos(_reliability(kept), 'transient_local')] if kept else []
    if len(kept) < len(offers):
        found.append(Qos(_reliability(offers), 'volatile'))
    return tuple(found)


def _reliability(offers: Iterable[Qos]) -> Literal['reliable', 'best_effort']:
    every = all(offer.reliability == 'reliable' for offer in offers)
    return 'reliable' if every else 'best_effort'


def profile_of(request: Qos, depth: int) -> QoSProfile:
    """Return a request as rclpy takes it; no deadline, which would exclude publishers."""
    reliable, latched = request.reliability == 'reliable', request.durability == 'transient_local'
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def differing(infos: Sequence[TopicEndpointInfo]) -> str:
    """Return who offers what where publishers of one topic differ; empty where they do not."""
    offers = {(_node(info), _words(offer_of(info))) for info in infos}
    if len({words for _, words in offers}) < 2:
        return ''
    return ', '.join(f'{node} offers {words}' for node, words in sorted(offers))


def _words(offer: Qos) -> str:
    return ' and '.join(_WORDS.get(word, word) for word in (offer.reliability, offer.durability))


def _node(info: TopicEndpointInfo) -> str:
    return f'{info.node_namespace.rstrip("/")}/{info.node_name}'


def publishers(node: Node, topic: str) -> list[TopicEndpointInfo]:
    """Return the publishers of a topic that ROS knows of."""
    return list(node.get_publishers_info_by_topic(topic))
