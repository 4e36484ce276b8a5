"""IMU: gravity from an orientation that can be trusted, else from acceleration; faults by name."""

import math
from collections.abc import Sequence
from itertools import pairwise

import hypothesis
import numpy as np
import pytest
from evaluation.streams import (
    LEVEL,
    MS,
    REST,
    STILL,
    T0,
    Imu,
    Joints,
    S,
    give,
    imu_columns,
    imu_messages,
    settings,
    stamp_of,
    tilted,
    upright,
)
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import lfilter

from ugv_acceptance.evaluation.alerts.rules import RuleSet
from ugv_acceptance.evaluation.inputs.imu import ImuTracker
from ugv_acceptance.evaluation.inputs.low_pass import LowPass
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.evaluation.settings import ImuInput
from ugv_acceptance.model.robot import Vector

ON_ITS_BACK = (1.0, 0.0, 0.0, 0.0)
QUARTER_ROLL = ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))


def tracker(imu: ImuInput | None = None) -> ImuTracker:
    """Return a tracker of the small robot."""
    told = settings(imu)
    return ImuTracker(told, RuleSet(told).attitude)


def step(of: ImuTracker, m: Imu) -> tuple[Vector, bool]:
    """Give a tracker one message."""
    return of.step(m.time, stamp_of(m), m.orientation, m.covariance_0, m.omega, m.acceleration)


_shifts = st.sampled_from([1, 2, 10, 300, 999, 1001, 0, 0, -5, -3_600_000, 3_600_000])


@hypothesis.settings(max_examples=200)
@given(
    st.lists(st.tuples(imu_messages(), _shifts), min_size=1, max_size=25),
    st.lists(st.integers(0, 25), max_size=3),
    st.sampled_from(['auto', 'orientation', 'accelerometer']),
    st.booleans(),
)
def test_columns_give_the_rows_of_single_messages(
    drawn: list[tuple[Imu, int]],
    cuts: list[int],
    attitude: str,
    specific_force: bool,  # noqa: FBT001 - drawn
) -> None:
    """Whatever stamps do: stand still, jump, run backwards."""
    told = ImuInput(attitude=attitude, specific_force=specific_force, agreement_delay=0.05)
    messages, stamp = [], T0
    for k, (m, shift) in enumerate(drawn):
        stamp += shift * MS
        messages.append(
            Imu(T0 + k * 10 * MS, m.orientation, m.omega, m.acceleration, m.covariance_0, stamp)
        )
    one, many = tracker(told), tracker(told)
    expected = [step(one, m) for m in messages]
    places = [0, *sorted(min(c, len(messages)) for c in cuts), len(messages)]
    got: list[tuple[Sequence[float], bool]] = []
    for a, b in pairwise(places):
        rows = many.columns([imu_columns(messages[a:b])])
        got += list(zip(rows.gravity.tolist(), rows.unusable, strict=True))
    for (gravity, unusable), (g, u) in zip(expected, got, strict=True):
        np.testing.assert_allclose(gravity, g, rtol=1e-12, atol=1e-11)
        assert unusable == u
    assert many.taken == one.taken


@pytest.mark.parametrize('hz', [50.0, 400.0])
def test_low_pass_is_that_of_scipy(hz: float) -> None:
    """For a constant step: y = keep y + (1 - keep) x, started at the first value."""
    random = np.random.default_rng(1)
    x = random.normal((0.0, 0.0, 9.81), 1.0, (2000, 3))
    keep = math.exp(-1.0 / hz / 0.2)
    start = keep * x[:1]
    expected, _ = lfilter([1.0 - keep], [1.0, -keep], x, axis=0, zi=start)
    messages = [
        Imu(T0 + round(k * S / hz), acceleration=tuple(a)) for k, a in enumerate(x.tolist())
    ]
    smooth = LowPass(0.2).columns(
        np.array([m.time for m in messages]), np.array([m.acceleration for m in messages]).T
    )
    np.testing.assert_allclose(smooth.T, expected, rtol=1e-12, atol=1e-11)


def outcome(imu: ImuInput, orientation: Sequence[float], acceleration: Sequence[float],
            covariance_0: float = 0.0) -> tuple[Margins | None, set[str]]:  # fmt: skip
    """Return the margins after three seconds at rest, and the codes of the alerts."""
    evaluator = LiveEvaluator(settings(imu))
    evaluator.start(T0)
    margins = None
    for k in range(300):
        give(evaluator, Joints(T0 + k * 10 * MS))
        margins = give(
            evaluator,
            Imu(T0 + k * 10 * MS + 1, tuple(orientation), STILL, tuple(acceleration), covariance_0),
        )
    return margins, {alert.rule.code for alert in evaluator.watch.log}


@pytest.mark.parametrize(
    ('orientation', 'covariance_0', 'named'),
    [
        (LEVEL, 0.0, {'IMU_ORIENTATION'}),
        ((0.0, 0.0, 0.0, 0.0), 0.0, {'IMU_ORIENTATION'}),
        ((100.0, 100.0, 100.0, 92.0), 0.0, {'IMU_ORIENTATION'}),
        ((math.nan, 0.0, 0.0, 1.0), 0.0, {'IMU_ORIENTATION'}),
        (tilted(0.5), -1.0, set()),
    ],
    ids=['identity', 'zero', 'norm 196', 'not a number', 'covariance -1'],
)
def test_an_orientation_that_tells_nothing_leaves_it_to_the_accelerometer(
    orientation: Sequence[float], covariance_0: float, named: set[str]
) -> None:
    """An empty orientation is a fault unless announced; the accelerometer replaces it."""
    lean = upright(tilted(0.2, 0.1))
    margins, codes = outcome(ImuInput(), orientation, lean, covariance_0)
    assert margins is not None
    np.testing.assert_allclose(margins.gravity, -np.array(lean), rtol=1e-9)
    assert codes - {'TIP_OVER', 'TORQUE_LIMIT'} == named


def test_an_identity_that_the_accelerometer_confirms_is_no_fault() -> None:
    """A robot that stands level tells the identity, and need not be suspected."""
    margins, codes = outcome(ImuInput(), LEVEL, REST)
    assert margins is not None
    assert not codes - {'TORQUE_LIMIT'}


def test_only_one_bad_orientation_is_no_alert() -> None:
    """A single bad orientation raises no alert, and the accelerometer replaces it."""
    told = settings()
    watch = RuleSet(told)
    of = ImuTracker(told, watch.attitude)
    for k in range(300):
        orientation = (0.0,) * 4 if k == 50 else tilted(0.1)
        m = Imu(T0 + k * 10 * MS, orientation, acceleration=upright(tilted(0.1)))
        gravity, unusable = step(of, m)
        np.testing.assert_allclose(gravity, -np.array(upright(tilted(0.1))), rtol=1e-9)
        assert not unusable
    assert not watch.log
    assert of.taken == [299, 0, 1]


@pytest.mark.parametrize('frame', ['imu_link', '/imu_link', 'robot_1/imu_link', ''])
def test_a_frame_that_is_the_configured_one_is_no_fault(frame: str) -> None:
    """A frame matches the configured one with a leading slash, a namespace, or no name."""
    margins, codes = framed(frame)
    assert margins is not None
    assert not codes - {'TORQUE_LIMIT'}


@pytest.mark.parametrize('frame', ['imu', 'other_imu_link', 'imu_link/x'])
def test_another_frame_is_a_fault_without_margins(frame: str) -> None:
    """An IMU frame other than the configured one is a fault, and gives no margins."""
    margins, codes = framed(frame)
    assert margins is None
    assert 'IMU_FRAME' in codes


def framed(frame: str) -> tuple[Margins | None, set[str]]:
    """Return the margins after messages of a frame, where imu_link is expected."""
    evaluator = LiveEvaluator(settings(ImuInput(frame='imu_link')))
    evaluator.start(T0)
    give(evaluator, Joints(T0))
    margins = give(evaluator, Imu(T0 + 1, tilted(0.1), STILL, upright(tilted(0.1)), frame=frame))
    return margins, {alert.rule.code for alert in evaluator.watch.log}


def test_an_orientation_that_disagrees_at_rest_is_a_fault_without_margins() -> None:
    """Orientation and accelerometer that disagree at rest are a fault, and give no margins."""
    margins, codes = outcome(ImuInput(), tilted(0.5), REST)
    assert margins is None
    assert 'IMU_INCONSISTENT' in codes
    assert 'INPUT_INVALID' not in codes


@pytest.mark.parametrize(
    'acceleration',
    [(0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 16384.0), (0.01, 0.0, 0.02)],
    ids=['in g', 'all zero', 'raw counts', 'gravity removed'],
)
def test_an_acceleration_that_is_not_gravity_gives_no_margins(
    acceleration: Sequence[float],
) -> None:
    """Without orientation an acceleration that is not g is a fault, and gives no margins."""
    margins, codes = outcome(ImuInput(), LEVEL, acceleration)
    assert margins is None
    believable = math.hypot(*acceleration) < 1e3
    assert ('INPUT_INVALID' in codes) != believable
    assert ('IMU_NO_GRAVITY' in codes) == believable


@pytest.mark.parametrize('bad', [math.nan, math.inf, -math.inf, 1e308])
def test_a_number_beyond_belief_is_a_fault_and_soon_forgotten(bad: float) -> None:
    """An impossible acceleration is a fault, and does not stay in the low-pass."""
    of = tracker(ImuInput(attitude='accelerometer'))
    step(of, Imu(T0))
    gravity, unusable = step(of, Imu(T0 + 10 * MS, acceleration=(bad, 0.0, 9.81)))
    assert unusable
    assert math.isnan(gravity[0])
    gravity, unusable = step(of, Imu(T0 + 20 * MS))
    assert not unusable
    assert gravity == (0.0, 0.0, -9.81)


def test_a_good_orientation_beside_a_broken_accelerometer_is_named() -> None:
    """With a broken accelerometer margins are known only if attitude is `orientation`."""
    for attitude in ('auto', 'orientation'):
        told = ImuInput(attitude=attitude)
        margins, codes = outcome(told, tilted(0.1), (math.nan,) * 3)
        assert (margins is None) is (attitude == 'auto')
        assert 'INPUT_INVALID' in codes
        for force in ((0.0, 0.0, 1.0), (0.01, 0.0, 0.02)):
            margins, codes = outcome(told, tilted(0.1), force)
            assert (margins is None) is (attitude == 'auto')
            assert 'IMU_GRAVITY' in codes


@pytest.mark.parametrize('force', [(0.0, 0.0, 1.0), (0.01, 0.0, 0.02), (0.0, 0.0, 0.0)])
def test_specific_force_that_is_none_gives_no_margins_at_all(force: Sequence[float]) -> None:
    """A specific force in g, or without gravity, gives no margins: they would look too large."""
    evaluator = LiveEvaluator(settings(ImuInput(specific_force=True)))
    evaluator.start(T0)
    for k in range(300):
        give(evaluator, Joints(T0 + k * 10 * MS))
        give(evaluator, Imu(T0 + k * 10 * MS + 1, tilted(0.1), STILL, tuple(force)))
    assert evaluator.evaluated == 0
    assert 'IMU_NO_GRAVITY' in {alert.rule.code for alert in evaluator.watch.log}


@pytest.mark.parametrize('orientation', [ON_ITS_BACK, tilted(math.pi / 2)])
def test_an_imu_mounted_otherwise_than_told_is_never_ok(orientation: tuple[float, ...]) -> None:
    """An IMU mounted upside down or at 90 degrees has no margins as soon as that is known."""
    margins, codes = outcome(ImuInput(), orientation, upright(orientation))
    assert margins is None
    assert {'TIP_OVER', 'IMU_MOUNTING'} <= codes


def test_a_mounting_that_is_told_is_undone() -> None:
    """The configured mounting turns sensor axes into `base_link`, orientation and acceleration."""
    sensor = tilted(math.pi / 2)
    margins, codes = outcome(ImuInput(mounting=QUARTER_ROLL), sensor, upright(sensor))
    assert margins is not None
    np.testing.assert_allclose(margins.gravity, (0.0, 0.0, -9.81), atol=1e-12)
    assert not codes - {'TORQUE_LIMIT'}


def test_specific_force_takes_gravitys_place_and_the_spin_is_undone() -> None:
    """A sensor 1 m ahead on a robot that turns feels 1 m/s2 towards the axis; the base does not."""
    of = tracker(ImuInput(specific_force=True, position=(1.0, 0.0, 0.0)))
    moving: NDArray[np.float64] = np.array((-1.0, 0.0, 9.81))
    gravity, _ = step(of, Imu(T0, LEVEL, (0.0, 0.0, 1.0), tuple(moving.tolist())))
    np.testing.assert_allclose(gravity, (0.0, 0.0, -9.81), atol=1e-12)
