"""Joint states: found by name, in robot convention, partial ones merged, odd ones told apart."""

import math
from dataclasses import replace
from typing import Any

import hypothesis
import numpy as np
import pytest
from evaluation.streams import MS, T0, Joints, S, batch_of, joint_messages, settings, split
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.alerts.rules import RuleSet
from ugv_acceptance.evaluation.inputs.joints import JointMerger


def merged(message: Joints) -> JointMerger:
    """Return a merger that took one message."""
    merger = JointMerger(settings())
    m = message
    merger.merge(m.time, m.names, m.position, m.velocity, m.effort)
    return merger


@hypothesis.settings(max_examples=200)
@given(
    st.lists(joint_messages(), min_size=1, max_size=25), st.lists(st.integers(0, 25), max_size=4)
)
def test_columns_are_merged_as_single_messages_are(messages: list[Joints], cuts: list[int]) -> None:
    """Whatever joints each message names, in whatever order, with whatever numbers."""
    timed = [
        Joints(T0 + k * MS, m.names, m.position, m.velocity, m.effort)
        for k, m in enumerate(messages)
    ]
    one, many = JointMerger(settings()), JointMerger(settings())
    expected = [
        (m.time, [*one.q, *one.qd, *one.effort], min(one.seen))
        for m in timed
        if one.merge(m.time, m.names, m.position, m.velocity, m.effort)
    ]
    rows = [many.merge_columns(batch_of(part).joints) for part in split(timed, cuts)]
    got = [
        (int(r.time[k]), [*r.q[k], *r.qd[k], *r.effort[k]], int(r.oldest[k]))
        for r in rows
        for k in range(len(r.time))
    ]
    assert [(t, oldest) for t, _, oldest in got] == [(t, oldest) for t, _, oldest in expected]
    np.testing.assert_array_equal([x for _, x, _ in got], [x for _, x, _ in expected])
    assert many.seen == one.seen


def test_sign_offset_and_effort_scale_are_undone() -> None:
    """The lift counts downwards from 0.1 rad and tells its torque in kN m of other sign."""
    merger = merged(Joints(T0, position=(0.3, 0.2), velocity=(0.5, 0.1), effort=(0.02, 7.0)))
    assert merger.q == [pytest.approx(-0.2), 0.2]
    assert merger.qd == [-0.5, 0.1]
    assert merger.effort == [-20.0, 7.0]


def test_names_may_come_in_any_order_among_others() -> None:
    """Joints are found by name, in any order and among other joints."""
    merger = merged(Joints(T0, ('wheel', 'hand_slide', 'lift'), (9.0, 0.2, 0.3)))
    assert merger.q == [pytest.approx(-0.2), 0.2]


@pytest.mark.parametrize('position', [math.nan, math.inf, -math.inf, 1e308, 90.0])
def test_a_position_that_cannot_be_the_joints_is_unknown(position: float) -> None:
    """Not a number, infinite, or far outside its limits, as degrees given for radians are."""
    merger = merged(Joints(T0, position=(position, 0.2)))
    assert math.isnan(merger.q[0])
    assert merger.q[1] == 0.2


@pytest.mark.parametrize(
    ('slide', 'known'), [(0.5, True), (0.5001, False), (-0.3, True), (-0.3001, False)]
)
def test_a_position_may_be_a_tenth_beyond_its_limits(slide: float, known: bool) -> None:  # noqa: FBT001
    """The slide goes from -0.2 m to 0.4 m; alone and in columns."""
    message = Joints(T0, position=(0.1, slide))
    assert math.isnan(merged(message).q[1]) != known
    rows = JointMerger(settings()).merge_columns(batch_of([message]).joints)
    assert np.isnan(rows.q[0, 1]) != known
    assert rows.unusable[0] != known


@pytest.mark.parametrize(
    ('number', 'known'), [(1e5, True), (-1e5, True), (1.0001e5, False), (-1.0001e5, False)]
)
def test_no_rate_is_beyond_a_hundred_thousand(number: float, known: bool) -> None:  # noqa: FBT001
    """A rate beyond 1e5 is unknown."""
    message = Joints(T0, position=(0.1, 0.1), velocity=(0.0, number))
    one = JointMerger(settings())
    one.merge(T0, message.names, message.position, message.velocity, ())
    rows = JointMerger(settings()).merge_columns(batch_of([message]).joints)
    assert [x == number for x in (one.qd[1], float(rows.qd[0, 1]))] == [known] * 2


def test_a_name_that_stands_twice_is_left_out() -> None:
    """A joint named twice in one message is left out."""
    merger = merged(Joints(T0, ('lift', 'lift', 'hand_slide'), (0.1, 0.2, 0.3)))
    assert math.isnan(merger.q[0])
    assert merger.q[1] == 0.3


@pytest.mark.parametrize(
    'message',
    [
        Joints(T0, ('wheel',), (1.0,)),
        Joints(T0, (), ()),
        Joints(T0, position=()),
        Joints(T0, position=(0.1,)),
    ],
)
def test_a_message_without_a_position_of_ours_is_no_event(message: Joints) -> None:
    """Foreign joints, no names, no positions, or another number of them than of names."""
    merger = JointMerger(settings())
    m = message
    assert not merger.merge(m.time, m.names, m.position, m.velocity, m.effort)


def test_empty_velocity_and_effort_are_unknown_not_zero() -> None:
    """Empty velocities and efforts are unknown (NaN), not 0."""
    merger = merged(Joints(T0))
    assert all(map(math.isnan, [*merger.qd, *merger.effort]))


def turning(unit: float, wrapped: float = 0.0) -> tuple[list[float], list[str]]:
    """Return what is known of an endless joint that turns at 1 of its 2 rad/s, and the alerts.

    `unit` is what a message says of a radian; positions are wrapped at that many of them.
    """
    told = settings()
    lift = replace(told.robot.joints[0], kind='continuous', lower=-math.inf, upper=math.inf)
    told = replace(told, robot=replace(told.robot, joints=(lift, told.robot.joints[1])))
    watch = RuleSet(told)
    merger, known = JointMerger(told, watch.jump_signals), []
    for k in range(1000):
        angle = k * 0.01
        angle = angle - wrapped * round(angle / wrapped) if wrapped else angle
        merger.merge(T0 + k * 10 * MS, ('lift', 'hand_slide'), (unit * angle, 0.1), (), ())
        known.append(merger.q[0])
    return known, [f'{a.rule.code} {a.rule.subject}' for a in watch.log]


@pytest.mark.parametrize('wrapped', [0.0, math.tau])
def test_an_endless_joint_may_turn(wrapped: float) -> None:
    """A continuous joint's position stays known as it turns, wrapped at a turn or not."""
    known, alerts = turning(1.0, wrapped)
    assert not alerts
    assert not any(map(math.isnan, known))


@pytest.mark.parametrize('wrapped', [0.0, math.tau])
def test_degrees_of_an_endless_joint_are_found_by_its_motion(wrapped: float) -> None:
    """Degrees given for radians are found by a continuous joint's motion: 57 times too fast."""
    known, alerts = turning(180.0 / math.pi, wrapped)
    assert set(alerts) == {'POSITION_LEAP lift'}
    assert all(map(math.isnan, known[101:]))


def test_a_leap_is_forgotten_when_the_joint_is_slow_again() -> None:
    """A joint that jumps once, as by homing, is unknown for a while and then known again."""
    slide = [0.0] * 150 + [0.3] * 450
    told = [replace(j, velocity=0.01) for j in settings().robot.joints]
    slow = replace(settings(), robot=replace(settings().robot, joints=tuple(told)))
    watch = RuleSet(slow)
    merger, known = JointMerger(slow, watch.jump_signals), []
    for k, q in enumerate(slide):
        merger.merge(T0 + k * 10 * MS, ('lift', 'hand_slide'), (0.1, q), (), ())
        known.append(merger.q[1])
    assert [a.rule.subject for a in watch.log] == ['slide']
    assert watch.log[0].start == T0 + 2 * S
    assert watch.log[0].end == T0 + 4 * S
    assert all(map(math.isnan, known[200:400]))
    assert known[400:] == [0.3] * 200


def heard(
    told: list[tuple[int, float]], joint: str = 'hand_slide', **change: Any
) -> list[tuple[str, int]]:
    """Return the leaps (subject, seconds from the start) of a joint told (ms, position)."""
    robot = settings().robot
    joints = tuple(replace(j, lower=-9.0, upper=9.0, **change) for j in robot.joints)
    of = replace(settings(), robot=replace(robot, joints=joints))
    logs = []
    for columns in (False, True):
        watch = RuleSet(of)
        merger = JointMerger(of, watch.jump_signals)
        run = [Joints(T0 + at * MS, (joint,), (q,)) for at, q in told]
        for part in split(run, [len(run) // 3, 370]):
            if columns:
                merger.merge_columns(batch_of(part).joints)
            else:
                for m in part:
                    assert isinstance(m, Joints)
                    merger.merge(m.time, m.names, m.position, (), ())
        logs.append([(a.rule.subject, (a.start - T0) // S) for a in watch.log])
    assert logs[0] == logs[1]
    return logs[0]


@pytest.mark.parametrize('every', [10, 100, 300])
def test_two_robots_that_tell_of_one_joint_are_not_believed(every: int) -> None:
    """Two robots' positions of one joint, in turn, make it unknown."""
    ours = [(at, 0.0) for at in range(0, 3000, 10)]
    theirs = [(at + 3, 0.2) for at in range(20, 3000, every)]
    assert heard(sorted(ours + theirs)) == [('slide', 1)]


def test_robots_that_agree_are_believed() -> None:
    """Two drivers of one joint whose positions agree cause no fault."""
    told = [(at + late, (at - 10 * late) / 1e3) for at in range(0, 3000, 10) for late in (0, 5)]
    assert not heard(told, velocity=1.0)


def test_a_wrong_reading_a_second_is_no_contradiction() -> None:
    """One wrong reading a second (two jumps) is no fault; three jumps in a second are."""
    told = [(at, 0.2 if at % 1000 == 500 else 0.0) for at in range(0, 4000, 10)]
    assert not heard(told)
    assert heard([*told[:160], (1601, 0.2), *told[160:]]) == [('slide', 2)]


def test_messages_that_come_late_and_all_at_once_do_not_leap() -> None:
    """Messages of a moving joint that arrive in a burst are no jump."""
    assert not heard([(at - at % 50 + at % 50 // 10, at / 1e3) for at in range(0, 3000, 10)])


@pytest.mark.parametrize(('kind', 'jump_signals'), [('continuous', 0), ('revolute', 1)])
def test_a_turn_to_and_fro_is_no_leap_of_an_endless_joint(kind: str, jump_signals: int) -> None:
    """A continuous joint reported at +half a turn and -half a turn in turn has not jumped."""
    told = [(at, math.pi * (-1) ** (at // 10)) for at in range(5, 3000, 10)]
    assert len(heard(told, 'lift', kind=kind)) == jump_signals
