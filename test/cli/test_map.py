"""`ugv-acceptance map`: files, thresholds, what it prints and what it refuses."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from ugv_acceptance import AcceptanceError
from ugv_acceptance.bag.reader import choose_topics, open_bag
from ugv_acceptance.cli.map import map as map_verb
from ugv_acceptance.config import load
from ugv_acceptance.model.stability import stability
from ugv_acceptance.studies.planar import PAPER, planar_torque

app = typer.Typer()
app.command('map')(map_verb)
runner = CliRunner(env={'COLUMNS': '200', 'TERM': 'dumb'})
SMALL = ('--steps', '41')


def run(*arguments: str) -> str:
    """Run the verb and return what it printed; raise what it raised."""
    result = runner.invoke(app, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


@pytest.mark.parametrize('kind', ['torque', 'rollover', 'payload', 'drag'])
def test_every_map_in_every_form(kind: str, tmp_path: Path) -> None:
    """Each of the four maps can be written as SVG, PNG, CSV and NPZ."""
    files = [tmp_path / f'map.{ending}' for ending in ('svg', 'png', 'csv', 'npz')]
    run(kind, *SMALL, *(x for file in files for x in ('--out', str(file))))
    assert files[0].read_text().startswith('<svg')
    assert files[1].read_bytes().startswith(b'\x89PNG')
    rows = list(csv.reader(files[2].open()))
    assert len(rows) == 1 + 41 * 41
    with np.load(files[3]) as arrays:
        assert arrays['value'].shape == (41, 41)
        assert float(rows[1][2]) == pytest.approx(arrays['value'][0, 0], rel=1e-5)


def test_the_torque_map_is_the_paper_s(tmp_path: Path) -> None:
    """PackBot's arm on level ground: the cells are equations (1) and (2) over 50 N m."""
    run('torque', *SMALL, '--out', str(tmp_path / 'map.npz'))
    with np.load(tmp_path / 'map.npz') as arrays:
        theta1, theta2 = np.meshgrid(arrays['x'], arrays['y'], indexing='ij')
        used = np.max(np.abs(planar_torque(PAPER, theta1, theta2)), axis=0) / 50.0
        assert np.allclose(arrays['value'], 100.0 * used, atol=1e-9)
        assert (arrays['class'] == np.digitize(used, [0.8, 1.0])).all()


def test_orientation_posture_and_payload_count(tmp_path: Path) -> None:
    """Right tilt, turret aside, 2 kg: cells are the tilt left of just that robot."""
    run(
        'rollover',
        *('--orientation', 'right', '--slope', '25deg', '--payload', '2'),
        *('--posture', 'turret_joint=90deg,flipper_joint=180deg'),
        *('--x', 'shoulder_joint=0deg:90deg', '--y', 'elbow_joint=-1rad:1rad'),
        *(*SMALL, '--out', str(tmp_path / 'map.npz')),
    )
    robot = load().settings.robot
    with np.load(tmp_path / 'map.npz') as arrays:
        q = np.array([np.pi / 2, arrays['x'][7], arrays['y'][11], np.pi])
        g = 9.81 * np.array([0.0, -np.sin(np.radians(25)), -np.cos(np.radians(25))])
        load_2 = type(robot.payload)(2.0, robot.payload.cog)
        least = min(float(a) for a in stability(robot, q, g, load_2).angle)
        assert arrays['value'][7, 11] == pytest.approx(np.degrees(least), abs=1e-9)


def test_thresholds_move_the_areas(tmp_path: Path) -> None:
    """With --caution 40 % and --failure 50 % more of the torque map fails."""
    out = ('--out', str(tmp_path / 'map.csv'))
    usual = run('torque', *SMALL, *out)
    strict = run('torque', *SMALL, *out, '--caution', '40', '--failure', '50')
    share = [float(re.search(r'failure +([\d.]+) %', text)[1]) for text in (usual, strict)]  # type: ignore[index]
    assert share[1] > share[0] + 10.0


def test_the_assumptions_are_said(tmp_path: Path) -> None:
    """A map states its attitude, payload, other joints and limits."""
    text = run('rollover', *SMALL, '--orientation', 'nose-up', '--out', str(tmp_path / 'map.csv'))
    words = 'pitch -30°; payload 4 kg; turret_joint 0°, flipper_joint 0°'
    assert words in ' '.join(text.split())


def test_a_recorded_run_is_drawn(tmp_path: Path, repository: Path) -> None:
    """--from-bag keeps where the run went: between the joints' extremes of the recording."""
    bag, out = repository / 'bags' / 'packbot_pass', tmp_path / 'map.npz'
    picture = tmp_path / 'map.svg'
    run('rollover', *SMALL, '--from-bag', str(bag), '--out', str(out), '--out', str(picture))
    run('rollover', *SMALL, '--out', str(tmp_path / 'bare.svg'))
    recording = open_bag([bag])
    batches = recording.batches(choose_topics(recording, 'joint_states', 'imu/data', 'payload'))
    columns = [c for batch in batches for c in batch.joints]
    names = columns[0].names
    joints = [names.index('shoulder_joint'), names.index('elbow_joint')]
    went = np.concatenate([c.position for c in columns])[:, joints]
    with np.load(out) as arrays:
        track = arrays['track']
    assert track.min(axis=0) == pytest.approx(went.min(axis=0), abs=1e-3)
    assert track.max(axis=0) == pytest.approx(went.max(axis=0), abs=1e-3)
    assert len(picture.read_text()) > len((tmp_path / 'bare.svg').read_text())


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (('speed',), 'expected torque, rollover, payload, drag, got speed'),
        (('torque', '--x', 'knee'), '--x: expected a measured joint'),
        (
            ('torque', '--x', 'elbow_joint', '--y', 'elbow_joint'),
            '--y: expected another joint than --x',
        ),
        (('torque', '--x', 'shoulder_joint=2deg:1deg'), 'FROM below TO'),
        (('torque', '--x', 'shoulder_joint=2deg'), 'expected shoulder_joint=FROM:TO'),
        (('torque', '--orientation', 'upside'), '--orientation: expected one of level, right'),
        (('torque', '--slope', '3 kg'), '--slope 3 kg: expected an angle'),
        (('torque', '--payload', '-1'), '--payload: expected a mass >= 0 kg'),
        (('torque', '--limit', 'elbow_joint=0'), 'expected a torque > 0 N m'),
        (('torque', '--limit', 'knee=3'), '--limit: expected JOINT=TORQUE'),
        (('drag', '--friction', '0'), '--friction: expected a number > 0'),
        (('torque', '--caution', '120'), 'on the safe side of --failure'),
        (('torque', '--out', 'map.gif'), '--out map.gif: expected .svg, .png, .csv or .npz'),
    ],
)
def test_wrong_options_are_named(arguments: tuple[str, ...], words: str) -> None:
    """One line: the option, what was expected, what came."""
    with pytest.raises(AcceptanceError, match=re.escape(words)):
        runner.invoke(app, [*arguments, *SMALL], catch_exceptions=False)
