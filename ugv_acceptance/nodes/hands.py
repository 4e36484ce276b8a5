"""Commands to a robot, and to the test ground of a simulated one, as messages."""

import time
from collections.abc import Mapping
from typing import Any

from geometry_msgs.msg import Inertia, InertiaStamped, Twist, Vector3
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from ugv_acceptance.config import Config
from ugv_acceptance.plan.motions import HITCH
from ugv_acceptance.run.hands import OPERATOR, SIM

SIMULATOR = 'packbot_simulator'
# Seconds in which a simulator answers, on a busy machine too.
PATIENCE = 30.0


class RosCommands:
    """The commands of `run.world.Commands` sent by a node, joints counted as its driver does."""

    def __init__(self, node: Node, config: Config) -> None:
        self._node, self._config = node, config
        publish = node.create_publisher
        self._trajectory = publish(JointTrajectory, 'arm_controller/joint_trajectory', 10)
        self._velocity = publish(Twist, 'cmd_vel', 10)
        self._payload = publish(InertiaStamped, config.topics.payload.name, QoSProfile(depth=10))
        self._ground = publish(Vector3, f'{SIMULATOR}/ground', 10)
        self._pull = publish(Vector3, f'{SIMULATOR}/pull', 10)
        self._load = publish(Inertia, f'{SIMULATOR}/load', 10)
        self._reset: Any = node.create_client(Trigger, f'{SIMULATOR}/reset')

    def unheard(self, mode: str) -> str:
        """Return a topic that nobody listens to yet though a run of this mode needs it; or empty.

        A command that is sent before its topic is matched is lost, and nobody is told.
        """
        needed = [self._payload]
        if mode != OPERATOR:
            needed.append(self._trajectory)
        if mode == SIM:
            needed += [self._velocity, self._ground, self._pull, self._load]
        alone = [p.topic_name for p in needed if not p.get_subscription_count()]
        if mode == SIM and not self._reset.service_is_ready():
            alone.append(self._reset.srv_name)
        return alone[0] if alone else ''

    def move(self, posture: Mapping[str, float], seconds: float) -> None:
        """Start a motion to `posture` (rad) that takes `seconds`."""
        settings = self._config.settings
        joints = dict(zip(settings.robot.joint_names, settings.joints, strict=True))
        message = JointTrajectory(joint_names=[joints[n].topic_name for n in posture])
        positions = [(a - joints[n].offset) / joints[n].sign for n, a in posture.items()]
        point = JointTrajectoryPoint(positions=positions)
        point.time_from_start.sec = int(seconds)
        point.time_from_start.nanosec = int((seconds % 1.0) * 1e9)
        message.points = [point]
        self._trajectory.publish(message)

    def freeze(self) -> None:
        """Hold arm and tracks still: an empty trajectory, no speed."""
        self._trajectory.publish(JointTrajectory())
        self._velocity.publish(Twist())

    def drive(self, forward: float, yaw: float) -> None:
        """Drive at m/s and rad/s."""
        message = Twist()
        message.linear.x, message.angular.z = forward, yaw
        self._velocity.publish(message)

    def declare(self, mass: float) -> None:
        """Tell the monitor what is carried (kg)."""
        message = InertiaStamped(inertia=self._inertia(mass))
        message.header.frame_id = self._config.topics.payload.frame_id or ''
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._payload.publish(message)

    def tilt(self, tilt: float, heading: float, rate: float) -> None:
        """Tilt the ground: rad, down towards `heading` (rad), at a peak `rate` (rad/s)."""
        self._ground.publish(Vector3(x=tilt, y=heading, z=rate))

    def load(self, mass: float) -> None:
        """Put a load (kg) into the simulated hand."""
        self._load.publish(self._inertia(mass))

    def pull(self, force: float) -> None:
        """Pull the simulated robot backwards at its hitch (N)."""
        self._pull.publish(Vector3(x=force, z=HITCH))

    def stand_up(self) -> None:
        """Put the simulated robot back to its start, and wait until it is."""
        if self._reset.wait_for_service(PATIENCE):
            future, end = self._reset.call_async(Trigger.Request()), time.monotonic() + PATIENCE
            while not future.done() and time.monotonic() < end:
                time.sleep(0.01)

    def _inertia(self, mass: float) -> Inertia:
        message = Inertia(m=float(mass))
        message.com.x, message.com.y, message.com.z = self._config.settings.robot.payload.cog
        return message
