"""The words for a margin: short, and never better than the margin is."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.margin_words import (
    degrees_words,
    rate_words,
    share_words,
    tipping_words,
)


@pytest.mark.parametrize(
    ('degrees', 'words'),
    [
        (6.0, '6 deg to tipping: RIGHT'),
        (5.96, '5.9 deg to tipping: RIGHT'),
        (34.9, '34 deg to tipping: RIGHT'),
        (-1.4, '1.4 deg past tipping: RIGHT'),
        (-1.41, '1.5 deg past tipping: RIGHT'),
        (-18.04, '18 deg past tipping: RIGHT'),
        (-35.0, '35 deg past tipping: RIGHT'),
        (0.0, '0 deg to tipping: RIGHT'),
    ],
)
def test_tilt_left_is_said_with_its_side_in_capitals(degrees: float, words: str) -> None:
    """The side is the direction of the fall, and stands where it cannot be misread."""
    assert tipping_words('right', math.radians(degrees)) == words


def test_what_is_not_known_is_a_dash() -> None:
    """NaN is never a number of degrees or percent."""
    assert degrees_words(math.nan) == share_words(math.nan) == '-'


@given(st.floats(0.0, 3.0), st.integers(0, 300))
def test_a_share_never_reads_as_a_limit_it_has_not_reached(share: float, limit: int) -> None:
    """Whatever whole percent the limit is: below it no number reads like it or more."""
    if 100.0 * share < limit - 1e-6:
        assert int(share_words(share).removesuffix(' %')) < limit


@given(st.floats(-90.0, 90.0), st.integers(-9, 90))
def test_tilt_left_never_reads_as_more_than_there_is(degrees: float, limit: int) -> None:
    """Below a limit of whole degrees no number reads like the limit or more."""
    if degrees < limit - 1e-6:
        assert float(degrees_words(math.radians(degrees)).removesuffix(' deg')) < limit


def test_speeds_are_in_degrees_for_people() -> None:
    """Nobody thinks in rad/s; lengths stay metres."""
    assert rate_words(0.63, 'rad/s') == '36 deg/s'
    assert rate_words(0.25, 'm/s') == '0.25 m/s'
