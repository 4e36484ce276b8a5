"""MTBF, availability, success and trend from hours and failures, with exact bounds.

Exact bounds of an MTBF rest on a constant failure rate (exponential times between failures); the
trend tests say whether that may be assumed. Times in hours; infinite where there is no bound.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtr, chdtri, fdtri, ndtr

from ugv_acceptance.studies.spread import clopper_pearson

# Fewer failures do not determine a growth slope.
LEAST_FAILURES = 3


@dataclass(frozen=True, slots=True)
class Bounded:
    """An estimate with two-sided bounds `low` and `high` at a `confidence` from 0 to 1.

    `demonstrated` is the one-sided lower bound at the same confidence. `value` is None if the data
    give no estimate.
    """

    value: float | None
    low: float
    high: float
    demonstrated: float
    confidence: float


def chi_square(probability: float, degrees: int) -> float:
    """Return the chi-square value that `probability` lies below; 0 for zero degrees of freedom."""
    return float(chdtri(degrees, 1.0 - probability)) if degrees else 0.0


def demonstrated_mtbf(
    hours: float, failures: int, confidence: float, *, failure_terminated: bool = False
) -> float:
    """Return the MTBF (h) demonstrated with `confidence`: the exact one-sided lower bound.

    2 T / chi2(confidence, 2 r + 2) for r failures in T hours of a test that ends by time; 2 r
    degrees of freedom for one that ends with its last failure.
    """
    degrees = 2 * failures if failure_terminated else 2 * failures + 2
    quantile = chi_square(confidence, degrees)
    return 2.0 * hours / quantile if quantile > 0.0 else 0.0


def mtbf(
    hours: float, failures: int, confidence: float, *, failure_terminated: bool = False
) -> Bounded:
    """Return the MTBF (h) with exact chi-square bounds; without failures only a lower bound."""
    tail = (1.0 - confidence) / 2.0
    quantile = chi_square(tail, 2 * failures)
    ended = failure_terminated
    return Bounded(
        hours / failures if failures else None,
        demonstrated_mtbf(hours, failures, 1.0 - tail, failure_terminated=ended),
        2.0 * hours / quantile if quantile > 0.0 else math.inf,
        demonstrated_mtbf(hours, failures, confidence, failure_terminated=ended),
        confidence,
    )


def hours_to_demonstrate(required: float, failures: int, confidence: float) -> float:
    """Return the total hours needed to demonstrate an MTBF (h) with this number of failures."""
    return required * chi_square(confidence, 2 * failures + 2) / 2.0


def hours_still_to_run(required: float, hours: float, failures: int, confidence: float) -> float:
    """Return the failure-free hours still needed to demonstrate an MTBF (h); 0 if it is."""
    return max(0.0, hours_to_demonstrate(required, failures, confidence) - hours)


def proportion(successes: int, trials: int, confidence: float) -> Bounded:
    """Return a share of successes with exact (Clopper-Pearson) bounds."""
    low, high = clopper_pearson(successes, trials, confidence) if trials else (0.0, 1.0)
    # The lower end of the interval of twice the tail is the one-sided bound.
    one_sided = clopper_pearson(successes, trials, 2.0 * confidence - 1.0)[0] if trials else 0.0
    return Bounded(successes / trials if trials else None, low, high, one_sided, confidence)


def availability(
    up: float,
    failures: int,
    down: float,
    confidence: float,
    *,
    failure_terminated: bool = False,
) -> Bounded:
    """Return availability up / (up + down); `down` (h) is the time of all `failures` repairs.

    Times to failure and to repair are taken as exponential, so that the ratio of their sums is F
    distributed: exactly if the test ended with its last failure. If it ended by time, the next
    failure was still to come: as for the MTBF, 2 r + 2 degrees of freedom then bound from below.
    """
    if failures == 0 or down <= 0.0 or up <= 0.0:
        known = up > 0.0 and failures == 0
        return Bounded(1.0 if known else None, 0.0, 1.0, 0.0, confidence)

    def bound(probability: float, times: int) -> float:
        quantile = float(fdtri(2 * times, 2 * failures, probability))
        return 1.0 / (1.0 + (down / failures) / (up / times) * quantile)

    # Times to failure that have begun: the last one, if the test ended by time, has not ended.
    begun = failures if failure_terminated else failures + 1
    tail = (1.0 - confidence) / 2.0
    low, shown = bound(1.0 - tail, begun), bound(confidence, begun)
    return Bounded(up / (up + down), low, bound(tail, failures), shown, confidence)


@dataclass(frozen=True, slots=True)
class Trend:
    """Whether failures become rarer: the power law lambda t^beta (Crow-AMSAA) and Laplace's test.

    `beta` < 1 is improvement; `unbiased` is beta corrected for few failures, `low` and `high` its
    exact bounds, `scale` is lambda. `mtbf_now` (h) is the inverse of the fitted rate at the end.
    `laplace` is the test's score. `p_growth` and `laplace_p` are two-sided p-values of a constant
    rate.
    """

    failures: int
    beta: float
    unbiased: float
    low: float
    high: float
    scale: float
    mtbf_now: float
    p_growth: float
    laplace: float
    laplace_p: float


def trend(
    times: Sequence[float], hours: float, confidence: float, *, failure_terminated: bool = False
) -> Trend | None:
    """Return the trend of failures at `times` (h, of `hours` run); None for fewer than three.

    If the test ends with its last failure, the time of that one carries no information.
    """
    at = np.sort(np.asarray(times, dtype=np.float64))
    n, free = at.size, at.size - failure_terminated
    if n < LEAST_FAILURES or at[0] <= 0.0:
        return None
    logs = float(np.log(hours / at[:free]).sum())
    if logs <= 0.0:
        return None
    beta = n / logs
    tail = (1.0 - confidence) / 2.0
    # 2 beta logs is chi-square: of 2n degrees, of 2(n - 1) if failure-terminated.
    low, high = (chi_square(p, 2 * free) / (2.0 * logs) for p in (tail, 1.0 - tail))
    score = (at[:free].mean() / hours - 0.5) * math.sqrt(12.0 * free)
    scale = n / hours**beta
    return Trend(
        n,
        beta,
        beta * ((n - 2) / n if failure_terminated else (n - 1) / n),
        low,
        high,
        scale,
        1.0 / (scale * beta * hours ** (beta - 1.0)),
        _two_sided_chi_square(2.0 * logs, 2 * free),
        score,
        2.0 * float(ndtr(-abs(score))),
    )


def _two_sided_chi_square(statistic: float, degrees: int) -> float:
    """Return the two-sided p-value of a chi-square statistic, as in MIL-HDBK-189."""
    below = float(chdtr(degrees, statistic))
    return min(1.0, 2.0 * min(below, 1.0 - below))
