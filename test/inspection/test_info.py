"""`info`: what is in a recording, does it fit, what could be judged; never against `evaluate`."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from bag.bag_cases import STORE
from cases.base import NAMES, base
from cases.table import MADE, SHARED
from cli.here import ugv
from cli.test_outputs import process
from made.run import EPOCH, NS, Form, messages_of, write

from ugv_acceptance import BadBag
from ugv_acceptance.bag.encode import string_message
from ugv_acceptance.bag.recording import open_recording
from ugv_acceptance.bag.statuses import TYPE
from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.config import load
from ugv_acceptance.config.loading import names_in_messages
from ugv_acceptance.inspection.info import info_of
from ugv_acceptance.inspection.look import look, until_cheap
from ugv_acceptance.offline.evaluate import evaluate
from ugv_acceptance.type_aliases import Json

REPOSITORY = Path(__file__).parents[2]
PASSING = REPOSITORY / 'bags' / 'packbot_pass'
LINES, COLUMNS = 23, 80


def told_of(path: Path, config: Path | None = None) -> Json:
    """Return all that `info` says of a recording."""
    return info_of(open_recording(path), config)


def info(*arguments: object) -> tuple[int, str]:
    """Run the verb; return its exit code and what it printed."""
    done = ugv('info', *arguments)
    return done.returncode, done.stdout


CASES = (
    *('base', 'no_imu', 'imu_topic_no_message', 'imu_dropout', 'names_empty_positions'),
    *(
        'prefixed_names',
        'position_nan_start',
        'two_robots',
        'imu_raw_and_filtered',
        'json_messages',
    ),
    *('dynamic_joint_states_only', 'degrees', 'imu_in_g', 'advice_axis_y', 'ros1_in_mcap'),
)


@pytest.mark.parametrize('name', CASES)
def test_what_evaluate_cannot_judge_is_said_beforehand(name: str, tmp_path: Path) -> None:
    """INCONCLUSIVE or refused there: exit code 1 and the same reasons here; else 0."""
    path = MADE[name].recording(tmp_path)
    robot = tmp_path / 'robot.yaml'
    config = robot if robot.exists() else None
    told = told_of(path, config)
    decides = [one['why'] for one in told['could_not'] if one['decides']]
    refusal = ''
    try:
        judged = evaluate(path, config=config)
    except BadBag as error:
        refusal = str(error)
    if refusal:
        assert not told['can_be_judged']
        assert refusal.endswith(decides[0])
        return
    assert told['can_be_judged'] == (judged.verdict != 'INCONCLUSIVE')
    if judged.verdict == 'INCONCLUSIVE':
        assert decides == list(judged.reasons)
    unchecked = [one['why'] for one in judged.result['not_checked']]
    assert [one['why'] for one in told['could_not'] if not one['decides']] == unchecked


@pytest.mark.skipif(not SHARED.is_dir(), reason=f'recordings of others are not here: {SHARED}')
def test_recordings_of_others_fit_one_screen() -> None:
    """Whatever is odd with it: no traceback, 23 lines of 80 columns, exit code 0 or 1."""
    for folder in sorted(SHARED.iterdir())[::8]:
        code, text = info(folder)
        lines = [line for line in text.splitlines() if str(SHARED) not in line]
        assert code in {0, 1}, folder
        assert len(text.splitlines()) <= LINES, folder
        assert max(map(len, lines)) <= COLUMNS, folder


def test_a_good_recording_is_told_on_one_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Topics with rate, gap, QoS and what they are taken for; what could be judged; the command."""
    monkeypatch.setenv('COLUMNS', '80')
    code, text = info(PASSING)
    assert code == 0
    assert len(text.splitlines()) <= LINES
    assert re.search(r'/imu/data +Imu +5601 +200 +5 ms +best effort +imu', text)
    assert 'every chunk has a checksum; simulated' in ' '.join(text.split())
    assert 'Could be judged: torque of shoulder_joint, elbow_joint; tip-over' in text
    assert f'It can be judged: ugv-acceptance evaluate {PASSING}' in ' '.join(text.split())


def test_a_recording_with_much_to_say_keeps_to_one_screen(tmp_path: Path) -> None:
    """Thirty topics, long names, a fault that is told in many words; -v has all of it."""
    silent = tuple(
        (f'/a/very/long/namespace/of/topic_{k}', 'std_msgs/msg/String') for k in range(30)
    )
    made = base()
    joints = replace(made.joints, names=tuple(f'a_prefix_{name}' for name in NAMES))
    path = write(tmp_path / 'run.mcap', messages_of([joints, made.imu]), Form(silent=silent))
    code, text = info(path)
    assert code == 1
    assert len(text.splitlines()) <= LINES
    assert all(len(line) <= COLUMNS for line in text.splitlines() if str(path) not in line)
    assert 'topic_29' not in text
    assert 'topic_29' in info(path, '-v')[1]


def test_the_documented_keys_are_those_of_the_json(tmp_path: Path) -> None:
    """docs/info.md names every key of the top level, of a topic, and of a recording."""
    out = tmp_path / 'info.json'
    assert info(PASSING, '--json', out)[0] == 0
    told = json.loads(out.read_text())
    page = (REPOSITORY / 'docs' / 'info.md').read_text()
    keys = [*told, *told['recording'], *told['topics'][0], *told['robot']]
    assert [key for key in keys if f'`{key}`' not in page] == []
    assert told['version'] == 1


def test_a_recording_that_cannot_be_read_is_a_usage_error(tmp_path: Path) -> None:
    """One line and exit code 2, as with every verb."""
    path = tmp_path / 'run.mcap'
    path.write_bytes(b'no recording')
    done = ugv('info', path)
    assert done.returncode == 2
    assert done.stderr.count('\n') == 1
    assert str(path) in done.stderr


def test_a_truncated_recording_is_told_as_such(tmp_path: Path) -> None:
    """Where it breaks off, and what of it is used; it is not fit for a verdict."""
    path = tmp_path / 'cut.mcap'
    path.write_bytes((PASSING / 'packbot_pass_0.mcap').read_bytes()[:300_000])
    told = told_of(path)
    assert 'truncated' in told['recording']['salvaged']
    assert 0 < told['topics'][0]['messages'] < 5601
    assert not told['can_be_judged']


@pytest.mark.parametrize('same', [True, False])
def test_the_robots_own_description_is_compared(tmp_path: Path, *, same: bool) -> None:
    """Whether the recorded URDF is the one in force; if not, in what they differ."""
    urdf = load().urdf_text.decode()
    text = urdf if same else urdf.replace('<mass value="1', '<mass value="2', 1)
    path = folder_with(tmp_path, '/robot_description', 'std_msgs/msg/String', string_message(text))
    found = told_of(path)['robot']['description']
    assert found['topics'] == ['/robot_description']
    assert found['same'] is same
    assert bool(found['difference']) is not same


def folder_with(where: Path, topic: str, kind: str, data: bytes) -> Path:
    """Return a recording of the base with one more message at its start."""
    path = where / 'run'
    qos = Qos('reliable', 'transient_local')
    with BagWriter(path) as bag:
        bag.add_topic(topic, kind, qos)
        bag.write(topic, EPOCH, data)
        for message in base(imu_hz=50).messages():
            bag.add_topic(message.topic, message.type, Qos('best_effort'))
            bag.write(message.topic, message.log, message.data)
    return path


def test_the_alerts_of_a_monitor_and_its_limits_are_counted(tmp_path: Path) -> None:
    """How many were raised, and by which limits: these or others."""
    types: Any = STORE.types
    pairs = {'state': 'raised', 'code': 'TIP_OVER', 'limits_hash': 'abcdef'}
    values = [types['diagnostic_msgs/msg/KeyValue'](key=k, value=v) for k, v in pairs.items()]
    status = types['diagnostic_msgs/msg/DiagnosticStatus'](
        level=2, name='TIP_OVER front', message='raised', hardware_id='', values=values
    )
    stamp = types['builtin_interfaces/msg/Time'](sec=0, nanosec=0)
    header = types['std_msgs/msg/Header'](stamp=stamp, frame_id='')
    data = bytes(STORE.serialize_cdr(types[TYPE](header=header, status=[status]), TYPE))
    told = told_of(folder_with(tmp_path, '/acceptance_monitor/alerts', TYPE, data))
    expected = {'topic': '/acceptance_monitor/alerts', 'raised': 1, 'limits_hash': ['abcdef']}
    assert told['monitors'] == [expected]
    assert told['limits_hash'] != 'abcdef'


def test_a_recording_of_another_robot_that_ships_is_recognised(tmp_path: Path) -> None:
    """By its joint names, without --config; the command to judge it names the configuration."""
    names = names_in_messages('packbot_eod') or ()
    made = base()
    zeros = made.joints.position[:, :1].repeat(len(names), axis=1) * 0.0
    joints = replace(made.joints, names=names, position=zeros, velocity=None, effort=None)
    path = write(tmp_path / 'run.mcap', messages_of([joints, made.imu]))
    assert told_of(path)['robot']['name'] == 'packbot_eod'
    code, text = info(path)
    assert code == 0
    assert ' '.join(text.split()).endswith(f'{path} -c packbot_eod')


def test_of_a_long_recording_the_beginning_is_read(tmp_path: Path) -> None:
    """About as many messages of inputs as are cheap, or as many bytes; all of a short one."""
    recording = open_recording(write(tmp_path / 'run.mcap', base().messages()))
    bag = recording.bag
    assert until_cheap(bag, messages=300) - bag.start_ns == pytest.approx(2 * NS, rel=0.02)
    assert bag.start_ns < until_cheap(bag, messages=10**9, most=1) < bag.end_ns
    assert until_cheap(bag) == bag.end_ns
    part = look(replace(recording, bag=bag.beginning(until_cheap(bag, messages=300))), None)
    assert part.judged is not None
    assert part.judged.result['bag']['duration_s'] == pytest.approx(2.0, rel=0.02)
    assert part.judged.verdict == 'PASS'


def test_json_to_standard_output_holds_nothing_else() -> None:
    """`--json -` can be piped; the page goes to standard error."""
    done = process('info', PASSING, '--json', '-')
    assert json.loads(done.stdout)['can_be_judged'] is True
    assert 'Could be judged' in done.stderr


def test_two_parts_of_a_split_recording_are_one(tmp_path: Path) -> None:
    """Messages of both, one table, the number of files."""
    messages = base(imu_hz=50).messages()
    half = len(messages) // 2
    write(tmp_path / 'run_0.mcap', messages[:half])
    write(tmp_path / 'run_1.mcap', messages[half:])
    code, text = info(tmp_path / 'run_0.mcap', tmp_path / 'run_1.mcap')
    assert code == 0
    assert 'and 1 more files' in ' '.join(text.split())
    assert f'; {len(messages)} messages;' in ' '.join(text.split())


def test_info_reads_and_writes_nothing_else(tmp_path: Path) -> None:
    """The folder of the recording is as before."""
    shutil.copytree(PASSING, tmp_path / 'run')
    before = {p.name: p.read_bytes() for p in (tmp_path / 'run').iterdir()}
    assert info(tmp_path / 'run')[0] == 0
    assert {p.name: p.read_bytes() for p in (tmp_path / 'run').iterdir()} == before
