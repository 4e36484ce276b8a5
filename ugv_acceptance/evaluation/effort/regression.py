"""Least squares with intervals, for samples of a run that resemble their neighbours."""

from dataclasses import dataclass

import numpy as np

from ugv_acceptance.evaluation.effort.quantiles import t_quantile
from ugv_acceptance.type_aliases import Floats

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Fit:
    """A least-squares fit: coefficients (k,) and half the width of each one's 95 % interval.

    `independent` is the number of independent samples that the n samples of a run are worth.
    """

    value: Floats
    half_width: Floats
    independent: float


def independent_samples(residual: Floats) -> float:
    """Return the number of independent samples that correlated residuals (n,) are worth.

    n (1 - r) / (1 + r) for the correlation r of neighbours, taken as at least 0.
    """
    n = len(residual)
    centred = residual - residual.mean()
    power = float(centred @ centred)
    if power == 0.0:
        return float(n)
    r = min(max(float(centred[1:] @ centred[:-1]) / power, 0.0), 0.999)
    return n * (1.0 - r) / (1.0 + r)


def least_squares(columns: Floats, y: Floats) -> Fit | None:
    """Return the least-squares fit of y (n,) by columns (n, k); None if it is not determined."""
    n, k = columns.shape
    scale = np.sqrt((columns**2).sum(axis=0))
    if n <= k or not (scale > 0.0).all():
        return None
    scaled = columns / scale
    _, _, rank, singular = np.linalg.lstsq(scaled, y, rcond=None)
    if rank < k or singular[-1] < 1e-6 * singular[0]:
        return None
    inverse = np.linalg.inv(scaled.T @ scaled)
    value = inverse @ (scaled.T @ y)
    residual = y - scaled @ value
    worth = independent_samples(residual)
    freedom = max(worth - k, 1.0)
    variance = float(residual @ residual) / (n - k) * (n / max(worth, 1.0))
    deviation = np.sqrt(variance * np.diag(inverse))
    quantile = t_quantile(freedom, 0.5 + CONFIDENCE / 2.0)
    return Fit(value / scale, quantile * deviation / scale, worth)
