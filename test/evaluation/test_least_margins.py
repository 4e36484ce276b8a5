"""Which margins are the least at one moment, in the same words for everybody who tells them."""

import math
from dataclasses import replace
from itertools import permutations

import pytest

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.least_margins import least_tilt, most_used, with_most_used
from ugv_acceptance.evaluation.settings import Settings

PACKBOT = load().settings
NAMES = PACKBOT.robot.joint_names


def limited(*torque: float) -> Settings:
    """Return settings with these torque limits."""
    return replace(PACKBOT, limits=replace(PACKBOT.limits, torque=torque))


@pytest.mark.parametrize(
    ('angles', 'side', 'left'),
    [
        ((0.5, 0.4, 0.3, 0.6), 'rear', 0.3),
        ((0.5, -0.1, math.inf, 0.0), 'left', -0.1),
        ((0.3, 0.2, 0.3, 0.2), 'left', 0.2),
        ((math.nan, math.inf, 0.7, math.nan), 'rear', 0.7),
    ],
)
def test_the_least_tilt_is_that_of_a_side_with_an_edge(
    angles: tuple[float, ...], side: str, left: float
) -> None:
    """A side without an edge, or of which nothing is known, is none; of two alike the first."""
    assert least_tilt(angles) == (side, left)


@pytest.mark.parametrize('nothing', [math.nan, math.inf])
def test_without_any_edge_there_is_no_least_tilt(nothing: float) -> None:
    """No side, and not a number: never 0."""
    side, left = least_tilt((nothing,) * 4)
    assert side == ''
    assert math.isnan(left)


@pytest.mark.parametrize('torque', permutations((1.0, -30.0, 12.0, 2.0)))
def test_the_joint_most_used_has_the_largest_share_of_its_limit(torque: tuple[float, ...]) -> None:
    """Not the largest torque; the sign does not count."""
    limits = (10.0, 100.0, 50.0, math.inf)
    shares = [abs(tau) / limit for tau, limit in zip(torque, limits, strict=True)]
    name, use = most_used(torque, limited(*limits))
    assert (name, use) == (NAMES[shares.index(max(shares))], max(shares))


def test_a_joint_without_limit_or_number_is_not_the_most_used() -> None:
    """Nothing is said of it; of two alike the first of the robot is told."""
    settings = limited(math.inf, 10.0, 10.0, 10.0)
    assert most_used((99.0, 5.0, 5.0, math.nan), settings) == (NAMES[1], 0.5)
    assert with_most_used('tilt', (99.0, 5.0, 5.0, 0.0), settings) == (
        f'tilt, {NAMES[1]} 50 % of its limit'
    )
    assert with_most_used('tilt', (1.0,) * 4, limited(*[math.inf] * 4)) == 'tilt'
