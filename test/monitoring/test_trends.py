"""Trends of live margins: the least seen, the time until one is gone, and the payload estimate."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from evaluation.streams import settings
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.evaluation.settings import Limits, Settings
from ugv_acceptance.model.sliding import slide_left
from ugv_acceptance.model.stability import Stability
from ugv_acceptance.monitoring.trends import Trends
from ugv_acceptance.simulation.vehicle import gravity_on_slope

PACKBOT = load().settings
LEVEL = (0.0, 0.0, -9.81)
STILL = (0.0,) * 4
SECOND = 1_000_000_000


def sample(time: int, front: float, shoulder: float = 10.0) -> Margins:
    """Return margins with this tilt left (rad) to the front and this torque (N m)."""
    nothing = (1.0,) * 4
    angle, torque = (front, 1.0, 1.0, 1.0), (0.0, shoulder, 5.0, 0.0)
    stability = Stability(angle, nothing, nothing, 0.1, 0)
    return Margins(time, time, STILL, LEVEL, torque, angle, 0, stability)


@given(st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(-60.0, 60.0)), min_size=1))
def test_near_misses_are_the_least_of_all_samples(values: list[tuple[float, float]]) -> None:
    """The smallest tilt and the smallest torque margin, whatever their order."""
    trends = Trends(PACKBOT)
    for k, (front, shoulder) in enumerate(values):
        trends.see(sample(k, front, shoulder))
    tilt, torque = trends.near_misses()
    assert tilt.left == min(1.0, *(front for front, _ in values))
    assert torque.left == min(45.0, *(50.0 - abs(tau) for _, tau in values))


def test_a_margin_that_shrinks_evenly_is_told_with_its_time() -> None:
    """Ten degrees left and five a second: two seconds; it does not matter that it is noisy."""
    trends, noise = Trends(PACKBOT), np.random.default_rng(3).normal(0.0, 0.002, 200)
    for k in range(200):
        left = math.radians(20.0 - 5.0 * k / 100) + float(noise[k])
        trends.see(sample(k * SECOND // 100, left))
    (front,) = trends.ahead(2 * SECOND)
    assert front.subject == 'front'
    assert front.seconds == pytest.approx(2.0, abs=0.2)
    assert front.rate == pytest.approx(math.radians(-5.0), rel=0.1)


def test_a_load_that_grows_is_told_with_its_time() -> None:
    """From 30 N m at 10 N m a second it takes two seconds to 50 N m."""
    trends = Trends(PACKBOT)
    for k in range(100):
        trends.see(sample(k * SECOND // 100, 0.8, -20.0 - k / 10))
    (shoulder,) = trends.ahead(SECOND)
    assert shoulder.subject == 'shoulder_joint'
    assert shoulder.seconds == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize('later', [0, 3 * SECOND])
def test_a_robot_that_rests_or_is_not_heard_has_nothing_ahead(later: int) -> None:
    """A robot at rest, or without samples in the last second, has no predicted end."""
    trends = Trends(PACKBOT)
    for k in range(100):
        left = 0.1 - 0.05 * k / 100 if later else 0.1
        trends.see(sample(k * SECOND // 100, left))
    assert trends.ahead(SECOND + later) == ()


MS = 1_000_000
TWO = settings(limits=Limits((100.0, 10.0)))


def seen(
    values: Sequence[tuple[tuple[float, ...], tuple[float, float]]], spacing: int = 50 * MS,
    told: Settings = TWO,
) -> Trends:  # fmt: skip
    """Return an outlook that saw (tilts left, torques) from time 0 on."""
    trends, nothing = Trends(told), (1.0,) * 4
    for k, (angle, torque) in enumerate(values):
        stability = Stability(angle, nothing, nothing, 0.1, 0)
        trends.see(Margins(k * spacing, 0, (0.0, 0.0), LEVEL, torque, angle, 0, stability))
    return trends


FINE = (1.0, 1.0, 1.0, 1.0)


def test_a_near_miss_is_dated_to_the_first_of_equals() -> None:
    """Tilt in rad; of torques the one that was the largest share of its limit, in its unit."""
    least = ((1.0, 0.2, 1.0, 0.5), (-90.0, 8.0))
    trends = seen([(FINE, (1.0, 1.0)), least, least, (FINE, (80.0, -7.0))])
    tilt, torque = trends.near_misses()
    assert (tilt.time, tilt.subject, tilt.left) == (50 * MS, 'left', 0.2)
    assert (torque.time, torque.subject, torque.left) == (50 * MS, 'lift', 10.0)


def test_what_has_no_limit_or_was_never_seen_is_no_near_miss() -> None:
    """A joint without a limit, or a tilt that is unknown, gives no near miss."""
    free = settings(limits=Limits((math.inf, 10.0)))
    nowhere = (math.nan,) * 4
    (torque,) = seen([(nowhere, (50.0, 3.0))], told=free).near_misses()
    assert (torque.subject, torque.left) == ('slide', 7.0)
    assert seen([]).near_misses() == ()
    assert seen([]).ahead(0) == ()


def falling(count: int, spacing: int = 50 * MS, tilt: float = 0.2, load: float = 0.0) -> Trends:
    """Return an outlook on a front tilt of 0.5 rad and a lift's load of 85 N m, at these rates."""
    at = [k * spacing / SECOND for k in range(count)]
    return seen([((0.5 - tilt * t, 1.0, 1.0, 1.0), (85.0 + load * t, 0.0)) for t in at], spacing)


def test_eight_samples_of_the_last_second_tell_a_rate() -> None:
    """A rate needs eight samples, one every 50 ms, from the last second."""
    assert len(falling(8).ahead(350 * MS)) == 1
    assert falling(7).ahead(300 * MS) == ()
    assert len(falling(8).ahead(SECOND - 1)) == 1
    assert falling(8).ahead(SECOND) == ()
    assert falling(15, spacing=25 * MS).ahead(350 * MS) != ()
    assert falling(14, spacing=25 * MS).ahead(350 * MS) == ()


def test_a_second_of_samples_is_all_that_is_kept() -> None:
    """Only the samples of the last second are kept, however long the robot runs."""
    assert len(falling(500)._recent) == 21


def test_a_rate_is_that_of_a_line_through_the_last_second() -> None:
    """Least squares over its twenty samples, carried on to the moment that is asked for."""
    time = np.arange(40) * 0.05
    tilt = 1.0 - 0.1 * time**2
    found = seen([((float(x), 1.0, 1.0, 1.0), (0.0, 0.0)) for x in tilt])
    now = 2.0
    last = time > now - 1.0
    rate, value = np.polyfit(time[last] - now, tilt[last], 1)
    (front,) = found.ahead(2 * SECOND)
    assert front.rate == pytest.approx(rate)
    assert front.seconds == pytest.approx(-value / rate)


@pytest.mark.parametrize(
    ('tilt', 'load', 'names'),
    [
        (0.2, 0.0, ['front']), (0.0, 5.0, ['lift']), (0.2, 12.0, ['lift', 'front']),
        (0.0, 3.1, ['lift']), (0.0, 2.9, []), (0.2, -5.0, ['front']), (-0.2, -5.0, []),
        (0.1, 0.0, ['front']), (0.085, 0.0, []),
    ],
)  # fmt: skip
def test_what_is_used_up_within_five_seconds_is_told_soonest_first(
    tilt: float, load: float, names: list[str]
) -> None:
    """Margins gone within 5 s are listed, soonest first; recovering ones are not."""
    assert [a.subject for a in falling(10, tilt=tilt, load=load).ahead(450 * MS)] == names


@pytest.mark.parametrize(('degrees', 'told'), [(1.1, True), (0.9, False)])
def test_a_tilt_that_shrinks_by_a_degree_a_second_is_told(degrees: float, told: bool) -> None:  # noqa: FBT001
    """A tilt is listed only if it shrinks by at least 1 deg/s, however little is left."""
    at = [k * 0.05 for k in range(10)]
    low = [((0.03 - math.radians(degrees) * t, 1.0, 1.0, 1.0), (0.0, 0.0)) for t in at]
    assert bool(seen(low).ahead(450 * MS)) == told


def test_a_margin_that_was_unknown_tells_nothing_and_one_that_is_gone_tells_now() -> None:
    """A margin with an unknown sample is not listed; one already gone is listed with 0 s."""
    at = [k * 0.05 for k in range(10)]
    rows = [((0.5 - 0.2 * t, -0.1 - 0.2 * t, 1.0, 1.0), (85.0 + 9.0 * t, 9.0 + t)) for t in at]
    rows[4] = ((math.nan, *rows[4][0][1:]), rows[4][1])
    free = settings(limits=Limits((math.inf, 10.0)))
    left, slide = seen(rows, told=free).ahead(450 * MS)
    assert (left.subject, left.seconds) == ('left', 0.0)
    assert slide.subject == 'slide'
    assert slide.rate == pytest.approx(-1.0)


@given(st.floats(0.0, 1.5), st.floats(-3.1, 3.1), st.floats(0.05, 2.0))
def test_the_robot_slides_where_the_slope_is_the_angle_of_friction(
    tilt: float, heading: float, friction: float
) -> None:
    """The margin to sliding is the friction angle less the slope, at any heading."""
    x, y, z = gravity_on_slope(9.81, tilt, heading).tolist()
    assert slide_left((x, y, z), friction) == pytest.approx(math.atan(friction) - tilt, abs=1e-9)


def test_without_a_friction_nothing_slides() -> None:
    """Without a known friction, sliding is not judged."""
    assert slide_left(LEVEL, math.inf) == math.inf
