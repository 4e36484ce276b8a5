"""Checks of an IMU in motion: each fault by its name, none where there is none, live as recorded."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from evaluation.imu_runs import (
    FAULTS,
    NS,
    ImuRun,
    bursty,
    good_run,
    jittery,
    lossy,
    shocked,
    tilted_by,
)
from evaluation.streams import settings
from scipy.spatial.transform import Rotation

from ugv_acceptance.evaluation.alerts.messages import describe
from ugv_acceptance.evaluation.alerts.rules import RuleSet
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, WARN, Alert
from ugv_acceptance.evaluation.inputs.imu import ImuRows, ImuTracker
from ugv_acceptance.evaluation.samples import ImuColumns
from ugv_acceptance.evaluation.settings import ImuInput

# What only speaks at rest.
AT_REST = {'IMU_GRAVITY', 'IMU_INCONSISTENT', 'IMU_ORIENTATION', 'IMU_NO_GRAVITY'}


def recorded(run: ImuRun, cuts: Sequence[int] = (), **imu: Any) -> tuple[list[ImuRows], RuleSet]:
    """Return gravity and alerts of a run in parts."""
    told = settings(ImuInput(**imu))
    watch = RuleSet(told)
    tracker = ImuTracker(told, watch.attitude)
    places = [0, *sorted(cuts), len(run.q)]
    rows = []
    for a, b in zip(places[:-1], places[1:], strict=True):
        part = ImuRun(*(v[a:b] for v in (run.time, run.stamp, run.q, run.w, run.a, run.frame)))
        if a < b:
            rows.append(tracker.columns(part.columns()))
    return rows, watch


def live(run: ImuRun, **imu: Any) -> tuple[np.ndarray, list[bool], RuleSet]:
    """Return gravity, whether the gyro is trusted, and alerts of a run message by message."""
    told = settings(ImuInput(**imu))
    watch = RuleSet(told)
    tracker = ImuTracker(told, watch.attitude)
    gravity, trusted = [], []
    lists = (run.time, run.stamp, run.q, run.w, run.a, run.frame)
    for now, stamp, q, w, a, k in zip(*(v.tolist() for v in lists), strict=True):
        down, _ = tracker.step(now, stamp, tuple(q), 0.0, tuple(w), tuple(a), f'imu_{k}')
        gravity.append(down)
        trusted.append(tracker.gyro_trusted)
    return np.array(gravity), trusted, watch


def codes(watch: RuleSet) -> set[str]:
    """Return the codes of the alerts that work in motion."""
    return {alert.rule.code for alert in watch.log} - AT_REST


def facts(log: list[Alert]) -> Counter[Any]:
    """Return what alerts say, to be compared."""
    return Counter((a.rule, a.start, a.end, f'{a.peak:.7g}') for a in log)


def of(watch: RuleSet, code: str) -> Alert:
    """Return the first alert of a code."""
    return next(alert for alert in watch.log if alert.rule.code == code)


@pytest.mark.parametrize('name', [name for name in FAULTS if name not in {'tilt 5', 'tilt 10'}])
def test_a_fault_is_named(name: str) -> None:
    """Within a minute of driving each kind of fault raises an alert of its own."""
    fault, expected = FAULTS[name]
    for seed in (1001, 1002):
        run = fault(good_run(seed), np.random.default_rng(seed))
        assert codes(recorded(run)[1]) & expected


@pytest.mark.parametrize('seed', range(4))
@pytest.mark.parametrize('form', ['even', 'lost', 'jitter', 'bursts', 'shocks', '50 Hz', '20 Hz'])
def test_a_good_run_raises_nothing(form: str, seed: int) -> None:
    """Driving, slopes and vibration, with losses, jitter, bursts, shocks, and slow drivers."""
    hz = {'50 Hz': 50.0, '20 Hz': 20.0}.get(form, 100.0)
    run = good_run(seed, 60.0, hz)
    run = {
        'lost': lambda: lossy(run, seed), 'jitter': lambda: jittery(run, seed),
        'bursts': lambda: bursty(run), 'shocks': lambda: shocked(run, seed),
    }.get(form, lambda: run)()  # fmt: skip
    assert codes(recorded(run)[1]) == set()


@pytest.mark.parametrize('name', list(FAULTS))
def test_live_is_the_same_as_recorded(name: str) -> None:
    """Gravity, trust in the gyro, and alerts, in whatever parts the recording is read."""
    rng = np.random.default_rng(len(name))
    run = FAULTS[name][0](lossy(good_run(5, 30.0), 1, 0.1), rng)
    hole = (run.seconds > 9.0) & (run.seconds < 9.0 + 2.0 * (len(name) % 2))
    run = ImuRun(*(v[~hole] for v in (run.time, run.stamp, run.q, run.w, run.a, run.frame)))
    gravity, trusted, watch = live(run)
    for cuts in ([], rng.integers(0, len(run.q), 7).tolist(), range(0, len(run.q), 61)):
        rows, other = recorded(run, cuts)
        assert facts(other.log) == facts(watch.log)
        np.testing.assert_allclose(np.concatenate([r.gravity for r in rows]), gravity, atol=1e-9)
        assert np.concatenate([r.gyro_trusted for r in rows]).tolist() == trusted


@pytest.mark.parametrize('stamps', ['zero', 'jump back', 'slow', 'one for two'])
def test_stamps_that_are_wrong_raise_no_alert_and_hide_none(stamps: str) -> None:
    """Stamps of 0 or that jump give way to the time of receipt; a slow clock counts as it is."""
    for fault in (None, 'tilt 20'):
        run = good_run(8, 60.0)
        run = FAULTS[fault][0](run, np.random.default_rng(0)) if fault else run
        since = run.time - run.time[0]
        stamp = {
            'zero': since * 0, 'jump back': run.time - (since > 5 * NS) * 5 * NS,
            'slow': run.time[0] + since // 10 * 9, 'one for two': run.time // 20_000_000 * 20_000_000,
        }[stamps]  # fmt: skip
        run = replace(run, stamp=stamp)
        assert codes(recorded(run)[1]) == ({'IMU_CONTRADICTION'} if fault else set())
        assert facts(recorded(run)[1].log) == facts(live(run)[2].log)


def test_a_contradiction_makes_gravity_unknown_and_reaches_back_its_window() -> None:
    """The shortest window that shows it is told, with its length and the angle."""
    run = tilted_by(good_run(1, 20.0, vibration=0.0), 30.0)
    rows, watch = recorded(run)
    alert = of(watch, 'IMU_CONTRADICTION')
    assert alert.rule.level == ERROR
    assert alert.rule.reach == 3 * NS
    assert np.isnan(rows[0].gravity[rows[0].time >= alert.start]).all()
    said = describe(alert, settings())
    assert said.startswith('averaged over 2 s, the acceleration of imu contradicts its orientation')


def test_who_uses_the_accelerometer_is_warned_only() -> None:
    """A wrong orientation that is not used takes no margins away, and makes none doubtful."""
    run = tilted_by(good_run(1, 20.0, vibration=0.0), 30.0)
    _, watch = recorded(run, attitude='accelerometer')
    rule = of(watch, 'IMU_CONTRADICTION').rule
    assert (rule.level, rule.reach) == (WARN, 0)


def test_a_gyro_in_degrees_is_named_and_not_trusted() -> None:
    """It takes no margins away: the tilt does not come from it."""
    run = good_run(1003)
    rows, watch = recorded(replace(run, w=np.degrees(run.w)))
    alert = of(watch, 'IMU_RATES')
    assert alert.rule.level == WARN
    assert 'deg/s instead of rad/s' in describe(alert, settings())
    assert not rows[0].gyro_trusted[rows[0].time >= alert.start].any()
    assert np.isfinite(rows[0].gravity).all()


def test_a_gyro_that_hides_an_orientation_that_is_stuck_hides_it_no_more() -> None:
    """A rate that is never small keeps the checks at rest silent; the mean acceleration does not."""
    run = good_run(4, 20.0, vibration=0.3)
    lean = Rotation.from_euler('x', 30.0, degrees=True).inv()
    run = replace(
        run, q=np.tile((0.0, 0.0, 0.0087, 0.99996), (len(run.q), 1)),
        w=np.random.default_rng(1).normal(0.0, 2.0, run.w.shape), a=lean.apply(run.a),
    )  # fmt: skip
    rows, watch = recorded(run)
    assert of(watch, 'IMU_CONTRADICTION').start - run.time[0] <= 3 * NS
    assert np.isnan(rows[0].gravity[-1]).all()


@pytest.mark.parametrize(
    ('euler', 'said'),
    [
        ((180.0, 0.0), '[180, 0, 0]'), ((90.0, 0.0), '[90, 0, 0]'), ((-90.0, 0.0), '[-90, 0, 0]'),
        ((0.0, 90.0), '[0, 90, 0]'), ((0.0, -90.0), '[0, -90, 0]'),
    ],
)  # fmt: skip
@pytest.mark.parametrize('oriented', [True, False])
def test_a_mounting_is_named_as_it_must_be_configured(
    euler: tuple[float, float],
    said: str,
    oriented: bool,  # noqa: FBT001
) -> None:
    """From its first message on; set as told, the same IMU raises nothing."""
    turn = Rotation.from_euler('xy', euler, degrees=True)
    run = good_run(6, 20.0)
    q = (Rotation.from_quat(run.q) * turn).as_quat() if oriented else run.q * 0.0
    run = replace(run, q=q, w=turn.inv().apply(run.w), a=turn.inv().apply(run.a))
    rows, watch = recorded(run)
    alert = of(watch, 'IMU_MOUNTING')
    assert alert.start - run.time[0] == alert.rule.reach
    assert f'imu.mounting_rpy_deg: {said}' in describe(alert, settings())
    assert np.isnan(rows[0].gravity[rows[0].time >= alert.start]).all()
    mounting = tuple(map(tuple, turn.as_matrix().tolist()))
    assert codes(recorded(run, mounting=mounting)[1]) == set()


def test_a_robot_that_falls_is_no_wrong_mounting() -> None:
    """One that stood at its first message and lies a moment later fell over."""
    run = good_run(6, 20.0, vibration=0.0)
    turn = Rotation.from_euler('x', np.clip((run.seconds - 0.7) * 4.0, 0.0, 1.6)[:, None])
    q = (Rotation.from_quat(run.q) * turn).as_quat()
    run = replace(run, q=q, a=turn.inv().apply(run.a))
    assert 'IMU_MOUNTING' not in codes(recorded(run)[1])


def test_a_robot_that_is_put_upright_has_margins_again() -> None:
    """A mounting that was named is forgotten once the IMU stands upright."""
    run = good_run(6, 20.0, vibration=0.0)
    turn = Rotation.from_euler('x', np.clip((9.0 - run.seconds) * 4.0, 0.0, 1.57)[:, None])
    attitude = Rotation.from_quat(run.q) * turn
    rate = (attitude[:-1].inv() * attitude[1:]).as_rotvec() * 100.0
    run = replace(run, q=attitude.as_quat(), w=np.vstack((rate, rate[-1:])))
    rows, watch = recorded(replace(run, a=turn.inv().apply(run.a)))
    end = of(watch, 'IMU_MOUNTING').end
    assert end is not None
    assert np.isfinite(rows[0].gravity[rows[0].time >= end]).all()


@pytest.mark.parametrize(
    ('scale', 'words'),
    [(1 / 9.80665, 'in g'), (3.28084, 'in ft/s2'), (100.0, 'in cm/s2 or mg'), (0.0, 'subtracted')],
)
def test_the_unit_of_an_acceleration_is_named_in_motion(scale: float, words: str) -> None:
    """In a robot that is never at rest, as well."""
    run = good_run(7, 20.0, vibration=2.0)
    _, watch = recorded(replace(run, a=run.a * scale))
    assert words in describe(of(watch, 'IMU_UNIT'), settings())


def test_two_frame_ids_that_alternate_are_two_sources() -> None:
    """One change of the frame_id is a driver that was started anew."""
    run = good_run(9, 20.0)
    mixed = replace(run, frame=(np.arange(len(run.q)) % 3 == 0).astype(np.int64))
    assert 'two frame_ids' in describe(of(recorded(mixed)[1], 'IMU_TWO_SOURCES'), settings())
    once = replace(run, frame=(run.seconds > 7.0).astype(np.int64))
    assert codes(recorded(once)[1]) == set()


def test_no_message_no_alert() -> None:
    """A part without messages changes nothing."""
    told = settings()
    tracker = ImuTracker(told, RuleSet(told).attitude)
    none = np.zeros(0, np.int64)
    empty = ImuColumns('', none, none, *(np.zeros((0, k)) for k in (4, 3, 3)), *[np.zeros(0)] * 3)
    assert len(tracker.columns([empty]).gyro_trusted) == 0
