"""The verbs simulate, plan and run as a person types them."""

from pathlib import Path

import pytest
import yaml
from cli.here import ugv


def test_a_simulated_run_that_tips_is_recorded_and_fails(tmp_path: Path) -> None:
    """Simulate says the truth, evaluate finds it in the recording alone."""
    made = ugv('simulate', 'tilt', '--seed', '1', '--seconds', '20', '--bag', str(tmp_path / 'run'))
    assert made.returncode == 0, made.stderr
    assert 'tipped over at' in made.stdout
    judged = ugv('evaluate', str(tmp_path / 'run'))
    assert judged.returncode == 1, judged.stderr
    assert 'TIP_OVER' in judged.stdout


def test_the_list_names_scenarios_and_faults() -> None:
    """What can be asked for is said without a folder to record into."""
    text = ugv('simulate', '--list').stdout
    assert all(name in text for name in ('overreach', 'dash', 'frozen-encoder', 'weak-motor'))


def test_a_plan_and_its_card_are_written(tmp_path: Path) -> None:
    """The YAML is data a person can read, the card names its hash."""
    plan, card = tmp_path / 'plan.yaml', tmp_path / 'card.html'
    done = ugv('plan', '-o', str(plan), '--card', str(card))
    assert done.returncode == 0, done.stderr
    data = yaml.safe_load(plan.read_text())
    assert len(data['steps']) > 30
    sha256 = done.stdout.split('sha256 ')[1].split()[0]
    assert sha256 in card.read_text()


@pytest.mark.parametrize(
    ('arguments', 'said'),
    [
        (('simulate', 'nothing', '--bag', 'x'), 'scenario: expected one of gentle'),
        (('simulate', '--bag', 'x', '--fault', 'broken'), "fault 'broken': expected one of"),
        (('simulate', '--bag', 'x', '--seconds', '-3'), 'seconds: expected a number above 0'),
        (('simulate',), 'expected a folder to record into'),
        (('simulate', '--bag', 'x', '--seed', '-1'), '--seed'),
        (('run', '--sim', '--seed', '-1'), '--seed'),
        (('run', 'nowhere.yaml', '--sim'), 'nowhere.yaml: expected a plan'),
        (('run', 'nowhere.yaml'), 'expected one of --sim, --robot, --operator'),
        (('plan', '--from', 'nowhere.yaml'), 'nowhere.yaml: expected a plan, got: No such file'),
    ],
)
def test_what_cannot_be_is_said_and_ends_with_2(arguments: tuple[str, ...], said: str) -> None:
    """No traceback; what was expected and what came."""
    done = ugv(*arguments)
    assert done.returncode == 2
    assert said in ' '.join(done.stderr.replace('│', ' ').split())
    assert 'Traceback' not in done.stderr
