"""Node `bag_player`: publishes a recording with its timing and QoS.

Header stamps are moved to the time of replay (replay_stamps.py), so that a monitor does not report
a wrong clock; without `restamp` they stay as recorded.
"""

import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock

from ugv_acceptance import AcceptanceError, BadBag, BadConfig
from ugv_acceptance.bag.raw import Logged, Offered, messages, offered
from ugv_acceptance.bag.reader import Bag, open_bag
from ugv_acceptance.nodes import parameter_types
from ugv_acceptance.nodes.executor import BAD_INPUT, Stop, ros
from ugv_acceptance.nodes.monitor.parameters import described
from ugv_acceptance.nodes.replay_stamps import NS, Stamped, Stamps, stamped

# Seconds to wait for subscribers at the start: discovery takes one to three.
DISCOVERY = 5.0
# Seconds until a matched subscriber has matched us too, and until it has the last messages.
SETTLING = 0.7
CLOCK = '/clock'
# A monitor's words for gates of motion: the last part of the topic's name, and the type.
_PERMISSIONS = {
    ('ok', 'std_msgs/msg/Bool'),
    ('check_result', 'diagnostic_msgs/msg/DiagnosticStatus'),
}
# Seconds between two messages on it.
_CLOCK_STEP = 0.01


@dataclass(frozen=True, slots=True)
class Play:
    """The options of a replay; with no `topics`, all that can be published are."""

    bag: Path
    rate: float = 1.0
    loop: bool = False
    topics: tuple[str, ...] = ()
    clock: bool = False
    restamp: bool = True


@dataclass(slots=True)
class Player:
    """Publishes a recording on a node. `published` counts; `skipped` names topics and reasons."""

    node: Node
    play: Play
    bag: Bag = field(init=False)
    publishers: dict[str, Publisher] = field(default_factory=dict)
    skipped: dict[str, str] = field(default_factory=dict)
    published: int = 0
    _stamped: dict[str, Stamped] = field(default_factory=dict)
    _leaders: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        if not self.play.rate > 0:
            raise BadConfig(f'rate: expected a number above 0, got {self.play.rate}')
        self.bag = open_bag(self.play.bag)
        unknown = sorted(set(self.play.topics) - set(self.bag.topics))
        if unknown:
            held = ', '.join(self.bag.topics)
            raise BadBag(f'{self.play.bag}: expected topic {unknown[0]}; the bag holds: {held}')
        profiles = offered(self.bag)
        for name, topic in self.bag.topics.items():
            if not self.play.topics or name in self.play.topics:
                self._offer(name, topic.type, profiles.get(name, Offered()))
        if not self.publishers:
            raise BadBag(f'{self.play.bag}: expected a topic that can be published: {self.skipped}')
        # A message published once, such as a map, has an old stamp and shows no clock.
        self._leaders = frozenset(
            name
            for name in self.publishers
            if self.bag.topics[name].count > 1
            and profiles.get(name, Offered()).durability == 'volatile'
        )

    def _offer(self, name: str, type_: str, offer: Offered) -> None:
        kind = message_type(type_)
        if kind is None:
            self.skipped[name] = f'type {type_ or "unknown"} is not installed'
            return
        if self.play.restamp and name == CLOCK and CLOCK not in self.play.topics:
            self.skipped[name] = 'header stamps tell the time of replay (see --no-restamp)'
            return
        last = name.rpartition('/')[2]
        if (last, type_) in _PERMISSIONS and name not in self.play.topics:
            self.skipped[name] = 'a gate of motion would take it for the live robot (see --topics)'
            return
        # Relative, so that a namespace and remaps work.
        self.publishers[name] = self.node.create_publisher(kind, name.lstrip('/'), qos_of(offer))
        if self.play.restamp:
            self._stamped[name] = stamped(kind)

    def wait_for_subscribers(self, stop: Stop, seconds: float = DISCOVERY) -> None:
        """Wait until every topic has a subscriber, but not longer than `seconds`."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and not stop.asked:
            if all(p.get_subscription_count() for p in self.publishers.values()):
                break
            time.sleep(0.05)
        time.sleep(SETTLING)

    def run(self, stop: Stop, progress: Callable[[float], None] = lambda _: None) -> None:
        """Play to the end, or for ever with `loop`; `progress` is called with the position (s)."""
        clock = self.node.create_publisher(Clock, CLOCK, 10) if self.play.clock else None
        while not stop.asked:
            self._once(stop, clock, progress)
            if not self.play.loop:
                break
        time.sleep(SETTLING)  # best effort drops what is on its way when a publisher goes

    def _once(self, stop: Stop, clock: Publisher | None, progress: Callable[[float], None]) -> None:
        first, began = self.bag.start_ns, time.monotonic_ns()
        stamps = Stamps(first, time.time_ns(), self.play.rate, self._leaders)
        told = clocked = 0.0
        for message in messages(self.bag, self.publishers):
            elapsed = message.log_time - first
            due = began + int(elapsed / self.play.rate)
            while (wait := due - time.monotonic_ns()) > 0 and not stop.asked:
                time.sleep(min(wait * 1e-9, 0.1))
            if stop.asked:
                return
            seconds = elapsed * 1e-9
            if clock is not None and seconds >= clocked:
                clock.publish(_clock_at(message.log_time))
                clocked = seconds + _CLOCK_STEP
            self._publish(message, stamps)
            if seconds >= told:
                progress(seconds)
                told = seconds + 0.1 * self.play.rate
        progress(self.bag.duration_s)

    def _publish(self, message: Logged, stamps: Stamps) -> None:
        topic, data = message.topic, message.data
        if topic in self._stamped:
            data = self._stamped[topic].moved(data, topic, message.log_time, stamps)
        self.publishers[topic].publish(data)
        self.published += 1


def player_of(play: Play) -> Player:
    """Return a player on a node of its own; rclpy must be initialised."""
    return Player(Node('bag_player'), play)


def message_type(name: str) -> Any:  # noqa: ANN401 - a message class
    """Return the Python class of a type such as sensor_msgs/msg/Imu; None if not installed."""
    package, _, kind = name.partition('/msg/')
    try:
        return getattr(import_module(f'{package}.msg'), kind)
    except (ImportError, AttributeError, ValueError):
        return None


def qos_of(offer: Offered) -> QoSProfile:
    """Return the QoS that a recorded publisher offered, with a queue for the replay."""
    reliable, latched = offer.reliability == 'reliable', offer.durability == 'transient_local'
    return QoSProfile(
        depth=1000,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def _clock_at(now: int) -> Clock:
    message = Clock()
    message.clock.sec, message.clock.nanosec = divmod(now, NS)
    return message


def play_from(node: Node) -> Play:
    """Return the options of a replay from the parameters of a node."""
    declare = partial(parameter_types.declare, node)
    declare('bag', '', described('recording: a rosbag2 folder or one file'))
    declare('rate', 1.0, described('speed, as a multiple of real time', 0.001, 1000.0))
    declare('loop', False, described('start again at the end'))
    declare('topics', [''], described('topics to play; empty: all'))
    declare('clock', False, described('publish the time of the recording on /clock'))
    what = described('move header stamps to the time of replay; by default unless clock')
    if node.get_parameter('clock').value:
        declare('restamp', False, what)
    else:
        declare('restamp', True, what)
    names = ('bag', 'rate', 'loop', 'topics', 'clock', 'restamp')
    bag, rate, loop, topics, clock, restamp = (node.get_parameter(n).value for n in names)
    if not bag:
        raise BadConfig('parameter bag: expected the path of a recording, got none')
    return Play(Path(bag), rate, loop, tuple(filter(None, topics)), clock, restamp)


def main(args: Iterable[str] | None = None) -> None:
    """Play as the parameters say until the end or an interrupt; exit code 2 for bad input."""
    try:
        with ros(None if args is None else list(args)) as stop:
            node = Node('bag_player')
            player = Player(node, play_from(node))
            for topic, reason in player.skipped.items():
                node.get_logger().warning(f'{topic} is not played: {reason}')
            player.wait_for_subscribers(stop)
            player.run(stop)
            node.get_logger().info(f'{player.published} messages published')
            node.destroy_node()
    except AcceptanceError as error:
        sys.stderr.write(f'ugv-acceptance: {error}\n')
        sys.exit(BAD_INPUT)
