"""The oracle of the made recordings: it agrees with closed forms and with a slower one."""

import math

import numpy as np
import pytest
from made.truth import G, Load, Rocking, rocking, tilts_left, torques
from robots import centre, masses, tracked

from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Payload

UP = np.array((0.0, 0.0, 1.0))


def test_torque_is_the_slope_of_the_potential_energy() -> None:
    """The torque at rest is how much potential energy a turn of the joint costs."""
    robot, q, step = tracked(), np.array((0.4, 0.7, -1.1, 2.0)), 1e-6
    payload = Payload(2.5, (0.05, 0.01, -0.02))
    up = np.array((0.1, -0.2, math.sqrt(0.95)))

    def energy(pose: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
        mass, place = masses(robot, pose.tolist(), payload)
        return float(G * mass @ (place @ up))

    slopes = [(energy(q + step * e) - energy(q - step * e)) / (2.0 * step) for e in np.eye(4)]
    found = torques(robot, q[None], up, Load(2.5, payload.cog))[0]
    assert found == pytest.approx(slopes, abs=1e-6)


def test_tilt_left_is_where_the_centre_of_gravity_leaves_the_polygon() -> None:
    """Tilted by the tilt left to its front edge, a robot's weight acts exactly on that edge."""
    robot = load().settings.robot
    q = np.array(((0.3, 0.8, -1.9, math.pi),))
    left, outward = tilts_left(robot, q, UP, Load(1.0))
    front = int(np.argmax(outward @ np.array((1.0, 0.0, 0.0))))
    _, c = centre(robot, q[0].tolist(), Payload(1.0))
    assert math.tan(left[0, front]) == pytest.approx((0.25 - c[0]) / c[2])


def test_a_robot_rocks_once_braking_outweighs_its_weight() -> None:
    """Braking lifts the rear where its moment about the edge outweighs that of the weight."""
    rests = Rocking(0.2, 0.1, 20.0, 2.0, 0.5)
    below = rests.turned(np.full(2000, 0.999 * 2.0 * G), 1e-3)[0]
    above = rests.turned(np.full(2000, 1.001 * 2.0 * G), 1e-3)[0]
    assert below.max() == 0.0 < above.max()


def test_a_small_rock_lasts_as_the_closed_form_says() -> None:
    """Pulled hard for a moment, the rear rises as the linear equation of a pendulum says."""
    rests = Rocking(0.2, 0.1, 20.0, 2.0, 0.5)
    angle, rate = rests.turned(np.full(500, 30.0), 1e-4)
    pull = 20.0 * (30.0 * 0.1 - G * 0.2) / 2.0
    k = math.sqrt(20.0 * (30.0 * 0.2 + G * 0.1) / 2.0)
    assert rate[-1] == pytest.approx(pull / k * math.sinh(k * 0.05), rel=0.01)
    assert angle[-1] == pytest.approx(pull / k**2 * (math.cosh(k * 0.05) - 1.0), rel=0.01)


def test_the_rocking_of_a_robot_is_that_of_its_masses() -> None:
    """Where the centre of gravity is from the front edge follows from masses and places alone."""
    robot, q = load().settings.robot, np.array((0.0, 1.0, -2.0, math.pi))
    found = rocking(robot, q, np.array((1.0, 0.0, 0.0)), Load(2.0))
    mass, c = centre(robot, q.tolist(), Payload(2.0))
    assert (found.mass, found.inward, found.height) == pytest.approx((mass, 0.25 - c[0], c[2]))
    assert found.width == pytest.approx(0.5)
    assert found.inertia > mass * (found.inward**2 + found.height**2)
