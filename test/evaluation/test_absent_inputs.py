"""Robots without an IMU, and robots without joint states: what is judged, and what is not."""

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
    Imu,
    Joints,
    Message,
    S,
    give,
    live,
    recorded,
    robot,
    run_of,
    settings,
    split,
    streams,
    tilted,
    upright,
)
from evaluation.test_live_equals_recorded import compare
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.criteria.criteria import default_criteria
from ugv_acceptance.evaluation.criteria.not_judged import not_judged, not_judged_joints
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.settings import Delays, ImuInput, Limits, Settings
from ugv_acceptance.model.robot import Joint, Link, Payload

NO_IMU = replace(settings(delays=Delays(off=0.1)), imu=ImuInput(attitude='level'))
ROVER = Settings(
    replace(robot(), joint_names=(), held=(('lift', 0.1), ('slide', 0.0))),
    (),
    ImuInput(frame='imu_link', agreement_delay=0.05),
    Limits(()),
    Delays(tip_on=0.02, off=0.1),
)


@hypothesis.settings(max_examples=100)
@given(
    streams(),
    st.lists(st.integers(0, 120), max_size=5),
    st.lists(st.integers(0, 3000), max_size=20),
    st.integers(0, 3 * S),
    st.sampled_from([NO_IMU, ROVER]),
)
def test_what_is_judged_is_the_same_live_and_recorded(
    messages: list[Message], cuts: list[int], ticks: list[int], rest: int, told: Settings
) -> None:
    """With an input less, any messages give the same margins and alerts live and recorded."""
    compare(told, messages, cuts, [T0 + t * MS for t in ticks], rest)


def without_imu() -> list[Message]:
    """A run of which only joint states came; the lift goes up at its end."""
    run = [m for m in run_of(3.0) if isinstance(m, Joints)]
    return [replace(m, position=(0.1 if m.time < T0 + 2 * S else -1.5, 0.0)) for m in run]


def test_without_an_imu_torques_are_those_of_a_level_base() -> None:
    """A base declared level gives the torques of a level IMU, and no tip-over margin at all."""
    run = without_imu()
    found, alerts = live(NO_IMU, run, T0 + 3 * S)
    level, _ = live(settings(), run_of(3.0), T0 + 3 * S)
    by_imu = next(m for _, m in reversed(level) if m is not None)
    told = [m for _, m in found if m is not None]
    assert len(told) == len(run)
    assert told[0].torque == pytest.approx(by_imu.torque)
    assert all(math.isnan(float(a)) for m in told for a in m.stability.angle)
    assert 'imu' not in {a.rule.subject for a in alerts}
    assert {'TIP_OVER', 'NO_SUPPORT', 'SLIDE'}.isdisjoint(a.rule.code for a in alerts)


def test_without_an_imu_a_torque_limit_still_counts() -> None:
    """A joint that needs more than its limit raises its alert without any IMU."""
    weak = replace(NO_IMU, limits=Limits((10.0, 30.0)))
    run = without_imu()
    _, alerts = live(weak, run, T0 + 3 * S)
    _, evaluator = recorded(weak, split(run, [70]), T0 + 3 * S)
    for log in (alerts, evaluator.watch.log):
        assert ('TORQUE_LIMIT', 'lift') in {(a.rule.code, a.rule.subject) for a in log}


def test_without_an_imu_silent_joints_are_still_stale() -> None:
    """What is left of the inputs must still come: silence of it leaves no margin."""
    run = [m for m in without_imu() if not T0 + S < m.time < T0 + 2 * S]
    _, alerts = live(NO_IMU, run, T0 + 3 * S)
    assert [a.rule.subject for a in alerts if a.rule.code == 'INPUT_STALE'] == ['joint_states']


def rolled(angle: float) -> list[Message]:
    """A run of which only the IMU came; the robot rolls to `angle` (rad) after a second."""
    turned = tilted(angle)
    lying: dict[str, Any] = {'orientation': turned, 'acceleration': upright(turned)}
    run = [m for m in run_of(3.0) if isinstance(m, Imu)]
    return [replace(m, **lying) if m.time > T0 + S else m for m in run]


def test_a_rover_without_joint_states_tips_by_its_imu_alone() -> None:
    """Without joint states every IMU message gives tip-over margins, and tipping is told."""
    run = rolled(1.2)
    found, alerts = live(ROVER, run, T0 + 3 * S)
    assert all(m is not None for _, m in found[:100])
    assert found[-1][1] is not None
    assert 'TIP_OVER' in {a.rule.code for a in alerts}
    assert 'joint_states' not in {a.rule.subject for a in alerts}


def test_a_rover_stands_by_the_load_it_was_told() -> None:
    """A load declared on a robot without joint states counts from its message on."""
    run: list[Message] = sorted([*rolled(0.0), Carry(T0 + 2 * S + 1, 8.0)], key=lambda m: m.time)
    found, _ = live(ROVER, run, T0 + 3 * S)
    front = {m.time: float(x.stability.angle[0]) for m, x in found if x is not None}
    before, after = (front[T0 + t * MS + MS] for t in (1990, 2000))
    assert after < before - 0.05
    rows, _ = recorded(ROVER, split(run, [150]), T0 + 3 * S)
    angles = np.concatenate([part.angle[:, 0] for part in rows])
    np.testing.assert_allclose(angles, list(front.values()), rtol=1e-12)


def test_a_rover_stands_by_the_load_that_a_person_told() -> None:
    """One set while the monitor runs counts from the next IMU message on, as if told before."""
    loaded = replace(ROVER, robot=replace(ROVER.robot, payload=Payload(8.0)))
    told, before = LiveEvaluator(ROVER), LiveEvaluator(loaded)
    for evaluator in (told, before):
        evaluator.start(T0)
        for message in rolled(0.0)[:100]:
            give(evaluator, message)
    told.adopt(loaded)
    for evaluator in (told, before):
        give(evaluator, rolled(0.0)[100])
    assert told.margins is not None
    assert before.margins is not None
    assert told.margins.angle == before.margins.angle


def test_what_an_absent_input_would_tell_is_not_checked() -> None:
    """Tip-over without an IMU, and torques without joint states, are told as not checked."""
    assert [one.what for one in not_judged(NO_IMU)] == ['tip-over']
    assert [one.what for one in not_judged(ROVER)] == ['torques']
    assert list(not_judged(settings())) == []


def test_nothing_is_demanded_that_nobody_measures() -> None:
    """Without an IMU the default criteria ask for no tip-over margin, and for all torques."""
    names = [c.name for c in default_criteria(NO_IMU).criteria]
    assert {'tip-over', 'support'}.isdisjoint(names)
    assert {'torque lift', 'torque slide'} <= set(names)
    assert {'tip-over', 'support'} <= {c.name for c in default_criteria(ROVER).criteria}


def test_joints_that_carry_weight_without_a_limit_are_named() -> None:
    """A joint without limit that carries torque in some attitude is named; a wheel is not."""
    body = robot()
    wheel = Joint('wheel', 'continuous', 'base', 'tyre', (0.0, 0.4, 0.1), axis=(0.0, 1.0, 0.0))
    mast = Joint('mast', 'continuous', 'base', 'pole', (0.0, 0.0, 0.4), axis=(0.0, 0.0, 1.0))
    more = replace(
        body,
        links=(*body.links, Link('tyre', 2.0), Link('pole', 2.0, (0.2, 0.0, 0.1))),
        joints=(*body.joints, wheel, mast),
        joint_names=('lift', 'slide', 'wheel', 'mast'),
    )
    told = settings()
    known = replace(
        told, robot=more, joints=(*told.joints, *told.joints), limits=Limits((math.inf,) * 4)
    )
    (found,) = not_judged_joints(known)
    assert ['lift' in found.what, 'slide' in found.what, 'mast' in found.what] == [True] * 3
    assert 'wheel' not in found.what
    judged = replace(known, limits=Limits((45.0, 30.0, math.inf, 5.0)))
    assert list(not_judged_joints(judged)) == []
