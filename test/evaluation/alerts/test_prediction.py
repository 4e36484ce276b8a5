"""Predictions over time: margins that end soon, motors that are too weak, encoders that freeze."""

import math
from dataclasses import replace

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
    tilted,
    upright,
)
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.alerts.state_machine import Alert

CODES = ('TIP_AHEAD', 'TORQUE_AHEAD', 'EFFORT_LIMIT', 'MOTOR_WEAK', 'ENCODER_FROZEN')
# The lift counts downwards from 0.1 rad and tells efforts in -kN m.
LIMIT = 45.0


def message(time: float, lift: float, effort: float = 0.0, roll: float = 0.0) -> list[Message]:
    """Return both messages at a time (s): lift (rad), its effort (N m), roll (rad)."""
    at = T0 + round(time * S)
    q = tilted(roll)
    told = Joints(at, position=(0.1 - lift, 0.0), effort=(-effort / 1000.0, 0.0))
    return [told, Imu(at + MS, q, acceleration=upright(q))]


def run(rows: list[list[Message]]) -> list[Alert]:
    """Return the alerts ahead of a recording."""
    messages = [m for row in rows for m in row]
    _, evaluator = recorded(settings(), [messages], messages[-1].time)
    return [a for a in evaluator.watch.log if a.rule.code in CODES]


def times(alerts: list[Alert], code: str) -> list[float]:
    """Return when (s) alerts of a code were raised."""
    return [(a.start - T0) / S for a in alerts if a.rule.code == code]


def grid(seconds: float) -> list[float]:
    """Return times (s) a hundredth of a second apart."""
    return np.arange(0.0, seconds, 0.01).tolist()


@pytest.mark.parametrize('rate', [0.1, 0.15, 0.3])
def test_a_steady_roll_is_told_a_second_before_the_edge(rate: float) -> None:
    """The tilt left is used up at rate: the warning comes within 0.15 s of one second before."""
    rows = [message(t, 0.0, roll=rate * t) for t in grid(1.0 / rate)]
    messages = [m for row in rows for m in row]
    (part,), evaluator = recorded(settings(), [messages], messages[-1].time)
    gone = (part.time[np.argmax(part.angle.min(axis=1) < 0.0)] - T0) / S
    told = [a for a in evaluator.watch.log if a.rule.code == 'TIP_AHEAD']
    assert (told[0].start - T0) / S == pytest.approx(gone - 1.0 + 0.1, abs=0.15)


def test_a_margin_that_shrinks_slowly_is_told_late() -> None:
    """At 1 degree a second a tilt of 20 degrees is far from its end: nothing is told."""
    assert run([message(t, 0.0, roll=math.radians(1.0) * t) for t in grid(20.0)]) == []


def test_a_declared_load_is_no_rate() -> None:
    """A step of all margins when a payload is declared gives no prediction."""
    rows = [message(t, 0.0) for t in grid(2.0)]
    rows[100].append(Carry(T0 + S + 2 * MS, 1.2))
    assert times(run(rows), 'TIP_AHEAD') == []
    assert times(run(rows), 'TORQUE_AHEAD') == []


def test_an_effort_near_its_limit_is_told() -> None:
    """36 N m of 45 are 80 %: above it for 0.1 s the motor's effort is a warning, below it none."""
    rows = [message(t, 0.0, 34.0 if t < 1.0 else 38.0) for t in grid(2.0)]
    (told,) = times(run(rows), 'EFFORT_LIMIT')
    assert told == pytest.approx(1.1, abs=0.06)


def needs(lift: float) -> float:
    """Return the share of the lift's greatest torque that it needs at a position (rad)."""
    return math.cos(lift)


@pytest.mark.parametrize('even', [True, False])
def test_an_even_effort_under_a_growing_need_is_a_weak_motor(*, even: bool) -> None:
    """The arm sinks from 1.4 rad; a motor that holds follows the need, a weak one gives no more."""
    rows = [message(t, 1.4 - 0.3 * t, 20.0 if even else 30.0 * needs(1.4 - 0.3 * t) + 5.0)
            for t in grid(2.0)]  # fmt: skip
    assert bool(times(run(rows), 'MOTOR_WEAK')) is even


@pytest.mark.parametrize(('roll', 'weak'), [(0.5, True), (0.9, False)])
def test_the_motor_of_a_robot_that_lies_is_not_judged(roll: float, *, weak: bool) -> None:
    """Past its tipping point the ground bears the arm: an even effort shows no weakness."""
    rows = [message(t, 1.4 - 0.6 * t, 20.0, roll) for t in grid(2.0)]
    assert bool(times(run(rows), 'MOTOR_WEAK')) is weak


@pytest.mark.parametrize('frozen', [True, False])
def test_a_position_that_keeps_every_bit_under_changing_effort_is_frozen(*, frozen: bool) -> None:
    """Effort rises by a fifth of the limit: a real encoder would have moved by some bits."""
    rows = [message(t, 0.2 + (0.0 if frozen else 1e-4 * (-1.0) ** round(100 * t) * (t % 0.07)),
                    10.0 + 3.0 * t) for t in grid(3.0)]  # fmt: skip
    assert bool(times(run(rows), 'ENCODER_FROZEN')) is frozen


@pytest.mark.parametrize('seed', range(4))
@pytest.mark.parametrize(
    ('noise', 'rise', 'frozen'),
    [(2e-4, 8.0, True), (2e-4, 3.0, False), (3e-4, 8.0, True), (4e-3, 8.0, False)],
)
def test_a_position_that_only_trembles_under_growing_effort_is_frozen(
    seed: int, noise: float, rise: float, *, frozen: bool
) -> None:
    """0.2 mrad of noise hide no stuck encoder: effort grows by half of its limit in three seconds.

    A fifth is friction; and what trembles by more than 2 mrad moves.
    """
    rng = np.random.default_rng(seed)
    rows = [message(t, 0.2 + noise * rng.normal(), 10.0 + rise * t) for t in grid(3.0)]
    assert bool(times(run(rows), 'ENCODER_FROZEN')) is frozen


def test_a_joint_that_creeps_under_growing_effort_is_not_frozen() -> None:
    """It moves by 0.02 rad/s: more than its noise within a fifth of a second."""
    rows = [message(t, 0.2 + 0.02 * t, 10.0 + 8.0 * t) for t in grid(3.0)]
    assert not times(run(rows), 'ENCODER_FROZEN')


def test_a_frozen_encoder_at_rest_cannot_be_told() -> None:
    """Nothing changes but gravity's part: a joint that stands still looks the same."""
    assert run([message(t, 0.2, 10.0) for t in grid(3.0)]) == []


_efforts = st.sampled_from([0.0, 20.0, 20.1, 37.0, 44.0, math.nan])
_steps = st.tuples(st.floats(-0.03, 0.03), _efforts, st.floats(-0.03, 0.03), st.booleans())


@given(
    st.lists(_steps, min_size=40, max_size=120),
    st.lists(st.integers(0, 300), max_size=3),
    st.lists(st.integers(0, 4000), max_size=8),
)
def test_live_and_recorded_foresee_the_same(
    steps: list[tuple[float, float, float, bool]], cuts: list[int], ticks: list[int]
) -> None:
    """However a stream is cut and whenever time passes, the same alerts come at the same times."""
    messages: list[Message] = []
    lift, roll = 1.0, 0.0
    for k, (lower, effort, more, hold) in enumerate(steps):
        lift, roll = lift + (0.0 if hold else lower - 0.01), roll + more + 0.01
        messages += message(0.03 * k, lift, effort, roll)
    end = messages[-1].time + S
    whole = sorted(T0 + tick * MS for tick in ticks)
    _, told = live(settings(), messages, end, [t for t in whole if t < end])
    _, evaluator = recorded(settings(), split(messages, cuts), end)
    assert sorted(map(facts, told)) == sorted(map(facts, evaluator.watch.log))


def facts(alert: Alert) -> tuple[object, ...]:
    """Return what an alert says, as something to compare."""
    end = -1 if alert.end is None else alert.end
    return alert.rule.code, alert.rule.subject, alert.rule.level, alert.start, end


def test_limits_that_are_not_known_are_not_judged() -> None:
    """A joint without a limit has no effort that is too much, whatever it tells."""
    limits = replace(settings().limits, torque=(math.inf, math.inf))
    rows = [m for t in grid(2.0) for m in message(t, 1.0 - 0.4 * t, 1e9)]
    _, evaluator = recorded(settings(limits=limits), [rows], rows[-1].time)
    assert not [a for a in evaluator.watch.log if a.rule.code in CODES[1:]]


def test_a_load_that_is_declared_freezes_no_encoder() -> None:
    """The static torque changes by it; what is measured, and the posture, do not."""
    told = settings()
    torque = 22.0
    rest = Joints(0, effort=(-torque / 1000.0, 0.0))
    messages = [*run_of(6.0, joints=rest), Carry(T0 + 3 * S, mass=6.0)]
    messages.sort(key=lambda m: m.time)
    _, log = live(told, messages, T0 + 6 * S, range(T0, T0 + 6 * S, 50 * MS))
    _, evaluator = recorded(told, split(messages, range(0, 900, 31)), T0 + 6 * S)
    for alerts in (log, evaluator.watch.log):
        assert 'ENCODER_FROZEN' not in {a.rule.code for a in alerts}
