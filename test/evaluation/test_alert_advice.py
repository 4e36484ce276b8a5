"""What to do about the alerts of a recording: for the moment each was raised, at a bounded cost."""

import math
from dataclasses import replace

import pytest
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

from ugv_acceptance.evaluation import alert_advice
from ugv_acceptance.evaluation.advice import COMPUTED, advise
from ugv_acceptance.evaluation.alert_advice import AlertAdvice
from ugv_acceptance.evaluation.alerts import Alert
from ugv_acceptance.evaluation.payload_log import PayloadLog
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
    """The cost of a run is bounded: beyond MOST there is what helps in general."""
    monkeypatch.setattr(alert_advice, 'MOST', 3)
    alerts, told = told_of(swaying(), [])
    advised = [alert.rule.level for alert in alerts if id(alert) in told]
    others = [a.rule.level for a in alerts if id(a) not in told and a.rule.code in COMPUTED]
    assert 1 <= len(advised) <= 3
    assert len(others) >= 3
    assert min(advised) >= max(others)
