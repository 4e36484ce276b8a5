"""Margins a little ahead, against scipy's rotations and straight lines."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.prediction import (
    gravity_ahead,
    margins_ahead,
    time_to,
    time_to_saturation,
    time_to_tip,
)
from ugv_acceptance.model.stability import margins

ROBOT = load().settings.robot
LEVEL = np.array([0.0, 0.0, -9.81])
small = st.floats(-3.0, 3.0, allow_subnormal=False)


@given(arrays(np.float64, 3, elements=small), st.floats(0.0, 2.0))
def test_gravity_turns_against_the_base(omega: np.ndarray, seconds: float) -> None:
    """In axes that turn at omega a fixed vector turns by the inverse rotation: scipy agrees."""
    expected = Rotation.from_rotvec(omega * seconds).inv().apply(LEVEL)
    assert gravity_ahead(LEVEL, omega, seconds) == pytest.approx(expected, abs=1e-9)


def test_at_rest_the_future_is_the_present() -> None:
    """Without rates, or with unknown ones, the margins ahead are those of now."""
    q = np.radians([[0.0, 60.0, -40.0, 180.0]])
    now = margins(ROBOT, q, LEVEL)
    for rate in (np.zeros_like(q), np.full_like(q, np.nan)):
        then = margins_ahead(ROBOT, q, rate, LEVEL, np.zeros(3), 0.5)
        assert then.torque == pytest.approx(now.torque)
        assert then.angle == pytest.approx(now.angle)


def test_a_roll_rate_is_tilt_lost() -> None:
    """A rigid robot that rolls loses tilt at that rate: the time to tip is their quotient."""
    q, rate = np.radians([0.0, 115.0, -140.0, 180.0]), 0.2
    now = margins(ROBOT, q, LEVEL)
    then = margins_ahead(ROBOT, q, np.zeros(4), LEVEL, np.array([rate, 0.0, 0.0]), 0.5)
    right = now.angle[..., 3]
    assert time_to_tip(now.angle, then.angle, 0.0, 0.5) == pytest.approx(right / rate, rel=1e-6)


@example(0.0, 2e-313, 1.0)
@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(0.1, 5.0))
def test_a_straight_line_reaches_its_limit_in_time(start: float, rate: float, limit: float) -> None:
    """Start + rate t = limit: closed form; never where it does not rise, now where it is there."""
    found = float(time_to(limit, start, start + rate * 0.5, 0.5))
    if start >= limit:
        assert found == 0.0
    elif start + rate * 0.5 <= start:
        assert found == np.inf
    elif rate >= 1e-8:
        assert start + rate * found == pytest.approx(limit, rel=1e-6, abs=1e-6)
    else:  # the rise is lost in the digits of the two values
        assert found >= 0.0


def test_what_is_not_known_has_no_time() -> None:
    """NaN stays NaN; it is never taken for safe or for dangerous."""
    assert np.isnan(time_to(1.0, np.nan, 2.0, 0.5))
    assert np.isnan(time_to_tip([0.1, np.nan, 0.3, 0.2], [0.1, 0.1, 0.1, 0.1], 0.0, 0.5))


def test_saturation_counts_either_sign() -> None:
    """A torque that falls to minus its limit saturates too."""
    found = time_to_saturation([-40.0, 40.0], [-45.0, 45.0], [50.0, 50.0], 0.5)
    assert found == pytest.approx([1.0, 1.0])
