"""Safeguards: no criteria overlook a robot that tips, a joint beyond its limit, a blind spot."""

from dataclasses import replace
from typing import Any

import pytest
from evaluation.hand_made import alert, findings, made, seconds
from evaluation.streams import settings

from ugv_acceptance.evaluation.criteria.assumptions import assumptions
from ugv_acceptance.evaluation.criteria.criteria import (
    ANY,
    AlertDemand,
    CriteriaSet,
    DataDemand,
    Demand,
    Value,
    Window,
)
from ugv_acceptance.evaluation.criteria.findings import Findings
from ugv_acceptance.evaluation.criteria.safeguards import (
    SAFEGUARDS,
    Safeguarded,
    safeguards_result,
    with_objection,
)
from ugv_acceptance.evaluation.criteria.statement import NotChecked, Objection, Statement
from ugv_acceptance.evaluation.criteria.verdict import judge_criteria
from ugv_acceptance.model.robot import Payload

TOLD = settings()
QUIET = made(seconds(0, 1), until=seconds(1, 10))
# Demands nothing.
NOTHING = DataDemand('duration', least=0.0)
GOOD: dict[str, Any] = {
    'bag': {'salvaged': None, 'lost_messages': 0},
    'coverage': {
        'fraction': 0.99, 'duration_s': 10.0, 'unseen_s': [], 'unseen_stretches': 0,
        'longest_unseen_s': 0.2,
    },
    'stability': {'min_angle_deg': 20.0, 'edge': 'left', 'time_of_min_s': 3.0},
    'torque': {'lift': {'max_abs': 20.0, 'limit': 45.0, 'unit': 'N m', 'time_of_min_s': 4.0}},
}  # fmt: skip
TIPPED = {**GOOD, 'stability': {'min_angle_deg': -2.5, 'edge': 'left', 'time_of_min_s': 3.0}}
OVER = {**GOOD, 'torque': {'lift': {**GOOD['torque']['lift'], 'max_abs': 45.0}}}
BLIND = {
    **GOOD,
    'coverage': {
        **GOOD['coverage'],
        'unseen_s': [[1.0, 2.4]],
        'unseen_stretches': 1,
        'longest_unseen_s': 1.4,
    },
}
CUT = {**GOOD, 'bag': {**GOOD['bag'], 'salvaged': 'run_0 is missing'}}
LOSSY = {**GOOD, 'bag': {**GOOD['bag'], 'lost_messages': 7}}
SHORT = {**GOOD, 'coverage': {**GOOD['coverage'], 'duration_s': 0.4}}


def judged(data: Any, demand: Demand = NOTHING, **options: Any) -> Any:
    """Return the judgement of a run by one criterion; `waive` and `statements` are options."""
    waive, statements = options.pop('waive', ()), options.pop('statements', ())
    _, found = findings(TOLD, demand, (QUIET,), data=data, **options)
    criteria = replace(found.measurement.criteria, waive=waive)
    found.measurement.criteria = criteria
    return judge_criteria(replace(found, statements=statements))


@pytest.mark.parametrize(
    ('data', 'verdict', 'reason'),
    [
        (GOOD, 'PASS', 'all criteria met'),
        (TIPPED, 'FAIL', '2.5 deg past tipping: LEFT at 3.00 s'),
        (OVER, 'FAIL', 'lift 100 % of its limit at 4.00 s: it needs 45.0 of 45.0 N m'),
        (BLIND, 'INCONCLUSIVE', 'no margins from 1.00 to 2.40 s (1.40 s)'),
        (CUT, 'INCONCLUSIVE', 'the recording is not whole: run_0 is missing'),
        (LOSSY, 'INCONCLUSIVE', '7 messages are missing'),
    ],
)
def test_what_criteria_do_not_ask_for_counts(data: Any, verdict: str, reason: str) -> None:
    """A file that demands only a duration does not make a pass of it."""
    found = judged(data)
    assert found['verdict'] == verdict
    assert found['reasons'][0].startswith(reason)


@pytest.mark.parametrize(
    ('data', 'name'),
    [
        (TIPPED, 'tipping'),
        (OVER, 'torque_limit'),
        (BLIND, 'unseen_stretches'),
        (CUT, 'recording'),
        (LOSSY, 'recording'),
    ],
)
def test_a_waiver_stands_in_the_first_line(data: Any, name: str) -> None:
    """With its reason; what it waives stays on record with the verdict it had."""
    found = judged(data, waive=((name, 'on the test rig'),))
    assert found['verdict'] == 'PASS'
    assert found['reasons'][0] == f'{name} waived (on the test rig)'
    (of,) = (s for s in found['safeguards'] if s['name'] == name)
    assert of['waived'] == 'on the test rig'
    assert of['verdict'] != 'PASS'
    assert of['reasons']
    assert [s['name'] for s in found['safeguards']] == list(SAFEGUARDS)


def test_a_waiver_of_another_safeguard_does_not_help() -> None:
    """Each is waived by its own name."""
    assert judged(TIPPED, waive=(('torque_limit', 'rig'),))['verdict'] == 'FAIL'


def test_criteria_may_say_how_long_a_stretch_without_margins_may_be() -> None:
    """Their own demand replaces the half second."""
    assert judged(BLIND, DataDemand('longest_unseen', most=1.5))['verdict'] == 'PASS'
    assert judged(BLIND, DataDemand('longest_unseen', most=1.3))['verdict'] == 'INCONCLUSIVE'


def test_criteria_may_say_how_much_of_a_recording_may_be_missing() -> None:
    """Their own demand replaces the safeguard's, each for its own quantity."""
    assert judged(LOSSY, DataDemand('lost_messages', most=9.0))['verdict'] == 'PASS'
    assert judged(LOSSY, DataDemand('lost_messages', most=6.0))['verdict'] == 'INCONCLUSIVE'
    assert judged(LOSSY, DataDemand('salvaged', most=1.0))['verdict'] == 'INCONCLUSIVE'
    assert judged(CUT, DataDemand('salvaged', most=1.0))['verdict'] == 'PASS'
    assert judged(SHORT, DataDemand('duration', least=0.3))['verdict'] == 'PASS'
    of = judged(SHORT, DataDemand('salvaged', most=0.0))
    assert (of['verdict'], of['reasons'][0]) == ('INCONCLUSIVE', 'the recording lasts 0.4 s')


def test_a_failed_criterion_is_not_said_twice() -> None:
    """The reasons name the tilt once where a criterion failed on it as well."""
    rows = made(seconds(0, 1), until=seconds(1, 10), angle=[(1.0, -0.04, 1.0, 1.0)] * 2)
    criterion = Value('tip_angle', ANY, below=False, limit=0.0)
    _, found = findings(TOLD, criterion, (rows,), data=TIPPED)
    reasons = judge_criteria(found)['reasons']
    assert len(reasons) == 1
    assert 'past tipping: LEFT' in reasons[0]


def test_an_alert_that_is_an_objection_is_one() -> None:
    """Such as a frozen encoder: the run is inconclusive, and the joint is named once."""
    stuck = [alert('ENCODER_FROZEN', 'lift', t, None) for t in (1.0, 3.0)]
    found = judged(GOOD, alerts=stuck)
    assert found['verdict'] == 'INCONCLUSIVE'
    assert [r for r in found['reasons'] if 'lift' in r] == found['reasons'][:1]


@pytest.mark.parametrize(
    ('code', 'subject', 'words'),
    [('TIP_AHEAD', 'left', 'it tips within'), ('TORQUE_AHEAD', 'lift', 'lift')],
)
def test_a_recording_does_not_end_on_the_way_to_a_limit(
    code: str, subject: str, words: str
) -> None:
    """A limit is passed within a second of the last message, or not: nobody saw which."""
    assert judged(GOOD, alerts=[alert(code, subject, 8.0, 9.0)])['verdict'] == 'PASS'
    found = judged(GOOD, alerts=[alert(code, subject, 9.8, None)])
    assert found['verdict'] == 'INCONCLUSIVE'
    assert found['reasons'][0].startswith('the recording ends too early: ')
    assert words in found['reasons'][0]


def test_what_an_examination_states_counts() -> None:
    """Its objections decide, and what it did not check is passed on."""
    objection = Objection('residual', 'INCONCLUSIVE', 'lift differs by 9 N m', ('at 4 s',))
    stated = Statement(objections=(objection,), not_checked=(NotChecked('yaw', 'no yaw', 3.5),))
    found = judged(GOOD, statements=(stated,))
    assert (found['verdict'], found['reasons']) == ('INCONCLUSIVE', ['lift differs by 9 N m'])
    assert found['not_checked'] == [{'what': 'yaw', 'why': 'no yaw', 'seconds': 3.5}]
    (of,) = (s for s in found['safeguards'] if s['verdict'] != 'PASS')
    assert (of['name'], of['evidence']) == ('residual', ['at 4 s'])


def test_an_objection_found_later_replaces_the_verdict() -> None:
    """And the reasons of another verdict; those of the same verdict stay below it."""
    late = Objection('payload', 'INCONCLUSIVE', 'the load was told late')
    found = judged(GOOD)
    assert with_objection(found, late)['verdict'] == 'INCONCLUSIVE'
    assert with_objection(found, late)['reasons'] == ['the load was told late']
    again = with_objection(judged(BLIND), late)['reasons']
    assert again[0] == 'the load was told late'
    assert len(again) == 2
    waived = judged(GOOD, waive=(('payload', 'known'),))
    assert list(with_objection(waived, late)) == ['safeguards']


def test_alerts_from_margins_in_doubt_decide_nothing() -> None:
    """A tip-over alert drawn from an IMU that contradicted itself is no failure of the robot."""
    criterion = 'TIP_OVER'
    alerts = [alert(criterion, 'left', 2.0, 3.0)]
    demand = AlertDemand(raised=False, code=criterion)
    _, found = findings(TOLD, demand, (QUIET,), data=GOOD, alerts=alerts)
    assert judge_criteria(found)['verdict'] == 'FAIL'
    begin, end = seconds(1.5, 2.5)
    assert judge_criteria(replace(found, doubtful=[(begin, end)]))['verdict'] == 'PASS'
    begin, end = seconds(2.1, 2.5)
    assert judge_criteria(replace(found, doubtful=[(begin, end)]))['verdict'] == 'FAIL'


@pytest.mark.parametrize(
    ('demand', 'window', 'words'),
    [
        (Value('tip_angle', ANY, below=False, limit=-3.0), None, ' deg past tipping'),
        (
            Value('tip_angle', 'left', below=False, limit=0.2),
            None,
            'criteria demand them only to the left',
        ),
        (Value('torque', 'lift', below=True, limit=9.0), None, 'no criterion demands any'),
        (
            Value('torque_utilisation', 'lift', below=True, limit=1.4),
            None,
            'allows 140 % of the',
        ),
        (
            Value('torque', 'lift', below=True, limit=9.0, share_in_violation=1.0),
            None,
            'it cannot fail: it may be violated all the time',
        ),
        (
            Value('torque', 'lift', below=True, limit=9.0, time_in_violation=10.0),
            None,
            'it cannot fail: it may be violated all the time',
        ),
        (
            Value('torque', 'lift', below=True, limit=9.0),
            (12.0, 13.0),
            'its window begins at 12 s, after',
        ),
        (NOTHING, None, 'no criterion demands any'),
    ],
)
def test_criteria_that_cannot_fail_are_told(
    demand: Demand, window: Window | None, words: str
) -> None:
    """They stand among what was not checked."""
    _, found = findings(TOLD, demand, (QUIET,), window=window)
    whys = [one.why for one in assumptions(TOLD, (), found.measurement, None).not_checked]
    assert any(words in why for why in whys), whys


def test_a_window_outside_the_recording_never_passes() -> None:
    """Even with a coverage of 0, by which nothing would have to be evaluated."""
    demand = Value('torque', 'lift', below=True, limit=9.0)
    found = judged(GOOD, demand, window=(12.0, 13.0), coverage=0.0)
    assert found['verdict'] == 'INCONCLUSIVE'
    assert 'no value could be computed' in found['reasons'][0]
    absent = judged(GOOD, AlertDemand(raised=False), window=(12.0, 13.0), coverage=0.0)
    assert absent['verdict'] == 'INCONCLUSIVE'
    assert 'its window begins at 12 s, after the end' in absent['reasons'][0]


def _unchecked(found: Findings, told: Any, first: Any, sources: Any = ()) -> list[str]:
    return [o.what for o in assumptions(told, sources, found.measurement, first).not_checked]


def test_the_load_is_assumed_unless_it_is_told_or_known() -> None:
    """A payload that no message declares is an assumption; `payload.known` makes it a fact."""
    _, found = findings(TOLD, NOTHING, (QUIET,))
    assert 'load' in _unchecked(found, TOLD, None)
    assert 'load' not in _unchecked(found, TOLD, (seconds(0)[0], Payload(2.0)))
    assert 'load' not in _unchecked(found, replace(TOLD, payload_known=True), None)


def test_margins_without_a_bound_are_told() -> None:
    """Where the configuration states no uncertainty."""
    _, found = findings(TOLD, NOTHING, (QUIET,))
    assert 'margins without a bound' in _unchecked(found, TOLD, None)
    assert 'margins without a bound' not in _unchecked(found, TOLD, None, ('a source',))


def test_joints_without_a_limit_are_told() -> None:
    """Their torques are not judged."""
    _, found = findings(TOLD, NOTHING, (QUIET,))
    free = replace(TOLD, limits=replace(TOLD.limits, torque=(45.0, float('inf'))))
    assert any('torque of slide' in what for what in _unchecked(found, free, None))
    assert not [what for what in _unchecked(found, TOLD, None) if 'torque of' in what]


def test_default_criteria_have_nothing_to_tell_of_themselves() -> None:
    """What they demand is the configuration's own limits."""
    _, found = findings(TOLD, NOTHING, (QUIET,))
    found.measurement.criteria = CriteriaSet('defaults', 1, (), '')
    told = _unchecked(found, TOLD, None)
    assert not [what for what in told if 'criterion' in what or 'tilt' in what]


def test_a_safeguard_without_its_input_is_not_called_checked() -> None:
    """Without an IMU nobody knows if the robot tipped; without limits no torque is judged."""
    _, found = findings(TOLD, NOTHING, (QUIET,), data=GOOD)
    level = replace(TOLD, imu=replace(TOLD.imu, attitude='level'))
    unlimited = replace(level, limits=replace(TOLD.limits, torque=(float('inf'),) * 2))
    without = {'tipping', 'ground', 'chassis_acceleration', 'imu', 'torque_limit'}
    for told, names in ((TOLD, set()), (unlimited, without)):
        held = Safeguarded((), ())
        result = safeguards_result(held, found.measurement.criteria, told)
        assert {one['name'] for one in result if not one['checked']} == names
