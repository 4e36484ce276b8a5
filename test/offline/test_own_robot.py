"""The robot's own description in a recording, and recordings of robots that nobody configured."""

import hashlib
import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cases.base import base
from cli.here import ugv as command
from made.run import EPOCH, IMU, JOINT_STATE, NS, Message, write

import ugv_acceptance as ugv
from ugv_acceptance.bag.encode import string_message
from ugv_acceptance.config.criteria import load_criteria

STRING = 'std_msgs/msg/String'
MASS = re.compile(r'(<link name="chassis_link">.*?<mass value=")([0-9.]+)', re.DOTALL)


@pytest.fixture(scope='module')
def urdf(repository: Path) -> str:
    """Return the URDF that ships."""
    return (repository / 'urdf' / 'packbot.urdf').read_text('utf-8')


@pytest.fixture(scope='module')
def bare(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the configuration that ships, without the URDF that it names."""
    text = (repository / 'msg_configs' / 'packbot.yaml').read_text('utf-8')
    path = tmp_path_factory.mktemp('bare') / 'robot.yaml'
    path.write_text(re.sub(r'(?m)^urdf:.*$', '', text), 'utf-8')
    return path


def heavier(urdf: str, by: float = 2.0) -> str:
    """Return a URDF with a chassis that is heavier (kg)."""
    return MASS.sub(lambda found: f'{found[1]}{float(found[2]) + by:g}', urdf)


def mass_of(urdf: str) -> str:
    """Return the mass of the chassis as it stands in a URDF."""
    found = MASS.search(urdf)
    assert found is not None
    return f'{float(found[2]):g}'


def told(*texts: str | bytes, topic: str = '/robot_description') -> list[Message]:
    """Return messages of descriptions, one each second; bytes are a message as it is."""
    return [
        Message(EPOCH + k * NS, topic, STRING, string_message(t) if isinstance(t, str) else t)
        for k, t in enumerate(texts)
    ]


def run(folder: Path, more: Sequence[Message] = (), names: tuple[str, ...] | None = None) -> Path:
    """Write a good run with more messages, or with joints of other names."""
    made = base()
    if names is not None:
        made = replace(made, joints=replace(made.joints, names=names))
    messages = sorted([*made.messages(), *more], key=lambda message: message.log)
    return write(folder / 'run.mcap', messages)


def test_a_recorded_description_that_is_the_configured_one_is_no_objection(
    tmp_path: Path, urdf: str
) -> None:
    """Comments and spaces do not count; the result tells the hash and the source of the URDF."""
    found = ugv.evaluate(run(tmp_path, told(urdf + '<!-- as published -->\n')))
    robot = found.result['robot']
    assert found.verdict == 'PASS'
    assert robot['description'] == 'file'
    assert robot['urdf_sha256'] == hashlib.sha256(urdf.encode()).hexdigest()


def test_a_recorded_description_that_differs_is_no_pass(tmp_path: Path, urdf: str) -> None:
    """It is INCONCLUSIVE, and the reason names the part and both values."""
    found = ugv.evaluate(run(tmp_path, told(heavier(urdf))))
    own = mass_of(urdf)
    assert found.verdict == 'INCONCLUSIVE'
    assert found.reasons[0] == (
        'CONFIG_DIFFERS: the URDF in force is not that on /robot_description: link '
        f'chassis_link: mass {own} kg in the file, {float(own) + 2:g} kg on the robot'
    )


def test_criteria_can_waive_the_difference_with_a_reason(tmp_path: Path, urdf: str) -> None:
    """A robot that is described more simply on purpose can still pass; the reason is told."""
    criteria = tmp_path / 'site.yaml'
    criteria.write_text(
        'version: 1\nname: site\nwaive: {robot_description: "a camera was added"}\n'
        'criteria: {tilt: {value: tip_angle, above_deg: 1}}\n'
    )
    settings = ugv.load_config().settings
    bag = run(tmp_path, told(heavier(urdf)))
    found = ugv.evaluate(bag, criteria=load_criteria(criteria, settings))
    assert found.verdict == 'PASS'
    assert 'a camera was added' in found.reasons[0]


def test_a_configuration_without_a_urdf_takes_the_recorded_one(
    tmp_path: Path, urdf: str, bare: Path
) -> None:
    """Margins are those of the same URDF as a file; the result says that it was recorded."""
    bag = run(tmp_path, told(urdf))
    found, same = ugv.evaluate(bag, config=bare), ugv.evaluate(bag)
    assert found.verdict == 'PASS'
    assert found.result['stability'] == same.result['stability']
    assert found.result['robot']['description'] == 'recorded'
    assert found.result['robot']['urdf_sha256'] == same.result['robot']['urdf_sha256']


def test_the_command_takes_it_too_and_verify_agrees(tmp_path: Path, urdf: str, bare: Path) -> None:
    """`evaluate --config` without a URDF writes a result that `verify` computes again."""
    bag, result = run(tmp_path, told(urdf)), tmp_path / 'result.json'
    done = command('evaluate', bag, '-c', bare, '--json', result)
    assert done.returncode == 0, done.stderr
    assert json.loads(result.read_text())['robot']['urdf'] == '/robot_description'
    again = command('verify', result)
    assert again.returncode == 0, again.stdout + again.stderr


def test_without_any_urdf_there_is_no_verdict(tmp_path: Path, bare: Path) -> None:
    """A configuration without a URDF and a recording without a description are refused."""
    with pytest.raises(ugv.BadConfig, match=r'urdf: expected .* /robot_description, got none'):
        ugv.evaluate(run(tmp_path), config=bare)


def test_descriptions_that_change_are_no_pass(tmp_path: Path, urdf: str, bare: Path) -> None:
    """Several different robots in one recording are INCONCLUSIVE, whichever was configured."""
    bag = run(tmp_path, told(urdf, urdf, heavier(urdf)))
    for config in (bare, None):
        found = ugv.evaluate(bag, config=config)
        assert found.verdict == 'INCONCLUSIVE'
        assert any('2 different robots on /robot_description' in r for r in found.reasons)


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('<robot', 'not a URDF'),
        ('', 'not a URDF'),
        (b'\x00\x01\x00\x00\x05\x00\x00\x00\xff\xfe\xfd\xfc\x00', 'cannot be read'),
        (b'\x00\x01\x00\x00\xff\xff\xff\xff', 'cannot be read'),
    ],
)
def test_an_unreadable_description_is_no_pass(
    tmp_path: Path, bare: Path, text: str | bytes, words: str
) -> None:
    """It cannot be held against the configuration, and cannot be the configuration."""
    bag = run(tmp_path, told(text))
    found = ugv.evaluate(bag)
    assert found.verdict == 'INCONCLUSIVE'
    assert words in found.reasons[0]
    with pytest.raises(ugv.BadConfig):
        ugv.evaluate(bag, config=bare)


def test_of_several_robots_the_description_in_the_namespace_of_the_joints_counts(
    tmp_path: Path, urdf: str
) -> None:
    """The description of another robot, recorded beside it, is no objection."""
    made = base()
    made = replace(made, joints=replace(made.joints, topic='/r1/joint_states'))
    more = [
        *told(urdf, topic='/r1/robot_description'),
        *told(heavier(urdf), topic='/r2/robot_description'),
    ]
    bag = write(tmp_path / 'run.mcap', sorted([*more, *made.messages()], key=lambda m: m.log))
    assert ugv.evaluate(bag).verdict == 'PASS'


def test_more_texts_than_are_read_are_no_pass(tmp_path: Path, urdf: str) -> None:
    """What was not read may be another robot: texts that always change cannot hide it."""
    same = [f'{urdf}<!-- {k} -->' for k in range(8)]
    assert ugv.evaluate(run(tmp_path, told(*same))).verdict == 'PASS'
    found = ugv.evaluate(run(tmp_path, told(*same, heavier(urdf))))
    assert found.verdict == 'INCONCLUSIVE'
    assert 'more than 8 different texts' in found.reasons[0]


HUSKY = ('front_left_wheel', 'front_right_wheel', 'rear_left_wheel', 'rear_right_wheel')
UR5 = ('shoulder_pan_joint', 'shoulder_lift_joint', 'elbow_joint', 'wrist_1_joint')


@pytest.mark.parametrize('names', [HUSKY, UR5])
def test_a_foreign_recording_does_not_become_the_robot_that_ships(
    tmp_path: Path, names: tuple[str, ...]
) -> None:
    """Where nobody named a configuration, joints that do not match are named, and `init` is."""
    bag = run(tmp_path, names=names)
    with pytest.raises(ugv.BadBag) as refused:
        ugv.evaluate(bag)
    said = str(refused.value)
    assert '\n' not in said
    assert names[0] in said
    assert 'shoulder_joint' in said
    assert f'ugv-acceptance init {bag} -o robot.yaml' in said


def test_a_named_configuration_is_taken_at_its_word(tmp_path: Path) -> None:
    """With --config packbot the same recording is judged, and told to name other joints."""
    found = ugv.evaluate(run(tmp_path, names=HUSKY), config='packbot')
    assert found.verdict == 'INCONCLUSIVE'
    assert any('none names a joint of the robot' in reason for reason in found.reasons)


@pytest.mark.parametrize(
    'names',
    [
        ('r1_turret_joint', 'r1_shoulder_joint', 'r1_elbow_joint', 'r1_flipper_joint'),
        ('turret_joint', 'shoulder_joint', 'elbow_joint', 'left_flipper'),
    ],
)
def test_its_own_names_with_a_prefix_or_one_lost_are_still_judged(
    tmp_path: Path, names: tuple[str, ...]
) -> None:
    """A recording of the robot that ships stays INCONCLUSIVE with the key to set."""
    assert ugv.evaluate(run(tmp_path, names=names)).verdict == 'INCONCLUSIVE'


def test_a_recording_without_joint_states_says_nothing_of_its_robot(tmp_path: Path) -> None:
    """An IMU alone is refused where nobody named a configuration."""
    imu = [m for m in base().messages() if m.type == IMU]
    with pytest.raises(ugv.BadBag, match=r'got none: .* says that this is .*init'):
        ugv.evaluate(write(tmp_path / 'run.mcap', imu))


@pytest.mark.parametrize('verb', ['map', 'campaign', 'evaluate'])
def test_every_verb_that_reads_recordings_names_the_foreign_joints(
    tmp_path: Path, verb: str
) -> None:
    """Maps over a run, campaign and evaluate say it in the same words."""
    bag, out = str(run(tmp_path, names=HUSKY)), str(tmp_path / 'out')
    given = {
        'map': ['map', 'rollover', '--steps', '5', '--from-bag', bag, '--out', f'{out}.csv'],
        'campaign': ['campaign', bag, '--out', out, '--workers', '1'],
        'evaluate': ['evaluate', bag],
    }
    done = command(*given[verb])
    text = done.stdout + done.stderr
    assert done.returncode == 2
    assert 'front_left_wheel' in text
    assert 'init' in text


def test_one_description_among_many_chunks_is_found(tmp_path: Path, urdf: str) -> None:
    """Also one that was told late, in a chunk of its own."""
    late = Message(EPOCH + 9 * NS, '/robot_description', STRING, string_message(heavier(urdf)))
    assert ugv.evaluate(run(tmp_path, [late])).verdict == 'INCONCLUSIVE'


def test_joint_names_told_later_count(tmp_path: Path) -> None:
    """Joints of the robot that begin to speak after others are its joints all the same."""
    made = base()
    wheels = replace(made.joints, names=HUSKY, stamp=made.joints.stamp - 1)
    later = made.joints.kept(np.arange(250, 500))
    messages = replace(made, joints=later, more=(wheels.kept(np.arange(200)),)).messages()
    assert JOINT_STATE in {m.type for m in messages}
    assert ugv.evaluate(write(tmp_path / 'run.mcap', messages)).verdict == 'INCONCLUSIVE'
