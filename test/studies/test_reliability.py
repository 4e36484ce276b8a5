"""Reliability held to published values, to scipy and to brute force."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from ugv_acceptance.studies.reliability import (
    availability,
    demonstrated_mtbf,
    hours_still_to_run,
    hours_to_demonstrate,
    mtbf,
    proportion,
    trend,
)
from ugv_acceptance.studies.two_groups import (
    compare_mtbf,
    compare_success,
    mtbf_power,
    success_power,
)

# A development test of 620 h that ended with its last failure, worked in the textbook of the
# Crow-AMSAA model (ReliaSoft, Reliability Growth Reference): beta 0.6142, lambda 0.4239.
TEXTBOOK = [2.7, 10.3, 12.5, 30.6, 57.0, 61.3, 80.0, 109.5, 125.0, 128.6, 143.8]
TEXTBOOK += [167.9, 229.2, 296.7, 320.6, 328.2, 366.2, 396.7, 421.1, 438.2, 501.2, 620.0]

counts = st.integers(0, 60)
levels = st.floats(0.5, 0.99)


@pytest.mark.parametrize(('confidence', 'hours'), [(0.8, 154.5), (0.9, 221.0)])
def test_hours_without_failure_that_demonstrate_96_hours(confidence: float, hours: float) -> None:
    """An MTBF of 96 h needs 154.5 h without failure at 80 %, 221.0 h at 90 %."""
    assert hours_to_demonstrate(96.0, 0, confidence) == pytest.approx(hours, abs=0.06)


def test_a_six_hour_endurance_run_proves_little() -> None:
    """Six hours without failure demonstrate 3.73 h at 80 %."""
    assert demonstrated_mtbf(6.0, 0, 0.8) == pytest.approx(3.73, abs=0.005)


def test_hours_still_to_run_end_at_zero() -> None:
    """What was run is taken off; what is demonstrated needs no more."""
    assert hours_still_to_run(96.0, 100.0, 0, 0.8) == pytest.approx(54.5, abs=0.06)
    assert hours_still_to_run(96.0, 300.0, 0, 0.8) == 0.0


@given(hours=st.floats(0.1, 1e5), failures=counts, confidence=levels)
def test_the_demonstrated_mtbf_needs_exactly_the_hours_run(
    hours: float, failures: int, confidence: float
) -> None:
    """Hours needed and MTBF demonstrated are each other's inverse."""
    shown = demonstrated_mtbf(hours, failures, confidence)
    assert hours_to_demonstrate(shown, failures, confidence) == pytest.approx(hours)


@given(failures=st.integers(1, 60), confidence=levels)
def test_time_terminated_bounds_are_those_of_the_poisson_count(
    failures: int, confidence: float
) -> None:
    """At the bounds, so many failures or more (fewer) have half the doubt: exact by definition."""
    found = mtbf(100.0, failures, confidence)
    tail = (1.0 - confidence) / 2.0
    assert stats.poisson.cdf(failures, 100.0 / found.low) == pytest.approx(tail)
    assert stats.poisson.sf(failures - 1, 100.0 / found.high) == pytest.approx(tail)


@given(failures=st.integers(1, 60), confidence=levels)
def test_failure_terminated_bounds_are_those_of_the_gamma_time(
    failures: int, confidence: float
) -> None:
    """The time of the n-th failure is gamma distributed; the bounds are its two tails."""
    found = mtbf(100.0, failures, confidence, failure_terminated=True)
    tail = (1.0 - confidence) / 2.0
    assert stats.gamma.sf(100.0, failures, scale=found.low) == pytest.approx(tail)
    assert stats.gamma.cdf(100.0, failures, scale=found.high) == pytest.approx(tail)


@pytest.mark.parametrize(
    ('by_failure', 'low'), [(False, 9.512001136498702), (True, 10.924760161528141)]
)
def test_bounds_are_those_of_the_package_reliability(by_failure: bool, low: float) -> None:  # noqa: FBT001
    """5 failures in 100 h at 90 %, both sides, by its `reliability_test_planner` (0.9.0).

    Its numbers, not itself: it needs NumPy 2.2, and Jazzy has 1.26.
    """
    found = mtbf(100.0, 5, 0.9, failure_terminated=by_failure)
    assert found.low == pytest.approx(low, rel=1e-12)


def test_hours_with_failures_are_those_of_the_package_reliability() -> None:
    """96 h at 80 % with 3 failures, and 29 of 30 at 80 %, by reliability 0.9.0."""
    assert hours_to_demonstrate(96.0, 3, 0.8) == pytest.approx(529.4443886545492, rel=1e-12)
    found = proportion(29, 30, 0.8)
    expected = (0.8764300093247439, 0.9964941427304151)
    assert (found.low, found.high) == pytest.approx(expected, rel=1e-12)


def test_without_failure_nothing_bounds_the_mtbf_from_above() -> None:
    """No failure: no point value, an infinite upper bound."""
    found = mtbf(10.0, 0, 0.8)
    assert (found.value, found.high) == (None, math.inf)


@settings(max_examples=40)
@given(trials=st.integers(1, 80), data=st.data(), confidence=levels)
def test_proportions_have_the_bounds_of_scipy(
    trials: int, data: st.DataObject, confidence: float
) -> None:
    """Clopper-Pearson, two-sided and one-sided, as scipy computes it."""
    good = data.draw(st.integers(0, trials))
    found = proportion(good, trials, confidence)
    two = stats.binomtest(good, trials).proportion_ci(confidence)
    one = stats.binomtest(good, trials, alternative='greater').proportion_ci(confidence)
    assert (found.low, found.high) == pytest.approx((two.low, two.high), abs=1e-9)
    assert found.demonstrated == pytest.approx(one.low, abs=1e-9)


def test_availability_bounds_of_a_test_ended_by_failure_cover_as_often_as_they_say() -> None:
    """Of 4000 simulated campaigns, 90 % hold the true availability within their bounds."""
    rng, held, trials = np.random.default_rng(1), 0, 4000
    truth = 50.0 / (50.0 + 5.0)
    for up, down in zip(
        rng.gamma(6, 50.0, trials).tolist(), rng.gamma(6, 5.0, trials).tolist(), strict=True
    ):
        found = availability(up, 6, down, 0.9, failure_terminated=True)
        held += found.low <= truth <= found.high
    assert held / trials == pytest.approx(0.9, abs=0.02)


@pytest.mark.parametrize('confidence', [0.8, 0.95])
@pytest.mark.parametrize('expected', [0.5, 2.0, 4.0, 6.0, 12.0, 60.0])
def test_the_availability_shown_by_a_test_ended_by_time_is_at_most_the_true_one(
    expected: float, confidence: float
) -> None:
    """At least as often as the confidence says, by the exact sum over the number of failures.

    Of a fixed operating time the number of failures is Poisson, and the repairs' sum is gamma.
    """
    most = int(stats.poisson.isf(1e-12, expected))
    held = float(stats.poisson.pmf(0, expected))  # no failure shows no availability
    for failures in range(1, most + 1):
        # The repairs' time (in mean repairs) above which the true availability is not passed.
        down = largest_covered(expected, failures, confidence)
        held += float(stats.poisson.pmf(failures, expected) * stats.gamma.sf(down, failures))
    assert confidence <= held


def largest_covered(expected: float, failures: int, confidence: float) -> float:
    """Return the time of repairs at which the availability shown is the true one.

    MTBF and mean time to repair are 1 h, so it is 1/2. The availability shown falls with the time
    of repairs in proportion: its odds times that time are the same for any time.
    """
    shown = availability(expected, failures, 1.0, confidence).demonstrated
    return shown / (1.0 - shown)


def test_availability_bounds_of_a_test_ended_by_time_cover_at_least_as_often_as_they_say() -> None:
    """20000 campaigns of 300 h, 50 h between failures, 5 h a repair (seed 7), at 80 %."""
    rng, trials, truth = np.random.default_rng(7), 20_000, 50.0 / 55.0
    counts_of = rng.poisson(300.0 / 50.0, trials).tolist()
    found = [availability(300.0, n, float(rng.gamma(n, 5.0)) if n else 0.0, 0.8) for n in counts_of]
    assert np.mean([f.demonstrated <= truth for f in found]) >= 0.8
    assert np.mean([f.low <= truth <= f.high for f in found]) >= 0.8
    assert np.mean([truth <= f.high for f in found]) >= 0.9


def test_the_textbook_growth_test() -> None:
    """Slope, scale and MTBF at the end are those published for the 620 h development test."""
    found = trend(TEXTBOOK, 620.0, 0.9, failure_terminated=True)
    assert found is not None
    assert (found.beta, found.scale) == pytest.approx((0.6142, 0.4239), abs=5e-5)
    assert found.mtbf_now == pytest.approx(620.0 / (22 * 0.61421), rel=1e-4)
    assert found.high < 1.0


def test_a_constant_rate_is_called_a_trend_as_rarely_as_said() -> None:
    """Evenly spread failures: both tests give p < 0.1 in a tenth of campaigns, bounds cover 1."""
    rng, trials = np.random.default_rng(2), 2000
    found = [trend(rng.uniform(0.0, 500.0, 12).tolist(), 500.0, 0.9) for _ in range(trials)]
    known = [t for t in found if t is not None]
    assert np.mean([t.p_growth < 0.1 for t in known]) == pytest.approx(0.1, abs=0.025)
    assert np.mean([t.laplace_p < 0.1 for t in known]) == pytest.approx(0.1, abs=0.025)
    assert np.mean([t.low <= 1.0 <= t.high for t in known]) == pytest.approx(0.9, abs=0.025)


def test_laplace_by_hand() -> None:
    """Failures at 10, 20, 60 of 100 h: mean 30, so U = (0.3 - 0.5) sqrt(36) = -1.2."""
    found = trend([60.0, 10.0, 20.0], 100.0, 0.9)
    assert found is not None
    assert found.laplace == pytest.approx(-1.2)
    assert found.laplace_p == pytest.approx(2.0 * stats.norm.cdf(-1.2))


def test_two_failures_are_no_trend() -> None:
    """Fewer than three failures give no trend."""
    assert trend([1.0, 2.0], 10.0, 0.9) is None


@pytest.mark.parametrize('times', [[0.0, 1.0, 2.0], [10.0, 10.0, 10.0]])
def test_failures_all_at_one_end_are_no_trend(times: list[float]) -> None:
    """A power law fits neither a failure before the first hour nor all in the last."""
    assert trend(times, 10.0, 0.9) is None


@pytest.mark.parametrize(
    ('up', 'failures', 'down', 'value'),
    [(10.0, 0, 0.0, 1.0), (0.0, 0, 0.0, None), (0.0, 2, 1.0, None), (10.0, 2, 0.0, None)],
)
def test_availability_without_repairs_is_unbounded(
    up: float, failures: int, down: float, value: float | None
) -> None:
    """Nothing failed: all of the time; nothing run or no time of repair known: no number."""
    found = availability(up, failures, down, 0.9)
    assert (found.value, found.low, found.high, found.demonstrated) == (value, 0.0, 1.0, 0.0)


def test_no_trial_says_nothing_of_success() -> None:
    """Without a trial the share of success is anything from 0 to 1."""
    found = proportion(0, 0, 0.9)
    assert (found.value, found.low, found.high, found.demonstrated) == (None, 0.0, 1.0, 0.0)


def test_a_test_that_ended_with_its_only_failure_to_come_demonstrates_nothing() -> None:
    """Without a failure it cannot have ended with one."""
    assert demonstrated_mtbf(100.0, 0, 0.8, failure_terminated=True) == 0.0


def test_two_groups_without_failure_do_not_differ() -> None:
    """Chance explains them, and the ratio may be anything."""
    found = compare_mtbf((10.0, 0), (20.0, 0), 0.9)
    assert (found.p, found.ratio, found.low, found.high, found.power) == (
        1.0,
        None,
        0.0,
        math.inf,
        0.0,
    )


def test_the_ratio_of_two_mtbfs() -> None:
    """4 failures in 100 h against 2 in 150 h: 75 h over 25 h; without any in the second none."""
    assert compare_mtbf((100.0, 4), (150.0, 2), 0.9).ratio == pytest.approx(3.0)
    one_sided = compare_mtbf((100.0, 4), (150.0, 0), 0.9)
    assert (one_sided.ratio, one_sided.high) == (None, math.inf)
    assert compare_mtbf((100.0, 0), (150.0, 3), 0.9).power > 0.0


def test_many_failures_are_normally_distributed() -> None:
    """The power of a thousand times as many hours goes on where the exact sum ends."""
    below, above = (mtbf_power(1.0, hours, hours, 1.05, 0.1) for hours in (1950.0, 2050.0))
    assert 0.0 < above - below < 0.02


def test_the_odds_of_two_groups() -> None:
    """1 of 4 fails against 2 of 4: (2 x 1) / (2 x 3); without a failure there is no ratio."""
    assert compare_success((3, 4), (2, 4), 0.9).ratio == pytest.approx(2.0 * 1.0 / (2.0 * 3.0))
    assert compare_success((4, 4), (4, 4), 0.9).ratio is None
    nothing = compare_success((0, 0), (3, 4), 0.9)
    assert (nothing.p, nothing.power) == (1.0, 0.0)


@settings(max_examples=40)
@given(n1=counts, n2=counts, hours=st.floats(1.0, 1e3))
def test_the_bounds_of_the_ratio_agree_with_the_test(n1: int, n2: int, hours: float) -> None:
    """Exchanging the two inverts ratio and bounds, and leaves p."""
    one = compare_mtbf((hours, n1), (50.0, n2), 0.9)
    other = compare_mtbf((50.0, n2), (hours, n1), 0.9)
    assert one.p == pytest.approx(other.p)
    assert one.low == pytest.approx(1.0 / other.high if other.high else math.inf)


def test_the_power_of_the_rate_test_is_how_often_it_rejects() -> None:
    """3000 simulated pairs of campaigns reject as often as the power says."""
    rng, alpha, trials = np.random.default_rng(3), 0.2, 3000
    pairs = zip(rng.poisson(12.0, trials).tolist(), rng.poisson(6.0, trials).tolist(), strict=True)
    rejected = [compare_p(a, b) < alpha for a, b in pairs]
    assert mtbf_power(0.12, 100.0, 100.0, 2.0, alpha) == pytest.approx(np.mean(rejected), abs=0.03)


def compare_p(first: int, second: int) -> float:
    """Return p of two groups of the same hours."""
    return float(stats.binomtest(first, first + second, 0.5).pvalue) if first + second else 1.0


def test_the_power_of_fishers_test_is_how_often_it_rejects() -> None:
    """The sum over all tables of small groups is the power."""
    alpha, runs1, runs2, share1, share2 = 0.2, 9, 7, 0.5, 0.9
    power = sum(
        float(stats.binom.pmf(a, runs1, share1)) * float(stats.binom.pmf(b, runs2, share2))
        for a in range(runs1 + 1)
        for b in range(runs2 + 1)
        if stats.fisher_exact(np.array([[a, runs1 - a], [b, runs2 - b]])).pvalue < alpha
    )
    assert success_power(share1, share2, runs1, runs2, alpha) == pytest.approx(power)


def test_success_of_two_groups_is_fishers_exact_test() -> None:
    """The lady tasting tea: 3 of 4 against 1 of 4 gives p = 0.486, as Fisher published."""
    assert compare_success((3, 4), (1, 4), 0.9).p == pytest.approx(0.486, abs=5e-4)
