"""Passive joints, springs, and contact points on wheels in a robot's files."""

import math
from pathlib import Path

import pytest
from config.robot_files import YAML, write_robot

from ugv_acceptance import BadConfig
from ugv_acceptance.config import Config, load
from ugv_acceptance.evaluation.criteria.not_judged import not_judged
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Law
from ugv_acceptance.model.statics import static_torque

LIFT = '  lift:\n    limit_nm: 30\n'
# A rover of two driven wheels and a flipper; {wheel} is the wheel's centre of gravity.
ROVER = """<robot name="rover">
  <link name="base"><inertial><mass value="20"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="axle" type="continuous"><origin xyz="0.3 0 0.1" rpy="0 0 0.5"/>
    <parent link="base"/><child link="wheel"/><axis xyz="0.479425538604203 0.8775825618903728 0"/>
  </joint>
  <link name="wheel"><inertial><origin xyz="{wheel}"/><mass value="2"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"""
ROVER_YAML = """robot: {{name: rover}}
urdf: two.urdf
joints: {{axle: {{limit_nm: 5}}}}
contacts:
  a: {{link: base, position_m: [-0.3, 0.2, 0]}}
  b: {{link: base, position_m: [-0.3, -0.2, 0]}}
  w: {{link: wheel, position_m: {point}}}
"""
BELOW = '[0, 0, -0.1]'


def config_of(folder: Path, joint: str) -> Config:
    """Load the small robot with another text for its lift."""
    return load(write_robot(folder, YAML.replace(LIFT, joint)))


def rover(folder: Path, point: str, wheel: str = '0 0 0') -> Config:
    """Load the rover with its third contact at a point of the wheel."""
    return load(write_robot(folder, ROVER_YAML.format(point=point), ROVER.format(wheel=wheel)))


def test_a_passive_joint_is_not_judged_and_that_is_said(tmp_path: Path) -> None:
    """It has no limit, nobody is warned of that, and every verdict names it as passive."""
    config = config_of(tmp_path, '  lift: {passive: true}\n')
    assert config.settings.limits.torque[0] == math.inf
    assert config.settings.passive == ('lift',)
    assert config.warnings == ()
    told = {one.what: one.why for one in not_judged(config.settings)}
    assert told['torque of lift'].startswith('declared as passive')
    assert not any('no limit' in why for why in told.values())


def test_a_passive_joint_with_a_limit_is_refused(tmp_path: Path) -> None:
    """Both together say two things."""
    with pytest.raises(BadConfig, match=r'joints\.lift\.passive: expected no limit'):
        config_of(tmp_path, '  lift: {passive: true, limit_nm: 30}\n')


def test_a_spring_takes_its_part_off_the_torque(tmp_path: Path) -> None:
    """The motor holds what the weight needs, less the constant torque and the spring."""
    law = '{constant_nm: 4, spring_nmprad: 20, rest_deg: 30}'
    plain = config_of(tmp_path, LIFT).settings.robot
    robot = config_of(tmp_path, f'{LIFT}    law: {law}\n').settings.robot
    assert robot.laws == (Law('lift', 4.0, 20.0, math.radians(30.0)),)
    q, down = [0.2, 0.0], (0.0, 0.0, -9.81)
    spring = 4.0 - 20.0 * (0.2 - math.radians(30.0))
    needed = static_torque(plain, q, down)[0] - spring
    assert static_torque(robot, q, down)[0] == pytest.approx(needed)


@pytest.mark.parametrize(
    ('law', 'says'),
    [
        ('{rest_deg: 30}', r'law: expected constant or spring, got neither'),
        ('{constant_n: 3}', r'law\.constant_n: expected a torque .* got a force'),
        ('{spring_npm: 3}', r'law\.spring_npm: expected a stiffness .* got a linear stiffness'),
        ('{sprung: 3}', r'sprung: unknown key'),
    ],
)
def test_a_law_that_says_nothing_or_another_unit_is_refused(
    tmp_path: Path, law: str, says: str
) -> None:
    """Each is one line that names file, line and field."""
    with pytest.raises(BadConfig, match=says):
        config_of(tmp_path, f'{LIFT}    law: {law}\n')


def test_a_contact_below_the_axle_of_a_wheel_stays_below_it(tmp_path: Path) -> None:
    """It is fixed to the link that carries the wheel, and every verdict says so."""
    settings = rover(tmp_path, BELOW).settings
    contact = settings.robot.contacts[2]
    assert contact.link == 'base'
    assert contact.position == pytest.approx((0.3, 0.0, 0.0))
    (words,) = settings.moved_contacts
    assert words.startswith('w is taken as the lowest point of the wheel wheel, fixed to base')
    mechanics = mechanics_of(settings.robot)
    assert mechanics.carried == ()
    for angle in (0.0, 1.0, 50.0):
        posture = posture_of(mechanics, [angle], 0.0, (0.0, 0.0, 0.0))
        assert posture.contacts[2] == pytest.approx((0.3, 0.0, 0.0))


@pytest.mark.parametrize('point', ['[0.1, 0, 0]', '[0, 0, 0.1]'])
def test_a_contact_elsewhere_on_a_wheel_is_refused(tmp_path: Path, point: str) -> None:
    """It would go round with the wheel."""
    with pytest.raises(BadConfig, match=r'contacts\.w\.position.*below the axle of wheel'):
        rover(tmp_path, point)


@pytest.mark.parametrize('point', [BELOW, '[0.1, 0, 0]'])
def test_a_flipper_that_turns_without_end_moves_its_contact(tmp_path: Path, point: str) -> None:
    """Its centre of gravity is off the axle: it is no wheel, wherever its zero points."""
    settings = rover(tmp_path, point, '0 0 -0.05').settings
    assert settings.robot.contacts[2].link == 'wheel'
    assert settings.moved_contacts == ()
