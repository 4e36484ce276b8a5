"""Timeouts: an input's period is learnt from receipt times, and silence is judged by it."""

import numpy as np
import pytest
from evaluation.streams import MS, T0, S
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.inputs.timeouts import STARTUP, WINDOW, InputTimeout
from ugv_acceptance.evaluation.settings import Delays

_steps = st.lists(st.integers(1, 400), min_size=1, max_size=150)


def times_of(steps: list[int]) -> list[int]:
    """Return receipt times (ns) from intervals in ms."""
    return [T0 + t * MS for t in np.cumsum(steps).tolist()]


@given(_steps, st.lists(st.integers(0, 150), max_size=5))
def test_many_messages_are_as_many_single_ones(steps: list[int], cuts: list[int]) -> None:
    """Limits before and after each message, period and deadline are the same."""
    times = times_of(steps)
    one, many = InputTimeout(Delays()), InputTimeout(Delays())
    expected = []
    for now in times:
        before = one.limit
        one.message(now)
        expected.append((before, one.limit))
    got = []
    for part in np.split(np.array(times), sorted(min(c, len(times)) for c in cuts)):
        if len(part):
            befores, afters = many.messages(part)
            got += list(zip(befores.tolist(), afters.tolist(), strict=True))
    assert got == expected
    assert many.deadline == one.deadline
    np.testing.assert_equal(many.period, one.period)


@given(_steps)
def test_the_period_is_the_median_of_the_last_full_window(steps: list[int]) -> None:
    """Of 32 intervals; until then nothing is known and the start-up limit holds."""
    fresh = InputTimeout(Delays())
    fresh.messages(np.array(times_of(steps)))
    whole = (len(steps) - 1) // WINDOW * WINDOW
    if not whole:
        assert np.isnan(fresh.period)
        assert fresh.limit == STARTUP
        return
    period = float(np.median(np.array(steps[1:])[whole - WINDOW : whole])) * MS
    assert fresh.period == period
    assert fresh.limit == int(max(3 * period, 100 * MS))


@given(
    st.lists(st.tuples(st.integers(1, 3 * S), st.integers(-3 * S, 3 * S)), min_size=1, max_size=40),
    st.integers(0, 40),
    st.sampled_from([1, S, 3 * S]),
)
def test_clock_of_many_is_clock_of_each(pairs: list[tuple[int, int]], cut: int, grain: int) -> None:
    """Clock faults of columns equal those of single messages, in parts and with coarse clocks."""
    times = T0 + np.cumsum([step for step, _ in pairs])
    stamps = (times + [shift for _, shift in pairs]) // grain * grain
    one, many = InputTimeout(Delays()), InputTimeout(Delays())
    expected = []
    for now, stamp in zip(times.tolist(), stamps.tolist(), strict=True):
        expected.append(one.clock(now, stamp))
        one.message(now)
    got = []
    for a, b in zip(np.split(times, [cut]), np.split(stamps, [cut]), strict=True):
        got += many.clocks(a, b).tolist()
        if len(a):
            many.messages(a)
    assert got == expected


@pytest.mark.parametrize(
    ('stamps', 'wrong'),
    [
        ([0, 1], [0.0, 0.0]),
        ([0, 1 + 3600], [0.0, 1.0]),
        ([0, 1 - 3600], [0.0, 1.0]),
        ([-9 * 86400, 1 - 9 * 86400], [1.0, 1.0]),
    ],
)
def test_stamps_that_jump_or_are_days_off_are_a_clock_fault(
    stamps: list[int], wrong: list[float]
) -> None:
    """A second of slack; staleness does not depend on stamps."""
    fresh = InputTimeout(Delays())
    times = np.array([T0, T0 + S])
    assert fresh.clocks(times, T0 + np.array(stamps) * S).tolist() == wrong
    fresh.messages(times)
    assert fresh.deadline == T0 + S + STARTUP


def test_a_frozen_clock_is_a_fault_within_a_second() -> None:
    """Stamps that stand still while messages come are a CLOCK fault within a second."""
    fresh = InputTimeout(Delays())
    wrong = []
    for k in range(40):
        wrong.append(fresh.clock(T0 + k * 50 * MS, T0))
        fresh.message(T0 + k * 50 * MS)
    assert 500 < wrong.index(1.0) * 50 <= 600


def test_columns_learn_the_period_of_a_slow_input() -> None:
    """Columns learn the period of a slow input: stale after three periods of 60 ms."""
    fresh = InputTimeout(Delays())
    _, limits = fresh.messages(T0 + np.arange(100) * 60 * MS)
    assert fresh.period == 60 * MS
    assert limits[-1] == fresh.limit == 180 * MS


def test_columns_of_a_frozen_clock_are_wrong_after_half_a_second() -> None:
    """Not at half a second: only what is longer."""
    times = T0 + np.arange(20) * 50 * MS
    wrong = InputTimeout(Delays()).clocks(times, np.full(20, T0))
    assert np.flatnonzero(wrong)[0] * 50 == 550


def test_no_message_has_no_clock() -> None:
    """An empty batch of messages does not change the state of the clock."""
    fresh = InputTimeout(Delays())
    assert fresh.clocks(np.empty(0, np.int64), np.empty(0, np.int64)).tolist() == []
    assert fresh.deadline is None
