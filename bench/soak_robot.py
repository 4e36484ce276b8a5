"""The robot of bench_soak.py: 200 Hz joint states and 400 Hz IMU from messages made beforehand.

Its argument is a file of int64: messages sent of each input, which it counts up, and by how much
(ns) it was late to send one at most since that was last set to 0. On stdin it takes the name of
what it does from then on: a key of DOINGS.
"""

import math
import mmap
import struct
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import InertiaStamped
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from ugv_acceptance.bag.encode import imu_cdr, inertia_cdr, joint_state_cdr, string_message
from ugv_acceptance.bag.raw import Offered
from ugv_acceptance.nodes.bag_player import qos_of
from ugv_acceptance.nodes.executor import end, ros

NS = 1_000_000_000
JOINTS_HZ, IMU_HZ = 200, 400
# The file's size, and where the largest delay stands in it.
SIZE, LATE = 32, 24
NAMES = ('turret_joint', 'shoulder_joint', 'elbow_joint', 'flipper_joint')
# Folded; stretched out, which with LOAD (kg) in the hand is too much for the shoulder.
CALM, REACH, LOAD = np.array((0.0, 2.0, -2.5, 2.0)), np.array((0.0, 0.0, 0.0, 2.0)), 2.2
# Seconds of a swing: out (slow enough for the static model), there, back, and at rest.
OUT, THERE, BACK, REST = 9.0, 4.0, 9.0, 8.0
STAMP = struct.Struct('<iI')
URDF = Path(__file__).resolve().parents[1] / 'urdf' / 'packbot.urdf'
Messages = list[bytearray]


def swing() -> Iterator[tuple[Any, Any]]:
    """Give positions and speeds of the joints through a swing, smooth at both ends of a move."""
    for seconds, start, stop in (
        (OUT, CALM, REACH),
        (THERE, REACH, REACH),
        (BACK, REACH, CALM),
        (REST, CALM, CALM),
    ):
        for s in np.arange(0.0, 1.0, 1.0 / (seconds * JOINTS_HZ)):
            way = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
            rate = 30.0 * s * s * (1.0 - s) ** 2 / seconds
            yield start + way * (stop - start), rate * (stop - start)


def at_rest(q: Any, names: tuple[str, ...] = NAMES) -> Messages:  # noqa: ANN401 - an array
    """Return a second of joint states that tell the same posture with an encoder's noise."""
    rng = np.random.default_rng(1)
    noise = rng.normal(0.0, 1e-5, (JOINTS_HZ, len(names)))
    return [
        bytearray(
            joint_state_cdr(0, 'base_link', names, (q[: len(names)] + e).tolist(), e.tolist())
        )
        for e in noise
    ]


def swinging() -> Messages:
    """Return the joint states of a swing."""
    return [
        bytearray(joint_state_cdr(0, 'base_link', NAMES, q.tolist(), v.tolist()))
        for q, v in swing()
    ]


# What the robot does -> its joint states; empty: none.
DOINGS: dict[str, Callable[[], Messages]] = {
    'calm': lambda: at_rest(CALM),
    'swing': swinging,
    'overload': lambda: at_rest(REACH),
    'half': lambda: at_rest(CALM, NAMES[:2]),
    'nan': lambda: at_rest(np.array((math.nan, *CALM[1:]))),
    'garbage': lambda: [data[:-9] for data in at_rest(CALM)],
    'silent joints': list,
    'silent imu': lambda: at_rest(CALM),
    'mute': list,
}


def imus() -> Messages:
    """Return five seconds of a noisy IMU on a robot that stands still and leans a little."""
    rng = np.random.default_rng(2)
    rates, forces = rng.normal(0.0, 1e-3, (2000, 3)), rng.normal(0.0, 1e-2, (2000, 3))
    up = np.array((-0.196, 0.392, 9.8))
    return [
        bytearray(imu_cdr(0, 'imu_link', (0.02, 0.01, 0.0, 0.99975), w.tolist(), (up + f).tolist()))
        for w, f in zip(rates, forces, strict=True)
    ]


@dataclass(slots=True)
class Stream:
    """One input: what it publishes in a round, every `period` (ns); `sent` is counted at `at`."""

    publish: Callable[[bytes], None]
    messages: Messages
    period: int
    count: mmap.mmap
    at: int
    due: int = 0
    index: int = 0

    def publish_until(self, elapsed: int) -> None:
        """Publish what is due, stamped with the time of publishing."""
        while self.due <= elapsed:
            self.due += self.period
            if not self.messages:
                continue
            data = self.messages[self.index % len(self.messages)]
            self.index += 1
            STAMP.pack_into(data, 4, *divmod(time.time_ns(), NS))
            self.publish(bytes(data))
            sent = int.from_bytes(self.count[self.at : self.at + 8], 'little') + 1
            self.count[self.at : self.at + 8] = sent.to_bytes(8, 'little')


def publish_all(
    streams: list[Stream], made: dict[str, Messages], imu: Messages, count: mmap.mmap
) -> None:
    """Publish as stdin says until it ends."""
    told = ['calm']
    Thread(
        target=lambda: told.extend(chain(map(str.strip, sys.stdin), ('end',))), daemon=True
    ).start()
    start, doing = time.monotonic_ns(), ''
    while told[-1] != 'end':
        if told[-1] != doing:
            doing = told[-1]
            streams[0].messages, streams[0].index = made[doing], 0
            streams[1].messages = [] if doing in ('silent imu', 'mute') else imu
        elapsed = time.monotonic_ns() - start
        behind = elapsed - min(stream.due for stream in streams)
        if behind > int.from_bytes(count[LATE : LATE + 8], 'little'):
            count[LATE : LATE + 8] = behind.to_bytes(8, 'little')
        for stream in streams:
            stream.publish_until(elapsed)
        wait = min(stream.due for stream in streams) - (time.monotonic_ns() - start)
        if wait > 0:
            time.sleep(wait * 1e-9)


def main() -> None:
    """Wait until the monitor hears both inputs, then publish."""
    made, imu = {name: make() for name, make in DOINGS.items()}, imus()
    load = bytearray(inertia_cdr(0, 'gripper_link', LOAD, (0.0,) * 3))
    with Path(sys.argv[1]).open('r+b') as file, ros():
        count = mmap.mmap(file.fileno(), SIZE)
        node = rclpy.create_node('robot')
        quick = qos_of(Offered('reliable'))
        joints = node.create_publisher(JointState, 'joint_states', quick)
        attitude = node.create_publisher(Imu, 'imu/data', quick)
        held = node.create_publisher(InertiaStamped, 'payload', 10)
        profile: Any = QoSProfile
        latched = profile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        own = node.create_publisher(String, 'robot_description', latched)
        own.publish(string_message(URDF.read_text(encoding='utf-8')))
        while not (joints.get_subscription_count() and attitude.get_subscription_count()):
            time.sleep(0.05)
        time.sleep(1.0)
        streams = [
            Stream(joints.publish, [], NS // JOINTS_HZ, count, 0),
            Stream(attitude.publish, [], NS // IMU_HZ, count, 8),
            Stream(held.publish, [load], NS, count, 16),
        ]
        publish_all(streams, made, imu, count)
        end(node)


if __name__ == '__main__':
    main()
