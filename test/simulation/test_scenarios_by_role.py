"""Tests of the scenarios for robots of other makes, which are made from the roles of joints."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from foreign_robots import arm_on_wheels, rover, tracks_and_flippers
from robots import tracked

from ugv_acceptance.config import load
from ugv_acceptance.model.clearance import clearance
from ugv_acceptance.model.mechanics import mechanics_of
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.stability import margins
from ugv_acceptance.simulation.arm_grid import ArmGrid, grid_of, limits_of
from ugv_acceptance.simulation.fixed_runs import FIXED
from ugv_acceptance.simulation.ground import ground_of
from ugv_acceptance.simulation.poses import STOWED, Poses, Region, named, stowed_of
from ugv_acceptance.simulation.repertoire import KINDS
from ugv_acceptance.simulation.scenario import Scenario
from ugv_acceptance.simulation.scenarios import SCENARIOS, scenario_of

ARMED = {'six joints': arm_on_wheels(), 'flippers': tracks_and_flippers(), 'tracked': tracked()}
each_arm = pytest.mark.parametrize('robot', ARMED.values(), ids=ARMED)
LEVEL = (0.0, 0.0, -9.81)


def posture(robot: Robot, joints: tuple[tuple[str, float], ...]) -> np.ndarray:
    """Return positions (j,) of a command's targets, joints that it does not name at zero."""
    at = dict(joints)
    return np.array([at.get(name, 0.0) for name in robot.joint_names])


def height(robot: Robot, q: np.ndarray) -> float:
    """Return how high the arm is above the ground (m)."""
    return float(clearance(mechanics_of(robot), None, q.tolist(), robot.payload.cog))


def test_packbot_keeps_its_own() -> None:
    """PackBot is folded and driven as ever: its recordings are bit for bit what they were."""
    robot = load('packbot').settings.robot
    assert stowed_of(robot) == STOWED
    for name, make in SCENARIOS.items():
        assert scenario_of(name, robot) == make()


@each_arm
def test_the_folded_posture_has_most_tilt_left(robot: Robot) -> None:
    """No other posture clear of ground and body keeps more on slopes, at low torques."""
    grid = grid_of(robot)
    q = posture(robot, stowed_of(robot))
    assert height(robot, q) > 0.05
    load = Payload(grid.capacity / 2.0, robot.payload.cog)
    tilt, share = grid.looked(grid.rows[:, None, :], np.radians(10.0), load)
    mine, torque = (float(x[0]) for x in grid.looked(q[None, None], np.radians(10.0), load))
    assert torque < 0.5
    assert mine >= tilt[share < 0.5].max() - 1e-9


def test_flippers_are_folded_onto_the_tracks() -> None:
    """Their tips are above the ground and stick out neither in front nor behind."""
    robot = tracks_and_flippers()
    at = dict(stowed_of(robot))
    assert abs(at['bow_drive']) > np.radians(100.0)
    assert abs(at['stern_drive']) > np.radians(100.0)
    still = margins(robot, posture(robot, stowed_of(robot)), LEVEL)
    flat = replace(robot, contacts=tuple(c for c in robot.contacts if c.link == 'hull'))
    alone = margins(flat, posture(robot, stowed_of(robot)), LEVEL)
    np.testing.assert_allclose(still.angle, alone.angle, atol=1e-9)


@each_arm
def test_the_outstretched_arm_just_holds_its_capacity(robot: Robot) -> None:
    """With it a motor is at its limit, or little tilt is left to some side."""
    grid = grid_of(robot)
    for share, passes in ((0.95, True), (1.3, False)):
        load = Payload(grid.capacity * share, robot.payload.cog)
        around = [grid.turned(grid.outstretched[None], h)[0] for h in np.linspace(-pi, pi, 9)]
        found = margins(robot, np.array(around), LEVEL, load)
        holds = (np.abs(found.torque) <= limits_of(robot)).all()
        stands = found.angle.min() >= np.radians(10.0)
        assert (holds and stands) == passes


@each_arm
def test_the_arm_is_turned_where_it_is_asked_to(robot: Robot) -> None:
    """The load is then in that direction from the pillar, if the turret's travel allows."""
    grid = grid_of(robot)
    q = grid.outstretched
    for heading in (-2.0, -0.5, 0.0, 1.0, 2.5):
        turned = ArmGrid(robot, grid.roles, grid.rest, grid.turned(q[None], heading))
        x, y = (turned.grip[0] - grid.pillar)[:2]
        assert np.arctan2(y, x) == pytest.approx(heading, abs=0.02)


def every_posture(run: Scenario, robot: Robot) -> list[np.ndarray]:
    """Return the postures that a run goes to."""
    targets = [run.start, *(c.joints for c in run.commands if c.joints)]
    return [posture(robot, joints) for joints in targets]


@each_arm
@pytest.mark.parametrize('name', [*FIXED, *KINDS])
def test_a_run_stays_within_the_travel_of_every_joint(robot: Robot, name: str) -> None:
    """Targets are positions that the joints have, whatever the seed."""
    low = np.array([robot.joint(n).lower for n in robot.joint_names]) - 1e-9
    high = np.array([robot.joint(n).upper for n in robot.joint_names]) + 1e-9
    for seed in range(4):
        rng = np.random.default_rng(seed)
        run = FIXED[name](robot) if name in FIXED else KINDS[name](robot, rng, 40.0)
        for q in every_posture(run, robot):
            assert ((q >= low) & (q <= high)).all()


@each_arm
def test_gentle_lifts_looks_around_and_drives(robot: Robot) -> None:
    """Every posture keeps large margins with the load, and the arm does move."""
    run = scenario_of('gentle', robot)
    poses = Poses(robot, np.random.default_rng(0))
    postures = every_posture(run, robot)
    assert poses.keeps(np.array(postures), run.payload, 0.0)
    assert np.abs(postures[1] - postures[0]).max() > 0.3
    assert any(c.drive for c in run.commands)


@pytest.mark.parametrize('robot', [arm_on_wheels(), tracks_and_flippers()], ids=lambda r: r.name)
def test_overreach_passes_a_torque_limit(robot: Robot) -> None:
    """Outstretched the arm needs more than a motor gives; folded it does not."""
    run = scenario_of('overreach', robot)
    load = next(c.payload for c in run.commands if c.payload)
    needs = [
        np.abs(margins(robot, q, LEVEL, load).torque / limits_of(robot)).max()
        for q in every_posture(run, robot)
    ]
    assert needs[0] < 1.0
    assert max(needs) > 1.0


@each_arm
def test_a_fetched_load_is_taken_low_and_ahead(robot: Robot) -> None:
    """When the load is gripped the arm reaches ahead of the robot, low, and clear of the ground."""
    run = scenario_of('fetch', robot)
    taken = next(c for c in run.commands if c.payload)
    before = [c for c in run.commands if c.joints and c.time < taken.time][-1]
    q = posture(robot, before.joints)
    grid = grid_of(robot)
    place = ArmGrid(robot, grid.roles, grid.rest, q[None]).grip[0]
    assert place[0] > ground_of(robot).front
    assert place[2] < grid.grip[:, 2].max() / 2.0
    assert height(robot, q) > 0.05


@each_arm
def test_regions_are_of_the_arms_own_range(robot: Robot) -> None:
    """Stretched out is farther than drawn in, held up higher than low."""
    poses, grid = Poses(robot, np.random.default_rng(1)), grid_of(robot)
    nothing = ((0.0, 0.0), (0.0, 0.0))
    far, near = (poses.at(Region(*nothing, reach=r)) for r in ((0.8, 1.0), (0.0, 0.4)))
    places = ArmGrid(robot, grid.roles, grid.rest, np.array([far, near]))
    assert places.reach[0] > places.reach[1]
    high, low = (poses.at(Region(*nothing, height=h)) for h in ((0.8, 1.0), (0.0, 0.3)))
    places = ArmGrid(robot, grid.roles, grid.rest, np.array([high, low]))
    assert places.grip[0, 2] > places.grip[1, 2]


def test_wheels_are_no_targets_of_a_posture() -> None:
    """A measured wheel is driven, not moved to an angle."""
    assert named(rover(), np.zeros(4)) == ()


@pytest.mark.parametrize('measured', [True, False])
@pytest.mark.parametrize('name', ['gentle', 'work', 'tilt', 'dash', 'climb'])
def test_a_rover_has_the_runs_without_an_arm(name: str, *, measured: bool) -> None:
    """It drives, tilts and climbs; no command moves a joint or a load."""
    robot, rng = rover(measured=measured), np.random.default_rng(2)
    run = FIXED[name](robot) if name in FIXED else KINDS[name](robot, rng, 30.0)
    assert run.payload.mass == 0.0
    assert not any(c.joints or c.payload for c in run.commands)
    assert any(c.drive or c.slope for c in run.commands)


def test_obstacles_are_of_the_robots_size() -> None:
    """They begin ahead of its wheels; a step is one that its wheels climb."""
    for robot in (rover(), tracks_and_flippers()):
        ground = ground_of(robot)
        for seed in range(20):
            run = KINDS['climb'](robot, np.random.default_rng(seed), 14.0)
            nearest = min(b.middle[0] - b.half[0] for b in run.blocks)
            assert nearest > ground.front or any(b.pitch for b in run.blocks)
            assert run.lean < np.radians(25.0)
    assert ground_of(rover()).highest == pytest.approx(0.4 * 0.16)
    assert ground_of(load('packbot').settings.robot).size == 1.0
