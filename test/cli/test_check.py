"""`ugv-acceptance check`: what it reads, what it prints, its exit codes."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag.bag_cases import STORE
from bag.trajectories import encoded
from cli.here import ugv

from ugv_acceptance.bag.trajectory import TYPE
from ugv_acceptance.bag.writer import BagWriter

FOLDED = ('--posture', 'flipper_joint=180deg')
# The arm of the PackBot lowers a little, slowly.
POINTS = ((1.0, (0.0, 1.9, -1.5)), (4.0, (0.2, 1.7, -1.4)))
NAMES = ('turret_joint', 'shoulder_joint', 'elbow_joint')


def text_of(points: Any = POINTS) -> str:
    """Return a trajectory as YAML."""
    rows = [f'- {{positions: {list(q)}, time: {t}}}\n' for t, q in points]
    return f'joint_names: [{", ".join(NAMES)}]\npoints:\n{"".join(rows)}'


@pytest.fixture
def reach(tmp_path: Path) -> Path:
    """Return the file of a motion that is permitted without a load."""
    path = tmp_path / 'reach.yaml'
    path.write_text(text_of())
    return path


def answer(*words: object) -> tuple[int, dict[str, Any]]:
    """Return the exit code and the values of a check."""
    done = ugv('check', *words, '--json')
    return done.returncode, json.loads(done.stdout)


def test_a_motion_is_permitted_with_its_margins(reach: Path) -> None:
    """Exit code 0; least tilt, joints with their limits, what was not checked."""
    code, found = answer(reach, *FOLDED, '--payload', 0)
    assert (code, found['verdict'], found['reasons']) == (0, 'PERMITTED', [])
    assert found['tilt_left']['deg'] > 20.0
    joints = {use['joint']: use for use in found['joints']}
    assert set(joints) == {'shoulder_joint', 'elbow_joint'}
    assert all(0.0 < use['share'] < 1.0 and use['limit'] == 50.0 for use in joints.values())
    assert any('turret_joint' in told for told in found['not_checked'])
    assert found['conditions']['payload_kg'] == 0.0


def test_the_answer_on_the_page_is_that_of_the_program(monkeypatch: pytest.MonkeyPatch) -> None:
    """The motion on docs/check.md is the file, and what it prints is what the page shows."""
    monkeypatch.chdir(Path(__file__).resolve().parents[2])
    page, example = Path('docs/check.md').read_text('utf-8'), 'docs/examples/reach.yaml'
    _, _, motion = Path(example).read_text('utf-8').partition('\n')
    assert f'```yaml\n{motion}```' in page
    shown = page.partition(f'$ ugv-acceptance check {example} {" ".join(FOLDED)}\n')[2]
    done = ugv('check', example, *FOLDED)
    assert done.returncode == 1
    assert done.stdout.startswith(shown.partition('```')[0])


def test_a_load_that_is_too_heavy_is_refused(reach: Path) -> None:
    """Exit code 1; the first line names the file, a sentence the joint and its torque."""
    done = ugv('check', reach, *FOLDED, '--payload', '15kg')
    assert done.returncode == 1
    text = ' '.join(done.stdout.split())
    assert text.startswith(f'[X] REFUSED {reach}')
    assert 'shoulder_joint' in text
    assert 'of 50.0 N m' in text
    assert max(map(len, done.stdout.splitlines())) <= max(80, len(str(reach)) + 14)


def test_a_joint_that_nobody_told_is_not_known(reach: Path) -> None:
    """Exit code 3; nothing is guessed."""
    done = ugv('check', reach, '--payload', 0)
    assert done.returncode == 3
    assert 'NOT KNOWN' in done.stdout
    assert 'flipper_joint' in done.stdout


def test_tilt_place_and_ground_count(reach: Path) -> None:
    """Each option changes the least tilt left to where it should."""
    _, level = answer(reach, *FOLDED, '--payload', 2)
    _, leans = answer(reach, *FOLDED, '--payload', 2, '--tilt', 'roll=10deg')
    _, away = answer(reach, *FOLDED, '--payload', 2, '--at', '10cm,0,0')
    _, rough = answer(reach, *FOLDED, '--payload', 2, '--ground', 'stairs')
    assert leans['tilt_left']['side'] == 'right'
    assert leans['tilt_left']['deg'] < level['tilt_left']['deg'] - 3.0
    assert away['joints'] != level['joints']
    assert rough['tilt_left_cautious']['deg'] < rough['tilt_left']['deg']
    assert level['tilt_left_cautious'] is None


def test_the_way_from_where_the_arm_stands_counts(reach: Path) -> None:
    """From far below it is a long way in a second: too fast."""
    here, away = ((*FOLDED[:1], f'{FOLDED[1]},{more}') for more in (
        'turret_joint=0deg,shoulder_joint=1.9rad,elbow_joint=-1.5rad',
        'turret_joint=0deg,shoulder_joint=0.6rad,elbow_joint=-1.5rad'))  # fmt: skip
    assert answer(reach, *here, '--payload', 0)[0] == 0
    code, found = answer(reach, *away, '--payload', 0)
    assert code == 1
    assert any('shoulder_joint is to move at' in reason for reason in found['reasons'])


def message(rows: Any) -> bytes:
    """Return a serialised JointTrajectory as rosbags writes it."""
    types = STORE.types
    empty = np.empty(0)
    points = [
        types['trajectory_msgs/msg/JointTrajectoryPoint'](
            np.array(q), empty, empty, empty,
            time_from_start=types['builtin_interfaces/msg/Duration'](sec=int(t), nanosec=0),
        )
        for t, q in rows
    ]  # fmt: skip
    stamp = types['builtin_interfaces/msg/Time'](sec=0, nanosec=0)
    header = types['std_msgs/msg/Header'](stamp=stamp, frame_id='')
    return encoded(types[TYPE](header=header, joint_names=list(NAMES), points=points))


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """Return a recording with two trajectories on one topic: a slow one, and a hasty one at 5 s."""
    path = tmp_path / 'run'
    hasty = [(1.0, (0.0, 1.9, -1.5)), (2.0, (3.0, 0.2, 0.0))]
    with BagWriter(path) as writer:
        writer.add_topic('/arm/joint_trajectory', TYPE)
        for seconds, rows in ((0, POINTS), (5, hasty)):
            writer.write('/arm/joint_trajectory', (100 + seconds) * 10**9, message(rows))
    return path


def test_a_recorded_trajectory_is_read(run: Path) -> None:
    """The one that is meant, by --when; the same answer as from YAML."""
    assert answer(run, *FOLDED, '--payload', 0, '--when', '1s')[0] == 0
    assert answer(run, *FOLDED, '--payload', 0, '--when', '5s')[0] == 1
    named = ('--topic', '/arm/joint_trajectory', '--when', '0s')
    assert answer(run, *FOLDED, '--payload', 0, *named)[0] == 0


@pytest.mark.parametrize(
    ('words', 'told'),
    [
        ((), 'expected --when'),
        (('--topic', '/arm'), 'expected a topic of trajectory_msgs/msg/JointTrajectory'),
        (('--when', 'soon'), '--when'),
        (('--ground', 'mud'), '--ground mud: expected one of'),
        (('--ground', 'stairs=1s..2s'), 'expected a kind for all the motion'),
        (('--payload', '-1'), 'expected a mass >= 0 kg'),
        (('--at', '1'), '--at: expected three lengths'),
        (('--posture', 'knee=3deg'), 'expected a measured joint'),
        (('--tilt', 'yaw=3deg'), 'expected roll or pitch'),
    ],
)
def test_a_wrong_option_is_one_line_and_exit_code_2(
    run: Path, words: tuple[str, ...], told: str
) -> None:
    """Which names the option, or what it needs."""
    more = () if '--when' in words or told == 'expected --when' else ('--when', '1s')
    done = ugv('check', run, *more, *words)
    assert done.returncode == 2
    assert told in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_files_that_are_none_are_one_line_and_exit_code_2(tmp_path: Path, reach: Path) -> None:
    """No file, no YAML, an option for recordings only, a recording without trajectories."""
    broken = tmp_path / 'broken.yaml'
    broken.write_text('points: 3')
    bags = Path(__file__).parents[2] / 'bags' / 'packbot_pass'
    for words in ((tmp_path / 'no.yaml',), (broken,), (reach, '--topic', '/a'), (bags,)):
        done = ugv('check', *words)
        assert done.returncode == 2
        assert len(done.stderr.splitlines()) == 1
