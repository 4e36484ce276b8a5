"""The grid of an IMU: integrals against closed forms and scipy, live against columns."""

import math
from itertools import pairwise

import numpy as np
import pytest
from evaluation.imu_runs import FAULTS, bursty, good_run, jittery, lossy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ugv_acceptance.evaluation.inputs.imu_cell import BODY, OWN, SECONDS, TAU, TURN, WORLD, grown
from ugv_acceptance.evaluation.inputs.imu_grid import GRID, ImuGrid, samples
from ugv_acceptance.type_aliases import Floats

unit = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: math.hypot(*q) > 0.1)


@given(unit, unit, st.tuples(*[st.floats(-50, 50)] * 3), st.sampled_from([1.0, -1.0]))
def test_a_cell_turns_as_scipy_does(
    before: tuple[float, ...], after: tuple[float, ...], force: tuple[float, ...], sign: float
) -> None:
    """The step between two orientations, and a force turned by the one half way between them."""
    p, q = Rotation.from_quat(before), Rotation.from_quat(after)
    step = (p.inv() * q).as_rotvec()
    if np.linalg.norm(step) > 3.0:  # half a turn has no shorter way
        return
    ends = [(r.as_quat() * s).tolist() for r, s in ((p, 1.0), (q, sign))]
    found = grown(0.5, (1.0, *force, 0.0, 0.0, 0.0, 0.0, 0.0), *ends)
    half = p * Rotation.from_rotvec(step / 2.0)
    np.testing.assert_allclose(found[OWN], step, atol=1e-9)
    np.testing.assert_allclose(found[WORLD], half.apply(force) / 2.0, atol=1e-8)


def filled(x: Floats) -> tuple[ImuGrid, ImuGrid]:
    """Return the grid of samples taken cell by cell, and of the same taken at once."""
    one, many = ImuGrid(9.81), ImuGrid(9.81)
    at = x[TAU] // GRID
    ends = [0, *(np.flatnonzero(np.diff(at)) + 1).tolist()]
    for a, b in pairwise(ends):
        one.close(x[:, a:b].T.ravel().tolist(), x[:, b].tolist())
    many.extend(x[:, : ends[-1] + 1])
    return one, many


def table_of(hz: float, seconds: float, q: Floats, w: Floats, a: Floats) -> Floats:
    """Return samples at a constant rate."""
    n = int(hz * seconds)
    q, w, a = (np.broadcast_to(v[:, None], (len(v), n)) for v in (q, w, a))
    x = samples(q, w, a, np.ones(n, np.bool_))
    x[TAU] = np.round(np.arange(n) * 1e9 / hz)
    return x


@pytest.mark.parametrize('hz', [10.0, 37.0, 100.0, 400.0])
def test_constant_numbers_are_integrated_to_their_closed_form(hz: float) -> None:
    """Rate times time, acceleration times time, whatever the number of messages a second."""
    still = np.array([0.0, 0.0, 0.0, 1.0])
    x = table_of(hz, 12.0, still, np.array([0.1, -0.2, 0.3]), np.array([1.0, 2.0, 9.0]))
    for grid in filled(x):
        d = grid.over(grid.row, 100)
        assert d[SECONDS] == pytest.approx(10.0, abs=0.11)
        np.testing.assert_allclose(d[TURN], np.array([0.1, -0.2, 0.3]) * d[SECONDS], rtol=1e-9)
        np.testing.assert_allclose(d[BODY], np.array([1.0, 2.0, 9.0]) * d[SECONDS], rtol=1e-9)
        np.testing.assert_allclose(d[WORLD], d[BODY], rtol=1e-9)
        np.testing.assert_allclose(d[OWN], 0.0, atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 10**6),
    st.sampled_from([8.0, 30.0, 100.0, 213.0]),
    st.sampled_from(['even', 'bursts', 'jitter', 'lost']),
    st.floats(0.0, 0.2),
)
def test_cell_by_cell_is_the_same_as_all_at_once(
    seed: int, hz: float, form: str, broken: float
) -> None:
    """Also with orientations and numbers that cannot be used, shocks, bursts and losses."""
    run = good_run(seed % 50, 9.0, hz)
    run = {
        'even': lambda: run, 'bursts': lambda: bursty(run), 'jitter': lambda: jittery(run, seed),
        'lost': lambda: lossy(run, seed),
    }[form]()  # fmt: skip
    rng = np.random.default_rng(seed)
    n = len(run.q)
    a, w, told = run.a.copy(), run.w.copy(), rng.random(n) >= broken
    a[rng.random(n) < broken / 4] = np.nan
    w[rng.random(n) < broken / 4, 1] = 1e12
    a[rng.random(n) < 0.01] *= 5.0
    x = samples(run.q.T, w.T, a.T, told)
    x[TAU] = run.time - run.time[0]
    one, many = filled(x)
    assert one.row == many.row
    last = min(len(one.rows), len(many.rows))
    np.testing.assert_allclose(
        np.array(one.rows)[-last:], np.array(many.rows)[-last:], rtol=1e-9, atol=1e-9
    )


def test_messages_in_bursts_weigh_as_much_as_even_ones() -> None:
    """The mean over 2 s differs by less than a twentieth of a m/s2, not by its own size."""
    run = good_run(3, 20.0)
    means = []
    for form in (run, bursty(run)):
        x = samples(form.q.T, form.w.T, form.a.T, np.ones(len(form.q), np.bool_))
        x[TAU] = form.time - form.time[0]
        grid, _ = filled(x)
        d = grid.over(100, 20)
        means.append(np.array(d[WORLD]) / d[SECONDS])
    np.testing.assert_allclose(means[0], means[1], atol=0.2)


def test_every_fault_of_the_trial_has_a_name() -> None:
    """The trial of bench/ and the tests draw the same kinds."""
    assert len(FAULTS) == 14
