"""Pulling and lifting: at the largest force the named bound is just reached."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from robots import tracked

from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import stability
from ugv_acceptance.model.statics import gripper_point, payload_capacity, static_torque
from ugv_acceptance.studies.capacity import (
    CAUSES,
    NOTHING,
    SATURATION,
    SLIP,
    TIP,
    lift_capacity,
    pull_capacity,
)

ROBOT = tracked()
LIMITS = np.array([np.inf, 60.0, 50.0, np.inf])
DOWN = np.array([0.0, 0.0, -9.81])
EMPTY = Payload(0.0, ROBOT.payload.cog)
postures = st.tuples(
    st.floats(-3.0, 3.0), st.floats(0.0, 3.0), st.floats(-3.0, 3.0), st.sampled_from([3.1, 0.5])
)


@given(q=postures)
def test_the_largest_payload_just_tips_or_saturates(q: tuple[float, ...]) -> None:
    """With that payload the named margin is zero and the other is not negative."""
    mass, cause = lift_capacity(ROBOT, q, DOWN, LIMITS)
    assume(0.0 < mass < 200.0)
    load = Payload(float(mass), ROBOT.payload.cog)
    torque = np.abs(static_torque(ROBOT, q, DOWN, load))
    angle = min(float(a) for a in stability(ROBOT, q, DOWN, load).angle)
    left = float((LIMITS - torque).min())
    assert (left if cause == SATURATION else angle) == pytest.approx(0.0, abs=1e-9)
    assert left >= -1e-9
    assert angle >= -1e-9


@given(q=postures)
def test_without_tipping_it_is_the_payload_capacity(q: tuple[float, ...]) -> None:
    """Where a joint ends the lift, the payload is that of payload_capacity."""
    mass, cause = lift_capacity(ROBOT, q, DOWN, LIMITS)
    assume(cause == SATURATION and mass > 0.0)
    assert mass == pytest.approx(payload_capacity(ROBOT, q, DOWN, LIMITS))


@given(q=postures, heading=st.floats(0.0, 6.3))
def test_a_pull_that_saturates_is_the_torque_of_a_sideways_load(
    q: tuple[float, ...], heading: float
) -> None:
    """A force at the load is a second gravity that acts on the load alone: its torque adds up."""
    d = np.array([math.cos(heading), math.sin(heading), 0.0])
    found = pull_capacity(ROBOT, q, DOWN, d, LIMITS, payload=EMPTY)
    force = float(found.bounds[SATURATION])
    assume(0.0 < force < 1e4)
    unit = static_torque(ROBOT, q, d, Payload(1.0, ROBOT.payload.cog)) - static_torque(
        ROBOT, q, d, EMPTY
    )
    torque = static_torque(ROBOT, q, DOWN, EMPTY) + force * unit
    assert (np.abs(torque) / LIMITS).max() == pytest.approx(1.0)


def test_a_hitch_pull_tips_about_the_rear_edge() -> None:
    """By hand: weight times its distance from the rear edge over the hitch's height."""
    q = (0.0, math.pi / 2.0, 0.0, math.pi)  # the arm upright
    found = pull_capacity(
        ROBOT, q, DOWN, (-1.0, 0.0, 0.0), LIMITS, hitch=(-0.3, 0.0, 0.5), payload=EMPTY
    )
    mass = sum(link.mass for link in ROBOT.links)
    moments = [(24.0, 0.02), (1.5, 0.0), (2.5, 0.0), (2.5, 0.0), (2.0, 0.239 - 0.1)]
    centre = sum(m * x for m, x in moments) / mass
    assert found.force == pytest.approx(mass * 9.81 * (centre + 0.26) / 0.5)
    assert CAUSES[int(found.cause)] == 'tip'


def test_a_level_pull_slips_at_friction_times_weight() -> None:
    """On level ground a horizontal pull is held by mu times the weight."""
    q = (0.0, math.pi / 2.0, 0.0, math.pi)
    found = pull_capacity(ROBOT, q, DOWN, (0.0, -1.0, 0.0), LIMITS, 0.4, (0.0, 0.0, 0.02), EMPTY)
    mass = sum(link.mass for link in ROBOT.links)
    assert found.force == pytest.approx(0.4 * mass * 9.81)
    assert found.cause == SLIP


@given(slope=st.floats(-0.5, 0.5), mu=st.floats(0.1, 1.2), lift=st.floats(-0.9, 0.9))
def test_at_slip_the_force_lies_on_the_friction_cone(slope: float, mu: float, lift: float) -> None:
    """On a slope and for a slanting pull: tangential force is mu times the normal force."""
    g = 9.81 * np.array([math.sin(slope), 0.0, -math.cos(slope)])
    d = np.array([math.cos(lift), 0.0, math.sin(lift)])
    q = (0.0, math.pi / 2.0, 0.0, math.pi)
    found = pull_capacity(ROBOT, q, g, d, LIMITS, mu, (0.0, 0.0, 0.02), EMPTY)
    force = float(found.bounds[SLIP])
    mass = sum(link.mass for link in ROBOT.links)
    assume(abs(math.tan(slope)) < mu and math.isfinite(force))
    total = mass * g + force * d
    assert math.hypot(total[0], total[1]) == pytest.approx(mu * -total[2], abs=1e-6)


def test_a_robot_that_slides_already_pulls_nothing() -> None:
    """On a slope steeper than the friction allows, no pull is left."""
    g = 9.81 * np.array([math.sin(0.5), 0.0, -math.cos(0.5)])
    q = (0.0, math.pi / 2.0, 0.0, math.pi)
    found = pull_capacity(ROBOT, q, g, (1.0, 0.0, 0.0), LIMITS, 0.3, (0.0, 0.0, 0.02), EMPTY)
    assert found.bounds[SLIP] == 0.0


def test_an_upward_pull_along_no_lever_has_no_end() -> None:
    """A force that presses the robot down through its middle never tips it."""
    q = (0.0, math.pi / 2.0, 0.0, math.pi)
    found = pull_capacity(
        ROBOT, q, DOWN, (0.0, 0.0, -1.0), LIMITS, hitch=(0.0, 0.0, 0.2), payload=EMPTY
    )
    assert found.cause == NOTHING
    assert found.force == np.inf


def test_a_robot_that_tips_already_pulls_nothing() -> None:
    """Past the tipping slope every pull is zero, because of tipping."""
    g = 9.81 * np.array([0.0, -math.sin(1.2), -math.cos(1.2)])
    q = (0.0, math.pi / 2.0, 0.0, math.pi)
    found = pull_capacity(
        ROBOT, q, g, (1.0, 0.0, 0.0), LIMITS, hitch=(0.0, 0.0, 0.1), payload=EMPTY
    )
    assert found.bounds[TIP] == 0.0


def test_the_gripper_is_where_the_arm_ends() -> None:
    """Stretched forward: turret, shoulder, both links and the payload's own offset."""
    x, y, z = gripper_point(ROBOT, (0.0, 0.0, 0.0, 0.0))
    assert (x, y, z) == pytest.approx((0.55 + 0.64 + 0.05, 0.01, 0.25 - 0.02))
