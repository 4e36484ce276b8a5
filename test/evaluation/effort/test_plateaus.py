"""Measured effort at rest: plateaus of synthetic runs, held to what was put in and to leverage."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from evaluation.streams import MS, T0, Joints, Message, S, batch_of, run_of, settings

from ugv_acceptance.evaluation.effort.plateaus import (
    EffortComparison,
    Plateau,
    _split,
)
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.settings import JointInput, Limits

G = 9.81
TOLD = replace(
    settings(limits=Limits((45.0, 300.0))), joints=(JointInput('lift'), JointInput('hand_slide'))
)
# Level arm: 4 kg at 0.5 m, 1 kg at 1.05 m, a declared kg at 1.1 m; what the lift holds.
LEVEL_TORQUE, LEVEL_SLOPE = G * (4.0 * 0.5 + 1.05 + 1.1), G * 1.1
Step = tuple[float, float, float]  # until (s), rate of the lift (rad/s), effort of the lift


def compared(
    steps: Sequence[Step], q: float = 0.0, slide: float = math.nan, hz: float = 20.0
) -> EffortComparison:
    """Return the comparison of a run whose lift's effort follows `steps`."""
    run: list[Message] = []
    for message in run_of(steps[-1][0], joints_hz=hz, imu_hz=20.0):
        if isinstance(message, Joints):
            at = (message.time - T0) / S
            _, rate, effort = next(step for step in steps if at < step[0])
            message = replace(  # noqa: PLW2901
                message, position=(q, 0.0), velocity=(rate, 0.0), effort=(effort, slide)
            )
        run.append(message)
    evaluator, found = RecordedEvaluator(TOLD), EffortComparison(TOLD)
    evaluator.start(T0)
    found.add(evaluator.batch(batch_of(run)))
    return found


def plateaus(steps: Sequence[Step], q: float = 0.0) -> list[Plateau]:
    """Return the lift's plateaus."""
    return compared(steps, q).plateaus(0)


def test_a_plateau_is_where_the_effort_stands() -> None:
    """Two levels, two plateaus; model and leverage of a kg are those of a level."""
    first, second = plateaus([(5.0, 0.0, 20.0), (10.0, 0.0, 35.0)])
    assert (first.measured, second.measured) == (20.0, 35.0)
    for found in (first, second):
        assert found.model == pytest.approx(LEVEL_TORQUE)
        assert found.slope == pytest.approx(LEVEL_SLOPE)
        assert not found.saturated
    assert (first.start - T0) / S == pytest.approx(0.0, abs=0.051)
    assert (first.end - T0) / S == pytest.approx(5.0, abs=0.11)
    assert (second.start - T0) / S == pytest.approx(5.0, abs=0.11)
    assert (second.end - T0) / S == pytest.approx(10.0, abs=0.11)


@pytest.mark.parametrize(
    ('other', 'count'), [(20.9, 1), (21.0, 1), (21.1, 2), (19.0, 1), (18.9, 2)]
)
def test_a_step_of_more_than_a_twentieth_ends_a_plateau(other: float, count: int) -> None:
    """20 N m to 21 is one level, to 21.1 two; a N m is the least step that counts."""
    assert len(plateaus([(5.0, 0.0, 20.0), (10.0, 0.0, other)])) == count


@pytest.mark.parametrize(('other', 'count'), [(34.4, 1), (34.9, 1), (36.7, 1), (36.8, 2)])
def test_a_large_effort_may_waver_by_its_twentieth(other: float, count: int) -> None:
    """A plateau of 35 N m may vary by 5 %, which is 1.75 N m, in either direction."""
    assert len(plateaus([(5.0, 0.0, 35.0), (10.0, 0.0, other)])) == count


def test_a_plateau_lasts_three_seconds() -> None:
    """A plateau lasts at least 3 s; 2 s at one level are none."""
    found = plateaus([(4.0, 0.0, 10.0), (6.0, 0.0, 20.0), (9.0, 0.0, 30.0)])
    assert [p.measured for p in found] == [10.0, 30.0]


@pytest.mark.parametrize(('rate', 'count'), [(0.02, 1), (-0.02, 1), (0.021, 0), (-0.021, 0)])
def test_a_joint_in_motion_is_not_compared(rate: float, count: int) -> None:
    """A joint faster than 0.02 rad/s has no plateau of effort."""
    assert len(plateaus([(5.0, rate, 20.0)])) == count


@pytest.mark.parametrize(('effort', 'saturated'), [(39.9, False), (39.97, True), (-39.97, True)])
def test_an_effort_at_the_joints_limit_does_not_weigh(effort: float, saturated: bool) -> None:  # noqa: FBT001
    """The lift's motor gives 40 N m."""
    (found,) = plateaus([(5.0, 0.0, effort)])
    assert found.saturated == saturated


@pytest.mark.parametrize(('level', 'saturated'), [(9.0, False), (11.0, True)])
def test_an_effort_far_from_the_model_that_stands_at_the_runs_largest_is_clipped(
    level: float,
    saturated: bool,  # noqa: FBT001
) -> None:
    """A level slide holds nothing: over 10 N, always the same number, is a limit not declared."""
    (found,) = compared([(5.0, 0.0, 20.0)], slide=level).plateaus(1)
    assert found.model == pytest.approx(0.0, abs=1e-9)
    assert found.saturated == saturated


def test_without_efforts_there_is_nothing() -> None:
    """Without efforts or messages there are no plateaus."""
    assert plateaus([(5.0, 0.0, math.nan)]) == []
    assert EffortComparison(TOLD).plateaus(0) == []


def test_at_most_twenty_samples_a_second_are_kept() -> None:
    """Of ten seconds at 100 Hz about 200 remain, one every 50 ms."""
    times, _ = compared([(10.0, 0.0, 20.0)], hz=100.0)._samples.samples(2)
    assert len(set((times // (50 * MS)).tolist())) == len(times)
    assert 198 <= len(times) <= 201


def test_the_result_names_each_joint_its_unit_and_difference() -> None:
    """A plateau in the result has joint, unit, difference, and times from the start."""
    found = compared([(5.0, 0.0, 20.0)], slide=2.0).result(T0)
    (lift,), (slide,) = found['lift'], found['slide']
    assert (lift['unit'], slide['unit']) == ('N m', 'N')
    assert lift['difference'] == pytest.approx(20.0 - LEVEL_TORQUE)
    assert lift['effort_per_kg'] == pytest.approx(LEVEL_SLOPE)
    assert lift['start_s'] == pytest.approx(0.0, abs=0.051)
    assert lift['end_s'] == pytest.approx(5.0, abs=0.06)
    assert not lift['saturated']


def test_a_plateau_is_split_at_whole_seconds_of_its_run() -> None:
    """Rows of [0 s, 3 s) and [3 s, 6 s), ten a second."""
    time = T0 + np.arange(60) * 100 * MS
    effort = np.repeat([10.0, 20.0], 30)
    assert list(_split(time, effort)) == [slice(0, 30), slice(30, 60)]
    assert list(_split(time[:0], effort[:0])) == []
    assert list(_split(time[:29], effort[:29])) == [slice(0, 29)]
    assert list(_split(time[:20], effort[:20])) == []


def saturated(
    level: float, model: float = 0.0, most: float = 1e6, urdf: float = 1e6, limit: float = 45.0
) -> bool:
    """Return whether the lift, whose motor and limit are these, stands at a limit."""
    joints = (replace(TOLD.robot.joints[0], effort=urdf), *TOLD.robot.joints[1:])
    limits = Limits((limit, 300.0))
    told = replace(TOLD, robot=replace(TOLD.robot, joints=joints), limits=limits)
    return EffortComparison(told)._saturated(0, np.full(40, level), model, most)


def test_an_effort_is_clipped_at_the_lesser_of_its_limits() -> None:
    """From 0.999 of it on, either way; a limit that is none, zero or infinite, clips nothing."""
    assert saturated(0.999 * 45.0)
    assert saturated(-0.999 * 45.0)
    assert not saturated(math.nextafter(0.999 * 45.0, 0.0))
    assert saturated(0.999 * 20.0, urdf=20.0)
    assert saturated(0.5, urdf=0.5)
    assert not saturated(5.0, urdf=0.0)
    assert not saturated(5.0, limit=math.inf, urdf=math.inf)


@pytest.mark.parametrize(
    ('level', 'model', 'far'),
    [
        (10.0, 0.0, False), (10.1, 0.0, True), (-10.1, 0.0, True), (20.0, -2.0, False),
        (20.1, -2.0, True), (20.1, 2.0, True), (10.1, 0.5, True),
    ],
)  # fmt: skip
def test_ten_times_the_model_is_far_from_it(level: float, model: float, far: bool) -> None:  # noqa: FBT001
    """Or ten N m, whichever is more, at the largest effort of the run."""
    assert saturated(level, model, most=abs(level)) is far
    assert not saturated(level, model, most=abs(level) + 0.1)


@pytest.mark.parametrize(('count', 'clipped'), [(10, True), (9, False)])
def test_a_quarter_of_the_samples_at_the_largest_effort_is_a_limit(
    count: int,
    clipped: bool,  # noqa: FBT001
) -> None:
    """Of forty; of either sign."""
    effort = np.full(40, 20.0)
    effort[:count] = np.tile((21.0, -21.0), 20)[:count]
    assert EffortComparison(TOLD)._saturated(0, effort, 0.0, 21.0) is clipped


def test_a_result_counts_seconds_from_the_start() -> None:
    """Ten seconds before the first message."""
    (lift,) = compared([(5.0, 0.0, 20.0)]).result(T0 - 10 * S)['lift']
    assert lift['start_s'] == pytest.approx(10.0, abs=0.051)
    assert lift['end_s'] == pytest.approx(15.0, abs=0.06)
    assert (lift['measured'], lift['model']) == (20.0, pytest.approx(LEVEL_TORQUE))


@pytest.mark.parametrize(
    ('levels', 'ends'),
    [
        ((20.0, 20.9, 21.4, 21.7), [(0, 40)]),  # each is near the middle of those before
        ((20.0, 20.0, 20.0, 21.1, 21.1, 21.1), [(0, 30), (30, 60)]),
        ((20.0, 20.0, 30.0, 30.0, 30.0), [(20, 50)]),
        ((10.0, 20.0, 20.0, 20.0, 20.0), [(10, 50)]),
        ((-40.0, -41.9, -39.0, -43.9), [(0, 30)]),
        ((0.0, 0.9, -0.1, 0.95), [(0, 40)]),
        ((0.0, 0.9, -0.1, 1.1), [(0, 30)]),
    ],
)
def test_a_plateau_goes_on_while_a_second_is_near_the_middle_of_those_before(
    levels: tuple[float, ...], ends: list[tuple[int, int]]
) -> None:
    """Within a twentieth, or a newton metre; seconds are counted from the first of its samples."""
    effort = np.repeat(levels, 10)
    time = T0 + np.arange(len(effort)) * 100 * MS
    assert list(_split(time, effort)) == [slice(a, b) for a, b in ends]
    assert list(_split(time + 370 * MS, effort)) == [slice(a, b) for a, b in ends]
