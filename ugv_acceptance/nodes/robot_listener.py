"""Listens to a running robot for what it tells of itself: URDF, fixed frames, joints, IMUs.

The counterpart for recordings is configure/recorded.py: both feed the same collector.
"""

import time
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from ugv_acceptance import AcceptanceError
from ugv_acceptance.bag.cdr import IMU, JOINT_STATE
from ugv_acceptance.bag.description import TYPE as STRING
from ugv_acceptance.bag.transforms import TYPE as TF
from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.configure.collector import Collector, is_wanted
from ugv_acceptance.configure.evidence import LIVE, Evidence
from ugv_acceptance.nodes.bag_player import message_type
from ugv_acceptance.nodes.executor import ros, spin

# Seconds in which publishers should be found, and then send; the listening begins with the first
# message, for a slow machine needs long to come that far.
DISCOVERY = 4.0
# What a publisher keeps for late subscribers is heard only by one that asks for it.
_LATCHED = QoSProfile(
    depth=100,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
# Matches every publisher.
_ANY = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
_QOS = {STRING: _LATCHED, TF: _LATCHED, JOINT_STATE.type: _ANY, IMU.type: _ANY}


def listen(
    seconds: float = 5.0, urdf: Urdf | None = None, args: list[str] | None = None
) -> Evidence:
    """Return what the robot on this ROS domain tells of itself in `seconds` (s).

    It should stand still meanwhile. `urdf` is its URDF where that is known already; `args` are ROS
    arguments. Raises AcceptanceError if nobody publishes anything that tells of a robot.
    """
    collector = Collector(LIVE)
    with ros(args) as stop:
        node = Node('robot_listener')
        heard = Listener(node, collector)
        began = time.monotonic()
        spin(node, stop, lambda: heard.look() or time.monotonic() > began + DISCOVERY)
        end = time.monotonic() + seconds + (DISCOVERY if heard.topics else 0.0)

        def over() -> bool:
            heard.look()
            since = heard.first
            return time.monotonic() >= (end if since is None else min(end, since + seconds))

        spin(node, stop, over)
        stop.leave()
        heard.close()
        node.destroy_node()
    if not heard.topics:
        raise AcceptanceError(
            f'nobody publishes {JOINT_STATE.type}, {IMU.type} or /robot_description: start the '
            'robot, and check that ROS_DOMAIN_ID and the network are the same on both sides'
        )
    return collector.evidence(urdf)


class Listener:
    """Subscribes to every topic that tells of the robot; `topics` are those by name with type.

    `first` is the monotonic time (s) of the first message of a topic that goes on; None: none yet.
    """

    def __init__(self, node: Node, collector: Collector) -> None:
        self._node, self._collector = node, collector
        self.topics: dict[str, str] = {}
        self.first: float | None = None

    def look(self) -> bool:
        """Subscribe to the topics that came up since; return whether there is any."""
        for name, types in self._node.get_topic_names_and_types():
            known = [kind for kind in types if is_wanted(name, kind)]
            if known and name not in self.topics and self._node.count_publishers(name):
                self.topics[name] = known[0]
                self._collector.topic(name, known[0])
                self._subscribe(name, known[0])
        return bool(self.topics)

    def _subscribe(self, name: str, kind: str) -> None:
        of, take = message_type(kind), self._taker(name)
        if of is None:
            package = kind.partition('/')[0]
            self._collector.doubts.append(
                f'{name} is not heard: the package {package} is not installed '
                f'(ros-jazzy-{package.replace("_", "-")})'
            )
            return
        self._node.create_subscription(of, name, take, _QOS[kind], raw=True)

    def close(self) -> None:
        """Note what was odd with the publishers."""
        for name, kind in self.topics.items():
            infos = self._node.get_publishers_info_by_topic(name)
            nodes = sorted({f'{i.node_namespace.rstrip("/")}/{i.node_name}' for i in infos})
            if len(nodes) > 1 and kind != TF:
                listed = ', '.join(nodes)
                self._collector.doubts.append(f'{name} has several publishers: {listed}')

    def _taker(self, name: str) -> Callable[[Any], None]:
        def take(data: Any) -> None:  # noqa: ANN401 - bytes, for it is raw
            if self.first is None and self.topics[name] not in (STRING, TF):
                self.first = time.monotonic()
            self._collector.take(time.time_ns(), name, data)

        return take
