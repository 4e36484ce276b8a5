"""`ugv-acceptance evaluate` from bag to exit code."""

import csv
import json
import math
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from cli.here import ugv

from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.writer import BagWriter

START = 1_700_000_000_000_000_000
MS = 1_000_000
MAIN = 'from ugv_acceptance.cli import main; main()'
NAMES = ['turret_joint', 'shoulder_joint', 'elbow_joint', 'flipper_joint']
FOLDED = (0.0, math.radians(120.0), math.radians(-140.0), math.pi)
STRETCHED = (0.0, 0.0, 0.0, math.pi)
# What the name of a column of numbers ends with.
UNITS = ('_s', '_ns', '_rad', '_deg', '_nm', '_j', '_m')
COVARIANCES = ((1e-4, *(0.0,) * 8),) * 3


def evaluate(*arguments: object) -> 'subprocess.CompletedProcess[str]':
    """Run the verb."""
    return ugv('evaluate', *arguments)


def write_run(
    folder: Path, posture: Iterable[float] = FOLDED, seconds: float = 3.0,
    silent: tuple[float, float] = (0.0, 0.0), names: list[str] = NAMES,
) -> Path:  # fmt: skip
    """Record a PackBot that stands still: joints at 50 Hz, IMU at 100 Hz but for its silence."""
    with BagWriter(folder) as bag:
        bag.add_topic('/joint_states', 'sensor_msgs/msg/JointState')
        bag.add_topic('/imu/data', 'sensor_msgs/msg/Imu')
        q = list(posture)
        for k in range(int(seconds * 100)):
            now = START + k * 10 * MS
            if not silent[0] <= k / 100 < silent[1]:
                still = ((0.0, 0.0, 0.7071068, 0.7071068), (0.0, 0.0, 0.0), (0.0, 0.0, 9.81))
                bag.write('/imu/data', now, imu_cdr(now, 'imu_link', *still, COVARIANCES))
            if k % 2 == 0:
                body = joint_state_cdr(now, '', names, q, [0.0] * 4, [])
                bag.write('/joint_states', now + MS, body)
    return folder


@pytest.mark.parametrize(('name', 'code'), [('packbot_pass', 0), ('packbot_fail', 1)])
def test_nobody_reads_what_is_printed(
    name: str, code: int, repository: Path, tmp_path: Path
) -> None:
    """A closed pipe, as by `| head`, changes no exit code, is no error and loses no file."""
    files = [tmp_path / name for name in ('r.json', 'r.html', 'r.xml')]
    options = [
        x for pair in zip(('--json', '--report', '--junit'), files, strict=True) for x in pair
    ]
    command = [sys.executable, '-c', MAIN, 'evaluate', repository / 'bags' / name, *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.close()
        assert process.stderr is not None
        told = process.stderr.read()
        assert process.wait(60) == code
    assert {line.split()[0] for line in told.splitlines()} == {b'Wrote'}
    assert all(file.stat().st_size for file in files)


@pytest.mark.parametrize(
    ('name', 'code', 'verdict'),
    [('packbot_pass', 0, 'PASS'), ('packbot_fail', 1, 'FAIL'), ('packbot_gap', 3, 'INCONCLUSIVE')],
)
def test_the_runs_that_ship_give_their_verdicts(
    name: str, code: int, verdict: str, repository: Path, tmp_path: Path
) -> None:
    """The recordings that ship give their verdicts in exit code, first and last line, JSON."""
    found = tmp_path / 'result.json'
    done = evaluate(repository / 'bags' / name, '--json', found)
    assert done.returncode == code, done.stderr
    lines = done.stdout.splitlines()
    assert verdict in lines[0]
    assert lines[-1] == lines[0]
    result = json.loads(found.read_text())
    assert result['verdict'] == verdict
    assert set(result) >= {
        'version', 'verdict', 'reasons', 'bag', 'robot', 'coverage', 'torque', 'stability',
        'alerts', 'inputs',
    }  # fmt: skip
    keys = {'path', 'sha256', 'duration_s', 'messages', 'protected', 'salvaged'}
    assert set(result['bag']) >= keys
    for source in ('joint_states', 'imu'):
        assert set(result['inputs'][source]) >= {'messages', 'rate_hz', 'gaps', 'faults'}


def test_a_posture_beyond_the_limit_fails_for_that_joint(tmp_path: Path) -> None:
    """The paper's arm with 4 kg at full reach fails: 74.8 N m of 50."""
    found = tmp_path / 'result.json'
    done = evaluate(write_run(tmp_path / 'run', STRETCHED), '--json', found)
    assert done.returncode == 1
    shoulder = json.loads(found.read_text())['torque']['shoulder_joint']
    assert shoulder['max_abs'] == pytest.approx(74.8, abs=0.05)
    assert shoulder['time_in_violation_s'] == pytest.approx(3.0, abs=0.03)


def test_a_silent_imu_is_no_pass(tmp_path: Path) -> None:
    """A run whose IMU is silent for a quarter of the time does not pass."""
    done = evaluate(write_run(tmp_path / 'run', silent=(1.0, 2.0), seconds=4.0))
    assert done.returncode == 3
    assert 'no message from imu' in done.stdout


def test_a_recording_that_breaks_off_is_no_pass(repository: Path, tmp_path: Path) -> None:
    """A truncated recording of a good run does not pass, with or without metadata.yaml."""
    run = Path(shutil.copytree(repository / 'bags' / 'packbot_pass', tmp_path / 'run'))
    file = run / 'packbot_pass_0.mcap'
    file.write_bytes(file.read_bytes()[:60_000])
    for place in (run, file):
        done = evaluate(place)
        assert (done.returncode, 'the recording is not whole' in done.stdout) == (3, True)
    assert '7374 messages are missing' in evaluate(run).stdout


def test_a_recording_with_a_part_missing_is_no_pass(repository: Path, tmp_path: Path) -> None:
    """A recording does not pass if metadata.yaml lists more files than are there."""
    run = write_run(tmp_path / 'run')
    shutil.copy(repository / 'bags' / 'packbot_pass' / 'metadata.yaml', run)
    (run / 'run_0.mcap').rename(run / 'packbot_pass_0.mcap')
    done = evaluate(run)
    assert done.returncode == 3
    assert 'messages are missing' in done.stdout


def test_less_than_a_second_is_no_pass(tmp_path: Path) -> None:
    """A recording shorter than 1 s does not pass: no silence could be noticed in it."""
    done = evaluate(write_run(tmp_path / 'run', seconds=0.9))
    assert done.returncode == 3
    assert 'duration: 0.89 s; length of the recording: at least 1 s' in done.stdout


def test_joint_states_of_another_robot_are_told_as_such(tmp_path: Path) -> None:
    """Joint states of another robot's joints are reported as that, not as silence."""
    run = write_run(tmp_path / 'run', names=['a', 'b', 'c', 'd'])
    done = evaluate(run, '--config', 'packbot')
    assert done.returncode == 3
    assert '/joint_states: 150 messages' in done.stdout
    assert 'none contains a joint of this robot' in ' '.join(done.stdout.split())


def test_csv_has_one_row_a_message(tmp_path: Path) -> None:
    """The CSV has a header and a row per message, and the worst value of the result."""
    table, found = tmp_path / 'margins.csv', tmp_path / 'result.json'
    evaluate(write_run(tmp_path / 'run'), '--csv', table, '--json', found)
    rows: list[dict[str, Any]] = list(csv.DictReader(table.read_text().splitlines()))
    assert len(rows) == 300 + 150
    assert rows[0]['state'] == 'unknown'
    assert not {n for n in rows[0] if n != 'state' and not n.endswith(UNITS)}
    assert rows[0]['shoulder_joint_torque_margin_nm'] == ''
    known = [row for row in rows if row['state'] != 'unknown']
    assert len(known) == len(rows) - 1
    result = json.loads(found.read_text())
    least = min(float(row['shoulder_joint_torque_margin_nm']) for row in known)
    assert least == result['torque']['shoulder_joint']['min_margin']
    side = min(float(row[f'{result["stability"]["edge"]}_angle_deg']) for row in known)
    assert side == pytest.approx(result['stability']['min_angle_deg'], rel=1e-12)


def test_the_same_bag_gives_the_same_bytes(tmp_path: Path) -> None:
    """Evaluating a recording in two processes gives the same bytes of result."""
    run = write_run(tmp_path / 'run', STRETCHED)
    texts = []
    for k in range(2):
        found = tmp_path / f'{k}.json'
        # Each with a seed of its own for the order of sets.
        command = [sys.executable, '-c', MAIN, 'evaluate', str(run), '--json', str(found)]
        subprocess.run(command, capture_output=True, check=False, timeout=60)
        texts.append(found.read_bytes())
    assert texts[0] == texts[1]


def test_of_several_bags_the_worst_counts(tmp_path: Path) -> None:
    """Of several bags the worst verdict counts; an unreadable one does not hide a FAIL."""
    runs = [write_run(tmp_path / 'good'), write_run(tmp_path / 'bad', STRETCHED)]
    found = tmp_path / 'result.json'
    assert evaluate(*runs, tmp_path / 'none', '--json', found).returncode == 1
    verdicts = [result['verdict'] for result in json.loads(found.read_text())]
    assert verdicts == ['PASS', 'FAIL', 'BAD INPUT']


def broken_input(kind: str, folder: Path) -> list[object]:
    """Return arguments that cannot be used."""
    run = write_run(folder / 'run', seconds=0.2)
    text = folder / 'text.mcap'
    text.write_text('not a bag')
    empty = folder / 'empty'
    empty.mkdir()
    wrong = folder / 'wrong.yaml'
    wrong.write_text('robot: {nome: packbot}\n')
    cases: dict[str, list[object]] = {
        'no such bag': [folder / 'none'],
        'no bag': [text],
        'folder without bags': [empty],
        'no such config': [run, '--config', folder / 'none.yaml'],
        'wrong config': [run, '--config', wrong],
        'no such urdf': [run, '--urdf', folder / 'none.urdf'],
        'json into no folder': [run, '--json', folder / 'none' / 'result.json'],
        'json over a folder': [run, '--json', empty],
        'csv into no folder': [run, '--csv', folder / 'none' / 'margins.csv'],
        'one csv of two bags': [run, write_run(folder / 'other'), '--csv', folder / 'm.csv'],
    }
    return cases[kind]


@pytest.mark.parametrize(
    'kind',
    [
        'no such bag', 'no bag', 'folder without bags', 'no such config', 'wrong config',
        'no such urdf', 'json into no folder', 'json over a folder', 'csv into no folder',
        'one csv of two bags',
    ],
)  # fmt: skip
def test_bad_input_is_one_line_and_exit_code_2(kind: str, tmp_path: Path) -> None:
    """It says what was expected and what came; nothing half-written stays."""
    done = evaluate(*broken_input(kind, tmp_path))
    assert done.returncode == 2, done.stdout + done.stderr
    assert done.stderr.startswith('ugv-acceptance: ')
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    assert not list(tmp_path.rglob('*.part'))


def test_effort_of_a_foreign_recording_shows_its_payload(
    shared_bags: Path, repository: Path, tmp_path: Path
) -> None:
    """A SCARA arm holds 98.0 N, and 137.2 N after it grasps 4 kg: only their ratio is certain.

    Whether the force is in newtons cannot be told from one sliding joint that holds one load.
    """
    folder, found = shared_bags / 'abitobot', tmp_path / 'result.json'
    done = evaluate(
        *(folder, '--config', repository / 'msg_configs' / 'abitobot.yaml'),
        *('--urdf', folder / 'robot.urdf', '--compare-effort', '--json', found),
    )
    assert 'what the effort of arm_3_link_joint means is not known' in done.stdout
    assert 'kg' not in done.stdout.split('what the measured efforts mean')[1]
    plateaus = json.loads(found.read_text())['effort']['arm_3_link_joint']
    grasped = [p for p in plateaus if 137.0 < p['measured'] < 137.4]
    assert len(grasped) == 1
    before = [p for p in plateaus if p['end_s'] < grasped[0]['start_s'] and not p['saturated']]
    assert before[0]['measured'] == pytest.approx(97.99, abs=0.05)
    assert before[0]['model'] == pytest.approx(98.0, abs=0.05)
    assert any(p['saturated'] for p in plateaus)


def test_no_recording_of_others_crashes_or_hangs(shared_bags: Path, tmp_path: Path) -> None:
    """Every recording made by others gives a verdict or one line that says why not."""
    bags = sorted(
        {path.parent if (path.parent / 'metadata.yaml').exists() else path
         for folder in shared_bags.iterdir() if folder.is_dir() and folder.name != 'conformance'
         for path in folder.rglob('*') if path.suffix in {'.mcap', '.db3', '.bag', '.zstd'}}
    )  # fmt: skip
    assert len(bags) > 30
    found = tmp_path / 'results.json'
    done = evaluate(*bags, '--json', found)
    results = json.loads(found.read_text())
    refused = [result for result in results if result['verdict'] == 'BAD INPUT']
    assert 'Traceback' not in done.stderr
    assert all(result['reasons'] for result in results)
    told = done.stderr.strip().splitlines()
    assert told.pop() == f'Wrote {found}'
    assert len(told) == len(refused)
    assert len(results) - len(refused) >= 11
    assert sum(len(result['bag']['path']) for result in results) >= len(bags)
