"""The arm on the ground: no margins, an alert; with permission only torques are not known."""

import math
from dataclasses import replace
from typing import Any

import hypothesis
import numpy as np
import pytest
from evaluation.streams import (
    MS,
    T0,
    Carry,
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
)
from evaluation.test_live_equals_recorded import compare
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.alerts.messages import describe
from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.settings import ALWAYS, Settings
from ugv_acceptance.model.clearance import nearness_of
from ugv_acceptance.model.mechanics import mechanics_of

# The arm of the small robot is 1 m long, its joint 0.3 m above the ground; a load 0.1 m beyond.
TOUCHES = nearness_of(mechanics_of(settings().robot)).touches
OVER, ON = 0.1, -0.2


def at_height(height: float) -> float:
    """Return the lift's position in messages at which its load is at a height (m)."""
    return 0.1 - math.asin((height - 0.3) / 1.1)


def dips(*heights: tuple[float, float], seconds: float = 6.0) -> list[Message]:
    """Return a run whose load is at 0.1 m, and from each time (s) on at a height (m)."""
    found = []
    for m in run_of(seconds):
        now = [h for since, h in ((0.0, OVER), *heights) if (m.time - T0) / S >= since]
        position = (at_height(now[-1]), 0.0)
        found.append(replace(m, position=position) if isinstance(m, Joints) else m)
    return found


def both(told: Settings, run: list[Message], until: int) -> Any:
    """Return margins and alerts of a run, live and recorded: ((known, torque), alerts) of each."""
    margins, alerts = live(told, run, until)
    alone = {m.time: r for m, r in margins}
    rows, evaluator = recorded(told, split(run, [70, 301]), until)
    time = np.concatenate([part.time for part in rows])
    known = np.concatenate([part.known for part in rows])
    torque = np.concatenate([part.torque for part in rows])
    seen = [alone[int(t)] for t in time]
    assert [m is not None for m in seen] == known.tolist()
    untold = [m is not None and math.isnan(m.torque[0]) for m in seen]
    assert untold == (known & np.isnan(torque[:, 0])).tolist()
    shown = [
        [found(a) for a in log if a.rule.code == 'ARM_ON_GROUND']
        for log in (alerts, evaluator.watch.log)
    ]
    assert shown[0] == shown[1]
    return time, known, np.array(untold), shown[0]


def found(alert: Alert) -> tuple[float, float | None, float, str]:
    """Return begin and end (s), the least clearance (m) and the words of an alert."""
    end = None if alert.end is None else (alert.end - T0) / S
    return (alert.start - T0) / S, end, round(-alert.peak, 6), alert.detail


def test_on_the_ground_no_margin_is_known() -> None:
    """From the message that shows the arm on the ground to the one that shows it clear: nothing."""
    run = dips((2.0, ON), (4.0, OVER))
    time, known, untold, alerts = both(settings(), run, T0 + 6 * S)
    down = (time >= T0 + 2 * S) & (time < T0 + 4 * S)
    assert known[time > T0 + 100 * MS].tolist() == (~down)[time > T0 + 100 * MS].tolist()
    assert not untold.any()
    assert alerts == [(2.0, 5.0, pytest.approx(-0.2), 'the lowest part is load')]


def test_a_robot_without_an_imu_is_judged_alike() -> None:
    """The torques of a base that was declared level are not known while the arm is down."""
    told = replace(settings(), imu=replace(settings().imu, attitude='level'))
    run: list[Message] = [m for m in dips((2.0, ON), (4.0, OVER)) if isinstance(m, Joints)]
    _, known, _, alerts = both(told, run, T0 + 6 * S)
    assert (~known).sum() == 100
    assert len(alerts) == 1


def test_where_the_hand_may_touch_only_torques_are_unknown() -> None:
    """In its window the arm may be down: no alert, tilts are known, torques are not."""
    told = replace(settings(), hand_may_touch=((1.0, 3.0), (4.5, 5.0)))
    run = dips((2.0, ON), (4.0, OVER))
    time, known, untold, alerts = both(told, run, T0 + 6 * S)
    assert untold.tolist() == ((time >= T0 + 2 * S) & (time < T0 + 3 * S)).tolist()
    late = (time >= T0 + 3 * S) & (time < T0 + 4 * S)
    assert not known[late].any()
    assert known[~late][10:].all()
    assert [a[:2] for a in alerts] == [(3.0, 5.0)]


def test_a_torque_alert_does_not_outlive_what_nobody_knows() -> None:
    """A torque alert that is active when the hand comes down ends there, live and recorded."""
    told = replace(settings(), hand_may_touch=ALWAYS)
    run = dips((2.0, ON))
    _, alerts = live(told, run, T0 + 6 * S)
    _, evaluator = recorded(told, split(run, [150]), T0 + 6 * S)
    for log in (alerts, evaluator.watch.log):
        ends = {a.end for a in log if a.rule.code == 'TORQUE_LIMIT'}
        assert ends == {T0 + 3 * S}


@pytest.mark.parametrize('middle', [TOUCHES, 0.0])
def test_an_arm_about_its_threshold_does_not_flicker(middle: float) -> None:
    """Encoder noise about the threshold, or about the ground, raises one alert."""
    rng = np.random.default_rng(1)
    noise = [(1.0 + k / 50.0, middle + x) for k, x in enumerate(rng.normal(0, 0.002, 250))]
    run = dips((0.9, middle - 0.005), *noise)
    _, known, _, alerts = both(settings(), run, T0 + 6 * S)
    assert len(alerts) == 1
    assert np.count_nonzero(np.diff(known.astype(int))) <= 2


def test_an_arm_is_off_the_ground_only_half_as_far_again() -> None:
    """It touches up to TOUCHES above the ground, and is clear 1.5 times as high, not before."""
    above = dips((1.0, TOUCHES + 0.001))
    assert both(settings(), above, T0 + 6 * S)[3] == []
    rises = dips((1.0, TOUCHES - 0.001), (2.0, 1.4 * TOUCHES), (3.0, 1.6 * TOUCHES))
    ((start, end, least, _),) = both(settings(), rises, T0 + 6 * S)[3]
    assert (start, end) == (1.0, 4.0)
    assert least == pytest.approx(TOUCHES - 0.001, abs=1e-6)


def test_a_longer_load_counts_from_the_message_that_declares_it() -> None:
    """A load declared further out touches the ground where a shorter one did not."""
    low = [
        replace(m, position=(at_height(0.05), 0.0)) if isinstance(m, Joints) else m
        for m in run_of(4.0)
    ]
    run = sorted(
        [*low, Carry(T0 + 2 * S + 5 * MS, 1.0, (0.4, 0.0, 0.0), 'hand')], key=lambda m: m.time
    )
    (alert,) = both(settings(), run, T0 + 4 * S)[3]
    assert alert[0] == pytest.approx(2.02, abs=0.011)


def test_a_forgotten_permission_still_judges_an_arm_in_the_air() -> None:
    """With permission, torques are judged as long as the arm is off the ground."""
    told = replace(settings(), hand_may_touch=ALWAYS)
    _, known, untold, alerts = both(told, dips(), T0 + 6 * S)
    assert known[10:].all()
    assert not untold.any()
    assert alerts == []


def test_an_operator_may_permit_it_while_the_robot_runs() -> None:
    """Margins come back, but for torques, once somebody says that the hand may touch."""
    evaluator = LiveEvaluator(settings())
    evaluator.start(T0)
    run = dips((0.5, ON), seconds=2.0)
    for m in run[:150]:
        give(evaluator, m)
    before = evaluator.margins
    assert before is None
    evaluator.adopt(replace(settings(), hand_may_touch=ALWAYS))
    for m in run[150:]:
        give(evaluator, m)
    assert evaluator.margins is not None
    assert math.isnan(evaluator.margins.torque[0])
    assert math.isfinite(float(evaluator.margins.stability.angle[0]))
    assert evaluator.ground.clearance == pytest.approx(ON)


def test_the_alert_says_how_low_it_came() -> None:
    """The sentence tells the clearance in words, above or below the ground."""
    _, alerts = live(settings(), dips((2.0, ON)), T0 + 6 * S)
    (alert,) = (a for a in alerts if a.rule.code == 'ARM_ON_GROUND')
    assert 'it came to 0.20 m below the plane' in describe(alert, settings())


@hypothesis.settings(max_examples=15, deadline=None)
@given(
    streams(),
    st.lists(st.tuples(st.floats(0.0, 2.0), st.floats(2.0, 4.0)), max_size=2),
    st.lists(st.integers(0, 40), max_size=3),
)
def test_windows_hold_live_and_recorded(
    messages: list[Message], windows: list[tuple[float, float]], cuts: list[int]
) -> None:
    """Any messages and any windows give the same margins and alerts live and recorded."""
    compare(replace(settings(), hand_may_touch=tuple(windows)), messages, cuts, [], 500)
