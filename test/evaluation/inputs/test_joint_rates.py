"""Rates of joints: reported, or from the positions where these contradict them."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from evaluation.streams import MS, T0, Imu, Joints, Message, S, live, recorded, settings, split

import ugv_acceptance as ugv
from ugv_acceptance.bag.cdr import JOINT_STATE, Decoder
from ugv_acceptance.bag.encode import joint_state_cdr
from ugv_acceptance.bag.raw import messages
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.evaluation.inputs.joint_rates import JointRate
from ugv_acceptance.type_aliases import Floats


def rates(
    position: Callable[[float], float],
    reported: Callable[[float], float],
    late: Callable[[int], int] = lambda _: 0,
    turn: float = 0.0,
) -> Floats:
    """Return rate and speed (2, n) of 10 s at 50 Hz: the same by steps and by columns."""
    seconds = np.arange(500) / 50
    stamp = T0 + (seconds * 1e9).astype(np.int64)
    time = np.maximum.accumulate(stamp + np.array([late(k) for k in range(500)]))
    q = np.array([position(t) for t in seconds])
    qd = np.array([reported(t) for t in seconds])
    one, many, steps = JointRate(turn), JointRate(turn), []
    for t, s, x, v in zip(time.tolist(), stamp.tolist(), q.tolist(), qd.tolist(), strict=True):
        if t // 200_000_000 != one.cell:
            one.step(t, s, x, v)
        steps.append(one.best(v))
    parts = [many.columns(time[p], stamp[p], q[p], qd[p]) for p in (slice(77), slice(77, None))]
    columns = np.concatenate([np.array(part[:2]) for part in parts], axis=1)
    np.testing.assert_array_equal(columns, np.array(steps).T)
    return columns


def turned(t: float) -> float:
    """Rest for 3 s, then half a radian a second."""
    return 0.5 * max(t - 3.0, 0.0)


@pytest.mark.parametrize(
    'reported',
    [lambda _: math.nan, lambda t: 28.6 * (t > 3.0), lambda _: 0.0, lambda t: -0.5 * (t > 3)],
)
def test_positions_tell_the_rate_where_none_is_reported_or_it_contradicts(
    reported: Callable[[float], float],
) -> None:
    """Missing, deg/s, always 0, of the other sign: 0.4 s after the motion began both are right."""
    found = rates(turned, reported)
    assert found[:, 170:] == pytest.approx(0.5, abs=1e-9)
    assert np.nanmax(found[1]) < 0.51


def test_a_reported_rate_that_is_proven_is_used_at_once() -> None:
    """After the positions have proven it, a change is seen without the lag of the positions."""
    found = rates(lambda t: 0.5 * t + 0.3 * max(t - 5.0, 0.0), lambda t: 0.5 + 0.3 * (t > 5.0))
    assert found[1, 249:252] == pytest.approx([0.5, 0.5, 0.8])


def test_rest_and_noise_prove_and_doubt_nothing() -> None:
    """A reported 0 stays, though the encoder flickers by a hundredth of a radian."""
    rng = np.random.default_rng(1)
    found = rates(lambda _: 0.01 * float(rng.integers(2)), lambda _: 0.0)
    assert not found[0].any()


@pytest.mark.parametrize('wrap', [0.0, math.tau])
def test_a_wrapped_joint_turns_on(wrap: float) -> None:
    """A number that falls back by a turn is no speed, and no rate is wrong beside it."""
    found = rates(lambda t: (0.9 * t) % wrap if wrap else 0.9 * t, lambda _: 0.9, turn=math.tau)
    assert np.nan_to_num(found, nan=0.9) == pytest.approx(0.9)


def test_messages_that_come_in_bursts_are_dated_by_their_stamps() -> None:
    """A network that delivers every 0.1 s makes a joint no faster."""
    found = rates(lambda t: 0.4 * t, lambda _: math.nan, lambda k: (4 - k % 5) * 20 * MS)
    assert np.nanmax(found) == pytest.approx(0.4, abs=1e-6)


@pytest.mark.parametrize('velocity', [(), (math.nan, math.nan), (0.0, 0.0)])
def test_a_fast_joint_is_found_without_its_velocity(velocity: tuple[float, ...]) -> None:
    """STATIC_MODEL comes live and recorded from positions alone: 1 rad/s where 0.6 holds."""
    told = settings()
    told = replace(told, limits=replace(told.limits, speed=(0.6, math.inf)))
    messages: list[Message] = []
    for k in range(150):
        at = 0.1 + max(k - 100, 0) * 0.02
        messages += [Joints(T0 + k * 20 * MS, position=(at, 0.0), velocity=velocity)]
        messages += [Imu(T0 + k * 20 * MS + MS)]
    _, alerts = live(told, messages, T0 + 3 * S)
    _, evaluator = recorded(told, split(messages, [60, 110]), T0 + 3 * S)
    for log in (alerts, evaluator.watch.log):
        (found,) = [a for a in log if a.rule.code == 'STATIC_MODEL']
        assert found.rule.subject == 'lift'
        assert found.peak == pytest.approx(1.0)
        assert 2.2 <= (found.start - T0) / S <= 2.6


STUCK_AT = 4.0


def stuck(t: float) -> float:
    """Turn by 0.3 rad/s; from then on the encoder repeats one number."""
    return 0.3 * min(t, STUCK_AT)


@pytest.mark.parametrize(
    ('position', 'reported', 'told'),
    [
        (stuck, lambda _: 0.3, 0.3 * (10.0 - STUCK_AT)),
        (stuck, lambda t: 0.3 if t < STUCK_AT + 3.0 else 0.0, 0.9),
        (stuck, lambda t: 0.3 if t < STUCK_AT + 0.5 else 0.0, 0.0),
        (stuck, lambda t: 0.3 if t < STUCK_AT else 0.02, 0.0),
        (stuck, lambda t: 0.3 if t < STUCK_AT else 0.1 * math.sin(40.0 * t), 0.0),
        (lambda _: 1.0, lambda _: 0.3, 0.0),
        (lambda t: 0.3 * t, lambda _: 0.3, 0.0),
        (lambda t: 0.3 * t, lambda _: 17.2, 0.0),
    ],
)
def test_a_motion_that_only_a_proven_rate_tells(
    position: Callable[[float], float], reported: Callable[[float], float], told: float
) -> None:
    """Summed up while the position stands still to the last bit; not noise, nor a rate unproven."""
    seconds = np.arange(500) / 50
    time = T0 + (seconds * 1e9).astype(np.int64)
    q = np.array([position(t) for t in seconds])
    qd = np.array([reported(t) for t in seconds])
    found = []
    for parts in ([slice(None)], [slice(k, k + 37) for k in range(0, 500, 37)]):
        rate = JointRate(0.0)
        for part in parts:
            rate.columns(time[part], time[part], q[part], qd[part])
        found.append(rate.stuck)
    assert found[0] == pytest.approx(found[1])
    assert found[0] == pytest.approx(told, abs=0.07)


def test_an_encoder_that_stands_still_while_its_joint_turns_is_no_pass(
    repository: Path, tmp_path: Path
) -> None:
    """Without any effort: the positions of a recorded run freeze, its velocities go on."""
    bag = open_bag(repository / 'bags' / 'packbot_pass')
    frozen: tuple[float, ...] = ()
    with BagWriter(tmp_path / 'run') as writer:
        for name, topic in bag.topics.items():
            writer.add_topic(name, topic.type)
        decoder = Decoder(JOINT_STATE)
        for message in messages(bag, bag.topics):
            data = message.data
            if message.topic == '/joint_states':
                told = decoder.one(data)
                if message.log_time >= bag.start_ns + 10 * S:
                    frozen = frozen or told.position
                now = frozen or told.position
                data = joint_state_cdr(told.stamp, '', told.names, now, told.velocity, [])
            writer.write(message.topic, message.log_time, data)
    found = ugv.evaluate(tmp_path / 'run')
    assert found.verdict == 'INCONCLUSIVE'
    assert 'stands still to the last digit until' in found.reasons[0]
