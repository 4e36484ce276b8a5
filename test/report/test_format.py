"""Numbers of a result as a person reads them: with units, limits, and what speaks against them."""

from typing import Any

import pytest

from ugv_acceptance.report.format import (
    DASH,
    doubts_of,
    hours_text,
    limit_text,
    missing_text,
    number_text,
    time_text,
    worst_text,
)


def of_data(quantity: str, unit: str, **bounds: float | None) -> dict[str, Any]:
    """Return what a criterion on the data measured."""
    values = {'joint_states': 0.5, 'imu': None}
    return {
        'quantity': quantity, 'unit': unit, 'values': values, 'least': None, 'most': None, **bounds
    }  # fmt: skip


@pytest.mark.parametrize(
    ('measured', 'limit', 'worst'),
    [
        (
            of_data('coverage', '', least=0.95),
            'at least 95.0 %',
            f'joint_states 50.0 %, imu {DASH}',
        ),
        (of_data('longest_gap', 's', most=0.2), 'at most 0.2 s', f'joint_states 0.5 s, imu {DASH}'),
        (
            of_data('rate', 'Hz', least=90.0, most=110.0),
            'at least 90 Hz, at most 110 Hz',
            f'joint_states 0.5 Hz, imu {DASH}',
        ),
        ({'alerts': 0, 'evaluated_s': 3.0}, DASH, 'no alert'),
    ],
)
def test_what_is_demanded_of_the_data_stands_beside_what_was_measured(
    measured: dict[str, Any], limit: str, worst: str
) -> None:
    """Both in one unit; what is unknown is a dash."""
    assert (limit_text(measured), worst_text(measured)) == (limit, worst)


@pytest.mark.parametrize(
    ('messages', 'rate', 'text'),
    [(1580, 100.0, '21 % missing'), (1990, 100.0, ''), (2400, 100.0, ''), (3, None, '')],
)
def test_messages_that_are_missing_by_their_rate_are_told(
    messages: int, rate: float | None, text: str
) -> None:
    """In 20 s at 100 Hz 2000 should have come; without a rate nobody can say."""
    assert missing_text({'messages': messages, 'rate_hz': rate}, 20.0) == text


def test_what_the_efforts_say_is_a_doubt_unless_it_is_a_reason_already() -> None:
    """Findings about efforts stand beside the verdict, once."""
    result = {'reasons': ['a load'], 'model_check': {'findings': ['a load', 'a sign']}}
    assert doubts_of(result) == ['a sign']


@pytest.mark.parametrize(
    ('hours', 'text'),
    [
        (None, DASH),
        (0.0, '0 s'),
        (0.0002, '0.72 s'),
        (0.006675, '24 s'),
        (0.0533, '3.2 min'),
        (1.0, '60 min'),
        (4.5, '4.5 h'),
        (37.24, '37.2 h'),
        (154.53, '154.5 h'),
        (221.0, '221 h'),
        (12345.6, '12,345.6 h'),
        (1e9, '1,000,000,000 h'),
    ],
)
def test_hours_are_told_in_the_unit_that_fits(hours: float | None, text: str) -> None:
    """No exponent, no row of zeros: 24 s is not 0.006675 h."""
    assert hours_text(hours) == text


def test_a_time_that_is_none_ends_no_report() -> None:
    """A time of NaN is shown as such and does not end a report."""
    assert time_text(float('nan')) == 'nan s'


@pytest.mark.parametrize(
    ('value', 'text'),
    [(19289181967339508.0, '1.93e+16 kg'), (-2e6, '-2e+06 kg'), (999999.0, '999999.0 kg')],
)
def test_a_long_number_is_shortened(value: float, text: str) -> None:
    """A number of sixteen digits is shortened to fit a column."""
    assert number_text(value, 1, 'kg') == text
