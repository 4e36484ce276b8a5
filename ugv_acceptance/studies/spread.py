"""Distributions of uncertain numbers (uniform or normal), and exact intervals of a probability."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaincinv, ndtr

from ugv_acceptance.type_aliases import Floats

UNIFORM, NORMAL = 'uniform', 'normal'


@dataclass(frozen=True, slots=True)
class Spread:
    """An uncertain number: uniform from `low` to `high`, or normal with mean `low` and sd `high`.

    The two readings share fields so that a scenario is a plain table of names and numbers.
    """

    kind: str
    low: float
    high: float

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        """Return `count` random values, shape (count,)."""
        return _DRAW[self.kind](self, rng, count)

    def rank(self, values: Floats) -> Floats:
        """Return the cumulative distribution at each value: 0 to 1."""
        return _RANK[self.kind](self, values)


def uniform(low: float, high: float) -> Spread:
    """Return a uniform distribution from `low` to `high`."""
    return Spread(UNIFORM, low, high)


def normal(mean: float, deviation: float) -> Spread:
    """Return a normal distribution with this mean and standard deviation."""
    return Spread(NORMAL, mean, deviation)


def _draw_uniform(spread: Spread, rng: np.random.Generator, count: int) -> Floats:
    values = rng.random(count)
    values *= spread.high - spread.low
    values += spread.low
    return values


def _draw_normal(spread: Spread, rng: np.random.Generator, count: int) -> Floats:
    values = rng.standard_normal(count)
    values *= spread.high
    values += spread.low
    return values


def _rank_uniform(spread: Spread, values: Floats) -> Floats:
    width = spread.high - spread.low
    return (values - spread.low) / width if width > 0.0 else np.zeros_like(values)


def _rank_normal(spread: Spread, values: Floats) -> Floats:
    if spread.high == 0.0:
        return np.zeros_like(values)
    rank: NDArray[np.float64] = ndtr((values - spread.low) / spread.high)
    return rank


_DRAW: dict[str, Callable[[Spread, np.random.Generator, int], Floats]] = {
    UNIFORM: _draw_uniform,
    NORMAL: _draw_normal,
}
_RANK: dict[str, Callable[[Spread, Floats], Floats]] = {
    UNIFORM: _rank_uniform,
    NORMAL: _rank_normal,
}


def generators(seed: int, count: int) -> list[np.random.Generator]:
    """Return independent random generators, one per chunk: results do not depend on the workers."""
    return [
        np.random.Generator(np.random.SFC64(child))
        for child in np.random.SeedSequence(seed).spawn(count)
    ]


def clopper_pearson(failures: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return the exact (Clopper-Pearson) two-sided interval of a probability."""
    tail = (1.0 - confidence) / 2.0
    low = 0.0 if failures == 0 else float(betaincinv(failures, trials - failures + 1, tail))
    high = 1.0
    if failures < trials:
        high = float(betaincinv(failures + 1, trials - failures, 1.0 - tail))
    return low, high


def together(probabilities: list[float], repeats: list[int]) -> float:
    """Return the probability of any failure in independent trials, each repeated some times."""
    logs = [
        n * math.log1p(-min(p, 1.0 - 1e-16)) for p, n in zip(probabilities, repeats, strict=True)
    ]
    return -math.expm1(math.fsum(logs))
