"""`doctor RECORDING`: the checks of a live set-up on a recording, with what to do."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from cases.base import base
from cases.table import MADE
from cli.here import ugv
from made.run import messages_of, write

from ugv_acceptance.bag.recording import open_recording
from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.config import load
from ugv_acceptance.inspection.heard import FAIL, OK, WARN, Finding
from ugv_acceptance.inspection.recorded import examine_recording

CONFIG = load()
PASSING = Path(__file__).parents[2] / 'bags' / 'packbot_pass'


def findings(path: Path) -> tuple[Finding, ...]:
    """Return what is found in a recording of PackBot."""
    return examine_recording(open_recording(path), CONFIG).findings


def test_a_good_recording_has_no_finding() -> None:
    """Every check of the live doctor that numbers allow is made, and is OK."""
    found = findings(PASSING)
    assert {one.level for one in found} == {OK}
    about = {one.about for one in found}
    checks = ('joint names', 'joint_states clock', 'imu gravity', 'imu mounting')
    assert about >= {*checks, 'recording', 'robot_description', 'imu orientation', 'ground'}


# Case -> level, subject and words (a regular expression) of a line that must be there.
TOLD = {
    'cdr_truncated_some': (FAIL, 'joint_states', '10 messages cannot be decoded'),
    'clock_offset_topics': (WARN, 'imu clock', r'stamps are \d\.\d s before receipt'),
    'degrees': (FAIL, 'elbow_joint', 'degrees instead of radians'),
    'dynamic_joint_states_only': (FAIL, 'joint_states', 'DynamicJointState'),
    'effort_currents': (WARN, 'effort of elbow_joint', 'effort_scale'),
    'effort_sign_flipped': (WARN, 'effort of elbow_joint', 'effort_sign: -1'),
    'gravity_removed': (FAIL, 'imu gravity', 'gravity was subtracted'),
    'gyro_deg_hides_wrong_orientation': (FAIL, 'imu IMU_CONTRADICTION', 'contradicts'),
    'imu_dropout': (WARN, 'imu INPUT_STALE', 'no message from imu'),
    'imu_in_g': (FAIL, 'imu gravity', 'it is in g'),
    'imu_nan_orientation': (WARN, 'imu IMU_ORIENTATION', 'orientation of imu is invalid'),
    'imu_ned_flat': (FAIL, 'imu mounting', 'upside down'),
    'imu_raw_and_filtered': (FAIL, 'imu', r'topics\.imu\.name'),
    'imu_two_publishers': (WARN, 'imu frame', 'mast_imu'),
    'joint_jump_homing': (WARN, 'joint positions', 'homed'),
    'log_time_backwards': (WARN, 'imu', 'log times .* go back'),
    'names_empty_positions': (FAIL, 'joint_states', 'the names are empty'),
    'no_imu': (FAIL, 'imu', 'record a topic of type sensor_msgs/msg/Imu'),
    'position_nan_start': (FAIL, 'joint_states INPUT_INVALID', 'not a number'),
    'prefixed_names': (FAIL, 'joint names', 'with the prefix bot7_'),
    'quaternion_degrees': (FAIL, 'imu orientation', 'norm'),
    'rate_mismatch_2hz': (WARN, 'joint_states', 'raise the rate'),
    'renamed_file': (WARN, 'recording', 'monday_0.mcap'),
    'stamp_zero': (WARN, 'joint_states clock', 'all zero'),
    'velocity_units': (WARN, 'reported velocity of .*', '57'),
}


@pytest.mark.parametrize('name', list(TOLD))
def test_the_fault_of_an_input_is_named(name: str, tmp_path: Path) -> None:
    """Unit, sign, frame, names, rate, clock: a line with the level, the subject, what to do."""
    level, about, words = TOLD[name]
    found = findings(MADE[name].recording(tmp_path))
    lines = [one for one in found if one.level == level and re.fullmatch(about, one.about)]
    assert [one for one in lines if re.search(words, f'{one.seen} -> {one.do}')], found


@pytest.mark.parametrize(
    'name', ['imu_frame_slash', 'namespaced_topics', 'two_publishers_prefixed']
)
def test_what_is_no_fault_is_not_called_one(name: str, tmp_path: Path) -> None:
    """A slash before the frame, a namespace, names of others: every line is OK."""
    assert {one.level for one in findings(MADE[name].recording(tmp_path))} == {OK}


def test_gravity_is_judged_where_the_robot_stands_still(tmp_path: Path) -> None:
    """The robot turns all the time but for two seconds: those are looked at, no others."""
    made = base()
    still = slice(400, 600)
    rate, force = made.imu.rate + 1.0, made.imu.force * 3.0
    rate[still], force[still] = 0.0, made.imu.force[still]
    moving = made.imu.with_values(made.imu.orientation, rate, force)
    found = findings(write(tmp_path / 'run.mcap', messages_of([made.joints, moving])))
    assert [one.level for one in found if one.about == 'imu gravity'] == [OK]


def test_a_robot_that_never_stands_still_is_told(tmp_path: Path) -> None:
    """Gravity cannot be judged then: a warning that says what to record, and no guess."""
    made = base()
    moving = made.imu.with_values(made.imu.orientation, made.imu.rate + 1.0, made.imu.force)
    found = findings(write(tmp_path / 'run.mcap', messages_of([made.joints, moving])))
    assert [one.do for one in found if one.about == 'imu' and one.level == WARN]
    assert not [one for one in found if one.about == 'imu gravity']


def test_efforts_are_not_judged_by_a_gravity_that_is_not_known(tmp_path: Path) -> None:
    """An IMU upside down turns the static torques round: no sign of an effort follows from it."""
    found = findings(MADE['imu_ned_flat'].recording(tmp_path))
    assert not [one for one in found if one.about.startswith('effort of ')]


def test_the_recorded_quality_of_service_is_checked(tmp_path: Path) -> None:
    """A driver offered best effort where the configuration asks for reliable: no monitor hears."""
    path = tmp_path / 'run'
    with BagWriter(path) as bag:
        for message in base(imu_hz=50).messages():
            bag.add_topic(message.topic, message.type, Qos('best_effort'))
            bag.write(message.topic, message.log, message.data)
    topics = replace(CONFIG.topics, imu=replace(CONFIG.topics.imu, reliability='reliable'))
    config = replace(CONFIG, topics=topics)
    found = examine_recording(open_recording(path), config).findings
    (one,) = [one for one in found if 'QoS as recorded' in one.seen]
    assert (one.level, one.about) == (WARN, 'imu')


def test_the_verb_checks_a_recording_without_ros(tmp_path: Path) -> None:
    """0 where no check fails, 1 where one does, 2 where it cannot be read; the sum comes twice."""
    done = ugv('doctor', PASSING)
    assert done.returncode == 0
    lines = done.stdout.splitlines()
    assert lines[0] == lines[-1]
    assert '0 failed' in lines[0]
    bad = write(tmp_path / 'bad.mcap', base().messages()[:3])
    assert ugv('doctor', bad).returncode == 1
    nothing = ugv('doctor', tmp_path / 'none.mcap')
    assert (nothing.returncode, nothing.stderr.count('\n')) == (2, 1)


def test_a_truncated_recording_fails(tmp_path: Path) -> None:
    """The first line about it says where it breaks off, and how a recorder is ended."""
    path = tmp_path / 'cut.mcap'
    path.write_bytes((PASSING / 'packbot_pass_0.mcap').read_bytes()[:300_000])
    (one,) = [f for f in findings(path) if f.about == 'recording' and f.level == FAIL]
    assert 'truncated' in one.seen
    assert 'Ctrl-C' in one.do
