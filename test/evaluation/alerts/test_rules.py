"""The rules that are watched: at which values, of which level, after which delays."""

import math
from typing import Any

import pytest
from evaluation.streams import MS, T0, S, settings

from ugv_acceptance.evaluation.alerts.rules import RuleSet
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, STALE, WARN, Signal
from ugv_acceptance.evaluation.settings import Delays, ImuInput, Limits


def rule(signal: Signal) -> tuple[Any, ...]:
    """Return what a rule says beside its subject."""
    r = signal.rule
    return r.code, r.level, r.on, pytest.approx(r.off), r.on_delay, r.off_delay


DELAYS = Delays(tip_on=0.2, torque_on=0.3, fault_on=0.4, off=2.0, tip_off=6.0)


def test_sliding_is_watched_where_the_friction_is_known() -> None:
    """A warning from the tilt's warning limit on, with its deadband and delay; else never."""
    limits = Limits((40.0, 30.0), tip_warn=0.3, tip_deadband=0.05, friction=0.5)
    slide = RuleSet(settings(limits=limits, delays=DELAYS)).slide
    assert rule(slide) == ('SLIDE', WARN, -0.3, -0.35, 200 * MS, 2 * S)
    assert slide.rule.subject == 'robot'
    assert RuleSet(settings()).slide.rule.on == math.inf


def test_the_way_to_gravity_is_watched_with_the_delay_of_the_imu() -> None:
    """Attitude faults use the IMU's on-delay, a foreign frame the delay of any other fault.

    Disagreement has half its limit as deadband; the acceleration may be 15 % from g.
    """
    of = RuleSet(settings(ImuInput(agreement=0.2, agreement_delay=1.5), DELAYS)).attitude
    found = [rule(s) for s in (of.frame, of.orientation, of.strange, of.disagreement)]
    assert found == [
        ('IMU_FRAME', ERROR, 0.5, 0.5, 400 * MS, 2 * S),
        ('IMU_ORIENTATION', WARN, 0.5, 0.5, 1500 * MS, 2 * S),
        ('IMU_GRAVITY', ERROR, 0.15, 0.15, 0, 2 * S),
        ('IMU_INCONSISTENT', ERROR, 0.2, 0.1, 0, 2 * S),
    ]


@pytest.mark.parametrize(
    ('attitude', 'specific_force', 'level'),
    [
        ('orientation', False, WARN), ('orientation', True, ERROR), ('auto', False, ERROR),
        ('auto', True, ERROR), ('accelerometer', False, ERROR),
    ],
)  # fmt: skip
def test_a_strange_acceleration_is_a_warning_to_who_asks_for_the_orientation_alone(
    attitude: str,
    specific_force: bool,  # noqa: FBT001
    level: int,
) -> None:
    """To all others margins hang on it."""
    imu = ImuInput(attitude=attitude, specific_force=specific_force)
    assert RuleSet(settings(imu)).attitude.strange.rule.level == level


def test_faults_of_inputs_have_their_level_and_delay() -> None:
    """Each input fault has its level and on-delay; silence, already measured, has no delay."""
    watch = RuleSet(settings(delays=DELAYS))
    for subject, of in (('joint_states', watch.joints), ('imu', watch.imu)):
        assert [rule(s) for s in (of.stale, of.invalid, of.clock)] == [
            ('INPUT_STALE', STALE, 0.5, 0.5, 0, 2 * S),
            ('INPUT_INVALID', ERROR, 0.5, 0.5, 400 * MS, 2 * S),
            ('CLOCK', WARN, 0.5, 0.5, 400 * MS, 2 * S),
        ]
        assert {s.rule.subject for s in (of.stale, of.invalid, of.clock)} == {subject}
    assert rule(watch.missing) == ('INPUT_INCOMPLETE', STALE, 0.5, 0.5, 400 * MS, 2 * S)
    assert rule(watch.payload) == ('PAYLOAD_INVALID', ERROR, 0.5, 0.5, 400 * MS, 2 * S)
    assert rule(watch.jump_signals[0]) == ('POSITION_LEAP', ERROR, 20.0, 20.0, 400 * MS, 2 * S)


def test_what_is_active_comes_with_the_most_severe_first() -> None:
    """STALE before ERROR before WARN; what is over is not active."""
    watch = RuleSet(settings(delays=Delays(tip_on=0.0, torque_on=0.0, off=0.0)))
    wanted = (watch.torque[0][0], watch.support, watch.imu.stale)
    for signal in wanted:
        signal.step(T0, 1e3)
    assert [alert.rule.level for alert in watch.active] == [STALE, ERROR, WARN]
    watch.support.step(T0 + 1, 0.0)
    assert [alert.rule.level for alert in watch.active] == [STALE, WARN]


def test_every_signal_is_listed_once() -> None:
    """There is one signal for each code, subject and level, and all write to the same log."""
    watch = RuleSet(settings())
    rules = [(s.rule.code, s.rule.subject, s.rule.level) for s in watch.signals]
    assert len(set(rules)) == len(rules)
    assert all(signal.log is watch.log for signal in watch.signals)
    assert {('SLIDE', 'robot', WARN), ('TORQUE_LIMIT', 'slide', ERROR)} <= set(rules)


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize('joint', [0, 1])
def test_a_torque_of_either_sign_is_not_small_at_the_first_limit(joint: int, sign: float) -> None:
    """A message whose torques are all below it is not looked at closer."""
    watch = RuleSet(settings(limits=Limits((40.0, 30.0), torque_warn=0.8)))
    limit = (32.0, 24.0)[joint]
    for value, small in ((limit - 0.01, True), (limit, False), (math.nan, True)):
        torque = [0.0, 0.0]
        torque[joint] = sign * value
        assert watch.is_small(torque, (1.0,) * 4) is small


@pytest.mark.parametrize('side', range(4))
def test_a_tilt_of_any_side_is_not_small_at_the_first_limit(side: int) -> None:
    """Whatever is known of the other sides; infinite is a side without an edge."""
    watch = RuleSet(settings(limits=Limits((40.0, 30.0), tip_warn=0.3)))
    for others in (1.0, math.inf, math.nan):
        for value, small in ((0.31, True), (0.3, False), (-0.5, False), (math.nan, True)):
            angle = [others] * 4
            angle[side] = value
            assert watch.is_small((0.0, 0.0), angle) is small
