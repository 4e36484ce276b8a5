"""Alerts: a deadband, a delay on and a delay off, dated to when they fell due."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import hypothesis
import numpy as np
import pytest
from evaluation.streams import MS, settings
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts.rules import RuleSet
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, Alert, Rule, Signal, feed, runs
from ugv_acceptance.evaluation.settings import Delays, Limits

Found = list[tuple[int, int | None, float, int | None]]
# Limits 1 and 0.5, times in ns that a table can walk through one by one.
_values = st.sampled_from([0.0, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, math.nan])
_delays = st.integers(0, 12)


def rule(on_delay: int, off_delay: int) -> Rule:
    """A value is bad from 1 on and good below 0.5."""
    return Rule('TEST', 'it', ERROR, 1.0, 0.5, on_delay, off_delay)


def found(log: list[Alert]) -> Found:
    """Return start, end and peak of every alert, and when the peak came."""
    return [(a.start, a.end, a.peak, a.worst_at) for a in log]


def stepped(told: Rule, times: Sequence[int], values: Sequence[float], end: int) -> Found:
    """Return the alerts of samples given one by one."""
    log: list[Alert] = []
    signal = Signal(told, log)
    for now, value in zip(times, values, strict=True):
        signal.step(now, value)
    signal.advance(end)
    return found(log)


def fed(
    told: Rule, times: Sequence[int], values: Sequence[float], end: int, cuts: Sequence[int] = ()
) -> Found:
    """Return the alerts of samples given as columns, cut into parts."""
    log: list[Alert] = []
    signal = Signal(told, log)
    for part in np.split(np.arange(len(times)), sorted(min(c, len(times)) for c in cuts)):
        feed(signal, np.array(times, np.int64)[part], np.array(values)[part])
    signal.advance(end)
    return found(log)


def table(told: Rule, times: Sequence[int], values: Sequence[float], end: int) -> Found:
    """Return the alerts by walking through every nanosecond: the definition, in words of a table.

    The state of the value holds from a sample to the next; an alert starts when it has been bad for
    the on-delay, and ends when it has been good for the off-delay.
    """
    samples = dict(zip(times, values, strict=True))
    bad, since, worst, at = False, 0, -math.inf, -1
    alerts: list[list[Any]] = []
    active = False
    for now in range(end + 1):
        # What falls due at this instant was decided by the samples before it.
        for _ in range(2):
            if bad and not active and now - since >= told.on_delay:
                active = True
                alerts.append([since + told.on_delay, None, worst, at])
            if not bad and active and now - since >= told.off_delay:
                active = False
                alerts[-1][1] = since + told.off_delay
            value = samples.pop(now, math.nan)
            if value >= told.on and not bad:
                bad, since = True, now
                if not active:
                    worst, at = value, now
            elif value < told.off and bad:
                bad, since = False, now
            if bad and value > worst:
                worst, at = value, now
            if bad and active:
                alerts[-1][2:] = worst, at
    return [(a, b, c, d) for a, b, c, d in alerts]


@st.composite
def samples(draw: st.DrawFn) -> tuple[list[int], list[float], int]:
    """Return times (ns), values and the end of a short stretch."""
    waits = draw(st.lists(st.integers(1, 9), min_size=1, max_size=30))
    times = np.cumsum(waits).tolist()
    values = draw(st.lists(_values, min_size=len(times), max_size=len(times)))
    return times, values, times[-1] + draw(st.integers(0, 20))


@given(samples(), _delays, _delays)
def test_alerts_are_those_of_the_table(
    case: tuple[list[int], list[float], int], on_delay: int, off_delay: int
) -> None:
    """Whatever the values and delays, alerts are those of a walk through every nanosecond."""
    told = rule(on_delay, off_delay)
    assert stepped(told, *case) == table(told, *case)


@hypothesis.settings(max_examples=300)
@given(samples(), _delays, _delays, st.lists(st.integers(0, 30), max_size=4))
def test_columns_give_the_alerts_of_single_samples(
    case: tuple[list[int], list[float], int], on_delay: int, off_delay: int, cuts: list[int]
) -> None:
    """Columns give the same alerts as single samples, however a recording is cut into batches."""
    told = rule(on_delay, off_delay)
    assert fed(told, *case, cuts) == stepped(told, *case)


@given(
    st.lists(st.sampled_from([0.0, 1e-10, 4e-10, 9e-10, 2e-9, 1e-6, -3e-9]), max_size=30),
    st.sampled_from([1.5, 0.0, -1.0, 1e3, math.inf]),
    st.lists(st.integers(0, 30), max_size=4),
)
def test_a_worst_value_that_is_crept_up_to_has_one_time(
    steps: list[float], first: float, cuts: list[int]
) -> None:
    """A value that settles by less and less: its worst came at the same time in columns."""
    told = Rule('TEST', 'it', ERROR, -2.0, -3.0, 0, 0)
    values = (first + np.cumsum([0.0, *steps]) * (1.0 + min(abs(first), 1e9))).tolist()
    times = list(range(10, 10 + len(values)))
    assert fed(told, times, values, 100, cuts) == stepped(told, times, values, 100)


@given(samples(), _delays, _delays, st.lists(st.integers(0, 300), max_size=20))
def test_the_passing_of_time_changes_no_dates(
    case: tuple[list[int], list[float], int], on_delay: int, off_delay: int, ticks: list[int]
) -> None:
    """A timer that looks at the signal between samples only makes alerts known earlier."""
    told, (times, values, end) = rule(on_delay, off_delay), case
    log: list[Alert] = []
    signal = Signal(told, log)
    waiting = sorted(t for t in ticks if t < end)
    for now, value in zip(times, values, strict=True):
        while waiting and waiting[0] < now:
            signal.advance(waiting.pop(0))
        signal.step(now, value)
    signal.advance(end)
    assert found(log) == stepped(told, *case)


def test_a_value_in_the_deadband_keeps_an_alert() -> None:
    """An alert ends only when the value is below the lower limit, not within the deadband."""
    assert stepped(rule(0, 0), [10, 20, 30], [1.0, 0.5, 0.49], 40) == [(10, 30, 1.0, 10)]


def test_a_short_excursion_raises_nothing() -> None:
    """A value that is bad for less than the on-delay raises no alert."""
    assert stepped(rule(100, 0), [10, 109], [5.0, 0.0], 1000) == []


def test_an_alert_that_falls_due_between_samples_has_that_date() -> None:
    """Start and end of an alert are when they fell due, not when a sample made them known."""
    assert stepped(rule(100, 50), [10, 500, 2000], [5.0, 0.0, 0.0], 3000) == [(110, 550, 5.0, 10)]


def test_not_a_number_changes_nothing() -> None:
    """NaN neither raises nor clears an alert, and is never its peak."""
    values = [2.0, math.nan, math.nan, 0.0]
    assert stepped(rule(0, 0), [1, 2, 3, 4], values, 9) == [(1, 4, 2.0, 1)]
    assert stepped(rule(0, 0), [1, 2], [math.nan, math.nan], 9) == []


def test_another_rule_counts_from_the_next_value_on() -> None:
    """An alert that is active keeps its own; a new one is raised by the new limit."""
    signal = Signal(rule(0, 0), [])
    signal.judge_by(Rule('TEST', 'it', ERROR, 3.0, 2.5, 0, 0))
    signal.step(1, 2.0)
    assert signal.alert is None
    signal.step(2, 3.0)
    assert signal.alert is not None


def hovering(seed: int, period: float) -> tuple[Signal, NDArray[np.int64], NDArray[np.bool_]]:
    """Return the alert signal after ten minutes at 50 Hz about the limit, and which were bad.

    The tilt left swings a degree to either side in `period` (s), with noise of half a degree.
    """
    random = np.random.default_rng(seed)
    times = np.arange(30_000) * 20 * MS
    limit = math.degrees(Limits(()).tip_error)
    swing = np.sin(times * 2e-9 * math.pi / period)
    degrees = limit + swing + random.normal(0.0, 0.5, len(times))
    signal = RuleSet(settings(delays=Delays())).tip[0][1]
    for now, value in zip(times.tolist(), degrees.tolist(), strict=True):
        signal.step(now, -math.radians(value))
    signal.advance(int(times[-1]))
    return signal, times, degrees <= limit


@pytest.mark.parametrize('seed', range(4))
def test_chatter_about_a_limit_is_one_alert(seed: int) -> None:
    """As long as the limit is passed again within the off-delay."""
    signal, _, bad = hovering(seed, 1.0)
    assert bad.sum() > 10_000
    assert len(signal.log) == 1


@pytest.mark.parametrize('seed', range(4))
@pytest.mark.parametrize('period', [1.0, 10.0])
def test_no_excursion_longer_than_the_on_delay_is_hidden(seed: int, period: float) -> None:
    """Every stretch of bad samples that lasts longer ends inside an alert."""
    signal, times, bad = hovering(seed, period)
    edges = np.flatnonzero(np.diff(bad, prepend=False, append=False)).reshape(-1, 2)
    long = [int(times[b - 1]) for a, b in edges if times[b - 1] - times[a] > 100 * MS]
    assert long
    for last in long:
        assert any(a.start <= last <= (last if a.end is None else a.end) for a in signal.log)


def test_a_value_that_stays_as_bad_raises_what_is_due() -> None:
    """An alert that is due is raised at the next sample, without a timer."""
    signal = Signal(rule(100, 0), [])
    for now in (0, 99):
        signal.step(now, 5.0)
    assert signal.log == []
    signal.step(150, 5.0)
    assert found(signal.log) == [(100, None, 5.0, 0)]


@pytest.mark.parametrize(
    ('values', 'raw', 'expected'),
    [
        ((2.0, 0.7, 0.0, 0.0, 1.0), False, [(0, 2, True), (2, 4, False), (4, 5, True)]),
        ((0.7, 0.0, 1.0), True, [(0, 1, True), (1, 2, False), (2, 3, True)]),
        ((math.nan, 0.7), True, [(0, 2, True)]),
        ((math.nan, 0.5, 1.0), False, [(0, 2, False), (2, 3, True)]),
        ((0.0, 2.0), True, [(0, 1, False), (1, 2, True)]),
        ((), True, []),
    ],
)
def test_runs_are_the_stretches_on_one_side(
    values: tuple[float, ...], expected: list[tuple[int, int, bool]], *, raw: bool
) -> None:
    """A sample within the deadband, or NaN, counts to the side of the sample before it."""
    assert list(runs(rule(0, 0), np.array(values), raw=raw)) == expected


def test_the_first_value_of_a_part_may_be_the_worst() -> None:
    """The peak of an alert from the part before may be the first value of the next part."""
    assert fed(rule(0, 0), [1, 2, 3], [2.0, 9.0, 3.0], 5, [1]) == [(1, None, 9.0, 2)]


@pytest.mark.parametrize('way', [stepped, fed])
@pytest.mark.parametrize('size', [1.0, 50.0, 1e6])
@pytest.mark.parametrize('error', [-1.0, 0.0, 1.0])
def test_rounding_does_not_move_the_worst(
    way: Callable[..., Found], size: float, error: float
) -> None:
    """Of values that differ in their last bits, as live and columns do, the first is the worst."""
    told = rule(100, 100)
    values = [0.5 * size, size, size * (1.0 + error * 1e-15), 0.0]
    ((_, _, _, worst),) = way(replace(told, on=0.1, off=0.05), [0, 50, 200, 300], values, 1000)
    assert worst == 50


@pytest.mark.parametrize('way', [stepped, fed])
def test_the_worst_value_has_its_own_time(way: Callable[..., Found]) -> None:
    """It is when the worst came first: after the alert was raised, before it, or in a relapse."""
    told = rule(100, 100)
    late = way(told, [0, 200, 300, 400, 500], [1.0, 2.0, 7.0, 7.0, 0.0], 1000)
    assert late == [(100, 600, 7.0, 300)]
    early = way(told, [0, 50, 200, 300], [1.0, 9.0, 2.0, 0.0], 1000)
    assert early == [(100, 400, 9.0, 50)]
    relapse = way(told, [0, 200, 250, 280, 300], [3.0, 0.0, 2.0, 4.0, 0.0], 1000)
    assert relapse == [(100, 400, 4.0, 280)]
