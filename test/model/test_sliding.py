"""Whether tracks slide before the robot tips, for slopes whose angle is known."""

import math

import numpy as np
import pytest

from ugv_acceptance.model.sliding import slide_left, slides_first


def on_slope(angle: float, heading: float) -> tuple[float, float, float]:
    """Return gravity on a slope (rad) that falls towards a heading."""
    s = 9.81 * math.sin(angle)
    return s * math.cos(heading), s * math.sin(heading), -9.81 * math.cos(angle)


@pytest.mark.parametrize('heading', [0.0, 0.7, 2.0, -2.5])
@pytest.mark.parametrize('slope', [0.0, 0.2, 1.0, 2.0])
def test_what_is_left_is_the_angle_of_friction_less_the_slope(slope: float, heading: float) -> None:
    """Also of a robot beyond the vertical; without friction known it is infinite."""
    gravity = on_slope(slope, heading)
    assert float(slide_left(gravity, 0.5)) == pytest.approx(math.atan(0.5) - slope)
    assert float(slide_left(gravity, math.inf)) == math.inf


def test_it_slides_first_only_where_less_slope_than_tilt_is_left() -> None:
    """Minus what is left where it does; as much of both, or no friction known: it tips."""
    gravity = on_slope(0.2, 0.5)
    left = float(slide_left(gravity, 0.5))
    least = np.array((left + 1e-6, left, left - 1e-6))
    many = tuple(np.full(3, g) for g in gravity)
    assert slides_first(many, least, 0.5).tolist() == pytest.approx([-left, -math.inf, -math.inf])
    assert slides_first(many, least, math.inf).tolist() == [-math.inf] * 3
    assert float(slides_first(on_slope(0.6, 0.0), 0.1, 0.5)) == pytest.approx(0.6 - math.atan(0.5))
