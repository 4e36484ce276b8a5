"""Simulated runs of robots of other makes, from their files to the verdict of `evaluate`."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from foreign_robots import arm_on_wheels, rover, tracks_and_flippers, walker, write_robot
from robots import paper_arm

from ugv_acceptance import BadConfig
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.offline.evaluate import evaluate
from ugv_acceptance.offline.evaluation import Evaluation
from ugv_acceptance.run.catalogue import NEEDS_ARM, NEEDS_LOAD, case_of
from ugv_acceptance.run.fault_text import fault_from
from ugv_acceptance.run.record import Outcome, real_robot, record
from ugv_acceptance.run.simulated_robot import VirtualRobot

each_robot = pytest.mark.parametrize('made', [rover, arm_on_wheels, tracks_and_flippers])


class Run(NamedTuple):
    """A simulated run: its recording, what really happened, and its evaluation."""

    folder: Path
    truth: Outcome
    found: Evaluation


def simulated(folder: Path, robot: Robot, name: str, seconds: float | None = None) -> Run:
    """Record and evaluate a run of a robot from its files."""
    config = load(write_robot(folder, robot))
    case = case_of(name, config.settings.robot, 1, seconds)
    truth = record(config, case, 1, folder / 'run')
    return Run(folder / 'run', truth, evaluate(folder / 'run', config=config))


@each_robot
def test_gentle_passes(tmp_path: Path, made: Callable[[], Robot]) -> None:
    """Quiet work of any robot keeps every margin: it passes, and no alarm is raised."""
    run = simulated(tmp_path, made(), 'gentle', seconds=18.0)
    assert run.truth.tipped_at == np.inf
    assert run.found.verdict == 'PASS', run.found.reasons
    assert [alert for alert in run.found.alerts if alert.level == 'ERROR'] == []
    assert run.found.coverage > 0.99


@each_robot
def test_a_robot_that_tips_is_warned_of_before(tmp_path: Path, made: Callable[[], Robot]) -> None:
    """On ground that tilts, tip-over is alarmed before the simulated robot falls."""
    robot = made()
    high = (0.0, 0.0, 0.6)
    tall = tuple(replace(k, cog=high) if k.name in {'chassis', 'hull'} else k for k in robot.links)
    run = simulated(tmp_path, replace(robot, links=tall), 'tilt')
    assert run.truth.tipped_at < np.inf
    first = min(alert.start_s for alert in run.found.alerts if alert.code == 'TIP_OVER')
    assert first < run.truth.tipped_at
    assert run.found.verdict == 'FAIL'


def test_overreach_saturates_and_fails(tmp_path: Path) -> None:
    """The motor that is overloaded in the simulation is the one that the evaluation names."""
    run = simulated(tmp_path, tracks_and_flippers(), 'overreach', seconds=13.0)
    assert run.truth.saturated_at
    assert run.found.verdict == 'FAIL'
    told = {alert.subject for alert in run.found.alerts if alert.code == 'TORQUE_LIMIT'}
    assert {*run.truth.saturated_at} & told


def test_a_run_is_recorded_on_the_robots_topics(tmp_path: Path) -> None:
    """Topics are those of its configuration, and the URDF; without a payload link no load."""
    for robot, topics in (
        (rover(), {'/drives/state', '/sensors/imu'}),
        (arm_on_wheels(), {'/drives/state', '/sensors/imu', '/load'}),
        (rover(measured=False), {'/sensors/imu'}),
    ):
        folder = tmp_path / f'{len(topics)}'
        folder.mkdir()
        run = simulated(folder, robot, 'gentle', seconds=1.0)
        assert {*open_bag(run.folder).topics} == topics | {'/robot_description'}


@pytest.mark.parametrize('name', NEEDS_ARM)
def test_what_needs_an_arm_says_so(name: str) -> None:
    """A rover is told in one line why it cannot."""
    with pytest.raises(BadConfig, match=f'^{name} needs an arm that lifts; rover has none$'):
        case_of(name, rover(), 1, None)


@pytest.mark.parametrize('name', NEEDS_LOAD)
def test_what_needs_a_load_says_so(name: str) -> None:
    """An arm without a payload link cannot grasp."""
    robot = replace(arm_on_wheels(), payload_link=None, payload=Payload())
    with pytest.raises(BadConfig, match=rf'^{name} needs payload\.link in the configuration'):
        case_of(name, robot, 1, None)


@pytest.mark.parametrize(
    ('robot', 'why'),
    [
        (walker(), 'it walks on legs'),
        (paper_arm(), 'it is an arm without contact points on the ground'),
        (replace(rover(), contacts=()), 'it has no contact points on the ground'),
    ],
)
def test_what_does_not_drive_is_not_simulated(robot: Robot, why: str) -> None:
    """Legs, arms alone and what stands on nothing are refused in one line."""
    with pytest.raises(BadConfig, match=f'expected a robot on wheels or tracks.*{why}'):
        case_of('gentle', robot, 1, None)


def test_a_fault_of_a_joint_is_at_the_arm() -> None:
    """The joint of fault-frozen-encoder is the arm's last axis, a rover's the last wheel."""
    for robot, joint in ((arm_on_wheels(), 'j3'), (rover(), 'rear_right_axle')):
        (fault,) = case_of('fault-frozen-encoder', robot, 1, None).faults
        assert fault.subject == joint
    with pytest.raises(BadConfig, match='needs a joint whose position a message tells'):
        case_of('fault-frozen-encoder', rover(measured=False), 1, None)


@pytest.mark.parametrize('name', ['arm.1_link-joint', 'front/left wheel', 'joint:2'])
def test_a_fault_names_a_joint_of_any_name(name: str) -> None:
    """Joints of other makes have points, dashes and slashes in their names."""
    robot = arm_on_wheels()
    joints = tuple(replace(j, name=name) if j.name == 'j3' else j for j in robot.joints)
    names = tuple(name if n == 'j3' else n for n in robot.joint_names)
    robot = replace(robot, joints=joints, joint_names=names)
    fault = fault_from(f'frozen-encoder:{name}@5-9', robot)
    assert (fault.subject, fault.start, fault.end) == (name, 5.0, 9.0)
    assert fault_from(f'weak-motor:{name}=0.5', robot).amount == 0.5


def test_motors_are_as_strong_as_configured(tmp_path: Path) -> None:
    """A limit in the configuration is that of the simulated motor; without one the URDF's is."""
    path = write_robot(tmp_path, arm_on_wheels())
    told = path.read_text(encoding='utf-8').replace('  j2: {}', '  j2: {limit_nm: 30}')
    path.write_text(told, encoding='utf-8')
    robot = real_robot(load(path))
    assert [robot.joint(n).effort for n in ('j2', 'j3')] == [30.0, 80.0]


def test_a_robot_under_live_commands_starts_folded_and_drives(tmp_path: Path) -> None:
    """The robot of the simulator's node is any: its arm is folded, it obeys drive commands."""
    config = load(write_robot(tmp_path, arm_on_wheels()))
    virtual = VirtualRobot(config)
    position, _, _ = virtual.remote.simulation.joints()
    start = dict(zip(config.settings.robot.joint_names, position.tolist(), strict=True))
    assert any(abs(at) > 0.5 for at in start.values())
    virtual.remote.drive(0.4, 0.0)
    for _ in range(80):
        virtual.step()
    assert virtual.remote.simulation.base()[0][0] > 0.05
    sent = [source for source, _ in virtual.due()]
    assert {*sent} == {'joint_states', 'imu'}


def test_a_robot_that_stands_still_under_live_commands_is_refused(tmp_path: Path) -> None:
    """One on legs is refused before anything is simulated."""
    config = load(write_robot(tmp_path, walker()))
    with pytest.raises(BadConfig, match='it walks on legs'):
        VirtualRobot(config)
