"""The verdict on a criterion: PASS, FAIL or INCONCLUSIVE, each with its reason."""

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pytest
from evaluation.streams import (
    T0,
    Imu,
    Joints,
    Message,
    S,
    batch_of,
    run_of,
    settings,
    tilted,
    upright,
)

from ugv_acceptance.evaluation.criteria.criteria import (
    ANY,
    AlertDemand,
    CriteriaSet,
    Criterion,
    DataDemand,
    Demand,
    MapDemand,
    Value,
    Window,
    default_criteria,
)
from ugv_acceptance.evaluation.criteria.findings import Findings
from ugv_acceptance.evaluation.criteria.measurement import CriteriaMeasurement
from ugv_acceptance.evaluation.criteria.uncertainty import Bounds, Source
from ugv_acceptance.evaluation.criteria.verdict import judge_criteria
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.summary import Summary, ordered, result_of

TOLD = settings()
# Level (the lift at 0.1 - 0.1 = 0 rad) the arm needs 40.7 N m of 45, up (at 1.0 rad) 22.0.
LEVEL, UP = (0.1, 0.0), (-0.9, 0.0)


def judged(
    criteria: CriteriaSet, messages: Sequence[Message], end: int, sources: Sequence[Source] = ()
) -> Any:
    """Return the judgement of a recording by criteria."""
    measurement = CriteriaMeasurement(criteria, TOLD, T0, end)
    evaluator, summary = RecordedEvaluator(TOLD, measurement.detail), Summary(TOLD, T0)
    evaluator.start(T0)
    batch = batch_of(messages)
    measurement.payloads.take(batch.payload)
    rows = evaluator.batch(batch)
    measurement.add(rows)
    summary.add(rows)
    for finish in (evaluator.finish, measurement.finish, summary.finish):
        finish(end)
    alerts = ordered(evaluator.watch.log)
    source = {'rate_hz': 50.0, 'gaps': 0, 'longest_gap_s': 0.0, 'messages': 1, 'malformed': 0}
    data = {
        **result_of(summary, alerts, T0, end - T0),
        'inputs': {'joint_states': source, 'imu': {**source, 'rate_hz': None}, 'late_messages': 0},
        'bag': {'protected': 'part', 'salvaged': None, 'lost_messages': 0, 'findings': []},
    }
    return judge_criteria(Findings(measurement, alerts, data, Bounds(TOLD, tuple(sources))))


def outcome(
    demand: Demand,
    messages: Sequence[Message],
    sources: Sequence[Source] = (),
    *,
    end: int = T0 + 2 * S,
    window: Window | None = None,
    method: str = 'rss',
    own: str | None = None,
) -> Any:
    """Return what becomes of one criterion."""
    criterion = Criterion('it', demand, window=window, uncertainty=own)
    criteria = CriteriaSet('set', 1, (criterion,), '', 'a.yaml', uncertainty=method)
    return judged(criteria, messages, end, sources)['criteria']['results'][0]


def moving(*stretches: tuple[float, float, tuple[float, float]]) -> list[Message]:
    """Return a run of 2 s, level but where a stretch (from, to, position) says otherwise."""
    found: list[Message] = []
    for message in run_of(2.0):
        at = (message.time - T0) / S
        for start, end, position in stretches:
            if isinstance(message, Joints) and start <= at < end:
                message = replace(message, position=position)  # noqa: PLW2901
        found.append(message)
    return found


TORQUE = Value('torque', 'lift', below=True, limit=25.0)


@pytest.mark.parametrize(
    ('demand', 'verdict'),
    [
        (TORQUE, 'FAIL'),
        (replace(TORQUE, limit=41.0), 'PASS'),
        (replace(TORQUE, time_in_violation=0.7), 'PASS'),
        (replace(TORQUE, time_in_violation=0.5), 'FAIL'),
        (replace(TORQUE, longest_violation=0.35), 'PASS'),
        (replace(TORQUE, longest_violation=0.25), 'FAIL'),
        (replace(TORQUE, share_in_violation=0.35), 'PASS'),
        (replace(TORQUE, share_in_violation=0.25), 'FAIL'),
        (replace(TORQUE, longest_violation=0.35, share_in_violation=0.25), 'FAIL'),
        (replace(TORQUE, dwell=0.4), 'PASS'),
        (replace(TORQUE, dwell=1.2), 'FAIL'),
    ],
    ids=str,
)
def test_a_value_is_judged_by_its_demand(demand: Value, verdict: str) -> None:
    """A value can be judged by its worst, total time, longest time, share or dwell in violation."""
    run = moving((0.0, 0.5, UP), (0.8, 1.2, UP), (1.5, 2.0, UP))
    assert outcome(demand, run)['verdict'] == verdict


def test_the_limit_itself_is_a_violation() -> None:
    """A value must stay below, as an alert is raised from its limit on."""
    worst = outcome(TORQUE, moving())['measured']['worst']
    assert outcome(replace(TORQUE, limit=worst), moving())['verdict'] == 'FAIL'
    assert outcome(replace(TORQUE, limit=worst * (1 + 1e-12)), moving())['verdict'] == 'PASS'


def test_a_criterion_counts_in_its_window_only() -> None:
    """A violation from 0.5 s to 0.8 s fails only a criterion whose window holds it."""
    run = moving((0.0, 0.5, UP), (0.8, 2.0, UP))
    assert outcome(TORQUE, run, window=(1.0, 1.9))['verdict'] == 'PASS'
    assert outcome(TORQUE, run, window=(0.0, 0.7))['verdict'] == 'FAIL'


def test_missing_data_never_pass() -> None:
    """A run that ends before a criterion's window does cannot pass it."""
    found = outcome(replace(TORQUE, limit=44.0), moving(), window=(1.0, 4.0))
    assert found['verdict'] == 'INCONCLUSIVE'
    assert found['reason'] == 'only 33.3 % of 1 to 4 s could be evaluated (95 % needed)'


def test_a_violation_fails_also_where_data_are_missing() -> None:
    """A violation that was seen fails a criterion even if data are missing elsewhere."""
    assert outcome(TORQUE, moving(), window=(1.0, 4.0))['verdict'] == 'FAIL'


def test_how_much_has_to_be_evaluated_is_for_the_criteria_to_say() -> None:
    """A criterion sets the share of its window that must be evaluated: a third is enough here."""
    criterion = Criterion('it', replace(TORQUE, limit=44.0), window=(1.0, 4.0))
    waived = (('unseen_stretches', 'only the beginning matters'),)
    criteria = CriteriaSet('set', 1, (criterion,), '', 'a.yaml', coverage=0.3, waive=waived)
    assert judged(criteria, moving(), T0 + 2 * S)['verdict'] == 'PASS'


def test_a_failure_shows_the_worst_moment_the_first_and_the_alerts_about_it() -> None:
    """A failure names its worst moment, its first violation and the alerts about it."""
    found = outcome(replace(TORQUE, limit=42.0), loaded())
    measured = found['measured']
    assert measured['worst_of'] == 'lift'
    assert 0.5 <= measured['at_s'] < 1.5
    assert measured['moment']['joints']['slide']['position'] == pytest.approx(0.2)
    assert measured['first_violations_s'][0] == pytest.approx([0.5, 1.5], abs=0.03)
    assert [line.split(' from')[0] for line in found['evidence']] == ['CAUTION TORQUE_LIMIT']


def test_a_dwell_that_was_too_short_says_how_long_it_was() -> None:
    """Up from 0.8 s to 1.2 s where 1.2 s were asked for."""
    found = outcome(replace(TORQUE, dwell=1.2), moving((0.8, 1.2, UP)))
    assert found['measured']['longest_kept_s'] == pytest.approx(0.4, abs=0.03)
    assert re.match(r'it: held for 0\.\d+ s; required: ', found['reason'])


def test_a_run_is_the_worst_of_its_criteria() -> None:
    """FAIL before INCONCLUSIVE before PASS, with the reasons of that verdict."""
    met = Criterion('met', replace(TORQUE, limit=44.0))
    unknown = Criterion('unknown', DataDemand('rate', 'imu', least=1.0))
    broken = Criterion('broken', AlertDemand(raised=True, code='TIP_OVER'))
    for several, verdict, name in (
        ((met, unknown), 'INCONCLUSIVE', 'unknown'),
        ((met, unknown, broken), 'FAIL', 'broken'),
    ):
        found = judged(CriteriaSet('set', 1, several, '', 'a.yaml'), moving(), T0 + 2 * S)
        assert found['verdict'] == verdict
        assert [reason.split(':')[0] for reason in found['reasons']] == [name]


MASS = Source('arm.mass_kg', 'arm', 'mass', 0.4)


@pytest.mark.parametrize(
    ('limit', 'method', 'verdict'),
    [
        (40.0, 'rss', 'FAIL'),
        (42.0, 'rss', 'INCONCLUSIVE'),
        (42.0, 'ignored', 'PASS'),
        (43.0, 'rss', 'PASS'),
    ],
)
def test_a_pass_within_its_uncertainty_is_inconclusive(
    limit: float, method: str, verdict: str
) -> None:
    """0.4 kg at half a metre are 1.96 N m: 40.7 of 42 is within, of 43 beyond; unless ignored.

    A violation stays one within its uncertainty.
    """
    found = outcome(replace(TORQUE, limit=limit), moving(), [MASS], method=method)
    assert found['measured']['uncertainty']['bound'] == pytest.approx(0.4 * 9.81 * 0.5, rel=1e-6)
    assert found['verdict'] == verdict


def test_a_criterion_may_ignore_the_uncertainty_for_itself() -> None:
    """A criterion's own method for uncertainty overrides the file's."""
    found = outcome(replace(TORQUE, limit=42.0), moving(), [MASS], own='ignored')
    assert found['verdict'] == 'PASS'


@pytest.mark.parametrize(('method', 'verdict'), [('rss', 'PASS'), ('worst_case', 'INCONCLUSIVE')])
def test_worst_case_adds_what_rss_squares(method: str, verdict: str) -> None:
    """Two effects of 1.96 N m are 2.8 N m as a root of squares and 3.9 N m as a sum."""
    twice = [MASS, replace(MASS, name='again')]
    found = outcome(replace(TORQUE, limit=44.0), moving(), twice, method=method)
    assert found['verdict'] == verdict


LOW = Value('tip_angle', ANY, below=False, limit=0.1)
WARNED = AlertDemand(raised=True, code='TORQUE_LIMIT', of='lift', level='WARN')


def loaded() -> list[Message]:
    """Return a run whose arm reaches out from 0.5 s to 1.5 s: a warning from 0.6 s on."""
    out = (0.1, 0.2)
    return moving((0.0, 0.5, UP), (0.5, 1.5, out), (1.5, 2.0, UP))


@pytest.mark.parametrize(
    ('demand', 'window', 'verdict'),
    [
        (WARNED, (0.5, 0.8), 'PASS'),
        (WARNED, (0.8, 1.8), 'FAIL'),
        (WARNED, (1.5, 9.0), 'INCONCLUSIVE'),
        (replace(WARNED, raised=False), (0.0, 0.5), 'PASS'),
        (replace(WARNED, raised=False), (0.9, 1.2), 'FAIL'),
        (replace(WARNED, raised=False), (0.0, 9.0), 'FAIL'),
        (replace(WARNED, raised=False, of='slide'), (0.0, 9.0), 'INCONCLUSIVE'),
        (replace(WARNED, raised=False, level='ERROR'), None, 'PASS'),
        (AlertDemand(raised=False), None, 'FAIL'),
    ],
    ids=str,
)
def test_alerts_are_expected_and_forbidden_in_windows(
    demand: AlertDemand, window: Window | None, verdict: str
) -> None:
    """Expected: it starts in the window. Forbidden: it is never active in it."""
    assert outcome(demand, loaded(), window=window)['verdict'] == verdict


@pytest.mark.parametrize(
    ('demand', 'verdict'),
    [
        (DataDemand('coverage', least=0.9), 'PASS'),
        (DataDemand('protected', least=1.0), 'INCONCLUSIVE'),
        (DataDemand('protected', least=1.0, fails=True), 'FAIL'),
        (DataDemand('rate', 'joint_states', least=45.0), 'PASS'),
        (DataDemand('rate', least=45.0), 'INCONCLUSIVE'),
        (DataDemand('longest_gap', most=0.1), 'PASS'),
        (DataDemand('rate', 'joint_states', least=40.0, most=45.0), 'INCONCLUSIVE'),
    ],
    ids=str,
)
def test_data_are_judged_by_their_numbers(demand: DataDemand, verdict: str) -> None:
    """A number out of bounds or unknown makes a run inconclusive, or fails it if asked to."""
    assert outcome(demand, moving())['verdict'] == verdict


@pytest.mark.parametrize(('least', 'verdict'), [(0.01, 'PASS'), (0.5, 'INCONCLUSIVE')])
def test_a_run_must_visit_the_map(least: float, verdict: str) -> None:
    """A run that stays where it is visits one cell of sixty."""
    demand = MapDemand(('lift', 'slide'), ((0.0, 1.0), (-0.2, 0.4)), (0.1, 0.1), least)
    assert outcome(demand, moving())['verdict'] == verdict


def test_without_criteria_the_limits_of_the_configuration_hold() -> None:
    """A quiet run passes, one over its torque limit fails, a silent one is inconclusive."""
    quiet, criteria = moving(), default_criteria(TOLD)
    assert judged(criteria, quiet, T0 + 2 * S)['verdict'] == 'PASS'
    assert judged(criteria, quiet, T0 + 4 * S)['verdict'] == 'INCONCLUSIVE'
    heavy = [*moving((0.5, 0.6, (0.1, 0.4)))]
    told = replace(criteria, criteria=tuple(_tighter(c) for c in criteria.criteria))
    found = judged(told, heavy, T0 + 2 * S)
    assert found['verdict'] == 'FAIL'
    assert '% of its limit' in found['reasons'][0]


def _tighter(criterion: Criterion) -> Criterion:
    """Return a torque criterion at four fifths of its limit."""
    demand = criterion.demand
    if isinstance(demand, Value) and demand.of == 'lift':
        return replace(criterion, demand=replace(demand, limit=0.75))
    return criterion


def test_a_robot_on_its_side_fails() -> None:
    """A robot tilted by 70 degrees fails the tip-over criterion."""
    tilt = tilted(math.radians(70.0))
    run = [
        replace(m, orientation=tilt, acceleration=upright(tilt)) if isinstance(m, Imu) else m
        for m in moving()
    ]
    found = judged(default_criteria(TOLD), run, T0 + 2 * S)
    assert found['verdict'] == 'FAIL'
    assert 'past tipping: RIGHT' in found['reasons'][0]


def test_the_hash_of_the_defaults_is_that_of_their_content() -> None:
    """Another limit gives another hash; the same limits the same."""
    other = settings(limits=replace(TOLD.limits, tip_error=0.1))
    assert default_criteria(TOLD).sha256 == default_criteria(settings()).sha256
    assert default_criteria(TOLD).sha256 != default_criteria(other).sha256
