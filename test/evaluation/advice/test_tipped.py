"""After a fall: whether a robot has tipped, and that nothing but to stand clear is said then."""

import math

import pytest

from ugv_acceptance.evaluation.advice.tipped import TIPPED, has_tipped


@pytest.mark.parametrize(
    ('left', 'tipped'),
    [
        ((5.0, 5.0, 5.0, 5.0), False),
        ((5.0, -9.9, 5.0, 5.0), False),
        ((5.0, -10.0, 5.0, 5.0), True),
        ((math.inf, -35.0, math.nan, 80.0), True),
        ((math.nan,) * 4, False),
        ((math.inf,) * 4, False),
        ((), False),
    ],
)
def test_it_has_tipped_from_ten_degrees_past_on(left: tuple[float, ...], tipped: bool) -> None:
    """One side ten degrees past tipping is a fall; what is not known or has no edge is none."""
    assert math.degrees(TIPPED) == pytest.approx(10.0)
    assert has_tipped([math.radians(x) for x in left]) is tipped
