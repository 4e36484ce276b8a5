"""`ugv-acceptance risk`: what is drawn, what is printed, what is refused."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from ugv_acceptance import BadConfig
from ugv_acceptance.cli.risk import risk
from ugv_acceptance.cli.risk_study import nominal, phases_from, spread_from
from ugv_acceptance.config import load
from ugv_acceptance.studies.spread import normal, uniform

app = typer.Typer()
app.command('risk')(risk)
runner = CliRunner(env={'COLUMNS': '200', 'TERM': 'dumb'})
FEW = ('--samples', '20000')


def run(*arguments: str) -> str:
    """Run the verb and return what it printed; raise what it raised."""
    result = runner.invoke(app, [*arguments, *FEW], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.stdout


def document(*arguments: str) -> dict[str, Any]:
    """Run the verb with --json."""
    values: dict[str, Any] = json.loads(run(*arguments, '--json'))
    return values


def test_a_person_reads_probability_convergence_and_what_matters() -> None:
    """The three tables, and what the configuration says but cannot vary."""
    text = run()
    assert re.search(r'rollover +0\.\d{6}   \[0\.\d{6}, 0\.\d{6}\]', text)
    assert 'convergence of "either"' in text
    assert 'what matters most' in text
    assert 'not varied: contacts.x_m' in text


def test_a_seed_gives_the_same_numbers() -> None:
    """One seed gives the same numbers again, and another seed gives others."""
    assert document('--seed', '4') == document('--seed', '4')
    assert document('--seed', '4')['phases'] != document('--seed', '5')['phases']


def test_a_robot_that_cannot_fail_does_not() -> None:
    """Arm upright, level, no load: no failure, and an interval that says how sure that is."""
    upright = 'shoulder_joint=90deg,flipper_joint=180deg'
    found = document('--posture', upright, '--vary', 'slope=0', '--vary', 'payload.mass=0')
    estimate = found['phases'][0]['estimates']['either']
    assert estimate['failures'] == 0
    assert estimate['high'] == pytest.approx(1.844e-4, rel=1e-3)


def test_a_robot_that_must_fail_does() -> None:
    """Stretched forward with 4 kg the shoulder needs 74.8 N m of 50, whatever else varies."""
    found = document(
        '--posture', 'flipper_joint=180deg', '--vary', 'payload.mass=4', '--vary', 'slope=0'
    )
    assert found['phases'][0]['estimates']['saturation']['probability'] == 1.0


def test_a_mission_is_worse_than_its_parts(tmp_path: Path) -> None:
    """1 - (1 - p)^3 (1 - q) of two phases."""
    mission = tmp_path / 'mission.json'
    phases = [
        {'name': 'lift', 'times': 3, 'vary': {'slope': '0deg..10deg'}},
        {'posture': 'shoulder_joint=60deg', 'vary': {'payload.mass': '3kg+-1kg'}},
    ]
    mission.write_text(json.dumps({'phases': phases}))
    found = document('--mission', str(mission))
    p, q = (f['estimates']['either']['probability'] for f in found['phases'])
    whole = found['mission']['either']
    assert whole['probability'] == pytest.approx(1.0 - (1.0 - p) ** 3 * (1.0 - q))
    assert whole['low'] < whole['probability'] < whole['high']
    assert 'mission: at least one failure' in run('--mission', str(mission))


def test_the_configured_uncertainty_is_drawn() -> None:
    """+/- of the file, about the robot's own value; joints' places included."""
    config = load()
    (phase,) = phases_from(config, '', [], None)
    size = dict(config.uncertainty)['chassis_link.mass_kg']
    mass = config.settings.robot.link('chassis_link').mass
    assert phase.study.spreads['chassis_link.mass'] == uniform(mass - size, mass + size)
    assert nominal(config.settings.robot, 'turret_joint.z') == 0.19
    assert 'turret_joint.z' in phase.study.spreads


def test_spreads_as_people_write_them() -> None:
    """Even, normal, fixed; units as in the configuration."""
    robot = load().settings.robot
    assert spread_from(robot, 'payload.mass=1..3') == ('payload.mass', uniform(1.0, 3.0))
    assert spread_from(robot, 'elbow_joint.limit=50+-5') == ('elbow_joint.limit', normal(50.0, 5.0))
    assert spread_from(robot, 'payload.x=20mm') == ('payload.x', uniform(0.02, 0.02))


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (('--vary', 'knee.mass=1..2'), '--vary: expected NAME=LOW..HIGH'),
        (('--vary', 'slope'), '--vary: expected NAME=LOW..HIGH'),
        (('--vary', 'slope=3deg..1deg'), '--vary: slope: expected LOW..HIGH or MEAN+-SD'),
        (('--vary', 'slope=1kg..2kg'), '--vary slope=1kg..2kg: expected an angle'),
        (('--mission', 'absent.json'), 'absent.json: expected a readable file'),
    ],
)
def test_wrong_options_are_named(arguments: tuple[str, ...], words: str) -> None:
    """One line: the option, what was expected, what came."""
    with pytest.raises(BadConfig, match=re.escape(words)):
        runner.invoke(app, [*arguments, *FEW], catch_exceptions=False)


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('{', 'expected JSON'),
        ('[]', 'expected {"phases"'),
        ('{"phases": [{"pose": ""}]}', 'phases[0]: expected name, posture, vary, times, got pose'),
        ('{"phases": [{"times": 0}]}', 'phases[0].times: expected a whole number >= 1, got 0'),
        ('{"phases": [{"vary": []}]}', 'phases[0]: expected vary as a table'),
    ],
)
def test_a_wrong_mission_is_named(text: str, words: str, tmp_path: Path) -> None:
    """An error in a mission's file names file, phase and key."""
    mission = tmp_path / 'mission.json'
    mission.write_text(text)
    with pytest.raises(BadConfig, match=re.escape(words)):
        runner.invoke(app, ['--mission', str(mission), *FEW], catch_exceptions=False)
