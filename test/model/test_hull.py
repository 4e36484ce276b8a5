"""Convex hulls of a few points: one sample against many, and against geometry, to the digit."""

from itertools import permutations

import numpy as np
import pytest

from ugv_acceptance.model.hull import (
    THIN,
    Cycle,
    Point,
    drawn_in,
    hull,
    hulls,
    pairs,
    sample,
)
from ugv_acceptance.type_aliases import Floats

SQUARE: list[Point] = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]
SLACK = 1e-12  # twice the area (m2) of a triangle that counts as a line


def columns(samples: list[list[Point]]) -> list[tuple[Floats, Floats, Floats]]:
    """Return each point's coordinates over the samples."""
    return [(p[:, 0], p[:, 1], p[:, 2]) for p in np.swapaxes(np.array(samples), 0, 1)]


def of_many(samples: list[list[Point]]) -> list[tuple[Cycle, list[int]]]:
    """Return every hull of the samples with its rows."""
    active = tuple(range(len(samples[0])))
    found = hulls(columns(samples), active, len(samples))
    return [(cycle, np.arange(len(samples))[rows].tolist()) for cycle, rows in found]


def alone(points: list[Point]) -> Cycle:
    """Return the hull of one sample."""
    return hull(tuple(points), tuple(range(len(points))))


@pytest.mark.parametrize(
    ('cycle', 'edges'),
    [
        ((), []),
        ((4, 7, 2), [(4, 7), (7, 2), (2, 4)]),
        ((0, 1, 2, 3), [(0, 1), (1, 2), (2, 3), (3, 0)]),
    ],
)
def test_a_polygon_has_an_edge_from_each_corner_to_the_next(
    cycle: Cycle, edges: list[tuple[int, int]]
) -> None:
    """A polygon's edges join each corner to the next, and the last to the first."""
    assert list(pairs(cycle)) == edges


@pytest.mark.parametrize('order', list(permutations(range(3))))
def test_a_hull_goes_counter_clockwise_from_its_least_number(order: tuple[int, ...]) -> None:
    """Whatever the points' order; numbers are the caller's."""
    corners = [(0.2, 0.1), (0.7, 0.2), (0.3, 0.9)]
    points = tuple((*corners[k], 0.0) for k in order)
    numbers = tuple(10 + k for k in order)
    assert hull(points, numbers) == (10, 11, 12)


def test_heights_do_not_count_from_above() -> None:
    """The hull is that of the points seen from above: their heights do not matter."""
    rng = np.random.default_rng(0)
    for _ in range(50):
        flat = rng.integers(0, 3, (7, 2)).astype(float)
        level = [(x, y, 0.0) for x, y in flat.tolist()]
        hilly = [(x, y, float(rng.normal())) for x, y in flat.tolist()]
        assert alone(hilly) == alone(level)


@pytest.mark.parametrize(('out', 'corner'), [(0.0, False), (SLACK, False), (2.0 * SLACK, True)])
@pytest.mark.parametrize('before', [-1e-3, 1e-3])
def test_a_point_that_hardly_stands_out_is_no_corner(
    out: float,
    corner: bool,  # noqa: FBT001
    before: float,
) -> None:
    """A point that stands out by no more than the tolerance is no corner."""
    points: list[Point] = [*SQUARE, (0.5, -out, 0.0)]
    cycle = (0, 4, 1, 2, 3) if corner else (0, 1, 2, 3)
    assert alone(points) == cycle
    first: list[Point] = [*SQUARE, (0.5, before, 0.0)]
    same = alone(first) == cycle
    expected = [(cycle, [0, 1, 2])] if same else [(alone(first), [0]), (cycle, [1, 2])]
    assert of_many([first, points, points]) == expected


@pytest.mark.parametrize(('width', 'corners'), [(0.5 * THIN, 0), (2.0 * THIN, 3)])
@pytest.mark.parametrize('place', [(0.0, 0.0), (5.0, -7.0), (-6.0, 3.0)])
@pytest.mark.parametrize('size', [0.1, 3.0])
def test_what_is_thin_is_thin_wherever_it_lies(
    width: float, corners: int, place: tuple[float, float], size: float
) -> None:
    """Along x or along y, for one sample as for many."""
    x, y = place
    along_x = [(x, y, 0.0), (x + size, y, 0.0), (x + 0.4 * size, y + width, 0.0)]
    along_y = [(x, y, 0.0), (x + width, y + 0.4 * size, 0.0), (x, y + size, 0.0)]
    for points in (along_x, along_y):
        cycle = alone(points)
        assert len(cycle) == corners
        assert of_many([points] * 3) == [(cycle, [0, 1, 2])]


@pytest.mark.parametrize(
    'points', [[(1.0, 2.0, 0.0)] * 4, [(0.1 * k, 0.2 * k, 0.0) for k in range(4)], SQUARE[:2]]
)
def test_points_without_a_hull_are_told_at_once(points: list[Point]) -> None:
    """Points all in one place, in one line or too few have no hull, one answer for all samples."""
    assert of_many([points] * 3) == [((), [0, 1, 2])]


def test_samples_that_share_a_hull_share_an_answer() -> None:
    """Whichever way round their points lie, each hull comes once and each sample with its own."""
    left, right = SQUARE[:3], [SQUARE[0], SQUARE[2], SQUARE[1]]
    assert of_many([left, right, left, right]) == [((0, 1, 2), [0, 2]), ((0, 2, 1), [1, 3])]


def test_what_no_sample_moves_has_one_hull() -> None:
    """Points that no sample moves have one hull for all samples."""
    assert [cycle for cycle, _ in hulls(SQUARE, (0, 1, 2, 3), 5)] == [(0, 1, 2, 3)]


@pytest.mark.parametrize('seed', range(4))
def test_every_sample_has_the_hull_it_has_alone(seed: int) -> None:
    """More hulls than are tried on all samples, with points in line and in one place."""
    rng = np.random.default_rng(seed)
    samples = [
        [(x, y, 0.0) for x, y in points]
        for points in (rng.integers(0, 4, (150, 5, 2)) / 4.0).tolist()
    ]
    found = of_many(samples)
    assert sorted(row for _, rows in found for row in rows) == list(range(150))
    assert all(rows for _, rows in found)
    for cycle, rows in found:
        for row in rows:
            points = [samples[row][k] for k in cycle]
            expected = [samples[row][k] for k in alone(samples[row])]
            assert set(points) == set(expected)


def test_a_sample_of_arrays_is_its_floats() -> None:
    """One sample taken from arrays is the same nested floats; a float belongs to every sample."""
    found = sample(((np.array((1.0, 2.0)), 3.0), (np.array((4.0, 5.0)),)), 1)
    assert found == ((2.0, 3.0), (5.0,))
    assert all(type(x) is float for part in found for x in part)


@pytest.mark.parametrize('first', range(5))
@pytest.mark.parametrize('shift', [(0.0, 0.0), (3.0, -2.0)])
def test_a_place_outside_is_drawn_towards_the_middle(
    first: int, shift: tuple[float, float]
) -> None:
    """To the hull's edge or corner, and a billionth of the way inside, whatever the order."""
    corners = np.array([(-1.0, -1.0), (1.0, -1.0), (1.5, 0.0), (1.0, 1.0), (-1.0, 1.0)]) + shift
    points: list[Point] = [(x, y, 0.0) for x, y in np.roll(corners, first, axis=0).tolist()]
    middle = corners.mean(axis=0)
    edge = [(0.5 * (a + b), a, b) for a, b in zip(corners, np.roll(corners, 1, 0), strict=True)]
    for target in (*corners, *(at for at, _, _ in edge)):
        for beyond in (1.001, 1.5, 8.0):
            x, y = (middle + beyond * (target - middle)).tolist()
            found = np.array(drawn_in(points, (x, y, 0.3)))
            np.testing.assert_allclose(found, target, atol=1e-8)
            assert np.linalg.norm(found - middle) < np.linalg.norm(target - middle)


def test_many_places_are_drawn_each_its_own_way() -> None:
    """Over a square about the origin: to x = 1 and to y = -1."""
    points: list[Point] = [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)]
    x, y = drawn_in(points, (np.array((3.0, 0.5)), np.array((0.5, -2.0)), 0.0))
    np.testing.assert_allclose(x, (1.0, 0.25), atol=1e-8)
    np.testing.assert_allclose(y, (0.5 / 3.0, -1.0), atol=1e-8)
