"""The trend rule: its formula in words, row by row, and what it says of missing looks."""

import math

import numpy as np
import pytest

from ugv_acceptance.evaluation.tipping_trend import (
    ERROR,
    LONGEST,
    LOOKS,
    NOT_KNOWN,
    OK,
    TREND,
    WARN,
    trend_of,
)
from ugv_acceptance.type_aliases import Floats, Times

LOOK = 50_000_000


def looks(seed: int) -> tuple[Times, Floats, Floats]:
    """Return random looks: margins that wander, gaps, sides without an edge, unknown numbers."""
    rng = np.random.default_rng(seed)
    n = 300
    step = np.where(rng.random(n) < 0.05, rng.integers(1, 20, n) * LOOK, LOOK)
    angle = np.radians(22.0 + np.cumsum(rng.normal(0.0, 0.7, (n, 4)), axis=0))
    cautious = angle - np.radians(rng.uniform(0.0, 8.0))
    for values in (angle, cautious):
        values[rng.random((n, 4)) < 0.01] = np.nan
        values[rng.random((n, 4)) < 0.01] = np.inf
    return np.cumsum(step), angle, cautious


def in_words(time: list[int], angle: list[list[float]], cautious: list[float]) -> int:
    """Return the level at the last of some looks, side by side, as the rule's docstring has it."""
    known = not any(map(math.isnan, cautious))
    level = OK
    seconds = (time[-1] - time[-LOOKS]) * 1e-9 if len(time) >= LOOKS else math.inf
    for side, narrow in enumerate(cautious):
        if narrow < TREND.cautious:
            level = max(level, WARN)
        if seconds > LONGEST or math.isnan(angle[-1][side]) or math.isnan(angle[-LOOKS][side]):
            known = False
            continue
        now, before = angle[-1][side], angle[-LOOKS][side]
        slope = 0.0 if math.isinf(now) or math.isinf(before) else (now - before) / seconds
        then = now + min(slope, 0.0) * TREND.ahead
        if slope <= -TREND.rate and then < TREND.warn:
            level = max(level, WARN)
        if slope <= -TREND.fast and then < TREND.error:
            level = ERROR
    return level if known or level > OK else NOT_KNOWN


@pytest.mark.parametrize('seed', range(4))
def test_the_formula_is_that_of_its_words(seed: int) -> None:
    """At every look the level is what a plain loop over the four sides gives."""
    time, angle, cautious = looks(seed)
    found = trend_of(time, angle, cautious).level.tolist()
    for k in range(len(time)):
        first = max(k + 1 - LOOKS, 0)
        some = time[first : k + 1].tolist(), angle[first : k + 1].tolist()
        assert found[k] == in_words(*some, cautious[k].tolist())
    assert {NOT_KNOWN, OK, WARN} <= set(found)


@pytest.mark.parametrize('seed', range(4))
def test_looks_one_by_one_give_the_columns(seed: int) -> None:
    """Live, from the newest LOOKS only, every number is bit for bit that of the whole recording."""
    time, angle, cautious = looks(seed)
    whole = trend_of(time, angle, cautious)
    for k in range(LOOKS - 1, len(time)):
        some = slice(k + 1 - LOOKS, k + 1)
        one = trend_of(time[some], angle[some], cautious[some])
        for part in ('level', 'side', 'slope', 'left'):
            np.testing.assert_array_equal(getattr(one, part)[-1], getattr(whole, part)[k])


@pytest.mark.parametrize('missing', [math.nan, 'gap', 'few'])
def test_without_enough_looks_nothing_is_ok(missing: float | str) -> None:
    """An unknown margin, a gap in the looks, or too few of them is not known: never OK."""
    time = np.arange(LOOKS, dtype=np.int64) * LOOK
    angle = np.full((LOOKS, 4), math.radians(40.0))
    if missing == 'gap':
        time[-1] += 1_000_000_000
    elif missing == 'few':
        time, angle = time[1:], angle[1:]
    else:
        angle[-1, 2] = math.nan
    assert trend_of(time, angle, angle).level[-1] == NOT_KNOWN
    narrow = np.where(np.arange(4) == 1, 0.0, angle)
    assert trend_of(time, angle, narrow).level[-1] == WARN


def test_a_robot_that_falls_is_danger_to_that_side() -> None:
    """A margin of 10 deg that loses 30 deg/s is an ERROR to its side, a third of a second off."""
    time = np.arange(LOOKS, dtype=np.int64) * LOOK
    angle = np.full((LOOKS, 4), math.radians(40.0))
    angle[:, 3] = np.radians(10.0 + 30.0 * (time[-1] - time) * 1e-9)
    found = trend_of(time, angle, angle)
    assert (found.level[-1], found.side[-1]) == (ERROR, 3)
    assert found.slope[-1] == pytest.approx(math.radians(-30.0))
    assert found.left[-1] == pytest.approx(1.0 / 3.0)


def test_a_margin_that_grows_is_ok() -> None:
    """A margin that grows or stays has all the time there is."""
    time = np.arange(LOOKS, dtype=np.int64) * LOOK
    angle = np.radians(12.0 + 30.0 * time[:, None] * 1e-9) * np.ones((1, 4))
    found = trend_of(time, angle, angle)
    assert (found.level[-1], found.left[-1]) == (OK, math.inf)
