"""Publishes JointStates and Imus at two rates for some seconds; started by bench_live.py."""

import json
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
    data: bytearray
    period: float
    due: float = 0.0
    sent: int = 0

    def publish_until(self, elapsed: float) -> None:
        """Publish what is due, stamped with the time of publishing."""
        while self.due <= elapsed:
            stamp = time.time_ns()
            STAMP.pack_into(self.data, 4, stamp // 1_000_000_000, stamp % 1_000_000_000)
            self.publisher.publish(bytes(self.data))
            self.due += self.period
            self.sent += 1


def main() -> None:
    """Publish `seconds` at (joint rate, imu rate) Hz; print how many of each as JSON."""
    joint_rate, imu_rate, seconds = (float(word) for word in sys.argv[1:4])
    rclpy.init()
    node = rclpy.create_node('load')
    qos = qos_of(Offered())
    for kind, topic in OUTPUTS:
        node.create_subscription(kind, topic, lambda _: None, 10, raw=True)
    position = [0.1, 0.9, -0.4, 0.0, 1.0, 2.0]
    joints = bytearray(joint_state_cdr(0, 'base_link', NAMES, position, [0.0] * 6, [1.0] * 6))
    imu = bytearray(imu_cdr(0, 'imu_link', (0.02, 0.01, 0, 0.99975), (0, 0, 0), (-0.2, 0.39, 9.8)))
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
