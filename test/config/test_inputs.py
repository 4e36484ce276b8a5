"""Which inputs a robot has: topics that are null, and what must then stand in their place."""

from pathlib import Path

import pytest
from config.robot_files import URDF, YAML, write_robot

from ugv_acceptance import BadConfig
from ugv_acceptance.config import Config, load

NO_IMU = 'topics: {imu: null}\nimu: {attitude: level}\n'
ROVER = YAML.replace('joints:\n  lift:\n    limit_nm: 30\n  slide:\n    limit_n: 100\n', '')
NO_JOINTS = 'topics: {joint_states: null}\nheld: {lift: 30 deg, slide: 0}\n'


def config_of(folder: Path, yaml: str) -> Config:
    """Load a robot's file."""
    return load(write_robot(folder, yaml, URDF))


def test_a_robot_may_have_no_imu(tmp_path: Path) -> None:
    """A null IMU topic with a base declared level is read: no IMU is listened to."""
    config = config_of(tmp_path, YAML + NO_IMU)
    assert (config.settings.hears_imu, config.settings.hears_joints) == (False, True)
    assert list(config.topics.used) == ['joint_states', 'payload']
    assert config.topics.names == ('joint_states', None, 'payload')


def test_a_robot_may_have_no_joint_states(tmp_path: Path) -> None:
    """A null topic of joint states with all joints held is read: the posture is declared."""
    config = config_of(tmp_path, ROVER + NO_JOINTS)
    assert (config.settings.hears_imu, config.settings.hears_joints) == (True, False)
    assert list(config.topics.used) == ['imu', 'payload']
    assert dict(config.settings.robot.held)['lift'] == pytest.approx(0.5236, abs=1e-4)
    assert config.warnings == ()


def test_a_posture_nobody_declared_is_warned_of(tmp_path: Path) -> None:
    """Without joint states, joints that are not under held are held at 0, with a warning."""
    config = config_of(tmp_path, ROVER + 'topics: {joint_states: null}\n')
    assert any('held at 0: lift, slide' in text for text in config.warnings)


def test_by_default_both_inputs_are_used(tmp_path: Path) -> None:
    """A file that says nothing of topics has joint states, IMU and payload."""
    assert list(config_of(tmp_path, YAML).topics.used) == ['joint_states', 'imu', 'payload']


@pytest.mark.parametrize(
    ('yaml', 'words'),
    [
        (YAML + 'topics: {imu: null}\n', r'topics\.imu: expected a topic, or null with imu\.attit'),
        (YAML + 'imu: {attitude: level}\n', r'imu\.attitude: level is for robots without an IMU'),
        (
            YAML + 'topics: {imu: null}\nimu: {attitude: level, specific_force: true}\n',
            r'imu\.specific_force: expected false',
        ),
        (
            YAML + 'topics: {joint_states: null}\n',
            r'topics\.joint_states: .*under held; got null with lift, slide under joints',
        ),
        (
            ROVER + 'topics: {joint_states: null, imu: null}\nimu: {attitude: level}\n',
            r'topics: expected joint states or an IMU',
        ),
        (YAML + 'topics: {payload: null}\n', r'topics\.payload'),
        (YAML + 'imu: {attitude: flat}\n', r"imu\.attitude: expected .*'level', got"),
        (YAML + 'imu: {noise_free: 1}\n', r'imu\.noise_free: expected a valid boolean'),
        (YAML.replace('mass_kg: 1}', 'mass_kg: 1, known: "yes"}'), r'payload\.known: expected'),
    ],
)
def test_half_a_declaration_is_refused_by_its_field(tmp_path: Path, yaml: str, words: str) -> None:
    """What contradicts itself is refused with file, line, field, and what was expected."""
    with pytest.raises(BadConfig, match=rf'two\.yaml:\d+: {words}'):
        config_of(tmp_path, yaml)


@pytest.mark.parametrize('known', [True, False])
def test_a_load_may_be_declared_as_known(tmp_path: Path, known: bool) -> None:  # noqa: FBT001
    """`payload.known` says that the load is carried from the start; by default it does not."""
    yaml = YAML.replace('mass_kg: 1}', f'mass_kg: 1, known: {str(known).lower()}}}')
    assert config_of(tmp_path, yaml).settings.payload_known is known
    assert config_of(tmp_path, YAML).settings.payload_known is False


@pytest.mark.parametrize('clean', [True, False])
def test_an_imu_may_be_declared_free_of_noise(tmp_path: Path, clean: bool) -> None:  # noqa: FBT001
    """`imu.noise_free` says that equal readings are no fault; by default it does not."""
    yaml = YAML + f'imu: {{noise_free: {str(clean).lower()}}}\n'
    assert config_of(tmp_path, yaml).settings.imu.noise_free is clean
    assert config_of(tmp_path, YAML).settings.imu.noise_free is False


@pytest.mark.parametrize(
    ('frame', 'warned'), [('hand', False), ('/r1/hand', False), ('tool0', True), ('null', False)]
)
def test_a_payload_frame_that_cannot_be_is_warned_of(
    tmp_path: Path,
    frame: str,
    warned: bool,  # noqa: FBT001
) -> None:
    """A frame of the payload topic that is not the payload link makes every load unusable."""
    yaml = YAML + f'topics: {{payload: {{name: payload, frame_id: {frame}}}}}\n'
    found = [text for text in config_of(tmp_path, yaml).warnings if 'payload link' in text]
    assert bool(found) is warned
