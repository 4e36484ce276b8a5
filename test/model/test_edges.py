"""Edges of support polygons: their sides, which corners move, and margins of edges on a slant."""

import math
from itertools import pairwise

import numpy as np
import pytest
from robots import tracked

from ugv_acceptance.model.edges import SIDES, corners_of, edges_of, side_of
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Contact, Link, Robot, Vector
from ugv_acceptance.model.stability import RAISED, stability_of, stances_of, standing

FRONT, LEFT, REAR, RIGHT = range(4)
NORMALS = [
    ((0.3, 0.1), FRONT), ((0.3, -0.1), FRONT), ((0.1, 0.3), LEFT), ((-0.1, 0.3), LEFT),
    ((-0.3, 0.1), REAR), ((-0.3, -0.1), REAR), ((0.1, -0.3), RIGHT), ((-0.1, -0.3), RIGHT),
    ((0.2, 0.2), FRONT), ((0.2, -0.2), FRONT), ((-0.2, 0.2), REAR), ((-0.2, -0.2), REAR),
    ((5.0, 0.0), FRONT), ((-5.0, 0.0), REAR), ((0.0, 5.0), LEFT), ((0.0, -5.0), RIGHT),
]  # fmt: skip


def test_the_sides_go_round_from_the_front() -> None:
    """The sides go front, left, rear, right: counter-clockwise seen from above."""
    assert SIDES == ('front', 'left', 'rear', 'right')


@pytest.mark.parametrize(('normal', 'side'), NORMALS)
def test_an_edge_lies_on_the_side_its_normal_points_to_most(
    normal: tuple[float, float], side: int
) -> None:
    """Of equals front and rear; floats, arrays and one of each alike."""
    x, y = normal
    several = np.array((x, x)), np.array((y, y))
    assert side_of(x, y) == side
    for one, other in ((several[0], several[1]), (x, several[1]), (several[0], y)):
        assert side_of(one, other).tolist() == [side, side]


def test_corners_of_the_base_are_constants() -> None:
    """The flippers' move; the sides are known beforehand where none does."""
    mechanics = mechanics_of(tracked())
    names = [contact.name for contact in mechanics.robot.contacts]
    tracks = ('rear_right', 'front_right', 'front_left', 'rear_left')
    still = corners_of(mechanics, tuple(names.index(name) for name in tracks))
    assert still.moving == ()
    assert still.sides == (RIGHT, FRONT, LEFT, REAR)
    ends = ('rear_right', 'flipper_right', 'flipper_left', 'rear_left')
    lifted = corners_of(mechanics, tuple(names.index(name) for name in ends))
    assert [names[k] for k in lifted.moving] == ['flipper_right', 'flipper_left']
    assert lifted.sides is None
    terms = (9.0, 9.0, 9.0, 0.5, -0.25, 0.1, 0.6, 0.25, 0.1)
    along = [(0.76, -0.05), (0.1, 0.5), (-0.86, -0.05), (0.0, -0.4)]
    normals = lifted.outward.one(*terms)
    assert np.array(normals) == pytest.approx(np.array([(y, -x) for x, y in along]))


@pytest.mark.parametrize('sides', [(0, 1, 2), (0, 1, 2, 3, 0)])
def test_every_edge_has_one_side(sides: tuple[int, ...]) -> None:
    """Every edge of a support polygon belongs to exactly one side."""
    mechanics = mechanics_of(tracked())
    with pytest.raises(ValueError, match='zip'):
        edges_of(mechanics, corners_of(mechanics, (3, 1, 0, 2)), sides)


# Three feet, two of them low: the robot is raised, and its edges lie on a slant.
SLANTED: list[Vector] = [(-0.3, -0.2, 0.0), (0.35, -0.25, -0.2), (-0.35, 0.2, -0.02)]


def slanted(points: list[Vector]) -> Robot:
    """Return a robot of one link whose tracks' plane is at 0."""
    contacts = tuple(Contact(f'p{k}', 'base', p) for k, p in enumerate(points))
    return Robot('r', (Link('base', 12.0, (0.02, -0.03, 0.3)),), (), (), contacts)


@pytest.mark.parametrize('seed', range(20))
def test_margins_of_a_raised_robot_are_those_of_its_slanted_edges(seed: int) -> None:
    """Angle, moment, energy and ZMP of each edge, by plain vectors: none of the edges is level."""
    rng = np.random.default_rng(seed)
    points = [(x, y, z - float(rng.uniform(0.0, 0.05))) for x, y, z in SLANTED]
    robot = slanted(points)
    mechanics = mechanics_of(robot)
    gravity = np.array((*rng.uniform(-4.0, 4.0, 2), -9.0))
    gx, gy, gz = gravity.tolist()
    stances = stances_of(mechanics, posture_of(mechanics, [], 0.0, (0.0, 0.0, 0.0)))
    stance = standing(stances, (gx, gy, gz))
    assert stance.state == RAISED
    assert stance.footing is not None
    found = stability_of(stance, (gx, gy, gz))
    cog = np.array(robot.links[0].cog)
    margin = {name: np.full(4, np.inf) for name in ('angle', 'moment', 'energy')}
    distances = []
    cycle = (*stance.footing.polygon, stance.footing.polygon[0])
    for (i, j), side in zip(pairwise(cycle), stance.sides, strict=True):
        start, edge = np.array(points[i]), np.subtract(points[j], points[i])
        along = edge / np.linalg.norm(edge)
        moment = -12.0 * float(np.cross(cog - start, gravity) @ along)
        foot = start + along * ((cog - start) @ along)
        pull = gravity - along * (gravity @ along)
        size, arm = float(np.linalg.norm(pull)), float(np.linalg.norm(cog - foot))
        reach = float((cog - foot) @ pull)
        angle = math.copysign(math.acos(-reach / size / arm), moment)
        lift = 12.0 * (size * arm + reach)
        for name, value in (
            ('angle', angle), ('moment', moment), ('energy', math.copysign(lift, moment)),
        ):  # fmt: skip
            margin[name][side] = min(margin[name][side], value)
        # The plumb line meets the plane of the edge and the level line at right angles to it.
        level = np.array((-along[1], along[0], 0.0)) / np.hypot(along[0], along[1])
        parts = np.linalg.solve(np.column_stack((along, level, -gravity)), cog - start)
        distances.append(float(parts[1]))
    for name, expected in margin.items():
        assert np.array(getattr(found, name)) == pytest.approx(expected, rel=1e-9)
    assert found.zmp == pytest.approx(min(distances), rel=1e-9)
