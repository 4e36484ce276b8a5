"""What an evaluation leaves behind: report, JUnit XML, tables, a result that can be verified."""

import csv
import json
import re
import shutil
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import jsonschema
import pyarrow.parquet as pq
import pytest
import yaml
from junitparser import JUnitXml
from typer.testing import CliRunner

from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.cli import evaluate, verify
from ugv_acceptance.offline.judge import RESULT_VERSION

SHIPPED = Path(__file__).resolve().parents[2] / 'bags'
EVIL = '<script>alert(1)</script>'
RUNS = {'packbot_pass': 0, 'packbot_fail': 1, 'packbot_gap': 3}


def app(function: Any) -> Any:
    """Return one verb as a command of its own."""
    import typer  # noqa: PLC0415

    command = typer.Typer(pretty_exceptions_enable=False)
    command.command()(function)
    return command


EVALUATE, VERIFY = app(evaluate.evaluate), app(verify.verify)


def run(command: Any, *arguments: object) -> Any:
    """Return what a verb did."""
    return CliRunner().invoke(command, [str(a) for a in arguments])


@pytest.fixture(scope='module')
def papers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with all papers of the runs that ship, by name."""
    folder = tmp_path_factory.mktemp('papers')
    for name, code in RUNS.items():
        done = run(
            EVALUATE, SHIPPED / name, '--json', folder / f'{name}.json', '--report',
            folder / f'{name}.html', '--junit', folder / f'{name}.xml', '--csv',
            folder / f'{name}.csv', '--parquet', folder / f'{name}.parquet', '--identity',
            'operator=A. Smith,witness=<b>B</b>',
        )  # fmt: skip
        assert done.exit_code == code, done.output
    return folder


def result_of(papers: Path, name: str) -> Any:
    """Return the result of a run that ships."""
    return json.loads((papers / f'{name}.json').read_text('utf-8'))


each_run = pytest.mark.parametrize('name', RUNS)


@each_run
def test_a_result_has_the_published_layout(papers: Path, repository: Path, name: str) -> None:
    """The JSON Schema that is installed holds for a pass, a failure and an inconclusive run."""
    schema = json.loads((repository / 'schema' / 'result.schema.json').read_text('utf-8'))
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.Draft202012Validator(schema).validate(result_of(papers, name))


def test_a_list_with_an_unreadable_recording_has_the_published_layout(
    tmp_path: Path, repository: Path
) -> None:
    """Several recordings give a list; one that cannot be read has its reason, in JUnit too."""
    broken, out, xml = tmp_path / 'broken.mcap', tmp_path / 'r.json', tmp_path / 'r.xml'
    broken.write_bytes(b'no recording')
    given = (broken, SHIPPED / 'packbot_gap', '--json', out, '--junit', xml)
    assert run(EVALUATE, *given).exit_code == 2
    schema = json.loads((repository / 'schema' / 'result.schema.json').read_text('utf-8'))
    results = json.loads(out.read_text('utf-8'))
    jsonschema.validate(results, schema)
    assert [result['verdict'] for result in results] == ['BAD INPUT', 'INCONCLUSIVE']
    document: Any = JUnitXml.fromfile(str(xml))
    suite = next(iter(document))
    (case,) = suite
    assert (suite.name, suite.errors, case.name) == (str(broken), 1, 'recording')
    assert case.result[0].message == results[0]['reasons'][0]


def test_the_schema_refuses_another_layout(papers: Path, repository: Path) -> None:
    """A verdict of another name or a criterion without one is no result."""
    schema = json.loads((repository / 'schema' / 'result.schema.json').read_text('utf-8'))
    validator = jsonschema.Draft202012Validator(schema)
    result = result_of(papers, 'packbot_pass')
    assert not validator.is_valid({**result, 'verdict': 'OK'})
    del result['criteria']['results'][0]['verdict']
    assert not validator.is_valid(result)


@each_run
def test_junit_has_a_case_a_criterion(papers: Path, name: str) -> None:
    """Failures are FAIL, errors INCONCLUSIVE; nothing that did not pass looks green."""
    result = result_of(papers, name)
    verdicts = [c['verdict'] for c in result['criteria']['results']]
    document: Any = JUnitXml.fromfile(str(papers / f'{name}.xml'))
    assert document.tests == len(verdicts)
    assert document.failures == verdicts.count('FAIL')
    assert document.errors == verdicts.count('INCONCLUSIVE')
    told = [case.system_out.splitlines() for suite in document for case in suite]
    assert all(line.startswith('measured: ') for _, line, *_ in told)
    assert all(len(lines) == len(set(lines)) for lines in told)


class Outside(HTMLParser):
    """Gathers what a page refers to, its elements, and its text."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.elements: set[str] = set()
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take an element."""
        self.elements.add(tag)
        named = ('src', 'href', 'xlink:href', 'action', 'data')
        self.links += [value or '' for name, value in attrs if name in named]

    def handle_data(self, data: str) -> None:
        """Take text."""
        self.text.append(data)


def page_of(path: Path) -> Outside:
    """Return a page taken apart."""
    page = Outside()
    page.feed(path.read_text('utf-8'))
    return page


@each_run
def test_a_report_works_without_a_network(papers: Path, name: str) -> None:
    """It refers to nothing outside itself, runs no script, and has its pictures in it."""
    page = page_of(papers / f'{name}.html')
    assert all(link.startswith('#') for link in page.links), page.links
    assert 'svg' in page.elements
    assert not page.elements & {'script', 'iframe', 'object', 'embed', 'img', 'form'}
    text = (papers / f'{name}.html').read_text('utf-8')
    assert not re.search(r'url\((?!#)', text)


@pytest.mark.parametrize(
    ('name', 'sentence'),
    [
        ('packbot_pass', 'This run met these criteria.'),
        ('packbot_fail', 'This run did not meet these criteria.'),
        ('packbot_gap', 'This run did not meet these criteria'),
    ],
)
def test_a_report_ends_on_the_criteria_and_never_says_safe(
    papers: Path, name: str, sentence: str
) -> None:
    """The last words are whether this run met these criteria."""
    text = ' '.join(' '.join(page_of(papers / f'{name}.html').text).split())
    assert sentence in text[-120:]
    assert not re.search(r'\bsafe', text, re.IGNORECASE)


@each_run
def test_a_report_says_what_the_result_says(papers: Path, name: str) -> None:
    """Verdict, hashes and every criterion; what was not entered is marked; no zero is negative."""
    result = result_of(papers, name)
    page = (papers / f'{name}.html').read_text('utf-8')
    for sha in (result['bag']['sha256'], result['robot']['sha256'], result['criteria']['sha256']):
        assert sha in page
    assert 'A. Smith' in page
    assert '&lt;b&gt;B&lt;/b&gt;' in page
    assert page.count('not entered') >= 8
    for criterion in result['criteria']['results']:
        assert criterion['name'] in page
    assert not re.search(r'-0\.0+\b(?![.\d])', ' '.join(page_of(papers / f'{name}.html').text))


def hostile_run(folder: Path) -> tuple[Path, Path]:
    """Return a recording and a robot whose names are all HTML."""
    path = folder / 'bag'
    with BagWriter(path) as writer:
        writer.add_topic('/js', 'sensor_msgs/msg/JointState')
        writer.add_topic('/imu', 'sensor_msgs/msg/Imu')
        for k in range(400):
            time = 10**9 + k * 10**7
            writer.write('/js', time, joint_state_cdr(time, EVIL, [EVIL], [0.1], [0.0], [1.0]))
            still = ((0.0, 0.0, 0.6, 0.8), (0.0, 0.0, 0.0), (0.0, 0.0, 9.81))
            covariances = ((1e-4, *(0.0,) * 8),) * 3
            writer.write('/imu', time + 10**6, imu_cdr(time, EVIL, *still, covariances))
    urdf = (
        '<robot name="r"><link name="base"><inertial><mass value="10"/></inertial></link>'
        '<link name="arm"><inertial><origin xyz="0.5 0 0"/><mass value="1"/></inertial></link>'
        '<joint name="&lt;script&gt;alert(1)&lt;/script&gt;" type="revolute">'
        '<parent link="base"/><child link="arm"/><axis xyz="0 -1 0"/>'
        '<limit lower="-1" upper="1" effort="2" velocity="1"/></joint></robot>'
    )
    (folder / 'robot.urdf').write_text(urdf, 'utf-8')
    config = {
        'robot': {'name': EVIL, 'serial': EVIL},
        'urdf': 'robot.urdf',
        'topics': {'joint_states': {'name': '/js'}, 'imu': {'name': '/imu'}},
        'joints': {EVIL: {}},
        'contacts': {
            f'c{k}': {'link': 'base', 'position_m': [x, y, 0]}
            for k, (x, y) in enumerate(((0.3, 0.3), (0.3, -0.3), (-0.3, 0.3), (-0.3, -0.3)))
        },
    }
    (folder / 'robot.yaml').write_text(yaml.safe_dump(config), 'utf-8')
    return path, folder / 'robot.yaml'


def test_hostile_names_are_escaped_everywhere(tmp_path: Path) -> None:
    """Joints, frames, robot, criteria and identity full of <script> give no element of a page."""
    bag, config = hostile_run(tmp_path)
    evil = tmp_path / 'criteria.yaml'
    named = {EVIL: {'value': 'torque', 'of': EVIL, 'below': 1, 'requirement': EVIL}}
    evil.write_text(yaml.safe_dump({'version': 1, 'name': EVIL, 'criteria': named}), 'utf-8')
    done = run(
        EVALUATE, bag, '--config', config, '--criteria', evil, '--report', tmp_path / 'r.html',
        '--junit', tmp_path / 'r.xml', '--identity', f'operator={EVIL}',
    )  # fmt: skip
    assert isinstance(done.exception, SystemExit)
    assert done.exit_code == 1, done.output
    page = page_of(tmp_path / 'r.html')
    assert 'script' not in page.elements
    assert EVIL in ''.join(page.text)
    assert ET.parse(tmp_path / 'r.xml').getroot().find('.//script') is None  # noqa: S314 - ours


def test_parquet_has_the_margins_of_the_csv(papers: Path) -> None:
    """The same rows and torques, in SI."""
    table = pq.read_table(papers / 'packbot_gap.parquet')
    with (papers / 'packbot_gap.csv').open() as lines:
        rows = list(csv.DictReader(lines))
    assert table.num_rows == len(rows)
    name = 'shoulder_joint_static_torque_nm'
    told = [float(row[name]) if row[name] else None for row in rows]
    assert table[name].to_pylist() == told
    assert None in told


def test_a_result_is_verified_from_its_recording(papers: Path) -> None:
    """Everything is computed again and is the same."""
    done = run(VERIFY, papers / 'packbot_fail.json')
    assert done.exit_code == 0, done.output
    assert 'VERIFIED' in done.output


@pytest.mark.parametrize(
    ('old', 'new', 'where'),
    [
        ('"verdict": "FAIL"', '"verdict": "PASS"', 'verdict'),
        ('"time_in_violation_s": 4.', '"time_in_violation_s": 5.', 'time_in_violation_s'),
        ('"level": "ERROR"', '"level": "WARN"', ".level: 'WARN' in the result, 'ERROR'"),
    ],
)
def test_a_result_that_was_changed_is_not_verified(
    papers: Path, tmp_path: Path, old: str, new: str, where: str
) -> None:
    """A verdict, a number or an alert that somebody edited is named."""
    text = (papers / 'packbot_fail.json').read_text('utf-8')
    assert old in text
    changed = tmp_path / 'changed.json'
    changed.write_text(text.replace(old, new, 1), 'utf-8')
    done = run(VERIFY, changed)
    assert done.exit_code == 1
    assert where in done.output


def test_a_result_is_verified_from_what_lies_beside_it(papers: Path, tmp_path: Path) -> None:
    """Recording, robot and result on one stick: places of another machine do not matter."""
    told = result_of(papers, 'packbot_pass')
    for path in (*told['bag']['path'], told['robot']['config'], told['robot']['urdf']):
        shutil.copy(path, tmp_path)
    told['bag']['path'] = ['/nowhere/' + Path(path).name for path in told['bag']['path']]
    for key in ('config', 'urdf'):
        told['robot'][key] = '/nowhere/' + Path(told['robot'][key]).name
    (tmp_path / 'result.json').write_text(json.dumps(told), 'utf-8')
    done = run(VERIFY, tmp_path / 'result.json')
    assert done.exit_code == 0, done.output


@pytest.mark.parametrize(
    ('lost', 'option'),
    [
        (('bag', 'path'), '--bag'),
        (('robot', 'config'), '--config'),
        (('robot', 'urdf'), '--urdf'),
        (('criteria', 'path'), '--criteria'),
    ],
)
def test_what_is_not_found_is_asked_for(
    papers: Path, tmp_path: Path, lost: tuple[str, str], option: str
) -> None:
    """Of a result made in another folder: what is missing, and the option that says where it is."""
    told = result_of(papers, 'packbot_pass')
    gone = 'run/part_of_the_result'
    told[lost[0]][lost[1]] = [gone] if option == '--bag' else gone
    (tmp_path / 'result.json').write_text(json.dumps(told), 'utf-8')
    error = str(run(VERIFY, tmp_path / 'result.json').exception)
    assert error.startswith(f'{gone}: expected this file (seen from')
    assert error.endswith(f'give its path with {option}')
    assert '\n' not in error


def test_another_recording_has_another_hash(papers: Path) -> None:
    """What was judged then is not what lies there now."""
    bag = SHIPPED / 'packbot_pass'
    done = run(VERIFY, papers / 'packbot_fail.json', '--bag', bag)
    assert done.exit_code == 1
    assert done.output.startswith('[X] DIFFERS')
    differences = done.output.partition('differences')[2]
    assert differences.split()[0].startswith('bag.sha256')


def test_a_result_of_an_older_version_says_where_it_is_told_what_to_do(
    tmp_path: Path, repository: Path
) -> None:
    """The refusal names the page about upgrading, and that page names the version."""
    path = tmp_path / 'r.json'
    path.write_text('{"version": 1}', 'utf-8')
    said = str(run(VERIFY, path).exception)
    page = (repository / 'docs' / 'upgrading.md').read_text('utf-8')
    assert 'docs/upgrading.md' in said
    assert f'| {RESULT_VERSION} (was 1) | `verify` refuses it |' in page


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('{', 'got no JSON'),
        ('[]', 'expected the result of one recording'),
        ('{"version": 99}', 'expected a result of version 2, got 99'),
        ('{"version": 2}', 'bag: expected a result of evaluate'),
    ],
)
def test_what_is_no_result_is_refused(tmp_path: Path, text: str, words: str) -> None:
    """With one line that says what was expected."""
    path = tmp_path / 'r.json'
    path.write_text(text, 'utf-8')
    done = run(VERIFY, path)
    assert words in str(done.exception)


@pytest.mark.parametrize(
    ('name', 'failures', 'errors'),
    [('packbot_pass', 0, 0), ('packbot_fail', 1, 0), ('packbot_gap', 0, 1)],
)
def test_junit_is_never_greener_than_the_verdict(
    tmp_path: Path, name: str, failures: int, errors: int
) -> None:
    """A run whose only criterion is met, yet which a safeguard fails or doubts, is not green."""
    little, report = tmp_path / 'little.yaml', tmp_path / 'r.xml'
    demand = 'came: {data: coverage, at_least: 0.1}'
    little.write_text(f'version: 1\nname: little\ncoverage: 0.1\ncriteria:\n  {demand}\n', 'utf-8')
    done = run(EVALUATE, SHIPPED / name, '--criteria', little, '--junit', report)
    assert done.exit_code == RUNS[name], done.output
    suites = JUnitXml.fromfile(str(report))
    assert (suites.failures, suites.errors) == (failures, errors)


def test_a_proposed_file_is_met_by_its_own_run(tmp_path: Path) -> None:
    """--init-criteria writes what --criteria reads, and a worse run does not meet it."""
    proposed = tmp_path / 'site.yaml'
    good, bad = SHIPPED / 'packbot_pass', SHIPPED / 'packbot_fail'
    assert run(EVALUATE, good, '--init-criteria', proposed).exit_code == 0
    assert run(EVALUATE, good, '--criteria', proposed).exit_code == 0
    assert run(EVALUATE, bad, '--criteria', proposed).exit_code == 1


def test_the_documented_criteria_judge_the_bad_run(tmp_path: Path, repository: Path) -> None:
    """The example of docs/criteria.md, every kind in it, from the file to the verdicts."""
    text = (repository / 'docs' / 'criteria.md').read_text('utf-8')
    site, out, page = (tmp_path / name for name in ('site.yaml', 'r.json', 'r.html'))
    site.write_text(text.split('```yaml\n')[1].split('```')[0], 'utf-8')
    bag = SHIPPED / 'packbot_fail'
    done = run(EVALUATE, bag, '--criteria', site, '--json', out, '--report', page)
    assert done.exit_code == 1
    result = json.loads(out.read_text('utf-8'))
    results = result['criteria']['results']
    assert {c['name']: c['verdict'] for c in results} == {
        'shoulder torque': 'FAIL',
        'tilt left while the arm reaches out': 'INCONCLUSIVE',  # it sinks to the ground
        'arm was out': 'PASS',
        'nothing went wrong': 'FAIL',
        'joint states came': 'PASS',
        'enough of the map': 'PASS',
    }
    words = ' '.join(' '.join(page_of(page).text).split())
    assert 'SPEC-12 3.2.1' in words
    # The arm starts beyond its 75 degrees and stays within them from then on; but where it lies on
    # the ground nothing is known. The alert clears a second later.
    [lying] = [a for a in result['alerts'] if a['code'] == 'ARM_ON_GROUND']
    kept = [float(x) for x in re.findall(r'kept for ([0-9.]+) s', words)]
    left = result['coverage']['duration_s'] - (lying['end_s'] - 1.0)
    assert any(x == pytest.approx(left, abs=0.02) for x in kept), (kept, left)


def test_nothing_is_proposed_from_a_bad_run(tmp_path: Path) -> None:
    """The verdict stands, no file is written, and one line says why."""
    proposed = tmp_path / 'site.yaml'
    done = run(EVALUATE, SHIPPED / 'packbot_fail', '--init-criteria', proposed)
    assert done.exit_code == 1
    assert 'expected a run that passes, got FAIL' in done.output
    assert not proposed.exists()


def test_a_report_is_of_one_recording(tmp_path: Path) -> None:
    """Two recordings and one report is an error before anything is read."""
    bags = [SHIPPED / 'packbot_pass', SHIPPED / 'packbot_fail']
    done = run(EVALUATE, *bags, '--report', tmp_path / 'r.html')
    assert '--report takes one recording, got 2' in str(done.exception)


def test_the_pdf_has_pages_or_one_line_says_why_not(tmp_path: Path) -> None:
    """Without WeasyPrint or Pango the verdict stands and everything else is written."""
    pdf = tmp_path / 'r.pdf'
    done = run(EVALUATE, SHIPPED / 'packbot_pass', '--pdf', pdf)
    assert done.exit_code == 0
    if pdf.exists():
        content = pdf.read_bytes()
        assert content.startswith(b'%PDF')
        assert len(content) > 20_000
    else:
        assert 'no PDF: expected WeasyPrint' in done.output


def test_without_weasyprint_one_line_says_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command that installs it is named, the verdict stands."""
    monkeypatch.setitem(__import__('sys').modules, 'weasyprint', None)
    done = run(EVALUATE, SHIPPED / 'packbot_pass', '--pdf', tmp_path / 'r.pdf')
    assert done.exit_code == 0
    assert 'pip install weasyprint' in done.output
    assert not (tmp_path / 'r.pdf').exists()
