"""How much must be evaluated, and criteria on alerts, data and maps exactly at their limits."""

import math
from dataclasses import replace
from typing import Any

import pytest
from evaluation.hand_made import alert, findings, made, seconds
from evaluation.streams import settings

from ugv_acceptance.evaluation.alerts.state_machine import ERROR, STALE, WARN
from ugv_acceptance.evaluation.criteria.criteria import (
    AlertDemand,
    DataDemand,
    Demand,
    MapDemand,
    Value,
)
from ugv_acceptance.evaluation.criteria.findings import short_of_data
from ugv_acceptance.evaluation.criteria.verdict import judge_criteria

TOLD = settings()
S = 1_000_000_000
QUIET = made(seconds(0, 1), until=seconds(1, 10))
BELOW = Value('torque', 'lift', below=True, limit=25.0)
COVERED = {
    'bag': {'salvaged': None, 'lost_messages': 0},
    'coverage': {'fraction': 0.987, 'duration_s': 10.0, 'unseen_s': [], 'unseen_stretches': 0},
    'stability': {'min_angle_deg': 20.0},
    'torque': {},
}


def judged(demand: Demand, *parts: Any, **options: Any) -> Any:
    """Return the judgement of one criterion over a quiet run, or over other rows."""
    options.setdefault('data', COVERED)
    _, found = findings(TOLD, demand, parts or (QUIET,), **options)
    return judge_criteria(found)


@pytest.mark.parametrize(
    ('evaluated', 'needed', 'end', 'window', 'reason'),
    [
        (9.5, 0.95, 10.0, None, None),
        (9.49, 0.95, 10.0, None, 'only 94.9 % of the recording could be evaluated (95 % needed)'),
        (2.0, 0.5, 10.0, (1.0, 5.0), None),
        (1.0, 0.5, 10.0, (1.0, 5.0), 'only 25.0 % of 1 to 5 s could be evaluated (50 % needed)'),
        (0.0, 0.0, 0.0, None, 'only 0.0 % of the recording could be evaluated (0 % needed)'),
    ],
)
def test_too_little_data_are_told_as_a_share(
    evaluated: float, needed: float, end: float, window: Any, reason: str | None
) -> None:
    """Of the window; as much as needed is enough; a recording without length never is."""
    criterion, found = findings(TOLD, BELOW, end=end, window=window, coverage=needed)
    assert short_of_data(round(evaluated * S), criterion, found) == reason


def test_seconds_count_from_the_start_of_the_recording() -> None:
    """Times in an outcome are seconds from the recording's start."""
    _, found = findings(TOLD, BELOW)
    assert found.seconds(seconds(2.5)[0]) == 2.5


@pytest.mark.parametrize(
    ('start', 'end', 'raised', 'absent'),
    [
        (2.0, 3.0, 'PASS', 'FAIL'), (8.0, None, 'PASS', 'FAIL'), (1.99, 2.0, 'FAIL', 'PASS'),
        (1.0, 2.01, 'FAIL', 'FAIL'), (1.0, None, 'FAIL', 'FAIL'), (8.01, None, 'FAIL', 'PASS'),
    ],
)  # fmt: skip
def test_an_alert_counts_in_its_window(
    start: float, end: float | None, raised: str, absent: str
) -> None:
    """Expected: it starts from 2 s to 8 s. Forbidden: it is active then, not just until 2 s."""
    alerts = [alert('TIP_OVER', 'left', start, end, ERROR)]
    for demand, verdict in (
        (AlertDemand(raised=True), raised),
        (AlertDemand(raised=False), absent),
    ):
        found = judged(demand, window=(2.0, 8.0), alerts=alerts)['criteria']['results'][0]
        assert found['verdict'] == verdict
        counted = demand.raised == (verdict == 'PASS')
        assert found['measured'] == {'alerts': int(counted), 'evaluated_s': 6.0}
        assert len(found['evidence']) == counted


@pytest.mark.parametrize(
    ('least', 'most', 'verdict'),
    [
        (50.0, 90.0, 'PASS'), (10.0, 50.0, 'PASS'), (50.01, 90.0, 'INCONCLUSIVE'),
        (10.0, 49.99, 'INCONCLUSIVE'), (50.0, math.inf, 'PASS'),
    ],
)  # fmt: skip
def test_a_number_of_the_data_may_be_at_its_bound(least: float, most: float, verdict: str) -> None:
    """A number of the data exactly at its bound meets the demand; a violation names the number."""
    data = {**COVERED, 'inputs': {'imu': {'rate_hz': 50.0}, 'joint_states': {'rate_hz': None}}}
    found = judged(DataDemand('rate', 'imu', least, most), data=data)['criteria']['results'][0]
    assert found['verdict'] == verdict
    assert found['measured'] == {
        'quantity': 'rate',
        'unit': 'Hz',
        'least': least,
        'most': most if math.isfinite(most) else None,
        'values': {'imu': 50.0},
    }
    if verdict != 'PASS':
        assert found['reason'].startswith('it: imu 50 Hz; rate of imu: at least ')
    both = judged(DataDemand('rate', least=least), data=data)['criteria']['results'][0]
    assert 'joint_states unknown' in both['reason']
    short = judged(DataDemand('coverage', least=0.99), data=data)['reasons'][0]
    assert short == 'only 98.7 % of the recording could be evaluated (99 % needed)'


@pytest.mark.parametrize(('least', 'verdict'), [(0.5, 'PASS'), (0.51, 'INCONCLUSIVE')])
def test_the_share_of_a_map_is_of_its_cells(least: float, verdict: str) -> None:
    """The visited share of a map is the number of cells visited over all of its cells."""
    demand = MapDemand(('lift', 'slide'), ((0.0, 1.0), (0.0, 0.2)), (0.5, 0.1), least)
    rows = made(seconds(0, 1), until=seconds(1, 10), q=[(0.1, 0.05), (0.7, 0.15)])
    found = judged(demand, rows)['criteria']['results'][0]
    assert found['verdict'] == verdict
    assert found['measured'] == {'cells': 4, 'visited': 2, 'share': 0.5}
    if verdict != 'PASS':
        assert found['reason'] == 'it: the run visited 2 of 4 cells (50.0 %); 51 % needed'


def test_faults_of_the_input_explain_what_is_inconclusive_and_nothing_else() -> None:
    """Input faults are the reasons of an INCONCLUSIVE run only, not of a pass or a failure."""
    alerts = [
        alert('INPUT_STALE', 'imu', 1.0, 2.0, STALE),
        alert('INPUT_STALE', 'imu', 3.0, 4.0, STALE),
        alert('CLOCK', 'imu', 1.0, 2.0, WARN),
        alert('TIP_OVER', 'left', 1.0, 2.0, ERROR),
    ]
    met = Value('torque', 'lift', below=True, limit=1.0)
    broken = replace(met, limit=0.0)
    assert judged(met, alerts=alerts)['reasons'] == [
        'all criteria met, 98.7 % of the recording evaluated'
    ]
    assert len(judged(broken, alerts=alerts)['reasons']) == 1
    found = judged(met, alerts=alerts, end=99.0)
    assert found['verdict'] == 'INCONCLUSIVE'
    assert found['reasons'][:-1] == ['no message from imu']
