"""Recordings whose joint states cannot be believed do not pass, and say why; good ones do pass."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from offline.joint_runs import EPOCH, FOLDED, NAMES, NS, Run, judged, moved, rest

import ugv_acceptance as ugv
from ugv_acceptance.config import load
from ugv_acceptance.model.statics import inverse_dynamics
from ugv_acceptance.type_aliases import Floats

RAD = math.radians


def reasons(found: ugv.Evaluation) -> str:
    """Return all that a verdict says: reasons, alerts, what was not checked."""
    alerts = [alert.message for alert in found.alerts]
    unchecked = [f'{x["what"]}: {x["why"]}' for x in found.result.get('not_checked', ())]
    return '\n'.join([*found.result['reasons'], *alerts, *unchecked])


def swing(rate: float, amplitude: float) -> Callable[[Floats], Floats]:
    """Return a way to and fro with a greatest rate (rad/s)."""

    def way(t: Floats) -> Floats:
        result: Floats = amplitude * np.sin(rate / amplitude * t)
        return result

    return way


def stroke(
    rate: float, start: float, end: float, acceleration: float
) -> Callable[[Floats], Floats]:
    """Return one stroke: speeding up, `rate` (rad/s), slowing down, between two times (s)."""

    def way(t: Floats) -> Floats:
        ramp = min(abs(rate) / acceleration, (end - start) / 2)
        s = np.clip(t - start, 0.0, end - start)
        up, level = np.minimum(s, ramp), np.clip(s - ramp, 0.0, end - start - 2 * ramp)
        down = np.clip(s - (end - start - ramp), 0.0, ramp)
        size = 0.5 * acceleration * up**2 + abs(rate) * (level + down)
        result: Floats = np.sign(rate) * (size - 0.5 * acceleration * down**2)
        return result

    return way


def late(run: Run, kind: str, seed: int = 4) -> Run:
    """Return a run whose messages come late by up to 20 ms, or in bursts of 80 ms."""
    rng, n = np.random.default_rng(seed), len(run.time)
    wait = {
        'steady': np.zeros(n, np.int64),
        'jitter': rng.integers(0, 20_000_000, n),
        'bursts': (3 - np.arange(n) % 4) * 20_000_000,
    }[kind]
    return run.changed(time=np.maximum.accumulate(run.time + wait))


FAST: dict[str, tuple[int, Callable[[Floats], Floats], str]] = {
    'shoulder stops hard': (1, stroke(-RAD(118), 3.0, 3.5, 20.0), 'shoulder_joint'),
    'elbow to and fro': (2, swing(RAD(140), 0.4), 'elbow_joint'),
    'shoulder to and fro': (1, swing(RAD(118), 0.35), 'shoulder_joint'),
}


@pytest.mark.parametrize('velocity', ['reported', 'missing', 'zero', 'deg/s'])
@pytest.mark.parametrize('kind', FAST)
def test_motion_that_may_need_more_than_the_limit_is_inconclusive(
    kind: str, velocity: str, tmp_path: Path
) -> None:
    """Each static margin is kept; joint, time, speed and N m are named, whatever velocity says."""
    joint, way, name = FAST[kind]
    run = moved(rest(8.0, noise=5e-4), joint, way)
    rate = np.gradient(run.position, 0.02, axis=0)
    told = {'reported': rate, 'missing': None, 'zero': 0 * rate, 'deg/s': np.degrees(rate)}[
        velocity
    ]
    found = judged(tmp_path, run.changed(velocity=told, seconds=8.0))
    assert found.verdict == 'INCONCLUSIVE'
    said = [r for r in found.result['reasons'] if 'its motion up to' in r]
    assert said
    assert f'({name} at' in said[0]
    assert 'deg/s and' in said[0]
    past = [of['longest_past_limit_s'] for of in found.result['dynamic_torque']['joints'].values()]
    assert max(past) >= 0.1


def longest_past(joint: int, way: Callable[[Floats], Floats]) -> tuple[float, float]:
    """Return for how long (s) the true torque is past 50 N m, and its greatest share of that."""
    t = np.arange(0.0, 8.0, 1e-3)
    q = np.tile(FOLDED, (len(t), 1))
    q[:, joint] += way(t)
    rate = np.gradient(q, 1e-3, axis=0)
    robot = load().settings.robot
    bent = np.gradient(rate, 1e-3, axis=0)
    torque = np.abs(inverse_dynamics(robot, q, rate, bent, (0.0, 0.0, -9.81))[:, 1:3])
    breaks = [np.flatnonzero(np.concatenate(([True], x <= 50.0, [True]))) for x in torque.T]
    return max(float(np.diff(b).max() - 1) for b in breaks) / 1e3, float(torque.max() / 50.0)


@pytest.mark.parametrize('seed', range(16))
def test_what_truly_needs_more_than_the_limit_never_passes(seed: int, tmp_path: Path) -> None:
    """Random strokes and swings, rates and noise; and what truly stays below 0.9 of it passes."""
    rng = np.random.default_rng(seed)
    joint, sign = int(rng.integers(1, 3)), float(rng.choice([-1.0, 1.0]))
    way = stroke(sign * RAD(rng.uniform(30, 180)), 3.0, 3.0 + rng.uniform(0.3, 1.2), 20.0)
    if seed % 2:
        way = swing(RAD(rng.uniform(20, 160)), rng.uniform(0.15, 0.8))
    run = moved(rest(8.0, hz=float(rng.choice([25, 50, 100])), noise=5e-4), joint, way)
    found = judged(tmp_path, run.changed(seconds=8.0))
    longest, share = longest_past(joint, way)
    if longest > 0.15:
        assert found.verdict != 'PASS'
    if share < 0.9:
        assert 'its motion up to' not in reasons(found)


def to_and_fro(t: Floats) -> Floats:
    """Turn at 7.2 deg/s to one side, then to the other, without a pause."""
    result: Floats = -0.3 * np.abs((0.42 * t) % 2 - 1)
    return result


def through_a_turn(t: Floats) -> Floats:
    """Turn at 10 deg/s, told within 0 and a full turn."""
    result: Floats = np.mod(RAD(10) * t + 5.0, math.tau) - 0.1
    return result


GOOD: dict[str, Callable[[], Run]] = {
    'rest': rest,
    'noise of 1 mrad': lambda: rest(20.0, noise=1e-3),
    'noise of 1 mrad at 100 Hz': lambda: rest(20.0, hz=100.0, noise=1e-3),
    'triangle at 7.2 deg/s': lambda: moved(rest(20.0, noise=1e-3), 1, to_and_fro),
    'turret at 10 deg/s through a turn': lambda: moved(rest(40.0, noise=1e-3), 0, through_a_turn),
    'swing at 25 deg/s': lambda: moved(rest(20.0, noise=1e-3), 1, swing(RAD(25), 0.3)),
    'stroke of 20 deg/s': lambda: moved(rest(noise=1e-3), 1, stroke(-RAD(20), 2.0, 4.0, 1.0)),
    'elbow at 30 deg/s': lambda: moved(rest(20.0, noise=1e-3), 2, swing(RAD(30), 0.4)),
}


@pytest.mark.parametrize('kind', ['steady', 'jitter', 'bursts'])
@pytest.mark.parametrize('name', GOOD)
def test_ordinary_motion_passes(name: str, kind: str, tmp_path: Path) -> None:
    """Slow and middling motion with encoder noise, however messages are delivered."""
    run = late(GOOD[name](), kind)
    seconds = len(run.time) / (NS / float(np.median(np.diff(run.stamp))))
    found = judged(tmp_path, run.changed(seconds=seconds))
    assert found.verdict == 'PASS', reasons(found)


@pytest.mark.parametrize('zero', [False, True])
@pytest.mark.parametrize('degps', [0.0, 3.0, 10.0])
@pytest.mark.parametrize('first', [0.0, 50.0])
def test_degrees_neither_pass_nor_fail(
    first: float,
    degps: float,
    zero: bool,  # noqa: FBT001
    tmp_path: Path,
) -> None:
    """At rest and moving, from the first message on; the unit is named."""
    run = moved(rest(), 1, lambda t: RAD(degps) * t + (RAD(first) if zero else 0.0))
    found = judged(tmp_path, run.changed(position=np.degrees(run.position)))
    assert found.verdict == 'INCONCLUSIVE'
    assert 'degrees instead of radians?' in reasons(found)


@pytest.mark.parametrize('begin', [2.0, 5.0])
@pytest.mark.parametrize('moves', [1, 2])
def test_a_driver_that_repeats_one_message_does_not_pass(
    begin: float, moves: int, tmp_path: Path
) -> None:
    """The arm moves, its driver tells the same message for 0.7 s, for 1.5 s, or to the end."""
    run = moved(rest(noise=1e-4), moves, swing(0.15, 0.4))
    for end in (begin + 0.7, begin + 1.5, 10.0):
        rows = np.arange(500)
        stuck = (rows >= begin * 50) & (rows < end * 50)
        rows[stuck] = rows[stuck][0]
        stopped = run.changed(stamp=run.stamp[rows], position=run.position[rows])
        effort = np.random.default_rng(2).normal(10.0, 3.0, (500, 4))
        found = judged(tmp_path, stopped.changed(effort=effort, velocity=effort))
        assert found.verdict == 'INCONCLUSIVE'
        assert 'joint_states repeats one message' in reasons(found)


def test_stamps_of_whole_seconds_pass(tmp_path: Path) -> None:
    """A driver whose clock counts seconds tells the same stamp for one, of an arm at rest."""
    run = rest()
    found = judged(tmp_path, run.changed(stamp=run.stamp // NS * NS))
    assert found.verdict == 'PASS'
    assert 'repeats' not in reasons(found)


@pytest.mark.parametrize('prefix', ['r1_', 'bot/', 'UGV-7.'])
def test_joints_with_a_prefix_are_shown_with_what_to_set(prefix: str, tmp_path: Path) -> None:
    """The names found, the near match of each, the prefix, and the key of the configuration."""
    names = tuple(prefix + name for name in NAMES)
    found = judged(tmp_path, rest().changed(names=names))
    assert found.verdict == 'INCONCLUSIVE'
    for name in NAMES:
        assert f'joints.{name}.topic_name: {prefix}{name}' in reasons(found)
    assert f'all with the prefix {prefix}' in reasons(found)


def test_one_renamed_joint_is_named_with_its_near_match(tmp_path: Path) -> None:
    """INPUT_INCOMPLETE names the joint that was never told, and what to set."""
    names = ('turret_joint', 'Shoulder-Joint', 'elbow_joint', 'flipper_joint')
    found = judged(tmp_path, rest().changed(names=names))
    assert found.verdict == 'INCONCLUSIVE'
    assert 'shoulder_joint was never told' in reasons(found)
    assert 'joints.shoulder_joint.topic_name: Shoulder-Joint' in reasons(found)


def test_a_position_beyond_its_range_is_named_with_the_range(tmp_path: Path) -> None:
    """INPUT_INVALID names joint, value, range, the likely unit, and the keys."""
    loaded = load()
    told = loaded.settings
    joints = tuple(
        replace(j, lower=-1.6, upper=1.6) if j.name == 'elbow_joint' else j
        for j in told.robot.joints
    )
    ranged = replace(told, robot=replace(told.robot, joints=joints))
    run = rest().changed(position=np.tile([0.0, 1.1, 57.3, math.pi], (500, 1)))
    found = judged(tmp_path, run, config=replace(loaded, settings=ranged))
    assert found.verdict == 'INCONCLUSIVE'
    said = 'elbow_joint is at 57.3 rad, its range is -1.6 to 1.6 rad: degrees instead of radians?'
    assert said in reasons(found)
    assert 'joints.elbow_joint.sign and offset' in reasons(found)


def test_a_position_that_steps_once_is_told(tmp_path: Path) -> None:
    """An encoder homed in the run: wrong before or after, so the run does not pass."""
    run = moved(rest(noise=5e-4), 2, lambda t: np.where(t > 5.0, 0.2, 0.0))
    found = judged(tmp_path, run)
    assert found.verdict == 'INCONCLUSIVE'
    assert 'at 5.02 s: the position of elbow_joint jumps by 11.4 deg' in reasons(found).replace(
        '11.5 deg', '11.4 deg'
    )


@pytest.mark.parametrize('hz', [1.0, 2.0, 3.0])
def test_joint_states_that_come_too_seldom_do_not_pass(hz: float, tmp_path: Path) -> None:
    """Between two of them nobody sees the arm: not a PASS, and the rate is told."""
    found = judged(tmp_path, rest(12.0, hz=hz).changed(seconds=12.0))
    assert found.verdict == 'INCONCLUSIVE'
    assert 'the rate of joint_states is low' in reasons(found)


@pytest.mark.parametrize('behind', [0.15, -0.4, 3.0])
def test_inputs_whose_stamps_are_apart_are_told(behind: float, tmp_path: Path) -> None:
    """A slow link, or another clock: posture and tilt may not belong together."""
    run = rest()
    found = judged(tmp_path, run.changed(stamp=run.stamp - round(behind * NS)))
    assert f'their stamps are {abs(behind):.2f} s apart' in reasons(found)
    same = judged(tmp_path, run)
    assert 'apart' not in reasons(same)


def test_velocities_in_another_unit_are_told(tmp_path: Path) -> None:
    """deg/s for rad/s: 57 times what the positions say, which are used instead."""
    run = moved(rest(), 0, swing(0.3, 1.0))
    rate = np.degrees(np.gradient(run.position, 0.02, axis=0))
    found = judged(tmp_path, run.changed(velocity=rate))
    assert found.verdict == 'PASS'
    assert 'reported velocity of turret_joint' in reasons(found)
    assert not [alert for alert in found.alerts if alert.code == 'STATIC_MODEL']


def test_a_log_whose_clock_went_back_is_judged(tmp_path: Path) -> None:
    """Interleaved receipt times are no motion: stamps tell the order."""
    run = moved(rest(noise=1e-4), 1, swing(0.1, 0.5))
    back = run.changed(time=np.where(run.time < EPOCH + 5 * NS, run.time, run.time - 3 * NS))
    order = np.argsort(back.time, kind='stable')
    told: dict[str, Any] = {x: getattr(back, x)[order] for x in ('time', 'stamp', 'position')}
    found = judged(tmp_path, back.changed(**told, seconds=7.0))
    assert 'its motion up to' not in reasons(found)
    assert 'CLOCK' in {alert.code for alert in found.alerts}
    assert FOLDED[1] > 0.0
