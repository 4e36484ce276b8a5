"""Recordings without an IMU or without joint states, judged with and without a word about it."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from cli import here

import ugv_acceptance as ugv
from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.writer import BagWriter

S, MS = 1_000_000_000, 1_000_000
T0 = 1_700_000_000 * S
NAMES = ('turret_joint', 'shoulder_joint', 'elbow_joint', 'flipper_joint')
FOLDED, STRETCHED = (0.0, 2.0, -2.5, 2.0), (0.0, 0.0, 0.0, 2.0)
STILL, UP = (0.0, 0.0, 0.0), (0.0, 0.0, 9.81)
LEVEL_WITHOUT_IMU = 'set topics.imu: null and imu.attitude: level'


def recorded(folder: Path, inputs: Sequence[str], q: Sequence[float] = FOLDED) -> Path:
    """Write a recording of five seconds with these inputs of a PackBot that rests."""
    kinds = {'/joint_states': 'sensor_msgs/msg/JointState', '/imu/data': 'sensor_msgs/msg/Imu'}
    with BagWriter(folder) as bag:
        for topic in inputs:
            bag.add_topic(topic, kinds[topic])
        for k in range(500):
            now = T0 + k * 10 * MS
            if '/joint_states' in inputs and k % 2:
                bag.write('/joint_states', now, joint_state_cdr(now, '', NAMES, q))
            if '/imu/data' in inputs:
                level = (0.0005, 0.0, 0.0, 1.0)
                bag.write('/imu/data', now, imu_cdr(now, 'imu_link', level, STILL, UP))
    return folder


def packbot(folder: Path, repository: Path, absent: str) -> Path:
    """Return the file of a PackBot that is declared to be without one of its inputs."""
    text = (repository / 'msg_configs' / 'packbot.yaml').read_text('utf-8')
    text = text.replace('../urdf', str(repository / 'urdf'))
    start = text.index(f'  {absent}:\n    name')
    end = text.index('  imu:\n' if absent == 'joint_states' else '  payload:\n', start)
    text = f'{text[:start]}  {absent}: null\n{text[end:]}'
    if absent == 'imu':
        text = text.replace('attitude: auto ', 'attitude: level ')
    else:
        first, last = text.index('\njoints:\n'), text.index('\nimu:\n')
        held = '{turret_joint: 0, shoulder_joint: 2, elbow_joint: -2.5, flipper_joint: 2}'
        text = f'{text[:first]}\nheld: {held}\n{text[last:]}'
        text = text[: text.index('\nuncertainty:')]
    path = folder / 'packbot.yaml'
    path.write_text(text, 'utf-8')
    return path


def command(*arguments: str) -> tuple[int, str]:
    """Run `ugv-acceptance`; return its exit code and output."""
    done = here.ugv(*arguments)
    return done.returncode, done.stdout + done.stderr


def unchecked(result: ugv.Evaluation) -> dict[str, str]:
    """Return what was not checked, and why."""
    told: Any = result.to_dict()['not_checked']
    return {one['what']: one['why'] for one in told}


def test_a_recording_without_an_imu_is_inconclusive_and_says_what_to_set(tmp_path: Path) -> None:
    """It is no bad input: the first reason says what is missing, and what declares it absent."""
    result = ugv.evaluate(recorded(tmp_path / 'run', ['/joint_states']))
    assert result.verdict == 'INCONCLUSIVE'
    assert 'has no IMU topic' in result.reasons[0]
    assert LEVEL_WITHOUT_IMU in result.reasons[0]


@pytest.mark.parametrize(('q', 'verdict'), [(FOLDED, 'PASS'), (STRETCHED, 'FAIL')])
def test_with_a_level_base_declared_torques_are_judged(
    tmp_path: Path, repository: Path, q: tuple[float, ...], verdict: str
) -> None:
    """Torques decide the verdict; tip-over is not checked, though the stretched arm would tip."""
    config = packbot(tmp_path, repository, 'imu')
    result = ugv.evaluate(recorded(tmp_path / 'run', ['/joint_states'], q), config=config)
    assert result.verdict == verdict
    assert unchecked(result)['tip-over'] == 'no IMU: the base was declared level'
    assert not any('tip' in reason for reason in result.reasons if verdict == 'FAIL')


def test_a_pass_without_an_imu_says_so_in_its_reason(tmp_path: Path, repository: Path) -> None:
    """The first line of a PASS does not speak of all margins."""
    config = packbot(tmp_path, repository, 'imu')
    result = ugv.evaluate(recorded(tmp_path / 'run', ['/joint_states']), config=config)
    assert result.reasons[0].startswith('all torque margins kept, tip-over not checked')


def test_an_imu_that_was_recorded_but_declared_absent_is_told(
    tmp_path: Path, repository: Path
) -> None:
    """Who declares an IMU absent that was recorded reads that it was not used."""
    config = packbot(tmp_path, repository, 'imu')
    run = recorded(tmp_path / 'run', ['/joint_states', '/imu/data'])
    assert 'does not use topics.imu' in unchecked(ugv.evaluate(run, config=config))['/imu/data']


def test_a_rover_is_judged_by_its_imu_alone(tmp_path: Path, repository: Path) -> None:
    """Without joint states the declared posture gives tip-over margins; torques are not checked."""
    config = packbot(tmp_path, repository, 'joint_states')
    result = ugv.evaluate(recorded(tmp_path / 'run', ['/imu/data']), config=config)
    assert result.verdict == 'PASS'
    assert 'torques' in unchecked(result)
    whole = ugv.evaluate(recorded(tmp_path / 'all', ['/joint_states', '/imu/data']))
    own, of_all = result.to_dict()['stability'], whole.to_dict()['stability']
    assert isinstance(own, dict)
    assert isinstance(of_all, dict)
    assert own['min_angle_deg'] == pytest.approx(of_all['min_angle_deg'], abs=1e-6)


@pytest.mark.parametrize(
    ('absent', 'kept'), [('imu', '/joint_states'), ('joint_states', '/imu/data')]
)
def test_every_output_copes_with_an_absent_input(
    tmp_path: Path, repository: Path, absent: str, kept: str
) -> None:
    """Report, JSON by the schema, CSV and annotated recording are written for both kinds."""
    run = recorded(tmp_path / 'run', [kept], STRETCHED)
    out = {kind: tmp_path / f'r.{kind}' for kind in ('html', 'json', 'csv', 'mcap')}
    options = ('--report', '--json', '--csv', '--annotate')
    files = [x for o, path in zip(options, out.values(), strict=True) for x in (o, str(path))]
    robot = str(packbot(tmp_path, repository, absent))
    code, said = command('evaluate', str(run), '-c', robot, '-v', *files)
    assert code in {0, 1}, said
    schema = json.loads((repository / 'schema' / 'result.schema.json').read_text('utf-8'))
    jsonschema.Draft202012Validator(schema).validate(json.loads(out['json'].read_text('utf-8')))
    assert all(path.stat().st_size for path in out.values())
    assert 'not read' in said


def test_warnings_about_the_robot_stand_in_the_text(tmp_path: Path, repository: Path) -> None:
    """`evaluate` prints what is odd with the robot's files beside its verdict."""
    text = (repository / 'msg_configs' / 'packbot.yaml').read_text('utf-8')
    text = text.replace('../urdf', str(repository / 'urdf'))
    text = text.replace('front_left: {link: base_link, position_m: [0.250, 0.202, 0]}',
                        'front_left: {link: base_link, position_m: [0.250, 1.202, 0]}')  # fmt: skip
    path = tmp_path / 'wide.yaml'
    path.write_text(text, 'utf-8')
    run = recorded(tmp_path / 'run', ['/joint_states', '/imu/data'])
    _, said = command('evaluate', str(run), '-c', str(path))
    assert 'warning:' in said
    assert 'contacts.front_left.position_m' in said
    assert 'outside of the collision geometry' in said
