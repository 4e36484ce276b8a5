"""Static torques against the paper's equations and against sums of forces; the payload left."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from robots import DOWN, at, masses, paper_arm, places, random_robot, tracked
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from ugv_acceptance import BadConfig
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Joint, Link, Payload, Robot
from ugv_acceptance.model.statics import (
    centre_of_gravity,
    inverse_dynamics,
    payload_capacity,
    static_torque,
    torque_margin,
    torque_of,
    utilisation,
)

# The paper's numbers, and its two lever arms' moments (N m).
L1, L2, M1, M2, G = 0.55, 0.64, 2.5, 2.5, 9.81
TURN = np.linspace(0.0, 2.0 * np.pi, 201)
angles = st.floats(-7.0, 7.0)
loads = st.floats(0.0, 10.0)


def equations_1_and_2(theta1: float, theta2: float, load: float) -> tuple[float, float]:
    """Return the paper's torques (N m)."""
    force = load * G
    a = (M1 * G * L1 / 2 + M2 * G * L1 + force * L1) * math.cos(theta1)
    b = (M2 * G * L2 / 2 + force * L2) * math.cos(theta1 + theta2)
    return a + b, b


@given(angles, angles, loads)
def test_the_paper_s_equations(theta1: float, theta2: float, load: float) -> None:
    """The torques of the two-link arm on level ground are equations (1) and (2)."""
    found = static_torque(paper_arm(), [theta1, theta2], DOWN, Payload(load))
    np.testing.assert_allclose(found, equations_1_and_2(theta1, theta2, load), rtol=0, atol=1e-12)


@given(angles, angles, loads)
def test_a_live_sample_gives_the_same(theta1: float, theta2: float, load: float) -> None:
    """A posture of floats gives the torques of an array of one."""
    posture = posture_of(mechanics_of(paper_arm()), [theta1, theta2], load, (0.0, 0.0, 0.0))
    found = np.array(torque_of(posture, DOWN))
    np.testing.assert_allclose(found, equations_1_and_2(theta1, theta2, load), rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ('theta1', 'theta2'),
    [
        (0.0, [0.0, 2.0 * np.pi]),
        (np.pi / 6, [11 * np.pi / 6]),
        (np.pi / 3, [5 * np.pi / 3]),
        (np.pi / 2, [np.pi / 2, 3 * np.pi / 2]),
        (2 * np.pi / 3, [np.pi / 3]),
        (5 * np.pi / 6, [np.pi / 6]),
        (np.pi, [0.0, 2.0 * np.pi]),
    ],
)
def test_table_1(theta1: float, theta2: list[float]) -> None:
    """Over a turn of the second joint |tau_1| is largest where Table 1 says, and nowhere else."""
    fine = np.linspace(0.0, 2.0 * np.pi, 1201)
    q = np.stack(np.broadcast_arrays(theta1, fine), axis=-1)
    size = np.abs(static_torque(paper_arm(), q, DOWN)[:, 0])
    worst = fine[size > size.max() - 1e-9]
    np.testing.assert_allclose(worst, theta2, rtol=0, atol=1e-9)


@given(loads)
def test_an_arm_that_hangs_straight_down_needs_no_torque(load: float) -> None:
    """An arm that hangs straight down needs no torque."""
    found = static_torque(paper_arm(), [-np.pi / 2, 0.0], DOWN, Payload(load))
    np.testing.assert_allclose(found, 0.0, atol=1e-13)


def test_torque_equals_a_sum_of_weights_times_levers() -> None:
    """For random trees: -axis . sum of (c - p) x m g over all that hangs on the joint."""
    rng = np.random.default_rng(1)
    for _ in range(30):
        robot = random_robot(rng, 4)
        q = rng.uniform(-3.0, 3.0, len(robot.joint_names))
        gravity = rng.normal(size=3) * 9.0
        expected = [moment_on(robot, name, q, gravity) for name in robot.joint_names]
        np.testing.assert_allclose(static_torque(robot, q, gravity), expected, atol=1e-11)


def moment_on(robot: Robot, name: str, q: np.ndarray, gravity: np.ndarray) -> float:
    """Return what holds a joint (N m; N) by a sum over the links that hang on it."""
    joint, found = robot.joint(name), places(robot, q.tolist())
    below = {joint.child}
    for _ in robot.joints:
        below |= {j.child for j in robot.joints if j.parent in below}
    mass, points = masses(robot, q.tolist(), robot.payload)
    names = [*(link.name for link in robot.links), robot.payload_link]
    on = np.array([n in below for n in names])
    axis = found[joint.child][:3, :3] @ np.asarray(joint.axis)
    if joint.kind == 'prismatic':
        return float(-mass[on].sum() * axis @ gravity)
    arm = points[on] - at(found[joint.child], (0.0, 0.0, 0.0))
    return float(-axis @ np.cross(arm, mass[on, None] * gravity).sum(axis=0))


def test_inverse_dynamics_at_rest_is_the_static_torque() -> None:
    """With no rate and no acceleration the full recursion gives the same torques."""
    rng = np.random.default_rng(2)
    for _ in range(10):
        robot = random_robot(rng, 4)
        q = rng.uniform(-3.0, 3.0, (50, len(robot.joint_names)))
        gravity = rng.normal(size=(50, 3)) * 9.0
        moving = inverse_dynamics(robot, q, 0.0 * q, 0.0 * q, gravity)
        np.testing.assert_allclose(static_torque(robot, q, gravity), moving, atol=1e-11)


@given(st.floats(-3.0, 3.0), st.floats(-0.8, 0.8), st.floats(-0.8, 0.8))
def test_a_turn_about_the_vertical_changes_nothing(yaw: float, pitch: float, roll: float) -> None:
    """Gravity in the base, and with it every torque, is the same whatever the heading."""
    tilt = Rotation.from_euler('ZYX', [[0.0, pitch, roll], [yaw, pitch, roll]])
    gravity = tilt.inv().apply(DOWN)
    level, turned = static_torque(tracked(), [0.3, 0.4, -0.9, 0.1], gravity)
    np.testing.assert_allclose(turned, level, rtol=0, atol=1e-12)


def test_margins_fall_as_the_payload_grows() -> None:
    """At full reach each kilogram takes from both margins; utilisation 1 leaves nothing."""
    limit = [70.0, 50.0]
    torque = np.array([static_torque(paper_arm(), [0.0, 0.0], DOWN, Payload(m)) for m in range(9)])
    assert (np.diff(torque_margin(torque, limit), axis=0) < 0.0).all()
    np.testing.assert_allclose(utilisation(torque, torque), 1.0)


def test_arrays_broadcast_over_leading_axes() -> None:
    """A map (n, m, j) under one gravity equals its postures one by one, in any blocks."""
    rng = np.random.default_rng(3)
    q = rng.uniform(-3.0, 3.0, (130, 140, 4))
    found = static_torque(tracked(), q, DOWN, workers=2)
    assert found.shape == (130, 140, 4)
    np.testing.assert_array_equal(found[7, 11], static_torque(tracked(), q[7, 11], DOWN))


def test_centre_of_gravity_is_the_mean_of_the_links() -> None:
    """Weighted with their masses, the payload among them."""
    robot, q = tracked(), [0.4, 0.7, -1.1, 0.3]
    mass, points = masses(robot, q, robot.payload)
    expected = mass @ points / mass.sum()
    np.testing.assert_allclose(centre_of_gravity(robot, q), expected, atol=1e-14)


LIMITS = [40.0, 60.0, 45.0, 30.0]


def random_postures(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return postures of the tracked robot and tilted gravity."""
    rng = np.random.default_rng(4)
    tilt = Rotation.from_rotvec(rng.uniform(-0.6, 0.6, (count, 3)))
    return rng.uniform(-3.0, 3.0, (count, 4)), tilt.apply(DOWN)


def test_at_the_payload_capacity_the_worst_joint_is_at_its_limit() -> None:
    """Carrying exactly the capacity, max |tau| / T is 1 to 1e-9."""
    robot, (q, gravity) = tracked(), random_postures(200)
    capacity = payload_capacity(robot, q, gravity, LIMITS)
    assert np.isfinite(capacity).any()
    for k in np.flatnonzero(np.isfinite(capacity)):
        load = Payload(float(capacity[k]), robot.payload.cog)
        used = np.abs(static_torque(robot, q[k], gravity[k], load)) / LIMITS
        assert used.max() == pytest.approx(1.0, abs=1e-9)


def test_payload_capacity_equals_a_search() -> None:
    """Bisection over the payload finds the same mass."""
    robot, (q, gravity) = tracked(), random_postures(60)
    capacity = payload_capacity(robot, q, gravity, LIMITS)

    def left(mass: float, k: int) -> float:
        torque = static_torque(robot, q[k], gravity[k], Payload(mass, robot.payload.cog))
        return float((np.array(LIMITS) - np.abs(torque)).min())

    for k in range(len(q)):
        if left(0.0, k) < 0.0:
            assert capacity[k] < 0.0
        else:
            found = brentq(left, 0.0, 1e5, args=(k,), xtol=1e-12)
            assert capacity[k] == pytest.approx(found, rel=1e-9)


def test_no_payload_is_allowed_where_a_joint_saturates_without_any() -> None:
    """Neither where the payload loads that joint nor where it would relieve it."""
    q = [[0.0, 0.0], [0.0, np.pi]]
    assert (payload_capacity(paper_arm(), q, DOWN, [5.0, 50.0]) < 0.0).all()


def test_a_payload_that_loads_no_joint_has_no_limit() -> None:
    """A payload that loads no joint, or limits that are infinite, have no largest payload."""
    arm = paper_arm()
    assert payload_capacity(arm, [0.0, 0.0], DOWN, [np.inf, np.inf]) == np.inf
    free = payload_capacity(arm, [0.0, 0.0], (0.0, -9.81, 0.0), [30.0, 30.0])
    assert free == np.inf


@pytest.mark.parametrize('bad', [math.nan, math.inf])
def test_an_unknown_joint_makes_its_torques_unknown(bad: float) -> None:
    """NaN and infinity give NaN, no exception and no warning; the flippers do not depend on it."""
    robot, q = tracked(), [0.2, 0.3, bad, 0.1]
    torque = static_torque(robot, [q], DOWN)[0]
    np.testing.assert_array_equal(np.isnan(torque), [True, True, True, False])
    posture = posture_of(mechanics_of(robot), q, 4.0, robot.payload.cog)
    np.testing.assert_array_equal(np.isnan(np.array(torque_of(posture, DOWN))), np.isnan(torque))
    assert np.isnan(payload_capacity(robot, q, DOWN, LIMITS))
    rest = [0.0] * 4
    moving = inverse_dynamics(robot, [q], rest, rest, DOWN)[0]
    np.testing.assert_array_equal(np.isnan(moving), np.isnan(torque))


def test_a_robot_without_mass_is_refused() -> None:
    """A robot without mass is refused, because it has no centre of gravity."""
    joint = Joint('j', 'revolute', 'a', 'b')
    robot = Robot('ghost', (Link('a'), Link('b')), (joint,), ('j',))
    with pytest.raises(BadConfig, match='robot ghost: expected a link with a mass'):
        mechanics_of(robot)
