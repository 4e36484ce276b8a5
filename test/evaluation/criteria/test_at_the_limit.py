"""Values that are exactly at a limit, and least squares in closed form."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from evaluation.streams import LEVEL, MS, REST, STILL, T0, Joints, S, batch_of, settings
from scipy import stats

from ugv_acceptance.evaluation.alerts.rules import RuleSet
from ugv_acceptance.evaluation.criteria.criteria import default_criteria
from ugv_acceptance.evaluation.effort.regression import independent_samples, least_squares
from ugv_acceptance.evaluation.inputs.joints import JointMerger
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.settings import Limits
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.stability import stability_of, stances_of, standing
from ugv_acceptance.model.statics import torque_of

DOWN = (0.0, 0.0, -9.81)


def level() -> tuple[float, float]:
    """Return torque of the lift and tilt left to the front, as one sample gives them."""
    mechanics = mechanics_of(settings().robot)
    posture = posture_of(mechanics, (0.0, 0.0), 1.0, (0.1, 0.0, 0.0))
    angle = stability_of(standing(stances_of(mechanics, posture), DOWN), DOWN).angle[0]
    return abs(float(torque_of(posture, DOWN)[0])), float(angle)


TORQUE, FRONT = level()


def alerts_of(limits: Limits) -> set[tuple[str, str]]:
    """Return code and subject of what is raised where the small robot stands level."""
    evaluator = LiveEvaluator(settings(limits=limits))
    evaluator.start(T0)
    for k in range(10):
        at = T0 + k * S // 20
        evaluator.imu(at, at, LEVEL, 0.0, STILL, REST)
        evaluator.joint_state(at, at, ('lift', 'hand_slide'), (0.1, 0.0), (), ())
    evaluator.tick(T0 + S // 2)
    return {(a.rule.code, a.rule.subject) for a in evaluator.watch.log}


def test_a_torque_exactly_at_its_limit_is_one_too_many() -> None:
    """A torque equal to its limit raises the alert; with the next larger float as limit, none."""
    code = ('TORQUE_LIMIT', 'lift')
    assert code in alerts_of(Limits((TORQUE, 300.0), torque_warn=1.0))
    more = math.nextafter(TORQUE, math.inf)
    assert code not in alerts_of(Limits((more, 300.0), torque_warn=1.0))


def test_a_tilt_exactly_at_its_limit_is_too_little() -> None:
    """A tilt left equal to its limit raises the alert; with the next smaller limit, none."""
    code = ('TIP_OVER', 'front')
    assert code in alerts_of(Limits((99.0, 300.0), tip_warn=FRONT, tip_error=0.01))
    less = math.nextafter(FRONT, 0.0)
    assert code not in alerts_of(Limits((99.0, 300.0), tip_warn=less, tip_error=0.01))


@pytest.mark.parametrize(('jump', 'told'), [(1.99, False), (2.01, True)])
def test_a_joint_that_leaps_ten_times_faster_than_it_can_is_lost(jump: float, told: bool) -> None:  # noqa: FBT001
    """A position that changes at ten times the joint's greatest speed is unknown."""
    robot = settings().robot
    wide = replace(robot, joints=tuple(replace(j, lower=-99.0, upper=99.0, velocity=0.1)
                                       for j in robot.joints))  # fmt: skip
    told_settings = replace(settings(), robot=wide)
    merger = JointMerger(told_settings, RuleSet(told_settings).jump_signals)
    for k in range(3):
        at = T0 + 2 * k * S
        merger.merge(at, ('hand_slide',), (jump * (k % 2),), (), ())
        assert math.isnan(merger.q[1]) == (told and k > 0)


def slow_slide() -> Any:
    """Return settings in which the joints make 0.1 m/s or rad/s and go anywhere."""
    robot = settings().robot
    joints = tuple(replace(j, lower=-99.0, upper=99.0, velocity=0.1) for j in robot.joints)
    return replace(settings(), robot=replace(robot, joints=joints))


@pytest.mark.parametrize(('apart', 'told'), [(0.49, False), (0.5, True)])
def test_positions_are_compared_half_a_second_apart_or_more(apart: float, told: bool) -> None:  # noqa: FBT001
    """Jumps are sought between positions at least 0.5 s apart; nearer ones are only jitter."""
    watch = RuleSet(slow_slide())
    merger = JointMerger(slow_slide(), watch.jump_signals)
    for at, q in ((T0 + S - int(apart * 1e9) // 2, 0.0), (T0 + S + int(apart * 1e9) // 2, 0.9)):
        merger.merge(at, ('hand_slide',), (q,), (), ())
    assert math.isnan(merger.q[1]) == told
    assert len(watch.log) == int(told)


def test_columns_see_the_leaps_that_messages_show() -> None:
    """Columns and single messages find the same implausible jumps in random walks of two joints."""
    rng = np.random.default_rng(12)
    for _ in range(5):
        steps = rng.choice((0.0, 0.3, 3.0), 300, p=(0.9, 0.05, 0.05)) * rng.choice((-1.0, 1.0), 300)
        run = [
            Joints(T0 + 130 * MS * k, names, (q,) * len(names))
            for k, q in enumerate(np.cumsum(steps).tolist())
            for names in [(('lift', 'hand_slide'), ('hand_slide',))[int(rng.integers(2))]]
        ]
        seen = RuleSet(slow_slide())
        one = JointMerger(slow_slide(), seen.jump_signals)
        expected = []
        for m in run:
            one.merge(m.time, m.names, m.position, (), ())
            expected.append(list(one.q))
        watch = RuleSet(slow_slide())
        many = JointMerger(slow_slide(), watch.jump_signals)
        rows = [many.merge_columns(batch_of(part).joints).q for part in (run[:23], run[23:])]
        for found, log in ((np.concatenate(rows), watch.log), (np.array(expected), seen.log)):
            assert [(a.start, a.end) for a in log] == [(a.start, a.end) for a in seen.log]
            # A joint that is not named keeps what is known of it, alert or none.
            both = np.array([len(m.names) == 2 for m in run])
            np.testing.assert_array_equal(found[both], np.array(expected)[both])
        assert len(seen.log) > 2


def test_the_criteria_without_a_file_are_of_the_first_version() -> None:
    """Criteria made without a file have version 1 and cover torques, tip-over, support and data."""
    found = default_criteria(replace(settings(), limits=Limits((40.0, math.inf), torque_error=0.9)))
    assert found.version == 1
    data = ['coverage', 'duration', 'whole file', 'all messages']
    assert [c.name for c in found.criteria] == ['torque lift', 'tip-over', 'support', *data]
    limits: list[Any] = [getattr(c.demand, 'limit', None) for c in found.criteria]
    assert limits == [0.9, Limits(()).tip_error, *[None] * 5]


def test_independent_samples_are_counted_from_neighbours() -> None:
    """Samples whose neighbours correlate by r count as n (1 - r) / (1 + r) independent ones."""
    assert independent_samples(np.array((1.0, 2.0, 3.0, 4.0))) == pytest.approx(4.0 * 0.75 / 1.25)
    assert independent_samples(np.array((1.0, -1.0, 1.0, -1.0))) == 4.0
    assert independent_samples(np.ones(7)) == 7.0
    assert independent_samples(np.array((1.0, 2.0))) == 2.0
    ramp = independent_samples(np.arange(100_000.0))
    assert ramp == pytest.approx(100_000 * 0.001 / 1.999, rel=1e-6)


def test_as_many_samples_as_unknowns_have_no_interval() -> None:
    """A fit has no interval with as many samples as unknowns; with one more it is Student's t."""
    x = np.array((1.0, 2.0, 4.0))
    assert least_squares(x[:1, None], x[:1]) is None
    assert least_squares(np.zeros((3, 1)), x) is None
    y = np.array((1.1, 1.9, 4.2))
    fit = least_squares(x[:, None], y)
    assert fit is not None
    slope = float(x @ y / (x @ x))
    residual = y - slope * x
    worth = independent_samples(residual)
    variance = float(residual @ residual) / 2.0 * 3.0 / worth
    half = stats.t.ppf(0.975, max(worth - 1.0, 1.0)) * math.sqrt(variance / float(x @ x))
    assert fit.value[0] == pytest.approx(slope)
    assert fit.half_width[0] == pytest.approx(half)
