"""Gyro against orientation: windows judged side by side are judged as each alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ugv_acceptance.evaluation.inputs.imu_cell import COUNT, FREEDOM, KNOWN, OWN, SPREAD, SUMS, TURN
from ugv_acceptance.evaluation.inputs.imu_grid import (
    PRODUCTS,
    QUATERNION,
    SPAN,
    TIME,
    ImuGrid,
    _compare,
)
from ugv_acceptance.evaluation.inputs.imu_rates import (
    AGREES,
    ALIKE,
    DEGREES,
    DIFFERS,
    EXPLAINED,
    EXPLAINED_UNIT,
    FEWEST,
    LATE,
    WINDOW,
    RatesFound,
    _most_explained,
    _Pairs,
    rates_of,
)
from ugv_acceptance.type_aliases import Floats

ROWS = 150
AXES = {
    'same': np.eye(3),
    'turned': np.eye(3)[[1, 2, 0]],
    'mirrored': np.diag([1.0, -1.0, 1.0]),
    'degrees': 57.3 * np.eye(3),
    'tiny': np.eye(3) / 57.3,
    'stuck': 300.0 * np.eye(3),
    'opposite': -np.eye(3),
}


def rates_over(grid: ImuGrid, end: int) -> RatesFound:
    """Return what one window alone shows, which ends at a row number of the grid."""
    return rates_of(grid, (end,))[0]


def made(seed: int, gyro: str, late: int, gaps: float) -> ImuGrid:
    """Return a grid of a robot that turns at random, with a gyro and an orientation that are odd.

    The orientation comes `late` rows late, and is unknown in a share `gaps` of the rows.
    """
    rng = np.random.default_rng(seed)
    wave = np.array([0.11, 0.17, 0.07]) * np.arange(ROWS + LATE)[:, None] + rng.uniform(0, 6, 3)
    turned = 0.06 * np.sin(wave) * rng.uniform(0.0, 1.5, 3)
    added = np.zeros((ROWS, SUMS))
    added[:, TURN] = turned[LATE:] @ AXES[gyro].T + rng.normal(0.0, 1e-3, (ROWS, 3))
    added[:, OWN] = turned[LATE - late :][:ROWS]
    added[:, KNOWN] = rng.uniform(size=ROWS) >= gaps
    added[:, OWN] *= added[:, [KNOWN]]
    added[:, COUNT], added[:, FREEDOM], added[:, SPREAD] = 10.0, 9.0, 1e-4
    rows = np.zeros((ROWS + 1, TIME + 1))
    rows[1:, :SUMS] = np.cumsum(added, axis=0)
    q = rng.normal(size=4) + 0.02 * np.cumsum(rng.normal(size=(ROWS + 1, 4)), axis=0)
    rows[:, QUATERNION] = q / np.linalg.norm(q, axis=1, keepdims=True)
    rows[:, TIME] = 0.1 * np.arange(ROWS + 1)
    rows[:, PRODUCTS] = 0.0
    _compare(rows, 1)
    return ImuGrid(9.81, rows=rows)


grids = st.builds(
    made,
    st.integers(0, 2**32 - 1),
    st.sampled_from(list(AXES)),
    st.integers(0, LATE),
    st.sampled_from([0.0, 0.03, 0.2, 0.9]),
)


@settings(deadline=None, max_examples=60)
@given(grids)
def test_windows_judged_side_by_side_are_judged_as_each_alone(grid: ImuGrid) -> None:
    """Windows of a recording that are judged at once give to the bit what each gives alone."""
    ends = range(WINDOW, ROWS + 1, 7)
    assert repr(rates_of(grid, ends)) == repr([rates_over(grid, end) for end in ends])


def gyro_kind(turned: Floats, own: Floats) -> float | None:
    """Return what is wrong with the gyro by the definition; None: both agree, nothing is wrong.

    The orientation's delay is that at which both are most alike.
    """
    pairs = [(turned[: len(own) - late], own[late:]) for late in range(LATE + 1)]
    cosines = [(a * b).sum() / np.sqrt((a * a).sum() * (b * b).sum() + 1e-18) for a, b in pairs]
    a, b = pairs[int(np.argmax(cosines))]
    cosine, ratio = max(cosines), np.sqrt((a * a).sum() / ((b * b).sum() + 1e-12))
    if cosine >= AGREES and ALIKE[0] <= ratio <= ALIKE[1]:
        return None
    turns, mirrors = 0.0, 0.0
    for one, other in pairs[::2]:
        u, size, v = np.linalg.svd(one.T @ other)
        whole = np.sqrt((one * one).sum() * (other * other).sum() + 1e-18)
        hand = np.sign(np.linalg.det(u @ v))
        turns = max(turns, (size[0] + size[1] + hand * size[2]) / whole)
        mirrors = max(mirrors, size.sum() / whole)
    if DEGREES[0] < ratio < DEGREES[1] and turns > EXPLAINED_UNIT:
        return 1.0
    if ratio < 1.0 / DEGREES[0] and turns > EXPLAINED_UNIT:
        return 2.0
    if ALIKE[0] < ratio < ALIKE[1] and cosine < DIFFERS:
        return 3.0 if turns > EXPLAINED else 4.0 if mirrors > EXPLAINED else None
    return None


@settings(deadline=None, max_examples=60)
@given(grids)
def test_the_gyros_fault_is_that_of_the_definition(grid: ImuGrid) -> None:
    """Unit, turned and mirrored axes of a gyro are found as their definition says."""
    rows = np.asarray(grid.rows)
    for end in range(WINDOW, ROWS + 1, 7):
        found = rates_over(grid, end)
        d = rows[end - WINDOW + SPAN : end + 1] - rows[end - WINDOW : end + 1 - SPAN]
        if not found.gyro > 0.0 and (d[:, KNOWN] < SPAN).any():
            continue
        if found.gyro > 0.0 and (d[:, KNOWN] == SPAN).all():
            assert found.gyro == gyro_kind(d[:, TURN], d[:, OWN])
        elif found.gyro == 0.0:
            assert gyro_kind(d[:, TURN], d[:, OWN]) is None


def test_too_few_comparisons_say_nothing() -> None:
    """Windows with fewer than ten comparisons are not judged beside others that are."""
    grid = made(3, 'degrees', 0, 0.0)
    rows = np.asarray(grid.rows)
    rows[:60, KNOWN] = 0.0
    rows[60:, KNOWN] -= 60.0
    rows[:, PRODUCTS] = 0.0
    _compare(rows, 1)
    ends = range(WINDOW, ROWS + 1, 7)
    found = rates_of(grid, ends)
    assert repr(found) == repr([rates_over(grid, end) for end in ends])
    unsaid = [rate for end, rate in zip(ends, found, strict=True) if end < 60 + FEWEST]
    assert unsaid
    assert not any(rate.excited for rate in unsaid)
    assert any(rate.gyro > 0.0 for rate in found)


@pytest.mark.parametrize(('gyro', 'kind'), [('degrees', 1.0), ('tiny', 2.0), ('turned', 3.0)])
def test_a_late_orientation_does_not_hide_the_gyros_fault(gyro: str, kind: float) -> None:
    """Units and axes of a gyro are found although the orientation comes most of a second late."""
    found = {rate.gyro for rate in rates_of(made(4, gyro, 8, 0.0), range(60, ROWS + 1, 7))}
    assert kind in found


@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 2, 3]), st.floats(0.0, 3.0))
def test_nothing_explains_more_than_the_bound_says(seed: int, rank: int, noise: float) -> None:
    """The best rotation of axes, mirrored or not, explains at most what needs no search for it."""
    rng = np.random.default_rng(seed)
    turned = rng.normal(size=(20, 26, rank)) @ rng.normal(size=(20, rank, 3))
    own = turned @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + noise * rng.normal(size=turned.shape)
    pairs = _Pairs(turned, own, own)
    turns, mirrors = pairs.explained
    most = _most_explained(pairs.product) / pairs.size
    assert (np.maximum(turns, mirrors) <= most * (1.0 + 1e-12)).all()
