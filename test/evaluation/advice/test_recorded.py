"""Advice on the alerts of a recording: for the moment each was raised, at a bounded cost."""

import math
from dataclasses import replace

import pytest
from evaluation.margin_rows import rows
from evaluation.streams import (
    T0,
    Carry,
    Imu,
    Joints,
    Message,
    S,
    batch_of,
    live,
    run_of,
    settings,
    split,
    tilted,
    upright,
)

from ugv_acceptance.evaluation.advice import recorded as alert_advice
from ugv_acceptance.evaluation.advice.recorded import AlertAdvice
from ugv_acceptance.evaluation.advice.search import COMPUTED, advise
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, WARN, Alert, Rule
from ugv_acceptance.evaluation.inputs.payload import PayloadLog
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.settings import Limits
from ugv_acceptance.model.robot import Payload

SETTINGS = settings(limits=Limits((45.0, 30.0), tip_warn=0.6, tip_error=0.3))
LOAD = Payload(2.0, (0.0, 0.0, 0.0))


def swaying(seconds: float = 20.0) -> list[Message]:
    """Return a run with a load on a slope, whose arm goes up and down: alerts come and go."""
    lean = tilted(0.2, 0.25)
    messages = run_of(seconds, imu=Imu(0, lean, acceleration=upright(lean)))
    swayed = [
        replace(m, position=(math.sin((m.time - T0) / S), 0.0)) if isinstance(m, Joints) else m
        for m in messages
    ]
    return [Carry(T0, LOAD.mass, LOAD.cog), *swayed]


def told_of(messages: list[Message], cuts: list[int]) -> tuple[list[Alert], dict[int, str]]:
    """Return the alerts of a recording, and what its reader says to do about them."""
    evaluator, payloads = RecordedEvaluator(SETTINGS), PayloadLog(SETTINGS)
    evaluator.start(T0)
    told = AlertAdvice(SETTINGS, evaluator.watch.log, payloads.at)
    for part in split(messages, cuts):
        batch = batch_of(part)
        payloads.take(batch.payload)
        told.add(evaluator.batch(batch))
    evaluator.finish(messages[-1].time)
    return evaluator.watch.log, told.sentences()


@pytest.mark.parametrize('cuts', [[], [1], list(range(0, 3000, 7))])
def test_advice_is_that_of_the_moment_the_alert_was_raised(cuts: list[int]) -> None:
    """As a live monitor would work it out then, however the recording comes in stretches."""
    messages = swaying()
    seen, _ = live(SETTINGS, messages, messages[-1].time)
    alerts, told = told_of(messages, cuts)
    computed = [alert for alert in alerts if alert.rule.code in COMPUTED]
    assert len(computed) >= 8
    assert len({alert.rule.code for alert in computed}) == 2
    for alert in computed:
        then = [margins for m, margins in seen if m.time <= alert.start and margins][-1]
        wanted = advise(SETTINGS, then.q, then.gravity, LOAD, alert.rule.subject)
        assert told.get(id(alert)) == (wanted[0].sentence if wanted else None)
        assert not wanted or wanted[0].margin == alert.rule.subject
    assert len(told) >= 6


def test_of_many_alerts_the_most_severe_are_advised(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond a fixed number of alerts a recording's advice is general, to bound the cost."""
    monkeypatch.setattr(alert_advice, 'MOST', 3)
    alerts, told = told_of(swaying(), [])
    advised = [alert.rule.level for alert in alerts if id(alert) in told]
    others = [a.rule.level for a in alerts if id(a) not in told and a.rule.code in COMPUTED]
    assert 1 <= len(advised) <= 3
    assert len(others) >= 3
    assert min(advised) >= max(others)


# Postures whose best advice differs in its words, and where the robot stands.
LOW, HIGH, SLOPE = (0.0, 0.0), (0.6, 0.2), (2.5, 0.5, -9.4)
TORQUE = Rule('TORQUE_LIMIT', 'lift', WARN, 36.0, 34.0, 0, 0)


def sentence(q: tuple[float, float], subject: str = 'lift', load: Payload = LOAD) -> str:
    """Return the first sentence of advice for a posture."""
    return advise(SETTINGS, q, SLOPE, load, subject)[0].sentence


def adviser(log: list[Alert], load: Payload = LOAD) -> AlertAdvice:
    """Return what gathers the cases of a log."""
    return AlertAdvice(SETTINGS, log, lambda _: load)


def test_the_row_of_the_very_moment_counts() -> None:
    """Advice uses the row of the alert's moment, else the last row before it, of any part."""
    log = [Alert(TORQUE, 1 * S, 40.0), Alert(TORQUE, 5 * S // 2, 40.0)]
    gathered = adviser(log)
    gathered.add(rows((1, 2, 3), q=(LOW, HIGH, LOW), gravity=(SLOPE,) * 3))
    log += [Alert(TORQUE, 7 * S // 2, 40.0), Alert(TORQUE, 4 * S, 40.0)]
    gathered.add(rows((), q=()))
    log.append(Alert(TORQUE, 5 * S - 1, 40.0))
    gathered.add(rows((5, 6), q=(HIGH, HIGH), gravity=(SLOPE,) * 2))
    log.append(Alert(TORQUE, 5 * S, 40.0))
    found = gathered.sentences()
    assert sentence(LOW) != sentence(HIGH)
    assert [found[id(alert)] for alert in log] == [
        sentence(q) for q in (LOW, HIGH, LOW, LOW, LOW, HIGH)
    ]


def test_what_is_raised_before_any_row_or_after_the_last_is_no_failure() -> None:
    """An alert before all rows gets no computed advice; one after the last row uses that row."""
    log = [Alert(TORQUE, S // 2, 40.0)]
    gathered = adviser(log)
    assert gathered.sentences() == {}
    gathered = adviser(log)
    gathered.add(rows((1, 2), q=(LOW, HIGH), gravity=(SLOPE,) * 2))
    log.append(Alert(TORQUE, 9 * S, 40.0))
    assert gathered.sentences() == {id(log[1]): sentence(HIGH)}


def test_the_payload_is_that_of_the_time_the_joints_were_heard() -> None:
    """Advice uses the payload in force when the row's joint states came, not the row's own time."""
    log, asked = [Alert(TORQUE, 2 * S, 40.0)], []

    def payload_at(time: int) -> Payload:
        asked.append(time)
        return Payload(2.5, LOAD.cog)

    gathered = AlertAdvice(SETTINGS, log, payload_at)
    gathered.add(rows((1, 2), q=(LOW, HIGH), gravity=(SLOPE,) * 2))
    assert gathered.sentences() == {id(log[0]): sentence(HIGH, load=Payload(2.5, LOAD.cog))}
    assert asked == [3 * S // 2]


def test_fifty_alerts_are_advised_the_most_severe_and_then_the_first() -> None:
    """Of sixty alerts fifty get computed advice: the most severe, and of equal ones the first."""
    warnings = [Alert(TORQUE, k * S, 40.0) for k in range(40)]
    errors = [Alert(replace(TORQUE, level=ERROR), (40 + k) * S, 50.0) for k in range(20)]
    log = [*warnings, *errors]
    gathered = adviser(log)
    gathered.add(rows(range(60), q=(LOW,) * 60, gravity=(SLOPE,) * 60))
    assert set(gathered.sentences()) == set(map(id, [*errors, *warnings[:30]]))


def test_other_alerts_are_left_alone() -> None:
    """Alerts that are not about margins, such as lost data, get no computed advice."""
    log = [Alert(replace(TORQUE, code='INPUT_STALE'), S, 1.0)]
    gathered = adviser(log)
    gathered.add(rows((1, 2), q=(LOW, LOW), gravity=(SLOPE,) * 2))
    assert gathered.sentences() == {}
