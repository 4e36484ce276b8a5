"""Every angle on a command line takes its unit: whatever verb, whatever option."""

import json
import math
import re
from importlib import import_module
from pathlib import Path

import pytest
import typer
from cli.here import ugv
from typer.main import get_command

from ugv_acceptance import BadConfig
from ugv_acceptance.cli import VERBS
from ugv_acceptance.cli.robot_description import posture_from
from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Joint, Link, Robot
from ugv_acceptance.run.fault_text import fault_from

SMALL = ('--steps', '11', '--out', 'OUT/map.csv')
FEW = ('--samples', '5000')
ANSWERED = ('--mass', 'urdf', '--limit', '*=50')
PACKBOT = str(Path(__file__).resolve().parents[2] / 'urdf/packbot.urdf')
MOTION = (str(Path(__file__).with_name('little_motion.yaml')), '--payload', '0')
STANDS = 'shoulder_joint=2rad,flipper_joint=2rad'
# Verb, what else it needs, option, and what is written with it; {} is an angle.
ANGLES: list[tuple[str, tuple[str, ...], str, str]] = [
    ('model', (), '--posture', 'shoulder_joint={},elbow_joint=0'),
    ('check', MOTION, '--posture', f'turret_joint={{}},{STANDS}'),
    (
        'check',
        (*MOTION, '--posture', f'turret_joint=0,{STANDS}'),
        '--tilt',
        'roll=1deg,pitch={}',
    ),
    ('model', (), '--tilt', 'roll={}'),
    ('model', (), '--tilt', 'roll=0,pitch={}'),
    ('map', ('rollover', *SMALL), '--x', 'shoulder_joint=0:{}'),
    ('map', ('rollover', *SMALL), '--y', 'elbow_joint=0deg:{}'),
    ('map', ('rollover', *SMALL), '--posture', 'turret_joint={}'),
    ('map', ('rollover', '--orientation', 'right', *SMALL), '--slope', '{}'),
    ('map', ('rollover', *SMALL), '--caution', '{}'),
    ('map', ('rollover', '--caution', '40deg', *SMALL), '--failure', '{}'),
    ('plan', ('--short',), '--tilt', '{}'),
    ('risk', FEW, '--posture', 'shoulder_joint={}'),
    ('risk', FEW, '--vary', 'slope=0..{}'),
    ('risk', FEW, '--vary', 'heading={}+-{}'),
    ('risk', FEW, '--vary', 'elbow_joint.position={}'),
    ('risk', FEW, '--vary', 'elbow_joint.rate=0+-{}/s'),
    ('speed', ('--samples', '11'), '--posture', 'shoulder_joint={}'),
    ('simulate', ('-s', '0.5', '--bag', 'OUT/bag'), '--fault', 'wrong-mounting={}@0-0.2'),
    ('init', (PACKBOT, '-o', 'OUT/robot.yaml', *ANSWERED), '--mounting', '{},0,0'),
    ('run', ('--sim', '--out', 'OUT/run'), '--fault', 'wrong-mounting={}'),
]
IDS = [f'{verb}-{option.strip("-")}-{text}' for verb, _, option, text in ANGLES]
# A file, with a test of its own; and a word: real or not-real.
NO_ANGLE = {('risk', '--mission'), ('init', '--tilt'), ('drill', '--seed')}
# Options of which some part is an angle, by what their help says.
TOLD = re.compile(r'\bangle|\btilt|slope|deg\b|degree|radian', re.IGNORECASE)


def options_of(verb: str) -> dict[str, str]:
    """Return the options of a verb with their help."""
    app = typer.Typer()
    module = import_module(f'ugv_acceptance.cli.{verb}')
    app.command(verb)(getattr(module, verb))
    named = (p for p in get_command(app).params if p.param_type_name == 'option')
    return {max(p.opts, key=len): getattr(p, 'help', None) or '' for p in named}


def arguments(row: tuple[str, tuple[str, ...], str, str], angle: str, out: Path) -> list[str]:
    """Return the command line of a row with an angle."""
    verb, rest, option, text = row
    words = [verb, *rest, option, text.replace('{}/s', f'{angle}/s').replace('{}', angle)]
    return [word.replace('OUT', str(out)) for word in words]


def test_every_option_that_tells_of_an_angle_is_in_the_table() -> None:
    """Every option whose help speaks of an angle is tested here."""
    told = {
        (verb, option)
        for verb in VERBS
        for option, text in options_of(verb).items()
        if TOLD.search(text) and (verb, option) not in NO_ANGLE
    }
    assert told == {(verb, option) for verb, _, option, _ in ANGLES}


@pytest.mark.parametrize('row', ANGLES, ids=IDS)
def test_a_bare_number_is_no_angle(
    row: tuple[str, tuple[str, ...], str, str], tmp_path: Path
) -> None:
    """An angle without unit ends with 2 and one line with both spellings; nothing is written."""
    bare = '17'
    words = [word.replace('17/s', '17') for word in arguments(row, bare, tmp_path)]
    done = ugv(*words)
    kind, per = ('an angular rate', '/s') if 'rate' in row[3] else ('an angle', '')
    expected = f'expected {kind} with its unit, such as "17deg{per}" or "0.2967rad{per}", got 17'
    assert (done.returncode, done.stdout) == (2, '')
    assert done.stderr.count('\n') == 1
    assert done.stderr.rstrip().endswith(expected)
    assert row[2].strip('-') in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize('row', [r for r in ANGLES if r[0] != 'run'], ids=[*IDS[:-1]])
def test_degrees_and_radians_of_one_angle_give_the_same(
    row: tuple[str, tuple[str, ...], str, str], tmp_path: Path
) -> None:
    """An angle in degrees and the same in radians give the same output, byte for byte."""
    found = []
    for name, angle in (('first', '17deg'), ('second', f'{math.radians(17)!r}rad')):
        out = tmp_path / name
        out.mkdir()
        done = ugv(*arguments(row, angle, out))
        assert done.returncode == 0, done.stderr
        written = {p.name: p.read_bytes() for p in out.rglob('*') if p.suffix in {'.csv', '.mcap'}}
        printed = '' if row[0] == 'simulate' else done.stdout.replace(str(out), '')
        found.append((printed, written))
    assert found[0] == found[1]


def test_a_fault_of_a_run_is_read_as_one_of_simulate() -> None:
    """`run --fault` needs units as `simulate --fault` does: for angles, not for other amounts."""
    robot = load().settings.robot
    first = fault_from('wrong-mounting=17deg', robot)
    assert first == fault_from(f'wrong-mounting={math.radians(17)!r}rad', robot)
    assert first.amount == pytest.approx(17.0, rel=1e-12)
    assert fault_from('late=17', robot).amount == 17.0


def test_zero_is_the_same_in_both_units() -> None:
    """An angle of 0 needs no unit."""
    robot = load().settings.robot
    assert posture_from(robot, 'shoulder_joint=0,elbow_joint=-0.0') == [0.0, 0.0, 0.0, 0.0]


def test_a_mission_s_angles_take_their_unit(tmp_path: Path) -> None:
    """Angles in a mission's file take their unit, as on the command line."""
    mission = tmp_path / 'mission.json'
    for phase in ({'posture': 'shoulder_joint=17'}, {'vary': {'slope': '0deg..17'}}):
        mission.write_text(json.dumps({'phases': [phase]}))
        done = ugv('risk', '--mission', str(mission), *FEW)
        assert done.returncode == 2
        assert 'expected an angle with its unit, such as "17deg"' in done.stderr


def test_a_joint_that_slides_takes_a_length_with_its_unit() -> None:
    """The position of a prismatic joint takes its unit: a bare number is refused."""
    lift = Joint('lift', 'prismatic', 'base_link', 'mast')
    robot = Robot('r', (Link('base_link', 1.0), Link('mast', 1.0)), (lift,), ('lift',))
    assert posture_from(robot, 'lift=25cm') == posture_from(robot, 'lift=250 mm') == [0.25]
    words = '--posture lift=250: expected a length with its unit, such as "250mm" or "0.25m"'
    with pytest.raises(BadConfig, match=re.escape(words)):
        posture_from(robot, 'lift=250')


@pytest.mark.parametrize(
    'words',
    [
        ('model', '--payload', '4000'),
        ('model', '--json', '--payload', '4000'),
        ('speed', '--payload', '4000', '--samples', '11'),
        ('map', 'rollover', '--payload', '4000', *SMALL),
        ('risk', '--vary', 'payload.mass=4000', *FEW),
        ('risk', '--vary', 'payload.mass=4000+-1', *FEW),
        ('risk', '--vary', 'payload.mass=0..4000', *FEW),
    ],
    ids=' '.join,
)
def test_a_payload_heavier_than_the_robot_is_doubted(
    words: tuple[str, ...], tmp_path: Path
) -> None:
    """A payload heavier than the robot prints a warning; the numbers are computed."""
    done = ugv(*(word.replace('OUT', str(tmp_path)) for word in words))
    told = [line for line in done.stderr.splitlines() if 'warning' in line]
    assert len(told) == 1
    assert 'kg: more than the robot weighs (24.6 kg): are these grams?' in told[0]
    assert '4000 kg' in told[0]
    assert done.returncode == 0
    assert done.stdout


def test_a_doubted_payload_is_doubted_in_what_is_written(tmp_path: Path) -> None:
    """The warning of a doubtful payload is also in JSON documents and a map's picture."""
    for words in (
        ('model', '--json', '--payload', '4000'),
        ('speed', '--json', '--payload', '4000', '--samples', '11'),
        ('risk', '--json', '--vary', 'payload.mass=4000', *FEW),
    ):
        warnings = json.loads(ugv(*words).stdout)['warnings']
        assert [w for w in warnings if 'more than the robot weighs' in w]
    picture = tmp_path / 'map.svg'
    done = ugv('map', 'torque', '--payload', '4000', '--steps', '11', '--out', str(picture))
    assert 'payload 4000 kg (more than the robot weighs)' in done.stdout


@pytest.mark.parametrize('payload', ['4', '4000 g', '24'])
def test_a_payload_the_robot_may_carry_is_not_doubted(payload: str) -> None:
    """A payload that the robot may carry gives no warning."""
    assert 'warning' not in ugv('speed', '--payload', payload, '--samples', '11').stderr
