"""Listens to a robot for a few seconds: who publishes what, and samples of it."""

import os
import time
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSCompatibility, QoSProfile, ReliabilityPolicy, qos_check_compatible
from rclpy.utilities import get_rmw_implementation_identifier

from ugv_acceptance.bag.cdr import IMU, JOINT_STATE, Decoder, Kind
from ugv_acceptance.config import Topic, Topics
from ugv_acceptance.inspection.heard import Heard, Told
from ugv_acceptance.nodes.bag_player import message_type
from ugv_acceptance.nodes.executor import RANGE, ros, spin
from ugv_acceptance.nodes.monitor.own_description import OwnDescription
from ugv_acceptance.nodes.monitor.publishers import MARGIN_TOPICS
from ugv_acceptance.nodes.monitor.subscriptions import qos_of
from ugv_acceptance.nodes.transport import Transport, transport_now, vendor_by

# Seconds until all publishers should be known; then the listening begins.
DISCOVERY = 4.0
# Names of a monitor's margin topics, whatever the node's own name.
_MARGINS = frozenset(topic.rpartition('/')[2] for topic in MARGIN_TOPICS)


@dataclass(frozen=True, slots=True)
class Surroundings:
    """The ROS environment, and the messages received on both inputs in `seconds`.

    An input that the configuration does not use is None. `robot` is what the robot tells of itself.
    `server` and `peers` are where discovery asks, '' for nowhere.
    """

    distribution: str
    middleware: str
    domain: str
    discovery: str
    monitors: list[str]
    seconds: float
    joint_states: Heard | None
    imu: Heard | None
    robot: Told | None = None
    transport: Transport | None = None
    server: str = ''
    peers: str = ''


def listen(topics: Topics, seconds: float, args: list[str]) -> Surroundings:
    """Listen to a robot for `seconds`."""
    discovery = os.environ.get(RANGE, 'SUBNET')
    with ros(args) as stop:
        node = Node('doctor')
        kinds: dict[str, Kind[Any]] = {'joint_states': JOINT_STATE, 'imu': IMU}
        inputs = {
            name: _subscribe(node, topics.used[name], Decoder(kind))
            for name, kind in kinds.items()
            if name in topics.used
        }
        own = OwnDescription(node, lambda _: None)
        own.listen(topics.robot_description)
        began = time.monotonic()

        def found_all() -> bool:
            all_there = all(node.count_publishers(heard.topic) for heard in inputs.values())
            return all_there or time.monotonic() > began + DISCOVERY

        spin(node, stop, found_all)
        end = time.monotonic() + seconds
        spin(node, stop, lambda: time.monotonic() >= end)
        stop.leave()
        for name, heard in inputs.items():
            _look(node, heard, topics.used[name])
        found = Surroundings(
            _distribution(),
            get_rmw_implementation_identifier(),
            os.environ.get('ROS_DOMAIN_ID', '0'),
            discovery,
            [name for name in node.get_node_names() if name == 'acceptance_monitor'],
            seconds,
            inputs.get('joint_states'),
            inputs.get('imu'),
            Told(own.topic, tuple(own.heard.values()), own.obstacle()),
            transport_now(),
            os.environ.get('ROS_DISCOVERY_SERVER', ''),
            os.environ.get('ROS_STATIC_PEERS', ''),
        )
        node.destroy_node()
        return found


def _distribution() -> str:
    """Return the ROS distribution that is sourced, or the wheels used instead."""
    if sourced := os.environ.get('ROS_DISTRO'):
        return sourced
    try:
        return f'jazzy wheels, rclpy {version("ros-jazzy-rclpy")}'
    except PackageNotFoundError:
        return 'ROS_DISTRO not set'


def _subscribe(node: Node, topic: Topic, decoder: Decoder[Any]) -> Heard:
    heard = Heard(node.resolve_topic_name(topic.name), topic.type)

    def take(data: Any) -> None:  # noqa: ANN401 - bytes, for it is raw
        heard.take(decoder.one, data)

    # Best effort, volatile: matches every publisher, whatever the configuration says.
    anything = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
    node.create_subscription(
        message_type(topic.type),
        topic.name,
        take,
        anything,
        raw=True,
    )
    return heard


def _look(node: Node, heard: Heard, topic: Topic) -> None:
    wanted = qos_of(topic, 1)
    for info in node.get_publishers_info_by_topic(heard.topic):
        level, reason = qos_check_compatible(info.qos_profile, wanted)
        name = f'{info.node_namespace.rstrip("/")}/{info.node_name}'
        bad = level == QoSCompatibility.ERROR
        heard.publishers.append((name, info.topic_type, reason if bad else ''))
        if vendor := vendor_by(bytes(info.endpoint_gid)):
            heard.vendors[name] = vendor
    heard.alike = [
        name
        for name, types in node.get_topic_names_and_types()
        if topic.type in types
        and name != heard.topic
        and node.count_publishers(name)
        and not _told_by_a_monitor(node, name)
    ]


def _told_by_a_monitor(node: Node, topic: str) -> bool:
    """Return whether a topic is published by a monitor, live or from a recording."""
    if topic.rpartition('/')[2] in _MARGINS:
        return True
    infos = node.get_publishers_info_by_topic(topic)
    names = {f'{info.node_namespace.rstrip("/")}/{info.node_name}' for info in infos}
    return bool(names) and all(node.count_publishers(f'{name}/verdict') for name in names)
