"""What counts as a failure though no alert is critical, and what passes but is no success."""

from pathlib import Path
from typing import Any

import pytest
from campaign.fleet import campaign, said, write_run

from ugv_acceptance.campaign.carry_out import Place, carry_out
from ugv_acceptance.campaign.failure_log import UNKNOWN
from ugv_acceptance.campaign.failures import from_result
from ugv_acceptance.campaign.run_table import Row, row_of
from ugv_acceptance.campaign.sources import find_sources
from ugv_acceptance.campaign.statement import Origin, Question, statement
from ugv_acceptance.campaign.work import Brief
from ugv_acceptance.config import load
from ugv_acceptance.offline.evaluate import evaluate
from ugv_acceptance.report.campaign import campaign_page

ORIGIN = Origin('packbot', '', 'limits', None)
WAIVED = """
version: 1
name: rig
waive: {tipping: the test rig tips it, torque_limit: it holds the arm}
criteria:
  data: {data: coverage, at_least: 0.5}
"""


@pytest.mark.parametrize('effort', [70.0, 50.0, -70.0])
def test_an_effort_at_the_limit_is_a_failure(effort: float, tmp_path: Path) -> None:
    """Its cause is the motor named, with the worst effort and the limit."""
    write_run(tmp_path / 'run', 0, effort=effort)
    result = evaluate(tmp_path / 'run').result
    (failure,) = from_result('run', result)
    assert (failure.alert, failure.path) == ('EFFORT_LIMIT', 'physical / effector')
    assert f'{2.0 * abs(effort):.0f} % of its limit at 1.60 s' in failure.what
    assert f'{abs(effort):.1f} of 50.0 N m' in failure.what
    assert failure.at_s == pytest.approx(1.7, abs=0.1)


def test_an_effort_below_the_limit_is_none(tmp_path: Path) -> None:
    """At 90 % of the limit a CAUTION is raised, and no failure counted."""
    write_run(tmp_path / 'run', 0, effort=45.0)
    result = evaluate(tmp_path / 'run').result
    assert 'EFFORT_LIMIT' in {alert['code'] for alert in result['alerts']}
    assert from_result('run', result) == []


@pytest.mark.parametrize('meaning', ['scaled', 'none', 'constant'])
def test_an_effort_that_is_no_torque_reaches_no_limit(meaning: str, tmp_path: Path) -> None:
    """70 percent or amperes are not 70 N m, where the model check says so."""
    write_run(tmp_path / 'run', 0, effort=70.0)
    result = evaluate(tmp_path / 'run').result
    result['model_check']['joints'].setdefault('shoulder_joint', {})['meaning'] = meaning
    assert from_result('run', result) == []


def test_a_failed_campaign_says_the_effort(tmp_path: Path) -> None:
    """The failure is in campaign.json and on the page, and counts for the MTBF."""
    write_run(tmp_path / 'fleet' / 'strong', 0, effort=70.0)
    campaign(tmp_path / 'out', tmp_path / 'fleet', '--workers', '1')
    found = said(tmp_path / 'out')
    assert found['failures']['class'] == {'physical / effector': 1}
    assert found['mtbf_h']['value'] == pytest.approx(3.98 / 3600.0, rel=0.01)
    assert '70.0 of 50.0 N m' in (tmp_path / 'out' / 'campaign.html').read_text()


def failing(name: str, **values: Any) -> dict[str, Any]:
    """Return a safeguard that failed."""
    of = {'name': name, 'demand': '', 'verdict': 'FAIL', 'reasons': ['why it did'], 'evidence': []}
    return {**of, 'waived': None, **values}


@pytest.fixture
def calm(tmp_path: Path) -> dict[str, Any]:
    """The result of a run in which nothing happened."""
    write_run(tmp_path / 'run', 0)
    result = evaluate(tmp_path / 'run').result
    assert from_result('run', result) == []
    return result


@pytest.mark.parametrize('name', ['tipping', 'torque_limit', 'measured_effort', 'anything'])
def test_a_failed_safeguard_without_an_alert_is_a_failure(name: str, calm: dict[str, Any]) -> None:
    """A fall too short for an alert counts as well: the verdict shows it."""
    calm['safeguards'] = [failing(name)]
    (failure,) = from_result('run', calm)
    assert (failure.what, failure.origin, failure.impact) == ('why it did', 'verdict', UNKNOWN)


def test_a_failure_counts_once(tmp_path: Path) -> None:
    """The alert of a fall and the safeguard against it are one failure."""
    write_run(tmp_path / 'run', 0, tilt_deg=60.0)
    result = evaluate(tmp_path / 'run').result
    assert 'FAIL' in {held['verdict'] for held in result['safeguards']}
    assert [f.alert for f in from_result('run', result)] == ['TIP_OVER']


def test_a_waived_safeguard_is_no_failure_of_its_own(calm: dict[str, Any]) -> None:
    """Who waives it has said why."""
    calm['safeguards'] = [failing('tipping', waived='on the rig')]
    assert from_result('run', calm) == []


def test_a_pass_with_a_waived_safeguard_that_was_not_kept_is_doubtful(tmp_path: Path) -> None:
    """It is no success, is counted by itself, and named with the waiver; the exit code is 3."""
    write_run(tmp_path / 'fleet' / 'good', 0)
    write_run(tmp_path / 'fleet' / 'tips', 1, tilt_deg=60.0)
    (tmp_path / 'rig.yaml').write_text(WAIVED)
    options = ('--criteria', tmp_path / 'rig.yaml', '--workers', '1')
    code, text = campaign(tmp_path / 'out', tmp_path / 'fleet', *options)
    found = said(tmp_path / 'out')
    assert code == 3, text
    assert (found['runs']['PASS'], found['runs']['DOUBTFUL']) == (1, 1)
    assert (found['success']['passed'], found['success']['runs']) == (1, 2)
    assert 'tipping waived (the test rig tips it), and not kept: ' in text
    assert '1 DOUBTFUL' in text
    assert 'DOUBTFUL' in (tmp_path / 'out' / 'campaign.html').read_text()


def test_a_pass_by_relaxed_limits_is_doubtful(tmp_path: Path) -> None:
    """Limits beyond what is permitted make no success of a run."""
    write_run(tmp_path / 'run', 0)
    shipped = load()
    text = shipped.path.read_text().replace('../urdf', str(shipped.urdf_path.parent))
    text = text.replace('tip_error_deg: 5', 'tip_error_deg: -1')
    (tmp_path / 'robot.yaml').write_text(f'unsafe_limits: tried on a rig\n{text}')
    brief = Brief(load(tmp_path / 'robot.yaml'))
    (row,), _ = carry_out(find_sources([str(tmp_path / 'run')]), brief, Place(tmp_path / 'out', 1))
    assert row.verdict == 'DOUBTFUL'
    assert 'tried on a rig' in row.reasons[0]


def test_a_run_that_failed_is_not_doubtful(tmp_path: Path) -> None:
    """A doubt takes nothing from a FAIL."""
    write_run(tmp_path / 'run', 0, tilt_deg=60.0)
    result = evaluate(tmp_path / 'run').result
    result['start_ns'] = 0  # as a campaign adds
    result['safeguards'].append(failing('static_model', waived='slow enough'))
    assert row_of('run', '', result).verdict == 'FAIL'


def test_the_longest_run_has_the_failures_of_the_log(tmp_path: Path) -> None:
    """A failure that only a person saw, and one said not to count, are told of it too."""
    write_run(tmp_path / 'fleet' / 'run', 0)
    log = tmp_path / 'log.yaml'
    log.write_text('- {run: run, class: power, what: battery lost}\n')
    campaign(tmp_path / 'out', tmp_path / 'fleet', '--workers', '1', '--failures', log)
    assert said(tmp_path / 'out')['endurance']['failures'] == 1


def test_no_share_stands_without_its_bounds() -> None:
    """Every % of the page of successes has bounds, beside the numbers of runs."""
    words = ('PASS', 'PASS', 'INCONCLUSIVE', 'DOUBTFUL', 'FAIL')
    rows = [
        Row(f'run{k}', word, (), f'{k:064x}', k, None, 60.0, 60.0) for k, word in enumerate(words)
    ]
    found = statement(rows, [], Question(), ORIGIN)
    page = ' '.join(campaign_page(found).split())
    best = found['success']['if_unclear_had_passed']
    assert '2 of 5: 40.0 %, ' in page
    low, high = (f'{100.0 * best[k]:.1f} %' for k in ('low', 'high'))
    assert f'if all of them had passed: 4 of 5, {low} to {high}.' in page
