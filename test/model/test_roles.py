"""Tests of the roles that joints have by the robot's tree."""

from dataclasses import replace
from math import pi

import pytest
from foreign_robots import (
    ACROSS,
    AXLE,
    CORNERS,
    HALF_BASE,
    HALF_TRACK,
    RADIUS,
    ROLLED,
    UP,
    arm_on_wheels,
    rover,
    walker,
)
from robots import paper_arm, tracked

from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Contact, Joint, Link, Payload, Robot
from ugv_acceptance.model.roles import Roles, roles_of, wheels_of

AXLES = tuple(f'{name}_axle' for name in CORNERS)


def renamed(robot: Robot) -> Robot:
    """Return the robot with every joint named by a number: names must not matter."""
    name = {joint.name: f'n{k}' for k, joint in enumerate(robot.joints)}
    return replace(
        robot,
        joints=tuple(replace(j, name=name[j.name]) for j in robot.joints),
        joint_names=tuple(name[n] for n in robot.joint_names),
        held=tuple((name[n], at) for n, at in robot.held),
    )


def test_the_roles_of_the_packbot() -> None:
    """A tracked robot with a turret, two lifting joints and flippers."""
    assert roles_of(load('packbot').settings.robot) == Roles(
        'tracked',
        ('turret_joint', 'shoulder_joint', 'elbow_joint'),
        ('shoulder_joint', 'elbow_joint'),
        'turret_joint',
        ('flipper_joint',),
    )


@pytest.mark.parametrize('measured', [True, False])
def test_a_rover_has_wheels_and_nothing_else(*, measured: bool) -> None:
    """Wheels are found whether a message tells them or not."""
    assert roles_of(rover(measured=measured)) == Roles('wheeled', wheels=AXLES)


def test_an_arm_on_wheels() -> None:
    """The joints that lift are found among six; rolls and the wrist are none."""
    robot = arm_on_wheels()
    arm = tuple(f'j{k}' for k in range(1, 7))
    assert roles_of(robot) == Roles('wheeled', arm, ('j2', 'j3'), 'j1', wheels=AXLES)


def test_no_name_is_looked_at() -> None:
    """Renamed joints have the same roles."""
    for robot in (arm_on_wheels(), tracked(), walker()):
        number = {f'n{k}': joint.name for k, joint in enumerate(robot.joints)}
        found, same = roles_of(renamed(robot)), roles_of(robot)
        back = [tuple(number[n] for n in names) for names in (found.arm, found.axes, found.legs)]
        assert (found.kind, *back) == (same.kind, same.arm, same.axes, same.legs)


def test_an_arm_is_found_without_a_payload_link() -> None:
    """Without a payload link the longest chain of three or more joints is the arm."""
    robot = replace(arm_on_wheels(), payload_link=None, payload=Payload())
    assert roles_of(robot).axes == ('j2', 'j3')


def test_the_head_of_a_camera_is_no_arm() -> None:
    """Two joints of a camera's head make no arm where no payload link is told."""
    robot = rover()
    head = (
        Joint('pan', 'revolute', 'chassis', 'pan_link', (0.2, 0.0, 0.3), axis=UP),
        Joint('tilt', 'revolute', 'pan_link', 'lens', axis=ACROSS),
    )
    links = (Link('pan_link', 0.2), Link('lens', 0.3, (0.02, 0.0, 0.0)))
    robot = replace(
        robot,
        links=(*robot.links, *links),
        joints=(*robot.joints, *head),
        joint_names=(*robot.joint_names, 'pan', 'tilt'),
    )
    assert roles_of(robot) == Roles('wheeled', wheels=AXLES)


def test_joints_without_messages_are_no_part_of_the_arm() -> None:
    """A held joint of the chain cannot be commanded: the arm is the rest."""
    robot = arm_on_wheels()
    robot = replace(robot, joint_names=('j1', 'j2', 'j3'), held=(*robot.held, ('j4', 0.3)))
    assert roles_of(robot).arm == ('j1', 'j2', 'j3')


def test_legs_are_no_flippers() -> None:
    """Chains of several joints to every contact point are legs."""
    found = roles_of(walker())
    assert (found.kind, found.flippers, len(found.legs)) == ('legged', (), 12)


def test_each_flipper_with_a_joint_of_its_own_is_one() -> None:
    """Two joints that each move contact points are two flippers."""
    robot = tracked()
    second = Joint('back', 'continuous', 'base_link', 'back_flippers', (-0.24, 0.0, 0.1), axis=UP)
    second = replace(second, axis=ACROSS)
    robot = replace(
        robot,
        links=(*robot.links, Link('back_flippers', 2.0, (-0.1, 0.0, 0.0))),
        joints=(*robot.joints, second),
        joint_names=(*robot.joint_names, 'back'),
        contacts=(*robot.contacts, Contact('back_tip', 'back_flippers', (-0.2, 0.2, -0.03))),
    )
    found = roles_of(robot)
    assert (found.kind, found.flippers, found.wheels) == ('tracked', ('flippers', 'back'), ())


def test_what_carries_wheels_is_no_flipper() -> None:
    """A measured suspension or steering moves contact points, and is none."""
    robot = rover()
    for kind, axis in (('revolute', ACROSS), ('prismatic', UP), ('revolute', UP)):
        moved = Joint('knee', kind, 'chassis', 'rocker', axis=axis, lower=-0.1, upper=0.1)
        name = 'front_left'
        joints = [
            replace(j, parent='rocker') if j.name == f'{name}_axle' else j for j in robot.joints
        ]
        contacts = [
            replace(c, link='rocker') if c.name.startswith(name) else c for c in robot.contacts
        ]
        changed = replace(
            robot,
            links=(*robot.links, Link('rocker', 1.0, (0.1, 0.0, 0.0))),
            joints=(*joints, moved),
            joint_names=(*robot.joint_names, 'knee'),
            contacts=tuple(contacts),
        )
        assert roles_of(changed) == Roles('wheeled', wheels=AXLES)


def test_an_arm_alone_and_a_box() -> None:
    """What stands on nothing is an arm, or nothing of the kind."""
    assert roles_of(paper_arm()).kind == 'arm'
    assert roles_of(Robot('box', (Link('box', 3.0),), (), ())) == Roles('none')


def test_a_wheel_stands_on_the_points_below_its_axle() -> None:
    """Both points across a tyre belong to its wheel, whose radius is their distance to the axle."""
    for wheel, (x, y) in zip(wheels_of(rover()), CORNERS.values(), strict=True):
        assert wheel.axle == pytest.approx((x, y, AXLE))
        assert wheel.radius == pytest.approx(RADIUS)
        name = wheel.joint.removesuffix('_axle')
        assert [c.name for c in wheel.contacts] == [f'{name}_in', f'{name}_out']


def test_an_axle_along_z_of_a_rolled_link_is_one() -> None:
    """The axle's direction counts in the robot's axes, as many URDFs roll the wheel's link."""
    robot = rover()
    joints = tuple(
        replace(j, rotation=ROLLED, axis=UP) if j.kind == 'continuous' else j for j in robot.joints
    )
    wheels = wheels_of(replace(robot, joints=joints))
    assert [w.joint for w in wheels] == list(AXLES)
    assert [w.axis for w in wheels] == [pytest.approx(ACROSS)] * 4


def test_a_wheel_without_a_point_below_it_has_none() -> None:
    """A point beside the line below the axle is not of the wheel: the robot rests on something."""
    robot = rover()
    caster = Contact('caster', 'chassis', (0.0, HALF_TRACK, AXLE - RADIUS))
    wheels = wheels_of(replace(robot, contacts=(caster,)))
    assert [(w.contacts, w.radius) for w in wheels] == [((), 0.0)] * 4
    assert roles_of(replace(robot, contacts=(caster,))).kind == 'tracked'


def test_what_hangs_off_its_axle_is_no_wheel() -> None:
    """A link that turns without end but is not balanced is a flipper or an arm, no wheel."""
    robot = rover()
    links = tuple(
        replace(k, cog=(0.03, 0.0, 0.0)) if k.name == 'front_left_tyre' else k for k in robot.links
    )
    assert 'front_left_axle' not in roles_of(replace(robot, links=links)).wheels
    turned = Joint('lidar', 'continuous', 'chassis', 'head', (HALF_BASE, 0.0, 0.4), axis=UP)
    robot = replace(robot, links=(*robot.links, Link('head', 0.3)), joints=(*robot.joints, turned))
    assert roles_of(robot).wheels == AXLES


def test_a_held_joint_counts_where_it_is_held() -> None:
    """A lifting axis is one by the posture that held joints give it."""
    robot = arm_on_wheels()
    tipped = Joint('deck', 'revolute', 'chassis', 'deck_plate', axis=(1.0, 0.0, 0.0))
    joints = [replace(j, parent='deck_plate') if j.name == 'j1' else j for j in robot.joints]
    robot = replace(robot, links=(*robot.links, Link('deck_plate', 1.0)), joints=(*joints, tipped))
    robot = replace(robot, held=(*robot.held, ('deck', pi / 2.0)))
    assert 'j1' in roles_of(robot).axes
