"""Plans of robots that are no PackBot: an arm of six joints on wheels, a rover, those without."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from foreign_files import arm_alone, mobile_arm, rover, walker

from ugv_acceptance import BadConfig
from ugv_acceptance.config import Config, load
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import margins
from ugv_acceptance.model.statics import gripper_point
from ugv_acceptance.plan.card import card_of
from ugv_acceptance.plan.derive import Wanted, derive, notes_of
from ugv_acceptance.plan.plan import (
    ROBOT,
    SIMULATION,
    Plan,
    plan_text,
    radians_of,
    read_plan,
    vector_of,
)
from ugv_acceptance.plan.search import Arm
from ugv_acceptance.studies.orientations import ORIENTATIONS


@pytest.fixture(scope='module')
def armed(tmp_path_factory: pytest.TempPathFactory) -> Config:
    """Return the configuration of the mobile arm."""
    return load(mobile_arm(tmp_path_factory.mktemp('armed')))


@pytest.fixture(scope='module')
def plan(armed: Config) -> Plan:
    """Return the plan of the mobile arm."""
    return derive(armed)


@pytest.fixture(scope='module')
def rolling(tmp_path_factory: pytest.TempPathFactory) -> Config:
    """Return the configuration of the rover."""
    return load(rover(tmp_path_factory.mktemp('rolling')))


def test_an_arm_of_any_names_has_torque_and_tilt_steps_for_its_lifting_joints(plan: Plan) -> None:
    """The two joints that lift are found in the tree; nobody looks for a flipper."""
    groups = {step.group for step in plan.steps}
    assert {'worst postures', 'torque boundary', 'orientations', 'rollover boundary'} <= groups
    assert {'lift', 'drag', 'driving', 'endurance'} <= groups
    titles = ' '.join(step.title for step in plan.steps)
    assert 'big_lift' in titles
    assert 'mid_lift' in titles
    assert 'flipper' not in plan_text(plan)


def test_the_margins_a_step_of_a_foreign_robot_expects_are_those_of_its_posture(
    armed: Config, plan: Plan
) -> None:
    """What the plan tells the reader is what torque and stability give, on every ground."""
    robot, limits = armed.settings.robot, np.array(armed.settings.limits.torque)
    held = [s for s in plan.steps if s.action in {'hold', 'tip'}]
    assert held
    for step in held:
        q = np.array([vector_of(robot, plan.home_deg, step.posture_deg)])
        load_ = Payload(step.payload_kg, robot.payload.cog)
        found = margins(robot, q, step.gravity(robot.gravity), load_)
        use = float((np.abs(found.torque) / limits).max())
        left = math.degrees(float(found.angle.min()))
        assert step.expected['use'] == pytest.approx(use, abs=2e-3)
        assert step.expected['tilt_left_deg'] == pytest.approx(left, abs=0.05)
        if step.where == ROBOT:
            assert use < armed.settings.limits.torque_error
            assert left > math.degrees(armed.settings.limits.tip_error)


@pytest.mark.parametrize('heading', [0.0, math.pi / 2.0, -math.pi / 2.0])
@pytest.mark.parametrize('turned', [False, True])
def test_the_turret_points_the_arm_where_it_is_asked(
    armed: Config, heading: float, *, turned: bool, tmp_path: Path
) -> None:
    """Whichever way its axis points, and wherever the arm points with the turret at zero."""
    config = armed
    if turned:
        path = mobile_arm(tmp_path)
        urdf = tmp_path / 'mobile_arm.urdf'
        text = urdf.read_text()
        at = '<origin xyz="0.15 0 0.2"/>'
        assert at in text
        text = text.replace(at, '<origin xyz="0.15 0 0.2" rpy="3.14159265358979 0 0.6"/>')
        # Upside down, so what lifted lowers.
        urdf.write_text(text.replace('lower="-2.9" upper="0.3"', 'lower="-0.3" upper="2.9"'))
        config = load(path)
    arm = Arm(config.settings)
    q = arm.turned(arm.grid, arm.turret_at(heading))
    hand = gripper_point(config.settings.robot, q) - (0.15, 0.0, 0.0)
    far = hand[np.linalg.norm(hand[:, :2], axis=1).argmax()]
    off = math.atan2(far[1], far[0]) - heading
    # An arm that reaches over itself also points the other way.
    assert abs(math.sin(off)) < math.sin(math.radians(1.0))
    ahead = hand @ (math.cos(heading), math.sin(heading), 0.0)
    assert ahead.max() > 0.9 * np.linalg.norm(hand[:, :2], axis=1).max()


def test_every_posture_is_within_the_ranges_of_the_joints(tmp_path: Path) -> None:
    """A joint whose range is without 0 is not sent there, nor one turned past its end."""
    path = mobile_arm(tmp_path)
    urdf = tmp_path / 'mobile_arm.urdf'
    text = urdf.read_text()
    for name, ends in (('base.yaw', (-1.0, 2.0)), ('roll_a', (0.3, 1.1)), ('mid_lift', (-2, -0.1))):
        old = re.search(rf'<joint name="{name}".*?</joint>', text, re.DOTALL)
        assert old
        new = re.sub(r'lower="\S+" upper="\S+"', f'lower="{ends[0]}" upper="{ends[1]}"', old[0])
        text = text.replace(old[0], new)
    urdf.write_text(text)
    config = load(path)
    made = derive(config, Wanted(short=True))
    for step in made.steps:
        for posture in (made.home_deg, step.posture_deg, *step.via_deg):
            for name, angle in radians_of(config.settings.robot, posture).items():
                joint = config.settings.robot.joint(name)
                assert joint.lower - 1e-4 <= angle <= joint.upper + 1e-4, (step.id, name)


def test_what_the_configuration_leaves_out_is_said_and_left_out(tmp_path: Path) -> None:
    """Without limits no torque steps, without a payload link no loads; each says what to set."""
    config = load(mobile_arm(tmp_path, payload=False, limits=False))
    notes = ' '.join(notes_of(config))
    assert 'joints.big_lift.limit_nm' in notes
    assert 'payload.link' in notes
    made = derive(config)
    groups = {step.group for step in made.steps}
    assert 'rollover boundary' in groups
    assert not groups & {'worst postures', 'torque boundary', 'lift'}
    assert all(note in card_of(made, config) for note in notes_of(config))


def test_a_rover_is_planned_on_ramps_and_driving(rolling: Config) -> None:
    """Every orientation, every side, driving and a pull; nothing of an arm it does not have."""
    made = derive(rolling)
    tilted = {s.ground.orientation for s in made.steps if s.group == 'orientations'}
    assert tilted == set(ORIENTATIONS) - {'level'}
    sides = {s.ground.orientation for s in made.steps if s.ground.tilt_deg > 10.0}
    assert {'left', 'right', 'nose-up', 'nose-down'} <= sides
    assert {s.action for s in made.steps} >= {'hold', 'drive', 'pull'}
    assert all(s.posture_deg == {} for s in made.steps)
    assert not re.search(r'\b(arm|gripper|flippers?|turret|elbow)\b', plan_text(made))
    card = card_of(made, rolling)
    assert not re.search('Turret|flipper|gripper|the posture drawn|Where this robot is safe', card)
    assert derive(rolling, Wanted(short=True)).steps


def test_a_rover_near_its_limit_is_held_on_both_sides_of_it(tmp_path: Path) -> None:
    """A tall load leaves so little tilt that ramps reach the limits: outside only in simulation."""
    path = rover(tmp_path)
    urdf = tmp_path / 'rover.urdf'
    urdf.write_text(urdf.read_text().replace('xyz="0 0 0.08"', 'xyz="0 0 0.6"'))
    made = derive(load(path))
    on_robot, simulated = (
        [s for s in made.steps if s.group == 'rollover boundary' and s.where == where]
        for where in (ROBOT, SIMULATION)
    )
    assert any('ERROR TIP_OVER' in s.alerts.must for s in simulated)
    assert any(s.action == 'tip' for s in simulated)
    assert any('WARN TIP_OVER' in s.alerts.must for s in on_robot)
    assert all(s.expected['tilt_left_deg'] > 5.0 for s in on_robot)


@pytest.mark.parametrize(
    ('make', 'said'), [(arm_alone, 'is an arm without contact points'), (walker, 'stands on legs')]
)
def test_who_is_not_driven_has_no_plan(make: object, said: str, tmp_path: Path) -> None:
    """An arm alone and legs are told in one line why not."""
    assert callable(make)
    with pytest.raises(BadConfig, match=said) as error:
        derive(load(make(tmp_path)))
    assert '\n' not in str(error.value)


def test_a_joint_that_slides_is_planned_in_metres(tmp_path: Path) -> None:
    """Positions of slides are not degrees: in the plan, back from it, and on the card."""
    path = mobile_arm(tmp_path)
    urdf = tmp_path / 'mobile_arm.urdf'
    text = urdf.read_text()
    old = re.search(r'<joint name="nod".*?</joint>', text, re.DOTALL)
    assert old
    slide = old[0].replace('revolute', 'prismatic')
    slide = re.sub(r'lower="\S+" upper="\S+"', 'lower="0.02" upper="0.08"', slide)
    urdf.write_text(text.replace(old[0], slide))
    config = load(path)
    made = derive(config, Wanted(short=True))
    robot = config.settings.robot
    assert made.home_deg['nod'] == pytest.approx(0.05)
    assert radians_of(robot, made.home_deg)['nod'] == pytest.approx(0.05)
    assert 'nod 0.05 m' in card_of(made, config)
    written = tmp_path / 'plan.yaml'
    written.write_text(plan_text(made), 'utf-8')
    assert read_plan(written, robot) == made
