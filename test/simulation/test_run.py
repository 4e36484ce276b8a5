"""Simulated runs: messages agree with the robot's motion, and a seed gives the same bits."""

import math
from dataclasses import fields, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ugv_acceptance import BadConfig
from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.simulation import shape
from ugv_acceptance.simulation.poses import STOWED
from ugv_acceptance.simulation.scenario import Command, Noise, Recording, Scenario
from ugv_acceptance.simulation.scenarios import SCENARIOS
from ugv_acceptance.simulation.simulation import BUILD, Simulation
from ugv_acceptance.simulation.stretches import run
from ugv_acceptance.simulation.tip_cases import least_angle

EXACT = Noise(**{f.name: 1e-12 if f.name.endswith('step') else 0.0 for f in fields(Noise)})
TILT = np.radians(12.0)
RIGHT = -np.pi / 2


@pytest.fixture(scope='module')
def robot() -> Robot:
    """Return PackBot."""
    return load().settings.robot


@pytest.fixture(scope='module')
def overreach(robot: Robot) -> Recording:
    """Return the run that tips, with perfect sensors."""
    return run(robot, replace(SCENARIOS['overreach'](), noise=EXACT), seed=0)


def still(duration: float = 0.5, **changes: Any) -> Scenario:
    """Return a robot that stands with its arm out a little and 1 kg in the hand."""
    start = (*STOWED[:1], ('shoulder_joint', 0.8), ('elbow_joint', -0.4))
    scenario = Scenario('still', duration, start, payload=Payload(1.0), noise=EXACT)
    return replace(scenario, **changes)


def test_effort_at_rest_is_the_static_torque(robot: Robot) -> None:
    """Motors of a robot at rest on a side slope give the torque that statics says."""
    found = run(robot, still(slope=(TILT, RIGHT)), seed=0)
    down = (0.0, -9.81 * np.sin(TILT), -9.81 * np.cos(TILT))
    ours = static_torque(robot, found.joints.position, down, Payload(1.0))
    np.testing.assert_allclose(found.joints.effort, ours, rtol=0, atol=0.05)


def test_imu_at_rest_on_the_level(robot: Robot) -> None:
    """REP-145: at rest the accelerometer reads +g upward, the gyro zero, the attitude level."""
    imu = run(robot, still(), seed=0).imu
    np.testing.assert_allclose(imu.linear_acceleration - [0.0, 0.0, 9.81], 0.0, atol=0.02)
    np.testing.assert_allclose(imu.angular_velocity, 0.0, atol=0.01)
    np.testing.assert_allclose(imu.orientation - [0.0, 0.0, 0.0, 1.0], 0.0, atol=1e-4)


def test_imu_on_a_side_slope(robot: Robot) -> None:
    """Right side down is a positive roll (REP-103), and the accelerometer tells the same."""
    imu = run(robot, still(slope=(TILT, RIGHT)), seed=0).imu
    roll, pitch, _ = Rotation.from_quat(imu.orientation[-1]).as_euler('xyz')
    np.testing.assert_allclose([roll, pitch], [TILT, 0.0], rtol=0, atol=1e-3)
    up = Rotation.from_quat(imu.orientation).inv().apply([0.0, 0.0, 9.81])
    np.testing.assert_allclose(imu.linear_acceleration, up, rtol=0, atol=0.03)


def test_imu_mounted_upside_down(robot: Robot) -> None:
    """The IMU's mounting turns its axes: upside down it reads -g along its z."""
    flipped = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
    imu = run(robot, still(), 0, replace(BUILD, imu_rotation=flipped)).imu
    np.testing.assert_allclose(imu.linear_acceleration[-1], [0.0, 0.0, -9.81], atol=0.02)
    level = Rotation.from_quat(imu.orientation[-1]).as_matrix()
    np.testing.assert_allclose(level, flipped, rtol=0, atol=1e-3)


def test_gyro_is_the_rate_of_the_orientation(robot: Robot) -> None:
    """While the ground tilts, the orientation turns as fast as the ground."""
    tilting = still(4.0, commands=(Command(0.5, slope=(TILT, RIGHT), slope_rate=0.1),))
    imu = run(robot, tilting, seed=0).imu
    roll = Rotation.from_quat(imu.orientation).as_euler('xyz')[:, 0]
    assert roll[-1] == pytest.approx(TILT, abs=2e-3)
    rate = np.gradient(roll, imu.stamp)
    assert rate.max() == pytest.approx(0.1, abs=0.02)


def test_rates_and_stamps(robot: Robot) -> None:
    """Joints come at 200 Hz and the IMU at 400 Hz, from 0 to the end."""
    found = run(robot, still(0.5), seed=0)
    np.testing.assert_allclose(found.joints.stamp, np.arange(101) / 200, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.imu.stamp, np.arange(201) / 400, rtol=0, atol=1e-12)


def test_the_same_seed_gives_the_same_bits(robot: Robot) -> None:
    """Two runs of a seed are equal in every bit; another seed's noise differs."""
    scenario = replace(SCENARIOS['overreach'](), duration=3.0)
    first, again, other = (run(robot, scenario, seed) for seed in (1, 1, 2))
    for log in ('joints', 'imu', 'truth'):
        for field in fields(getattr(first, log)):
            one, two = (getattr(getattr(r, log), field.name) for r in (first, again))
            assert one.tobytes() == two.tobytes(), field.name
    assert not np.array_equal(first.joints.effort, other.joints.effort)


def test_noise_is_as_large_as_told(robot: Robot) -> None:
    """At rest the samples scatter by the standard deviations of the noise."""
    noise = Noise()
    found = run(robot, still(3.0, noise=noise), seed=5)
    assert found.joints.effort.std(axis=0) == pytest.approx(noise.effort, rel=0.2)
    rate = found.imu.angular_velocity.std(axis=0)
    assert rate == pytest.approx(noise.gyro, rel=0.2)


def test_a_motor_gives_no_more_than_its_limit(robot: Robot, overreach: Recording) -> None:
    """Reaching out with 4 kg the shoulder saturates at 50 N m and sinks; it never gives more."""
    shoulder = robot.joint_names.index('shoulder_joint')
    effort = np.abs(overreach.joints.effort[:, shoulder])
    assert effort.max() == pytest.approx(50.0, abs=1e-6)
    assert 1.0 < overreach.truth.saturated[:, shoulder].mean() * overreach.scenario.duration < 6.0


def test_it_tips_after_the_static_margin_is_gone(robot: Robot, overreach: Recording) -> None:
    """The run that reaches out downhill tips to the right within a second of zero margin."""
    joints, ratio = overreach.joints, 2
    attitude = Rotation.from_quat(overreach.imu.orientation[::ratio])
    down = attitude.inv().apply([0.0, 0.0, -9.81])
    loaded = joints.stamp > overreach.payload[-1][0]
    left = least_angle(robot, joints.position[loaded], down[loaded], Payload(4.0))
    gone = joints.stamp[loaded][np.argmax(left < 0.0)]
    assert 0.0 < overreach.truth.tipped_at - gone < 1.0
    assert np.degrees(overreach.truth.lean[-1]) > 15.0


def test_a_gentle_run_does_not_tip_or_saturate(robot: Robot) -> None:
    """The gentle scenario keeps its stance, drives 0.35 m and never saturates."""
    found = run(robot, SCENARIOS['gentle'](), seed=0)
    assert found.truth.tipped_at == np.inf
    assert not found.truth.saturated.any()
    assert found.truth.lean.max() < np.radians(0.2)
    assert found.truth.position[-1, 0] == pytest.approx(0.375, abs=0.03)


def test_a_payload_taken_and_dropped(robot: Robot) -> None:
    """Effort rises when a load is taken and falls back when it is dropped."""
    commands = (Command(1.0, payload=Payload(3.0)), Command(3.0, payload=Payload(0.0)))
    found = run(robot, still(5.0, payload=Payload(0.0), commands=commands), seed=0)
    shoulder = found.joints.effort[:, robot.joint_names.index('shoulder_joint')]
    before, loaded, after = (shoulder[found.joints.stamp.searchsorted(t)] for t in (0.9, 2.9, 4.9))
    assert loaded - before > 15.0
    assert after == pytest.approx(before, abs=0.1)
    assert [time for time, _ in found.payload] == [0.0, 1.0, 3.0]


def test_it_turns_left_on_a_positive_yaw_rate(robot: Robot) -> None:
    """REP-103: a positive yaw rate turns the robot from x towards y."""
    found = run(robot, still(2.0, commands=(Command(0.0, drive=(0.0, 0.5)),)), seed=0)
    yaw = Rotation.from_quat(found.imu.orientation[-1]).as_euler('xyz')[2]
    assert 0.1 < yaw < 1.2


@pytest.mark.parametrize('drive', [(0.0, 0.5), (0.3, 0.0), (0.2, -0.4)])
def test_a_drive_does_not_shake_the_imu(robot: Robot, drive: tuple[float, float]) -> None:
    """Turning on the spot or driving and braking, the accelerometer stays within 5 m/s2 of g."""
    commands = (Command(0.2, drive=drive), Command(2.2, drive=(0.0, 0.0)))
    force = run(robot, still(4.0, commands=commands), seed=0).imu.linear_acceleration
    assert np.abs(np.linalg.norm(force, axis=1) - 9.81).max() < 5.0


@pytest.mark.parametrize('heading', [0.0, np.pi / 2, np.pi])
def test_brakes_hold_on_a_slope(robot: Robot, heading: float) -> None:
    """On 24 degrees, down any way, it creeps less than 1 mm in five seconds."""
    at = run(robot, replace(still(6.0), slope=(np.radians(24.0), heading)), 0).truth
    crept = at.position[-1] - at.position[at.stamp.searchsorted(1.0)]
    assert np.linalg.norm(crept) < 1e-3


def test_a_brake_stops_what_drives_down_a_slope(robot: Robot) -> None:
    """Told to stop on 15 degrees down, it stands within a few centimetres, and stays."""
    commands = (Command(0.2, drive=(0.3, 0.0)), Command(2.2, drive=(0.0, 0.0)))
    sloped = replace(still(5.0, commands=commands), slope=(np.radians(15.0), 0.0))
    truth = run(robot, sloped, 0).truth
    x = truth.position[:, 0]
    assert x[-1] - x[truth.stamp.searchsorted(2.2)] < 0.15
    assert x[-1] - x[truth.stamp.searchsorted(3.2)] < 1e-3


@pytest.mark.parametrize(
    ('blocks', 'height', 'lean'),
    [
        ((shape.step(0.6, 0.06),), 0.06, 14.0),
        (shape.stairs(0.6, 0.06, 0.3, 3), 0.18, 14.0),
        (shape.ramp(0.6, np.radians(12.0), 1.0), np.sin(np.radians(12.0)), 12.5),
    ],
)
def test_it_climbs_what_lies_ahead(
    robot: Robot, blocks: tuple[shape.Block, ...], height: float, lean: float
) -> None:
    """Its wheels end as high as the obstacle says; on the way it leans as far and no further."""
    commands = (Command(0.2, drive=(0.25, 0.0)),)
    climbing = replace(still(7.5, payload=Payload(0.0), commands=commands), blocks=blocks)
    truth = run(robot, replace(climbing, start=STOWED), seed=0).truth
    assert truth.position[:, 2].max() == pytest.approx(height, abs=0.02)
    assert 0.5 * lean < np.degrees(truth.lean.max()) < lean + 1.0


def test_what_blocks_explain_is_no_lean(robot: Robot) -> None:
    """A ramp of 16 degrees is above the 15 that count as tipped; its robot has not tipped."""
    ramp = shape.ramp(0.5, np.radians(16.0))
    drive = (Command(0.2, drive=(0.3, 0.0)),)
    climbing = replace(still(5.0, commands=drive), blocks=ramp, lean=np.radians(16.5))
    found = run(robot, climbing, seed=0)
    assert found.truth.position[-1, 2] > 0.1
    assert found.truth.tipped_at == np.inf


def test_a_load_lifted_off_the_ground_comes_gradually(robot: Robot) -> None:
    """Over a second the hand bears more and more, and the shoulder gives more and more."""
    lift = Command(1.0, payload=Payload(3.0), payload_time=1.0)
    found = run(robot, still(3.0, payload=Payload(0.0), commands=(lift,)), seed=0)
    at = found.truth.stamp.searchsorted([0.9, 1.5, 2.2])
    assert found.truth.load[at] == pytest.approx([0.0, 1.5, 3.0], abs=0.03)
    effort = found.joints.effort[at, robot.joint_names.index('shoulder_joint')]
    assert effort[1] - effort[0] == pytest.approx(effort[2] - effort[1], rel=0.15)
    assert effort[2] - effort[0] > 15.0


def test_the_imu_integrates_between_samples(robot: Robot) -> None:
    """The specific force is the change of velocity over the period, whatever rattles in between."""
    simulation = Simulation(robot, STOWED, (0.0, 0.0), Payload(0.0))
    simulation.apply(Command(0.0, drive=(0.5, 0.0), drive_rate=2.0))
    felt = []
    for _ in range(100):
        simulation.advance(0.01)
        felt.append(simulation.imu()[2][0])
    assert sum(felt) * 0.01 == pytest.approx(0.5, abs=0.02)


def test_an_unknown_joint_is_refused(robot: Robot) -> None:
    """A command that names no joint of the robot says which there are."""
    with pytest.raises(BadConfig, match=r"expected a joint of .*'wrist'"):
        Simulation(robot).apply(Command(0.0, joints=(('wrist', 1.0),)))


@pytest.mark.parametrize(('joint_rate', 'imu_rate'), [(150.0, 400.0), (200.0, 333.0)])
def test_rates_that_do_not_fit_are_refused(
    robot: Robot, joint_rate: float, imu_rate: float
) -> None:
    """The joints' rate divides the IMU's, and the IMU's period is a multiple of the time step."""
    with pytest.raises(BadConfig, match='expected'):
        run(robot, still(joint_rate=joint_rate, imu_rate=imu_rate), seed=0)


def test_the_gyro_feels_ground_that_tilts() -> None:
    """The rate is that of the orientation's own change, by another library's rotations."""
    simulation = Simulation(load().settings.robot)
    simulation.apply(Command(0.0, slope=(math.radians(20.0), 0.7), slope_rate=0.4))
    turned, felt, step = [], [], 0.01
    for _ in range(60):
        orientation, rate, _ = simulation.imu()
        turned.append(Rotation.from_quat(orientation))
        felt.append(rate)
        simulation.advance(step)
    steps = [(a.inv() * b).as_rotvec() / step for a, b in pairwise(turned)]
    middle = (np.array(felt[:-1]) + np.array(felt[1:])) / 2.0
    assert np.abs(np.array(steps)).max() > 0.3
    assert np.abs(np.array(steps) - middle).max() < 0.02
