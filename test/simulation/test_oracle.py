"""The model's tip-over margins against a simulated robot that tips or does not."""

from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from robots import box, random_robot

from ugv_acceptance.config import load
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Contact, Link, Payload, Robot
from ugv_acceptance.model.stability import stability
from ugv_acceptance.model.support import footings_of
from ugv_acceptance.simulation.oracle import BUILD, Truth, attitude, rigid, settled, tip_truth, turn
from ugv_acceptance.simulation.tip_cases import (
    Judged,
    TipCase,
    confusion,
    judge,
    judge_all,
    least_angle,
    random_cases,
)
from ugv_acceptance.simulation.vehicle import Vehicle, gravity_on_slope, vehicle_of

LEVEL = (0.0, 0.0, -9.81)
CASES = 30


def block(height: float, half_width: float) -> Robot:
    """Return a robot without joints: its centre of gravity above the middle of four points."""
    points = [(x, y, 0.0) for x in (-0.3, 0.3) for y in (-half_width, half_width)]
    contacts = tuple(Contact(f'c{k}', 'base_link', p) for k, p in enumerate(points))
    link = Link('base_link', 20.0, (0.0, 0.0, height), box(20.0, 0.6, 2 * half_width, height))
    return Robot('block', (link,), (), (), contacts)


@pytest.mark.parametrize(('height', 'half_width'), [(0.1, 0.2), (0.3, 0.2), (0.5, 0.1)])
def test_a_block_tips_where_geometry_says(height: float, half_width: float) -> None:
    """The simulated tilt is atan(half width / height) to 0.3 deg, a little late at most."""
    truth = tip_truth(block(height, half_width), [], Payload(), -np.pi / 2)
    late = np.degrees(truth.tilt - np.arctan2(half_width, height))
    assert 0.0 <= late < 0.3
    assert truth.over


def test_a_robot_with_its_weight_outside_does_not_stand() -> None:
    """With 4 kg at full reach PackBot, flippers stowed, tips on level ground."""
    truth = tip_truth(load().settings.robot, [0.0, 0.0, 0.0, np.pi], Payload(4.0), 0.0)
    assert truth.tilt == 0.0


@pytest.fixture(scope='module')
def judged() -> list[Judged]:
    """Return random postures, loads and slopes of PackBot with both opinions."""
    robot = load().settings.robot
    return [judge(robot, case) for case in random_cases(robot, CASES, seed=11)]


def test_no_disagreement_but_at_the_boundary(judged: list[Judged]) -> None:
    """Whether it tips on a slope is what the model says, but within a degree of the boundary."""
    found = confusion(judged)
    assert found.far == 0
    assert found.both_tip > 3
    assert found.both_stand > 3


def test_no_margin_is_left_when_it_tips(judged: list[Judged]) -> None:
    """When the simulated robot tips, the force-angle is zero to half a degree."""
    left = np.degrees([j.left for j in judged])
    left = left[~np.isnan(left)]
    assert len(left) > CASES / 2
    assert np.abs(left).max() < 0.5


@pytest.mark.parametrize('seed', range(12))
def test_random_robots_tip_where_the_model_says(seed: int) -> None:
    """Robots of random shape that stand on five points agree to half a degree."""
    rng = np.random.default_rng(seed)
    robot, q = _standing_robot(rng)
    case = TipCase(tuple(q), robot.payload, float(rng.uniform(-np.pi, np.pi)), 0.0)
    found = judge(robot, case)
    assert abs(np.degrees(found.left)) < 0.5


def _standing_robot(rng: np.random.Generator) -> tuple[Robot, list[float]]:
    """Return a random robot in a random posture with 5 to 60 deg of margin."""
    while True:
        robot = random_robot(rng, 5)
        q = rng.uniform(-1.0, 1.0, len(robot.joint_names)).tolist()
        least = np.degrees(least_angle(robot, q, LEVEL))
        if 5.0 < least < 60.0:
            return robot, q


@pytest.mark.parametrize('seed', range(8))
@pytest.mark.parametrize(('energy', 'tips'), [(0.9, False), (1.1, True)])
def test_the_energy_margin_is_the_push_it_takes(seed: int, energy: float, *, tips: bool) -> None:
    """Turned about its weakest edge with 10 % less energy it falls back, with 10 % more over."""
    robot = load().settings.robot
    case = random_cases(robot, 8, seed=3)[seed]
    robot = rigid(robot, (*case.q[:3], np.pi), Payload(min(case.payload.mass, 1.5)))
    margins = np.array(stability(robot, [], LEVEL, robot.payload).energy, dtype=np.float64)
    assert _goes_over(robot, energy * float(margins.min())) is tips


def _goes_over(robot: Robot, energy: float) -> bool:
    """Return whether a rigid robot that begins to turn about its weakest edge tips over it."""
    vehicle = vehicle_of(robot, replace(BUILD, timestep=0.0005))
    model, data = vehicle.model, settled(vehicle, np.eye(3))
    point, along = _weakest_edge(robot, _rise)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    velocity = np.concatenate([np.cross(along, -point), along])
    data.qvel[:] = np.sqrt(2.0 * energy / (velocity @ inertia @ velocity)) * velocity
    return _turns(vehicle, data, 70.0)


@pytest.mark.parametrize('seed', range(6))
@pytest.mark.parametrize(('share', 'tips'), [(0.97, False), (1.03, True)])
def test_the_restoring_moment_is_the_torque_it_takes(
    seed: int, share: float, *, tips: bool
) -> None:
    """A torque about the weakest edge lifts it from 3 % above the moment on, not 3 % below."""
    robot = load().settings.robot
    case = random_cases(robot, 6, seed=5)[seed]
    robot = rigid(robot, (*case.q[:3], np.pi), Payload(min(case.payload.mass, 1.5)))
    moments = np.array(stability(robot, [], LEVEL, robot.payload).moment, dtype=np.float64)
    vehicle = vehicle_of(robot, BUILD)
    data = settled(vehicle, np.eye(3))
    _, along = _weakest_edge(robot, _lever)
    data.xfrc_applied[vehicle.root, 3:] = share * float(moments.min()) * along
    assert _turns(vehicle, data, 2.0) is tips


def _turns(vehicle: Vehicle, data: mujoco.MjData, degrees: float) -> bool:
    """Return whether the robot turns by so much within two seconds or more."""
    rest = attitude(vehicle, data)
    for _ in range(400):
        mujoco.mj_step(vehicle.model, data, nstep=10)
        if turn(attitude(vehicle, data), rest) > np.radians(degrees):
            return True
    return False


def _lever(arm: np.ndarray) -> float:
    """Return how far the centre of gravity lies inside of the edge, seen from above."""
    return float(np.hypot(arm[0], arm[1]))


def _rise(arm: np.ndarray) -> float:
    """Return how far the centre of gravity must rise to pass over the edge."""
    return float(np.linalg.norm(arm) - arm[2])


def _weakest_edge(
    robot: Robot, measure: Callable[[np.ndarray], float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return a point of the edge of least `measure`, and the axis of tipping over it.

    `measure` is of the arm (3,) square from the edge to the centre of gravity, on level ground.
    """
    posture = posture_of(mechanics_of(robot), [], robot.payload.mass, robot.payload.cog)
    cog = np.array(posture.cog)
    points = [np.array(p) for p in posture.contacts]
    polygon = footings_of(mechanics_of(robot), posture.contacts)[0].polygon  # type: ignore[arg-type]

    def along(edge: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        unit: np.ndarray = (edge[1] - edge[0]) / np.linalg.norm(edge[1] - edge[0])
        return unit

    def measured(edge: tuple[np.ndarray, np.ndarray]) -> float:
        arm = cog - edge[0]
        return measure(arm - along(edge) * (arm @ along(edge)))

    pairs = zip(polygon, polygon[1:] + polygon[:1], strict=True)
    edge = min(((points[i], points[j]) for i, j in pairs), key=measured)
    return edge[0], along(edge)


def test_flippers_on_the_ground_hold_it_longer() -> None:
    """With the flippers' tips on the ground, PackBot tips forward later than with them stowed."""
    robot, load_ = load().settings.robot, Payload(2.0)
    stowed, down = (
        tip_truth(robot, [0.0, 0.5, 0.5, flipper], load_, 0.0).tilt
        for flipper in (np.pi, np.radians(-14.92))
    )
    assert down - stowed > np.radians(10.0)


def test_workers_give_what_one_process_gives() -> None:
    """Cases judged by two processes come back in order, to the bit."""
    robot = load().settings.robot
    cases = random_cases(robot, 3, seed=11)
    assert judge_all(robot, cases, workers=2) == [judge(robot, case) for case in cases]


def test_confusion_counts_by_who_says_that_it_tips() -> None:
    """A tip only the simulation sees, far from both boundaries, is counted as such."""
    case = TipCase((), Payload(), 0.0, tilt=0.5)
    early, late = Truth(0.3, over=True), Truth(0.7, over=True)
    told = [
        Judged(case, 0.3, -0.2, early, 0.0),
        Judged(case, 0.7, 0.2, late, 0.0),
        Judged(case, 0.7, 0.2, early, 0.4),
        Judged(case, 0.499, -0.001, late, -0.2),
        Judged(case, np.nan, np.nan, late, np.nan),
    ]
    found = confusion(told)
    counts = (found.both_tip, found.both_stand, found.only_truth, found.only_model)
    assert counts == (1, 1, 1, 1)
    assert (found.no_margin, found.far) == (1, 1)


def test_a_slope_towards_the_back_is_a_heading_of_pi() -> None:
    """A block shifted forward tips later backward than forward."""
    robot = block(0.3, 0.2)
    link = replace(robot.links[0], cog=(0.1, 0.0, 0.3))
    robot = replace(robot, links=(link,))
    forward, back = (tip_truth(robot, [], Payload(), heading).tilt for heading in (0.0, np.pi))
    np.testing.assert_allclose([forward, back], np.arctan2([0.2, 0.4], 0.3), rtol=0, atol=0.006)
    assert gravity_on_slope(1.0, 0.1, np.pi)[0] < 0.0
