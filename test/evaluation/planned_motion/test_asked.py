"""What cannot be known is never permitted, nor what passes a joint's own limits."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from evaluation.planned_motion.motions import (
    EMPTY,
    FOLDED,
    arm_settings,
    level,
    one_joint,
    settings_of,
    way,
)

from ugv_acceptance.evaluation.planned_motion import (
    NOT_KNOWN,
    PERMITTED,
    REFUSED,
    CheckedMotion,
    Conditions,
    Trajectory,
    check_motion,
)
from ugv_acceptance.evaluation.settings import ALWAYS, CONTACTS, JointInput, Settings, Untold
from ugv_acceptance.model.robot import Payload

SETTINGS = settings_of(one_joint())
GOOD = way([0.5, 0.8], [1.0, 2.0], [0.0, 0.0])


def ask(
    trajectory: Trajectory = GOOD, conditions: Conditions | None = None, **more: Any
) -> CheckedMotion:
    """Check a motion of the one joint, by default one that is permitted."""
    return check_motion(replace(SETTINGS, **more), trajectory, conditions or level(0.3))


def test_the_motion_that_the_others_are_made_of_is_permitted() -> None:
    """Without a reason."""
    assert (ask().verdict, ask().reasons) == (PERMITTED, ())


def with_number(table: str, value: float) -> Trajectory:
    """Return the good motion with one number replaced."""
    changed = np.array(getattr(GOOD, table), np.float64)
    changed.flat[1] = value
    tables: dict[str, Any] = {table: changed}
    return replace(GOOD, **tables)


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize('table', ['times', 'positions', 'velocities'])
def test_what_is_no_number_is_not_known(table: str, value: float) -> None:
    """NaN of a velocity alone in its row, as here, says that the point has none: a straight way."""
    if table == 'velocities' and math.isnan(value):
        assert any('changes of rate' in text for text in ask(with_number(table, value)).not_checked)
        return
    found = ask(with_number(table, value))
    assert found.verdict == NOT_KNOWN
    assert found.reasons


TWO = replace(GOOD, names=('lift_m', 'lift_m'), positions=np.zeros((2, 2)), velocities=None)


@pytest.mark.parametrize(
    ('change', 'told'),
    [
        (lambda t: replace(t, times=np.array([1.0, 1.0])), 'times do not increase'),
        (lambda t: replace(t, times=np.array([2.0, 1.0])), 'times do not increase'),
        (lambda t: replace(t, times=np.array([-1.0, 1.0])), '0 s or more'),
        (lambda _: TWO, 'names lift_m twice'),
        (lambda t: replace(t, names=('lift',)), 'no joint that the robot is known by'),
        (lambda t: replace(t, positions=np.zeros((2, 2))), 'expected 2 points of 1 joints'),
        (lambda t: replace(t, velocities=np.zeros((1, 1))), 'expected 2 points of 1 joints'),
        (lambda t: replace(t, times=np.zeros(0)), 'no points'),
        (lambda t: replace(t, names=(), positions=np.zeros((2, 0)), velocities=None), 'no joints'),
        (lambda t: replace(t, velocities=None, accelerations=np.zeros((2, 1))), 'no velocities'),
    ],
)  # fmt: skip
def test_what_is_no_motion_is_not_known(
    change: Callable[[Trajectory], Trajectory], told: str
) -> None:
    """With a sentence that says why."""
    found = ask(change(GOOD))
    assert found.verdict == NOT_KNOWN
    assert told in ' '.join(found.reasons)


@pytest.mark.parametrize(
    ('change', 'told'),
    [
        ({'gravity': None}, 'attitude'),
        ({'gravity': (0.0, math.nan, -9.81)}, 'attitude'),
        ({'payload': None}, 'payload'),
        ({'payload': Payload(math.nan)}, 'payload'),
        ({'payload': Payload(-1.0)}, 'payload'),
        ({'posture': ()}, 'where lift stands'),
        ({'posture': (math.nan,)}, 'where lift stands'),
        ({'posture': (0.0, 0.0)}, 'expected 1'),
        ({'at_rest': False}, 'moves already'),
        ({'ground': 'mud'}, 'mud'),
    ],
)
def test_without_a_condition_nothing_is_known(change: dict[str, Any], told: str) -> None:
    """Whatever is missing: attitude, load, posture, rest, ground."""
    found = ask(conditions=replace(level(0.3), **change))
    assert found.verdict == NOT_KNOWN
    assert told in ' '.join(found.reasons)


@pytest.mark.parametrize('key', [CONTACTS, 'joints.lift.limit'])
def test_what_the_configuration_does_not_know_permits_nothing(key: str) -> None:
    """As nothing passes an evaluation then; what is refused all the same stays refused."""
    assert ask(unknown=(key,)).verdict == NOT_KNOWN
    heavy = ask(unknown=(key,), conditions=level(0.3, payload=Payload(20.0)))
    assert heavy.verdict == REFUSED


def test_a_joint_that_stays_has_to_be_known() -> None:
    """Never guessed; unless turning it changes nothing, or the settings say that it is harmless."""
    told, names = arm_settings(), ('shoulder_m', 'elbow_m')
    motion = Trajectory(names, np.array([3.0]), np.array([[1.4, -2.0]]))
    known = level(0.0, 1.5, -2.2, FOLDED)
    assert check_motion(told, motion, known).verdict == PERMITTED
    unknown = level(0.0, 1.5, -2.2, math.nan)
    found = check_motion(told, motion, unknown)
    assert (found.verdict, found.reasons) == (NOT_KNOWN, ('where flippers stands is not known',))
    untold = (None, None, None, Untold(FOLDED, harmless=False))
    assert check_motion(replace(told, untold=untold), motion, unknown).verdict == NOT_KNOWN
    untold = (None, None, None, Untold(FOLDED, harmless=True))
    assert check_motion(replace(told, untold=untold), motion, unknown).verdict == PERMITTED


def test_signs_and_offsets_of_messages_are_applied() -> None:
    """The same motion, told in the messages' own sense, has the same margins."""
    other = replace(SETTINGS, joints=(JointInput('lift_m', -1.0, 0.2),))
    rates = GOOD.velocities
    assert rates is not None
    turned = replace(GOOD, positions=0.2 - GOOD.positions, velocities=-rates)
    found = check_motion(other, turned, level(0.3))
    assert found.joint is not None
    assert found.joint.torque == pytest.approx(ask().joint.torque, rel=1e-12)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ('motion', 'told'),
    [
        (way([2.6], [3.0], [0.0]), 'its range is'),
        (way([-1.1], [3.0], [0.0]), 'its range is'),
        # Between points that are inside the range, it swings out of it.
        (way([2.4, 2.4], [3.0, 4.0], [2.0, -2.0]), 'its range is'),
        (way([2.0], [0.5], [0.0]), 'it can move at'),
        (way([2.0], [0.5]), 'it can move at'),
    ],
)
def test_a_joint_is_not_sent_past_its_range_or_speed(motion: Trajectory, told: str) -> None:
    """Neither at a point nor between two."""
    found = check_motion(settings_of(one_joint(), 1e6, tip_error=-9.0), motion, level(0.3))
    assert found.verdict == REFUSED
    assert any(told in reason for reason in found.reasons)


def test_a_way_back_into_the_range_is_none_out_of_it() -> None:
    """The joint stands a degree beyond its stop, by its encoder."""
    assert ask(way([1.0], [3.0], [0.0]), level(2.515)).verdict == PERMITTED
    assert ask(way([2.515], [3.0], [0.0]), level(2.0)).verdict == REFUSED


def test_the_first_point_is_not_jumped_to() -> None:
    """Due at once and elsewhere: refused; near enough, as encoders are, or where it stands: not."""
    jump = way([0.5, 0.8], [0.0, 2.0], [0.0, 0.0])
    found = ask(jump)
    assert found.verdict == REFUSED
    assert 'it would jump' in found.reasons[0]
    assert ask(jump, level(0.49)).verdict == PERMITTED
    assert ask(jump, level(from_first_point=True)).verdict == PERMITTED


def endless() -> Settings:
    """Return settings of the one joint without ends."""
    robot = one_joint()
    lift = replace(robot.joints[0], kind='continuous', lower=-math.inf, upper=math.inf)
    return settings_of(replace(robot, joints=(lift, *robot.joints[1:])))


@pytest.mark.parametrize(
    ('start', 'first', 'verdict'),
    [
        (0.1, 3.0, PERMITTED),  # over the top
        (0.1, 3.0 - math.tau, REFUSED),  # over the top, or down by its numbers
        (0.1 + math.tau, 3.0, REFUSED),
        (0.1, 0.1 + math.pi - 0.01, REFUSED),  # as good as half a turn
        (0.1, 0.1 + math.pi + 0.01, REFUSED),
        (math.pi - 0.1, math.pi + 0.1, PERMITTED),
        (math.pi - 0.1, 0.1 - math.pi, REFUSED),  # by its numbers nearly a whole turn
        (0.1 + math.tau, 3.0 + math.tau, PERMITTED),
    ],
)
def test_a_joint_without_end_may_go_either_way_round(
    start: float, first: float, verdict: str
) -> None:
    """By its numbers or the shorter way, as controllers differ: permitted if each way is."""
    found = check_motion(endless(), way([first], [8.0], [0.0]), level(start))
    assert found.verdict == verdict
    told = any('either way round' in caution for caution in found.cautions)
    assert told == (verdict == REFUSED)


def test_the_worse_way_round_gives_the_margins() -> None:
    """The least tilt and the most torque of both ways, however they are refused."""
    ways = [
        check_motion(endless(), way([3.0 - turn], [8.0], [0.0]), level(0.1 - turn + back))
        for turn, back in ((math.tau, 0.0), (math.tau, math.tau))
    ]
    both = ways[1]
    assert both.tilt is not None
    assert ways[0].tilt is not None
    assert both.tilt.angle <= ways[0].tilt.angle
    assert both.joint is not None
    assert ways[0].joint is not None
    assert both.joint.share >= ways[0].joint.share
    assert both.samples > ways[0].samples


def test_a_first_point_that_is_told_in_another_turn_is_a_jump() -> None:
    """Due at once: a controller that counts whole turns would swing the arm round."""
    motion = way([0.5, 0.8], [0.0, 2.0], [0.0, 0.0])
    same, other = (check_motion(endless(), motion, level(0.5 + of)) for of in (0.0, math.tau))
    assert same.verdict == PERMITTED
    assert other.verdict == REFUSED
    assert '360 deg' in other.reasons[0]


@pytest.mark.parametrize('far', [1e19, -1e30, 1e300])
@pytest.mark.parametrize('seconds', [0.0, 8.0])
def test_a_first_point_beyond_all_turns_is_not_permitted(far: float, seconds: float) -> None:
    """A joint without end that is sent beyond what can be counted: an answer, and no fault."""
    found = check_motion(endless(), way([far], [seconds], [0.0]), level(0.1))
    assert found.verdict != PERMITTED
    assert found.reasons


def test_too_many_ways_round_are_not_known() -> None:
    """Of a robot with more such joints than can be looked at."""
    told = arm_settings()
    joints = tuple(
        replace(of, kind='continuous') if of.kind == 'revolute' else of for of in told.robot.joints
    )
    endless_arm = replace(told, robot=replace(told.robot, joints=joints))
    names = tuple(of.topic_name for of in told.joints)
    motion = Trajectory(names, np.array([9.0]), np.full((1, len(names)), 4.0))
    found = check_motion(endless_arm, motion, level(*[0.0] * len(names)))
    assert (found.verdict, len(names)) == (NOT_KNOWN, 4)
    assert 'either' in found.reasons[0]


def test_the_way_to_the_first_point_is_a_part_of_the_motion() -> None:
    """A heavy arm passes its level place on the way from where it stands."""
    motion = way([1.3, 1.4], [30.0, 31.0], [0.0, 0.0])
    above, below = (ask(motion, level(start)) for start in (1.2, -0.4))
    assert above.joint is not None
    assert below.joint is not None
    assert below.joint.torque > 2.0 * above.joint.torque
    assert below.joint.point == 1


def test_an_arm_on_the_ground_is_refused() -> None:
    """No margin is valid there; where the hand may touch it, it is not known."""
    found = ask(way([-1.0], [5.0], [0.0]), level(0.3))
    assert found.verdict == REFUSED
    assert 'comes to the ground' in ' '.join(found.reasons)
    assert ask(way([-1.0], [5.0], [0.0]), level(0.3), hand_may_touch=ALWAYS).verdict == NOT_KNOWN


def test_a_motion_that_lifts_the_robot_off_is_refused() -> None:
    """Its reaction leaves nothing that presses on the ground."""
    found = check_motion(settings_of(one_joint(), 1e9), way([-0.1], [0.02], [0.0]), level(0.1))
    assert found.verdict == REFUSED
    assert any('does not stand' in reason for reason in found.reasons)


def test_stairs_are_taken_cautiously() -> None:
    """What flat ground permits is not known on stairs if shortened tracks would tip."""
    told, names = arm_settings(), ('shoulder_m', 'elbow_m')
    motion = Trajectory(names, np.array([6.0]), np.array([[0.9, -0.9]]))
    verdicts = [
        check_motion(told, motion, level(0.0, 1.5, -2.2, FOLDED, ground=kind)).verdict
        for kind in ('flat', 'stairs')
    ]
    assert verdicts == [PERMITTED, NOT_KNOWN]


def test_limits_are_those_of_the_live_monitor() -> None:
    """Refused from where it says DANGER on (2 % of a torque before), a caution from CAUTION on."""
    needs = ask().joint
    assert needs is not None
    for share, verdict, cautions in ((1.03, PERMITTED, 1), (1.01, REFUSED, 0), (2.0, PERMITTED, 0)):
        limits = replace(SETTINGS.limits, torque=(needs.torque * share,))
        found = ask(limits=limits)
        assert (found.verdict, len(found.cautions)) == (verdict, cautions)
    tilt = ask().tilt
    assert tilt is not None
    for over, verdict in ((1e-6, REFUSED), (-1e-6, PERMITTED)):
        assert ask(limits=replace(SETTINGS.limits, tip_error=tilt.angle + over)).verdict == verdict


def test_nearer_to_tipping_than_two_degrees_is_refused_whatever_the_limit() -> None:
    """There the robot rocks on one edge, and what its motors need is not known."""
    steep = 0.0
    while True:
        steep += math.radians(0.25)
        down = (0.0, -9.81 * math.sin(steep), -9.81 * math.cos(steep))
        found = ask(conditions=replace(level(0.3), gravity=down))
        assert found.tilt is not None
        if found.tilt.angle < math.radians(1.9):
            break
        if found.tilt.angle > math.radians(2.1):
            assert found.verdict == PERMITTED
    assert found.tilt.angle > math.radians(1.0)
    assert found.verdict == REFUSED
    assert 'must stay above 2 deg' in found.reasons[0]


def test_no_payload_link_carries_no_load() -> None:
    """A load on a robot that has nowhere for it is not known; none is."""
    robot = replace(one_joint(), payload_link=None)
    told = settings_of(robot)
    assert check_motion(told, GOOD, level(0.3, payload=EMPTY)).verdict == PERMITTED
    assert check_motion(told, GOOD, level(0.3, payload=Payload(1.0))).verdict == NOT_KNOWN
