"""Decode differently, evaluate once: a live monitor and a recording come to the same."""

import math
from collections import Counter
from dataclasses import replace
from random import Random
from typing import Any

import hypothesis
import numpy as np
import pytest
from evaluation.streams import (
    MS,
    T0,
    Carry,
    Imu,
    Joints,
    Message,
    S,
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

from ugv_acceptance.evaluation.alerts.alarms import key_of
from ugv_acceptance.evaluation.alerts.messages import describe
from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.settings import Delays, ImuInput, Limits, Settings, Untold
from ugv_acceptance.model.robot import Joint, Link, Vector

LIVE_INPUTS = ('auto', 'orientation', 'accelerometer')


def facts(alerts: list[Alert], *, balanced: bool = False) -> Counter[tuple[Any, ...]]:
    """Return what an alert says, as something to compare without its order.

    Of a robot `balanced` on its back nobody knows by how much it is past an edge, or when.
    """
    return Counter(
        (
            *key_of(a.rule),
            a.start,
            a.end,
            *(() if balanced and a.rule.code == 'TIP_OVER' else (f'{a.peak:.9g}', a.worst_at)),
            a.detail,
        )
        for a in alerts
    )


def compare(
    told: Settings, messages: list[Message], cuts: list[int], ticks: list[int], rest: int
) -> None:
    """Evaluate messages both ways and hold margins and alerts to each other."""
    end = messages[-1].time + rest
    seen, alerts = live(told, messages, end, ticks)
    rows, evaluator = recorded(told, split(messages, cuts), end)
    of_rows = {int(t): (part, k) for part in rows for k, t in enumerate(part.time)}
    events, balanced = 0, False
    for message, margins in seen:
        if message.time not in of_rows:
            continue
        events += 1
        part, k = of_rows[message.time]
        assert bool(part.known[k]) == (margins is not None)
        if margins is None:
            continue
        s = margins.stability
        one = [*margins.q, *margins.gravity, *margins.torque, *s.moment, *s.energy]
        many = [*(part.q[k], part.gravity[k], part.torque[k]), *(part.moment[k], part.energy[k])]
        for angle, other, moment in zip(s.angle, part.angle[k], s.moment, strict=True):
            # On its back, right above an edge: past it by half a turn or not at all, as one rounds.
            if margins.gravity[2] < 0.0 or moment != 0.0:
                one, many = [*one, angle], [*many, np.array([other])]
            else:
                balanced = True
        # The ZMP runs away to infinity as gravity turns parallel to the ground.
        if margins.gravity[2] < -1.0:
            one, many = [*one, s.zmp], [*many, part.zmp[k : k + 1]]
        np.testing.assert_allclose(np.array(one), np.concatenate(many), rtol=1e-12, atol=1e-12)
        assert (margins.stamp, s.state) == (part.stamp[k], part.state[k])
    assert events == len(of_rows)
    assert facts(alerts, balanced=balanced) == facts(evaluator.watch.log, balanced=balanced)


@hypothesis.settings(max_examples=200)
@given(
    streams(),
    st.lists(st.integers(0, 120), max_size=5),
    st.lists(st.integers(0, 3000), max_size=20),
    st.integers(0, 3 * S),
    st.sampled_from(LIVE_INPUTS),
    st.booleans(),
    st.booleans(),
)
def test_margins_and_alerts_are_equal(
    messages: list[Message],
    cuts: list[int],
    ticks: list[int],
    rest: int,
    attitude: str,
    specific_force: bool,  # noqa: FBT001 - drawn
    slow: bool,  # noqa: FBT001 - drawn: joints so slow that positions leap
) -> None:
    """Any messages give the same margins and alerts live and recorded, in any batches."""
    imu = ImuInput(
        attitude=attitude, specific_force=specific_force, position=(0.1, 0.0, 0.2),
        agreement_delay=0.05, frame='imu_link',
    )  # fmt: skip
    delays = Delays(tip_on=0.02, torque_on=0.03, off=0.1)
    told = settings(imu, delays)
    if slow:
        joints = tuple(replace(joint, velocity=0.02) for joint in told.robot.joints)
        told = replace(told, robot=replace(told.robot, joints=joints))
    compare(told, messages, cuts, [T0 + t * MS for t in ticks], rest)


@hypothesis.settings(max_examples=100)
@given(
    streams(),
    st.lists(st.integers(0, 120), max_size=5),
    st.lists(st.integers(0, 3000), max_size=20),
    st.sampled_from(LIVE_INPUTS),
    st.sampled_from(['base', 'arm', 'hand']),
    st.sampled_from(['auto', 'given', 'unknown', 'told by tf']),
    st.booleans(),
)
def test_a_mounting_that_is_found_and_one_that_moves_are_equal_too(
    messages: list[Message],
    cuts: list[int],
    ticks: list[int],
    attitude: str,
    carrier: str,
    how: str,
    noise_free: bool,  # noqa: FBT001 - drawn
) -> None:
    """On the base, the arm or the slide; by its frame or by its link; with messages of no frame."""
    turned = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0))
    placed = {'told by tf': 'auto'}.get(how, how)
    imu = ImuInput(
        attitude=attitude, position=(0.1, 0.0, 0.2), agreement_delay=0.05, noise_free=noise_free,
        placed=placed, link=carrier if how == 'given' else '',
        transforms=((carrier, 'imu_link', (0.0, 0.1, 0.0), turned),) if how == 'told by tf' else (),
    )  # fmt: skip
    told = settings(imu, Delays(tip_on=0.02, torque_on=0.03, off=0.1))
    if how == 'auto':
        link = Joint('imu_joint', 'fixed', carrier, 'imu_link', (0.0, 0.1, 0.0), turned)
        robot = told.robot
        told = replace(
            told,
            robot=replace(
                robot, links=(*robot.links, Link('imu_link')), joints=(*robot.joints, link)
            ),
        )
    compare(told, messages, cuts, [T0 + t * MS for t in ticks], S)


@hypothesis.settings(max_examples=20)
@given(st.lists(st.integers(0, 900), max_size=8), st.integers(0, 1000))
def test_long_runs_are_equal_too(cuts: list[int], seed: int) -> None:
    """Over enough messages that periods are learnt, with a gap and a payload in the middle."""
    random = Random(seed)
    run = [m for m in run_of(6.0) if not 3 * S < m.time - T0 < 3.5 * S or isinstance(m, Imu)]
    messages = [
        Joints(m.time, position=(random.uniform(-1.5, 0.5), 0.1)) if isinstance(m, Joints) else m
        for m in run
        if random.random() < 0.9
    ]
    middle = len(messages) // 2
    messages.insert(middle, Carry(messages[middle - 1].time + 1, 3.0))
    compare(settings(), messages, cuts, [], S)


@hypothesis.settings(max_examples=60)
@given(streams(), st.lists(st.integers(0, 120), max_size=5), st.floats(0.05, 0.6))
def test_sliding_is_the_same_too(messages: list[Message], cuts: list[int], friction: float) -> None:
    """With a known friction, sliding before tipping raises the same alerts live and recorded."""
    limits = Limits((45.0, 30.0), friction=friction, tip_warn=0.3)
    compare(settings(limits=limits, delays=Delays(tip_on=0.02, off=0.1)), messages, cuts, [], S)


@st.composite
def late_joints(draw: st.DrawFn) -> list[Message]:
    """Return messages of which the first, many or all, tell only one of the two joints."""
    names = draw(st.permutations(['lift', 'hand_slide']))
    count = draw(st.integers(20, 100))
    begins = draw(st.one_of(st.integers(5, count), st.just(count)))
    steps = st.tuples(
        st.sampled_from([5, 20, 20, 90, 300]), st.integers(0, 3), st.floats(-0.1, 0.3)
    )
    now = T0
    found: list[Message] = []
    for k, (wait, kind, q) in enumerate(draw(st.lists(steps, min_size=count, max_size=count))):
        now += wait * MS
        told = names[:1] if k < begins else names[: 1 + kind % 2]
        of = {'lift': 0.1 - q, 'hand_slide': q}
        position = tuple(of[name] for name in told)
        found.append(Joints(now, tuple(told), position) if kind < 2 else Imu(now))
    return found


_untold = st.none() | st.builds(Untold, st.floats(-0.1, 0.3), harmless=st.booleans())


@hypothesis.settings(max_examples=60)
@given(
    late_joints(),
    st.lists(st.integers(0, 100), max_size=5),
    st.lists(st.integers(0, 3000), max_size=10),
    st.tuples(_untold, _untold),
)
def test_joints_that_are_told_late_or_never_are_the_same_too(
    messages: list[Message],
    cuts: list[int],
    ticks: list[int],
    untold: tuple[Untold | None, ...],
) -> None:
    """Joints that are taken as held until a message tells them, in any batches."""
    told = replace(settings(delays=Delays(tip_on=0.02, off=0.1)), untold=untold)
    compare(told, messages, cuts, [T0 + t * MS for t in ticks], S)


def test_a_robot_slides_before_it_tips_where_friction_says_so() -> None:
    """On a slope of 15 degrees with a friction of 0.3 it does, with 0.5 there is no such alert."""
    lean = tilted(math.radians(15.0))
    messages = run_of(2.0, imu=Imu(0, lean, acceleration=upright(lean)))
    for friction, wanted in ((0.3, 1), (0.5, 0), (math.inf, 0)):
        told = settings(limits=Limits((45.0, 30.0), friction=friction))
        _, evaluator = recorded(told, [messages], T0 + 2 * S)
        slides = [a for a in evaluator.watch.log if a.rule.code == 'SLIDE']
        assert len(slides) == wanted
        for alert in slides:
            assert math.degrees(-alert.peak) == pytest.approx(1.7, abs=0.01)
            assert describe(alert, told).endswith(': 1.6 deg of slope left')


def test_a_payload_counts_from_the_next_joint_state_on() -> None:
    """Also where the batch ends between the payload, the IMU and the joint state that follow."""
    messages: list[Message] = [
        Imu(T0 + MS),
        Joints(T0 + 2 * MS),
        Carry(T0 + 3 * MS, 5.0),
        Imu(T0 + 4 * MS),
        Joints(T0 + 5 * MS),
    ]
    for cut in range(6):
        rows, _ = recorded(settings(), split(messages, [cut]), T0 + S)
        torque = np.concatenate([part.torque[:, 0] for part in rows])
        assert torque[1] == torque[2]
        assert torque[3] > torque[1] + 30.0


@pytest.mark.parametrize('absent', [Joints, Imu])
def test_an_absent_input_is_never_ok(absent: type) -> None:
    """Without joint states or without IMU no margin is ever known."""
    messages = [m for m in run_of(3.0) if not isinstance(m, absent)]
    seen, alerts = live(settings(), messages, T0 + 3 * S, [T0 + 600 * MS])
    assert all(margins is None for _, margins in seen)
    subject = 'joint_states' if absent is Joints else 'imu'
    stale = [a for a in alerts if a.rule.code == 'INPUT_STALE']
    assert [(a.rule.subject, a.start, a.end) for a in stale] == [(subject, T0 + 500 * MS, None)]
    rows, _ = recorded(settings(), [messages], T0 + 3 * S)
    assert not rows[0].known.any()


@pytest.mark.parametrize('silent', [Joints, Imu])
def test_an_input_that_falls_silent_makes_margins_unknown(silent: type) -> None:
    """From its limit on, three periods but at least 0.1 s, every margin is unknown."""
    messages = [m for m in run_of(6.0) if not (isinstance(m, silent) and m.time > T0 + 4 * S)]
    last = max(m.time for m in messages if isinstance(m, silent))
    seen, _ = live(settings(), messages, T0 + 6 * S)
    late = [margins for m, margins in seen if m.time > last + 100 * MS]
    assert len(late) > 90
    assert set(late) == {None}


def test_half_of_the_joints_gone_makes_margins_unknown() -> None:
    """A joint that is no longer refreshed is missing, though its topic is alive."""
    messages: list[Message] = [
        Joints(m.time, ('lift',), (0.1,)) if isinstance(m, Joints) and m.time > T0 + 4 * S else m
        for m in run_of(6.0)
    ]
    seen, alerts = live(settings(), messages, T0 + 6 * S)
    assert seen[-1][1] is None
    assert ('INPUT_INCOMPLETE', 'joint_states') in {(a.rule.code, a.rule.subject) for a in alerts}


def test_a_position_that_is_not_a_number_makes_margins_unknown() -> None:
    """A position of NaN makes the margins unknown: neither the last value nor 0 is used."""
    messages = [*run_of(1.0), Joints(T0 + S, position=(math.nan, 0.0)), Imu(T0 + S + MS)]
    seen, alerts = live(settings(), messages, T0 + S + MS)
    assert [margins for _, margins in seen[-2:]] == [None, None]
    assert ('INPUT_INVALID', 'joint_states') in {(a.rule.code, a.rule.subject) for a in alerts}


def endless(velocity: float = 2.0, axis: Vector = (0.0, -1.0, 0.0)) -> Settings:
    """Return settings in which the lift has no range, and its axis is another."""
    told = settings()
    lift = replace(
        told.robot.joints[0], kind='continuous', lower=-math.inf, upper=math.inf,
        velocity=velocity, axis=axis,
    )  # fmt: skip
    return replace(told, robot=replace(told.robot, joints=(lift, told.robot.joints[1])))


_held = st.sampled_from([T0, T0 + 123, 0])


@st.composite
def stubborn(draw: st.DrawFn) -> list[Message]:
    """Return streams whose joint states repeat stamps and positions, turn, and jump in units."""
    at = st.sampled_from([0.0, 0.3, 1.0, 6.0, 6.5, 7.0, 12.0, 60.0, -90.0])
    slides = st.sampled_from([0.0, 0.2, 0.3])
    names = st.sampled_from(
        [('lift', 'hand_slide'), ('lift',), ('hand_slide', 'lift'), ('a_lift',)]
    )
    found: list[Message] = []
    now = T0
    for _ in range(draw(st.integers(1, 8))):
        kind, count = draw(st.sampled_from(['held', 'whole', 'new'])), draw(st.integers(1, 40))
        wait = draw(st.sampled_from([20, 20, 50, 300])) * MS
        which, values = draw(names), {'lift': draw(at), 'hand_slide': draw(slides), 'a_lift': 0.0}
        turn, rate = draw(st.sampled_from([0.0, 0.0, 0.02, -0.2])), draw(st.floats(-60.0, 60.0))
        constant = draw(_held)
        for _ in range(count):
            now += wait
            values['lift'] += turn
            stamp = {'held': constant, 'whole': now // S * S, 'new': now}[kind]
            position = tuple(values[name] for name in which)
            rates = tuple(rate for _ in which) if draw(st.booleans()) else ()
            found.append(Joints(now, which, position, rates, stamp=stamp))
            found.append(Imu(now + MS))
    return found


@hypothesis.settings(max_examples=60)
@given(
    stubborn(),
    st.lists(st.integers(0, 300), max_size=5),
    st.sampled_from([2.0, 0.1, math.inf]),
    st.sampled_from([(0.0, -1.0, 0.0), (0.0, 0.0, 1.0)]),
)
def test_repeats_turns_and_rates_are_equal_too(
    messages: list[Message], cuts: list[int], velocity: float, axis: Vector
) -> None:
    """Repeated messages, turns beyond a full one, and rates that contradict, in any batches."""
    compare(endless(velocity, axis), messages, cuts, [T0 + 700 * MS], S)
