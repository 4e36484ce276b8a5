"""Footings: which contact points can carry a robot, and many samples against one at a time."""

import math
from dataclasses import replace

import numpy as np
import pytest
from robots import centre, feet, places, random_robot, tracked
from scipy.spatial import ConvexHull

from ugv_acceptance.model.feet import feet_of
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Contact, Link, Robot
from ugv_acceptance.model.support import (
    MOST,
    Footing,
    flat_polygon,
    footings_of,
    many_footings,
)

Points = list[tuple[float, float, float]]
SQUARE = [(0.3, 0.3), (-0.3, 0.3), (-0.3, -0.3), (0.3, -0.3)]
# Radius (m) of the square; rocking (rad) for each metre that a corner is off the ground.
RADIUS = 0.3 * math.sqrt(2.0)
CHARGE = 10.0 / RADIUS


def standing_on(points: Points, ground: float = 0.0) -> Robot:
    """Return a robot of one link with these contact points."""
    contacts = tuple(Contact(f'p{k}', 'base_link', p) for k, p in enumerate(points))
    link = Link('base_link', 10.0, (0.0, 0.0, 0.3))
    return Robot('stool', (link,), (), (), contacts, ground=ground)


def plane(points: np.ndarray, height: float = 0.0) -> Points:
    """Return points (n, 2) at one height."""
    return [(float(x), float(y), height) for x, y in points]


def square(*heights: float) -> Points:
    """Return the corners of a square, counter-clockwise, at these heights (m)."""
    return [(x, y, z) for (x, y), z in zip(SQUARE, heights, strict=True)]


def footings(points: Points, ground: float = 0.0) -> tuple[Footing, ...]:
    """Return the footings of a robot of one link."""
    return footings_of(mechanics_of(standing_on(points, ground)), points)


def rocking_of(points: Points, polygon: tuple[int, ...]) -> float:
    """Return the rocking (rad) of the footing with these corners."""
    (found,) = [f for f in footings(points) if set(f.polygon) == set(polygon)]
    assert isinstance(found.rocking, float)
    return found.rocking


def canonical(cycle: list[int]) -> tuple[int, ...]:
    """Return a cycle that starts with its smallest number."""
    start = cycle.index(min(cycle))
    return tuple(cycle[start:] + cycle[:start])


def test_on_one_plane_the_polygon_is_the_convex_hull() -> None:
    """For random points on the ground it is scipy's hull, counter-clockwise, without rocking."""
    rng = np.random.default_rng(0)
    for _ in range(100):
        points = rng.uniform(-0.5, 0.5, (int(rng.integers(3, 12)), 2))
        expected = canonical([int(k) for k in ConvexHull(points).vertices])
        (found,) = footings(plane(points))
        assert found.polygon == expected
        assert (found.points, found.rocking, found.raised) == (
            tuple(range(len(points))),
            0.0,
            False,
        )


def test_points_on_an_edge_are_no_corners() -> None:
    """Neither are points that stand twice in one place."""
    corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    points = plane(np.array([*corners, (0.5, 0.0), (1.0, 1.0), (0.5, 0.5)]))
    (found,) = footings(points)
    assert {points[k] for k in found.polygon} == set(plane(np.array(corners)))
    assert len(found.polygon) == 4


@pytest.mark.parametrize('by', [0.0002, 0.001, 0.004])
def test_a_corner_off_the_ground_carries_at_the_price_of_rocking(by: float) -> None:
    """Higher or lower: all four carry, less 10 rad for each radius that it is out of plane."""
    for points in (square(0.0, 0.0, 0.0, by), square(0.0, 0.0, 0.0, -by)):
        # Its height above the plane of the three others is square to their plane, so a bit less.
        out = CHARGE * by
        assert rocking_of(points, (0, 1, 2, 3)) == pytest.approx(out, rel=1e-3)


@pytest.mark.parametrize('by', [0.002, -0.002])
def test_an_uneven_square_rests_on_two_triangles_without_rocking(by: float) -> None:
    """On either side of the diagonal through the two that are lower than the plane of the rest."""
    level = {frozenset(f.polygon) for f in footings(square(0.0, 0.0, 0.0, by)) if not f.rocking}
    first, second = ((0, 2, 1), (0, 2, 3)) if by > 0.0 else ((1, 3, 0), (1, 3, 2))
    assert level == {frozenset(first), frozenset(second)}


def test_a_footing_with_a_quarter_turn_of_rocking_is_none() -> None:
    """No edge is ever further away, so it is left out where there is another."""
    assert len(footings(square(0.0, 0.0, 0.0, 0.04))) == 3
    assert len(footings(square(0.0, 0.0, 0.0, -0.08))) == 2


def flippers(robot: Robot, position: float) -> Points:
    """Return the contact points of the tracked robot with its flippers at a position (rad)."""
    return [(x, y, z) for x, y, z in feet(robot, [0.0, 0.5, -0.5, position]).tolist()]


@pytest.mark.parametrize('position', [-0.25, -0.2, -0.1])
def test_flippers_above_the_ground_carry_at_the_price_of_the_drop(position: float) -> None:
    """10 rad for each radian by which the front drops until they touch, beyond 25 degrees 15."""
    robot = tracked()
    points = flippers(robot, position)
    front = max(
        x for (x, _, _), c in zip(points, robot.contacts, strict=True) if c.link == robot.root
    )
    tips = [p for p, c in zip(points, robot.contacts, strict=True) if c.link == 'flippers']
    drop = (tips[0][2] - robot.ground) / (tips[0][0] - front)
    assert drop > 0.0
    ahead = [f for f in footings_of(mechanics_of(robot), points) if len(f.points) == 6]
    prices = [f.rocking for f in ahead]
    far = math.radians(25.0)
    price = max(10.0 * drop, far + 1.5 * (10.0 * drop - far))
    assert prices == ([pytest.approx(price)] if price < MOST else [])


def test_legs_may_stand_at_any_height() -> None:
    """Without contacts on the base nothing is the tracks' plane: a body stands askew on a slope."""
    robot = tracked()
    legs = tuple(replace(c, link='link1') for c in robot.contacts)
    assert feet_of(mechanics_of(replace(robot, contacts=legs))).lines == ()


def test_a_high_point_of_the_base_is_no_track() -> None:
    """A bumper 10 cm up carries nothing; a corner 2 cm up is one of four feet."""
    low, high = ([*square(0.0, 0.0, 0.0, 0.0), (0.6, 0.0, z)] for z in (0.02, 0.1))
    assert feet_of(mechanics_of(standing_on(low))).others == ()
    assert [k for k, _ in feet_of(mechanics_of(standing_on(high))).others] == [4]
    assert [f.polygon for f in footings(high)] == [(0, 1, 2, 3)]


@pytest.mark.parametrize('lift', [0.3, -0.3])
def test_the_ground_is_where_three_points_are(lift: float) -> None:
    """A robot whose points are all above, or below, the configured ground stands on them."""
    (found,) = footings(square(lift, lift, lift, lift))
    assert (found.rocking, found.raised) == (0.0, lift < 0.0)


def test_the_ground_may_lie_anywhere_in_the_base() -> None:
    """With base_link at axle height the tracks' plane is below it."""
    points = [*plane(np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]), -0.095), (1.0, 1.0, 0.9)]
    (found,) = footings(points, ground=-0.095)
    assert (found.polygon, found.raised) == ((0, 1, 2), False)


def test_a_robot_does_not_stand_on_its_side() -> None:
    """A face inclined by more than 30 degrees costs 10 rad for each radian more."""
    steep = math.radians(35.0)
    points = [*plane(np.array([(0.0, 0.3), (0.0, -0.3)]))]
    points += [(-0.5 * math.cos(steep), y, -0.5 * math.sin(steep)) for y in (0.3, -0.3)]
    (found,) = footings(points)
    assert found.rocking == pytest.approx(10.0 * math.radians(5.0))


@pytest.mark.parametrize('count', [0, 1, 2])
def test_fewer_than_three_points_carry_nothing(count: int) -> None:
    """Neither one sample nor many."""
    points = plane(np.array([(0.0, 0.0), (1.0, 0.0)]))[:count]
    assert footings(points) == ()
    contacts = [tuple(np.full(3, x) for x in p) for p in points]
    assert many_footings(mechanics_of(standing_on(points)), contacts, 3) == []


@pytest.mark.parametrize('height', [0.0, -0.3])
def test_points_in_one_line_make_no_polygon(height: float) -> None:
    """On the tracks' plane or below it."""
    points = [(0.1 * k, 0.2 * k, height) for k in range(5)]
    assert footings(points) == ()
    assert many(standing_on(points), [points] * 3) == [()] * 3


def test_without_rocking_each_face_is_one_of_the_lower_hull() -> None:
    """They are scipy's facets in space that face down by less than 30 degrees."""
    rng = np.random.default_rng(1)
    for _ in range(100):
        points = rng.uniform(-0.5, 0.5, (int(rng.integers(4, 9)), 3))
        points[:, 2] = rng.uniform(-0.11, -0.1, len(points))  # all of them are tracks
        triples: Points = [(x, y, z) for x, y, z in points.tolist()]
        hull = ConvexHull(points)
        down = hull.equations[:, 2] < -math.cos(math.radians(30.0))
        expected = {frozenset(s.tolist()) for s in hull.simplices[down]}
        found = {frozenset(f.face) for f in footings(triples) if f.rocking == 0.0}
        assert found == expected


def test_flippers_pressed_down_raise_the_front() -> None:
    """Pointing forward and down they stand with the rear ends of the tracks."""
    robot = tracked()
    points, mechanics = flippers(robot, -0.6), mechanics_of(robot)
    first = footings_of(mechanics, points)[0]
    assert first.raised
    expected = {'rear_left', 'rear_right', 'flipper_left', 'flipper_right'}
    assert {robot.contacts[k].name for k in first.polygon} == expected
    assert flat_polygon(mechanics, points) == ()


def test_flippers_laid_on_the_ground_lengthen_the_polygon() -> None:
    """At the height of the tracks they stand with them."""
    robot = tracked()
    down = -math.asin(0.095 / math.hypot(0.233, 0.035)) + math.atan2(0.035, 0.233)
    points = flippers(robot, down)
    corners = {'rear_left', 'rear_right', 'flipper_left', 'flipper_right'}
    (found,) = [
        f
        for f in footings_of(mechanics_of(robot), points)
        if len(f.points) == 6 and len(f.polygon) == 4
    ]
    assert {robot.contacts[k].name for k in found.polygon} == corners
    assert found.rocking < 1e-6
    assert not found.raised


def test_a_flat_polygon_is_that_of_one_footing() -> None:
    """Where a point is nearly on the ground, gravity decides, and there is none."""
    for heights, expected in (
        ((0.0, 0.0, 0.0, 0.0), (0, 1, 2, 3)),
        ((0.0, 0.0, 0.0, 0.001), ()),
        ((-0.1, -0.1, -0.1, -0.1), ()),
    ):
        points = square(*heights)
        assert flat_polygon(mechanics_of(standing_on(points)), points) == expected


def many(robot: Robot, points: list[Points]) -> list[tuple[Footing, ...]]:
    """Return each sample's footings by the function of arrays, in the order of their polygons."""
    contacts = [tuple(np.array(p)[:, k] for k in range(3)) for p in np.swapaxes(points, 0, 1)]
    return by_row(many_footings(mechanics_of(robot), contacts, len(points)), len(points))


def by_row(parts: list, count: int) -> list[tuple[Footing, ...]]:  # type: ignore[type-arg]
    """Return each row's footings, in the order of their polygons."""
    found: list[list[Footing]] = [[] for _ in range(count)]
    for rows, footing in parts:
        at = np.arange(count)[rows]
        rocking = np.broadcast_to(footing.rocking, len(at)).tolist()
        for row, price in zip(at.tolist(), rocking, strict=True):
            found[row].append(
                Footing(footing.points, footing.face, footing.polygon, price, footing.raised)
            )
    return [tuple(sorted(one, key=lambda f: f.polygon)) for one in found]


def assert_same(found: tuple[Footing, ...], expected: tuple[Footing, ...]) -> None:
    """Compare the footings of a sample: polygons and what they cost, to rounding."""
    ordered = sorted(expected, key=lambda f: f.polygon)
    assert [(f.polygon, f.raised) for f in found] == [(f.polygon, f.raised) for f in ordered]
    prices = [np.array([f.rocking for f in some]) for some in (found, ordered)]
    np.testing.assert_allclose(prices[0], prices[1], atol=1e-11)


@pytest.mark.parametrize('seed', range(3))
def test_many_samples_have_the_footings_of_each_alone(seed: int) -> None:
    """Random points about the ground: standing, raised, nearly on it, in line, all mixed."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-0.5, 0.5, (200, 6, 3))
    points[:, :, 2] = rng.choice([0.0, 0.0005, 0.01, 0.2], (200, 6))
    points[::3, :2, 2] = rng.uniform(-0.2, 0.1, (67, 2))
    points[::10, :, 1] = 0.1 * points[::10, :, 0]
    samples: list[Points] = [[(x, y, z) for x, y, z in p] for p in points.tolist()]
    robot = standing_on(samples[0])
    found = many(robot, samples)
    for some, p in zip(found, samples, strict=True):
        assert_same(some, footings_of(mechanics_of(robot), p))
    assert len({f.polygon for some in found for f in some}) > 20


@pytest.mark.parametrize('seed', range(3))
def test_many_postures_have_the_footings_of_each_alone(seed: int) -> None:
    """Joints move some contact points, the base carries the others."""
    rng = np.random.default_rng(seed)
    robot = tracked() if seed == 0 else random_robot(rng, 4, moving=2)
    q = rng.uniform(-3.0, 3.0, (200, len(robot.joint_names)))
    mechanics, load = mechanics_of(robot), robot.payload
    posture = posture_of(mechanics, list(q.T), load.mass, load.cog)
    found = by_row(many_footings(mechanics, posture.contacts, len(q)), len(q))
    for some, row in zip(found, q.tolist(), strict=True):
        one = posture_of(mechanics, row, load.mass, load.cog)
        assert_same(some, footings_of(mechanics, one.contacts))  # type: ignore[arg-type]


@pytest.mark.parametrize('seed', range(3))
def test_postures_that_repeat_have_the_footings_of_each_alone(seed: int) -> None:
    """Feet that stand still, come back, or share one coordinate of two postures, to the bit."""
    rng = np.random.default_rng(seed)
    robot = tracked() if seed == 0 else random_robot(rng, 4, moving=2)
    few = rng.uniform(-3.0, 3.0, (40, len(robot.joint_names)))
    few = np.concatenate((few, -few[:20]))
    of = np.sort(rng.integers(0, len(few), 400)) if seed < 2 else rng.integers(0, len(few), 400)
    mechanics, load = mechanics_of(robot), robot.payload
    posture = posture_of(mechanics, list(few[of].T), load.mass, load.cog)
    found = by_row(many_footings(mechanics, posture.contacts, len(of)), len(of))
    alone = {}
    for k in set(of.tolist()):
        one = posture_of(mechanics, list(few[[k, k]].T), load.mass, load.cog)
        alone[k] = by_row(many_footings(mechanics, one.contacts, 2), 2)[0]
    assert found == [alone[k] for k in of.tolist()]


def test_postures_that_share_one_coordinate_are_others() -> None:
    """A point straight above or below where it was: it carries in some of the rows only."""
    low = np.tile([-0.1, 0.2, -0.1, -0.1], 5)
    contacts = [*plane(np.array(SQUARE)), (np.full(20, 0.5), 0.0, low)]
    robot = standing_on([*plane(np.array(SQUARE)), (0.5, 0.0, 0.0)])
    found = by_row(many_footings(mechanics_of(robot), contacts, 20), 20)
    ways = {height: {repr(one) for one in np.array(found, object)[low == height]} for height in low}
    assert all(len(of) == 1 for of in ways.values())
    assert ways[-0.1] != ways[0.2]


def test_contact_points_and_cog_follow_the_joints() -> None:
    """They are where 4 x 4 matrices put them."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        robot = random_robot(rng, 3, moving=2)
        q = rng.uniform(-3.0, 3.0, len(robot.joint_names)).tolist()
        posture = posture_of(mechanics_of(robot), q, robot.payload.mass, robot.payload.cog)
        mass, cog = centre(robot, q, robot.payload)
        np.testing.assert_allclose(np.array(posture.contacts), feet(robot, q), atol=1e-13)
        np.testing.assert_allclose(np.array(posture.cog), cog, atol=1e-13)
        assert posture.mass == pytest.approx(mass)
        assert set(places(robot, q)) == {link.name for link in robot.links}


def test_no_sample_has_no_footing() -> None:
    """An empty recording is no error."""
    empty = np.empty(0)
    found = many_footings(mechanics_of(tracked()), [(empty, empty, empty)] * 6, 0)
    assert [np.empty(0)[rows].size for rows, _ in found] in ([], [0])
