"""The low-pass in closed form, against the recursion of its definition, one sample at a time."""

import math

import numpy as np
import pytest
from evaluation.streams import MS, S

from ugv_acceptance.evaluation.inputs.low_pass import LowPass
from ugv_acceptance.type_aliases import Floats

LOST = (math.nan, 0.0, 9.0)


def recursion(stamps: list[int], samples: Floats, constant: float) -> Floats:
    """Return y + (1 - exp(-t / T)) (x - y) of each sample; the sample itself where it begins anew.

    It does after a sample that cannot be, or where its stamp is not up to a second later.
    """
    found: list[Floats] = []
    for k, x in enumerate(samples):
        fit = np.isfinite(x).all() and math.hypot(*x) <= 1000.0
        y = x.copy() if fit else np.full(3, np.nan)
        step = (stamps[k] - stamps[k - 1]) / 1e9 if k else 0.0
        if 0.0 < step <= 1.0 and np.isfinite(found[-1]).all():
            y = found[-1] + (1.0 - math.exp(-step / constant)) * (y - found[-1])
        found.append(y)
    return np.array(found).reshape(-1, 3)


def noise(n: int) -> Floats:
    """Return accelerations about gravity."""
    return np.random.default_rng(n).normal((1.0, -2.0, 9.81), 2.0, (n, 3))


def marred(n: int, at: int, sample: tuple[float, float, float]) -> Floats:
    """Return accelerations of which one is another."""
    found = noise(n)
    found[at] = sample
    return found


STEADY = [k * 10 * MS for k in range(40)]
STREAMS = {
    'steady': (STEADY, noise(40)),
    'since 1970': ([1_700_000_000 * S + t for t in STEADY], noise(40)),
    'not a number': (STEADY, marred(40, 11, LOST)),
    'first lost': (STEADY, marred(40, 0, LOST)),
    'last lost': (STEADY, marred(40, 39, LOST)),
    'too large in all': (STEADY, marred(40, 20, (600.0, 600.0, 600.0))),
    'just not too large': (STEADY, marred(40, 20, (600.0, -600.0, 500.0))),
    'stands': ([0, 10, 10, 10, 20, 20], noise(6)),
    'runs back': ([0, 50 * MS, 20 * MS, 30 * MS, -S, -S + 1], noise(6)),
    'a second': ([0, S, 2 * S + 1, 3 * S + 1, 3 * S + 10], noise(5)),
    'a thousand constants': ([k * 500 * MS for k in range(400)], noise(400)),
    'many small steps': ([k * MS for k in range(3000)], noise(3000)),
}


@pytest.mark.parametrize('constant', [0.2, 0.01])
@pytest.mark.parametrize('name', STREAMS)
def test_columns_and_single_samples_are_the_recursion(name: str, constant: float) -> None:
    """Also where the columns come in two parts, or single samples come before and after."""
    stamps, samples = STREAMS[name]
    expected = recursion(stamps, samples, constant)
    one = LowPass(constant)
    singles = np.array([one.step(t, x.tolist()) for t, x in zip(stamps, samples, strict=True)])
    np.testing.assert_allclose(singles, expected, rtol=1e-12, atol=1e-12)
    for cut in {1, 2, len(stamps) // 2, len(stamps)}:
        many, time = LowPass(constant), np.array(stamps)
        parts = [
            many.columns(t, x.T).T
            for t, x in ((time[:cut], samples[:cut]), (time[cut:], samples[cut:]))
            if len(t)
        ]
        np.testing.assert_allclose(np.concatenate(parts), expected, rtol=1e-9, atol=1e-9)
        mixed = LowPass(constant)
        mixed.columns(time[:cut], samples[:cut].T)
        for t, x, y in list(zip(stamps, samples, expected, strict=True))[cut:]:
            np.testing.assert_allclose(mixed.step(t, x.tolist()), y, rtol=1e-9, atol=1e-9)
