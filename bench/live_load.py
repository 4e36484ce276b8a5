"""Publishes JointStates and Imus at two rates for some seconds; started by bench_live.py.

With `moving` the joints swing by half a degree, told in steps of an encoder, and the IMU's numbers
have noise; else every message is the same but for its stamp.
"""

import json
import math
import random
import struct
import sys
import time
from dataclasses import dataclass

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.publisher import Publisher
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64MultiArray

from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.raw import Offered
from ugv_acceptance.nodes.bag_player import qos_of
from ugv_acceptance.nodes.executor import end

NAMES = (
    'turret_joint',
    'shoulder_joint',
    'elbow_joint',
    'flipper_joint',
    'left_wheel',
    'right_wheel',
)
POSTURE = (0.1, 0.9, -0.4, 0.0, 1.0, 2.0)
# Step of a position (rad).
ENCODER = math.tau / 16384
STAMP = struct.Struct('<iI')
# What the monitors publish, so that each has somebody who listens.
OUTPUTS = (
    (JointState, 'acceptance_monitor/static_torque'),
    (JointState, 'acceptance_monitor/torque_margin'),
    (JointState, 'acceptance_monitor/stability'),
    (DiagnosticArray, '/diagnostics'),
    (Float64MultiArray, 'naive/margins'),
    (DiagnosticArray, 'naive/diagnostics'),
)


@dataclass
class Stream:
    """One topic at one rate; `due` is when the next message goes out (ns since the start)."""

    publisher: Publisher
    messages: list[bytearray]
    period: float
    due: float = 0.0
    sent: int = 0

    def publish_until(self, elapsed: float) -> None:
        """Publish what is due, stamped with the time of publishing."""
        while self.due <= elapsed:
            data, stamp = self.messages[self.sent % len(self.messages)], time.time_ns()
            STAMP.pack_into(data, 4, stamp // 1_000_000_000, stamp % 1_000_000_000)
            self.publisher.publish(bytes(data))
            self.due += self.period
            self.sent += 1


def joint_messages(rate: float, *, moving: bool) -> list[bytearray]:
    """Return joint states of two seconds: of joints that swing, or one message."""
    found = []
    for k in range(round(2 * rate) if moving else 1):
        swing = 0.01 * math.sin(math.pi * k / rate)
        q = [round((p + swing) / ENCODER) * ENCODER for p in POSTURE] if moving else POSTURE
        found.append(bytearray(joint_state_cdr(0, 'base_link', NAMES, q, [0.0] * 6, [1.0] * 6)))
    return found


def imu_messages(rate: float, *, moving: bool) -> list[bytearray]:
    """Return IMU messages of two seconds, with noise, or one message."""
    noise, found = random.Random(1), []
    for _ in range(round(2 * rate) if moving else 1):
        x, y, *w = (noise.gauss(0.0, 2e-3) if moving else 0.0 for _ in range(5))
        a = [f + (noise.gauss(0.0, 0.05) if moving else 0.0) for f in (-0.2, 0.39, 9.8)]
        q = (0.02 + x / 20, 0.01 + y / 20, 0, 0.99975)
        found.append(bytearray(imu_cdr(0, 'imu_link', q, (w[0], w[1], w[2]), (a[0], a[1], a[2]))))
    return found


def main() -> None:
    """Publish `seconds` at (joint rate, imu rate) Hz; print how many of each as JSON."""
    joint_rate, imu_rate, seconds = (float(word) for word in sys.argv[1:4])
    moving = 'moving' in sys.argv[4:]
    rclpy.init()
    node = rclpy.create_node('load')
    qos = qos_of(Offered())
    for kind, topic in OUTPUTS:
        node.create_subscription(kind, topic, lambda _: None, 10, raw=True)
    joints = joint_messages(joint_rate, moving=moving)
    imu = imu_messages(imu_rate, moving=moving)
    streams = [
        Stream(node.create_publisher(JointState, 'joint_states', qos), joints, 1e9 / joint_rate),
        Stream(node.create_publisher(Imu, 'imu/data', qos), imu, 1e9 / imu_rate),
    ]
    while not all(stream.publisher.get_subscription_count() for stream in streams):
        time.sleep(0.05)
    time.sleep(1.0)
    start = time.monotonic_ns()
    end_at = int(seconds * 1e9)
    while (elapsed := time.monotonic_ns() - start) < end_at:
        for stream in streams:
            stream.publish_until(elapsed)
        wait = min(stream.due for stream in streams) - (time.monotonic_ns() - start)
        if wait > 20_000:
            time.sleep((wait - 10_000) * 1e-9)
    time.sleep(0.5)
    print(json.dumps([stream.sent for stream in streams]), flush=True)
    time.sleep(1.0)
    end(node)
    rclpy.shutdown()


main()
