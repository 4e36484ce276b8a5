"""The MuJoCo model against the compiled mechanics: each is made from the links and joints alone."""

import mujoco
import numpy as np
import pytest
from robots import feet, random_robot, tracked

from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.statics import centre_of_gravity, inverse_dynamics, static_torque
from ugv_acceptance.simulation.vehicle import (
    Build,
    Vehicle,
    gravity_on_slope,
    set_payload,
    vehicle_of,
)

FIXED = Build(base='fixed', motors=False)


def robot_of(seed: int) -> Robot:
    """Return PackBot, the tracked robot of the tests, or a random one."""
    if seed == 0:
        return load().settings.robot
    return tracked() if seed == 1 else random_robot(np.random.default_rng(seed), 4, moving=2)


each_robot = pytest.mark.parametrize('seed', range(25))


def motion(robot: Robot, seed: int) -> np.ndarray:
    """Return random positions, rates and accelerations (3, j)."""
    return np.random.default_rng(seed).uniform(-3.0, 3.0, (3, len(robot.joint_names)))


def inverse(vehicle: Vehicle, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> mujoco.MjData:
    """Return MuJoCo's inverse dynamics of a motion."""
    data = mujoco.MjData(vehicle.model)
    data.qpos[vehicle.position], data.qvel[vehicle.rate] = q, qd
    data.qacc[vehicle.rate] = qdd
    mujoco.mj_inverse(vehicle.model, data)
    return data


@each_robot
def test_joint_forces_are_those_of_mujoco(seed: int) -> None:
    """Torques of a random motion on a random slope agree with mj_inverse to 1e-9."""
    robot = robot_of(seed)
    q, qd, qdd = motion(robot, seed)
    vehicle, gravity = vehicle_of(robot, FIXED), gravity_on_slope(9.81, 0.1 * seed, seed)
    vehicle.model.opt.gravity[:] = gravity
    data = inverse(vehicle, q, qd, qdd)
    ours = inverse_dynamics(robot, q, qd, qdd, gravity)
    np.testing.assert_allclose(data.qfrc_inverse[vehicle.rate], ours, rtol=1e-11, atol=1e-9)


@each_robot
def test_static_torque_is_that_of_mujoco(seed: int) -> None:
    """Torques that hold a posture on a slope agree with mj_inverse at rest to 1e-9."""
    robot = robot_of(seed)
    q, _, _ = motion(robot, seed)
    vehicle, gravity = vehicle_of(robot, FIXED), gravity_on_slope(9.81, 0.1 * seed, seed)
    vehicle.model.opt.gravity[:] = gravity
    data = inverse(vehicle, q, 0.0 * q, 0.0 * q)
    ours = static_torque(robot, q, gravity)
    np.testing.assert_allclose(data.qfrc_inverse[vehicle.rate], ours, rtol=1e-11, atol=1e-9)


@each_robot
def test_centre_of_gravity_is_that_of_mujoco(seed: int) -> None:
    """The whole robot's centre of gravity agrees with MuJoCo's to 1e-11 m."""
    robot = robot_of(seed)
    q, _, _ = motion(robot, seed)
    vehicle = vehicle_of(robot, FIXED)
    data = inverse(vehicle, q, 0.0 * q, 0.0 * q)
    found = data.subtree_com[vehicle.root] - data.xpos[vehicle.root]
    np.testing.assert_allclose(found, centre_of_gravity(robot, q), rtol=0, atol=1e-11)


@each_robot
def test_contact_spheres_are_at_the_contact_points(seed: int) -> None:
    """In any posture each sphere is centred on its contact point."""
    robot = robot_of(seed)
    q, _, _ = motion(robot, seed)
    vehicle = vehicle_of(robot, Build(motors=False))
    data = mujoco.MjData(vehicle.model)
    data.qpos[vehicle.position] = q
    mujoco.mj_kinematics(vehicle.model, data)
    found = [data.geom(f'contact:{c.name}').xpos for c in robot.contacts]
    moved = np.array(found) - data.xpos[vehicle.root]
    np.testing.assert_allclose(moved, feet(robot, q), rtol=0, atol=1e-12)


def test_a_payload_taken_later_is_as_one_taken_before() -> None:
    """set_payload gives the torques of a vehicle that is built with the payload."""
    robot = tracked()
    q, qd, qdd = motion(robot, 7)
    vehicle = vehicle_of(robot, FIXED)
    payload = Payload(2.5, (0.1, -0.05, 0.02))
    set_payload(vehicle, payload)
    found = inverse(vehicle, q, qd, qdd).qfrc_inverse[vehicle.rate]
    ours = inverse_dynamics(robot, q, qd, qdd, (0.0, 0.0, -9.81), payload)
    np.testing.assert_allclose(found, ours, rtol=0, atol=1e-9)


def test_wheels_stand_where_the_tracks_do() -> None:
    """A level vehicle on four wheels comes to rest within 0.5 mm of where it was put."""
    robot = load().settings.robot
    vehicle = vehicle_of(robot, Build(wheels=True))
    data = mujoco.MjData(vehicle.model)
    data.qpos[vehicle.position] = data.ctrl[vehicle.motor] = [0.0, 2.0, -2.4, np.pi]
    mujoco.mj_step(vehicle.model, data, nstep=2000)
    assert len(vehicle.wheels) == 4
    np.testing.assert_allclose(data.xpos[vehicle.root], [0.0, 0.0, 0.0], rtol=0, atol=5e-4)


def test_right_tilt_pulls_to_the_right() -> None:
    """A slope down towards -y (right) turns gravity towards -y and keeps its length."""
    gravity = gravity_on_slope(9.81, np.radians(30.0), -np.pi / 2)
    expected = [0.0, -9.81 / 2, -9.81 * np.cos(np.radians(30.0))]
    np.testing.assert_allclose(gravity, expected, rtol=0, atol=1e-12)
