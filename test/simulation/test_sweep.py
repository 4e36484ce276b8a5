"""The paper's dynamic simulation: a swept joint, on a fixed base and on the free vehicle."""

import numpy as np
import pytest
from robots import random_robot

from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.statics import inverse_dynamics
from ugv_acceptance.simulation.sweep import sweep

LEVEL = (0.0, 0.0, -9.81)
START = (0.0, np.pi / 6, 0.0, np.pi)


@pytest.mark.parametrize('speed_deg', [7.2, 36.0, 180.0])
def test_effort_is_our_inverse_dynamics(speed_deg: float) -> None:
    """Over a full turn of the elbow the motors' torques are inverse_dynamics to 1e-9 N m."""
    robot = load().settings.robot
    found = sweep(robot, START, 'elbow_joint', np.radians(speed_deg))
    ours = inverse_dynamics(robot, found.position, found.rate, found.acceleration, LEVEL)
    np.testing.assert_allclose(found.effort, ours, rtol=0, atol=1e-9)


def test_effort_of_any_tree() -> None:
    """The same holds for a random robot with branches and sliding joints, on a slope."""
    robot = random_robot(np.random.default_rng(8), 4)
    q = np.linspace(-1.0, 1.0, len(robot.joint_names))
    found = sweep(robot, q, robot.joint_names[0], 1.5, slope=(0.3, 0.0))
    down = (9.81 * np.sin(0.3), 0.0, -9.81 * np.cos(0.3))
    ours = inverse_dynamics(robot, found.position, found.rate, found.acceleration, down)
    np.testing.assert_allclose(found.effort, ours, rtol=1e-10, atol=1e-9)


def test_a_joint_carries_what_hangs_on_it() -> None:
    """Swept slowly, the force at a joint is the weight of all beyond it, straight up."""
    robot = load().settings.robot
    found = sweep(robot, START, 'elbow_joint', 1e-6, samples=11)
    weight = 9.81 * np.array([0.5 + 5.0 + 4.0, 5.0 + 4.0, 2.5 + 4.0, 1.6])
    expected = np.zeros((11, 4, 3))
    expected[:, :, 2] = weight
    np.testing.assert_allclose(found.force, expected, rtol=0, atol=1e-8)


def test_a_turning_load_pulls_outward() -> None:
    """At speed, the longitudinal force at the elbow is the centripetal one: sum of m r omega^2."""
    robot, speed = load().settings.robot, 3.0
    found = sweep(robot, (0.0, 0.0, 0.0, np.pi), 'elbow_joint', speed, samples=3)
    inward = -(2.5 * 0.32 + 4.0 * 0.64) * speed**2
    elbow = robot.joint_names.index('elbow_joint')
    np.testing.assert_allclose(found.force[0, elbow, :2], [inward, 0.0], rtol=0, atol=1e-8)


@pytest.mark.parametrize('speed_deg', [36.0, 180.0])
def test_the_free_vehicle_gives_nearly_the_same(speed_deg: float) -> None:
    """Standing on its wheels with 1 kg, all torques are within 0.5 N m of those on a fixed base."""
    robot, payload = load().settings.robot, Payload(1.0)
    ways = [
        sweep(robot, START, 'elbow_joint', np.radians(speed_deg), payload=payload, free=free)
        for free in (False, True)
    ]
    np.testing.assert_allclose(ways[1].rate, ways[0].rate, rtol=0, atol=0.02)
    np.testing.assert_allclose(ways[1].effort, ways[0].effort, rtol=0, atol=0.5)
    assert ways[1].lean.max() < np.radians(0.05)


def test_the_paper_s_load_tips_the_free_vehicle() -> None:
    """With 4 kg and flippers stowed the sweep of the paper tips PackBot on level ground."""
    found = sweep(
        load().settings.robot, START, 'elbow_joint', np.radians(36.0), turn=-np.pi / 3, free=True
    )
    assert found.lean.max() > np.radians(10.0)
