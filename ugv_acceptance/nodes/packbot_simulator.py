"""Node `packbot_simulator`: a simulated robot with the topics of a real one.

Parameter `config` says which: PackBot, or any robot on wheels or tracks, with an arm or without.
It publishes joint_states, imu/data and robot_description (and /clock when asked) and obeys
cmd_vel and arm_controller/joint_trajectory. What a person does on a test ground has topics of its
own: ~/ground tilts the ground, ~/load puts a load into the gripper, ~/pull pulls it backwards (x:
N, z: height in m), ~/reset stands it up again. At the start and after a reset its gripper holds the
load that the configuration declares, because a monitor assumes that one.
"""

import math
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from geometry_msgs.msg import Inertia, Twist, Vector3
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from ugv_acceptance import BadSample
from ugv_acceptance.bag.told_robot import description_message
from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.nodes import parameter_types
from ugv_acceptance.nodes.executor import run
from ugv_acceptance.nodes.monitor.parameters import described
from ugv_acceptance.nodes.monitor.publishers import LATCHED
from ugv_acceptance.nodes.monitor.subscriptions import qos_of
from ugv_acceptance.nodes.parameter_types import FittingParameters

NAME = 'packbot_simulator'
# Behind by more than this (s), the simulation lets time slip instead of catching up.
SLIP = 0.25
# Seconds between two messages on /clock.
CLOCK_STEP = 0.01


class Simulator(FittingParameters, Node):
    """The simulated robot as a node; `slipped` (s) is the real time it could not keep up with."""

    def __init__(self, **node: Any) -> None:  # noqa: ANN401 - as Node does
        # Without MuJoCo these imports raise AcceptanceError, which run() reports.
        from ugv_acceptance.run.fault_text import fault_from  # noqa: PLC0415
        from ugv_acceptance.run.simulated_robot import VirtualRobot  # noqa: PLC0415
        from ugv_acceptance.simulation.inertia import balanced_links  # noqa: PLC0415

        super().__init__(NAME, **node)
        self.slipped = 0.0
        self._declare()
        config = load(Path(self._value('config')))
        robot = config.settings.robot
        faults = tuple(fault_from(text, robot) for text in self._value('faults') if text)
        unset = Parameter('home', Parameter.Type.DOUBLE_ARRAY, [])
        self.virtual = VirtualRobot(
            config,
            int(self._value('seed')),
            faults,
            tuple(self.get_parameter_or('home', unset).value),
            self._value('joint_rate'),
            self._value('imu_rate'),
            epoch=0,
        )
        self._hold_declared()
        if names := balanced_links(robot):
            self.get_logger().warning(f'inertia of no rigid body, balanced: {", ".join(names)}')
        self._clocked = bool(self._value('clock'))
        kinds = {'joint_states': JointState, 'imu': Imu}
        self._outputs: dict[str, Publisher] = {
            name: self.create_publisher(kinds[name], topic.name, qos_of(topic, 100))
            for name, topic in config.topics.used.items()
            if name in kinds
        }
        self._description = self.create_publisher(String, config.topics.robot_description, LATCHED)
        self._description.publish(description_message(config.urdf_text))
        self._clock_publisher = (
            self.create_publisher(ClockMessage, '/clock', 10) if self._clocked else None
        )
        self._subscribe()
        self._began = 0.0
        self._next_clock = 0.0

    def _declare(self) -> None:
        declare = partial(parameter_types.declare, self)
        declare('config', 'packbot', described('YAML file, or the name of one that ships'))
        declare('seed', 1, described("of the sensors' noise and the faults"))
        declare('rate', 1.0, described('speed, as a multiple of real time', 0.01, 100.0))
        declare('clock', False, described('publish /clock; stamps are then simulated time'))
        declare('joint_rate', 100.0, described('joint states a second', 1.0, 1000.0))
        declare('imu_rate', 200.0, described('IMU messages a second', 1.0, 1000.0))
        what = 'positions (rad) at the start, in the order of the configuration; empty: stowed'
        declare('home', Parameter.Type.DOUBLE_ARRAY, described(what))
        declare('faults', [''], described('KIND[:SUBJECT][=AMOUNT][@START[-END]], as of simulate'))

    def _subscribe(self) -> None:
        subscribe = self.create_subscription
        subscribe(Twist, 'cmd_vel', self._guard(self._on_drive), 10)
        trajectories = 'arm_controller/joint_trajectory'
        subscribe(JointTrajectory, trajectories, self._guard(self._on_trajectory), 10)
        subscribe(Vector3, '~/ground', self._guard(self._on_ground), 10)
        subscribe(Inertia, '~/load', self._guard(self._on_load), 10)
        subscribe(Vector3, '~/pull', self._guard(self._on_pull), 10)
        self.create_service(Trigger, '~/reset', self._on_reset)

    def _guard(self, take: Callable[[Any], None]) -> Callable[[Any], None]:
        """Return `take` wrapped so that a bad command is logged and changes nothing."""

        def guarded(message: Any) -> None:  # noqa: ANN401 - a message
            try:
                take(message)
            except BadSample as error:
                self.get_logger().warning(f'refused: {error}', throttle_duration_sec=1.0)

        return guarded

    def bring_up(self) -> None:
        """Start the simulation's time."""
        self._began = time.monotonic()
        if not self._clocked:
            self.virtual.shift(time.time_ns())
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(self.virtual.tick / self._value('rate'), self._on_time, clock=steady)

    # Commands

    def _on_drive(self, message: Twist) -> None:
        self.virtual.remote.drive(message.linear.x, message.angular.z)

    def _on_trajectory(self, message: JointTrajectory) -> None:
        names = {j.topic_name: n for j, n in self._joint_names()}
        unknown = [n for n in message.joint_names if n not in names]
        if unknown:
            raise BadSample(f'trajectory: expected joints of {list(names)}, got {unknown}')
        inputs = {j.topic_name: j for j, _ in self._joint_names()}
        told = [inputs[n] for n in message.joint_names]
        points = [
            (
                p.time_from_start.sec + p.time_from_start.nanosec * 1e-9,
                [j.sign * q + j.offset for j, q in zip(told, p.positions, strict=False)],
            )
            for p in message.points
        ]
        self.virtual.remote.follow([names[n] for n in message.joint_names], points)

    def _joint_names(self) -> list[tuple[Any, str]]:
        settings = self.virtual.config.settings
        return list(zip(settings.joints, settings.robot.joint_names, strict=True))

    def _on_ground(self, message: Vector3) -> None:
        self.virtual.tilt(message.x, message.y, message.z)

    def _on_pull(self, message: Vector3) -> None:
        if not (math.isfinite(message.x) and message.x >= 0.0 and math.isfinite(message.z)):
            raise BadSample(f'pull: expected newtons backwards, got {message.x} at {message.z} m')
        self.virtual.pull(message.x, message.z)

    def _on_load(self, message: Inertia) -> None:
        self.virtual.remote.take(Payload(message.m, (message.com.x, message.com.y, message.com.z)))

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.virtual.remote.reset()
        self._hold_declared()
        held = self.virtual.config.settings.robot.payload.mass
        text = f'stands on level ground, arm as at the start, {held:g} kg in its hand'
        response.success, response.message = True, text
        return response

    def _hold_declared(self) -> None:
        """Put the configuration's load into the gripper, as a monitor assumes."""
        declared = self.virtual.config.settings.robot.payload
        if declared.mass > 0.0:
            self.virtual.remote.take(declared)

    # Time

    def _on_time(self) -> None:
        virtual, rate = self.virtual, self._value('rate')
        now = (time.monotonic() - self._began) * rate
        behind = now - virtual.elapsed
        if behind > SLIP:
            self._began += behind / rate
            self.slipped += behind
            now -= behind
            if not self._clocked:
                virtual.shift(int(behind * 1e9))
        while virtual.elapsed + virtual.tick <= now:
            virtual.step()
            for source, data in virtual.due(now):
                if source in self._outputs:
                    self._outputs[source].publish(data)
        self._tell_time()

    def _tell_time(self) -> None:
        elapsed = self.virtual.elapsed
        if self._clock_publisher is None or elapsed < self._next_clock:
            return
        message = ClockMessage()
        fraction, whole = math.modf(elapsed)
        message.clock.sec, message.clock.nanosec = int(whole), int(fraction * 1e9)
        self._clock_publisher.publish(message)
        self._next_clock = elapsed + CLOCK_STEP

    def _value(self, name: str) -> Any:  # noqa: ANN401 - a parameter's value
        return self.get_parameter(name).value


def main(args: list[str] | None = None) -> None:
    """Run the simulated robot until it is interrupted; exit code 2 where a file is bad."""
    sys.exit(run(Simulator, args))
