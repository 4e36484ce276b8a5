"""The kind of ground: when it holds, and that live and recorded judge by the same one."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import hypothesis
import numpy as np
import pytest
from evaluation.streams import (
    MS,
    T0,
    Imu,
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

from ugv_acceptance.evaluation.alerts.messages import describe
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, STALE, WARN, Alert
from ugv_acceptance.evaluation.ground import FLAT, KINDS, STAIRS, UNEVEN, Ground, GroundWindow
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.permitted_limits import limits_hash
from ugv_acceptance.evaluation.rough_ground import cautious_angles, cautious_mechanics
from ugv_acceptance.evaluation.settings import Settings

Facts = Counter[tuple[Any, ...]]


def on(
    kind: str | None, *windows: tuple[str, float, float], told: Settings | None = None
) -> Settings:
    """Return settings on a kind of ground, with windows of others (s)."""
    ground = Ground(kind, windows=tuple(GroundWindow(*window) for window in windows))
    return replace(told or settings(), ground=ground)


def rolling(seconds: float = 4.0, begin: float = 1.5, rate: float = 0.35) -> list[Message]:
    """Return a run in which the robot begins to roll to its right, at a rate in rad/s."""
    found: list[Message] = []
    for message in run_of(seconds):
        roll = rate * max((message.time - T0) / S - begin, 0.0)
        if isinstance(message, Imu):
            lean = tilted(roll)
            omega = (rate if roll else 0.0, 0.0, 0.0)
            found.append(
                replace(message, orientation=lean, omega=omega, acceleration=upright(lean))
            )
        else:
            found.append(message)
    return found


def facts(alerts: Sequence[Alert]) -> Facts:
    """Return what alerts say, as something to compare without its order."""
    return Counter(
        (a.rule.code, a.rule.subject, a.rule.level, a.start, a.end, f'{a.peak:.9g}', a.detail)
        for a in alerts
    )


def trends(alerts: Sequence[Alert]) -> list[tuple[int, float]]:
    """Return level and start (s) of every TIP_TREND."""
    return [(a.rule.level, (a.start - T0) / S) for a in alerts if a.rule.code == 'TIP_TREND']


def changing(told: Settings, messages: Sequence[Message], end: int) -> list[Alert]:
    """Return the alerts of a live evaluation whose kind of ground is set when its window says."""
    ground = told.ground
    evaluator = LiveEvaluator(replace(told, ground=replace(ground, windows=())))
    evaluator.start(T0)
    for k, message in enumerate(messages):
        kind = KINDS[int(ground.numbers_at(np.array([(message.time - T0) / S]))[0])]
        if kind != evaluator.settings.ground.taken:
            evaluator.adopt(replace(told, ground=Ground(kind, ground.pitch)))
        give(evaluator, message)
        if k % 7 == 0:
            evaluator.tick(message.time)
    evaluator.tick(end)
    return evaluator.watch.log


def test_the_last_of_overlapping_windows_holds() -> None:
    """A window holds from its start to before its end; where two do, the later in the list."""
    ground = Ground(None, windows=(GroundWindow(STAIRS, 2.0, 6.0), GroundWindow(FLAT, 4.0, 5.0)))
    found = ground.numbers_at(np.array([0.0, 2.0, 3.9, 4.0, 5.0, 6.0]))
    assert [KINDS[k] for k in found] == [FLAT, STAIRS, STAIRS, FLAT, STAIRS, FLAT]
    assert ground.rough_within(0.0, 2.0)
    assert ground.rough_within(5.5, 9.0)
    assert not ground.rough_within(4.0, 4.9)
    assert not ground.rough_within(6.0, 9.0)


def test_a_robot_that_begins_to_tip_on_stairs_is_told_once() -> None:
    """TIP_TREND says to which side, how fast and how long; first as a warning, then as an error."""
    _, evaluator = recorded(on(STAIRS), [rolling()], T0 + 4 * S)
    levels = [level for level, _ in trends(evaluator.watch.log)]
    assert levels == [WARN, ERROR]
    said = next(a for a in evaluator.watch.log if a.rule.code == 'TIP_TREND')
    text = describe(said, evaluator.settings)
    assert text.startswith('the robot begins to tip: RIGHT, by 2')
    assert 's until nothing is left' in text


@pytest.mark.parametrize('kind', [None, FLAT])
def test_on_flat_ground_nothing_changes(kind: str | None) -> None:
    """Entered or not, on flat ground there is no TIP_TREND and every alert is as without it."""
    _, plain = recorded(settings(), [rolling()], T0 + 4 * S)
    _, flat = recorded(on(kind), [rolling()], T0 + 4 * S)
    assert facts(plain.watch.log) == facts(flat.watch.log)
    assert not trends(flat.watch.log)
    assert limits_hash(on(kind)) == limits_hash(settings()) != limits_hash(on(UNEVEN))


def test_the_other_alerts_are_the_same_on_any_ground() -> None:
    """The kind of ground adds TIP_TREND, and takes no alert away."""
    _, flat = recorded(settings(), [rolling()], T0 + 4 * S)
    _, stairs = recorded(on(STAIRS), [rolling()], T0 + 4 * S)
    others = [a for a in stairs.watch.log if a.rule.code != 'TIP_TREND']
    assert facts(others) == facts(flat.watch.log)


@hypothesis.settings(max_examples=12)
@given(
    st.lists(
        st.tuples(st.sampled_from(KINDS), st.floats(0.0, 4.0), st.floats(0.05, 3.0)), max_size=3
    ),
    st.lists(st.integers(0, 900), max_size=4),
    st.sampled_from([None, STAIRS]),
)
def test_kinds_that_change_are_the_same_live_and_recorded(
    windows: list[tuple[str, float, float]], cuts: list[int], kind: str | None
) -> None:
    """A kind set while the monitor runs gives the alerts that its window in a recording gives."""
    told = on(kind, *((k, a, a + length) for k, a, length in windows))
    messages, end = rolling(), T0 + 5 * S
    _, evaluator = recorded(told, split(messages, cuts), end)
    assert facts(changing(told, messages, end)) == facts(evaluator.watch.log)


@hypothesis.settings(max_examples=25)
@given(streams(), st.lists(st.integers(0, 120), max_size=5), st.lists(st.integers(0, 3000)))
def test_any_messages_on_stairs_are_the_same_live_and_recorded(
    messages: list[Message], cuts: list[int], ticks: list[int]
) -> None:
    """Gaps, payloads and odd messages give the same alerts on stairs, in any batches."""
    told, end = on(STAIRS), messages[-1].time + S
    _, alerts = live(told, messages, end, [T0 + t * MS for t in ticks])
    _, evaluator = recorded(told, split(messages, cuts), end)
    assert facts(alerts) == facts(evaluator.watch.log)


def test_the_cautious_margin_is_the_same_live_and_recorded() -> None:
    """Every row on stairs has that of shortened tracks, with the load of its joint state."""
    told = on(None, (STAIRS, 1.0, 2.0))
    short = cautious_mechanics(told.robot, told.ground.pitch)
    rows, _ = recorded(told, split(rolling(), [100]), T0 + 4 * S)
    for part in rows:
        inside = (part.time >= T0 + S) & (part.time < T0 + 2 * S)
        assert np.isnan(part.ground.cautious[~inside | ~part.known]).all()
        for k in np.flatnonzero(inside & part.known)[::20]:
            of = part.q[k].tolist(), tuple(part.gravity[k].tolist())
            found = cautious_angles(short, *of, told.robot.payload)
            np.testing.assert_allclose(part.ground.cautious[k], found, rtol=1e-9)


def test_until_a_trend_is_known_there_is_no_ok() -> None:
    """For the first moments on stairs the level is NO DATA, also where they come later."""
    evaluator = LiveEvaluator(on(FLAT))
    evaluator.start(T0)
    seen = {}
    for message in run_of(3.0):
        seconds = (message.time - T0) / S
        if seconds >= 2.0 and evaluator.settings.ground.kind == FLAT:
            evaluator.adopt(on(STAIRS))
        give(evaluator, message)
        evaluator.tick(message.time)
        seen[seconds] = evaluator.level == STALE, evaluator.waits_for_trend

    def all_of(start: float, end: float) -> set[tuple[bool, bool]]:
        return {said for at, said in seen.items() if start <= at < end}

    assert all_of(1.0, 2.0) == {(False, False)}
    assert all_of(2.0, 2.2) == {(True, True)}
    assert all_of(2.6, 3.0) == {(False, False)}


def test_a_payload_changes_the_cautious_margin() -> None:
    """It is computed with the load that is carried."""
    told = on(STAIRS)
    short = cautious_mechanics(told.robot, told.ground.pitch)
    loads = (replace(told.robot.payload, mass=mass) for mass in (0.0, 10.0))
    light, heavy = (cautious_angles(short, (0.0, 0.0), (0.0, 0.0, -9.81), x) for x in loads)
    assert heavy[0] < light[0]
    assert math.isfinite(light[0])
