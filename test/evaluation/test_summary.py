"""What a recording came to: coverage, time in violation and worst values, against a plain loop."""

import json
import math
from dataclasses import replace

import hypothesis
import numpy as np
import pytest
from evaluation.streams import (
    MS,
    T0,
    Imu,
    Joints,
    Message,
    S,
    give,
    live,
    recorded,
    run_of,
    settings,
    split,
    streams,
    tilted,
    upright,
)
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.alerts import ERROR, WARN, Alert, Rule
from ugv_acceptance.evaluation.live import LiveEvaluator, Margins
from ugv_acceptance.evaluation.settings import Delays, Settings
from ugv_acceptance.evaluation.summary import Summary, ordered, result_of
from ugv_acceptance.evaluation.watch import Watch
from ugv_acceptance.evaluation.wording import WORDS, advice, describe
from ugv_acceptance.model.stability import NO_CONTACT


def summed(told: Settings, messages: list[Message], cuts: list[int], end: int) -> Summary:
    """Return the summary of messages given as a recording."""
    summary = Summary(told)
    rows, _ = recorded(told, split(messages, cuts), end)
    for part in rows:
        summary.add(part)
    summary.finish(end)
    return summary


@hypothesis.settings(max_examples=60)
@given(streams(), st.lists(st.integers(0, 120), max_size=4), st.integers(0, 200))
def test_sums_are_those_of_a_loop(messages: list[Message], cuts: list[int], rest: int) -> None:
    """A live monitor looked at every millisecond gives coverage, violations and worst values."""
    told = settings(delays=Delays(stale_after=0.05))
    # Even milliseconds only, so that a limit of three periods is a whole one.
    messages = [replace(m, time=2 * m.time - T0) for m in messages]
    end = messages[-1].time + 2 * rest * MS
    summary = summed(told, messages, cuts, end)
    seen = dict(zip([m.time for m in messages], messages, strict=True))
    spent, lifting, tipping = 0, 0, 0
    worst = [-math.inf] * 2
    least = math.inf
    evaluator = _Live(told)
    for now in range(T0, end, MS):
        margins = evaluator.at(now, seen.get(now))
        if margins is None:
            continue
        spent += 1
        load = [abs(float(x)) for x in margins.torque]
        worst = [max(pair) for pair in zip(worst, load, strict=True)]
        lifting += load[0] >= told.limits.torque[0]
        if margins.stability.state < NO_CONTACT:
            angle = min(map(float, margins.stability.angle))
            least = min(least, angle)
            tipping += angle <= told.limits.tip_error
    assert summary.evaluated == spent * MS
    assert summary.load_violation[0] == lifting * MS
    assert summary.tip_violation == tipping * MS
    final = evaluator.at(end, seen.get(end))
    if final is None:
        np.testing.assert_allclose([e.value for e in summary.load], worst, rtol=1e-12)
        np.testing.assert_allclose(max(e.value for e in summary.tip), -least, rtol=1e-12)


class _Live:
    """A live evaluator that can be asked every millisecond for the margins that hold."""

    def __init__(self, told: Settings) -> None:
        self.evaluator = LiveEvaluator(told)
        self.evaluator.start(T0)

    def at(self, now: int, message: Message | None) -> Margins | None:
        """Take the message of this time, if there is one; return the margins that hold from it."""
        if message is not None:
            give(self.evaluator, message)
        self.evaluator.tick(now + 1)
        return self.evaluator.margins


def test_a_gap_is_not_evaluated() -> None:
    """Ten seconds with a silence of two: its first tenth of a second still counts."""
    silent = [m for m in run_of(10.0) if not (isinstance(m, Imu) and 4 * S < m.time - T0 < 6 * S)]
    summary = summed(settings(), silent, [100, 700], T0 + 10 * S)
    assert summary.evaluated == pytest.approx(8.09 * S, abs=0.03 * S)


def test_results_name_all_that_is_promised_and_are_json() -> None:
    """No NaN, no infinity, all keys, also of a recording of which nothing is known."""
    told = settings()
    for messages in (run_of(3.0), [Joints(T0)]):
        rows, evaluator = recorded(told, [messages], T0 + 3 * S)
        summary = Summary(told)
        summary.add(rows[0])
        summary.finish(T0 + 3 * S)
        result = result_of(summary, evaluator.watch.log, T0, 3 * S)
        json.dumps(result, allow_nan=False)
        assert set(result['coverage']) >= {'evaluated_s', 'duration_s', 'fraction'}
        lift = {'limit', 'unit', 'max_abs', 'min_margin', 'time_of_min_s', 'time_in_violation_s'}
        assert set(result['torque']['lift']) >= lift
        stability = {'min_angle_deg', 'edge', 'time_of_min_s', 'time_in_violation_s', 'edges'}
        assert set(result['stability']) >= stability
        for alert in result['alerts']:
            assert {'code', 'level', 'start_s', 'end_s', 'peak', 'message'} <= set(alert)
        assert result['torque']['slide']['unit'] == 'N'


def test_alerts_come_in_the_same_order_however_they_were_gathered() -> None:
    """Batches of any size give the same result, byte by byte."""
    lean = tilted(1.2, 0.3)
    messages = run_of(3.0, imu=Imu(0, lean, acceleration=upright(lean)))
    told, texts = settings(), set()
    for cuts in ([], [1], list(range(0, 400, 7))):
        rows, evaluator = recorded(told, split(messages, cuts), T0 + 3 * S)
        summary = Summary(told)
        for part in rows:
            summary.add(part)
        summary.finish(T0 + 3 * S)
        texts.add(json.dumps(result_of(summary, evaluator.watch.log, T0, 3 * S)))
    _, alerts = live(told, messages, T0 + 3 * S)
    assert len(alerts) > 2
    assert len(texts) == 1
    assert [a.rule for a in ordered(alerts)] == [a.rule for a in ordered(evaluator.watch.log)]


def test_every_rule_has_words_and_advice() -> None:
    """A sentence without holes for every code that can be raised."""
    told = settings()
    for signal in Watch(told).signals():
        alert = Alert(signal.rule, T0, 0.3)
        assert '{' not in describe(alert, told)
        assert advice(signal.rule.code)
    assert {s.rule.code for s in Watch(told).signals()} == set(WORDS)


def test_a_robot_past_tipping_is_said_to_be() -> None:
    """Not that a negative tilt is left."""
    told = settings()
    rule = Rule('TIP_OVER', 'right', ERROR, -math.radians(5), -math.radians(6), 0, 0)
    past = describe(Alert(rule, T0, math.radians(35.0)), told)
    assert past.startswith('35.0 degrees past its tipping point to the right')
    left = describe(Alert(rule, T0, -math.radians(4.0)), told)
    assert left.startswith('4.0 degrees of tilt left before it tips to the right')


def test_a_force_is_told_in_newtons() -> None:
    """Of a prismatic joint; of others in newton metres."""
    told = settings()
    words = [
        describe(Alert(Rule('TORQUE_LIMIT', name, WARN, 1.0, 0.5, 0, 0), T0, 20.0), told)
        for name in ('lift', 'slide')
    ]
    assert words[0].endswith('45.0 N m')
    assert words[1].endswith('30.0 N')
