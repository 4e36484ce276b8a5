"""The Foxglove WebSocket: a real client speaks its protocol; what DDS brought is what it gets."""

import json
import socket
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from nodes.live_case import FOLDED, Driver, Live, joints
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from ugv_acceptance import AcceptanceError
from ugv_acceptance.bag.writer import definition_of
from ugv_acceptance.nodes.foxglove_bridge import Bridge

PROTOCOL = Subprotocol('foxglove.sdk.v1')


class Client:
    """A client that keeps what the server says."""

    def __init__(self, live: Live, socket_: ClientConnection) -> None:
        self.live, self.socket = live, socket_
        self.channels: dict[str, dict[str, Any]] = {}
        self.messages: list[tuple[int, bytes]] = []
        self.said: list[dict[str, Any]] = []

    def listen(self) -> None:
        """Take what has come."""
        try:
            while True:
                self._take(self.socket.recv(timeout=0.001))
        except (TimeoutError, ConnectionClosed):
            pass

    def _take(self, data: str | bytes) -> None:
        if isinstance(data, bytes):
            opcode, subscription, _ = struct.unpack_from('<BIQ', data)
            assert opcode == 1
            self.messages.append((subscription, data[13:]))
            return
        said = json.loads(data)
        self.said.append(said)
        if said['op'] == 'advertise':
            self.channels |= {channel['topic']: channel for channel in said['channels']}
        elif said['op'] == 'unadvertise':
            gone = set(said['channelIds'])
            self.channels = {t: c for t, c in self.channels.items() if c['id'] not in gone}

    def until(self, condition: Any, meanwhile: Any = lambda: None) -> None:
        """Spin the nodes and listen until it comes true."""

        def both() -> None:
            self.listen()
            meanwhile()

        self.live.until(condition, both)

    def say(self, op: str, **values: Any) -> None:
        """Send a request."""
        self.socket.send(json.dumps({'op': op, **values}))

    def subscribe(self, topic: str, number: int = 7) -> None:
        """Watch a topic."""
        self.until(lambda: topic in self.channels)
        channel = self.channels[topic]['id']
        self.say('subscribe', subscriptions=[{'id': number, 'channelId': channel}])

    def refused(self) -> list[str]:
        """Return what the server complained about."""
        return [s['message'] for s in self.said if s['op'] == 'status' and s['level'] == 2]


@pytest.fixture
def bridge(live: Live) -> Bridge:
    """Return a bridge on a free port."""
    node: Bridge = live.add(Bridge(0))
    return node


@contextmanager
def connected(live: Live, bridge: Bridge) -> Iterator[Client]:
    """Give a client of the bridge."""
    where = f'ws://127.0.0.1:{bridge.port}'
    with connect(where, subprotocols=[PROTOCOL], open_timeout=60) as found:
        yield Client(live, found)


def test_a_subscriber_gets_the_bytes_that_were_published(live: Live, bridge: Bridge) -> None:
    """Byte for byte the CDR that came over DDS, with the type's own text."""
    driver = live.driver()
    sent = joints(FOLDED, stamp=123_456_789)
    with connected(live, bridge) as client:
        client.subscribe('/joint_states')
        client.until(lambda: client.messages, lambda: driver.joints.publish(sent))
        channel = client.channels['/joint_states']
    assert set(client.messages) == {(7, sent)}
    assert channel['encoding'] == 'cdr'
    assert channel['schemaName'] == 'sensor_msgs/msg/JointState'
    assert channel['schemaEncoding'] == 'ros2msg'
    assert channel['schema'] == definition_of('sensor_msgs/msg/JointState')[0]


def test_the_monitor_can_be_watched(live: Live, bridge: Bridge) -> None:
    """Its margins come as it publishes them, and its latched verdict to who comes late."""
    _, driver = live.running()
    with connected(live, bridge) as client:
        client.subscribe('/acceptance_monitor/verdict', 1)
        client.subscribe('/acceptance_monitor/stability', 2)
        client.until(lambda: {n for n, _ in client.messages} == {1, 2}, driver.send)
    stability = next(data for number, data in client.messages if number == 2)
    assert list(deserialize_message(stability, JointState).name) == [
        'tilt_front', 'tilt_left', 'tilt_rear', 'tilt_right'
    ]  # fmt: skip


def test_a_topic_is_subscribed_only_while_it_is_watched(live: Live, bridge: Bridge) -> None:
    """A topic that nobody watches is not subscribed."""
    driver = live.driver()
    with connected(live, bridge) as client:
        client.subscribe('/joint_states')
        client.until(lambda: driver.joints.get_subscription_count() == 1)
        client.say('unsubscribe', subscriptionIds=[7])
        client.until(lambda: driver.joints.get_subscription_count() == 0)
        client.subscribe('/joint_states', 8)
        client.until(lambda: driver.joints.get_subscription_count() == 1)
    live.until(lambda: driver.joints.get_subscription_count() == 0)


def test_a_topic_that_is_gone_is_not_offered(live: Live, bridge: Bridge) -> None:
    """A topic no longer published is not offered, until it is published again."""
    talker: Node = live.add(Node('talker'))
    first = talker.create_publisher(String, 'words', 1)
    with connected(live, bridge) as client:
        client.until(lambda: '/words' in client.channels)
        talker.destroy_publisher(first)
        client.until(lambda: '/words' not in client.channels)
        again = talker.create_publisher(String, 'words', 1)
        client.subscribe('/words')
        client.until(lambda: client.messages, lambda: again.publish(String(data='hello')))


def test_a_client_cannot_publish(live: Live, bridge: Bridge) -> None:
    """A client cannot publish, with or without advertising; the robot receives nothing."""
    live.alone()
    heard: list[JointState] = []
    robot: Node = live.add(Node('robot'))
    robot.create_subscription(JointState, 'joint_states', heard.append, 10)
    kind = 'sensor_msgs/msg/JointState'
    with connected(live, bridge) as client:
        topic = {'id': 1, 'topic': '/joint_states', 'encoding': 'cdr', 'schemaName': kind}
        client.say('advertise', channels=[topic])
        client.until(client.refused)
        client.socket.send(struct.pack('<BI', 1, 1) + joints())
        client.until(lambda: len(client.refused()) >= 2 or _closed(client))
    live.spin(0.5)
    assert not heard
    assert robot.count_publishers('joint_states') == 0


def _closed(client: Client) -> bool:
    return client.socket.state.name != 'OPEN'


def test_a_client_cannot_set_parameters_or_call_services(live: Live, bridge: Bridge) -> None:
    """A client's parameters and service calls are refused, and the monitor is unchanged."""
    monitor, driver = live.running(limits__tip_warn_deg=11.0)
    assert isinstance(driver, Driver)
    with connected(live, bridge) as client:
        name = '/acceptance_monitor.limits.tip_warn_deg'
        client.say('setParameters', id='1', parameters=[{'name': name, 'value': 0.0}])
        client.until(lambda: len(client.refused()) >= 1, driver.send)
        client.say('getParameters', id='2', parameterNames=[])
        client.until(lambda: len(client.refused()) >= 2, driver.send)
        client.socket.send(struct.pack('<BIII', 2, 1, 1, 3) + b'cdr')
        client.until(
            lambda: (
                len(client.refused()) >= 3
                or any(s['op'] == 'serviceCallFailure' for s in client.said)
            ),
            driver.send,
        )
        info = next(s for s in client.said if s['op'] == 'serverInfo')
    assert info['capabilities'] == []
    assert not any(s['op'] in {'advertiseServices', 'parameterValues'} for s in client.said)
    assert monitor.get_parameter('limits.tip_warn_deg').value == 11.0
    assert live.call(Trigger, '/acceptance_monitor/acknowledge').success


def test_only_this_machine_is_heard(bridge: Bridge) -> None:
    """It listens on 127.0.0.1 alone: another address of the same machine is refused."""
    socket.create_connection(('127.0.0.1', bridge.port), 60.0).close()
    with pytest.raises(OSError, match='refused'):
        socket.create_connection(('127.0.0.2', bridge.port), 60.0)


def test_a_port_that_is_taken_is_one_line(bridge: Bridge) -> None:
    """A port in use is refused with one line that names it."""
    with pytest.raises(AcceptanceError, match=str(bridge.port)):
        Bridge(bridge.port)
