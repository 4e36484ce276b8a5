"""`ugv-acceptance model`: what it prints and what it refuses."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from ugv_acceptance import BadConfig
from ugv_acceptance.cli.model import model
from ugv_acceptance.cli.robot_description import describe
from ugv_acceptance.config import load

app = typer.Typer()
app.command('model')(model)
runner = CliRunner(env={'COLUMNS': '80', 'NO_COLOR': '1', 'TERM': 'dumb'})


def output_of(*arguments: str) -> str:
    """Run the verb and return what it printed."""
    result = runner.invoke(app, arguments)
    assert result.exit_code == 0, result.output
    return result.output


def described(*arguments: str) -> dict[str, Any]:
    """Run the verb with --json and return its values."""
    values: dict[str, Any] = json.loads(output_of('--json', *arguments))
    return values


def test_tables_fit_in_80_columns() -> None:
    """Only paths may be longer: cut lines cannot be copied."""
    lines = output_of().splitlines()
    free = ('config ', 'urdf ')
    assert [line for line in lines if len(line) > 80 and not line.startswith(free)] == []


@pytest.mark.parametrize(
    'text',
    [
        'chassis_link',
        '17.450',
        'shoulder_joint',
        '74.8 N m',
        '50 N m',
        'front_left',
        'Total mass 28.55 kg',
        'Support polygon: ',
        'the limits allow 1.88 kg here: 2.12 kg too much',
        'warning: shoulder_joint: limit 50 N m cannot hold 4 kg in every posture: up to 74.8 N m',
    ],
)
def test_what_the_tool_believes_is_printed(text: str) -> None:
    """Links, masses, joints, limits, contacts, polygon, payload and warnings."""
    assert text.strip() in ' '.join(output_of('--posture', 'flipper_joint=180deg').split())


def test_the_payload_that_is_left_is_exact() -> None:
    """At full reach 50 N m hold (50 - own weight's torque) / (g L)."""
    own = 9.81 * 2.5 * (0.275 + 0.87)
    largest = described()['payload']['largest_kg']
    assert largest == pytest.approx((50 - own) / (9.81 * 1.19), rel=1e-12)


def test_a_posture_changes_torques() -> None:
    """An arm straight up needs no torque."""
    joints = {
        joint['name']: joint for joint in described('--posture', 'shoulder_joint=90deg')['joints']
    }
    assert joints['shoulder_joint']['torque'] == pytest.approx(0.0, abs=1e-12)


def test_a_tilt_changes_the_margins_by_itself() -> None:
    """Nose down by 10 degrees leaves 10 degrees less to the front and 10 more to the rear."""
    level, down = (
        described('--posture', 'shoulder_joint=90deg', '--tilt', tilt)['sides']
        for tilt in ('pitch=0', 'pitch=10deg')
    )
    change = [down[s]['tilt_left_deg'] - level[s]['tilt_left_deg'] for s in ('front', 'rear')]
    assert change == pytest.approx([-10.0, 10.0])


def test_a_positive_roll_lowers_the_right_side() -> None:
    """Roll turns about x, forward: the left side rises (REP-103)."""
    sides = described('--posture', 'shoulder_joint=90deg', '--tilt', 'roll=10deg')['sides']
    assert sides['right']['tilt_left_deg'] < sides['left']['tilt_left_deg']


def test_an_inverted_robot_has_no_margins() -> None:
    """Its state is named, and no side has a tilt left."""
    values = described('--tilt', 'roll=180deg')
    assert values['state'] == 'inverted'
    assert {side['tilt_left_deg'] for side in values['sides'].values()} == {None}


def test_a_payload_replaces_the_configured_one() -> None:
    """--payload replaces the configured payload, in kg or pounds."""
    assert described('--payload', '10 lb')['payload']['mass_kg'] == pytest.approx(4.5359237)
    assert described('--payload', '0')['warnings'] == []


def test_json_has_no_infinity() -> None:
    """In JSON a number without limit is null, so that any reader takes it."""
    text = output_of('--json')
    json.loads(text, parse_constant=pytest.fail)
    joints = {joint['name']: joint for joint in json.loads(text)['joints']}
    assert joints['turret_joint']['limit'] is None


@pytest.mark.parametrize(
    ('arguments', 'sentence'),
    [
        ({'posture': 'shoulder=30deg'}, '--posture: expected a measured joint .*, got shoulder'),
        (
            {'posture': 'shoulder_joint=3 kg'},
            '--posture shoulder_joint=3 kg: expected an angle with its unit',
        ),
        ({'posture': 'shoulder_joint'}, '--posture: expected name=value'),
        ({'tilt': 'yaw=1'}, '--tilt: expected roll or pitch, got yaw'),
        ({'payload': '-1'}, '--payload: expected a mass >= 0 kg, got -1'),
        ({'payload': '4 m'}, '--payload: expected a mass'),
    ],
)
def test_a_wrong_option_is_refused(arguments: dict[str, str], sentence: str) -> None:
    """The error names the option, what was expected and what came."""
    with pytest.raises(BadConfig, match=sentence):
        describe(load(), **arguments)


def test_poses_are_listed_and_can_be_taken() -> None:
    """The tables name each pose with the joints that are not at 0, and --posture takes one."""
    text = output_of('--config', 'packbot_eod', '--posture', 'STOW,turret_joint=90deg')
    assert re.search(r'STAIRS +shoulder_joint 20 deg', text)
    assert re.search(r'turret_joint +any +90 deg', text)
    assert re.search(r'flipper_joint +any +180 deg', text)
    assert 'Poses' not in output_of()


def test_the_shell_completes_poses() -> None:
    """--posture ST<Tab> completes to the poses of the --config before it that begin so."""
    words = 'model --config packbot_eod --posture ST'
    told = {'_MODEL_COMPLETE': 'complete_bash', 'COMP_WORDS': words, 'COMP_CWORD': '4'}
    found = runner.invoke(app, [], prog_name='model', env=told)
    assert found.output.split() == ['STOW', 'STAIRS']


def test_a_foreign_robot_needs_its_urdf() -> None:
    """A configuration that ships without its URDF gives an error that names --urdf."""
    with pytest.raises(BadConfig, match='--urdf'):
        load(Path('abitobot'))


def test_a_prismatic_joint_is_shown_in_metres_and_newtons(shared_bags: Path) -> None:
    """arm_3 of abitobot holds 98 N."""
    urdf = shared_bags / 'abitobot' / 'robot.urdf'
    text = output_of('--config', 'abitobot', '--urdf', str(urdf))
    assert '-1.15 .. 1.15 m' in text
    assert '98.0 N ' in text


@pytest.mark.parametrize('shoulder', ['90deg', '89.99999999deg', '89.9deg', '-90deg', '90.01deg'])
def test_a_load_no_joint_feels_is_no_number(shoulder: str) -> None:
    """An upright arm, which feels no load, shows no number for the load that is allowed."""
    text = output_of('--posture', f'shoulder_joint={shoulder}')
    assert 'no joint limit bounds it in this posture; tipping may, see below' in text
    assert max(len(digits) for digits in re.findall(r'\d+', text.split('sha256')[1][20:])) < 7


@pytest.mark.parametrize('payload', ['4000', '1e6', '1e9'])
def test_tables_fit_whatever_is_carried(payload: str) -> None:
    """Nobody reads eleven digits in a row; a load too heavy is still computed."""
    text = output_of('--payload', payload)
    told = text[text.index('Links') :]
    lines = [line for line in told.splitlines() if not line.startswith('warning:')]
    assert max(len(line) for line in lines) <= 80
    assert 'kg too much' in told
    assert not re.search(r'\d{7}', told)


def test_rounding_bears_no_load() -> None:
    """The largest load of an upright arm is null in JSON: nothing bounds it."""
    assert described('--posture', 'shoulder_joint=90deg')['payload']['largest_kg'] is None
