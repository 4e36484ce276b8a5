"""A joint as data: what kind it is, its units, its travel."""

import math
from dataclasses import replace

import pytest

from ugv_acceptance.model.robot import SLIDING, TURNING, Joint

FREE, SLIDES = Joint('free', 'continuous', 'a', 'b'), Joint('slides', 'prismatic', 'a', 'b')
TRAVELS = [
    (FREE, 0.0, (-math.pi, math.pi)),
    (FREE, 1.0, (-math.pi, math.pi)),
    (SLIDES, 0.0, (0.0, 0.0)),
    (SLIDES, 1.0, (-1.0, 1.0)),
    (replace(FREE, lower=-0.5), 0.0, (-0.5, math.pi)),
    (replace(FREE, upper=0.75), 0.0, (-math.pi, 0.75)),
    (replace(SLIDES, lower=-0.1, upper=0.3), 1.0, (-0.1, 0.3)),
]


@pytest.mark.parametrize(('joint', 'half', 'expected'), TRAVELS)
def test_a_joint_travels_from_limit_to_limit(
    joint: Joint, half: float, expected: tuple[float, float]
) -> None:
    """Without limits one turn; one that slides stays where it is, or goes as far as is said."""
    assert joint.travel(half) == expected


def test_where_a_joint_stays_is_zero_without_a_sign() -> None:
    """People read 0, not -0."""
    assert [math.copysign(1.0, end) for end in SLIDES.travel()] == [1.0, 1.0]


@pytest.mark.parametrize('kind', ['revolute', 'continuous', 'prismatic', 'fixed'])
def test_only_a_prismatic_joint_slides(kind: str) -> None:
    """It is measured in m, m/s and N, the others in rad, rad/s and N m."""
    joint = replace(FREE, kind=kind)
    assert joint.slides == (kind == 'prismatic')
    assert joint.units == (SLIDING if joint.slides else TURNING)
    assert (SLIDING.position, SLIDING.rate, SLIDING.effort) == ('m', 'm/s', 'N')
    assert (TURNING.position, TURNING.rate, TURNING.effort) == ('rad', 'rad/s', 'N m')
