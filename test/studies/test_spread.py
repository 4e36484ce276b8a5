"""Uncertain numbers: draws, ranks, generators, exact intervals, many trials together."""

import numpy as np
import pytest
from scipy import stats

from ugv_acceptance.studies.spread import (
    Spread,
    clopper_pearson,
    generators,
    normal,
    together,
    uniform,
)

SPREADS = [
    (uniform(2.0, 5.0), stats.uniform(2.0, 3.0)),
    (normal(-1.0, 0.5), stats.norm(-1.0, 0.5)),
]


@pytest.mark.parametrize(('spread', 'truth'), SPREADS)
def test_draws_are_spread_as_said(spread: Spread, truth: 'stats.rv_continuous') -> None:
    """By Kolmogorov and Smirnov; the rank is the distribution function."""
    values = spread.draw(generators(7, 1)[0], 5_000)
    assert stats.kstest(values, truth.cdf).pvalue > 0.001
    np.testing.assert_allclose(spread.rank(values), truth.cdf(values), atol=1e-12)


@pytest.mark.parametrize('spread', [uniform(3.0, 3.0), normal(3.0, 0.0)])
def test_a_number_without_spread_is_always_the_same(spread: Spread) -> None:
    """A number without spread is constant, and its rank is 0."""
    values = spread.draw(generators(7, 1)[0], 5)
    assert values.tolist() == [3.0] * 5
    assert spread.rank(values).tolist() == [0.0] * 5


def test_generators_are_independent_and_repeat() -> None:
    """Each chunk has its own random generator, the same for every worker."""
    one, two = (rng.random(100) for rng in generators(3, 2))
    assert not np.array_equal(one, two)
    np.testing.assert_array_equal(generators(3, 5)[1].random(100), two)


@pytest.mark.parametrize(('failures', 'trials'), [(0, 7), (7, 7), (3, 7), (1, 1000)])
def test_intervals_are_scipy_s(failures: int, trials: int) -> None:
    """Exact intervals of a proportion equal scipy's, also for none and all."""
    expected = stats.binomtest(failures, trials).proportion_ci(0.9)
    assert clopper_pearson(failures, trials, 0.9) == pytest.approx((expected.low, expected.high))


@pytest.mark.parametrize(
    ('probabilities', 'repeats', 'expected'),
    [([0.5, 0.5], [1, 1], 0.75), ([0.5], [3], 0.875), ([1e-12], [2], 2e-12), ([0.3], [0], 0.0),
     ([1.0, 0.2], [1, 1], 1.0), ([], [], 0.0)],
)  # fmt: skip
def test_one_failure_of_many_trials(
    probabilities: list[float], repeats: list[int], expected: float
) -> None:
    """Exact for small ones; a certain one is certain."""
    assert together(probabilities, repeats) == pytest.approx(expected, rel=1e-9)
