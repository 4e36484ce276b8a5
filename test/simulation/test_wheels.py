"""Tests of robots of other makes in MuJoCo: their wheels, inertias, names and loads."""

from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest
from foreign_robots import ACROSS, AXLE, HALF_TRACK, RADIUS, ROLLED, UP, arm_on_wheels, rover
from robots import box, tracked

from ugv_acceptance import BadConfig
from ugv_acceptance.model.robot import Contact, Joint, Link, Matrix, Payload, Robot
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.simulation.inertia import balanced_links
from ugv_acceptance.simulation.power_loss import Released, power_loss
from ugv_acceptance.simulation.scenario import Command
from ugv_acceptance.simulation.shape import step
from ugv_acceptance.simulation.simulation import BUILD, Simulation
from ugv_acceptance.simulation.tip_cases import random_cases
from ugv_acceptance.simulation.vehicle import Build, gravity_on_slope, vehicle_of

FIXED = Build(base='fixed', motors=False)
# What makes the inertia of no body: one moment larger than the others together; a negative one.
NO_TRIANGLE: Matrix = ((0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.5))
NOT_POSITIVE: Matrix = ((2e-8, 6e-8, 1e-8), (6e-8, 3e-8, 8e-9), (1e-8, 8e-9, 4e-8))


def with_axles(robot: Robot, **changes: Any) -> Robot:
    """Return the robot with its axles changed."""
    joints = (replace(j, **changes) if j.name.endswith('_axle') else j for j in robot.joints)
    return replace(robot, joints=tuple(joints))


def on_plate(robot: Robot) -> Robot:
    """Return the robot on a new root link below it, as many URDFs have."""
    plate = Joint('to_plate', 'fixed', 'footprint', 'chassis', (0.02, 0.0, 0.1))
    return replace(
        robot,
        links=(Link('footprint'), *robot.links),
        joints=(plate, *robot.joints),
        ground=robot.ground + 0.1,
    )


ROVERS = {
    'measured': rover(),
    'held': rover(measured=False),
    'axles to the right': with_axles(rover(), axis=(0.0, -1.0, 0.0)),
    'rolled links': with_axles(rover(), axis=UP, rotation=ROLLED),
    'contacts on a fixed link': on_plate(rover()),
    'with an arm': arm_on_wheels(),
}
each_rover = pytest.mark.parametrize('robot', ROVERS.values(), ids=ROVERS)


@each_rover
def test_a_robot_drives_on_its_own_wheels(robot: Robot) -> None:
    """Four wheels of the tree's radius take it ahead as fast as told, and it stops."""
    simulation = Simulation(robot, payload=Payload())
    rollers = [roller for _, roller in simulation.vehicle.wheels]
    assert [r.radius for r in rollers] == pytest.approx([RADIUS] * 4)
    simulation.apply(Command(0.0, drive=(0.3, 0.0)))
    simulation.advance(3.0)
    before = simulation.base()[0][0]
    simulation.advance(2.0)
    after = simulation.base()[0][0]
    assert after - before == pytest.approx(0.6, abs=0.03)
    simulation.apply(Command(0.0, drive=(0.0, 0.0)))
    simulation.advance(2.0)
    there = simulation.base()[0][0]
    simulation.advance(1.0)
    assert simulation.base()[0][0] == pytest.approx(there, abs=1e-3)


@each_rover
def test_it_stands_on_its_wheels_as_it_was_put(robot: Robot) -> None:
    """At rest the root link is at its height over the ground and level."""
    place, up = Simulation(robot, payload=Payload()).base()
    assert place[2] == pytest.approx(-robot.ground, abs=1e-3)
    assert up == pytest.approx([0.0, 0.0, 1.0], abs=3e-3)


@each_rover
def test_it_turns_on_the_spot_to_the_left(robot: Robot) -> None:
    """A yaw rate above 0 turns it to the left about where it stands."""
    simulation = Simulation(robot, payload=Payload())
    simulation.apply(Command(0.0, drive=(0.0, 0.6)))
    simulation.advance(2.0)
    root = simulation.vehicle.root
    ahead = simulation.data.xmat[root].reshape(3, 3)[:, 0]
    assert ahead[1] > 0.1
    assert np.linalg.norm(simulation.base()[0][:2]) < 0.15


def test_measured_wheels_are_told_as_turning() -> None:
    """Joint states have the way driven over the radius, forward with the axle's direction."""
    for axis, sign in ((ACROSS, 1.0), ((0.0, -1.0, 0.0), -1.0)):
        simulation = Simulation(with_axles(rover(), axis=axis))
        simulation.apply(Command(0.0, drive=(0.5, 0.0)))
        simulation.advance(4.0)
        position, rate, _ = simulation.joints()
        way = simulation.base()[0][0]
        assert position == pytest.approx([sign * way / RADIUS] * 4, rel=0.03)
        assert rate == pytest.approx([sign * 0.5 / RADIUS] * 4, rel=0.05)


def test_a_wheel_bears_at_both_edges_of_its_tyre() -> None:
    """On a side slope it tips about the outer points of the tyres, not their middle."""
    robot = rover()
    tall = (replace(k, cog=(0.0, 0.0, 0.5)) if k.name == 'chassis' else k for k in robot.links)
    robot = replace(robot, links=tuple(tall))
    com = sum(k.mass * (0.5 if k.name == 'chassis' else AXLE) for k in robot.links) / robot.mass
    high = com - robot.ground
    middle, outer = (np.arctan2(HALF_TRACK + off, high) for off in (0.0, 0.05))
    simulation = Simulation(robot, build=replace(BUILD, friction=3.0))
    slope = float(middle + outer) / 2.0
    simulation.apply(Command(0.0, slope=(slope, np.pi / 2.0), slope_rate=0.1))
    simulation.advance(15.0)
    assert simulation.base()[1] == pytest.approx([0.0, 0.0, 1.0], abs=0.02)


def test_points_that_no_wheel_stands_on_roll_along() -> None:
    """A robot on two wheels and casters drives as fast as told; braked it holds on a slope."""
    robot = rover(measured=False)
    links = [k for k in robot.links if not k.name.startswith('rear')]
    joints = [j for j in robot.joints if not j.name.startswith('rear')]
    casters = replace(
        robot,
        links=tuple(links),
        joints=tuple(joints),
        held=tuple((n, at) for n, at in robot.held if not n.startswith('rear')),
    )
    simulation = Simulation(casters)
    simulation.apply(Command(0.0, drive=(0.3, 0.0)))
    simulation.advance(4.0)
    assert simulation.base()[0][0] == pytest.approx(0.3 * 4.0 - 0.05, abs=0.03)
    simulation.apply(Command(0.0, drive=(0.0, 0.0), slope=(0.5, 0.0), slope_rate=0.2))
    simulation.advance(6.0)
    there = simulation.base()[0][0]
    simulation.advance(1.0)
    assert simulation.base()[0][0] == pytest.approx(there, abs=0.01)


def test_wheels_are_not_let_go_when_the_power_goes() -> None:
    """Measured wheels hold as held ones do: the falls and the brakes are of the arm alone."""
    robot = arm_on_wheels()
    axles = tuple(name for name, _ in robot.held)
    told = replace(robot, joint_names=(*axles, *robot.joint_names), held=())
    q = (0.0, -0.6, 0.9, 0.0, 0.0, 0.0)
    weight = (0.0, 0.0, -9.81)
    held = power_loss(Released(robot, q, robot.payload, weight))
    measured = power_loss(Released(told, (0.3, 0.3, 0.3, 0.3, *q), robot.payload, weight))
    assert [brake.joint for brake in measured.brakes] == [f'j{k}' for k in range(1, 7)]
    assert measured.answer == held.answer
    assert [f.turn for f in measured.falls] == pytest.approx([f.turn for f in held.falls], abs=1e-3)


def test_random_cases_end_for_a_root_link_below_the_ground() -> None:
    """Only what joints move has to be above it: footprints often are a little below."""
    robot = arm_on_wheels()
    sunk = replace(
        robot,
        contacts=tuple(
            replace(c, position=(*c.position[:2], c.position[2] + 0.2)) for c in robot.contacts
        ),
        ground=robot.ground + 0.2,
    )
    assert len(random_cases(sunk, 3, seed=1)) == 3


def test_no_load_leaves_every_mass_as_it_is() -> None:
    """A robot without a payload link weighs what its links weigh; a load for it is refused."""
    simulation = Simulation(rover())
    simulation.advance(0.1)
    assert simulation.vehicle.model.body_mass.sum() == pytest.approx(rover().mass, abs=1e-4)
    with pytest.raises(BadConfig, match=r'expected payload\.link'):
        simulation.apply(Command(0.0, payload=Payload(1.0)))


@pytest.mark.parametrize('inertia', [NO_TRIANGLE, NOT_POSITIVE], ids=['triangle', 'not positive'])
def test_an_inertia_of_no_body_is_balanced(inertia: Matrix) -> None:
    """MuJoCo takes a robot with such links; these are named, the other links' numbers stay."""
    robot = arm_on_wheels()
    bad = {'imu', 'fore'}
    links = tuple(
        replace(k, inertia=inertia, mass=max(k.mass, 1e-3)) if k.name in bad else k
        for k in robot.links
    )
    wrong = replace(robot, links=links)
    assert set(balanced_links(wrong)) == bad
    assert balanced_links(robot) == ()
    found, good = vehicle_of(wrong, FIXED).model, vehicle_of(robot, FIXED).model
    others = [k.name for k in robot.links if k.name not in bad]
    for name in others:
        assert found.body(name).inertia.tolist() == good.body(name).inertia.tolist()
    mean = sum(inertia[k][k] for k in range(3)) / 3.0
    assert found.body('fore').inertia == pytest.approx([mean] * 3, rel=1e-3)


def test_a_flat_plate_is_a_body() -> None:
    """An inertia at the edge of what a body can have, as CAD gives for thin sheets, stays."""
    sheet = ((0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.2))
    robot = replace(rover(), links=(*rover().links[1:], Link('chassis', 9.0, inertia=sheet)))
    assert balanced_links(robot) == ()
    assert vehicle_of(robot, FIXED).model.body('chassis').inertia == pytest.approx([0.2, 0.1, 0.1])


@pytest.mark.parametrize('name', ['world', 'payload', 'base', 'ground', 'hull', 'imu', 'gyro'])
def test_links_and_joints_may_have_any_name(name: str) -> None:
    """Names that the simulation uses itself are no obstacle."""
    robot = arm_on_wheels()

    def named(link: str) -> str:
        return f'{name}_' if link == name else name if link == 'fore' else link

    joints = tuple(
        replace(j, parent=named(j.parent), child=named(j.child), name=f'x{j.name}')
        for j in robot.joints
    )
    joints = tuple(replace(j, name=name) if j.name == 'xj3' else j for j in joints)
    moved = ['xj1', 'xj2', name, 'xj4', 'xj5', 'xj6']
    robot = replace(
        robot,
        links=tuple(replace(k, name=named(k.name)) for k in robot.links),
        joints=joints,
        joint_names=tuple(moved),
        held=tuple((f'x{n}', at) for n, at in robot.held),
        contacts=tuple(replace(c, link=named(c.link)) for c in robot.contacts),
    )
    simulation = Simulation(robot, payload=Payload(1.0))
    simulation.advance(0.1)
    assert len(simulation.vehicle.wheels) == 4


def test_a_root_link_called_world_can_be_simulated() -> None:
    """As of many robots that somebody drew on the ground."""
    robot = on_plate(rover())
    links = tuple(replace(k, name='world') if k.name == 'footprint' else k for k in robot.links)
    joints = tuple(
        replace(j, parent='world') if j.parent == 'footprint' else j for j in robot.joints
    )
    simulation = Simulation(replace(robot, links=links, joints=joints))
    assert simulation.base()[0][2] == pytest.approx(-robot.ground, abs=1e-3)


@pytest.mark.parametrize('robot', [arm_on_wheels(), rover(), tracked()], ids=lambda r: r.name)
def test_a_torque_at_rest_is_that_of_the_statics(robot: Robot) -> None:
    """MuJoCo's torque of a resting robot is that of the model, for other makes too."""
    rng, vehicle = np.random.default_rng(3), vehicle_of(robot, FIXED)
    for k in range(10):
        q = rng.uniform(-3.0, 3.0, len(robot.joint_names))
        gravity = gravity_on_slope(9.81, 0.05 * k, float(k))
        vehicle.model.opt.gravity[:] = gravity
        data = mujoco.MjData(vehicle.model)
        data.qpos[vehicle.position] = q
        mujoco.mj_inverse(vehicle.model, data)
        ours = static_torque(robot, q, gravity)
        np.testing.assert_allclose(data.qfrc_inverse[vehicle.rate], ours, rtol=1e-11, atol=1e-9)


def test_motors_without_a_limit_and_slides_hold() -> None:
    """A joint without an effort limit and a prismatic one hold their load where they are."""
    robot = arm_on_wheels()
    lift = Joint(
        'lift', 'prismatic', 'chassis', 'carriage', (0.2, 0.0, 0.25), axis=UP, upper=0.3, lower=0.0
    )
    joints = [
        replace(j, parent='carriage', xyz=(0.0, 0.0, 0.0)) if j.name == 'j1' else j
        for j in robot.joints
    ]
    joints = [replace(j, effort=float('inf')) if j.name == 'j2' else j for j in joints]
    robot = replace(
        robot,
        links=(*robot.links, Link('carriage', 2.0, inertia=box(2.0, 0.1, 0.1, 0.1))),
        joints=(*joints, lift),
        joint_names=('lift', *robot.joint_names),
    )
    simulation = Simulation(robot, (('lift', 0.1), ('j2', -0.5)), payload=Payload(1.0))
    simulation.apply(Command(0.0, joints=(('lift', 0.25),), speed=0.1))
    simulation.advance(4.0)
    position, _, force = simulation.joints()
    assert position[0] == pytest.approx(0.25, abs=0.005)
    carried = 1.0 + 2.0 + sum(robot.link(n).mass for n in ('pillar', 'upper', 'fore', 'hand'))
    carried += robot.link('palm').mass + robot.link('flange').mass
    assert force[0] == pytest.approx(carried * 9.81, rel=0.01)


def test_contacts_on_one_side_only_are_no_obstacle() -> None:
    """A tracked robot with a single point on one side still drives."""
    robot = tracked()
    contacts = tuple(c for c in robot.contacts if c.name != 'rear_left' and c.link == 'base_link')
    contacts = (*contacts, Contact('tail', 'base_link', (-0.26, 0.0, 0.0)))
    build = replace(BUILD, blocks=(step(0.8, 0.03),))
    simulation = Simulation(replace(robot, contacts=contacts), build=build, payload=Payload())
    simulation.apply(Command(0.0, drive=(0.2, 0.0)))
    simulation.advance(2.0)
    assert simulation.base()[0][0] > 0.2
