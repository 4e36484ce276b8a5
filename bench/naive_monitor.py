"""The simplest possible monitor, for comparison: decoded messages, NumPy, publishing every time.

Torques by the paper's two-link equations, tilt left by Papadopoulos and Rey over four corners; no
alerts, no staleness, no payload, no checks. It stands beside the real one in bench_live.py.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64MultiArray

from ugv_acceptance.type_aliases import Floats

G = 9.81
LENGTH_1, LENGTH_2, LINK_MASS, LOAD = 0.55, 0.64, 2.5, 4.0
BODY_MASS, BODY_COG = 16.5, np.array([0.0, 0.0, 0.08])
SHOULDER = np.array([0.15, 0.0, 0.2])
CORNERS = np.array([[0.25, 0.2, 0], [-0.25, 0.2, 0], [-0.25, -0.2, 0], [0.25, -0.2, 0]])


def best_effort(depth: int) -> QoSProfile:
    """Return the QoS of sensor data with a queue of `depth`."""
    profile: Any = QoSProfile
    made: QoSProfile = profile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)
    return made


class NaiveMonitor(Node):
    """Computes and publishes on every message; `seen(stamp)` is called with its stamp (ns)."""

    def __init__(self, seen: Callable[[int], None], depth: int) -> None:
        super().__init__('naive_monitor')
        self.seen = seen
        self.gravity: Floats | None = None
        self.angles: dict[str, float] = {}
        qos = best_effort(depth)
        self.create_subscription(JointState, 'joint_states', self.on_joints, qos)
        self.create_subscription(Imu, 'imu/data', self.on_imu, qos)
        self.values = self.create_publisher(Float64MultiArray, 'naive/margins', 10)
        self.status = self.create_publisher(DiagnosticArray, 'naive/diagnostics', 10)

    def on_imu(self, message: Imu) -> None:
        """Take the attitude."""
        x, y, z, w = (getattr(message.orientation, k) for k in 'xyzw')
        up = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
        self.gravity = -G * up
        self.evaluate(message)

    def on_joints(self, message: JointState) -> None:
        """Take the posture."""
        self.angles = dict(zip(message.name, message.position, strict=True))
        self.evaluate(message)

    def evaluate(self, message: JointState | Imu) -> None:
        """Compute both margins and publish them."""
        if self.gravity is not None and self.angles:
            torque = np.array(self.torques())
            margins = np.concatenate((50.0 - np.abs(torque), self.tilt_left()))
            stamp = message.header.stamp
            self.seen(stamp.sec * 1_000_000_000 + stamp.nanosec)
            if isinstance(message, JointState):
                self.publish(margins)

    def torques(self) -> tuple[float, float]:
        """Return the paper's equations (1) and (2)."""
        one = self.angles['shoulder_joint']
        both = one + self.angles['elbow_joint']
        near, far = LENGTH_1 * math.cos(one), LENGTH_2 * math.cos(both)
        elbow = G * far * (LINK_MASS / 2 + LOAD)
        return elbow + G * near * (LINK_MASS / 2 + LINK_MASS + LOAD), elbow

    def tilt_left(self) -> Floats:
        """Return the force-angle (rad) about each edge."""
        one = self.angles['shoulder_joint']
        both = one + self.angles['elbow_joint']
        elbow = SHOULDER + LENGTH_1 * np.array([math.cos(one), 0, math.sin(one)])
        hand = elbow + LENGTH_2 * np.array([math.cos(both), 0, math.sin(both)])
        moment = BODY_MASS * BODY_COG + LOAD * hand
        moment = moment + LINK_MASS * ((SHOULDER + elbow) / 2 + (elbow + hand) / 2)
        cog = moment / (BODY_MASS + 2 * LINK_MASS + LOAD)
        found = []
        for start, end in zip(CORNERS, np.roll(CORNERS, -1, axis=0), strict=True):
            along = (end - start) / np.linalg.norm(end - start)
            arm = (np.eye(3) - np.outer(along, along)) @ (start - cog)
            force = (np.eye(3) - np.outer(along, along)) @ np.asarray(self.gravity)
            sine = along @ np.cross(arm, force)
            found.append(-math.atan2(sine, arm @ force))
        return np.array(found)

    def publish(self, margins: Floats) -> None:
        """Publish numbers and two statuses."""
        self.values.publish(Float64MultiArray(data=margins.tolist()))
        message = DiagnosticArray()
        message.header.stamp = self.get_clock().now().to_msg()
        for name, part in (('torque', margins[:2]), ('tip-over', margins[2:])):
            values = [KeyValue(key=str(k), value=str(v)) for k, v in enumerate(part)]
            level = DiagnosticStatus.OK if part.min() > 0 else DiagnosticStatus.ERROR
            message.status.append(DiagnosticStatus(level=level, name=name, values=values))
        self.status.publish(message)
