"""The exact values at which each rule of the evaluation begins."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from evaluation.streams import LEVEL, MS, REST, STILL, T0, Imu, Joints, S, run_of, settings

from ugv_acceptance.evaluation.alerts.rules import RuleSet
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, OK, STALE, WARN, Rule, Signal
from ugv_acceptance.evaluation.inputs.imu import ImuTracker
from ugv_acceptance.evaluation.inputs.low_pass import LowPass
from ugv_acceptance.evaluation.inputs.timeouts import InputTimeout
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.settings import Delays, ImuInput, Limits

G = 9.81


@pytest.mark.parametrize(('apart', 'wrong'), [(S, 0.0), (S + 1, 1.0), (-S, 0.0), (-S - 1, 1.0)])
def test_two_clocks_may_differ_by_a_second(apart: int, wrong: float) -> None:
    """A stamp may differ from receipt time by 1 s; a nanosecond more is a CLOCK fault."""
    assert InputTimeout(Delays()).clock(T0, T0 + apart) == wrong
    times = np.array([T0])
    assert InputTimeout(Delays()).clocks(times, times + apart).tolist() == [wrong]


@pytest.mark.parametrize(('jump', 'wrong'), [(S, 0.0), (S + 1, 1.0), (-S, 0.0), (-S - 1, 1.0)])
def test_a_stamp_may_jump_by_a_second(jump: int, wrong: float) -> None:
    """Stamps may jump by 1 s between messages 10 ms apart; more is a CLOCK fault."""
    start = -jump // 2
    fresh = InputTimeout(Delays())
    assert fresh.clock(T0, T0 + start) == 0.0
    fresh.message(T0)
    assert fresh.clock(T0 + 10 * MS, T0 + 10 * MS + start + jump) == wrong
    times = np.array([T0, T0 + 10 * MS])
    stamps = times + np.array((start, start + jump))
    assert InputTimeout(Delays()).clocks(times, stamps).tolist() == [0.0, wrong]


@pytest.mark.parametrize(('after', 'wrong'), [(500 * MS, 0.0), (500 * MS + 1, 1.0)])
def test_a_stamp_may_stand_for_half_a_second(after: int, wrong: float) -> None:
    """A stamp that repeats for more than 0.5 s is a frozen clock, alone and in columns."""
    fresh = InputTimeout(Delays())
    fresh.clock(T0, T0)
    fresh.message(T0)
    assert fresh.clock(T0 + after, T0) == wrong
    times = np.array([T0, T0 + after])
    assert InputTimeout(Delays()).clocks(times, np.array([T0, T0])).tolist() == [0.0, wrong]


@pytest.mark.parametrize(
    ('period', 'limit'), [(10, 100), (33, 100), (40, 120), (600, 1800), (1000, 2000)]
)
def test_silence_is_three_periods_but_at_least_a_tenth(period: int, limit: int) -> None:
    """An input is stale after 3 periods, between 0.1 and 2 s; until 32 intervals after 0.5 s."""
    fresh, columns = InputTimeout(Delays()), InputTimeout(Delays())
    times = T0 + np.arange(33) * period * MS
    for now in times[:32]:
        fresh.message(int(now))
    assert fresh.limit == 500 * MS
    assert fresh.deadline == int(times[31]) + 500 * MS
    fresh.message(int(times[32]))
    assert fresh.limit == limit * MS
    assert fresh.period == period * MS
    before, after = columns.messages(times)
    assert before.tolist() == [500 * MS] * 33
    assert after.tolist() == [*[500 * MS] * 32, limit * MS]


def test_silence_counts_from_the_start_until_a_message_came() -> None:
    """Before its first message an input's silence counts from the start of the evaluation."""
    fresh = InputTimeout(Delays())
    assert fresh.deadline is None
    fresh.started = T0
    assert fresh.deadline == T0 + 500 * MS


def tracked(*messages: Imu, **chosen: Any) -> list[tuple[tuple[float, ...], bool]]:
    """Return gravity and whether it is unusable, message by message."""
    told = settings(ImuInput(**chosen))
    tracker = ImuTracker(told, RuleSet(told).attitude)
    return [
        tracker.step(
            m.time, m.time, m.orientation, m.covariance_0, m.omega, m.acceleration, m.frame
        )
        for m in messages
    ]


@pytest.mark.parametrize(
    ('size', 'known'), [(1.1499, True), (1.1501, False), (0.8501, True), (0.8499, False)]
)
def test_an_accelerometer_shows_up_within_fifteen_hundredths_of_g(size: float, known: bool) -> None:  # noqa: FBT001
    """An acceleration tells the attitude only if its length is within 15 % of g."""
    ((gravity, unusable),) = tracked(
        Imu(T0, (0.0,) * 4, acceleration=(0.0, 0.0, size * G), covariance_0=-1.0)
    )
    assert not unusable
    assert math.isfinite(gravity[2]) == known


def test_an_orientation_is_believed_while_nothing_is_said_against_it() -> None:
    """Gravity comes from the orientation, unless it is an identity the accelerometer denies."""
    roll = 0.02
    leaning = (math.sin(roll / 2), 0.0, 0.0, math.cos(roll / 2))
    ((auto, _),) = tracked(Imu(T0, leaning))
    assert auto == pytest.approx((0.0, -G * math.sin(roll), -G * math.cos(roll)))
    ((other, _),) = tracked(Imu(T0, leaning), attitude='accelerometer')
    assert other == pytest.approx((0.0, 0.0, -G))
    ((identity, _),) = tracked(Imu(T0, LEVEL, acceleration=(0.5, 0.0, 9.8)))
    assert identity[0] != 0.0  # an identity is often a default: the accelerometer counts
    ((asked, _),) = tracked(Imu(T0, LEVEL, acceleration=(0.5, 0.0, 9.8)), attitude='orientation')
    assert asked == pytest.approx((0.0, 0.0, -G))


@pytest.mark.parametrize(('norm', 'used'), [(1.009, 1), (1.011, 0), (0.991, 1), (0.989, 0)])
def test_a_quaternion_is_one_within_a_hundredth(norm: float, used: int) -> None:
    """A quaternion whose norm is more than 1 % off 1 is not used as an orientation."""
    told = settings(ImuInput(attitude='orientation'))
    tracker = ImuTracker(told, RuleSet(told).attitude)
    half = norm * math.sqrt(0.5)
    tracker.step(T0, T0, (half, 0.0, 0.0, half), 0.0, STILL, (0.0, 9.81, 0.0))
    tracker.step(T0 + 1, T0 + 1, (half, 0.0, 0.0, half), -1.0, STILL, REST)
    assert tracker.taken == [used, 1, 1 - used]


@pytest.mark.parametrize(('share', 'known'), [(0.51, True), (0.49, False)])
def test_a_specific_force_below_half_of_g_is_a_fall(share: float, known: bool) -> None:  # noqa: FBT001
    """A specific force below half of g counts as free fall, and gives no margins."""
    ((gravity, unusable),) = tracked(
        Imu(T0, acceleration=(0.0, 0.0, share * G)), specific_force=True
    )
    assert not unusable
    assert math.isfinite(gravity[0]) == known
    if known:
        assert gravity == pytest.approx((0.0, 0.0, -share * G))


def test_the_low_pass_is_carried_for_a_second() -> None:
    """The low-pass keeps exp(-t / 0.2 s) of its old value, and begins anew after a gap of 1 s."""
    for step, keep in ((S, math.exp(-5.0)), (S + 1, 0.0), (100 * MS, math.exp(-0.5)), (0, 0.0),
                       (-1, 0.0)):  # fmt: skip
        low = LowPass(0.2)
        low.step(T0, (1.0, 2.0, 3.0))
        found = low.step(T0 + step, (0.0, 0.0, 10.0))
        assert found == pytest.approx((keep, 2.0 * keep, 10.0 - 7.0 * keep), abs=1e-12)
        columns = LowPass(0.2)
        columns.step(T0, (1.0, 2.0, 3.0))
        many = columns.columns(np.array([T0 + step]), np.array([[0.0], [0.0], [10.0]]))
        assert many[:, 0] == pytest.approx(found, abs=1e-12)


@pytest.mark.parametrize('axis', range(3))
@pytest.mark.parametrize(('size', 'known'), [(1000.0, True), (1000.1, False)])
def test_an_acceleration_beyond_a_kilometre_per_second_squared_is_none(
    axis: int,
    size: float,
    known: bool,  # noqa: FBT001
) -> None:
    """An acceleration longer than 1000 m/s2 is ignored, on any axis; the next one counts anew."""
    low = LowPass(0.2)
    found = low.step(T0, size * np.eye(3)[axis])
    assert math.isfinite(found[0]) == known
    many = LowPass(0.2).columns(np.array([T0]), size * np.eye(3)[:, axis : axis + 1])
    assert np.isfinite(many).all() == known


def test_signals_are_watched_at_the_limits_of_the_configuration() -> None:
    """WARN and ERROR at their shares, deadbands beyond, and each with its own delays (ns)."""
    limits = Limits((40.0, math.inf), 0.7, 0.9, 3.0, 0.3, 0.2, 0.05, (0.5, math.inf))
    delays = Delays(0.2, 0.3, 0.4, 2.0, 6.0)
    watch = RuleSet(settings(limits=limits, delays=delays))
    rule = [(s.rule.level, s.rule.on, s.rule.off, s.rule.on_delay, s.rule.off_delay)
            for s in (*watch.torque[0], *watch.tip[0], watch.speed[0], watch.support)]  # fmt: skip
    assert rule == [
        (WARN, pytest.approx(28.0), pytest.approx(25.0), 300 * MS, 2 * S),
        (ERROR, pytest.approx(36.0), pytest.approx(33.0), 300 * MS, 2 * S),
        (WARN, -0.3, pytest.approx(-0.35), 200 * MS, 6 * S),
        (ERROR, -0.2, pytest.approx(-0.25), 200 * MS, 6 * S),
        (WARN, 0.5, pytest.approx(0.45), 200 * MS, 2 * S),
        (ERROR, 0.5, 0.5, 200 * MS, 2 * S),
    ]
    assert math.isinf(watch.speed[1].rule.on)
    assert [s.rule.on for s in watch.jump_signals] == [20.0, 10.0]
    for signal in (watch.missing, watch.payload, *watch.jump_signals):
        assert signal.rule.on_delay == 400 * MS
    unlimited = RuleSet(settings(limits=Limits((40.0, 30.0))))
    assert [s.rule.on for s in unlimited.speed] == [math.inf, math.inf]


def test_a_value_on_the_limit_is_bad_and_on_the_deadband_not_yet_good() -> None:
    """A value at `on` raises an alert, one at `off` does not clear it; delays are exact to 1 ns."""
    log: list[Any] = []
    signal = Signal(Rule('X', 'y', WARN, 2.0, 1.0, 10, 20), log)
    signal.step(0, 1.9999)
    assert not signal.raw
    signal.step(1, 2.0)
    signal.advance(10)
    assert not log
    signal.advance(11)
    assert [(a.start, a.end, a.peak) for a in log] == [(11, None, 2.0)]
    signal.step(20, 1.0)
    signal.advance(100)
    assert log[0].end is None
    signal.step(101, 0.9999)
    signal.advance(120)
    assert log[0].end is None
    signal.step(120, 1.5)  # within the deadband it stays good
    signal.advance(121)
    assert log[0].end == 121


def live(**chosen: Any) -> LiveEvaluator:
    """Return a live evaluator that has heard both inputs for a second."""
    found = LiveEvaluator(settings(**chosen))
    found.start(T0)
    for m in run_of(1.0):
        if isinstance(m, Joints):
            found.joint_state(m.time, m.time, m.names, m.position, m.velocity, m.effort)
        elif isinstance(m, Imu):
            found.imu(m.time, m.time, m.orientation, 0.0, m.omega, m.acceleration)
    return found


def test_a_live_robot_is_ok_until_the_nanosecond_an_input_is_stale() -> None:
    """Joints come every 20 ms: stale after 100; the level then is STALE and margins are gone."""
    evaluator = live(limits=Limits((60.0, 300.0)))
    last = T0 + 980 * MS
    assert evaluator.level == OK
    assert evaluator.evaluated > 100
    for k in range(9):
        at = last + (15 + 10 * k) * MS
        evaluator.imu(at, at, LEVEL, 0.0, STILL, REST)
    evaluator.tick(last + 100 * MS)
    assert (evaluator.margins is None, evaluator.level) == (False, OK)
    evaluator.tick(last + 100 * MS + 1)
    assert (evaluator.margins is None, evaluator.level) == (True, STALE)
    stale = [a for a in evaluator.watch.log if a.rule.code == 'INPUT_STALE']
    assert [(a.rule.subject, a.start) for a in stale] == [('joint_states', last + 100 * MS)]


def test_other_limits_count_from_the_next_message_on() -> None:
    """New settings count from the next message; their payload only if it is another than before."""
    evaluator = live()
    evaluator.carry(T0 + S, 2.0, (0.0, 0.0, 0.0), 'hand')
    carried = evaluator.payload
    evaluator.adopt(replace(evaluator.settings, limits=Limits((99.0, 99.0))))
    assert evaluator.payload == carried
    robot = replace(evaluator.settings.robot, payload=replace(carried, mass=3.0))
    evaluator.adopt(replace(evaluator.settings, robot=robot))
    assert evaluator.payload.mass == 3.0
    assert evaluator.watch.torque[0][1].rule.on == 99.0


def test_the_period_is_the_middle_of_thirty_two_intervals() -> None:
    """An input's period is the median of 32 intervals, in single messages, columns and parts."""
    intervals = np.random.default_rng(2).permutation(np.arange(1, 33) ** 2) * MS
    times = T0 + np.concatenate(([0], np.cumsum(intervals)))
    one = InputTimeout(Delays())
    for now in times:
        one.message(int(now))
    assert (one.period, one.limit) == (272.5 * MS, round(817.5 * MS))
    for cut in (0, 1, 7, 32, 33):
        many = InputTimeout(Delays())
        limits: list[int] = []
        for part in (times[:cut], times[cut:]):
            if len(part):
                limits += many.messages(part)[1].tolist()
        assert (many.period, many.limit) == (one.period, one.limit)
        assert limits == [*[500 * MS] * 32, one.limit]
        assert many.last == times[-1]
