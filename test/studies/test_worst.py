"""Worst and safe positions of one joint of any tree, against sweeps and against the paper's arm."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robots import random_robot

from ugv_acceptance import BadConfig
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.studies.intervals import length, where_cosine_between
from ugv_acceptance.studies.planar import PAPER, paper_arm, safe_theta2, worst_theta2
from ugv_acceptance.studies.worst import safe_positions, torque_waves, worst_positions

DOWN = (0.0, 0.0, -9.81)
TURN = 2.0 * math.pi
SWEEP = np.linspace(0.0, TURN, 721)


def case(seed: int) -> tuple[Robot, str, np.ndarray, np.ndarray]:
    """Return a random tree, a turning joint of it, a posture and a gravity."""
    rng = np.random.default_rng(seed)
    while True:
        robot = random_robot(rng, 3)
        turning = [n for n in robot.joint_names if robot.joint(n).kind != 'prismatic']
        if turning:
            q = rng.uniform(-3.0, 3.0, len(robot.joint_names))
            return robot, turning[int(rng.integers(len(turning)))], q, 9.81 * rng.normal(size=3)


def swept(robot: Robot, joint: str, q: np.ndarray, gravity: np.ndarray) -> np.ndarray:
    """Return all torques (n, j) over a sweep of one joint."""
    postures = np.tile(q, (len(SWEEP), 1))
    postures[:, robot.joint_names.index(joint)] = SWEEP
    return static_torque(robot, postures, gravity)


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000))
def test_a_torque_over_one_joint_is_a_wave(seed: int) -> None:
    """Three postures tell the torque at every other position."""
    robot, joint, q, gravity = case(seed)
    waves = torque_waves(robot, q, joint, gravity)
    wave = waves.mean + waves.radius * np.cos(SWEEP[:, None] - waves.phase)
    assert np.allclose(wave, swept(robot, joint, q, gravity), atol=1e-9)


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000))
def test_no_position_is_worse_than_the_worst(seed: int) -> None:
    """The largest |torque| of a fine sweep is not above that at the worst position."""
    robot, joint, q, gravity = case(seed)
    waves, torque = torque_waves(robot, q, joint, gravity), swept(robot, joint, q, gravity)
    for k in range(len(q)):
        for worst in worst_positions(waves, k):
            at = q.copy()
            at[robot.joint_names.index(joint)] = worst
            found = abs(static_torque(robot, at, gravity)[k])
            assert found >= np.abs(torque[:, k]).max() - 1e-8


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), share=st.floats(0.2, 1.2))
def test_safe_positions_are_those_within_all_limits(seed: int, share: float) -> None:
    """Inside the intervals every torque keeps its limit; outside at least one does not."""
    robot, joint, q, gravity = case(seed)
    torque = swept(robot, joint, q, gravity)
    limits = share * np.abs(torque).max(axis=0) + 0.1
    over = (np.abs(torque) - limits).max(axis=1)
    inside = np.zeros(len(SWEEP), dtype=np.bool_)
    for start, end in safe_positions(torque_waves(robot, q, joint, gravity), limits):
        inside |= (start <= SWEEP) & (end >= SWEEP)
    clear = np.abs(over) > 1e-7
    assert ((over <= 0.0) == inside)[clear].all()


@given(theta1=st.floats(0.0, math.pi), limit=st.floats(10.0, 100.0))
def test_the_paper_s_arm_is_a_case_of_it(theta1: float, limit: float) -> None:
    """Worst and safe theta_2 of the general tree are those of equations (3) to (8)."""
    waves = torque_waves(paper_arm(), (theta1, 0.0), 'theta2', DOWN)
    ours = safe_positions(waves, limit)
    assert length(ours) == pytest.approx(length(safe_theta2(PAPER, theta1, limit, limit)), abs=1e-7)
    for worst in worst_positions(waves, 0):
        apart = [abs((worst - root + math.pi) % TURN - math.pi) for root in worst_theta2(theta1)]
        assert min(apart) < 1e-9


def test_a_joint_that_loads_nothing_has_no_worst_position() -> None:
    """The elbow's torque does not depend on a turn of the base about the vertical."""
    waves = torque_waves(paper_arm(), (0.3, 0.0), 'theta2', (0.0, -9.81, 0.0))
    assert worst_positions(waves, 0) == ()
    assert safe_positions(waves, 1.0) == ((0.0, TURN),)


def test_a_sliding_joint_is_refused() -> None:
    """A prismatic joint is refused, because its torques are straight lines."""
    rng = np.random.default_rng(0)
    robot = random_robot(rng, 3)
    while all(joint.kind != 'prismatic' for joint in robot.joints):
        robot = random_robot(rng, 3)
    slides = next(j.name for j in robot.joints if j.kind == 'prismatic')
    with pytest.raises(BadConfig, match='expected a turning joint'):
        torque_waves(robot, [0.0] * len(robot.joint_names), slides, DOWN)


@pytest.mark.parametrize(
    ('lower', 'upper', 'total'),
    [
        (-2.0, 2.0, TURN),
        (-2.0, -1.5, 0.0),
        (0.0, 2.0, math.pi),
        (0.5, -0.5, 0.0),
        (-0.5, 0.5, TURN / 3),
    ],
)
def test_lengths_of_intervals(lower: float, upper: float, total: float) -> None:
    """By hand: a whole turn, none, a half, an empty bound, twice sixty degrees."""
    assert length(where_cosine_between(lower, upper, 0.7)) == pytest.approx(total)
