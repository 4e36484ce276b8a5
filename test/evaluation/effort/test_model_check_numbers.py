"""The comparison of model and efforts in closed form, and its exact thresholds."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from evaluation.margin_rows import rows
from evaluation.streams import settings
from scipy import stats

from ugv_acceptance.evaluation.effort import joint_check as comparison
from ugv_acceptance.evaluation.effort.joint_check import LEAST, JointSamples
from ugv_acceptance.evaluation.effort.model_check import ModelCheck
from ugv_acceptance.evaluation.effort.regression import Fit, independent_samples
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Limits
from ugv_acceptance.type_aliases import Floats


def samples(
    count: int,
    effort: Callable[[Floats, Floats], Floats],
    *,
    moving: int = 0,
    margin: float = 20.0,
) -> JointSamples:
    """Return samples of one joint: `moving` of them at rates of both signs, the others at rest."""
    rng = np.random.default_rng(count)
    torque = rng.uniform(-10.0, 10.0, count)
    rate = np.zeros(count)
    rate[:moving] = rng.uniform(0.1, 1.0, moving) * np.where(np.arange(moving) % 2, 1.0, -1.0)
    return JointSamples(
        effort(torque, rate), torque, rate, np.full(count, margin),
        np.zeros(count, np.bool_), rate == 0.0,
    )  # fmt: skip


def test_friction_is_told_apart_by_speed() -> None:
    """1.5 N m against any motion and 0.7 N m s/rad more, of a bias that is neither."""
    found = comparison.friction(
        samples(80, lambda t, r: t + 1.5 * np.sign(r) + 0.7 * r + 2.0, moving=60)
    )['friction']
    assert found['coulomb']['value'] == pytest.approx(1.5)
    assert found['viscous']['value'] == pytest.approx(0.7)


@pytest.mark.parametrize(('moving', 'told'), [(LEAST, True), (LEAST - 1, False)])
def test_friction_needs_thirty_samples_both_ways(moving: int, told: bool) -> None:  # noqa: FBT001
    """Friction is estimated only from thirty samples in either direction."""
    both = samples(80, lambda t, r: t + np.sign(r), moving=moving)
    found = comparison.friction(both)
    assert (found['friction'] is not None) == told
    assert found['friction_unknown'] == ('' if told else 'too little motion')
    for sign in (1.0, -1.0):
        one = comparison.friction(replace(both, rate=sign * np.abs(both.rate)))
        assert one['friction'] is None
        assert not told or one['friction_unknown'] == 'motion in one direction or at one speed'


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize(('coulomb', 'viscous'), [(1.5, 0.0), (0.0, 2.0)])
def test_a_force_that_drives_the_motion_is_no_friction(
    sign: float, coulomb: float, viscous: float
) -> None:
    """Friction takes power; what gives it, beyond its interval, has another cause: no number."""
    rng = np.random.default_rng(3)
    noise = rng.normal(0.0, 0.1, 80)
    found = comparison.friction(
        samples(80, lambda t, r: t + sign * (coulomb * np.sign(r) + viscous * r) + noise, moving=60)
    )
    assert (found['friction'] is None) == (sign < 0.0)
    assert found['friction_unknown'] == ('' if sign > 0.0 else 'masked by other forces')


@pytest.mark.parametrize(('count', 'told'), [(LEAST, True), (LEAST - 1, False)])
def test_thirty_samples_at_rest_tell_of_bias_and_scale(count: int, told: bool) -> None:  # noqa: FBT001
    """Effort = 0.8 torque + 3: bias, root mean square and scale by their definitions."""
    s = samples(count, lambda t, _: 0.8 * t + 3.0)
    found, difference = comparison.at_rest(s), s.measured - s.torque
    assert (found['bias'] is not None) == told
    if told:
        assert found['bias']['value'] == pytest.approx(difference.mean())
        assert found['rms'] == pytest.approx(np.sqrt((difference**2).mean()))
        assert found['scale']['value'] == pytest.approx(0.8)


def test_f_is_that_of_the_mean_squares() -> None:
    """Sum of squares over n - 1, motion over rest; the critical value is scipy's."""
    rng = np.random.default_rng(9)
    s = samples(200, lambda t, r: t + rng.normal(0.0, np.where(r == 0.0, 1.0, 1.4)), moving=90)
    found = comparison.in_motion(s)
    assert found is not None
    motion, rest = s.difference[:90], s.difference[90:]
    squares = (motion @ motion / 89, rest @ rest / 109)
    assert found['f'] == pytest.approx(squares[0] / squares[1])
    assert found['rms_motion'] == pytest.approx(math.sqrt(squares[0]))
    assert found['rms_rest'] == pytest.approx(math.sqrt(squares[1]))
    freedom = [independent_samples(x) - 1.0 for x in (motion, rest)]
    assert found['freedom'] == pytest.approx(freedom)
    assert found['critical'] == pytest.approx(stats.f.ppf(0.95, *freedom))
    added = math.sqrt(max(squares[0] - squares[1], 0.0))
    assert found['added'] == pytest.approx(added)
    assert found['margin'] == 20.0
    assert found['matters'] is (2.0 * added > 20.0)


@pytest.mark.parametrize(('moving', 'rest', 'told'), [(30, 30, True), (29, 30, False), (30, 29, False)])  # fmt: skip # noqa: E501
def test_f_needs_thirty_samples_of_each(moving: int, rest: int, told: bool) -> None:  # noqa: FBT001
    """F needs thirty samples in motion and at rest, and some error at rest."""
    s = samples(moving + rest, lambda t, _: t + 0.1 * np.sin(t), moving=moving)
    assert (comparison.in_motion(s) is not None) == told
    perfect = samples(moving + rest, lambda t, _: t, moving=moving)
    assert comparison.in_motion(perfect) is None


@pytest.mark.parametrize(('rate', 'motion'), [(0.05, 0), (0.051, 50), (-0.051, 50), (math.nan, 0)])
def test_motion_is_faster_than_a_twentieth(rate: float, motion: int) -> None:
    """A joint moves above 0.05 rad/s or m/s; with an unknown rate it does not."""
    s = replace(samples(50, lambda t, _: t), rate=np.full(50, rate))
    assert s.motion().sum() == motion


def still(effort: Floats, torque: Floats) -> JointSamples:
    """Return samples of a joint at rest."""
    n, no = len(effort), np.zeros(len(effort), np.bool_)
    return JointSamples(effort, torque, np.zeros(n), np.full(n, 20.0), no, ~no)


@pytest.mark.parametrize(
    ('margin', 'matters'), [(20.0, False), (2.0, True), (-1.0, True), (math.inf, None)]
)
def test_an_error_in_motion_matters_by_the_margin_it_could_use_up(
    margin: float, *, matters: bool | None
) -> None:
    """1.5 N m more in motion: twice that in 95 % of the samples; without a limit nobody judges."""
    s = samples(
        200, lambda t, r: t + 0.1 * np.sin(9.0 * t) + 1.5 * np.sign(r), moving=90, margin=margin
    )
    found = comparison.in_motion(s)
    assert found is not None
    assert found['added'] == pytest.approx(1.5, abs=0.05)
    assert found['f'] > found['critical']
    assert found['matters'] is matters
    assert found['margin'] == (None if margin == math.inf else margin)


@pytest.mark.parametrize(('half', 'told'), [(0.5, False), (0.501, True)])
def test_a_scale_needs_torques_that_differ_by_half_a_newton_metre(half: float, told: bool) -> None:  # noqa: FBT001
    """Standard deviation: that of +- half is half; a bias can be told without."""
    torque = np.tile((half, -half), 20)
    found = comparison.at_rest(still(0.5 * torque + np.arange(40) % 3, torque))
    assert (found['scale'] is not None) is told
    assert found['bias'] is not None


def test_an_interval_is_of_one_coefficient() -> None:
    """An interval is that of one coefficient; without a finite one it is None."""
    fit = Fit(np.array((2.0, 5.0, math.nan)), np.array((0.5, 1.0, 1.0)), 9.0)
    assert comparison.interval(fit) == {'value': 2.0, 'low': 1.5, 'high': 2.5}
    assert comparison.interval(fit, 1) == {'value': 5.0, 'low': 4.0, 'high': 6.0}
    assert comparison.interval(fit, 2) is None
    assert comparison.interval(None) is None
    endless = Fit(np.array((2.0,)), np.array((math.inf,)), 9.0)
    assert comparison.interval(endless) is None


def test_f_has_one_degree_of_freedom_at_least() -> None:
    """F uses at least one degree of freedom, also for samples that all resemble each other."""
    s = samples(60, lambda t, _: t + np.linspace(1.0, 2.0, 60), moving=30)
    found = comparison.in_motion(s)
    assert found is not None
    assert independent_samples(s.difference[:30]) < 2.0
    assert found['freedom'] == [1.0, 1.0]
    assert found['alpha'] == 0.05


TOLD = settings(limits=Limits((40.0, 30.0), speed=(0.6, 0.2)))


def run(
    effort: Any = 5.0, rate: Any = (0.0, 0.0), count: int = 40, apart: float = 1.0
) -> MarginRows:
    """Return rows so many seconds apart: effort of the lift, rates of both joints."""
    told = rows([apart * k for k in range(count)], torque=[10.0 + k % 7 for k in range(count)])
    joints = told.pairs.joints
    efforts = np.column_stack((np.broadcast_to(effort, count), np.full(count, np.nan)))[::-1]
    turned = replace(joints, effort=efforts, qd=np.broadcast_to(rate, (count, 2))[::-1])
    return replace(told, pairs=replace(told.pairs, joints=turned))


def checked(told: MarginRows, limits: Limits | None = None) -> Any:
    """Return the comparison of rows."""
    check = ModelCheck(replace(TOLD, limits=limits or TOLD.limits))
    check.add(told)
    result: Any = check.statement(0, 0).result['model_check']
    return result


EFFORTS = np.arange(40.0) % 11


@pytest.mark.parametrize(
    ('rate', 'rest'),
    [((0.02, 0.0), 40), ((-0.02, 0.02), 40), ((0.021, 0.0), 0), ((0.0, -0.021), 0),
     ((math.nan, math.nan), 40)],
)  # fmt: skip
def test_the_robot_rests_where_no_joint_is_faster_than_two_hundredths(
    rate: tuple[float, float], rest: int
) -> None:
    """rad/s or m/s, any joint; a rate that is not known is none."""
    assert checked(run(EFFORTS, rate))['joints']['lift']['rest_samples'] == rest


@pytest.mark.parametrize(('effort', 'clipped'), [(39.6, 1), (-39.6, 1), (39.5, 0)])
def test_an_effort_of_ninety_nine_hundredths_of_its_limit_is_clipped(
    effort: float, clipped: int
) -> None:
    """39.6 of 40 N m; it is no sample of rest."""
    efforts = EFFORTS.copy()
    efforts[3] = effort
    found = checked(run(efforts))['joints']['lift']
    assert (found['clipped_samples'], found['rest_samples']) == (clipped, 40 - clipped)


@pytest.mark.parametrize(
    ('rates', 'share'),
    [
        ((0.6, 0.2), 1.0), ((-0.6, -0.2), 1.0), ((0.61, 0.0), 0.0), ((0.0, -0.21), 0.0),
        ((math.nan, 0.1), 1.0),
    ],
)  # fmt: skip
def test_a_sample_is_slow_where_every_joint_keeps_to_its_bound(
    rates: tuple[float, float], share: float
) -> None:
    """A sample is slow if no joint is faster than its static-speed limit."""
    assert checked(run(rate=rates))['speed_validity']['share'] == share


def test_only_joints_with_a_bound_and_a_rate_are_judged_by_speed() -> None:
    """Without a joint that has a speed limit and a rate, the share of slow samples is unknown."""
    half = run(rate=(0.7, 0.1))
    judged = checked(half, replace(TOLD.limits, speed=(math.inf, 0.2)))['speed_validity']
    assert judged == {'share': 1.0, 'joints': ['slide']}
    nothing: dict[str, Any] = {'share': None, 'joints': []}
    assert checked(half, replace(TOLD.limits, speed=()))['speed_validity'] == nothing
    assert checked(run(rate=(math.nan,) * 2))['speed_validity'] == nothing
    assert checked(run(rate=(math.nan, 0.1)))['speed_validity']['joints'] == ['slide']


def test_samples_are_a_tenth_of_a_second_apart() -> None:
    """Of 40 rows 50 ms apart every second one is taken; without rows there is nothing."""
    found = checked(run(apart=0.05))
    assert (found['samples'], found['spacing_s']) == (20, 0.1)
    empty: Any = ModelCheck(TOLD).statement(0, 0).result['model_check']
    assert (empty['samples'], empty['loads'], empty['postures']) == (0, [], 0)
    assert [joint['meaning'] for joint in empty['joints'].values()] == ['unknown'] * 2


def test_a_robot_that_has_tipped_is_not_compared() -> None:
    """It rests on its arm: rows without any tilt left are no samples."""
    told = run(EFFORTS)
    angle = told.angle.copy()
    angle[10:15, 2] = 0.0
    assert checked(replace(told, angle=angle))['samples'] == 35
