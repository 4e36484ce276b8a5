"""What a console reads from the values of the monitor's verdict."""

import math

import pytest

from ugv_acceptance.console.monitor_values import countdown_of, load_of, number_of, same_load
from ugv_acceptance.console.snapshot import Countdown
from ugv_acceptance.model.robot import Payload

TIP = {'tip_in_s': '1.2', 'tip_of': 'right'}
JOINT = {'saturation_in_s': '0.7', 'saturation_of': 'elbow_joint'}


@pytest.mark.parametrize(
    ('values', 'age', 'found'),
    [
        ({}, 0.0, None),
        ({'tip_in_s': 'soon'}, 0.0, None),
        ({'tip_in_s': 'nan'}, 0.0, None),
        (TIP, 0.0, Countdown(tips=True, subject='right', seconds=1.2)),
        (TIP, 0.5, Countdown(tips=True, subject='right', seconds=0.7)),
        (TIP, 3.0, Countdown(tips=True, subject='right', seconds=0.0)),
        (TIP | JOINT, 0.0, Countdown(tips=False, subject='elbow_joint', seconds=0.7)),
    ],
)
def test_the_margin_that_ends_first_counts_down(
    values: dict[str, str], age: float, found: Countdown | None
) -> None:
    """Of tipping and saturation the sooner, less the age of the verdict; never below 0."""
    shown = countdown_of(values, age)
    if found is None or shown is None:
        assert shown is found
    else:
        assert (shown.tips, shown.subject) == (found.tips, found.subject)
        assert shown.seconds == pytest.approx(found.seconds)


@pytest.mark.parametrize(
    'values',
    [
        {},
        {'payload_kg': '2.5'},
        {'payload_kg': '2.5', 'payload_cog_m': '1,2'},
        {'payload_kg': '2.5', 'payload_cog_m': '1,2,x'},
        {'payload_kg': 'nan', 'payload_cog_m': '1,2,3'},
    ],
)
def test_a_load_that_is_not_told_whole_is_not_known(values: dict[str, str]) -> None:
    """A mass without its place, or what is no number, is no load."""
    assert load_of(values) is None
    assert math.isnan(number_of({'active_s': '?'}, 'active_s'))


def test_a_load_is_the_same_as_far_as_it_was_told() -> None:
    """Six digits are told: a load with more is the same, one that differs in them is not."""
    told = load_of({'payload_kg': '0.453592', 'payload_cog_m': '0.1,0,-0.02'})
    assert told is not None
    assert same_load(told, Payload(0.45359237, (0.1, 0.0, -0.02)))
    assert not same_load(told, Payload(0.4537, (0.1, 0.0, -0.02)))
    assert not same_load(told, Payload(0.45359237, (0.1, 0.001, -0.02)))
