"""The exact values at which the IMU's rules begin: in single messages and in columns."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from evaluation.streams import LEVEL, MS, STILL, T0, Imu, imu_columns, settings, tilted, upright

from ugv_acceptance.evaluation.alerts.rules import RuleSet
from ugv_acceptance.evaluation.inputs.imu import ImuTracker
from ugv_acceptance.evaluation.settings import ImuInput

TEN = (0.0, 0.0, 10.0)
HALF = math.sqrt(0.5)


def tracked(
    message: Imu, count: int = 1, **chosen: Any
) -> tuple[tuple[float, ...], bool, list[int], set[str]]:
    """Return the last gravity, unusable, counts and alerts of a message that comes again and again.

    Gravity is 10 m/s2 here; both roads must come to the same.
    """
    told = settings(ImuInput(agreement_delay=0.5, **chosen))
    told = replace(told, robot=replace(told.robot, gravity=10.0))
    watch, other = RuleSet(told), RuleSet(told)
    one, many = ImuTracker(told, watch.attitude), ImuTracker(told, other.attitude)
    run = [replace(message, time=T0 + 10 * k * MS) for k in range(count)]
    for m in run:
        gravity, unusable = one.step(
            m.time, m.time, m.orientation, m.covariance_0, m.omega, m.acceleration, m.frame
        )
    rows = many.columns([imu_columns(run)])
    np.testing.assert_allclose(rows.gravity[-1], gravity, rtol=1e-12, atol=1e-12)
    assert bool(rows.unusable[-1]) == unusable
    assert many.taken == one.taken
    codes = {a.rule.code for a in watch.log}
    assert codes == {a.rule.code for a in other.log}
    return gravity, unusable, one.taken, codes


@pytest.mark.parametrize(
    ('omega', 'up', 'found'),
    [
        ((0.0, 0.0, 0.125), 10.0, {'IMU_INCONSISTENT'}), ((0.0, 0.1251, 0.0), 10.0, set()),
        ((0.0, 0.075, -0.1), 10.0, {'IMU_INCONSISTENT'}), ((0.1, 0.1, 0.0), 10.0, set()),
        (STILL, 10.25, {'IMU_INCONSISTENT'}), (STILL, 10.2501, set()),
        (STILL, 9.75, {'IMU_INCONSISTENT'}), (STILL, 9.7499, set()),
    ],
)  # fmt: skip
def test_orientation_and_acceleration_are_compared_at_rest(
    omega: tuple[float, ...], up: float, found: set[str]
) -> None:
    """A rate of 0.125 rad/s and a quarter of a m/s2 from g are rest, as configured here."""
    message = Imu(T0, tilted(0.5), omega, (0.0, 0.0, up))
    gravity, unusable, _, codes = tracked(message, 100, rest_rate=0.125, rest_acceleration=0.25)
    assert codes == found
    assert math.isnan(gravity[0]) == bool(found)
    assert not unusable


@pytest.mark.parametrize(
    ('up', 'omega', 'found'),
    [
        (11.5, STILL, {'IMU_GRAVITY'}), (11.49, STILL, set()), (8.5, STILL, {'IMU_GRAVITY'}),
        (8.51, STILL, set()), (20.0, (0.0, 0.0, 0.2), set()),
    ],
)  # fmt: skip
def test_an_acceleration_that_is_not_g_at_rest_is_strange(
    up: float, omega: tuple[float, ...], found: set[str]
) -> None:
    """At rest an acceleration 15 % off g is a fault; in motion it is not judged."""
    *_, codes = tracked(Imu(T0, tilted(0.1), omega, (0.0, 0.0, up)), 100, rest_rate=0.125)
    assert codes == found


@pytest.mark.parametrize(
    ('up', 'known'), [(11.5, True), (11.5001, False), (8.5, True), (8.4999, False)]
)
def test_an_acceleration_tells_up_within_fifteen_hundredths(up: float, known: bool) -> None:  # noqa: FBT001
    """An acceleration gives the attitude within 15 % of g, the bounds included."""
    gravity, unusable, *_ = tracked(Imu(T0, LEVEL, STILL, (0.0, 0.0, up), -1.0))
    assert not unusable
    assert math.isnan(gravity[2]) != known


@pytest.mark.parametrize(('up', 'known'), [(5.0, True), (4.9999, False)])
def test_half_of_g_is_no_fall(up: float, known: bool) -> None:  # noqa: FBT001
    """A specific force of exactly half of g is no free fall; less is, and gives no margins."""
    gravity, unusable, *_ = tracked(Imu(T0, LEVEL, STILL, (0.0, 0.0, up)), specific_force=True)
    assert not unusable
    assert gravity == (
        pytest.approx((0.0, 0.0, -up)) if known else pytest.approx((math.nan,) * 3, nan_ok=True)
    )


@pytest.mark.parametrize('attitude', ['auto', 'orientation'])
@pytest.mark.parametrize(('spin', 'usable'), [(1000.0, True), (1000.1, False)])
def test_a_rate_beyond_belief_makes_a_message_unusable(
    attitude: str,
    spin: float,
    usable: bool,  # noqa: FBT001
) -> None:
    """An impossible angular rate makes an IMU message unusable, except for `orientation`."""
    message = Imu(T0, tilted(0.1), (0.0, spin, 0.0), TEN)
    gravity, unusable, *_ = tracked(message, attitude=attitude)
    assert unusable != usable
    assert math.isnan(gravity[0]) == (attitude == 'auto' and not usable)


@pytest.mark.parametrize(
    ('orientation', 'gravity'),
    [
        ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 10.0)), ((0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 10.0)),
        ((0.0, 0.0, 1.0, 0.0), (0.0, 0.0, -10.0)), ((0.0, 0.0, 0.6, 0.8), (0.0, 0.0, -10.0)),
        ((HALF, 0.0, 0.0, HALF), (0.0, -10.0, 0.0)), ((0.0, HALF, 0.0, HALF), (10.0, 0.0, 0.0)),
        ((0.5, 0.5, 0.5, 0.5), (0.0, -10.0, 0.0)), ((-0.5, 0.5, 0.5, 0.5), (10.0, 0.0, 0.0)),
    ],
)  # fmt: skip
def test_a_unit_quaternion_is_a_rotation_about_any_axis(
    orientation: Sequence[float], gravity: Sequence[float]
) -> None:
    """Gravity in base axes by the textbook; a half turn about x or y stands on its head."""
    message = Imu(T0, tuple(orientation), (9.0, 0.0, 0.0), TEN)
    found, unusable, taken, _ = tracked(message)
    assert found == pytest.approx(gravity, abs=1e-12)
    assert (unusable, taken) == (False, [1, 0, 0])


@pytest.mark.parametrize('orientation', [LEVEL, (0.0,) * 4, tilted(0.5)])
def test_who_asks_for_the_accelerometer_hears_nothing_of_orientations_that_say_nothing(
    orientation: tuple[float, ...],
) -> None:
    """With attitude `accelerometer` only an orientation that contradicts it is a fault."""
    message = Imu(T0, orientation, STILL, TEN)
    gravity, unusable, _, codes = tracked(message, 100, attitude='accelerometer')
    contradicts = orientation == tilted(0.5)
    assert codes == ({'IMU_INCONSISTENT'} if contradicts else set())
    assert not unusable
    assert math.isnan(gravity[0]) == contradicts
    if not contradicts:
        assert gravity == pytest.approx((0.0, 0.0, -10.0))


LEAN = tilted(0.2)
LEANING = upright(LEAN, 10.0)


@pytest.mark.parametrize(
    ('orientation', 'covariance_0', 'counts', 'found'),
    [
        ((0.0,) * 4, 0.0, [0, 0, 100], {'IMU_ORIENTATION'}),
        (LEVEL, 0.0, [0, 0, 100], {'IMU_ORIENTATION'}),
        ((0.0,) * 4, -1.0, [0, 100, 0], set()), (LEVEL, -1.0, [0, 100, 0], set()),
        (LEAN, 0.0, [100, 0, 0], set()), (tilted(0.9), -1.0, [0, 100, 0], set()),
    ],
)  # fmt: skip
def test_a_warning_of_the_orientation_leaves_gravity_to_the_accelerometer(
    orientation: tuple[float, ...], covariance_0: float, counts: list[int], found: set[str]
) -> None:
    """What says of itself that it has none is no fault, whatever stands there."""
    message = Imu(T0, orientation, STILL, LEANING, covariance_0)
    gravity, unusable, taken, codes = tracked(message, 100)
    assert gravity == pytest.approx([-x for x in LEANING])
    assert (unusable, taken, codes) == (False, counts, found)


@pytest.mark.parametrize(('frame', 'found'), [('imu_link', set()), ('arm', {'IMU_FRAME'})])
def test_a_foreign_frame_takes_gravity_away_at_once(frame: str, found: set[str]) -> None:
    """A foreign frame makes gravity unknown from its first message on."""
    gravity, unusable, _, codes = tracked(
        Imu(T0, LEAN, STILL, LEANING, frame=frame), frame='imu_link'
    )
    assert codes == found
    assert math.isnan(gravity[0]) == bool(found)
    assert not unusable


@pytest.mark.parametrize(
    ('frames', 'foreign'),
    [
        (('r1/imu_link', 'r2/imu_link'), [50, 51]),
        (('/r1/imu_link', 'r1/imu_link'), []),
        (('imu_link', 'r1/imu_link'), []),
        (('', 'r1/imu_link'), []),
        (('fleet/r1/imu_link', 'r1/imu_link'), [50, 51]),
    ],
)
def test_the_frame_of_another_robot_is_foreign(frames: tuple[str, str], foreign: list[int]) -> None:
    """The expected frame with another prefix than at first: gravity is gone, live and recorded."""
    told = settings(ImuInput(frame='imu_link'))
    message = Imu(T0, LEAN, STILL, upright(LEAN))
    run = [replace(message, time=T0 + 10 * k * MS, frame=frames[k >= 50]) for k in range(52)]
    one, many = (ImuTracker(told, RuleSet(told).attitude) for _ in range(2))
    steps = [
        one.step(m.time, m.time, m.orientation, 0.0, m.omega, m.acceleration, m.frame)[0]
        for m in run
    ]
    rows = many.columns([imu_columns(run[50:]), imu_columns(run[:50])])
    assert [k for k, g in enumerate(steps) if not math.isfinite(g[0])] == foreign
    assert np.flatnonzero(np.isnan(rows.gravity[:, 0])).tolist() == foreign


def test_gravity_is_gone_from_the_alert_on_until_the_alert_ends() -> None:
    """Half a second after it began to disagree; a second after it agreed again, to the message."""
    told = settings(ImuInput(agreement_delay=0.5))
    right, wrong = Imu(T0, LEAN, STILL, upright(LEAN)), Imu(T0, tilted(0.9), STILL, upright(LEAN))
    run = [replace(wrong if 30 <= k < 100 else right, time=T0 + 10 * k * MS) for k in range(300)]
    known = [k for k in range(300) if not 80 <= k < 200]
    one = ImuTracker(told, RuleSet(told).attitude)
    steps = [one.step(m.time, m.time, m.orientation, 0.0, m.omega, m.acceleration)[0] for m in run]
    assert [k for k, g in enumerate(steps) if math.isfinite(g[0])] == known
    for cut in (0, 50, 80, 150, 199, 200, 201):
        many = ImuTracker(told, RuleSet(told).attitude)
        parts = [many.columns([imu_columns(part)]) for part in (run[:cut], run[cut:]) if part]
        gravity = np.concatenate([rows.gravity for rows in parts])
        assert np.flatnonzero(np.isfinite(gravity[:, 0])).tolist() == known


def test_messages_of_several_frames_come_in_order_of_receipt() -> None:
    """As one stream; no message gives no row."""
    told = settings()
    first, second = (
        [Imu(T0 + k * MS, tilted(0.01 * k), (9.0, 0.0, 0.0), frame=frame) for k in times]
        for frame, times in (('a', (1, 4)), ('b', (2, 3)))
    )
    rows = ImuTracker(told, RuleSet(told).attitude).columns(
        [imu_columns(first), imu_columns([]), imu_columns(second)]
    )
    assert rows.time.tolist() == [T0 + k * MS for k in (1, 2, 3, 4)]
    np.testing.assert_allclose(
        rows.gravity[:, 1], [-9.81 * math.sin(0.01 * k) for k in (1, 2, 3, 4)]
    )
    empty = ImuTracker(told, RuleSet(told).attitude).columns([])
    assert (empty.time.shape, empty.gravity.shape, empty.unusable.shape) == ((0,), (0, 3), (0,))
