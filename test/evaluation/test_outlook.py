"""What is left, what was least, how soon it is gone, and what the motors say of the load."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.live import Margins
from ugv_acceptance.evaluation.outlook import Outlook
from ugv_acceptance.evaluation.payload_estimate import payload_estimate
from ugv_acceptance.evaluation.sliding import slide_left
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import Stability
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.simulation.vehicle import gravity_on_slope

PACKBOT = load().settings
LEVEL = (0.0, 0.0, -9.81)
STILL = (0.0,) * 4
SECOND = 1_000_000_000


def sample(time: int, front: float, shoulder: float = 10.0) -> Margins:
    """Return margins with this tilt left (rad) to the front and this torque (N m)."""
    nothing = (1.0,) * 4
    stability = Stability((front, 1.0, 1.0, 1.0), nothing, nothing, 0.1, 0)
    return Margins(time, time, STILL, LEVEL, (0.0, shoulder, 5.0, 0.0), stability)


@given(st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(-60.0, 60.0)), min_size=1))
def test_near_misses_are_the_least_of_all_samples(values: list[tuple[float, float]]) -> None:
    """The smallest tilt and the smallest torque margin, whatever their order."""
    outlook = Outlook(PACKBOT)
    for k, (front, shoulder) in enumerate(values):
        outlook.see(sample(k, front, shoulder))
    tilt, torque = outlook.near_misses()
    assert tilt.left == min(1.0, *(front for front, _ in values))
    assert torque.left == min(45.0, *(50.0 - abs(tau) for _, tau in values))


def test_a_margin_that_shrinks_evenly_is_told_with_its_time() -> None:
    """Ten degrees left and five a second: two seconds; it does not matter that it is noisy."""
    outlook, noise = Outlook(PACKBOT), np.random.default_rng(3).normal(0.0, 0.002, 200)
    for k in range(200):
        left = math.radians(20.0 - 5.0 * k / 100) + float(noise[k])
        outlook.see(sample(k * SECOND // 100, left))
    (front,) = outlook.ahead(2 * SECOND)
    assert front.subject == 'front'
    assert front.seconds == pytest.approx(2.0, abs=0.2)
    assert front.rate == pytest.approx(math.radians(-5.0), rel=0.1)


def test_a_load_that_grows_is_told_with_its_time() -> None:
    """From 30 N m at 10 N m a second it takes two seconds to 50 N m."""
    outlook = Outlook(PACKBOT)
    for k in range(100):
        outlook.see(sample(k * SECOND // 100, 0.8, -20.0 - k / 10))
    (shoulder,) = outlook.ahead(SECOND)
    assert shoulder.subject == 'shoulder_joint'
    assert shoulder.seconds == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize('later', [0, 3 * SECOND])
def test_a_robot_that_rests_or_is_not_heard_has_nothing_ahead(later: int) -> None:
    """No rate, or no sample of the last second: nothing is said."""
    outlook = Outlook(PACKBOT)
    for k in range(100):
        left = 0.1 - 0.05 * k / 100 if later else 0.1
        outlook.see(sample(k * SECOND // 100, left))
    assert outlook.ahead(SECOND + later) == ()


@given(st.floats(0.0, 1.5), st.floats(-3.1, 3.1), st.floats(0.05, 2.0))
def test_the_robot_slides_where_the_slope_is_the_angle_of_friction(
    tilt: float, heading: float, friction: float
) -> None:
    """What is left is the friction angle less the slope, whatever way it faces."""
    x, y, z = gravity_on_slope(9.81, tilt, heading).tolist()
    assert slide_left((x, y, z), friction) == pytest.approx(math.atan(friction) - tilt, abs=1e-9)


def test_without_a_friction_nothing_slides() -> None:
    """Friction that is not known is not judged."""
    assert slide_left(LEVEL, math.inf) == math.inf


@given(st.floats(0.0, 6.0), st.floats(0.0, 6.0), st.floats(-0.8, 0.8))
def test_the_motors_tell_the_load(declared: float, carried: float, tilt: float) -> None:
    """Efforts of a load at rest give its mass, and whether it is another than the declared one."""
    q, down = (0.3, 0.4, -0.2, 0.0), gravity_on_slope(9.81, tilt, 1.0)
    effort = static_torque(PACKBOT.robot, q, down, Payload(carried))
    found = payload_estimate(PACKBOT, q, STILL, effort.tolist(), down.tolist(), Payload(declared))
    assert found is not None
    assert found.mass == pytest.approx(carried, abs=1e-6)
    if not 0.499 < abs(declared - carried) < 0.501:
        assert found.differs == (abs(declared - carried) > 0.5)


def test_the_motors_tell_nothing_of_a_load_while_they_move() -> None:
    """In motion, unknown, zero or turned round they say nothing; friction is no load."""
    q, ten, nan = (0.0, 0.4, -0.2, 0.0), (0.0, 90.0, 40.0, 0.0), (math.nan,) * 4
    moving = (0.0, 0.2, 0.0, 0.0)
    assert payload_estimate(PACKBOT, q, moving, ten, LEVEL, Payload(4.0)) is None
    assert payload_estimate(PACKBOT, q, STILL, nan, LEVEL, Payload(4.0)) is None
    assert payload_estimate(PACKBOT, q, STILL, (0.0,) * 4, LEVEL, Payload(4.0)) is None
    model = static_torque(PACKBOT.robot, q, LEVEL, Payload(4.0))
    assert payload_estimate(PACKBOT, q, STILL, (-model).tolist(), LEVEL, Payload(4.0)) is None
    stuck = (model + np.array((0.0, 10.0, -10.0, 0.0))).tolist()
    assert payload_estimate(PACKBOT, q, STILL, stuck, LEVEL, Payload(4.0)) is None
