"""Least squares: intervals by the textbook's formula, and what has no answer."""

import math

import numpy as np
import pytest
from scipy import stats

from ugv_acceptance.evaluation.effort.regression import independent_samples, least_squares
from ugv_acceptance.type_aliases import Floats


def textbook(columns: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return coefficients and half of their 95 % intervals, for samples that count for fewer."""
    n, k = columns.shape
    inverse = np.linalg.inv(columns.T @ columns)
    value = inverse @ columns.T @ y
    residual = y - columns @ value
    centred = residual - residual.mean()
    r = min(max(float(centred[1:] @ centred[:-1] / (centred @ centred)), 0.0), 0.999)
    worth = n * (1.0 - r) / (1.0 + r)
    variance = residual @ residual / (n - k) * n / max(worth, 1.0)
    quantile = stats.t.ppf(0.975, max(worth - k, 1.0))
    return value, quantile * np.sqrt(variance * np.diag(inverse))


T = np.arange(60.0)
RNG = np.random.default_rng(5)


@pytest.mark.parametrize(
    ('columns', 'y'),
    [
        (np.column_stack((np.ones(60), T)), 3.0 - 0.2 * T + RNG.normal(0.0, 1.0, 60)),
        (np.column_stack((1e-3 * np.ones(60), 1e4 * T, np.sin(T))), T + RNG.normal(0.0, 1.0, 60)),
        (np.ones((60, 1)), 2.0 + np.sin(2.0 * math.pi * T / 60.0)),  # worth less than one sample
        (np.ones((7, 1)), np.array((0.0, 0.4, 1.0, 0.6, 0.1, -0.7, -0.5))),
        (np.ones((4, 2)) * 0.01 + np.eye(4, 2) * 0.02, np.array((1.0, 2.0, 4.0, 3.0))),
    ],
    ids=['line', 'scales', 'slow', 'few', 'small'],
)
def test_a_fit_and_its_intervals_are_the_textbooks(columns: Floats, y: Floats) -> None:
    """Whatever the scales of the columns, and however neighbours resemble each other."""
    value, half = textbook(columns, y)
    fit = least_squares(columns, y)
    assert fit is not None
    np.testing.assert_allclose(fit.value, value, rtol=1e-8)
    np.testing.assert_allclose(fit.half_width, half, rtol=1e-8)
    residual = y - columns @ value
    assert fit.independent == pytest.approx(independent_samples(residual))


@pytest.mark.parametrize(('apart', 'told'), [(1e-7, False), (1e-4, True)])
def test_columns_that_are_all_but_one_have_no_answer(apart: float, told: bool) -> None:  # noqa: FBT001
    """A fit of columns that are nearly equal, the same or zero has no result."""
    second = T + apart * 60.0 * np.sin(T)
    assert (least_squares(np.column_stack((T, second)), T) is not None) == told
    assert least_squares(np.column_stack((T, T)), T) is None
    assert least_squares(np.column_stack((T, 0.0 * T)), T) is None


@pytest.mark.parametrize(
    ('residual', 'worth'),
    [
        ((3.0,), 1.0), ((1.0, 5.0), 2.0), ((1.0, 2.0, 9.0), 3.0), ((2.0,) * 5, 5.0),
        ((1.0, 2.0, 3.0, 4.0), 4.0 * 0.75 / 1.25), ((1.0, -1.0, 1.0, -1.0), 4.0),
        ((11.0, 12.0, 13.0, 14.0), 4.0 * 0.75 / 1.25),
    ],
)  # fmt: skip
def test_samples_that_resemble_their_neighbours_count_for_fewer(
    residual: tuple[float, ...], worth: float
) -> None:
    """Correlated samples count for fewer; three or less, or alternating ones, are not reduced."""
    assert independent_samples(np.array(residual)) == pytest.approx(worth)
