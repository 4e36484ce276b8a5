"""Trees of links: rotations, masses, joints that are held, and what is asked of positions."""

import math

import numpy as np
import pytest
from robots import paper_arm, tracked
from scipy.spatial.transform import Rotation

from ugv_acceptance.model.mechanics import mechanics_of, posture_of, posture_once
from ugv_acceptance.model.robot import IDENTITY, Joint, Link, Payload, Robot
from ugv_acceptance.model.statics import (
    centre_of_gravity,
    inverse_dynamics,
    payload_capacity,
    static_torque,
)
from ugv_acceptance.model.torque_gradients import in_base, steps_of
from ugv_acceptance.model.tree import pose_of, rotation_about, tree_of

UP = (0.0, 0.0, 1.0)
NOWHERE = (0.0, 0.0, 0.0)


@pytest.mark.parametrize('seed', range(10))
def test_a_rotation_about_an_axis_is_scipy_s(seed: int) -> None:
    """Any unit axis, any angle."""
    rng = np.random.default_rng(seed)
    axis, angle = rng.normal(size=3), float(rng.uniform(-7.0, 7.0))
    axis /= np.linalg.norm(axis)
    x, y, z = axis.tolist()
    expected = Rotation.from_rotvec(angle * axis).as_matrix()
    np.testing.assert_allclose(np.array(rotation_about((x, y, z), angle)), expected, atol=1e-14)


def test_a_robot_that_says_no_more_is_at_rest_on_the_ground_of_the_earth() -> None:
    """`base_link` on the ground, points within a millimetre stand, no load, no limit, axis x."""
    robot, joint = Robot('r', (Link('a', 1.0),), (), ()), Joint('j', 'revolute', 'a', 'b')
    assert (robot.gravity, robot.ground, robot.contact_tolerance) == (9.81, 0.0, 0.001)
    assert (robot.payload_link, robot.payload) == (None, Payload(0.0, NOWHERE))
    assert (joint.xyz, joint.rotation, joint.axis) == (NOWHERE, IDENTITY, (1.0, 0.0, 0.0))
    assert (joint.lower, joint.upper, joint.effort) == (-math.inf, math.inf, math.inf)
    np.testing.assert_array_equal(IDENTITY, np.eye(3))


def test_links_and_joints_are_found_by_name() -> None:
    """Links and joints are found by name, whatever their order."""
    robot = tracked()
    for link in robot.links:
        assert robot.link(link.name) is link
    for joint in robot.joints:
        assert robot.joint(joint.name) is joint


@pytest.mark.parametrize('mass', [0.25, 1.0, 4.0])
def test_a_light_robot_is_a_robot(mass: float) -> None:
    """A kilogram in all, or less; links without mass add nothing."""
    links = (Link('base', mass, (0.1, 0.2, 0.3)), Link('arm'), Link('tip'))
    joints = (Joint('j', 'revolute', 'base', 'arm'), Joint('t', 'fixed', 'arm', 'tip', UP))
    mechanics = mechanics_of(Robot('r', links, joints, ('j',)))
    posture = posture_of(mechanics, [0.3], 0.0, NOWHERE)
    assert posture.mass == mass
    assert posture.cog == pytest.approx((0.1, 0.2, 0.3))


def test_a_joint_nobody_speaks_of_is_at_zero() -> None:
    """Revolute and prismatic; a link of one kilogram weighs as much as any."""
    links = (Link('base', 2.0), Link('turn', 1.0, (0.5, 0.0, 0.0)), Link('slide', 1.0))
    joints = (
        Joint('t', 'revolute', 'base', 'turn', axis=UP),
        Joint('s', 'prismatic', 'turn', 'slide', (1.0, 0.0, 0.0), axis=UP),
    )
    whole = Robot('whole', links, joints, ())
    assert centre_of_gravity(whole, np.empty(0)) == pytest.approx((1.5 / 4.0, 0.0, 0.0))
    turned = Robot('turned', links, joints, ('t',))
    assert centre_of_gravity(turned, [math.pi / 2]) == pytest.approx((0.0, 1.5 / 4.0, 0.0))


@pytest.mark.parametrize('count', [1, 3])
def test_there_is_one_position_for_each_joint(count: int) -> None:
    """A posture has exactly one position for each joint; any other number is refused."""
    tree, q = tree_of(paper_arm()), [0.1] * count
    for ask in (pose_of, steps_of):
        with pytest.raises(ValueError, match='zip'):
            ask(tree, q)


def test_poses_and_steps_lead_to_the_same_place() -> None:
    """The axes and origin of every body, and the way from its axes to the base's."""
    robot, q = tracked(), (0.3, -0.4, 1.1, 0.7)
    tree = tree_of(robot)
    pose, steps = pose_of(tree, q), steps_of(tree, q)
    point = (0.2, -0.1, 0.4)
    for body in range(len(tree.bodies)):
        turned = np.array(pose.rotation[body]) @ point + np.array(pose.origin[body])
        assert np.array(in_base(tree, steps, body, point)) == pytest.approx(turned)


def test_a_posture_asked_for_once_is_the_compiled_one() -> None:
    """Same numbers without compiling."""
    robot, q = tracked(), (0.3, -0.4, 1.1, 0.7)
    once = posture_once(robot, q, 3.0, (0.1, 0.0, 0.2))
    compiled = posture_of(mechanics_of(robot), q, 3.0, (0.1, 0.0, 0.2))
    assert once.mass == pytest.approx(compiled.mass)
    for name in ('torque_gradients', 'cog', 'contacts'):
        assert np.array(getattr(once, name)) == pytest.approx(np.array(getattr(compiled, name)))


def rod(mass: float = 2.0) -> Robot:
    """Return a rod of 1 m that turns about y at its end, with a load at the other end."""
    links = (Link('base', 5.0), Link('rod', mass, (0.5, 0.0, 0.0)))
    joints = (Joint('j', 'revolute', 'base', 'rod', axis=(0.0, -1.0, 0.0)),)
    return Robot('rod', links, joints, ('j',), (), (), 'rod', Payload(0.0, (1.0, 0.0, 0.0)))


@pytest.mark.parametrize(
    ('gravity', 'limit', 'mass'),
    [(1.0, 3.0, 2.0), (1.0, 1.0, 0.0), (1.0, 0.5, -math.inf), (1.0, 0.98, -math.inf),
     (1.0, 0.9999, -math.inf), (10.0, 30.0, 2.0), (0.5, 3.0, 5.0), (1.0, math.inf, math.inf),
     (0.0, 0.0, math.inf)],
)  # fmt: skip
def test_the_payload_left_to_a_rod_is_the_limit_less_its_weight(
    gravity: float, limit: float, mass: float
) -> None:
    """(limit - m g / 2) / g: nothing at the limit, less than that beyond it, any without weight."""
    found = payload_capacity(rod(), [[0.0]], [0.0, 0.0, -gravity], [limit])
    assert found.tolist() == [mass]


def test_a_rod_alone_turns_by_hand_s_reckoning() -> None:
    """Held it needs m g / 2; in no gravity m / 4 times the acceleration, having no own inertia."""
    assert static_torque(rod(), [0.0], [0.0, 0.0, -9.0]) == pytest.approx([9.0])
    moved = inverse_dynamics(rod(), [0.4], [2.0], [3.0], NOWHERE)
    assert moved == pytest.approx([1.5])
