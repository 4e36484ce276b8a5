"""Named orientations and the flippers' way to the ground."""

import math

import numpy as np
import pytest
from robots import paper_arm, tracked

from ugv_acceptance import BadConfig
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.studies.orientations import ORIENTATIONS, gravity_of, grounding_angle


@pytest.mark.parametrize('name', ORIENTATIONS)
def test_a_tilt_is_what_it_says(name: str) -> None:
    """Gravity keeps its size and leaves the base's z axis by the tilt; level by nothing."""
    g = np.array(gravity_of(name, 0.5))
    assert np.linalg.norm(g) == pytest.approx(9.81)
    assert math.acos(-g[2] / 9.81) == pytest.approx(0.0 if name == 'level' else 0.5)


@pytest.mark.parametrize(
    ('name', 'low'),
    [('right', (0, -1)), ('left', (0, 1)), ('nose-down', (1, 0)), ('nose-up', (-1, 0))],
)
def test_gravity_points_to_the_low_side(name: str, low: tuple[int, int]) -> None:
    """REP-103: x forward, y left."""
    x, y, _ = gravity_of(name, math.pi / 6.0)
    assert (x, y) == pytest.approx((4.905 * low[0], 4.905 * low[1]), abs=1e-12)


def test_flippers_reach_the_ground() -> None:
    """At the grounding angle the flippers' contacts are as high as the tracks' plane."""
    robot = tracked()
    angle = grounding_angle(robot, 'flippers')
    posture = posture_of(mechanics_of(robot), [0.0, 0.0, 0.0, angle], 0.0, (0.0, 0.0, 0.0))
    assert posture.contacts[4][2] == pytest.approx(0.0, abs=1e-12)
    assert abs(angle) < math.pi / 2.0


def test_a_joint_without_contacts_reaches_nothing() -> None:
    """A joint that moves no contact point is refused by name as a flipper."""
    with pytest.raises(BadConfig, match='joint elbow: expected it to bring a contact'):
        grounding_angle(tracked(), 'elbow')
    with pytest.raises(BadConfig, match='joint elbow'):
        grounding_angle(paper_arm(), 'elbow')
