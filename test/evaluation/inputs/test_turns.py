"""Positions beyond a full turn of a joint that has no range: turns, or degrees."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from evaluation.streams import T0, Joints, S, batch_of, split

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.alerts.rules import RuleSet
from ugv_acceptance.evaluation.inputs.joints import JointMerger
from ugv_acceptance.evaluation.inputs.turns import turning_of
from ugv_acceptance.evaluation.settings import JointInput, Settings
from ugv_acceptance.model.robot import Joint, Link

TOLD = load().settings
NAMES = tuple(joint.topic_name for joint in TOLD.joints)
POSE = (0.4, 1.0, 1.5, math.pi)


def known(
    run: Sequence[tuple[float, ...]], settings: Settings = TOLD, hz: float = 50.0
) -> list[bool]:
    """Return for each message of positions whether all could be used: the same on both roads."""
    names = tuple(joint.topic_name for joint in settings.joints)
    messages = [Joints(T0 + round(k * S / hz), names, q) for k, q in enumerate(run)]
    found = []
    merger = JointMerger(settings, RuleSet(settings).jump_signals)
    for m in messages:
        merger.merge(m.time, m.names, m.position, (), (), m.time)
        found.append(all(map(math.isfinite, merger.q)))
    other = JointMerger(settings, RuleSet(settings).jump_signals)
    rows = [other.merge_columns(batch_of(p).joints) for p in split(messages, [len(run) // 3])]
    columns = np.concatenate([np.isfinite(r.q).all(axis=1) for r in rows])
    assert columns.tolist() == found
    return found


def held(*pose: float) -> list[tuple[float, ...]]:
    """Return a second of messages at one pose."""
    return [pose] * 50


@pytest.mark.parametrize(
    'pose',
    [
        (0.0, 60.0, 90.0, 180.0), (10.0, 64.0, 86.0, 180.0), (0.0, 60.0, 0.0, 0.0),
        (0.0, 0.0, -45.0, 3.0), (-20.0, 1.0, 30.0, 0.0), (0.4, 1.0, 1.5, 180.0),
        (20.0, 0.0, 0.0, 0.0), (0.0, 6.5, 0.0, 0.0), (0.0, -1e4, 1.0, 1.0), (0.4, 1.0, 1.5, 1e300),
    ],
)  # fmt: skip
def test_degrees_at_rest_are_not_believed(pose: tuple[float, ...]) -> None:
    """Beyond a turn from the first message on: one joint or all, however far, either sign."""
    assert not any(known(held(*pose)))


@pytest.mark.parametrize(
    'pose', [POSE, (0.0, 0.0, 0.0, 0.0), (0.0, 6.2, -6.2, 3.0), (math.tau, 1.0, 1.0, -math.tau)]
)
def test_positions_within_a_turn_are_believed(pose: tuple[float, ...]) -> None:
    """Whether drivers wrap at half a turn or at a whole one, and either way round."""
    assert all(known(held(*pose)))


@pytest.mark.parametrize('turns', [3, -3, 40])
def test_a_turret_may_have_turned_before(turns: int) -> None:
    """Its axis is upright, and the arm stands at angles that are angles in radians."""
    assert all(known(held(POSE[0] + turns * math.tau, *POSE[1:])))


@pytest.mark.parametrize('joint', range(4))
@pytest.mark.parametrize('rate', [0.3, -1.2])
def test_a_joint_may_turn_further_than_a_turn_in_sight(joint: int, rate: float) -> None:
    """At a rate it can reach; every joint, to either side, however many turns."""
    run = []
    for k in range(2500):
        pose = list(POSE)
        pose[joint] += rate * k / 50
        run.append(tuple(pose))
    assert all(known(run))


def test_degrees_that_begin_within_a_turn_are_found_by_their_speed() -> None:
    """A shoulder at 3 that moves by 5 a second to 60: it is not believed from 2 pi on."""
    way = np.concatenate([3.0 + 0.1 * np.arange(570), np.full(500, 60.0)])
    found = known([(0.0, float(q), 0.0, 0.0) for q in way])
    assert all(found[:30])
    assert not any(found[40:])


def test_a_unit_that_changes_in_a_run_is_found() -> None:
    """A driver that restarts in degrees, and comes back."""
    degrees = tuple(math.degrees(q) for q in POSE)
    found = known(held(*POSE) + held(*degrees) + held(*degrees) + held(*POSE) * 5)
    assert all(found[:50])
    assert not any(found[50:150])
    assert all(found[-50:])


def test_a_wheel_is_believed_at_any_angle() -> None:
    """Turning it moves nothing, so nothing depends on its angle; an eccentric one is judged."""
    for offset, wanted in ((0.0, True), (0.2, False)):
        wheel = Link('wheel', 2.0, (offset, 0.0, 0.0))
        axle = Joint('axle', 'continuous', TOLD.robot.root, 'wheel', axis=(0.0, 1.0, 0.0))
        robot = replace(
            TOLD.robot, links=(*TOLD.robot.links, wheel), joints=(*TOLD.robot.joints, axle),
            joint_names=(*TOLD.robot.joint_names, 'axle'),
        )  # fmt: skip
        limits = replace(TOLD.limits, torque=(*TOLD.limits.torque, math.inf), speed=(), rated=())
        told = replace(TOLD, robot=robot, joints=(*TOLD.joints, JointInput('axle')), limits=limits)
        assert set(known(held(*POSE, 9e4), told)) == {wanted}
        assert turning_of(robot)[-1].moves is not wanted


def test_a_joint_with_a_range_is_judged_by_it() -> None:
    """A range of three turns allows three turns."""
    shoulder = replace(TOLD.robot.joint(TOLD.robot.joint_names[1]), lower=-20.0, upper=20.0)
    joints = tuple(shoulder if j.name == shoulder.name else j for j in TOLD.robot.joints)
    told = replace(TOLD, robot=replace(TOLD.robot, joints=joints))
    assert all(known(held(0.0, 19.0, 0.0, 0.0), told))
    assert not any(known(held(0.0, 21.0, 0.0, 0.0), told))


def test_a_leap_makes_the_two_seconds_before_it_doubtful() -> None:
    """So long may it take until positions a second apart show it."""
    (signal, *_) = RuleSet(TOLD).jump_signals[1:]
    assert signal.rule.reach == 2 * S + signal.rule.on_delay
