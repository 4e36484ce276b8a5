"""The support polygon against convex hulls of others, and many samples against one at a time."""

import math
from itertools import combinations

import numpy as np
import pytest
from robots import centre, feet, places, random_robot, tracked
from scipy.spatial import ConvexHull

from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Contact, Link, Robot
from ugv_acceptance.model.support import Support, pairs, support_of, supports_of

Points = list[tuple[float, float, float]]
COG = (0.0, 0.0, 0.3)


def standing_on(points: Points, tolerance: float = 0.001) -> Robot:
    """Return a robot of one link with these contact points."""
    contacts = tuple(Contact(f'p{k}', 'base_link', p) for k, p in enumerate(points))
    link = Link('base_link', 10.0, (0.0, 0.0, 0.3))
    return Robot('stool', (link,), (), (), contacts, contact_tolerance=tolerance)


def plane(points: np.ndarray, height: float = 0.0) -> Points:
    """Return points (n, 2) at one height."""
    return [(float(x), float(y), height) for x, y in points]


def canonical(cycle: list[int]) -> tuple[int, ...]:
    """Return a cycle that starts with its smallest number."""
    start = cycle.index(min(cycle))
    return tuple(cycle[start:] + cycle[:start])


def test_the_polygon_is_the_convex_hull() -> None:
    """For random points on the ground it is scipy's hull, counter-clockwise."""
    rng = np.random.default_rng(0)
    for _ in range(300):
        points = rng.uniform(-0.5, 0.5, (int(rng.integers(3, 12)), 2))
        robot = standing_on(plane(points))
        support = support_of(robot, plane(points), COG)
        expected = canonical([int(k) for k in ConvexHull(points).vertices])
        assert support == Support(expected, len(points), raised=False)


def test_points_on_an_edge_are_no_corners() -> None:
    """Neither are points that stand twice in one place."""
    square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    points = plane(np.array([*square, (0.5, 0.0), (1.0, 1.0), (0.5, 0.5)]))
    polygon = support_of(standing_on(points), points, COG).polygon
    assert {points[k] for k in polygon} == set(plane(np.array(square)))
    assert len(polygon) == 4


def test_only_points_near_the_ground_stand() -> None:
    """A point higher than the tolerance above the tracks' plane is in the air."""
    points = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0009), (0.0, 1.0, 0.0), (1.0, 1.0, 0.0011)]
    assert support_of(standing_on(points), points, COG) == Support((0, 1, 2), 3, raised=False)


def test_the_ground_may_lie_anywhere_in_the_base() -> None:
    """With base_link at axle height the tracks' plane is below it."""
    points = [*plane(np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]), -0.095), (1.0, 1.0, 0.0)]
    robot = Robot('r', (Link('a', 1.0),), (), (), (), ground=-0.095)
    expected = Support((0, 1, 2), 3, raised=False, known=True)
    assert support_of(robot, points, COG) == expected
    assert support_of(robot, points, COG).known
    assert many(robot, [points] * 2, [COG] * 2) == [expected] * 2


@pytest.mark.parametrize('lift', [0.0, -0.25])
@pytest.mark.parametrize(('height', 'stands'), [(0.125, True), (0.126, False)])
def test_a_point_may_be_as_high_as_the_tolerance(
    lift: float,
    height: float,
    stands: bool,  # noqa: FBT001
) -> None:
    """An eighth of a metre above the tracks' plane, or above the face the robot is raised on."""
    flat = plane(np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]), lift)
    points = [*flat, (1.0, 1.0, lift + height)]
    cycle = (0, 1, 3, 2) if stands else (0, 1, 2)
    expected = Support(cycle, len(cycle), raised=lift < 0.0)
    assert support_of(standing_on(points, 0.125), points, (0.2, 0.2, 0.5)) == expected
    assert many(standing_on(points, 0.125), [points] * 2, [(0.2, 0.2, 0.5)] * 2) == [expected] * 2


@pytest.mark.parametrize('count', [0, 1, 2])
@pytest.mark.parametrize('height', [0.0, -0.3])
def test_fewer_than_three_points_make_no_polygon(count: int, height: float) -> None:
    """Their number is told, on the tracks' plane or below it."""
    points = plane(np.array([(0.0, 0.0), (1.0, 0.0)]), height)[:count]
    expected = Support((), count, raised=count > 0 and height < 0.0)
    assert support_of(standing_on(points), points, COG) == expected
    if count:
        assert many(standing_on(points), [points] * 2, [COG] * 2) == [expected] * 2


def test_nothing_stands_where_all_is_in_the_air() -> None:
    """No point reaches the tracks' plane."""
    points = plane(np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]), 0.2)
    assert support_of(standing_on(points), points, COG) == Support((), 0, raised=False)
    assert many(standing_on(points), [points] * 2, [COG] * 2) == [Support((), 0, raised=False)] * 2


@pytest.mark.parametrize('cog', [(0.2, 0.2, 0.5), (0.9, 0.9, 0.5), (-1.0, 0.3, 0.5)])
@pytest.mark.parametrize('extra', [[], [(0.4, 0.4, 0.3)]])
def test_three_low_points_are_stood_on_wherever_the_cog_is(
    cog: tuple[float, float, float], extra: Points
) -> None:
    """Above them or beside them; a point high above them does not count."""
    points = [*plane(np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]), -0.2), *extra]
    expected = Support((0, 1, 2), 3, raised=True)
    assert support_of(standing_on(points), points, cog) == expected
    assert many(standing_on(points), [points] * 3, [cog] * 3) == [expected] * 3


def test_samples_above_and_beside_their_points_are_told_apart() -> None:
    """The same points: the face under the first centre of gravity is not that under the second."""
    points = [(0.0, 0.0, -0.3), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, -1.0, 0.0)]
    cogs = [(0.3, 0.3, 0.4), (0.1, -0.4, 0.4), (-0.4, 0.1, 0.4), (3.0, 3.0, 0.4), (2.0, -3.0, 0.4)]
    faces = [(0, 1, 2), (0, 3, 1), (0, 2, 3), (0, 1, 2), (0, 3, 1)]
    expected = [Support(face, 3, raised=True) for face in faces]
    assert [support_of(standing_on(points), points, cog) for cog in cogs] == expected
    assert many(standing_on(points), [points] * 5, cogs) == expected


@pytest.mark.parametrize('height', [0.0, -0.3])
def test_points_in_one_line_make_no_polygon(height: float) -> None:
    """On the tracks' plane or below it."""
    points = [(0.1 * k, 0.2 * k, height) for k in range(5)]
    support = support_of(standing_on(points), points, COG)
    assert (support.polygon, support.standing) == ((), 5)
    assert many(standing_on(points), [points] * 3, [COG] * 3) == [support] * 3


@pytest.mark.parametrize('bad', [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize('place', [0, 1, 2, 3])
def test_an_unknown_coordinate_makes_the_support_unknown(bad: float, place: int) -> None:
    """Of a contact or of the centre of gravity, for one sample as for many."""
    points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 1.0]]
    cog = [0.3, 0.3, 0.3]
    (cog if place == 3 else points[3])[min(place, 2)] = bad
    known, unknown = [(x, y, z) for x, y, z in points], (cog[0], cog[1], cog[2])
    robot = standing_on(known)
    support = support_of(robot, known, unknown)
    assert support == Support((), 0, raised=False, known=False)
    assert many(robot, [known] * 2, [unknown] * 2) == [support] * 2


def test_a_raised_robot_stands_on_the_face_of_the_lower_hull_under_its_cog() -> None:
    """It is the facet of scipy's hull in space that faces down and holds the plumb line."""
    rng = np.random.default_rng(1)
    found = 0
    for _ in range(300):
        points = rng.uniform(-0.5, 0.5, (int(rng.integers(4, 9)), 3))
        points[0, 2] = -0.6
        cog = rng.uniform(-0.3, 0.3, 3)
        expected = face_under(points, cog)
        if expected is None:
            continue
        found += 1
        triples: Points = [(x, y, z) for x, y, z in points.tolist()]
        support = support_of(standing_on(triples, 1e-9), triples, (cog[0], cog[1], cog[2]))
        assert support.raised
        assert set(support.polygon) == expected
        assert support.standing == 3
    assert found > 100


def face_under(points: np.ndarray, cog: np.ndarray) -> set[int] | None:
    """Return the three points of the lower facet that holds the cog's plumb line; None: no such."""
    hull = ConvexHull(points)
    for triple, normal in zip(hull.simplices, hull.equations, strict=True):
        (ax, ay), (bx, by), (cx, cy) = points[triple][:, :2]
        matrix = np.array([[ax, bx, cx], [ay, by, cy], [1.0, 1.0, 1.0]])
        inside = (np.linalg.solve(matrix, [cog[0], cog[1], 1.0]) >= 0.0).all()
        if normal[2] < 0.0 and inside:
            return set(triple.tolist())
    return None


def test_a_raised_robot_whose_cog_lies_outside_all_points_tips_over_an_edge() -> None:
    """Some face is found, and the centre of gravity lies outside one of its edges."""
    rng = np.random.default_rng(2)
    for _ in range(200):
        points = rng.uniform(-0.5, 0.5, (6, 3))
        points[0, 2] = -0.6
        angle = rng.uniform(0.0, 2.0 * np.pi)
        cog = (2.0 * math.cos(angle), 2.0 * math.sin(angle), 0.3)
        triples: Points = [(x, y, z) for x, y, z in points.tolist()]
        support = support_of(standing_on(triples, 1e-9), triples, cog)
        assert support.raised
        sides = [
            (points[j, 0] - points[i, 0]) * (cog[1] - points[i, 1])
            - (points[j, 1] - points[i, 1]) * (cog[0] - points[i, 0])
            for i, j in pairs(support.polygon)
        ]
        assert min(sides) < 0.0


def test_flippers_pressed_down_raise_the_front() -> None:
    """Pointing forward and down they stand with the rear ends of the tracks."""
    robot = tracked()
    names = [c.name for c in robot.contacts]
    posture = feet(robot, [0.0, 0.5, -0.5, -0.6])
    assert posture[:, 2].min() < -0.02
    triples: Points = [(x, y, z) for x, y, z in posture.tolist()]
    support = support_of(robot, triples, (0.1, 0.0, 0.2))
    assert support.raised
    expected = {'rear_left', 'rear_right', 'flipper_left', 'flipper_right'}
    assert {names[k] for k in support.polygon} == expected


def test_flippers_laid_on_the_ground_lengthen_the_polygon() -> None:
    """At the height of the tracks they stand with them."""
    robot = tracked()
    down = -math.asin(0.095 / math.hypot(0.233, 0.035)) + math.atan2(0.035, 0.233)
    points: Points = [(x, y, z) for x, y, z in feet(robot, [0.0, 0.5, -0.5, down]).tolist()]
    support = support_of(robot, points, (0.1, 0.0, 0.2))
    corners = {robot.contacts[k].name for k in support.polygon}
    assert corners == {'rear_left', 'rear_right', 'flipper_left', 'flipper_right'}
    assert (support.standing, support.raised) == (6, False)


def many(robot: Robot, points: list[Points], cogs: Points) -> list[Support]:
    """Return each sample's support by the function of arrays; every row must come once."""
    contacts = [tuple(np.array(p)[:, k] for k in range(3)) for p in np.swapaxes(points, 0, 1)]
    cog = tuple(np.array(cogs).T)
    found: list[list[Support]] = [[] for _ in points]
    for rows, support in supports_of(robot, contacts, cog, len(points)):
        for row in np.arange(len(points))[rows]:
            found[row].append(support)
    assert [len(x) for x in found] == [1] * len(points)
    return [support for (support,) in found]


# A table's legs (m), which stand below the tracks' plane: first, second, ... counter-clockwise.
LEGS = [(0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2)]


@pytest.mark.parametrize('uneven', [2e-4, 5e-4, 9e-4, 2e-3])
def test_a_table_rocks_about_the_legs_that_are_longer(uneven: float) -> None:
    """With its last leg shorter by more than the tolerance it stands on the others, else on it.

    The load is near the second leg: a longer last leg makes a diagonal with that one.
    """
    short, long = (
        [(x, y, -0.05 + d) for (x, y), d in zip(LEGS, (0.0, 0.0, 0.0, by), strict=True)]
        for by in (uneven, -uneven)
    )
    samples: list[Points] = [short, long] * 8
    found = many(standing_on(short, 1e-4), samples, [(-0.1, 0.1, 0.3)] * len(samples))
    corners = (
        {tuple(sorted(s.polygon)) for s in found[::2]},
        {tuple(sorted(s.polygon)) for s in found[1::2]},
    )
    assert corners == ({(0, 1, 2)}, {(0, 1, 3)})
    assert {(s.standing, s.raised) for s in found} == {(3, True)}


def stands_on(points: np.ndarray, cog: np.ndarray, tolerance: float) -> set[int]:
    """Return the points (n, 3) within `tolerance` of the plane that carries the cog, by trial.

    Of three points that have the cog between them, and no other point below their plane.
    """
    for three in combinations(range(len(points)), 3):
        a, b, c = points[list(three)]
        normal = np.cross(b - a, c - a)
        share = np.linalg.solve(np.array([[*p[:2], 1.0] for p in (a, b, c)]).T, [*cog[:2], 1.0])
        height = (points - a) @ (normal / normal[2])
        if (share > 0.0).all() and (height > -1e-12).all():
            return set(np.flatnonzero(height <= tolerance).tolist())
    return set()


@pytest.mark.parametrize('tolerance', [1e-4, 5e-4, 3e-3])
def test_uneven_tables_stand_on_the_legs_that_reach_the_ground(tolerance: float) -> None:
    """As found by trying every three legs: 300 tables, legs of up to 8 mm difference, any load."""
    rng = np.random.default_rng(11)
    turn = np.linspace(0.0, 2.0 * np.pi, 7, endpoint=False)
    points = np.empty((300, 7, 3))
    points[:, :, 0], points[:, :, 1] = 0.3 * np.cos(turn), 0.2 * np.sin(turn)
    points[:, :, 2] = rng.uniform(-0.058, -0.05, points.shape[:2])
    cogs = rng.uniform([-0.15, -0.1, 0.3], [0.15, 0.1, 0.3], (300, 3))
    samples: list[Points] = [[(x, y, z) for x, y, z in p] for p in points.tolist()]
    centres = [(x, y, z) for x, y, z in cogs.tolist()]
    robot = standing_on(samples[0], tolerance)
    expected = [len(stands_on(p, c, tolerance)) for p, c in zip(points, cogs, strict=True)]
    assert min(expected) >= 3
    assert [s.standing for s in many(robot, samples, centres)] == expected
    alone = [support_of(robot, p, c).standing for p, c in zip(samples, centres, strict=True)]
    assert alone == expected


@pytest.mark.parametrize('seed', range(4))
def test_many_samples_have_the_supports_of_each_alone(seed: int) -> None:
    """Random points about the ground: standing, raised, too few, in line, unknown, all mixed."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-0.5, 0.5, (400, 6, 3))
    points[:, :, 2] = rng.choice([0.0, 0.0005, 0.2], (400, 6))
    points[::3, :2, 2] = rng.uniform(-0.2, 0.1, (134, 2))
    points[::10, :, 1] = 0.1 * points[::10, :, 0]
    points[5::50, 2, 1] = np.nan
    cogs = rng.uniform(-0.6, 0.6, (400, 3))
    samples: list[Points] = [[(x, y, z) for x, y, z in p] for p in points.tolist()]
    centres = [(x, y, z) for x, y, z in cogs.tolist()]
    robot = standing_on(samples[0])
    expected = [support_of(robot, p, c) for p, c in zip(samples, centres, strict=True)]
    assert many(robot, samples, centres) == expected
    assert len(set(expected)) > 20


@pytest.mark.parametrize('seed', range(3))
def test_many_postures_have_the_supports_of_each_alone(seed: int) -> None:
    """Joints move some contact points, the base carries the others."""
    rng = np.random.default_rng(seed)
    robot = tracked() if seed == 0 else random_robot(rng, 4, moving=2)
    q = rng.uniform(-3.0, 3.0, (500, len(robot.joint_names)))
    mechanics, load = mechanics_of(robot), robot.payload
    posture = posture_of(mechanics, list(q.T), load.mass, load.cog)
    found = supports_of(robot, posture.contacts, posture.cog, len(q))
    assert sum(np.arange(len(q))[rows].size for rows, _ in found) == len(q)
    for rows, support in found:
        for row in np.arange(len(q))[rows]:
            one = posture_of(mechanics, q[row].tolist(), load.mass, load.cog)
            assert support_of(robot, one.contacts, one.cog) == support  # type: ignore[arg-type]


def test_samples_beside_the_limit_of_a_thin_polygon_come_to_an_end() -> None:
    """Three points in one line but for a micrometre, which may or may not make a polygon."""
    rng = np.random.default_rng(6)
    points = np.zeros((3_000, 4, 3))
    points[:, :, 0] = np.array([-0.3, -0.1, 0.1, 0.3]) + rng.uniform(-1e-3, 1e-3, (3_000, 4))
    points[:, :, 1] = rng.uniform(-1e-6, 1e-6, (3_000, 4))
    samples: list[Points] = [[(x, y, z) for x, y, z in p] for p in points.tolist()]
    robot = standing_on(samples[0])
    expected = [support_of(robot, p, COG) for p in samples]
    assert many(robot, samples, [COG] * len(samples)) == expected
    assert len(set(expected)) > 5
    line: Points = [(-0.3, 0.0, 0.0), (0.0, 1e-6, 0.0), (0.3, 0.0, 0.0)]
    assert len(supports_of(standing_on(line), line, COG, 1_000_000)) == 1


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


def test_no_sample_has_no_support() -> None:
    """An empty recording is no error."""
    empty = np.empty(0)
    contacts = [(empty, empty, empty)] * 4
    assert supports_of(tracked(), contacts, (empty, empty, empty), 0) == []
