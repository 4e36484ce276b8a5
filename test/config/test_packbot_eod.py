"""The PackBot EOD that ships: the chassis of packbot, the whole arm, nothing invented."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from config.test_pinocchio import of_pinocchio

from ugv_acceptance.config import Config, load
from ugv_acceptance.config.uncertain import sources_from
from ugv_acceptance.model.clearance import clearance, nearness_of
from ugv_acceptance.model.mechanics import mechanics_of
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import STANDING, stability
from ugv_acceptance.model.statics import centre_of_gravity, static_torque

LEVEL = (0.0, 0.0, -9.81)
# The joints of the driver's arm, in its order, then its flippers.
DRIVER = ('turret', 'shoulder', 'elbow1', 'elbow2', 'tilt', 'pan', 'wrist', 'grip', 'flipper')
LB = 0.45359237


@pytest.fixture(scope='module')
def eod() -> Config:
    """Return the configuration that ships."""
    return load('packbot_eod')


def named(config: Config) -> dict[str, list[float]]:
    """Return the poses as positions in joint order."""
    robot = config.settings.robot
    poses = {pose.name: dict(pose.positions) for pose in robot.poses}
    return {name: [at[j] for j in robot.joint_names] for name, at in poses.items()}


def test_it_has_the_joints_that_the_driver_tells(eod: Config) -> None:
    """Eight joints of the arm and the flippers, under the driver's names, in its order."""
    assert tuple(joint.topic_name for joint in eod.settings.joints) == DRIVER


def test_its_chassis_is_that_of_packbot(eod: Config) -> None:
    """Links, joints, contact points and IMU of the platform are equal to packbot's, to the bit."""
    ours, other = eod.settings, load().settings
    for name in ('base_link', 'chassis_link', 'flipper_link', 'imu_link'):
        assert ours.robot.link(name) == other.robot.link(name)
    for name in ('chassis_joint', 'flipper_joint', 'imu_joint'):
        assert ours.robot.joint(name) == other.robot.joint(name)
    assert ours.robot.contacts == other.robot.contacts
    assert (ours.imu, ours.robot.ground) == (other.imu, other.robot.ground)


def test_it_weighs_what_was_reported(eod: Config) -> None:
    """68 lb with the arm, and 42 lb without, to 10 g."""
    robot = eod.settings.robot
    base = sum(robot.link(name).mass for name in ('chassis_link', 'flipper_link'))
    assert robot.mass == pytest.approx(68 * LB, abs=0.01)
    assert base == pytest.approx(42 * LB, abs=0.01)


def test_it_reaches_six_feet_and_no_more_than_two_metres(eod: Config) -> None:
    """Stretched forward, the camera's joint is 6 ft from the shoulder; the hand is at 1.19 m."""
    robot = eod.settings.robot
    tilt = ('elbow_1_joint', 'elbow_2_joint', 'tilt_joint')
    assert sum(robot.joint(name).xyz[0] for name in tilt) == pytest.approx(6 * 0.3048, abs=0.005)
    hand = ('elbow_1_joint', 'wrist_joint', 'gripper_joint')
    assert sum(robot.joint(name).xyz[0] for name in hand) == pytest.approx(1.19, abs=1e-12)


def test_its_torques_are_those_of_pinocchio(eod: Config) -> None:
    """Torques to 1e-9 N m, centres of gravity to 1e-12 m, in its poses and in random postures."""
    text, robot = eod.urdf_path.read_text('utf-8'), eod.settings.robot
    random = np.random.default_rng(4).uniform(-np.pi, np.pi, (20, len(DRIVER)))
    for q in [*map(np.array, named(eod).values()), *random]:
        torque, centre = of_pinocchio(text, robot, q)
        np.testing.assert_allclose(static_torque(robot, q, LEVEL), torque, rtol=0, atol=1e-9)
        np.testing.assert_allclose(centre_of_gravity(robot, q), centre, rtol=0, atol=1e-12)


def test_no_torque_limit_is_made_up(eod: Config) -> None:
    """No limit is published, so none is judged, and what carries the arm is warned of."""
    assert all(map(math.isinf, eod.settings.limits.torque))
    assert [re.findall(r'joints\.(\w+)\.limit', text) for text in eod.warnings] == [
        ['shoulder_joint'],
        ['elbow_1_joint'],
    ]


def test_it_stands_well_in_each_of_its_poses(eod: Config) -> None:
    """STOW, DRIVE, STAIRS and PLACE: more than 25 deg of tilt left, the arm off the ground."""
    robot, poses = eod.settings.robot, named(eod)
    assert sorted(poses) == ['DRIVE', 'PLACE', 'STAIRS', 'STOW']
    mechanics = mechanics_of(robot)
    for name, q in poses.items():
        found = stability(robot, q, LEVEL)
        assert found.state == STANDING, name
        assert min(found.angle) > math.radians(25), name
        assert clearance(mechanics, None, q, (0, 0, 0)) > nearness_of(mechanics).touches, name


def test_placing_a_load_ahead_with_raised_flippers_tips_it(eod: Config) -> None:
    """In PLACE it needs its flippers: raised, 4 kg tip it forward."""
    robot = eod.settings.robot
    q = named(eod)['PLACE']
    assert stability(robot, q, LEVEL, Payload(4)).angle[0] > math.radians(30)
    q[DRIVER.index('flipper')] = math.pi
    assert stability(robot, q, LEVEL, Payload(4)).angle[0] < 0


def test_every_assumed_mass_and_place_has_its_uncertainty(eod: Config) -> None:
    """What is called assumed, or carries no source, has a +/- in the file."""
    told = {(source.subject, source.what) for source in sources_from(eod)}
    for link in eod.settings.robot.links:
        assert not link.mass or (link.name, 'mass') in told, link.name
    for name, _ in eod.assumed or ():
        subject, _, what = name.partition('.')
        kind = {'position': 'place'}.get(what, what)
        assert subject in ('imu', 'poses') or (subject, kind) in told, name


def test_every_number_of_the_arm_has_a_source_in_its_urdf(repository: Path) -> None:
    """Beside each mass of the URDF a comment says paper, press, CAD, assumed or how it follows."""
    text = (repository / 'urdf' / 'packbot_eod.urdf').read_text('utf-8')
    masses = re.findall(r'(<!--(?:(?!-->).)*-->)?\s*<mass value', text, re.DOTALL)
    assert len(masses) == 10
    for comment in masses:
        assert re.search(r'paper|press|CAD|assumed|[Aa]ssumed', comment), comment
        assert '+/-' in comment, comment
