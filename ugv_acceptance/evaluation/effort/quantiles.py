"""Quantiles of the F and the t distribution, of any real degrees of freedom.

SciPy has them too; but to import its special functions takes longer than to judge a short run. The
upper tail is a density (Loader, Fast and accurate computation of binomial probabilities) over a
continued fraction (DiDonato and Morris, ACM TOMS 708): neither has differences of large numbers.
"""

import math

# The continued fraction ends at a factor this close to 1; a logarithm is found when it moves less.
_LAST, _SETTLED = 1e-16, 4e-16
# Terms of Stirling's series, which are enough from LARGE on.
_STIRLING = (1 / 12, -1 / 360, 1 / 1260, -1 / 1680, 1 / 1188, -691 / 360360, 1 / 156)
_LARGE = 16.0
# Steps of the search, terms of the fraction: more than a million degrees of freedom need.
_STEPS, _MOST = 60, 10_000


def t_quantile(freedom: float, probability: float) -> float:
    """Return the value below which a t variable is with a probability of 0.5 or more."""
    return math.sqrt(f_quantile(1.0, freedom, 2.0 * probability - 1.0))


def f_quantile(above: float, below: float, probability: float) -> float:
    """Return the value below which an F variable is with a probability.

    It has `above` and `below` degrees of freedom, both of 1 or more; NaN if one is not finite. By
    Newton's rule on the logarithms of both: the tail's is concave, so it comes from one side.
    """
    if not math.isfinite(above + below):
        return math.nan
    a, b, u = above / 2.0, below / 2.0, 0.0
    wanted = math.log1p(-probability)
    for _ in range(_STEPS):
        tail, density = _tail(a, b, u)
        step = tail * (math.log(tail) - wanted) / density
        u += step
        if abs(step) <= _SETTLED * max(1.0, abs(u)):
            break
    return math.exp(u)


def _tail(a: float, b: float, u: float) -> tuple[float, float]:
    """Return the probability of more than e^u, and its decrease by u; 2 a and 2 b are freedoms."""
    n, f = a + b, math.exp(u)
    x, y = a * f / (a * f + b), b / (a * f + b)
    # How far a share of n is from its expected part.
    off = a * b * math.expm1(u) / (a * f + b)
    exponent = _stirling(n) - _stirling(a) - _stirling(b)
    exponent -= a * _excess(off / a, n * x / a) + b * _excess(-off / b, n * y / b)
    density = math.sqrt(a * b / (2.0 * math.pi * n)) * math.exp(exponent)
    if off > 0.0:
        return density / _fraction(b, a, y, x, off), density
    return 1.0 - density / _fraction(a, b, x, y, -off), density


def _stirling(z: float) -> float:
    """Return the logarithm of the gamma function less that of Stirling's formula."""
    found = 0.0
    while z < _LARGE:
        found += (z + 0.5) * math.log1p(1.0 / z) - 1.0
        z += 1.0
    square = z * z
    return found + sum(term / (z * square**k) for k, term in enumerate(_STIRLING))


def _excess(t: float, ratio: float) -> float:
    """Return t - log(ratio), where ratio is 1 + t and t may be small."""
    if abs(t) > 0.2:
        return t - math.log(ratio)
    v = t / (2.0 + t)
    square, power, rest = v * v, 2.0 * v * v * v, 0.0
    for k in range(3, 41, 2):
        rest += power / k
        power *= square
    return v * t - rest


def _fraction(a: float, b: float, x: float, y: float, off: float) -> float:
    """Return what the density is divided by to give the probability of less than x = 1 - y.

    `off` is a - (a + b) x. By Lentz's rule.
    """
    c = found = (a * (off + 1.0)) / (a + 1.0)
    d = 0.0
    for m in range(1, _MOST):
        part = m * (b - m) * x / (a + 2 * m - 1.0)
        above = (a + m - 1.0) * (a + b + m - 1.0) * x * part / (a + 2 * m - 1.0)
        below = m + part + (a + m) * (off + 1.0 + m * (1.0 + y)) / (a + 2 * m + 1.0)
        d, c = 1.0 / (below + above * d), below + above / c
        found *= d * c
        if abs(d * c - 1.0) <= _LAST:
            break
    return found
