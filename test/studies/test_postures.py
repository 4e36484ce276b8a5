"""Sets of postures: each joint in its range, one joint a sweep."""

import math
from dataclasses import replace

import numpy as np
from robots import tracked

from ugv_acceptance.studies.postures import random_postures, sweeps


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
