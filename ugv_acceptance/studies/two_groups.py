"""Compares MTBF or success of two groups by exact tests, and gives the power of the tests.

Failure rates: given the total number of failures, those of the first group are binomial with its
share of the hours. Successes: Fisher's exact test. Both hold for any number of failures, even none.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import binom, binomtest, fisher_exact, hypergeom, norm, poisson

from ugv_acceptance.studies.spread import clopper_pearson

# Terms of a sum over counts are left out if together they weigh less than this.
_TAIL = 1e-9
_MOST = 4000


@dataclass(frozen=True, slots=True)
class Compared:
    """The comparison of two groups: p-value, ratio second / first with bounds, power of the test.

    `p` is two-sided. `power` is the chance that a true ratio of `assumed` gives p < alpha with as
    many hours or runs.
    """

    p: float
    ratio: float | None
    low: float
    high: float
    assumed: float
    power: float


def compare_mtbf(
    first: tuple[float, int],
    second: tuple[float, int],
    confidence: float,
    assumed: float = 2.0,
) -> Compared:
    """Compare the MTBF of two groups (hours, failures); the ratio is second over first.

    The power assumes the failure rate of the first group (of both, if it has no failure) and an
    MTBF of the second `assumed` times as long.
    """
    (hours1, failures1), (hours2, failures2) = first, second
    share = hours1 / (hours1 + hours2)
    total = failures1 + failures2
    if total == 0:
        return Compared(1.0, None, 0.0, math.inf, assumed, 0.0)
    p = float(binomtest(failures1, total, share).pvalue)
    low, high = (
        _mtbf_ratio(q, hours1, hours2) for q in clopper_pearson(failures1, total, confidence)
    )
    ratio = (failures1 / hours1) / (failures2 / hours2) if failures2 else None
    rate = failures1 / hours1 if failures1 else total / (hours1 + hours2)
    power = mtbf_power(rate, hours1, hours2, assumed, 1.0 - confidence)
    return Compared(p, ratio, low, high, assumed, power)


def _mtbf_ratio(share: float, hours1: float, hours2: float) -> float:
    """Return the ratio of MTBFs at which the first group has this share of the failures."""
    return math.inf if share >= 1.0 else share / (1.0 - share) * hours2 / hours1


def mtbf_power(rate: float, hours1: float, hours2: float, assumed: float, alpha: float) -> float:
    """Return the chance of p < alpha if the MTBFs are 1/rate and assumed/rate: an exact sum."""
    mean1, mean2 = rate * hours1, rate * hours2 / assumed
    share = hours1 / (hours1 + hours2)
    most = int(poisson.isf(_TAIL, mean1 + mean2))
    if most > _MOST:  # so many failures: the normal approximation is exact enough
        step = abs(math.log(assumed)) / math.sqrt(1.0 / mean1 + 1.0 / mean2)
        return float(norm.cdf(step - norm.isf(alpha / 2.0)))
    power = 0.0
    for total in range(1, most + 1):
        weight = float(poisson.pmf(total, mean1 + mean2))
        if weight > _TAIL:
            rejects = _rejected(total, share, alpha)
            power += weight * float(
                binom.pmf(np.flatnonzero(rejects), total, mean1 / (mean1 + mean2)).sum()
            )
    return power


def _rejected(
    total: int, share: float, alpha: float
) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Return for 0..total failures of the first group whether the binomial test rejects."""
    chances = binom.pmf(np.arange(total + 1), total, share)
    order = np.argsort(chances, kind='stable')
    sums = np.cumsum(chances[order])
    # The p-value sums all outcomes that are at most as likely; 1e-7 allows for rounding of ties.
    reach = np.searchsorted(chances[order], chances * (1.0 + 1e-7), side='right') - 1
    return np.asarray(sums[reach] < alpha)


def compare_success(
    first: tuple[int, int], second: tuple[int, int], confidence: float, assumed: float = 0.5
) -> Compared:
    """Compare the success of two groups (successes, trials); the odds ratio is second over first.

    The power assumes that the second fails `assumed` times as often as the first. No bounds of the
    ratio are computed: they are 0 and infinity.
    """
    (good1, runs1), (good2, runs2) = first, second
    bad1, bad2 = runs1 - good1, runs2 - good2
    p = float(fisher_exact(np.array([[good1, bad1], [good2, bad2]])).pvalue)
    ratio = (good2 * bad1) / (bad2 * good1) if bad2 and good1 else None
    failing = bad1 / runs1 if runs1 else 0.0
    power = success_power(1.0 - failing, 1.0 - assumed * failing, runs1, runs2, 1.0 - confidence)
    return Compared(p, ratio, 0.0, math.inf, assumed, power)


def success_power(share1: float, share2: float, runs1: int, runs2: int, alpha: float) -> float:
    """Return the exact chance that Fisher's test gives p < alpha for given true success rates."""
    ways1 = binom.pmf(np.arange(runs1 + 1), runs1, share1)
    ways2 = binom.pmf(np.arange(runs2 + 1), runs2, share2)
    power = 0.0
    for total in range(runs1 + runs2 + 1):
        good1 = np.arange(max(0, total - runs2), min(runs1, total) + 1)
        weights = ways1[good1] * ways2[total - good1]
        if weights.sum() > _TAIL / (runs1 + runs2 + 1):
            power += float(weights[_fisher_rejects(good1, total, runs1, runs2, alpha)].sum())
    return power


def _fisher_rejects(
    good1: np.ndarray[tuple[int, ...], np.dtype[np.int_]],
    total: int,
    runs1: int,
    runs2: int,
    alpha: float,
) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Return for every 2 x 2 table with these margins whether Fisher's two-sided test rejects."""
    chances = hypergeom.pmf(good1, runs1 + runs2, total, runs1)
    ordered = np.sort(chances)
    reach = np.searchsorted(ordered, chances * (1.0 + 1e-7), side='right') - 1
    return np.asarray(np.cumsum(ordered)[reach] < alpha)
