"""The drawing's points against plain 4 x 4 matrices."""

import math
from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from robots import DOWN, centre, feet, paper_arm, places, tracked

from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Payload, Vector
from ugv_acceptance.model.solids import places_of
from ugv_acceptance.monitoring.drawing import Figure, Skeleton, figure_of, skeleton_of

ROBOT = tracked()
FIGURE = figure_of(ROBOT)
LOAD = Payload(3.0, (0.05, 0.01, -0.02))
turns = st.floats(-3.2, 3.2)


def drawn(q: Sequence[float], gravity: Vector = DOWN) -> Skeleton:
    """Return the drawing of a posture."""
    found = skeleton_of(FIGURE, q, gravity, LOAD)
    assert found is not None
    return found


@given(turns, turns, turns, turns)
def test_limbs_join_the_places_of_the_links(a: float, b: float, c: float, d: float) -> None:
    """The arm's limbs run from shoulder to elbow to gripper, wherever these are."""
    found, where = drawn((a, b, c, d)), places(ROBOT, (a, b, c, d))
    ends = [(limb.start, limb.end) for limb in found.limbs if limb.joint in {'shoulder', 'elbow'}]
    expected = [
        (where['link1'][:3, 3], where['link2'][:3, 3]),
        (where['link2'][:3, 3], where['gripper'][:3, 3]),
    ]
    np.testing.assert_allclose(ends, expected, atol=1e-12)


@given(turns, turns, turns, turns)
def test_points_are_those_of_the_robot(a: float, b: float, c: float, d: float) -> None:
    """Contacts, centre of gravity and load are where matrices put them."""
    q = (a, b, c, d)
    found = drawn(q)
    np.testing.assert_allclose(found.contacts, feet(ROBOT, q), atol=1e-12)
    np.testing.assert_allclose(found.cog, centre(ROBOT, q, LOAD)[1], atol=1e-12)
    gripper = places(ROBOT, q)['gripper']
    expected = gripper[:3, :3] @ LOAD.cog + gripper[:3, 3]
    assert found.load == pytest.approx(tuple(expected), abs=1e-12)


@given(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6))
def test_the_plumb_line_meets_the_ground_below_the_centre(x: float, y: float) -> None:
    """The plumb point is in the plane of the polygon, along gravity from the centre."""
    gravity = (9.81 * math.sin(x), 9.81 * math.sin(y), -8.0)
    found = drawn((0.3, 0.5, 0.2, 2.0), gravity)
    assert found.plumb is not None
    along = np.subtract(found.plumb, found.cog)
    np.testing.assert_allclose(np.cross(along, gravity), 0.0, atol=1e-9)
    assert found.plumb[2] == pytest.approx(0.0, abs=1e-9)


def test_no_plumb_point_without_gravity_to_the_ground() -> None:
    """An inverted robot, or one whose gravity is not known, has no plumb point."""
    assert drawn((0.0, 0.5, 0.2, 2.0), (0.0, 0.0, 9.81)).plumb is None
    assert drawn((0.0, 0.5, 0.2, 2.0), (math.nan,) * 3).plumb is None


def test_nothing_is_drawn_of_an_unknown_posture() -> None:
    """A missing joint gives no drawing, not a robot with a joint at zero."""
    assert skeleton_of(FIGURE, (0.0, math.nan, 0.0, 0.0), DOWN, LOAD) is None
    assert skeleton_of(FIGURE, (), DOWN, LOAD) is None


def test_a_robot_that_stands_nowhere_is_drawn_without_polygon() -> None:
    """An arm without contact points has limbs and no polygon."""
    found = skeleton_of(figure_of(paper_arm()), (0.3, 0.2), DOWN, LOAD)
    assert found is not None
    assert len(found.limbs) == 2
    assert (found.polygon, found.plumb) == ((), None)


@given(turns, turns, turns, turns)
def test_solids_are_drawn_where_their_bodies_are(a: float, b: float, c: float, d: float) -> None:
    """The figure's places are those of the model, in the order of its bodies."""
    robot = load('packbot').settings.robot
    figure = figure_of_packbot()
    q = (a, b, c, d)
    found = skeleton_of(figure, q, DOWN, LOAD)
    assert found is not None
    every = places_of(robot, q)
    assert len(found.places) == len(figure.bodies) == 4
    for (turn, at), body in zip(found.places, figure.bodies, strict=True):
        np.testing.assert_allclose(turn, every[body][0], atol=1e-12)
        np.testing.assert_allclose(at, every[body][1], atol=1e-12)
    joints = {limb.joint: figure.shape_of(limb.joint) for limb in found.limbs}
    assert joints == {'flipper_joint': True, 'shoulder_joint': True, 'elbow_joint': True}
    assert not FIGURE.shape_of('elbow')


@cache
def figure_of_packbot() -> Figure:
    """Return PackBot's drawing."""
    return figure_of(load('packbot').settings.robot)
