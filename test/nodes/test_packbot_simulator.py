"""The simulated robot over real DDS: it publishes as a robot does and obeys as one."""

import math
from pathlib import Path
from typing import Any

import pytest
import rclpy
from foreign_robots import rover, write_robot
from geometry_msgs.msg import Inertia, Twist, Vector3
from nodes.live_case import Live, parameter, session_of
from rclpy.qos import qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from ugv_acceptance import BadConfig
from ugv_acceptance.nodes.packbot_simulator import Simulator


class Controller:
    """What a person or a runner has: the robot's topics, seen from the other side."""

    def __init__(self, live: Live, **values: Any) -> None:
        self.live = live
        self.robot: Simulator = live.add(
            Simulator(parameter_overrides=[parameter(k, v) for k, v in values.items()])
        )
        self.node = live.add(rclpy.create_node('controller'))
        self.joints: list[JointState] = []
        self.imu: list[Imu] = []
        self.clock: list[Clock] = []
        subscribe, sensor = self.node.create_subscription, qos_profile_sensor_data
        subscribe(JointState, 'joint_states', self.joints.append, sensor)
        subscribe(Imu, 'imu/data', self.imu.append, sensor)
        subscribe(Clock, '/clock', self.clock.append, 10)
        publish = self.node.create_publisher
        self.trajectory = publish(JointTrajectory, 'arm_controller/joint_trajectory', 10)
        self.velocity = publish(Twist, 'cmd_vel', 10)
        self.ground = publish(Vector3, 'packbot_simulator/ground', 10)
        self.load = publish(Inertia, 'packbot_simulator/load', 10)
        self.robot.bring_up()
        live.until(lambda: self.joints and self.imu and self._heard())

    def _heard(self) -> bool:
        publishers = (self.trajectory, self.velocity, self.ground, self.load)
        return all(p.get_subscription_count() for p in publishers)

    def position(self, name: str) -> float:
        """Return the newest position of a joint (rad)."""
        newest = self.joints[-1]
        return float(newest.position[list(newest.name).index(name)])

    def speed(self, name: str) -> float:
        """Return the newest speed of a joint (rad/s)."""
        newest = self.joints[-1]
        return float(newest.velocity[list(newest.name).index(name)])

    def move(self, seconds: int, **targets: float) -> None:
        """Send a trajectory of one point; no targets: hold still."""
        message = JointTrajectory(joint_names=list(targets))
        if targets:
            message.points = [JointTrajectoryPoint(positions=list(targets.values()))]
            message.points[0].time_from_start.sec = seconds
        self.trajectory.publish(message)


def test_it_publishes_what_a_robot_publishes(live: Live) -> None:
    """Joint states with effort, and an IMU that feels gravity, both stamped with the present."""
    robot = Controller(live)
    state, imu = robot.joints[-1], robot.imu[-1]
    assert len(state.name) == len(state.position) == len(state.velocity) == len(state.effort) == 4
    assert imu.linear_acceleration.z == pytest.approx(9.81, abs=0.5)
    assert imu.header.frame_id == 'imu_link'
    now = robot.node.get_clock().now().nanoseconds * 1e-9
    assert abs(now - state.header.stamp.sec - state.header.stamp.nanosec * 1e-9) < 5.0
    assert not robot.clock


def test_it_follows_a_trajectory_and_holds(live: Live) -> None:
    """A point is reached; an empty trajectory holds the arm where it is."""
    robot = Controller(live)
    robot.move(1, shoulder_joint=1.7)
    live.until(lambda: abs(robot.position('shoulder_joint') - 1.7) < 0.03)
    robot.move(8, turret_joint=1.5)
    live.until(lambda: robot.position('turret_joint') > 0.1)
    robot.move(0)
    live.until(lambda: abs(robot.speed('turret_joint')) < 0.01)
    there, told = robot.position('turret_joint'), len(robot.joints)
    live.until(lambda: len(robot.joints) > told + 25)
    assert robot.position('turret_joint') == pytest.approx(there, abs=0.01)
    assert there < 1.4


def test_a_command_that_makes_no_sense_is_refused(live: Live) -> None:
    """A wrong command is refused; the node goes on and the robot does not move."""
    robot = Controller(live)
    robot.move(1, wing_joint=1.0)
    robot.velocity.publish(Twist(linear=Vector3(x=math.nan)))
    robot.load.publish(Inertia(m=-1.0))
    robot.move(1, shoulder_joint=1.8)
    live.until(lambda: abs(robot.position('shoulder_joint') - 1.8) < 0.03)


def test_a_tilting_ground_is_felt_by_the_imu_and_reset_by_a_service(live: Live) -> None:
    """Down to the left by 0.3 rad: gravity shows it; after a reset it is level again."""
    robot = Controller(live)
    robot.ground.publish(Vector3(x=0.3, y=math.pi / 2.0, z=1.0))
    live.until(lambda: robot.imu[-1].linear_acceleration.y < -9.81 * math.sin(0.25))
    assert live.call(Trigger, 'packbot_simulator/reset').success
    robot.imu.clear()
    live.until(lambda: robot.imu and abs(robot.imu[-1].linear_acceleration.y) < 0.5)


def test_the_clock_is_told_when_asked(live: Live) -> None:
    """With `clock`, stamps are those of simulated time."""
    robot = Controller(live, clock=True)
    live.until(lambda: robot.clock)
    assert robot.joints[-1].header.stamp.sec < 1000
    first = robot.clock[0].clock
    live.until(lambda: robot.clock[-1].clock.nanosec != first.nanosec)


def warned(live: Live, robot: Controller, monitor: Any) -> set[str]:
    """Watch the robot stand for six looks at its motors, one a second; return the alerts' codes."""
    heard = len(robot.joints)
    live.until(lambda: session_of(monitor).evaluator.margins is not None)
    live.until(lambda: len(robot.joints) > heard + 600)
    codes = {status.values['code'] for kind, status in live.heard if kind == 'alert'}
    # What the start may be, and a machine that stands still for half a second.
    return {str(code) for code in codes} - {'INPUT_STALE', 'CLOCK'}


@pytest.mark.parametrize('declared', ['4', '0'])
def test_a_monitor_beside_the_simulator_has_nothing_to_warn_of(
    live: Live, repository: Path, tmp_path: Path, declared: str
) -> None:
    """Its hand holds what the configuration declares, from the start and after a reset."""
    live.alone()
    text = (repository / 'msg_configs' / 'packbot.yaml').read_text(encoding='utf-8')
    text = text.replace('../urdf', str(repository / 'urdf'))
    config = tmp_path / 'packbot.yaml'
    config.write_text(text.replace('mass_kg: 4\n', f'mass_kg: {declared}\n'), encoding='utf-8')
    monitor = live.monitor(config=str(config))
    robot = Controller(live, config=str(config))
    assert warned(live, robot, monitor) == set()
    assert live.call(Trigger, 'packbot_simulator/reset').success
    assert warned(live, robot, monitor) == set()
    assert session_of(monitor).settings.robot.payload.mass == float(declared)


def test_a_load_that_nobody_declared_is_still_warned_of(live: Live) -> None:
    """What is put into the hand is not told to the monitor: declaring it is a person's part."""
    live.alone()
    monitor, robot = live.monitor(), Controller(live)
    robot.load.publish(Inertia(m=0.0))
    # In one posture a load looks like another scale of the efforts.
    for lift in (1.4, 1.7, 2.0, 1.5):
        robot.move(1, shoulder_joint=lift)
        live.spin(5.0)
    live.until(lambda: 'PAYLOAD_DIFFERS' in {a.rule.code for a in session_of(monitor).active})


def test_a_fault_is_injected_live(live: Live) -> None:
    """A missing joint is missing from the messages, the others are told."""
    robot = Controller(live, faults=['dead-encoder:elbow_joint'])
    assert 'elbow_joint' not in robot.joints[-1].name
    assert len(robot.joints[-1].name) == len(robot.joints[-1].position) == 3


def test_a_fault_that_is_unknown_ends_the_node(live: Live) -> None:
    """A misspelt fault is said at the start, not ignored."""
    with pytest.raises(BadConfig, match='expected one of dropped'):
        live.add(Simulator(parameter_overrides=[parameter('faults', ['broken'])]))


def test_it_is_the_robot_of_its_configuration(live: Live, tmp_path: Path) -> None:
    """A rover of another make drives on its topics; its wheels are told as turning."""
    path = write_robot(tmp_path, rover())
    simulator: Simulator = live.add(Simulator(parameter_overrides=[parameter('config', str(path))]))
    node = live.add(rclpy.create_node('driver'))
    told: list[JointState] = []
    felt: list[Imu] = []
    node.create_subscription(JointState, 'drives/state', told.append, qos_profile_sensor_data)
    node.create_subscription(Imu, 'sensors/imu', felt.append, qos_profile_sensor_data)
    velocity = node.create_publisher(Twist, 'cmd_vel', 10)
    simulator.bring_up()
    live.until(lambda: told and felt and velocity.get_subscription_count())
    ahead = Twist()
    ahead.linear.x = 0.5

    def turned() -> bool:
        velocity.publish(ahead)
        return bool(min(told[-1].position) > 1.0)

    live.until(turned)
    assert [name.endswith('_axle') for name in told[-1].name] == [True] * 4
