"""Records of operators' drills in a result: shown for what they are, required where asked."""

import json
import shutil
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from drill.drills import ALL, ONE_FAILED, written
from junitparser import JUnitXml
from typer import Typer
from typer.testing import CliRunner

from ugv_acceptance import AcceptanceError
from ugv_acceptance.cli import evaluate, verify
from ugv_acceptance.config import load

SHIPPED = Path(__file__).resolve().parents[2] / 'bags'
GOOD, BAD = SHIPPED / 'packbot_pass', SHIPPED / 'packbot_fail'


def run(verb: Any, *arguments: object) -> Any:
    """Return what a verb did."""
    command = Typer(pretty_exceptions_enable=False)
    command.command()(verb)
    return CliRunner().invoke(command, [str(a) for a in arguments])


def told(folder: Path, bag: Path, *arguments: object) -> Any:
    """Return the result of a recording, evaluated with further arguments."""
    path = folder / 'result.json'
    run(evaluate.evaluate, bag, '--json', path, *arguments)
    return json.loads(path.read_text('utf-8'))


def edited(path: Path) -> Path:
    """Change one answer's time in a record by hand."""
    record = json.loads(path.read_text('utf-8'))
    record['situations'][0]['answers'][0]['after_s'] = 0.1
    path.write_text(json.dumps(record), 'utf-8')
    return path


@pytest.fixture(scope='module')
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with result, report and two records: one passed, one edited by hand."""
    folder = tmp_path_factory.mktemp('trained')
    ada = written(folder / 'ada.json', *ALL)
    bob = edited(written(folder / 'bob.json', *ONE_FAILED, operator='<b>Bob</b>'))
    done = run(
        evaluate.evaluate, GOOD, '--json', folder / 'r.json', '--report', folder / 'r.html',
        '--drill', ada, '--drill', bob,
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    (folder / 'out.txt').write_text(done.output, 'utf-8')
    return folder


def test_a_result_says_whose_drill_ended_how(trained: Path, repository: Path) -> None:
    """Each record stands in the result, in the published layout, and an edited one counts not."""
    result = json.loads((trained / 'r.json').read_text('utf-8'))
    schema = json.loads((repository / 'schema' / 'result.schema.json').read_text('utf-8'))
    jsonschema.Draft202012Validator(schema).validate(result)
    ada, bob = result['operator_training']['records']
    assert (ada['operator'], ada['outcome'], ada['same_robot']) == ('Ada', 'passed', True)
    assert (ada['counts'], ada['remarks'], len(ada['situations'])) == (True, [], 7)
    assert 28 < ada['days_before_run'] < 30
    assert (bob['counts'], bob['edited']) == (False, True)
    assert result['operator_training']['met'] is None


def test_text_and_report_show_the_drills(trained: Path) -> None:
    """Operator, outcome, day and minutes in both; the report has each situation, its answers."""
    page = (trained / 'r.html').read_text('utf-8')
    text = ' '.join((trained / 'out.txt').read_text('utf-8').split())
    assert 'operator training: Ada: drill passed, 2025-05-04, 24 min operator' in text
    assert '<b>Bob</b>: drill to repeat (slope), 2025-05-04, 24 min; edited: ' in text
    assert '<h3>Operator training</h3>' in page
    assert 'Ada: drill passed, 2025-05-04, 24 min' in page
    assert '<b>Bob</b>' not in page
    assert page.count('stop after 3.2 s, lower after 5.0 s') == 13
    assert page.count('it tipped to the right') == 1
    assert page.count('record of a drill') == 2


def test_a_result_with_drills_is_verified(trained: Path, tmp_path: Path) -> None:
    """From the same records it is the same; from beside the result too."""
    done = run(verify.verify, trained / 'r.json')
    assert (done.exit_code, 'VERIFIED' in done.output) == (0, True), done.output
    for path in trained.glob('*.json'):
        shutil.copy(path, tmp_path)
    moved = json.loads((tmp_path / 'r.json').read_text('utf-8'))
    for one in moved['operator_training']['records']:
        one['file'] = '/nowhere/' + Path(one['file']).name
    (tmp_path / 'r.json').write_text(json.dumps(moved), 'utf-8')
    assert run(verify.verify, tmp_path / 'r.json').exit_code == 0
    (tmp_path / 'ada.json').unlink()
    assert '--drill' in str(run(verify.verify, tmp_path / 'r.json').exception)


def test_a_record_changed_afterwards_is_found_by_verify(trained: Path, tmp_path: Path) -> None:
    """First stands the hash of the record's file."""
    ada = edited(Path(shutil.copy(trained / 'ada.json', tmp_path)))
    done = run(verify.verify, trained / 'r.json', '--drill', ada, '--drill', trained / 'bob.json')
    assert done.exit_code == 1
    first = next(line for line in done.output.splitlines() if 'operator_training' in line)
    assert first.startswith('  operator_training.records.0.file_sha256')


@pytest.mark.parametrize('content', ['{}', 'no json', '{"kind": "ugv_acceptance drill"}'])
def test_what_is_no_record_is_refused_before_anything_is_read(tmp_path: Path, content: str) -> None:
    """The error names the file; no result is written, so nothing passes silently."""
    record, out = tmp_path / 'record.json', tmp_path / 'result.json'
    record.write_text(content, 'utf-8')
    done = run(evaluate.evaluate, GOOD, '--drill', record, '--json', out)
    assert isinstance(done.exception, AcceptanceError)
    assert str(done.exception).startswith(f'{record}: ')
    assert not out.exists()


def test_a_record_is_never_overwritten_by_the_result(tmp_path: Path) -> None:
    """It is an input of the command like any other."""
    ada = written(tmp_path / 'ada.json', *ALL)
    done = run(evaluate.evaluate, GOOD, '--drill', ada, '--json', ada, '--overwrite')
    assert 'got the record of a drill itself' in str(done.exception)


LATER, OLD = '2025-06-02T09:00:01Z', '2024-05-01T09:00:00Z'
SAYS: dict[str, tuple[dict[str, Any], tuple[Any, ...], str]] = {
    'old': ({'started': OLD}, ALL, 'old: the drill was 397 days before the run'),
    'after': ({'started': LATER}, ALL, 'the drill was after the run'),
    'person': ({'operator': 'Bob'}, ALL, 'of another person: the operator entered for this run is'),
    'script': ({'scripted': True}, ALL, 'answered by a script, not by a person'),
    'failed': ({}, ONE_FAILED, ''),
    'part': ({}, ALL[:2], ''),
}


@pytest.mark.parametrize('name', SAYS)
def test_a_record_that_says_nothing_of_this_run_does_not_count(name: str, tmp_path: Path) -> None:
    """Old, later than the run, somebody else's, a script's, not passed or whole: said, not counted.

    The verdict stays: no criterion asked.
    """
    changes, outcomes, remark = SAYS[name]
    record = written(tmp_path / 'record.json', *outcomes, **changes)
    result = told(tmp_path, GOOD, '--drill', record, '--identity', 'operator=ADA')
    [entry] = result['operator_training']['records']
    assert entry['counts'] is False
    assert [text.startswith(remark) for text in entry['remarks']] == [True] * bool(remark)
    assert result['verdict'] == 'PASS'


def site(folder: Path, required: str) -> Path:
    """Return criteria that require a trained operator."""
    path = folder / 'site.yaml'
    text = f'version: 1\nname: site\noperator_training: {required}\ncriteria:\n'
    path.write_text(f'{text}  standing: {{value: tip_angle, above: 5 deg}}\n', 'utf-8')
    return path


def test_criteria_can_require_a_trained_operator(tmp_path: Path) -> None:
    """With a record that counts the run passes, without one it is INCONCLUSIVE and says why."""
    rules, report = site(tmp_path, 'this_robot'), tmp_path / 'r.xml'
    ada = written(tmp_path / 'ada.json', *ALL)
    result = told(tmp_path, GOOD, '--criteria', rules, '--drill', ada, '--junit', report)
    assert (result['verdict'], result['operator_training']['met']) == ('PASS', True)
    assert JUnitXml.fromfile(str(report)).errors == 0
    assert run(verify.verify, tmp_path / 'result.json').exit_code == 0
    result = told(tmp_path, GOOD, '--criteria', rules, '--junit', report)
    assert result['verdict'] == 'INCONCLUSIVE'
    assert result['reasons'] == [
        'operator training: the criteria require the record of a drill (--drill), none was given'
    ]
    assert JUnitXml.fromfile(str(report)).errors == 1
    assert run(verify.verify, tmp_path / 'result.json').exit_code == 0


@pytest.mark.parametrize(
    ('identity', 'said'), [((), True), (('--identity', 'operator=Ada'), False)]
)
def test_who_drove_is_not_checked_where_nobody_entered_it(
    identity: tuple[str, ...], *, said: bool, tmp_path: Path
) -> None:
    """A record of somebody is no record of whoever drove, and a PASS says so."""
    ada = written(tmp_path / 'ada.json', *ALL)
    rules = site(tmp_path, 'this_robot')
    result = told(tmp_path, GOOD, '--criteria', rules, '--drill', ada, *identity)
    unchecked = [one['what'] for one in result['not_checked']]
    assert (result['verdict'], 'who operated the robot' in unchecked) == ('PASS', said)


def test_a_missing_drill_softens_no_failure(tmp_path: Path) -> None:
    """A run that fails stays a failure; the missing record is a further reason."""
    result = told(tmp_path, BAD, '--criteria', site(tmp_path, 'any_robot'))
    assert result['verdict'] == 'FAIL'
    assert result['reasons'][-1].startswith('operator training: ')
    assert len(result['reasons']) > 1


def test_a_drill_on_another_robot_is_said_and_counts_only_where_any_will_do(
    tmp_path: Path,
) -> None:
    """One changed line makes another configuration: this_robot is not met by it, any_robot is."""
    ours, other = load('packbot'), tmp_path / 'other.yaml'
    text = ours.path.read_text('utf-8').replace('../urdf', str(ours.urdf_path.parent))
    other.write_text(f'{text}\n# another serial number\n', 'utf-8')
    ada = written(tmp_path / 'ada.json', *ALL)
    for required, verdict in (('this_robot', 'INCONCLUSIVE'), ('any_robot', 'PASS')):
        rules = site(tmp_path, required)
        result = told(tmp_path, GOOD, '--config', other, '--criteria', rules, '--drill', ada)
        [entry] = result['operator_training']['records']
        assert entry['same_robot'] is False
        assert entry['remarks'][0].startswith('another configuration of this robot (')
        assert result['verdict'] == verdict
