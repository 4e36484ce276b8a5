"""A lossy relay as a process of its own: hears /sent/*, republishes each message on every lane.

The one argument is a seed; the lanes, lane_0 and so on, are those of LANES, whose losses they
have. It prints "ready" and runs until stdin ends.
"""

import heapq
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random
from threading import Thread
from typing import Any

import rclpy
from geometry_msgs.msg import InertiaStamped
from hardening.lossy import WAYS
from hardening.robot import say
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Imu, JointState

from ugv_acceptance.bag.raw import Offered
from ugv_acceptance.nodes.bag_player import qos_of
from ugv_acceptance.nodes.executor import end

# Way -> share lost, bursts a minute, their length (s), jitter (s). The first is the control.
LANES = {'nothing lost': (0.0, 0.0, 0.0, 0.0), **WAYS}
TOPICS: tuple[tuple[str, Any], ...] = (
    ('joint_states', JointState),
    ('imu/data', Imu),
    ('payload', InertiaStamped),
)
# Seconds between looks at what is held back.
STEP = 0.001


@dataclass
class Lane:
    """One way to lose messages; `held` are the delayed ones: (when due in s, number, send)."""

    way: tuple[float, float, float, float]
    rng: Random
    held: list[tuple[float, int, Callable[[], None]]] = field(default_factory=list)
    _burst: float = 0.0
    _next: float = field(init=False)
    _count: int = 0

    def __post_init__(self) -> None:
        self._next = self._pause(time.monotonic())

    def _pause(self, now: float) -> float:
        a_minute = self.way[1]
        return now + (self.rng.expovariate(a_minute / 60.0) if a_minute else 1e9)

    def take(self, send: Callable[[], None]) -> None:
        """Lose a message, hold it back, or pass it on."""
        share, _, length, jitter = self.way
        now = time.monotonic()
        if now >= self._next:
            self._burst, self._next = now + length, self._pause(now + length)
        if now < self._burst or self.rng.random() < share:
            return
        if jitter:
            self._count += 1
            heapq.heappush(self.held, (now + self.rng.random() * jitter, self._count, send))
        else:
            send()

    def release(self) -> None:
        """Send what was held back long enough."""
        now = time.monotonic()
        while self.held and self.held[0][0] <= now:
            heapq.heappop(self.held)[2]()


def as_offered(topic: str) -> QoSProfile:
    """Return the QoS of a topic, as the robot offers it."""
    return qos_of(Offered('reliable' if topic == 'payload' else 'best_effort'))


def relay(node: Node, lanes: list[Lane], topic: str, kind: Any) -> None:
    """Pass a topic on, on every lane."""
    places = [f'/lane_{k}/{topic}' for k in range(len(lanes))]
    publishers = [node.create_publisher(kind, place, as_offered(topic)) for place in places]

    def take(data: bytes) -> None:
        for lane, publisher in zip(lanes, publishers, strict=True):
            lane.take(lambda p=publisher: p.publish(data))  # type: ignore[misc]

    node.create_subscription(kind, f'/sent/{topic}', take, as_offered(topic), raw=True)


def main() -> None:
    """Relay until stdin ends."""
    rclpy.init()
    node = rclpy.create_node('relay')
    lanes = [Lane(way, Random(f'{sys.argv[1]} {name}')) for name, way in LANES.items()]
    for topic, kind in TOPICS:
        relay(node, lanes, topic, kind)

    def release() -> None:
        for lane in lanes:
            lane.release()

    node.create_timer(STEP, release)
    executor = EventsExecutor()
    executor.add_node(node)
    ended: list[str] = []
    Thread(target=lambda: ended.append(sys.stdin.read()), daemon=True).start()
    say('ready')
    while not ended:
        executor.spin_once(timeout_sec=0.1)
    end(node)
    rclpy.shutdown()


if __name__ == '__main__':
    main()
