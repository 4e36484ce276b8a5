"""The doctor: what it says of set-ups with one thing wrong each, and of a real one."""

import math
import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from config.robot_files import YAML, write_robot
from nodes.live_case import FOLDED, NAMES, Live, imu, joints
from rclpy.utilities import get_rmw_implementation_identifier
from sensor_msgs.msg import JointState

from ugv_acceptance import BadSample
from ugv_acceptance.bag.cdr import ImuSample, JointStateSample
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.settings import Untold
from ugv_acceptance.inspection.heard import FAIL, OK, WARN, Finding, Heard, Told
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.nodes.doctor.checks import examine
from ugv_acceptance.nodes.doctor.probe import Surroundings

CONFIG = load()
URDF = CONFIG.urdf_text.decode()
MS = 1_000_000
T0 = 1_700_000_000_000 * MS


def joint_state(**changes: Any) -> JointStateSample:
    """Return a sample of a healthy driver, with changes."""
    return JointStateSample(T0, '', NAMES, FOLDED, (), ())._replace(**changes)


def imu_sample(**changes: Any) -> ImuSample:
    """Return a sample of a healthy IMU on a robot that stands level, with changes."""
    up = (0.01, 0.0, 0.0, math.sqrt(1 - 1e-4))
    force = (0.0, 9.81 * 0.02, 9.81)
    return ImuSample(T0, 'imu_link', up, (0.0,) * 3, force, 0.0, 0.0, 0.0)._replace(**changes)


def heard(name: str, kind: str, sample: Any, period: int) -> Heard:
    """Return a hundred messages at a steady rate from one publisher."""
    times = [T0 + k * period for k in range(100)]
    samples = [sample._replace(stamp=sample.stamp + k * period) for k in range(100)]
    return Heard(name, kind, [('/driver', kind, '')], [], times, samples)


def healthy(joint: Any = None, inertial: Any = None) -> Surroundings:
    """Return surroundings in which all is well, but for the samples given."""
    joint_states = heard(
        '/joint_states', 'sensor_msgs/msg/JointState', joint or joint_state(), 5 * MS
    )
    imus = heard('/imu/data', 'sensor_msgs/msg/Imu', inertial or imu_sample(), 2 * MS)
    return Surroundings('jazzy', 'rmw', '0', 'SUBNET', [], 1.0, joint_states, imus)


@pytest.mark.parametrize(
    ('texts', 'obstacle', 'level', 'words'),
    [
        ((), 'nobody', OK, 'compared with nothing'),
        ((URDF,), '', OK, 'is that of'),
        ((URDF.replace('value="1', 'value="2'),), '', FAIL, 'kg in the file'),
        ((BadSample('not UTF-8'),), '', FAIL, 'cannot be read: not UTF-8'),
        ((URDF, f'{URDF} '), 'two publishers', WARN, 'two publishers'),
    ],
)
def test_the_robots_own_description_is_held_against_the_configured_urdf(
    texts: tuple[str | BadSample, ...], obstacle: str, level: str, words: str
) -> None:
    """Whether the robot tells its URDF, and whether that is the one in force."""
    around = replace(healthy(), robot=Told('/robot_description', texts, obstacle))
    (found,) = [f for f in examine(around, CONFIG) if f.about == 'robot_description']
    assert found.level == level
    assert words in found.seen


def findings(around: Surroundings) -> list[Finding]:
    """Return what is not OK."""
    return [found for found in examine(around, CONFIG) if found.level != OK]


def test_a_healthy_set_up_has_no_finding() -> None:
    """Everything is OK, and each check says so."""
    assert findings(healthy()) == []
    assert len(list(examine(healthy(), CONFIG))) >= 9


@pytest.mark.parametrize(
    ('scale', 'words'), [(1.0, ''), (-1.0, 'effort_sign: -1'), (0.12, 'effort_scale'), (0.0, '')]
)
def test_what_an_effort_means_is_told_before_the_test(scale: float, words: str) -> None:
    """Other sign and other unit are warned of, with what to set, from a few seconds at rest."""
    robot, q = CONFIG.settings.robot, (0.0, 0.6, 1.5, 2.0)
    effort = scale * static_torque(robot, q, (0.0, 0.0, -9.81))
    of = dict(zip(robot.joint_names, zip(q, effort.tolist(), strict=True), strict=True))
    position, told_effort = zip(*(of[name] for name in NAMES), strict=True)
    sample = joint_state(position=position, effort=told_effort)
    told = [f for f in findings(healthy(joint=sample)) if f.about.startswith('effort of ')]
    assert bool(told) is bool(words)
    assert all(words in f.do for f in told)
    if words:
        about = {f.about for f in told}
        assert {'effort of shoulder_joint', 'effort of elbow_joint'} <= about


@pytest.mark.parametrize(
    ('change', 'level', 'advice'),
    [
        ({'linear_acceleration': (0.0, 0.0, 1.0)}, FAIL, 'in g'),
        ({'linear_acceleration': (0.0, 0.0, 0.0)}, FAIL, 'gravity was subtracted'),
        ({'linear_acceleration': (0.0, 0.0, -9.81)}, FAIL, 'mounting'),
        ({'linear_acceleration': (9.81, 0.0, 0.0)}, WARN, 'mounting'),
        ({'linear_acceleration': (0.0, 0.0, 12.0)}, FAIL, 'calibrate'),
        ({'angular_velocity': (0.0, 0.0, 1.0)}, WARN, 'still'),
        ({'angular_velocity': (math.nan,) * 3}, WARN, 'still'),
        ({'orientation_covariance_0': -1.0}, WARN, 'attitude'),
        ({'orientation': (0.0, 0.0, 0.0, 1.0)}, WARN, 'attitude'),
        ({'orientation': (0.0, 0.0, 0.0, 0.0)}, FAIL, 'attitude'),
        ({'orientation': (0.5, 0.0, 0.0, 196.0)}, FAIL, 'attitude'),
        ({'orientation': (math.sin(0.4), 0.0, 0.0, math.cos(0.4))}, FAIL, 'axes'),
        ({'frame_id': 'camera_imu'}, WARN, 'mounting'),
        ({'stamp': T0 - 9 * 86400 * 1000 * MS}, WARN, 'synchronise'),
    ],
)
def test_what_is_wrong_with_an_imu_is_named(
    change: dict[str, Any], level: str, advice: str
) -> None:
    """Unit, sign, mounting, orientation, frame, clock: each a line with what to do."""
    found = findings(healthy(inertial=imu_sample(**change)))
    assert [f for f in found if f.level == level and advice in f.do], found


@pytest.mark.parametrize(
    ('change', 'level', 'about', 'advice'),
    [
        ({'names': ('a', 'b', 'c', 'd')}, FAIL, 'joint names', 'topic_name'),
        ({'names': ()}, FAIL, 'joint names', 'no names'),
    ],
)
def test_what_is_wrong_with_joints_is_named(
    change: dict[str, Any], level: str, about: str, advice: str
) -> None:
    """Names that do not fit and positions that cannot be: each a line with what to do."""
    found = findings(healthy(joint=joint_state(**change)))
    assert [f for f in found if (f.level, f.about) == (level, about) and advice in f.do], found


@pytest.mark.parametrize(
    ('change', 'level', 'advice'),
    [
        ({'publishers': [], 'alike': []}, FAIL, 'start its driver'),
        ({'publishers': [], 'alike': ['/arm/joint_states']}, FAIL, 'arm/joint_states'),
        ({'publishers': [('/d', 'std_msgs/msg/String', '')]}, FAIL, 'another topic'),
        ({'publishers': [('/d', 'sensor_msgs/msg/JointState', 'reliability')]}, FAIL, 'qos'),
        ({'publishers': [('/d', 'sensor_msgs/msg/JointState', '')] * 2}, WARN, 'stop'),
        ({'malformed': ['name[0]: needs bytes 8..12']}, FAIL, 'version'),
        ({'times': [T0]}, FAIL, 'driver'),
        ({'times': [T0 + k * 500 * MS for k in range(9)]}, WARN, 'raise the rate'),
        ({'times': [T0 + k * 5 * MS + (k > 50) * 900 * MS for k in range(99)]}, WARN, 'load'),
    ],
)
def test_what_is_wrong_with_a_topic_is_named(
    change: dict[str, Any], level: str, advice: str
) -> None:
    """Absent, of another type, not matching, shared, slow, with gaps: each with what to do."""
    around = healthy()
    assert around.joint_states is not None
    changed = replace(around, joint_states=replace(around.joint_states, **change))
    found = findings(changed)
    assert [f for f in found if f.level == level and advice in f.do], found


@pytest.mark.parametrize(
    ('absent', 'said'), [('imu', 'tip-over is not checked'), ('joint_states', 'no torque is')]
)
def test_an_input_that_is_not_used_is_no_fault(absent: str, said: str) -> None:
    """Of an input that the configuration does without, the doctor says what is not checked."""
    whole = healthy()
    around = replace(whole, imu=None) if absent == 'imu' else replace(whole, joint_states=None)
    assert [f for f in examine(around, CONFIG) if f.level != OK] == []
    (found,) = [f for f in examine(around, CONFIG) if f.about == absent]
    assert said in found.seen


LIFT = YAML.replace('limit_nm: 30', 'limit_nm: 30\n    sign: -1\n    offset_deg: 10')


@pytest.mark.parametrize(
    ('yaml', 'joint', 'told', 'asked'),
    [
        (YAML, 'lift', 45.0, True),
        (YAML, 'lift', -80.0, True),
        (YAML, 'lift', 3.0, True),
        (YAML, 'lift', 180.0, False),  # outside in either unit
        (LIFT, 'lift', -70.0, True),
        (LIFT, 'lift', -100.0, False),
        (YAML, 'slide', 5.0, False),  # m are not degrees
    ],
)
def test_degrees_are_asked_of_a_joint_that_they_would_bring_within_its_limits(
    tmp_path: Path, yaml: str, joint: str, told: float, *, asked: bool
) -> None:
    """Outside its limits a joint FAILs; degrees are asked for only where they would fit."""
    config = load(write_robot(tmp_path, yaml))
    position = {'lift': 0.0, 'slide': 0.0, joint: told}
    sample = joint_state(names=tuple(position), position=tuple(position.values()))
    (found,) = [f for f in examine(healthy(joint=sample), config) if f.about == joint]
    assert found.level == FAIL
    assert 'sign and offset' in found.do
    assert ('degrees' in found.do) is asked


@pytest.mark.parametrize('angle', [3 * math.tau, -3 * math.tau, 114.6, 1e4])
def test_an_upright_endless_joint_may_stand_at_any_angle(angle: float) -> None:
    """A turret at three turns, or many, beside an arm in radians is no sign of degrees."""
    assert findings(healthy(joint=joint_state(position=(angle, *FOLDED[1:])))) == []


@pytest.mark.parametrize('angle', [3 * math.tau, -3 * math.tau, 114.6, 1e4])
@pytest.mark.parametrize('which', range(1, len(NAMES)))
def test_an_arm_beyond_a_full_turn_may_be_told_in_degrees(angle: float, which: int) -> None:
    """Shoulder, elbow and flipper FAIL there, with the unit and the key that takes turns off."""
    position = tuple(angle if k == which else q for k, q in enumerate(FOLDED))
    (found,) = findings(healthy(joint=joint_state(position=position)))
    assert (found.level, found.about) == (FAIL, NAMES[which])
    assert 'degrees instead of radians?' in found.seen
    assert f'joints.{NAMES[which]}.offset_rad' in found.seen


def test_names_with_a_prefix_are_shown_with_the_keys_to_set() -> None:
    """The near match of every joint stands in the advice, and that they share a prefix."""
    names = tuple(f'r1_{name}' for name in NAMES)
    (found,) = findings(healthy(joint=joint_state(names=names, position=FOLDED)))
    assert found.level == FAIL
    assert f'joints.{NAMES[1]}.topic_name: r1_{NAMES[1]}' in found.do
    assert 'all with the prefix r1_' in found.do


@pytest.mark.parametrize(('harmless', 'level'), [(True, WARN), (False, FAIL)])
def test_a_joint_that_is_not_on_the_topic_is_shown_with_the_line_to_enter(
    *, harmless: bool, level: str
) -> None:
    """The line that holds it; only a warning where margins do without it."""
    untold = (Untold(0.0, harmless=harmless), None, None, None)
    config = replace(CONFIG, settings=replace(CONFIG.settings, untold=untold))
    around = healthy(joint=joint_state(names=NAMES[1:], position=FOLDED[1:]))
    (found,) = [f for f in examine(around, config) if f.about == 'joint names']
    assert found.level == level
    assert f'if they do not move: held: {{{NAMES[0]}: 0}}' in found.do


def doctor(*options: str) -> 'subprocess.Popen[str]':
    """Start the verb in a process of its own."""
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    code = 'from ugv_acceptance.cli import main; main()'
    return subprocess.Popen(
        [sys.executable, '-c', code, 'doctor', *options],
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
    )


def test_it_says_that_nobody_publishes() -> None:
    """Without a robot both inputs fail with advice, and the exit code is 1."""
    # DDS still lists publishers of processes that other tests killed, on the usual names.
    process = doctor('--seconds', '0.5', '--ros-args', '-r', '__ns:=/empty')
    text, _ = process.communicate(timeout=60)
    assert process.returncode == 1
    assert 'nobody publishes /empty/joint_states' in text
    assert 'nobody publishes /empty/imu/data' in text


@pytest.mark.parametrize('arguments', [(), ('-r', '__node:=watch'), ('-r', '__ns:=/robot1')])
def test_what_a_monitor_publishes_is_no_input(live: Live, arguments: tuple[str, ...]) -> None:
    """Its margins are JointStates too: they are never what the doctor says to listen to."""
    monitor = live.monitor(arguments=arguments)
    process = doctor('--seconds', '1', '--ros-args', '-r', '__ns:=/nobody')
    live.until(lambda: process.poll() is not None)
    text, _ = process.communicate(timeout=60)
    (line,) = [x for x in text.splitlines() if 'nobody publishes /nobody/joint_states' in x]
    assert 'start its driver' in line, (line, monitor.get_name())


def test_the_robot_is_advised_where_a_monitor_publishes_too(live: Live) -> None:
    """Beside the margins of a monitor, live or played again, the one topic of a driver is named."""
    live.monitor()
    driver = live.driver(namespace='/zoo')
    again = driver.create_publisher(JointState, '/old/acceptance_monitor/stability', 10)
    process = doctor('--seconds', '1', '--ros-args', '-r', '__ns:=/nobody')
    live.until(lambda: process.poll() is not None, driver.send)
    text, _ = process.communicate(timeout=60)
    assert 'topics.joint_states.name: zoo/joint_states' in text
    assert again.topic_name not in text


def test_it_hears_a_real_robot(live: Live) -> None:
    """A driver that sends both inputs is found healthy but for its default orientation."""
    driver = live.driver()
    process = doctor('--seconds', '2')

    def send() -> None:
        driver.joints.publish(joints())
        driver.imu.publish(imu(0.05))

    end = time.monotonic() + 60
    live.until(lambda: process.poll() is not None or time.monotonic() > end, send)
    text, _ = process.communicate(timeout=60)
    assert process.returncode == 0, text
    assert 'OK      joint names: all 4' in text
    assert 'OK      imu gravity' in text
    assert 'OK      imu orientation' in text
    assert f'transport: {get_rmw_implementation_identifier()}: ' in text
    assert 'room for about' in text
    assert f'discovery: ROS_DOMAIN_ID {os.environ.get("ROS_DOMAIN_ID", "0")}, range ' in text
    assert 'middleware' not in text


@pytest.mark.parametrize(
    ('kind', 'seen', 'asked'),
    [(None, 'taken as flat (not entered)', True), ('stairs', 'taken as stairs', False)],
)
def test_it_says_what_the_ground_is_taken_for(kind: str | None, seen: str, asked: bool) -> None:  # noqa: FBT001 - a case
    """Before a run the assumption is told; where nobody entered it, what to set."""
    ground = replace(CONFIG.settings.ground, kind=kind)
    config = replace(CONFIG, settings=replace(CONFIG.settings, ground=ground))
    (found,) = (one for one in examine(healthy(), config) if one.about == 'ground')
    assert (found.level, found.seen) == (OK, seen)
    assert found.do.startswith('set ground.kind') == asked


@pytest.mark.parametrize(
    ('imu', 'frame', 'level', 'words'),
    [
        ({'placed': 'auto'}, 'chassis_link', OK, 'leans 1.1 deg'),
        ({'placed': 'auto'}, 'xsens', WARN, "its frame 'xsens' is no link of the URDF"),
        ({'placed': 'auto'}, '', WARN, 'name no frame'),
        ({'placed': 'unknown'}, 'imu_link', WARN, 'declared as unknown'),
        ({'link': 'arm_link_1'}, 'imu_link', OK, 'which turret_joint, shoulder_joint moves'),
    ],
)
def test_it_says_how_the_imu_is_mounted(
    imu: dict[str, Any], frame: str, level: str, words: str
) -> None:
    """By the frame of its messages, by a link that moves, or that nobody knows."""
    settings = CONFIG.settings
    told = replace(settings, imu=replace(settings.imu, frame='', **imu))
    around = healthy(inertial=imu_sample(frame_id=frame))
    found = [
        f for f in examine(around, replace(CONFIG, settings=told)) if f.about == 'imu mounting'
    ]
    assert [(one.level, words in one.seen) for one in found] == [(level, True)]
