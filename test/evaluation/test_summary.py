"""What a recording came to: coverage, time in violation and worst values, against a plain loop."""

import json
import math
from dataclasses import replace
from typing import Any

import hypothesis
import numpy as np
import pytest
from evaluation.hand_made import made
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
    shortened,
    split,
    streams,
    tilted,
    upright,
)
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.alerts.messages import RECORDED, advice, describe
from ugv_acceptance.evaluation.alerts.rules import RuleSet
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, WARN, Alert, Rule
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.evaluation.settings import Delays, Limits, Settings
from ugv_acceptance.evaluation.summary import Summary, ordered, result_of
from ugv_acceptance.model.stability import NO_CONTACT, SIDES, STATES


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
    messages = [replace(m, time=2 * m.time - T0) for m in shortened(messages, S)]
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
    for signal in RuleSet(told).signals:
        alert = Alert(signal.rule, T0, 0.3)
        assert '{' not in describe(alert, told)
        assert advice(signal.rule.code)
    assert {s.rule.code for s in RuleSet(told).signals} == set(RECORDED)


def test_a_robot_past_tipping_is_said_to_be() -> None:
    """A negative tilt left is told as past the tipping point, not as tilt left."""
    told = settings()
    rule = Rule('TIP_OVER', 'right', ERROR, -math.radians(5), -math.radians(6), 0, 0)
    past = describe(Alert(rule, T0, math.radians(35.0)), told)
    assert past.startswith('35 deg past tipping: RIGHT')
    left = describe(Alert(rule, T0, -math.radians(4.0)), told)
    assert left.startswith('4 deg to tipping: RIGHT')


def test_a_force_is_told_in_newtons() -> None:
    """A prismatic joint's force is told in N, a revolute joint's torque in N m."""
    told = settings()
    words = [
        describe(Alert(Rule('TORQUE_LIMIT', name, WARN, 1.0, 0.5, 0, 0), T0, 20.0), told)
        for name in ('lift', 'slide')
    ]
    assert words[0].endswith('45.0 N m')
    assert words[1].endswith('30.0 N')


HALF = settings(limits=Limits((40.0, 30.0), torque_error=0.5, tip_error=0.1))
FINE = (1.0, 1.0, 1.0, 1.0)


def test_time_in_violation_counts_from_the_limit_on() -> None:
    """Each known row counts until the next, the last until its deadline or the end.

    Half of 40 N m and 30 N are allowed; 0.1 rad are left to any side.
    """
    rows = made(
        [0, 1, 3, 7, 15],
        until=[1, 3, 7, 15, 31],
        known=[True, True, False, True, True],
        torque=[(20.0, 0.0), (19.999, -15.0), (-99.0, 99.0), (-20.0, 14.999), (0.0, 16.0)],
        angle=[(1.0, 0.1, 1.0, 1.0), (1.0, 1.0, 0.1001, 1.0), (-1.0,) * 4, FINE, (0.0,) * 4],
    )
    for end, last in ((40, 16), (20, 5), (15, 0)):
        summary = Summary(HALF)
        summary.add(made([]))
        summary.add(rows)
        summary.finish(end)
        summary.finish(end + 1)  # nothing is left that could hold
        assert summary.messages == 5
        assert summary.evaluated == 1 + 2 + 8 + last
        assert summary.load_violation == [1 + 8, 2 + last]
        assert summary.tip_violation == 1 + last


@pytest.mark.parametrize(('known', 'torque', 'tilt'), [
    (True, 20.0, 1.0), (True, 0.0, 0.05), (True, 0.0, 1.0), (False, 20.0, 0.05),
])  # fmt: skip
def test_the_last_row_of_a_stretch_holds_until_the_next_stretch(
    known: bool,  # noqa: FBT001
    torque: float,
    tilt: float,
) -> None:
    """With its own violations; three units of time here."""
    summary = Summary(HALF)
    end: dict[str, Any] = {
        'torque': [(0.0, 0.0), (torque, 0.0)],
        'angle': [FINE, (1.0, 1.0, 1.0, tilt)],
    }
    summary.add(made([0, 1], until=[1, 9], known=[True, known], **end))
    summary.add(made([4], until=[5]))
    summary.finish(9)
    held = 3 if known else 0
    assert summary.evaluated == 1 + held + 1
    assert summary.load_violation == [held if torque == 20.0 else 0, 0]
    assert summary.tip_violation == (held if tilt == 0.05 else 0)


def test_the_worst_is_kept_of_each_joint_and_side_with_its_time() -> None:
    """Torque by its size, tilt by what is least left; across stretches."""
    summary = Summary(HALF)
    angle = [(0.5, 0.6, 0.7, 0.8), (0.4, 0.9, 0.65, -0.1)]
    summary.add(made([10, 20], torque=[(-7.0, 1.0), (5.0, -2.0)], angle=angle))
    summary.add(made([30], torque=[(6.0, 3.0)], angle=[(0.45, 0.3, 0.65, 0.0)]))
    assert [(e.value, e.time) for e in summary.load] == [(7.0, 10), (3.0, 30)]
    assert [(-e.value, e.time) for e in summary.tip] == [
        (0.4, 20),
        (0.3, 30),
        (0.65, 20),
        (-0.1, 20),
    ]
    assert len(summary.tip) == len(SIDES)


def test_states_are_counted_over_the_rows_that_are_known() -> None:
    """Contact states are counted over known rows; a state that never was is not named."""
    summary = Summary(HALF)
    summary.add(made([0, 1, 2], state=[0, 1, 2], known=[True, True, False]))
    summary.add(made([3, 4], state=[1, len(STATES) - 1]))
    assert summary.states == {STATES[0]: 1, STATES[1]: 2, STATES[-1]: 1}


def test_nothing_was_seen_before_the_first_row() -> None:
    """The summary of a recording without messages is that of nothing seen."""
    empty = Summary(HALF)
    empty.finish(S)
    assert (empty.evaluated, empty.messages, empty.tip_violation) == (0, 0, 0)
    assert empty.load_violation == [0, 0]


def test_an_alert_is_told_with_what_was_computed_for_it() -> None:
    """The others get what helps in general; a recording of a nanosecond is covered too."""
    first, other = (
        Alert(Rule('TIP_OVER', side, ERROR, -0.1, -0.12, 0, 0), T0, -0.05) for side in SIDES[:2]
    )
    found = result_of(Summary(HALF, evaluated=1), [first, other], T0, 1, {id(other): 'raise it'})
    told = {one['subject']: (one['advice'], one['advice_computed']) for one in found['alerts']}
    assert told == {SIDES[0]: (advice('TIP_OVER'), False), SIDES[1]: ('raise it', True)}
    assert found['coverage']['fraction'] == 1.0
