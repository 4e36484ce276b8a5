"""The PackBot that ships: its files agree with the paper, and with readers of others."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio
import pytest
from rosbags.highlevel import AnyReader

from ugv_acceptance.config import Config, load, worst_torques
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import RAISED, SIDES, STANDING, stability
from ugv_acceptance.model.statics import centre_of_gravity, static_torque

LEVEL = (0.0, 0.0, -9.81)
STOWED = np.pi
TOUCHING = -np.arcsin(0.060 / 0.233)  # the tip rollers reach the ground


@pytest.fixture(scope='module')
def packbot() -> Config:
    """Return the configuration that ships."""
    return load()


def test_nothing_about_it_is_doubtful(packbot: Config) -> None:
    """The default configuration loads without a warning."""
    assert packbot.warnings == ()


def test_torques_are_those_of_the_paper(packbot: Config) -> None:
    """Equations (1) and (2) with the paper's numbers, for random arm angles."""
    theta = np.random.default_rng(1).uniform(-np.pi, np.pi, (50, 2))
    q = np.column_stack([np.zeros(50), theta, np.full(50, STOWED)])
    a = 2.5 * 9.81 * 0.55 / 2 + 2.5 * 9.81 * 0.55 + 4 * 9.81 * 0.55
    b = 2.5 * 9.81 * 0.64 / 2 + 4 * 9.81 * 0.64
    second = b * np.cos(theta.sum(axis=1))
    first = a * np.cos(theta[:, 0]) + second
    torque = static_torque(packbot.settings.robot, q, LEVEL)
    np.testing.assert_allclose(torque[:, 1:3], np.column_stack([first, second]), rtol=0, atol=1e-12)


def test_worst_postures_are_found_exactly(packbot: Config) -> None:
    """At full forward reach the shoulder needs 74.8 N m with the load, 35.5 N m without."""
    robot = packbot.settings.robot
    loaded, own = (worst_torques(robot, load)[1].torque for load in (robot.payload, Payload()))
    assert (loaded, own) == pytest.approx((74.776725, 9.81 * 2.5 * (0.275 + 0.87)), rel=1e-12)


def test_positive_angles_raise(packbot: Config) -> None:
    """Shoulder and elbow lift the load, the flipper joint lifts the tips."""
    model = pinocchio.buildModelFromXML(packbot.urdf_path.read_text(encoding='utf-8'))
    data = model.createData()
    q = pinocchio.neutral(model)

    def height(frame: str, joint: str, angle: float) -> float:
        turned = q.copy()
        k = model.joints[model.getJointId(joint)].idx_q
        turned[k : k + 2] = np.cos(angle), np.sin(angle)  # how Pinocchio tells a continuous joint
        pinocchio.framesForwardKinematics(model, data, turned)
        at = data.oMf[model.getFrameId(frame)]
        return float((at.rotation @ [0.1, 0.0, 0.0] + at.translation)[2])

    for frame, joint in [
        ('gripper_link', 'shoulder_joint'),
        ('gripper_link', 'elbow_joint'),
        ('flipper_link', 'flipper_joint'),
    ]:
        assert height(frame, joint, 0.3) > height(frame, joint, 0.0) > height(frame, joint, -0.3)


def test_it_tips_forward_on_level_ground_at_full_reach(packbot: Config) -> None:
    """With 4 kg stretched out and flippers stowed, moments about the front contacts say so."""
    moments = [
        (17.45, 0.010),
        (1.6, 0.249 - 0.070),
        (0.5, 0.0),
        (2.5, 0.275),
        (2.5, 0.87),
        (4, 1.19),
    ]
    mass = sum(m for m, _ in moments)
    ahead = sum(m * x for m, x in moments) / mass - 0.250
    heights = [(17.45, 0.094), (1.6, 0.095), (9.5, 0.19)]
    angle = -np.arctan2(ahead, sum(m * z for m, z in heights) / mass)
    found = stability(packbot.settings.robot, [0, 0, 0, STOWED], LEVEL)
    assert found.angle[SIDES.index('front')] == pytest.approx(angle, rel=1e-9)
    assert angle < np.radians(-10)


def test_lowered_flippers_keep_it_from_tipping(packbot: Config) -> None:
    """Their tips touch the ground 0.47 m ahead and widen the support polygon."""
    found = stability(packbot.settings.robot, [0, 0, 0, TOUCHING], LEVEL)
    assert found.state == STANDING
    assert found.angle[SIDES.index('front')] > np.radians(45)


def test_flippers_pushed_lower_raise_it(packbot: Config) -> None:
    """It stands on the tips and the rear contacts then."""
    assert stability(packbot.settings.robot, [0, 2, 0, TOUCHING - 0.2], LEVEL).state == RAISED


def test_the_flipper_points_lie_on_their_rollers(packbot: Config) -> None:
    """Each point is 0.035 m from the axle of its roller and lowest where it touches the ground."""
    for contact in packbot.settings.robot.contacts[-2:]:
        x, _, z = contact.position
        assert np.hypot(x - 0.233, z) == pytest.approx(0.035, abs=1e-5)
        assert np.arctan2(x - 0.233, -z) == pytest.approx(-TOUCHING, abs=1e-4)


def test_mujoco_reads_the_same_masses(packbot: Config) -> None:
    """Total mass and centre of gravity at zero are those of MuJoCo's own URDF reader."""
    text = packbot.urdf_path.read_text(encoding='utf-8')
    # Its compiler drops what is fixed to the world unless told otherwise.
    keep = '<mujoco><compiler fusestatic="false"/></mujoco></robot>'
    model = mujoco.MjModel.from_xml_string(text.replace('</robot>', keep))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    robot = packbot.settings.robot
    assert model.body_mass.sum() == pytest.approx(sum(link.mass for link in robot.links))
    ours = centre_of_gravity(robot, [0, 0, 0, 0], Payload())
    theirs = (model.body_mass[:, None] * data.xipos).sum(axis=0) / model.body_mass.sum()
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9)


def test_every_number_of_the_urdf_has_its_source() -> None:
    """Each mass and length stands under a comment that says where it comes from."""
    text = (Path(__file__).parents[2] / 'urdf' / 'packbot.urdf').read_text(encoding='utf-8')
    lines = text.splitlines()
    for k, line in enumerate(lines):
        if '<mass ' in line or '<inertia ' in line:
            assert '-->' in lines[k - 1] or '-->' in lines[k - 2], f'line {k + 1}: no source'


def test_force_of_a_foreign_robot_at_rest(shared_bags: Path) -> None:
    """The vertical joint arm_3 of abitobot holds 98.0 N, and 137.2 N with 4 kg in the gripper."""
    config = load(Path('abitobot'), urdf=shared_bags / 'abitobot' / 'robot.urdf')
    robot = config.settings.robot
    column = robot.joint_names.index('arm_3_link_joint')
    q = np.zeros(len(robot.joint_names))
    down = (0.0, 0.0, -9.8)
    forces = [static_torque(robot, q, down, Payload(mass))[column] for mass in (0.0, 4.0)]
    assert forces == pytest.approx([98.0, 137.2], rel=1e-9)


@pytest.mark.parametrize('mass', [0.0, 4.0])
def test_recorded_force_of_a_foreign_robot_agrees(shared_bags: Path, mass: float) -> None:
    """At rest, before and after abitobot grasps 4 kg, the median effort of arm_3 is ours."""
    config = load(Path('abitobot'), urdf=shared_bags / 'abitobot' / 'robot.urdf')
    robot = config.settings.robot
    column = robot.joint_names.index('arm_3_link_joint')
    name = config.settings.joints[column].topic_name
    posture = np.zeros(len(robot.joint_names))
    force = static_torque(robot, posture, (0.0, 0.0, -9.8), Payload(mass))[column]
    efforts = []
    with AnyReader([shared_bags / 'abitobot']) as reader:
        topics = [c for c in reader.connections if c.topic == '/joint_states']
        for connection, _, raw in reader.messages(topics):
            message: Any = reader.deserialize(raw, connection.msgtype)
            k = message.name.index(name)
            at_rest = abs(message.velocity[k]) < 1e-3
            if at_rest and abs(message.effort[k] - force) < 2 * 9.8:  # half way to the other mass
                efforts.append(message.effort[k])
    assert len(efforts) > 200
    assert np.median(efforts) == pytest.approx(force, abs=0.1)
