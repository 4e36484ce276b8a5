"""What a sensor on a moving link tells of the base, held against plain matrices and derivatives."""

import math

import numpy as np
import pytest
from robots import tracked
from scipy.spatial.transform import Rotation

from ugv_acceptance.model.carried import carried_kernel, carriers, quaternion_of
from ugv_acceptance.model.robot import IDENTITY, ZERO, Matrix, Vector
from ugv_acceptance.type_aliases import Floats

ROBOT = tracked()
MOUNT = Rotation.from_euler('xyz', [20.0, -70.0, 130.0], degrees=True)
PLACE: Vector = (0.1, -0.05, 0.2)
# Positions of turret, shoulder, elbow and flippers (rad) and their rates (rad/s).
Q, RATES = np.array([0.7, 0.5, -1.1, 0.3]), np.array([0.4, -0.3, 0.6, 5.0])
RATE = np.array([0.2, -0.1, 0.3])
G = np.array([0.0, 0.0, 9.81])


def rows(rotation: Rotation) -> Matrix:
    """Return a rotation as the model's matrix."""
    a, b, c = rotation.as_matrix().tolist()
    return tuple(a), tuple(b), tuple(c)


def sensor_in_base(q: Floats) -> tuple[Rotation, Floats]:
    """Return axes and place of the sensor on link1 by its joints, one matrix after the other."""
    at = np.eye(4)
    for xyz, axis, angle in (((0, 0, 0.19), (0, 0, 1), q[0]), ((0, 0, 0.06), (0, -1, 0), q[1])):
        step = np.eye(4)
        step[:3, 3], step[:3, :3] = xyz, Rotation.from_rotvec(np.multiply(axis, angle)).as_matrix()
        at = at @ step
    last = np.eye(4)
    last[:3, 3], last[:3, :3] = PLACE, MOUNT.as_matrix()
    at = at @ last
    return Rotation.from_matrix(at[:3, :3]), at[:3, 3]


def told(q: Floats, rates: Floats, world: Rotation, omega: Floats, force: Floats) -> list[Floats]:
    """Return what the kernel makes of a message."""
    kernel = carried_kernel(ROBOT, 'link1', rows(MOUNT), PLACE)
    found = kernel.one(*q.tolist(), *rates.tolist(), *world.as_quat(), *omega, *force)
    return [np.array(part) for part in found[:3]]


def test_the_joints_that_carry_a_link_are_those_between_it_and_the_base() -> None:
    """Not those beyond it, nor those of another limb."""
    assert carriers(ROBOT, 'link1') == (0, 1)
    assert carriers(ROBOT, 'gripper') == (0, 1, 2)
    assert carriers(ROBOT, 'base_link') == ()


def test_the_orientation_of_the_base_follows() -> None:
    """The sensor's orientation, turned back by its mounting and its joints."""
    base = Rotation.from_euler('xyz', [12.0, -7.0, 40.0], degrees=True)
    turn, _ = sensor_in_base(Q)
    found, _, _ = told(Q, RATES, base * turn, np.zeros(3), np.zeros(3))
    assert (Rotation.from_quat(found).inv() * base).magnitude() < 1e-14


def test_the_rate_of_the_base_is_without_that_of_the_joints() -> None:
    """The sensor's rate by numerical derivative, while base and joints turn."""
    step = 1e-6
    turn, _ = sensor_in_base(Q)
    base = Rotation.from_euler('xyz', [12.0, -7.0, 40.0], degrees=True)
    # The base's rate RATE is in its own axes.
    later = base * Rotation.from_rotvec(RATE * step) * sensor_in_base(Q + RATES * step)[0]
    omega = ((base * turn).inv() * later).as_rotvec() / step
    _, found, _ = told(Q, RATES, base * turn, omega, np.zeros(3))
    np.testing.assert_allclose(found, RATE, atol=1e-5)


def test_the_force_is_that_at_the_origin_of_the_base() -> None:
    """Of a base that turns at a constant rate about its origin: gravity, without the lever arm."""
    base = Rotation.from_euler('xyz', [12.0, -7.0, 40.0], degrees=True)
    turn, place = sensor_in_base(Q)
    felt = base.inv().apply(G) + np.cross(RATE, np.cross(RATE, place))
    omega = turn.inv().apply(RATE)
    _, _, found = told(Q, 0.0 * RATES, base * turn, omega, turn.inv().apply(felt))
    np.testing.assert_allclose(found, base.inv().apply(G), atol=1e-13)


def test_the_bases_z_is_told_in_the_sensors_axes() -> None:
    """For what asks which way the sensor leans."""
    kernel = carried_kernel(ROBOT, 'link1', rows(MOUNT), PLACE)
    found = kernel.one(*Q.tolist(), *RATES.tolist(), *np.zeros(10).tolist())[3]
    turn, _ = sensor_in_base(Q)
    np.testing.assert_allclose(found, turn.inv().apply([0.0, 0.0, 1.0]), atol=1e-15)


@pytest.mark.parametrize('link', ['base_link', 'turret', 'gripper', 'flippers'])
def test_columns_are_as_single_messages(link: str) -> None:
    """For a sensor anywhere."""
    random = np.random.default_rng(3)
    kernel = carried_kernel(ROBOT, link, rows(MOUNT), PLACE)
    table = random.normal(size=(18, 20))
    many = np.array([np.broadcast_to(x, 20) for part in kernel.many(*table) for x in part])
    for k in range(20):
        one = [x for part in kernel.one(*table[:, k].tolist()) for x in part]
        np.testing.assert_allclose(many[:, k], one, rtol=1e-12, atol=1e-12)


def test_a_matrix_as_a_quaternion_is_the_same_rotation() -> None:
    """Also at half turns, where some of the usual formulas divide by zero."""
    angles = [0.0, 90.0, 180.0, -90.0, 33.0]
    for turn in [(a, b, c) for a in angles for b in angles for c in angles]:
        rotation = Rotation.from_euler('xyz', turn, degrees=True)
        found = quaternion_of(rows(rotation))
        assert math.hypot(*found) == pytest.approx(1.0)
        assert (Rotation.from_quat(found).inv() * rotation).magnitude() < 1e-7
    assert quaternion_of(IDENTITY) == (0.0, 0.0, 0.0, 1.0)


def test_a_sensor_at_the_origin_of_a_still_base_tells_what_it_measures() -> None:
    """Nothing is lost on the way."""
    kernel = carried_kernel(ROBOT, 'base_link', IDENTITY, ZERO)
    message = (0.1, 0.2, 0.3, 0.9, 0.01, 0.02, 0.03, 1.0, 2.0, 9.0)
    found = [x for part in kernel.one(*Q.tolist(), *RATES.tolist(), *message) for x in part]
    assert found == pytest.approx((*message, 0.0, 0.0, 1.0), abs=1e-15)
