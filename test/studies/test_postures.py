"""Sets of postures: each joint in its range, one joint a sweep."""

import math
from dataclasses import replace

import numpy as np
import pytest
from robots import tracked

from ugv_acceptance.model.robot import Joint, Link, Robot
from ugv_acceptance.studies.postures import joint_range, random_postures, sweeps

FREE, SLIDES = Joint('free', 'continuous', 'a', 'b'), Joint('slides', 'prismatic', 'a', 'b')
RANGES = [
    (FREE, (-math.pi, math.pi)),
    (SLIDES, (0.0, 0.0)),
    (replace(FREE, lower=-0.5), (-0.5, math.pi)),
    (replace(FREE, upper=0.75), (-math.pi, 0.75)),
    (replace(SLIDES, lower=-0.1, upper=0.3), (-0.1, 0.3)),
]


@pytest.mark.parametrize(('joint', 'expected'), RANGES)
def test_a_joint_has_the_range_of_its_limits(joint: Joint, expected: tuple[float, float]) -> None:
    """Without any a full turn; one that slides stays where it is."""
    robot = Robot('r', (Link('a', 1.0), Link('b', 1.0)), (joint,), (joint.name,))
    assert joint_range(robot, joint.name) == expected


def test_random_postures_fill_the_ranges() -> None:
    """Evenly, the same for one seed, others for another."""
    found = random_postures(tracked(), 2_000, seed=1)
    assert found.shape == (2_000, 4)
    assert np.abs(found).max() <= math.pi
    np.testing.assert_allclose(found.mean(axis=0), 0.0, atol=0.2)
    np.testing.assert_allclose(found.std(axis=0), math.pi / math.sqrt(3.0), rtol=0.05)
    np.testing.assert_array_equal(found, random_postures(tracked(), 2_000, seed=1))
    assert not np.array_equal(found, random_postures(tracked(), 2_000, seed=2))


def test_a_sweep_moves_one_joint() -> None:
    """Over its limits; without any over a turn from zero, as the paper does."""
    robot = tracked()
    shoulder = robot.joint('shoulder')
    limited = tuple(
        replace(joint, lower=-0.5, upper=1.5) if joint is shoulder else joint
        for joint in robot.joints
    )
    found = sweeps(replace(robot, joints=limited), [0.1, 0.2, 0.3, 0.4], 11)
    for k, (low, high) in enumerate(
        [(0.0, 2.0), (-0.5 / math.pi, 1.5 / math.pi), *[(0.0, 2.0)] * 2]
    ):
        expected = np.tile([0.1, 0.2, 0.3, 0.4], (11, 1))
        expected[:, k] = math.pi * np.linspace(low, high, 11)
        np.testing.assert_allclose(found[k], expected)
