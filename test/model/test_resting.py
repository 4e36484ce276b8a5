"""The face on which a body rests, held against all triples of its points."""

import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.model.resting import Face, lowest_of, resting_face
from ugv_acceptance.model.robot import Vector

SQUARE: tuple[Vector, ...] = (
    (1.0, 1.0, 0.0),
    (1.0, -1.0, 0.0),
    (-1.0, 1.0, 0.0),
    (-1.0, -1.0, 0.0),
)


def height_below(points: list[Vector], at: tuple[float, float]) -> float | None:
    """Return the height at `at` of the highest plane below all points, by trying all triples."""
    best = None
    for a, b, c in combinations(np.array(points), 3):
        matrix = np.array([[*p[:2], 1.0] for p in (a, b, c)])
        if abs(np.linalg.det(matrix)) < 1e-9:
            continue
        shares = np.linalg.solve(matrix.T, np.array([*at, 1.0]))
        if shares.min() >= 0.0:
            z = float(shares @ np.array([a[2], b[2], c[2]]))
            best = z if best is None else min(best, z)
    return best


def height_at(face: Face, at: tuple[float, float]) -> float:
    """Return the height (m) of a face's plane at a place."""
    x, y, z = face.points[0]
    nx, ny, nz = face.normal
    return z - (nx * (at[0] - x) + ny * (at[1] - y)) / nz


@given(st.integers(0, 10_000), st.integers(3, 12))
def test_it_is_the_lowest_of_all_faces_above_which_the_body_is(seed: int, count: int) -> None:
    """All points are on or above its plane, and no triple around the place is lower there."""
    random = np.random.default_rng(seed)
    points: list[Vector] = [tuple(p) for p in random.uniform(-1.0, 1.0, (count, 3)).tolist()]
    at = (float(random.uniform(-0.7, 0.7)), float(random.uniform(-0.7, 0.7)))
    face, expected = resting_face(lowest_of(points), at), height_below(points, at)
    assert (face is None) == (expected is None)
    if face is None or expected is None:
        return
    assert min(face.height(p) for p in points) > -1e-7
    assert height_at(face, at) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize('at', [(0.0, 0.0), (0.5, 0.5), (0.0, 0.5), (0.99, 0.0)])
def test_four_points_in_one_plane_are_level(at: tuple[float, float]) -> None:
    """Also where the centre of gravity is on a line between two of them."""
    face = resting_face(lowest_of(SQUARE), at)
    assert face is not None
    assert face.tilt == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize('at', [(1.1, 0.0), (0.0, -3.0)])
def test_there_is_none_beside_the_body(at: tuple[float, float]) -> None:
    """Nor on points in one line, nor on none."""
    assert resting_face(lowest_of(SQUARE), at) is None
    assert resting_face(lowest_of(SQUARE[:2]), (1.0, 0.0)) is None


@pytest.mark.parametrize('heading', [0.0, 0.8, 2.4, -2.4])
def test_the_heading_is_where_the_plane_falls(heading: float) -> None:
    """A plane of 2 deg falls by that towards its heading."""
    fall = math.tan(math.radians(2.0))
    points: list[Vector] = [
        (x, y, -fall * (x * math.cos(heading) + y * math.sin(heading))) for x, y, _ in SQUARE
    ]
    face = resting_face(lowest_of(points), (0.1, 0.2))
    assert face is not None
    assert math.degrees(face.tilt) == pytest.approx(2.0)
    assert face.heading == pytest.approx(heading)


def test_a_body_without_corners_rests_on_its_true_points() -> None:
    """Three balls of different radii: the plane touches all of them, to a nanometre."""
    balls = [((1.0, 0.0, 0.0), 0.3), ((-1.0, 1.0, 0.0), 0.1), ((-1.0, -1.0, 0.2), 0.2)]

    def lowest(up: Vector) -> Vector:
        n = np.array(up)
        x, y, z = min((np.array(c) - r * n for c, r in balls), key=lambda p: float(p @ n)).tolist()
        return x, y, z

    face = resting_face(lowest, (0.0, 0.0))
    assert face is not None
    for centre, radius in balls:
        assert face.height(centre) == pytest.approx(radius, abs=2e-9)
