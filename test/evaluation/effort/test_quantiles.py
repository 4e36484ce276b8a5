"""Quantiles of F and t distributions: closed forms where there are some, SciPy elsewhere."""

import math

import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st
from numpy.lib import NumpyVersion
from scipy.special import fdtrc, fdtri, stdtrit

from ugv_acceptance.evaluation.effort.quantiles import f_quantile, t_quantile

freedoms = st.floats(0.0, 6.0).map(lambda power: 10.0**power)
# SciPy itself is this exact; 1.11, that of Ubuntu 24.04, was off by up to 4e-9.
EXACT = 3e-14 if NumpyVersion(scipy.__version__) >= '1.17.0' else 1e-8


@given(freedoms, st.sampled_from([0.9, 0.95, 0.99]))
def test_f_of_two_freedoms_above_or_below_has_a_closed_form(
    freedom: float, probability: float
) -> None:
    """With two degrees of freedom above or below the quantile of F is a power: to a few ulp."""
    tail = -math.log1p(-probability)
    above = freedom / 2.0 * math.expm1(tail * 2.0 / freedom)
    below = 2.0 / freedom / math.expm1(-math.log(probability) * 2.0 / freedom)
    assert f_quantile(2.0, freedom, probability) == pytest.approx(above, rel=3e-14)
    assert f_quantile(freedom, 2.0, probability) == pytest.approx(below, rel=3e-14)


def test_t_of_one_and_two_freedoms_has_a_closed_form() -> None:
    """The quantiles of t with one and two degrees of freedom are those of the textbook."""
    assert t_quantile(1.0, 0.975) == pytest.approx(math.tan(0.475 * math.pi), rel=1e-14)
    assert t_quantile(2.0, 0.975) == pytest.approx(0.95 / math.sqrt(2 * 0.975 * 0.025), rel=1e-14)


@given(freedoms, freedoms, st.sampled_from([0.9, 0.95, 0.99]))
def test_f_is_that_of_scipy(above: float, below: float, probability: float) -> None:
    """The quantile of F is SciPy's for all degrees of freedom from 1 to a million."""
    found = f_quantile(above, below, probability)
    assert found == pytest.approx(float(fdtri(above, below, probability)), rel=EXACT)
    assert float(fdtrc(above, below, found)) == pytest.approx(1.0 - probability, rel=EXACT)


@given(freedoms)
def test_t_is_that_of_scipy(freedom: float) -> None:
    """The quantile of t is SciPy's for all degrees of freedom from 1 to a million."""
    assert t_quantile(freedom, 0.975) == pytest.approx(float(stdtrit(freedom, 0.975)), rel=EXACT)


@pytest.mark.parametrize('freedom', [math.nan, math.inf])
def test_freedoms_that_are_not_finite_have_no_quantile(freedom: float) -> None:
    """Of degrees of freedom that are not known nothing is known: NaN, not a number of any kind."""
    assert math.isnan(t_quantile(freedom, 0.975))
    assert math.isnan(f_quantile(freedom, 3.0, 0.95))
