"""Who moves the robot and sets it up: a simulator, an arm controller, or a person. One table."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from geometry_msgs.msg import Inertia, InertiaStamped, Twist, Vector3
from rclpy.qos import QoSProfile
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from ugv_acceptance.nodes.guard import Guard
from ugv_acceptance.plan.plan import Step
from ugv_acceptance.studies.orientations import ORIENTATIONS

SIM, ROBOT, OPERATOR = 'sim', 'robot', 'operator'
SIMULATOR = 'packbot_simulator'
# Peak rate (rad/s) at which the simulated ground tilts; seconds to come to rest after it.
TILT_RATE, REST = 0.6, 0.8
# Seconds between two drive commands.
DRIVE_PERIOD = 0.1

Ask = Callable[[str], None]
Wait = Callable[[float], None]


@dataclass(slots=True)
class Hands:
    """Moves and sets up the robot in one of the modes sim, robot, operator.

    `ask` shows a person what to do and returns when it is done; `wait` lets seconds pass.
    """

    guard: Guard
    mode: str
    ask: Ask
    wait: Wait = time.sleep

    def __post_init__(self) -> None:
        guard = self.guard
        self._payload = guard.create_publisher(
            InertiaStamped, guard.config.topics.payload.name, QoSProfile(depth=10)
        )
        self._ground = guard.create_publisher(Vector3, f'{SIMULATOR}/ground', 10)
        self._load = guard.create_publisher(Inertia, f'{SIMULATOR}/load', 10)
        self._reset = guard.create_client(Trigger, f'{SIMULATOR}/reset')
        self._tilt = 0.0

    _payload: Any = None
    _ground: Any = None
    _load: Any = None
    _reset: Any = None
    _tilt: float = 0.0

    def set_up(self, step: Step) -> None:
        """Bring ground and load to what a step needs, and declare the load."""
        if self.mode == SIM:
            heading = ORIENTATIONS[step.ground.orientation].heading
            tilt = math.radians(step.ground.tilt_deg)
            # Back to level first: the direction of a slope cannot turn under the robot.
            for target, towards in ((0.0, 0.0), (tilt, heading or 0.0)):
                way = abs(target - self._tilt)
                if way > 0.0:
                    self._ground.publish(Vector3(x=target, y=towards, z=TILT_RATE))
                    self.wait(way * math.pi / (2.0 * TILT_RATE) + 0.2)
                self._tilt = target
            self._load.publish(self._inertia(step.payload_kg))
            self.wait(REST)
        else:
            self.ask(f'{step.id}: set up: {"; ".join(step.preparation)}')
        self.declare(step.payload_kg)

    def declare(self, mass: float) -> None:
        """Tell the monitor what is carried (kg)."""
        message = InertiaStamped(inertia=self._inertia(mass))
        message.header.frame_id = self.guard.config.topics.payload.frame_id or ''
        message.header.stamp = self.guard.get_clock().now().to_msg()
        self._payload.publish(message)

    def _inertia(self, mass: float) -> Inertia:
        message = Inertia(m=float(mass))
        message.com.x, message.com.y, message.com.z = self.guard.config.settings.robot.payload.cog
        return message

    def move(self, posture: Mapping[str, float], speed: float, step: Step | None = None) -> float:
        """Start a motion to `posture` (rad) at a peak `speed` (rad/s); return its length (s).

        In mode operator a person is told what to do and the time is unknown: infinite.
        """
        if self.mode == OPERATOR:
            told = ', '.join(f'{n} {math.degrees(a):.0f} deg' for n, a in posture.items())
            self.ask(f'{step.id if step else "home"}: bring the arm to {told} and hold it')
            return math.inf
        now = self.guard.position
        way = max((abs(a - now.get(n, a)) for n, a in posture.items()), default=0.0)
        seconds = max(way * math.pi / (2.0 * speed), 0.05)
        inputs = zip(
            self.guard.config.settings.robot.joint_names,
            self.guard.config.settings.joints,
            strict=True,
        )
        by_name = dict(inputs)
        message = JointTrajectory(joint_names=[by_name[n].topic_name for n in posture])
        positions = [(a - by_name[n].offset) / by_name[n].sign for n, a in posture.items()]
        point = JointTrajectoryPoint(positions=positions)
        point.time_from_start.sec = int(seconds)
        point.time_from_start.nanosec = int((seconds % 1.0) * 1e9)
        message.points = [point]
        self.guard.trajectory.publish(message)
        return seconds

    def drive(self, forward: float, yaw: float, seconds: float, going: Callable[[], bool]) -> None:
        """Drive at m/s and rad/s while `going()`, at most `seconds`, then stand still."""
        end = time.monotonic() + seconds
        message = Twist()
        message.linear.x, message.angular.z = forward, yaw
        while time.monotonic() < end and going():
            self.guard.velocity.publish(message)
            self.wait(DRIVE_PERIOD)
        self.guard.velocity.publish(Twist())

    def stand_up(self) -> None:
        """Bring a robot that tipped over, or whose arm gave way, back to its start."""
        if self.mode != SIM:
            self.ask('stand the robot on its tracks on level ground, arm folded')
            return
        if self._reset.wait_for_service(5.0):
            future = self._reset.call_async(Trigger.Request())
            end = time.monotonic() + 5.0
            while not future.done() and time.monotonic() < end:
                self.wait(0.05)
        self._tilt = 0.0
        self.declare(0.0)
        self.wait(REST)
