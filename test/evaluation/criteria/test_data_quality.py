"""What can be demanded of the data: each number is that of the result, of the run or an input."""

from typing import Any

import pytest

from ugv_acceptance.evaluation.criteria.quantities import DATA, measured_of, unit_of

RESULT: dict[str, Any] = {
    'coverage': {'fraction': 0.97, 'duration_s': 61.5, 'longest_unseen_s': 1.8},
    'bag': {
        'protected': 'all', 'salvaged': None, 'lost_messages': 7,
        'findings': ['one', 'two', 'three'],
    },
    'inputs': {
        'late_messages': 4,
        'joint_states': {
            'messages': 500, 'rate_hz': 49.5, 'gaps': 2, 'longest_gap_s': 0.7, 'malformed': 6,
            'faults': {'FROZEN': 1},
        },
        'imu': {
            'messages': 900, 'rate_hz': None, 'gaps': 0, 'longest_gap_s': 0.1, 'malformed': 0,
            'faults': {},
        },
    },
}  # fmt: skip
OF_RUN = {
    'coverage': 0.97, 'duration': 61.5, 'protected': 1.0, 'salvaged': 0.0, 'findings': 3.0,
    'late_messages': 4.0, 'lost_messages': 7.0, 'longest_unseen': 1.8,
}  # fmt: skip
OF_INPUTS = {
    'messages': (500.0, 900.0), 'rate': (49.5, None), 'gaps': (2.0, 0.0),
    'longest_gap': (0.7, 0.1), 'malformed': (6.0, 0.0), 'faults': (1.0, 0.0),
}  # fmt: skip


def test_every_quantity_is_of_the_run_or_of_an_input() -> None:
    """There are fourteen: eight of the run, six of each input."""
    assert {*DATA} == {*OF_RUN, *OF_INPUTS}


@pytest.mark.parametrize(('quantity', 'number'), OF_RUN.items())
def test_a_number_of_the_run_is_one_number(quantity: str, number: float) -> None:
    """It stands under the run's name."""
    assert measured_of(quantity, None, RESULT) == {'run': number}


@pytest.mark.parametrize(('quantity', 'numbers'), OF_INPUTS.items())
def test_a_number_of_an_input_is_asked_of_one_or_both(
    quantity: str, numbers: tuple[float, float | None]
) -> None:
    """Without a name of both; a rate that nobody could measure stays unknown."""
    joints, imu = numbers
    assert measured_of(quantity, None, RESULT) == {'joint_states': joints, 'imu': imu}
    assert measured_of(quantity, 'joint_states', RESULT) == {'joint_states': joints}
    assert measured_of(quantity, 'imu', RESULT) == {'imu': imu}


@pytest.mark.parametrize(('protected', 'share'), [('all', 1.0), ('part', 0.5), ('none', 0.0)])
def test_checksums_of_some_chunks_count_half(protected: str, share: float) -> None:
    """The checksum quantity is 1 if all chunks have one, 0.5 if some have, 0 if none has."""
    result = RESULT | {'bag': RESULT['bag'] | {'protected': protected}}
    assert measured_of('protected', None, result) == {'run': share}


def test_a_file_that_breaks_off_counts_one() -> None:
    """A recording that breaks off counts as 1 in the quantity for salvaged files."""
    result = RESULT | {'bag': RESULT['bag'] | {'salvaged': {'bytes': 0}}}
    assert measured_of('salvaged', None, result) == {'run': 1.0}


def test_only_times_and_rates_have_a_unit() -> None:
    """Of the data quantities only times and rates have a unit."""
    units = {name: unit_of(name) for name in DATA if unit_of(name)}
    assert units == {'longest_unseen': 's', 'duration': 's', 'rate': 'Hz', 'longest_gap': 's'}
