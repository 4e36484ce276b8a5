"""Maps over two joints: the fast ways give what the general functions of arrays give."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from robots import random_robot, tracked

from ugv_acceptance.model.robot import Joint, Link, Robot
from ugv_acceptance.model.stability import stability
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.studies.bilinear import Grid, evaluate, form_of, grid_of, level_curves
from ugv_acceptance.studies.maps import (
    CAUTION,
    FAILURE,
    SAFE,
    area_fraction,
    classes,
    rollover_map,
    stands,
    tip_forms,
    torque_forms,
    utilisation_map,
    within_limits,
)
from ugv_acceptance.studies.planar import PAPER, arm_robot, planar_torque
from ugv_acceptance.studies.windows import window_between

TURN = [[-math.pi, math.pi]] * 2


def arm_grid(n: int = 301) -> tuple[Robot, Grid]:
    """Return the paper's arm and a full turn of both joints."""
    robot = arm_robot(PAPER)
    return robot, grid_of(robot, ('theta1', 'theta2'), TURN, (n, n), np.zeros(2))


def tracked_grid(flippers: float, turret: float = 0.4) -> tuple[Robot, Grid]:
    """Return a tracked robot and its arm's range."""
    robot, q = tracked(), np.array([turret, 0.0, 0.0, flippers])
    return robot, grid_of(robot, ('shoulder', 'elbow'), TURN, (41, 57), q)


def tilted(roll: float, pitch: float) -> tuple[float, float, float]:
    """Return a gravity that is not level."""
    return (
        9.81 * math.sin(pitch),
        -9.81 * math.sin(roll),
        -9.81 * math.cos(roll) * math.cos(pitch),
    )


@given(seed=st.integers(0, 10_000))
def test_a_window_is_a_comparison(seed: int) -> None:
    """The booleans of ranks are those of comparing the floats, ties and empty bounds included."""
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(1, 150)), int(rng.integers(1, 40))
    table = rng.integers(-5, 6, n + m - 1) / 2.0
    lower, upper = rng.integers(-7, 8, (2, n)) / 2.0
    values = table[np.arange(n)[:, None] + np.arange(m)]
    plain = (values >= lower[:, None]) & (values <= upper[:, None])
    assert (window_between(table, lower, upper) == plain).all()
    assert (window_between(table, lower, upper, workers=3) == plain).all()


@pytest.mark.parametrize('limit', [20.0, 30.0, 50.0, 70.0])
def test_the_torque_map_is_that_of_the_equations(limit: float) -> None:
    """Every cell has the boolean of equations (1) and (2) on a meshgrid."""
    robot, grid = arm_grid()
    found = within_limits(robot, grid, torque_forms(robot, grid, (0, 0, -9.81)), limit)
    theta1, theta2 = np.meshgrid(grid.x, grid.y, indexing='ij')
    tau1, tau2 = planar_torque(PAPER, theta1, theta2)
    assert (found == ((np.abs(tau1) <= limit) & (np.abs(tau2) <= limit))).all()


@pytest.mark.parametrize('seed', range(10))
def test_a_form_is_exact_on_any_tree(seed: int) -> None:
    """Nine postures tell the torques of the whole map, prismatic joints included."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 3)
    while len(robot.joint_names) < 2:
        robot = random_robot(rng, 3)
    axes, n = (robot.joint_names[0], robot.joint_names[1]), len(robot.joint_names)
    grid = grid_of(robot, axes, [[-2.0, 1.0], [-1.0, 3.0]], (7, 9), rng.normal(size=n))
    gravity = 9.81 * rng.normal(size=3)
    whole = static_torque(robot, grid.postures(), gravity)
    form = evaluate(robot, grid, torque_forms(robot, grid, gravity))
    assert np.abs(np.moveaxis(form, 0, -1) - whole).max() <= 1e-11 * max(1.0, np.abs(whole).max())


@pytest.mark.parametrize('turret', [0.0, 0.7])
def test_limits_on_a_tilted_base(turret: float) -> None:
    """A turret and a tilt load out of the plane: the map judges as the general function."""
    robot, grid = tracked_grid(math.pi, turret)
    gravity, limits = tilted(0.3, -0.2), np.array([30.0, 45.0, 25.0, np.inf])
    forms = torque_forms(robot, grid, gravity)
    torque = static_torque(robot, grid.postures(), gravity)
    ok = (np.abs(torque) <= limits).all(axis=-1)
    used = utilisation_map(robot, grid, forms, limits)
    assert (within_limits(robot, grid, forms, limits) == ok).all()
    assert np.allclose(used, (np.abs(torque) / limits).max(axis=-1), atol=1e-12)


def three_link() -> Robot:
    """Return an arm of three links that turn about the same axis."""
    names, lift = ('first', 'second', 'third'), (0.0, -1.0, 0.0)
    links = [Link(name, 2.0, (0.2, 0.0, 0.05)) for name in names]
    parents = ('base', *names)
    joints = [
        Joint(f'{name}_joint', 'revolute', parent, name, (0.4 * (k > 0), 0.0, 0.0), axis=lift)
        for k, (name, parent) in enumerate(zip(names, parents, strict=False))
    ]
    return Robot('arm', (Link('base', 9.0), *links), tuple(joints), tuple(j.name for j in joints))


@pytest.mark.parametrize('rows', [5, 40])
@pytest.mark.parametrize('workers', [1, 2])
@pytest.mark.parametrize('steps', [1.0, 1.2])
@pytest.mark.parametrize('limits', [(30.0, 14.0, 3.0), (1e3, 1e3, 1e3), (30.0, 1e3, 3.0)])
def test_limits_of_joints_that_share_an_axis(
    rows: int, workers: int, steps: float, limits: tuple[float, ...]
) -> None:
    """The third joint has a wave of its own; equal and unequal steps, judged or never reached."""
    robot = three_link()
    ranges = [[-2.0, -2.0 + 0.1 * (rows - 1)], [-1.0, -1.0 + 0.1 * steps * (rows - 1)]]
    axes = ('first_joint', 'second_joint')
    grid = grid_of(robot, axes, ranges, (rows, rows), np.array([0.0, 0.0, 0.6]))
    gravity = (1.0, 0.5, -9.7)
    torque = static_torque(robot, grid.postures(), gravity)
    found = within_limits(robot, grid, torque_forms(robot, grid, gravity), limits, workers)
    assert (found == (np.abs(torque) <= limits).all(axis=-1)).all()


@pytest.mark.parametrize('flippers', [math.pi, 0.3, -0.25, -0.8])
def test_the_rollover_map_is_the_force_angle(flippers: float) -> None:
    """Stowed, lifted, on the ground or raising the robot: the least angle over the edges."""
    robot, grid = tracked_grid(flippers)
    gravity = tilted(0.4, 0.1)
    found = rollover_map(robot, grid, gravity)
    edges = np.array(stability(robot, grid.postures(), gravity).angle)
    assert np.allclose(found.angle, edges.min(axis=0), atol=1e-9)
    at = np.take_along_axis(edges, found.side[np.newaxis].astype(np.int64), axis=0)[0]
    assert np.allclose(at, edges.min(axis=0), atol=1e-9)


def test_a_flipper_as_an_axis_changes_the_polygon() -> None:
    """With a joint that moves contacts on an axis the map has no forms and is still right."""
    robot = tracked()
    grid = grid_of(robot, ('flippers', 'elbow'), TURN, (31, 21), np.zeros(4))
    assert tip_forms(robot, grid, (0, 0, -9.81)) is None
    found = rollover_map(robot, grid, (0, 0, -9.81)).angle
    edges = np.array(stability(robot, grid.postures(), (0, 0, -9.81)).angle)
    assert np.allclose(found, edges.min(axis=0), equal_nan=True)


@pytest.mark.parametrize('least', [0.0, 0.1, 0.4])
def test_standing_is_an_angle_above_the_least(least: float) -> None:
    """The test without an arc tangent agrees with the angle in every cell."""
    robot, grid = tracked_grid(math.pi)
    gravity = tilted(0.5, 0.0)
    forms = tip_forms(robot, grid, gravity)
    assert forms is not None
    angle = rollover_map(robot, grid, gravity).angle
    assert (stands(robot, grid, forms, least) == (angle > least)).all()


def test_an_upside_down_robot_has_no_forms() -> None:
    """Gravity that points upwards leaves the map to the general function, which knows the state."""
    robot, grid = tracked_grid(math.pi)
    assert tip_forms(robot, grid, (0.0, 0.0, 9.81)) is None


def test_level_curves_lie_on_the_level() -> None:
    """Along each closed-form boundary the torque is the level."""
    robot, grid = arm_grid()
    form = form_of(robot, grid, lambda q: static_torque(robot, q, (0, 0, -9.81)))[0]
    curves = level_curves(robot, grid, form, 50.0)
    known = np.isfinite(curves)
    assert known.sum() > 100
    for curve in curves:
        at = np.isfinite(curve)
        assert planar_torque(PAPER, grid.x[at], curve[at])[0] == pytest.approx(50.0)


def test_no_margin_is_a_failure() -> None:
    """A cell without a known margin counts as a failure, never as safe."""
    found = classes(np.array([20.0, 7.0, 5.0, -1.0, np.nan]), 10.0, 5.0)
    assert found.tolist() == [SAFE, CAUTION, FAILURE, FAILURE, FAILURE]


def test_the_area_of_a_half_plane() -> None:
    """A mask of half the map covers half of its area, to a cell."""
    grid = Grid(0, 1, np.linspace(0, 2, 401), np.linspace(0, 1, 201), np.zeros(2))
    mask = np.broadcast_to(grid.x[:, None] < 1.0, (401, 201))
    assert area_fraction(mask, grid) == pytest.approx(0.5, abs=0.002)
