"""`packbot_simulator`: a simulated robot behind the topics of a real one. docs/plan_and_run.md.

It publishes joint_states and imu/data (and /clock when asked) and obeys cmd_vel and
arm_controller/joint_trajectory. What a person does on a test ground comes on topics of its own:
~/ground tilts what it stands on, ~/load puts a load into its hand, ~/reset stands it up again.
"""

import heapq
import math
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from geometry_msgs.msg import Inertia, Twist, Vector3
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from ugv_acceptance import BadConfig, BadSample
from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.nodes.inputs import qos_of
from ugv_acceptance.nodes.parameters import described
from ugv_acceptance.nodes.running import run
from ugv_acceptance.run.messages import Driver
from ugv_acceptance.run.record import build_of
from ugv_acceptance.simulation.corruption import Corruption, overload, weakened
from ugv_acceptance.simulation.drive_by_wire import RemoteRobot
from ugv_acceptance.simulation.faults import fault_from
from ugv_acceptance.simulation.scenario import Noise, Scenario
from ugv_acceptance.simulation.scenarios import STOWED
from ugv_acceptance.simulation.stretches import Rows, Sensors, stride_of

NAME = 'packbot_simulator'
# Behind by more than this (s), the simulation lets time slip instead of catching up.
SLIP = 0.25
# Seconds between two messages on /clock.
CLOCK_STEP = 0.01


class Simulator(Node):
    """The simulated robot as a node; `slipped` (s) is how much real time it could not follow."""

    def __init__(self, **node: Any) -> None:  # noqa: ANN401 - as Node does
        super().__init__(NAME, **node)
        self.slipped = 0.0
        self._declare()
        config = load(Path(self._value('config')))
        robot = config.settings.robot
        faults = tuple(fault_from(text, robot) for text in self._value('faults') if text)
        seed = int(self._value('seed'))
        rates = self._value('joint_rate'), self._value('imu_rate')
        self._stride = stride_of(
            Scenario('live', 1.0, joint_rate=rates[0], imu_rate=rates[1]), build_of(config)
        )
        self._tick = 1.0 / rates[1]
        self._count = 0
        self.remote = RemoteRobot(
            weakened(robot, faults), build_of(config), self._home(robot), overload(faults)
        )
        self._corruption = Corruption(faults, robot.joint_names)
        self._rng = np.random.default_rng(seed)
        self._sensors = Sensors(Noise(), np.random.default_rng(seed))
        self._clocked = bool(self._value('clock'))
        self._driver = Driver(config, self._corruption, Noise(), 0)
        self._outgoing: list[tuple[float, int, str, bytes]] = []
        topics = config.topics
        self._outputs: dict[str, Publisher] = {
            'joint_states': self.create_publisher(
                JointState, topics.joint_states.name, qos_of(topics.joint_states, 100)
            ),
            'imu': self.create_publisher(Imu, topics.imu.name, qos_of(topics.imu, 100)),
        }
        self._clock_publisher = (
            self.create_publisher(ClockMessage, '/clock', 10) if self._clocked else None
        )
        self._subscribe()
        self._began = 0.0
        self._next_clock = 0.0

    def _home(self, robot: Robot) -> tuple[tuple[str, float], ...]:
        """Return the posture at the start: stowed, unless the parameter says another."""
        names, stowed = robot.joint_names, dict(STOWED)
        unset = Parameter('home', value=[stowed.get(n, 0.0) for n in names])
        home = list(self.get_parameter_or('home', unset).value)
        if len(home) != len(names):
            raise BadConfig(f'home: expected {len(names)} positions, got {len(home)}')
        return tuple(zip(names, home, strict=True))

    def _declare(self) -> None:
        declare = self.declare_parameter
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
        self.create_service(Trigger, '~/reset', self._on_reset)

    def _guard(self, take: Callable[[Any], None]) -> Callable[[Any], None]:
        """Return `take` such that a bad command is refused aloud and changes nothing."""

        def guarded(message: Any) -> None:  # noqa: ANN401 - a message
            try:
                take(message)
            except BadSample as error:
                self.get_logger().warning(f'refused: {error}', throttle_duration_sec=1.0)

        return guarded

    def bring_up(self) -> None:
        """Start the time of the simulation."""
        self._began = time.monotonic()
        if not self._clocked:
            self._driver = replace(self._driver, epoch=time.time_ns())
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(self._tick / self._value('rate'), self._on_time, clock=steady)

    # Commands

    def _on_drive(self, message: Twist) -> None:
        self.remote.drive(message.linear.x, message.angular.z)

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
        self.remote.follow([names[n] for n in message.joint_names], points)

    def _joint_names(self) -> list[tuple[Any, str]]:
        settings = self._driver.config.settings
        return list(zip(settings.joints, settings.robot.joint_names, strict=True))

    def _on_ground(self, message: Vector3) -> None:
        self.remote.tilt(message.x, message.y, message.z)

    def _on_load(self, message: Inertia) -> None:
        self.remote.take(Payload(message.m, (message.com.x, message.com.y, message.com.z)))

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.remote.reset()
        response.success, response.message = True, 'stands on level ground, arm stowed, no load'
        return response

    # Time

    def _on_time(self) -> None:
        now = (time.monotonic() - self._began) * self._value('rate')
        behind = now - self.remote.elapsed
        if behind > SLIP:
            self._began += behind / self._value('rate')
            self.slipped += behind
            self._shift(behind)
            now -= behind
        while self.remote.elapsed + self._tick <= now:
            self._step()
        while self._outgoing and self._outgoing[0][0] <= now:
            _, _, source, data = heapq.heappop(self._outgoing)
            self._outputs[source].publish(data)
        self._tell_time()

    def _shift(self, behind: float) -> None:
        if not self._clocked:
            later = self._driver.epoch + int(behind * 1e9)
            self._driver = replace(self._driver, epoch=later)

    def _step(self) -> None:
        self.remote.advance(self._tick)
        simulation, now = self.remote.simulation, self.remote.elapsed
        rows = Rows(imu=[(now, *simulation.imu())])
        self._count += 1
        if self._count % self._stride == 0:
            rows.joints.append((now, *simulation.joints()))
            self._send('joint_states', self._driver.joint_states(self._sensors.joints(rows)))
        self._send('imu', self._driver.imu(self._sensors.imu(rows)))

    def _send(self, source: str, messages: Iterable[tuple[float, bytes]]) -> None:
        for at, data in messages:
            if not self._corruption.faults:
                self._outputs[source].publish(data)
                continue
            for due in self._corruption.arrivals(source, at, self._rng):
                heapq.heappush(self._outgoing, (due, self._count, source, data))

    def _tell_time(self) -> None:
        if self._clock_publisher is None or self.remote.elapsed < self._next_clock:
            return
        message = ClockMessage()
        fraction, whole = math.modf(self.remote.elapsed)
        message.clock.sec, message.clock.nanosec = int(whole), int(fraction * 1e9)
        self._clock_publisher.publish(message)
        self._next_clock = self.remote.elapsed + CLOCK_STEP

    def _value(self, name: str) -> Any:  # noqa: ANN401 - a parameter's value
        return self.get_parameter(name).value


def main(args: list[str] | None = None) -> None:
    """Run the simulated robot until it is interrupted; exit code 2 where a file is bad."""
    sys.exit(run(Simulator, args))
