"""Times to a limit, against straight lines."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.alerts.prediction import time_to


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
