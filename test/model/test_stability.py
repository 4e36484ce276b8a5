"""Tip-over margins by brute force: tilt until the plumb line leaves the polygon, lift the cog."""

import math

import numpy as np
import pytest
from robots import DOWN, centre, feet, random_robot, tracked
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from ugv_acceptance.model.expressions import Number
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Contact, Link, Payload, Robot, Vector
from ugv_acceptance.model.stability import (
    DEGENERATE,
    FREE_FALL,
    INVERTED,
    NO_CONTACT,
    RAISED,
    SIDES,
    STANDING,
    UNKNOWN,
    Stability,
    many_stances,
    many_standing,
    margins,
    stability,
    stability_of,
    stances_of,
    standing,
    take_stance,
    tip_angles_of,
)
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.type_aliases import Floats

FLAT = [0.0, 0.5, -0.5, 2.5]  # the tracked robot, flippers up
HIGH = [0.3, 1.2, -0.2, 2.5]


def tilted(rng: np.random.Generator, count: int, most: float = 1.2) -> Floats:
    """Return gravity (count, 3) in bases tilted every way."""
    turn = Rotation.from_rotvec(rng.normal(size=(count, 3)) * most / 2.0)
    gravity: Floats = turn.apply(DOWN)
    gravity[:, 2] = -np.abs(gravity[:, 2])
    return gravity


def stool(points: list[Vector], cog: Vector = (0.0, 0.0, 0.3)) -> Robot:
    """Return a robot of one link."""
    contacts = tuple(Contact(f'p{k}', 'base_link', p) for k, p in enumerate(points))
    return Robot('stool', (Link('base_link', 10.0, cog),), (), (), contacts)


ORIGIN = (0.0, 0.0, 0.0)
SQUARE: list[Vector] = [(x, y, 0.0) for x in (-0.3, 0.3) for y in (-0.2, 0.2)]


def one(robot: Robot, q: list[float], gravity: Vector) -> Stability:
    """Return the margins of one sample by the functions of floats."""
    mechanics, load = mechanics_of(robot), robot.payload
    posture = posture_of(mechanics, q, load.mass, load.cog)
    return stability_of(standing(stances_of(mechanics, posture), gravity), gravity)


def least(values: tuple[Number, ...]) -> Floats:
    """Return the least over the sides."""
    smallest: Floats = np.array(values).min(axis=0)
    return smallest


def edges_on_ground(robot: Robot, points: Floats) -> list[tuple[Floats, Floats, int]]:
    """Return start, direction and side of each edge of scipy's hull of the points that stand."""
    low = points[np.abs(points[:, 2] - robot.ground) <= robot.contact_tolerance]
    corners = low[ConvexHull(low[:, :2]).vertices]
    found = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = (end - start) / np.linalg.norm(end - start)
        out = np.array([along[1], -along[0]])
        towards = [out[0], out[1], -out[0], -out[1]]  # front, left, rear, right
        found.append((start, along, int(np.argmax(towards))))
    return found


def holds(arm: Floats, along: Floats, gravity: Floats, tilt: Floats) -> Floats:
    """Return the moment a kg about an edge, negative if held, tilted outwards by angles (...).

    To tilt the robot outwards about the edge's line turns gravity inwards in its own axes. `arm` is
    from a point of the edge to the cog; all vectors are (..., 3).
    """
    turn = Rotation.from_rotvec(np.atleast_2d(-tilt[..., np.newaxis] * along))
    turned = turn.apply(np.array(np.broadcast_to(gravity, along.shape)))
    moment: Floats = (np.cross(arm, turned.reshape(along.shape)) * along).sum(axis=-1)
    return moment


def tilts_left(arm: Floats, along: Floats, gravity: Floats) -> Floats:
    """Return the tilts (n,) about edges at which the plumb line passes through them: a search."""
    grid = np.linspace(-np.pi, np.pi, 73)
    held = np.array([holds(arm, along, gravity, np.full(len(arm), t)) < 0.0 for t in grid])
    change = np.argmax(held[:-1] & ~held[1:], axis=0)
    low: Floats = grid[change]
    high: Floats = grid[change + 1]
    for _ in range(35):
        middle = 0.5 * (low + high)
        still = holds(arm, along, gravity, middle) < 0.0
        low, high = np.where(still, middle, low), np.where(still, high, middle)
    return low


def test_the_search_finds_a_tilt_known_by_hand() -> None:
    """A cog 0.2 m inside an edge and 0.3 m above it stands until atan(0.2 / 0.3)."""
    arm, along = np.array([[-0.2, 0.0, 0.3]]), np.array([[0.0, 1.0, 0.0]])
    found = tilts_left(arm, along, np.array([DOWN]))
    assert found == pytest.approx(math.atan(0.2 / 0.3), abs=1e-9)


def test_the_tip_angle_is_the_tilt_at_which_the_plumb_line_leaves_the_polygon() -> None:
    """600 random poses of random robots on random slopes: to 1e-6 rad on every side."""
    rng = np.random.default_rng(0)
    found, edges = [], []
    for pose in range(0, 600, 10):
        robot = random_robot(rng, int(rng.integers(3, 9)))
        q = rng.uniform(-3.0, 3.0, (10, len(robot.joint_names)))
        gravity = tilted(rng, 10)
        found += np.stack(stability(robot, q, gravity).angle, axis=-1).tolist()
        for k in range(10):
            _, cog = centre(robot, q[k].tolist(), robot.payload)
            on = edges_on_ground(robot, feet(robot, q[k].tolist()))
            edges += [(pose + k, side, cog - at, along, gravity[k]) for at, along, side in on]
    row, side, arm, along, g = (np.array(column) for column in zip(*edges, strict=True))
    expected = np.full((600, 4), np.inf)
    np.minimum.at(expected, (row, side), tilts_left(arm, along, g))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)


def test_the_energy_margin_is_the_lift_of_the_cog_over_the_edge() -> None:
    """Turned about the edge in small steps, the cog rises by E / (m g) before it falls."""
    rng = np.random.default_rng(1)
    turn = np.linspace(0.0, np.pi, 20001)
    for _ in range(30):
        robot = random_robot(rng, 3)
        q = rng.uniform(-3.0, 3.0, len(robot.joint_names)).tolist()
        gravity = tilted(rng, 1)[0]
        mass, cog = centre(robot, q, robot.payload)
        found = one(robot, q, (gravity[0], gravity[1], gravity[2]))
        expected = np.full(4, np.inf)
        for start, along, side in edges_on_ground(robot, feet(robot, q)):
            # Outwards while it is inside the edge; inwards, back over it, once it is past.
            inside = float(holds(cog - start, along, gravity, np.zeros(()))) < 0.0
            way = turn if inside else -turn
            moved = Rotation.from_rotvec(way[:, np.newaxis] * along).apply(cog - start)
            lift = -mass * (moved @ gravity - moved[0] @ gravity).min()
            expected[side] = min(expected[side], lift if inside else -lift)
        np.testing.assert_allclose(np.array(found.energy), expected, rtol=0, atol=1e-4)


def test_the_moment_is_that_of_the_weight_about_the_edge() -> None:
    """Mass times gravity crossed with the lever arm, for the worst edge of every side."""
    rng = np.random.default_rng(2)
    for _ in range(50):
        robot = random_robot(rng, 5)
        q = rng.uniform(-3.0, 3.0, len(robot.joint_names)).tolist()
        gravity = tilted(rng, 1)[0]
        mass, cog = centre(robot, q, robot.payload)
        expected = np.full(4, np.inf)
        for start, along, side in edges_on_ground(robot, feet(robot, q)):
            held = -mass * float(holds(cog - start, along, gravity, np.zeros(())))
            expected[side] = min(expected[side], held)
        found = one(robot, q, (gravity[0], gravity[1], gravity[2]))
        np.testing.assert_allclose(np.array(found.moment), expected, rtol=1e-9, atol=1e-9)


def test_the_zmp_lies_where_the_plumb_line_meets_the_ground() -> None:
    """Its distance inside the polygon is the least distance to an edge, in the tracks' plane."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        robot = random_robot(rng, 5)
        q = rng.uniform(-3.0, 3.0, len(robot.joint_names)).tolist()
        gravity = tilted(rng, 1, 0.6)[0]
        _, cog = centre(robot, q, robot.payload)
        meets = cog - gravity * cog[2] / gravity[2]
        inside = [
            float(np.cross(along, meets - start)[2])
            for start, along, _ in edges_on_ground(robot, feet(robot, q))
        ]
        found = one(robot, q, (gravity[0], gravity[1], gravity[2]))
        assert found.zmp == pytest.approx(min(inside), rel=1e-9, abs=1e-9)


def test_zmp_energy_moment_and_force_angle_agree_in_sign() -> None:
    """Where one says that the robot stands, all do."""
    rng = np.random.default_rng(4)
    q = rng.uniform(-3.0, 3.0, (20_000, 4))
    q[:, 3] = 2.5
    found = stability(tracked(), q, tilted(rng, len(q)))
    stands = least(found.angle) > 0.0
    assert 2_000 < stands.sum() < 18_000
    for other in (least(found.moment), least(found.energy), found.zmp):
        np.testing.assert_array_equal(np.asarray(other) > 0.0, stands)


def test_tilt_left_shrinks_one_for_one_towards_an_edge() -> None:
    """On a slope the downhill angle is less by the slope, the uphill angle more."""
    angles = [math.radians(d) for d in (0.0, 5.0, 10.0, 20.0)]
    gravity = [(-9.81 * math.sin(a), 0.0, -9.81 * math.cos(a)) for a in angles]
    front, _, rear, _ = np.array(stability(tracked(), FLAT, gravity).angle)
    np.testing.assert_allclose(rear, rear[0] - np.array(angles), atol=1e-12)
    np.testing.assert_allclose(front, front[0] + np.array(angles), atol=1e-12)


def test_a_load_held_out_sideways_takes_from_that_side() -> None:
    """The heavier it is the less is left there, and the more on the other."""
    robot, out = tracked(), [math.pi / 2, 0.0, 0.0, 2.5]
    angle = np.array(
        [stability(robot, out, DOWN, Payload(m, (0.0, 0.0, 0.0))).angle for m in (0.0, 2.0, 4.0)]
    )
    assert (np.diff(angle[:, SIDES.index('left')]) < 0.0).all()
    assert (np.diff(angle[:, SIDES.index('right')]) > 0.0).all()


def random_samples(count: int, seed: int) -> tuple[Robot, Floats, Floats]:
    """Return the tracked robot in random postures, often raised by its flippers, and gravity."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-np.pi, np.pi, (count, 4))
    gravity = tilted(rng, count)
    gravity[::17] *= -1.0
    gravity[::19] *= 0.01
    gravity[::23, 1] = np.nan
    q[::29, 2] = np.nan
    return tracked(), q, gravity


def test_many_samples_have_the_margins_of_each_alone() -> None:
    """Standing, raised, inverted, falling and unknown samples: the functions of floats agree."""
    robot, q, gravity = random_samples(3_000, 5)
    found = stability(robot, q, gravity)
    states = np.asarray(found.state)
    assert set(states.tolist()) == {STANDING, RAISED, INVERTED, FREE_FALL, UNKNOWN}
    table = np.array([*found.angle, *found.moment, *found.energy, found.zmp])
    for k in range(len(q)):
        x, y, z = gravity[k].tolist()
        alone = one(robot, q[k].tolist(), (x, y, z))
        assert alone.state == states[k]
        values = np.array([*alone.angle, *alone.moment, *alone.energy, alone.zmp])
        np.testing.assert_allclose(table[:, k], values, rtol=1e-9, atol=1e-9)


def test_torques_and_tip_angles_in_one_go_are_those_of_their_own_functions() -> None:
    """`margins`, on two threads, gives what `static_torque` and `stability` give.

    But for flippers that carry: test_reactions.py.
    """
    robot, q, gravity = random_samples(40_000, 6)
    both, alone = margins(robot, q, gravity, workers=2), stability(robot, q, gravity)
    known = np.isfinite(gravity).all(axis=1)
    torque = static_torque(robot, q, gravity)
    arm = [k for k, name in enumerate(robot.joint_names) if name != 'flippers']
    np.testing.assert_allclose(both.torque[known][:, arm], torque[known][:, arm], atol=1e-12)
    np.testing.assert_allclose(both.angle, np.stack(alone.angle, axis=-1), atol=1e-12)
    np.testing.assert_array_equal(both.state, alone.state)


def test_tip_angles_alone_are_those_among_all_margins() -> None:
    """The short way gives the same angles and the same state."""
    robot, q, gravity = random_samples(300, 7)
    mechanics, load = mechanics_of(robot), robot.payload
    for k in range(len(q)):
        x, y, z = gravity[k].tolist()
        posture = posture_of(mechanics, q[k].tolist(), load.mass, load.cog)
        stance = standing(stances_of(mechanics, posture), (x, y, z))
        everything = stability_of(stance, (x, y, z))
        angle, state = tip_angles_of(stance, (x, y, z))
        np.testing.assert_array_equal(np.array(angle), np.array(everything.angle))
        assert state == everything.state


def test_a_stance_may_be_taken_apart_and_held() -> None:
    """Rows of a stance, also repeated ones, have the margins of their samples."""
    robot, q, gravity = random_samples(200, 8)
    mechanics, load = mechanics_of(robot), robot.payload
    posture = posture_of(mechanics, list(q.T), load.mass, load.cog)
    expected = np.array(stability(robot, q[:, np.newaxis], gravity[5]).angle)[:, :, 0]
    again = np.repeat(np.arange(len(q)), 2)
    g = np.broadcast_to(gravity[5], (len(again), 3)).T
    stances, seen = many_stances(mechanics, posture, len(q)), 0
    for rows, stance in many_standing(stances, len(q), again, (g[0], g[1], g[2])):
        numbers = np.arange(len(again))[rows]
        seen += len(numbers)
        found = stability_of(stance, tuple(x[numbers] for x in g))
        table = np.array([np.broadcast_to(x, len(numbers)) for x in found.angle])
        np.testing.assert_allclose(table, expected[:, again[numbers]], atol=1e-12)
        taken = stability_of(take_stance(stance, np.array([0, 0])), tuple(g[:, :2]))
        assert np.allclose(np.broadcast_to(taken.angle[0], 2), table[0, 0], equal_nan=True)
    assert seen == len(again)


def test_a_raised_robot_has_its_margins_about_the_lower_face() -> None:
    """Flippers pressed down: tilt back is left as the cog stands to the rear ends of the tracks."""
    robot, q = tracked(), [0.0, 0.5, -0.5, -0.6]
    found = one(robot, q, DOWN)
    points, (_, cog) = feet(robot, q), centre(robot, q, robot.payload)
    rear = np.array([c.name.startswith('rear') for c in robot.contacts])
    tip = np.array([c.link == 'flippers' for c in robot.contacts])
    along = np.array([0.0, 1.0, 0.0])
    assert found.state == RAISED
    arm = np.array([cog - points[rear][0], cog - points[tip][0]])
    back, front = tilts_left(arm, np.array([-along, along]), np.array([DOWN, DOWN]))
    assert found.angle[SIDES.index('rear')] == pytest.approx(back, abs=1e-9)
    assert found.angle[SIDES.index('front')] == pytest.approx(front, abs=1e-9)


@pytest.mark.parametrize(
    ('points', 'state'),
    [
        (SQUARE, STANDING),
        ([], NO_CONTACT),
        (SQUARE[:2], NO_CONTACT),
        ([*SQUARE[:2], (0.0, 0.0, 0.1)], STANDING),
        ([(0.1 * k, 0.1 * k, 0.0) for k in range(3)], DEGENERATE),
        ([(0.1 * k, 0.1 * k, 0.0) for k in range(4)], DEGENERATE),
        ([(0.1 * k, 0.1 * k, -0.1) for k in range(4)], DEGENERATE),
    ],
)
def test_states_of_contact(points: list[Vector], state: int) -> None:
    """Fewer than three points, or all in one line, are states without margins."""
    robot = stool(points)
    for found in (one(robot, [], DOWN), stability(robot, np.empty((2, 0)), DOWN)):
        assert np.all(found.state == state)
        values = np.array([*found.angle, *found.moment, *found.energy, found.zmp])
        assert np.isnan(values).all() == (state != STANDING)


@pytest.mark.parametrize(
    ('gravity', 'state'),
    [
        ((0.0, 0.0, -9.81), STANDING),
        ((0.0, 0.0, 9.81), INVERTED),
        ((9.81, 0.0, 0.0), INVERTED),
        ((0.0, 0.0, 0.0), FREE_FALL),
        ((0.0, 0.0, -0.5), FREE_FALL),
        ((math.nan, 0.0, -9.81), UNKNOWN),
        ((0.0, 0.0, math.nan), UNKNOWN),
        ((0.0, 0.0, -math.inf), UNKNOWN),
    ],
)
def test_states_of_gravity(gravity: Vector, state: int) -> None:
    """Upside down, weightless, unknown: told without exception, for one sample and for many."""
    robot = stool(SQUARE)
    for found in (one(robot, [], gravity), stability(robot, np.empty((2, 0)), gravity)):
        assert np.all(found.state == state)
        known = state in {STANDING, INVERTED}
        assert np.isfinite(np.array(found.angle)).all() == known
        assert np.isnan(np.array([*found.angle, *found.moment, *found.energy])).all() != known
        assert np.isfinite(found.zmp).all() == (state == STANDING)


def test_an_inverted_robot_has_no_tilt_left() -> None:
    """The least angle is negative on its back, on its sides and anywhere between."""
    rng = np.random.default_rng(9)
    gravity = -tilted(rng, 2_000)
    q = rng.uniform(-0.5, 0.5, (2_000, 4)) + HIGH
    assert (least(stability(tracked(), q, gravity).angle) < 0.0).all()


@pytest.mark.parametrize('bad', [math.nan, math.inf])
@pytest.mark.parametrize('joint', range(4))
def test_an_unknown_joint_makes_the_margins_unknown(bad: float, joint: int) -> None:
    """Of the arm or of the flippers, for one sample as for many, which all come to an end."""
    q = np.tile(FLAT, (20_000, 1))
    q[:, joint] = bad
    found = stability(tracked(), q, DOWN)
    alone = one(tracked(), q[0].tolist(), DOWN)
    assert (np.asarray(found.state) == UNKNOWN).all()
    assert alone.state == UNKNOWN
    assert np.isnan(np.array([*found.angle, *found.moment, *found.energy])).all()
    assert all(map(math.isnan, (*alone.angle, *alone.moment, *alone.energy, alone.zmp)))


@pytest.mark.parametrize('points', [SQUARE[:2], [(0.1 * k, 0.0, 0.0) for k in range(3)]])
@pytest.mark.parametrize(
    ('gravity', 'state'),
    [((0.0, 0.0, 9.0), None), ((0.0, 0.0, -0.1), FREE_FALL), ((0.0, math.nan, 0.0), UNKNOWN)],
)
def test_a_robot_that_has_no_polygon_has_none_upside_down(
    points: list[Vector], gravity: Vector, state: int | None
) -> None:
    """Its contact is told whatever the attitude; that nothing presses it down is told first."""
    expected = one(stool(points), [], DOWN).state if state is None else state
    (stance,) = stances_of(
        mechanics_of(stool(points)), posture_of(mechanics_of(stool(points)), [], 0.0, ORIGIN)
    )
    for found in (
        one(stool(points), [], gravity),
        stability(stool(points), np.empty((2, 0)), gravity),
    ):
        assert np.all(found.state == expected)
        assert np.isnan(np.array([*found.angle, *found.moment, *found.energy])).all()
    assert tip_angles_of(stance, gravity)[1] == expected
    assert np.isnan(np.array(tip_angles_of(stance, gravity)[0])).all()


def test_the_state_of_an_unknown_posture_is_unknown_even_in_free_fall() -> None:
    """For one sample as for many."""
    gravity = (0.0, 0.0, -0.1)
    assert one(tracked(), [math.nan, 0.0, 0.0, 2.5], gravity).state == UNKNOWN
    found = stability(tracked(), [[math.nan, 0.0, 0.0, 2.5]] * 2, gravity)
    assert np.all(found.state == UNKNOWN)


def test_a_payload_given_takes_the_place_of_the_robot_s_own() -> None:
    """In all margins; left out, it is the robot's."""
    robot, light = tracked(), Payload(0.0, ORIGIN)
    for ask in (stability, margins):
        own, given = ask(robot, HIGH, DOWN), ask(robot, HIGH, DOWN, robot.payload)
        assert np.array_equal(np.array(own.angle), np.array(given.angle))
        assert not np.array_equal(
            np.array(own.angle), np.array(ask(robot, HIGH, DOWN, light).angle)
        )


def test_no_sample_has_no_margins() -> None:
    """An empty recording gives empty margins."""
    found = margins(tracked(), np.empty((0, 4)), np.empty((0, 3)))
    assert (found.torque.shape, found.angle.shape, found.state.shape) == ((0, 4), (0, 4), (0,))
