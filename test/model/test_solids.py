"""The solids that are drawn, against plain 4 x 4 matrices and the shapes' own surfaces."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from robots import places, tracked

from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Matrix, Shape
from ugv_acceptance.model.solids import moving_bodies, placed, places_of, solids_of

turns = st.floats(-3.2, 3.2)


def leaning(angle: float) -> Matrix:
    """Return a rotation about x."""
    s, c = math.sin(angle), math.cos(angle)
    return (1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c)


SHAPES = (
    Shape('base_link', 'box', (0.1, 0.0, 0.2), leaning(0.3), (0.3, 0.2, 0.1)),
    Shape('link1', 'cylinder', (0.2, 0.0, 0.0), leaning(1.2), (0.05, 0.05, 0.2)),
    Shape('gripper', 'sphere', (0.0, 0.1, 0.0), leaning(0.0), (0.07, 0.07, 0.07)),
    Shape('link2', 'mesh', (0.0, 0.0, 0.0), leaning(0.0), None),
    Shape('link2', 'box', (0.0, 0.0, 0.0), leaning(0.0), (0.001, 0.001, 0.001)),
)
ROBOT = replace(tracked(), drawn=SHAPES[:1], shapes=SHAPES[1:])


@given(turns, turns, turns, turns)
def test_a_solid_is_where_its_link_is(a: float, b: float, c: float, d: float) -> None:
    """Centre and reach along each axis are those of the shape, placed with its link."""
    q, where = (a, b, c, d), places(ROBOT, (a, b, c, d))
    at = places_of(ROBOT, q)
    solids = solids_of(ROBOT)
    assert [s.link for s in solids] == ['base_link', 'link1', 'gripper']
    for solid, shape in zip(solids, SHAPES, strict=False):
        points = np.array(placed(solid, at[solid.body]))
        t = where[shape.link]
        centre = t[:3, :3] @ shape.xyz + t[:3, 3]
        np.testing.assert_allclose(points.mean(axis=0), centre, atol=1e-9)
        axes, size = t[:3, :3] @ np.array(shape.rotation), np.array(shape.size)
        spread = np.ptp(points @ axes, axis=0) / 2.0 + solid.radius
        np.testing.assert_allclose(spread, size, atol=1e-9)


def test_what_is_no_solid_is_left_out() -> None:
    """A mesh is not read, and a shape of a few millimetres is a mark; the base does not move."""
    solids = solids_of(ROBOT)
    assert moving_bodies(solids) == tuple(sorted({s.body for s in solids} - {0}))
    assert 0 in {s.body for s in solids}


def test_all_that_is_solid_in_a_description_is_drawn() -> None:
    """The body of a robot too, which no clearance is asked of; no margin hangs on it."""
    robot = load('packbot').settings.robot
    links = {solid.link for solid in solids_of(robot)}
    assert links >= {'chassis_link', 'flipper_link', 'turret_link', 'arm_link_1', 'arm_link_2'}
    assert replace(robot, drawn=()) == robot
    tracks = [p for s in solids_of(robot) if s.link == 'chassis_link' for p in s.points]
    assert min(z for _, _, z in tracks) == pytest.approx(0.0, abs=1e-9)
    assert math.isclose(max(x for x, _, _ in tracks), 0.345, abs_tol=0.005)
