"""The static margin of a moving joint on a slope: right for slow motion, not for fast motion."""

import numpy as np
import pytest

from bench.arm_motion import (
    ArmMotion,
    path_of,
    random_motions,
    static_margin,
    tips,
)
from ugv_acceptance.config import load
from ugv_acceptance.simulation.tip_cases import least_angle
from ugv_acceptance.simulation.vehicle import gravity_on_slope

ARM = ('turret_joint', 'shoulder_joint', 'elbow_joint')
SLOW, FAST = np.radians(7.2), np.radians(180.0)


@pytest.fixture(scope='module')
def motions() -> list[ArmMotion]:
    """Return motions of which half tip by the static margin, half have 1 to 3 deg left."""
    bounds = [float(x) for x in np.radians([-6.0, -1.0, 1.5, 3.0])]
    robot = load().settings.robot
    found = random_motions(robot, ARM, 9, seed=4, margins=bounds)
    return [m for m in found if abs(static_margin(robot, m)) > np.radians(1.0)]


def test_slow_motion_tips_when_the_static_margin_is_gone(motions: list[ArmMotion]) -> None:
    """At the paper's 7.2 deg/s the simulated robot tips exactly where the margin is negative."""
    robot = load().settings.robot
    said = [static_margin(robot, m) < 0.0 for m in motions]
    assert [tips(robot, m, SLOW, ramp=0.2) for m in motions] == said
    assert 0 < sum(said) < len(said)


def test_fast_motion_tips_with_static_margin_left(motions: list[ArmMotion]) -> None:
    """At 180 deg/s with short ramps some that the static map calls safe tip."""
    robot = load().settings.robot
    safe = [m for m in motions if static_margin(robot, m) > 0.0]
    assert any(tips(robot, m, FAST, ramp=0.2) for m in safe)


def test_the_static_margin_is_the_least_on_the_way(motions: list[ArmMotion]) -> None:
    """No posture between start and end has less margin than static_margin says."""
    robot = load().settings.robot
    for motion in motions:
        gravity = gravity_on_slope(9.81, *motion.slope)
        left = [
            float(least_angle(robot, q, gravity, motion.payload)) for q in path_of(robot, motion)
        ]
        assert static_margin(robot, motion) == pytest.approx(min(left), abs=1e-12)
