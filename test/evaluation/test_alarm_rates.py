"""How many alerts an operator got, by the measures of EEMUA 191: average, peak and floods."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.summary import alarm_rates, rates_result

S = 1_000_000_000
WINDOW = 600 * S


@given(st.lists(st.integers(0, 6 * WINDOW), max_size=80))
def test_the_peak_is_that_of_all_windows(starts: list[int]) -> None:
    """No ten minutes that end with an alert hold more than the peak, and one holds as many."""
    counts = [sum(t - WINDOW < s <= t for s in starts) for t in starts]
    assert alarm_rates(starts, 0, 6 * WINDOW).peak == max(counts, default=0)


@given(st.lists(st.integers(0, 3 * WINDOW), max_size=80))
def test_there_is_a_flood_just_where_more_than_ten_come_in_ten_minutes(starts: list[int]) -> None:
    """A flood begins above ten in ten minutes, lasts while five are left, and never overlaps."""
    rates = alarm_rates(starts, 0, 10 * WINDOW)
    assert bool(rates.floods) is (rates.peak > 10)
    for begin, end in rates.floods:
        assert sum(begin - WINDOW < s <= begin for s in starts) > 10
        assert sum(end - WINDOW < s <= end for s in starts) < 5


def test_an_hour_with_six_alerts_is_manageable() -> None:
    """Six alerts in an hour are manageable by EEMUA 191; the seventh is one too many."""
    starts = [k * WINDOW for k in range(6)]
    assert alarm_rates(starts, 0, 6 * WINDOW).manageable
    assert not alarm_rates([*starts, 5], 0, 6 * WINDOW).manageable


def seconds(*starts: float, begin: float = 100.0) -> list[int]:
    """Return times (ns) so many seconds after a recording's start at `begin` (s)."""
    return [round((begin + s) * S) for s in starts]


def test_a_flood_lasts_from_the_eleventh_alert_until_four_are_left() -> None:
    """Eleven a second apart: it begins with the last; ten minutes after the seventh it ends."""
    starts = seconds(*range(11))
    (flood,) = alarm_rates(starts, 100 * S, 7200 * S).floods
    assert flood == (starts[10], starts[6] + WINDOW)


def test_ten_alerts_are_no_flood() -> None:
    """Ten alerts in ten minutes are no flood, however close together they come."""
    assert alarm_rates(seconds(*[0.0] * 10), 0, 7200 * S).floods == ()


def test_an_alert_ten_minutes_later_finds_the_window_empty() -> None:
    """An alert leaves the ten-minute window exactly 600 s later."""
    assert alarm_rates([0, WINDOW], 0, 2 * WINDOW).peak == 1
    assert alarm_rates([0, WINDOW - 1], 0, 2 * WINDOW).peak == 2


def test_a_flood_ends_with_the_recording() -> None:
    """A recording that starts at 100 s and lasts 300 s ends at 400 s."""
    starts = seconds(*range(11))
    assert alarm_rates(starts, 100 * S, 300 * S).floods == ((110 * S, 400 * S),)


def test_floods_are_told_apart_when_the_first_has_ended() -> None:
    """Eleven at once, eleven at once an hour later: two; a few in between do not begin another."""
    starts = seconds(*[0.0] * 11, *[1200.0] * 10, *[3600.0] * 11)
    floods = alarm_rates(starts, 100 * S, 7200 * S).floods
    assert floods == ((100 * S, 700 * S), (3700 * S, 4300 * S))


def test_five_in_ten_minutes_keep_a_flood_going() -> None:
    """Six new ones come before the eleven have gone: it lasts until two of them have gone too."""
    starts = seconds(*[0.0] * 11, *(400.0 + k for k in range(6)))
    assert alarm_rates(starts, 100 * S, 7200 * S).floods == ((100 * S, 1101 * S),)


@pytest.mark.parametrize(('minutes', 'average'), [(20, 2.0), (10, 4.0), (5, 4.0), (0, 4.0)])
def test_a_run_shorter_than_ten_minutes_counts_as_ten(minutes: int, average: float) -> None:
    """The alarm rate of a run shorter than ten minutes is per ten minutes."""
    rates = alarm_rates(seconds(1.0, 2.0, 3.0, 4.0), 100 * S, minutes * 60 * S)
    assert (rates.raised, rates.average, rates.peak) == (4, average, 4)


def test_a_flood_is_not_manageable_however_long_the_run() -> None:
    """Eleven alerts in two hours are fewer than one in ten minutes, but came at once."""
    rates = alarm_rates(seconds(*[0.0] * 11), 100 * S, 7200 * S)
    assert rates.average < 1.0
    assert not rates.manageable


def test_the_result_counts_times_from_the_start() -> None:
    """Alarm floods in a result are dated in seconds from the recording's start."""
    assert rates_result(seconds(*range(11)), 100 * S, 1200 * S) == {
        'raised': 11,
        'per_10_min': 5.5,
        'peak_in_10_min': 11,
        'floods_s': [[10.0, 606.0]],
        'manageable': False,
    }


def test_no_alert_is_manageable() -> None:
    """A recording without an alert is manageable, with every count 0."""
    assert rates_result([], 0, 60 * S) == {
        'raised': 0, 'per_10_min': 0.0, 'peak_in_10_min': 0, 'floods_s': [], 'manageable': True,
    }  # fmt: skip
