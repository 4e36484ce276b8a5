"""Where a recording comes from, what is only assumed, what was carried: told in the first lines."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from config.robot_files import YAML, write_robot
from rich.console import Console

from ugv_acceptance import BadConfig
from ugv_acceptance.bag.encode import imu_cdr, inertia_cdr, joint_state_cdr
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.cli.result_text import print_result
from ugv_acceptance.config import load
from ugv_acceptance.config.identity import PARTS
from ugv_acceptance.evaluation.downsampling import Strips
from ugv_acceptance.offline.evaluate import evaluate
from ugv_acceptance.report.acceptance import acceptance_page
from ugv_acceptance.report.format import assumed_line, load_text, origin_line

EPOCH, STEP = 1_748_854_800_000_000_000, 20_000_000
ANY = [0.0] * 9
CLOCK = 'rosgraph_msgs/msg/Clock'
ASSUMED = (
    "\nassumed: {lift.limit: the paper's example, slide.limit: the paper's example, arm.mass: weak}"
)


def record(
    folder: Path,
    loads: Sequence[tuple[int, float]] = (),
    *,
    simulated: bool = False,
    clock: bool = False,
) -> Path:
    """Write a robot at rest for 3 s; `loads` are pairs of a sample (20 ms) and kg told then."""
    with BagWriter(folder, simulated=simulated) as bag:
        bag.add_topic('/joint_states', 'sensor_msgs/msg/JointState')
        bag.add_topic('/imu/data', 'sensor_msgs/msg/Imu')
        bag.add_topic('/payload', 'geometry_msgs/msg/InertiaStamped')
        if clock:
            bag.add_topic('/clock', CLOCK)
            bag.write('/clock', EPOCH, b'\x00\x01\x00\x00' + bytes(8))
        for k in range(150):
            now = EPOCH + k * STEP
            for at, mass in loads:
                if at == k:
                    told = inertia_cdr(now, 'hand', mass, (0.0, 0.0, 0.0))
                    bag.write('/payload', now, told)
            state = joint_state_cdr(now, '', ['lift', 'slide'], [0.0, 0.0], [0.0, 0.0], [])
            bag.write('/joint_states', now, state)
            up = [0.0, 0.0, 9.81 + 0.001 * (k % 7)]
            level = [0.0, 0.0, 0.0, 1.0]
            imu = imu_cdr(now, 'imu', level, [0.0001 * (k % 5)] * 3, up, (ANY, ANY, ANY))
            bag.write('/imu/data', now, imu)
    return folder


def judged(tmp_path: Path, yaml: str = YAML, identity: Any = None, **how: Any) -> Any:
    """Return the result of a run of the robot of two joints."""
    config = load(write_robot(tmp_path, yaml))
    return evaluate(record(tmp_path / 'run', **how), config=config, identity=identity).result


def printed(result: Any, *, verbose: bool = True) -> str:
    """Return the first lines printed of a result, with single blanks: to NOT CHECKED."""
    console = Console(highlight=False)
    with console.capture() as capture:
        print_result(result, console, verbose=verbose)
    return ' '.join(capture.get().partition('NOT CHECKED')[0].split())


def page(result: Any, tmp_path: Path) -> str:
    """Return the report of a result without charts."""
    settings = load(tmp_path / 'two.yaml').settings
    nothing = Strips(*(np.empty(shape) for shape in (0, (0, 2), (0, 4), (0, 2))))
    return acceptance_page(result, nothing, settings, PARTS)


@pytest.mark.parametrize(
    ('how', 'words'),
    [
        ({}, 'simulated or real: the recording does not say'),
        ({'simulated': True}, 'simulated, as the recording says'),
        ({'clock': True}, 'simulated or replayed: the recording has a clock, /clock'),
        ({'identity': {'origin': 'real'}}, 'the recording does not say; entered: real'),
        (
            {'simulated': True, 'identity': {'origin': 'real'}},
            'simulated, as the recording says; entered: real',
        ),
    ],
)
def test_simulated_or_real_stands_in_the_first_lines(how: Any, words: str, tmp_path: Path) -> None:
    """Of text and report; a recording that says nothing is not called real."""
    result = judged(tmp_path, **how)
    assert words in printed(result)
    assert words in printed(result, verbose=False)
    head = page(result, tmp_path).partition('class="verdict')[0]
    assert words[1:] in head


@pytest.mark.parametrize(
    ('more', 'words'),
    [
        (ASSUMED, "assumed, not measured: lift.limit, slide.limit (the paper's example); arm.mass"),
        ('\nassumed: {}', 'no number of the robot is only assumed'),
        ('', "the robot's configuration does not say which of its numbers are only assumed"),
    ],
)
def test_assumed_numbers_stand_in_the_first_lines(more: str, words: str, tmp_path: Path) -> None:
    """With the reason for their values; where the configuration says nothing, that is told."""
    result = judged(tmp_path, f'{YAML}{more}')
    assert words in printed(result)
    assert 'assumed' in printed(result, verbose=False)
    head = page(result, tmp_path).partition('class="verdict')[0].replace('&#39;', "'")
    assert words[1:] in head


def test_the_shipped_robot_says_that_its_limits_are_the_papers_example() -> None:
    """50 N m of shoulder and elbow were measured by nobody."""
    assumed = dict(load('packbot').assumed or ())
    assert {name for name, why in assumed.items() if 'paper' in why} == {
        'shoulder_joint.limit',
        'elbow_joint.limit',
    }


@pytest.mark.parametrize(
    ('name', 'text'),
    [
        ('lift', r'two.yaml:\d+: assumed.lift: expected a link, joint or section'),
        ('lifft.limit', 'did you mean lift?'),
        ('.limit', 'expected a link, joint or section'),
    ],
)
def test_a_name_that_is_no_number_of_the_robot_is_refused(
    name: str, text: str, tmp_path: Path
) -> None:
    """With file, line and the nearest name."""
    with pytest.raises(BadConfig, match=text):
        load(write_robot(tmp_path, f'{YAML}\nassumed: {{{name}: a guess}}'))


@pytest.mark.parametrize(
    ('loads', 'entered', 'row'),
    [
        ((), None, '1.00 kg, as configured; none was told during the run'),
        (((0, 4.0),), None, '4.00 kg from 0.00 s: told during the run'),
        (
            ((0, 4.0), (50, 4.0), (100, 0.0)),
            None,
            '4.00 kg from 0.00 s, 0.00 kg from 2.00 s: told during the run',
        ),
        (((0, 4.0),), 'sandbag', 'sandbag, as entered; 4.00 kg from 0.00 s: told during the run'),
    ],
)
def test_the_payload_of_the_report_is_the_one_that_was_told(
    loads: Any, entered: str | None, row: str, tmp_path: Path
) -> None:
    """It is never "not entered" beside the load of the worst moment."""
    identity = {'payload': entered} if entered else None
    result = judged(tmp_path, identity=identity, loads=loads)
    assert f'<tr><th>payload</th><td>{row}</td></tr>' in page(result, tmp_path)


def test_many_changes_of_the_load_are_counted(tmp_path: Path) -> None:
    """The first 20 are listed, the others counted."""
    loads = [(k, 1.0 + k % 2) for k in range(1, 31)]
    result = judged(tmp_path, loads=loads)
    assert len(result['load']['told']) == 20
    assert load_text(result).endswith(', and 10 more changes: told during the run')


def test_a_mark_of_simulation_outlives_a_crash(tmp_path: Path) -> None:
    """A recording that breaks off, and has no summary, still says that it was simulated."""
    (file,) = record(tmp_path / 'run', simulated=True).glob('*.mcap')
    cut = tmp_path / 'cut.mcap'
    cut.write_bytes(file.read_bytes()[: file.stat().st_size * 2 // 3])
    assert open_bag(cut).simulated


def test_a_result_says_in_words_what_it_has_as_values(tmp_path: Path) -> None:
    """The lines are those of the result, so the JSON has what the text says."""
    result = judged(tmp_path, f'{YAML}{ASSUMED}', simulated=True)
    assert result['origin'] == {'simulated': True, 'clock': None}
    assert result['robot']['assumed']['arm.mass'] == 'weak'
    assert f'{origin_line(result)} {assumed_line(result)}' in printed(result)
