"""Intervals of an angle against a fine grid, and their seams at a full turn."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.studies.intervals import (
    TURN,
    Intervals,
    intersect,
    length,
    merge,
    where_cosine_between,
    wrap,
)

bounds = st.floats(-1.3, 1.3)


def holds(intervals: Intervals, x: float) -> bool:
    """Return whether a position lies in one of the intervals."""
    return any(start <= x <= end for start, end in intervals)


@given(bounds, bounds, st.floats(-10.0, 10.0))
def test_a_cosine_lies_between_its_bounds_where_it_is_said_to(
    lower: float, upper: float, shift: float
) -> None:
    """On a grid over the turn, but beside the ends; intervals are in order and apart."""
    found = where_cosine_between(lower, upper, shift)
    for x in np.linspace(0.0, TURN, 101).tolist():
        cosine = math.cos(x - shift)
        if min(abs(cosine - lower), abs(cosine - upper)) > 1e-9:
            assert holds(found, x) == (lower < cosine < upper)
    ends = [end for interval in found for end in interval]
    assert ends == sorted(ends)
    assert all(0.0 <= end <= TURN + 1e-12 for end in ends)


@pytest.mark.parametrize(
    ('start', 'end', 'parts'),
    [
        (0.5, 1.5, [(0.5, 1.5)]),
        (TURN + 0.5, TURN + 1.5, [(0.5, 1.5)]),
        (-0.5, 0.5, [(TURN - 0.5, TURN), (0.0, 0.5)]),
        (0.0, TURN, [(0.0, TURN)]),
    ],
)
def test_an_interval_is_cut_at_the_full_turn(
    start: float, end: float, parts: list[tuple[float, float]]
) -> None:
    """An interval of an angle is split at the full turn, whichever turn it is given in."""
    np.testing.assert_allclose(wrap(start, end), parts)


def test_intervals_that_touch_become_one() -> None:
    """Intervals that touch or contain each other are merged; a gap is kept."""
    assert merge([(2.0, 3.0), (0.0, 1.0), (1.0, 1.5), (0.2, 0.4)]) == ((0.0, 1.5), (2.0, 3.0))
    assert merge([]) == ()


def test_both_hold_where_intervals_overlap() -> None:
    """The intersection of intervals may be a point; its length is the sum of the parts."""
    a, b = ((0.0, 2.0), (3.0, 4.0)), ((1.0, 3.5), (5.0, 6.0))
    assert intersect(a, b) == ((1.0, 2.0), (3.0, 3.5))
    assert length(intersect(a, b)) == 1.5
    assert intersect(((0.0, 1.0),), ((1.0, 2.0),)) == ((1.0, 1.0),)
    assert intersect(((0.0, 1.0),), ((1.5, 2.0),)) == ()
