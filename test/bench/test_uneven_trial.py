"""The scenes of uneven ground: the robot tips where a closed form says, and margins are true."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bench.bench_uneven import alerts
from bench.uneven_scenes import BUILD, Belts, drive_step, scene, touching, tracked
from bench.uneven_trial import true_margin
from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import margins
from ugv_acceptance.simulation.engine import mujoco
from ugv_acceptance.simulation.shape import Block

ROBOT = replace(load().settings.robot, payload=Payload(2.0))
FOLDED = {'turret_joint': 0.0, 'shoulder_joint': 2.0, 'elbow_joint': -2.4, 'flipper_joint': math.pi}
POSTURE = [FOLDED[name] for name in ROBOT.joint_names]
DOWN = np.array([0.0, 0.0, -1.0])


def test_a_robot_driven_slowly_over_an_edge_tips_when_its_plumb_line_passes_it() -> None:
    """When the body has pitched by 0.5 deg its centre of gravity is within 15 mm of the edge."""
    high = replace(scene('drop', 0), blocks=(Block((-1.5, 0.0, 0.0), (1.5, 2.0, 0.4)),))
    vehicle = tracked(ROBOT, high)
    data, belts = mujoco.MjData(vehicle.model), Belts.of(vehicle.model)
    data.qpos[vehicle.position] = data.ctrl[vehicle.motor] = POSTURE
    data.qpos[0], data.qpos[2] = -0.12, 0.401
    for k in range(round(8.0 / BUILD.timestep)):
        drive_step(vehicle, data, belts, (0.03 if k > 200 else 0.0, 0.0))
        if data.xmat[vehicle.root][6] < -math.sin(math.radians(0.5)):
            break
    assert data.subtree_com[vehicle.root][0] == pytest.approx(0.0, abs=0.015)
    assert k > 400


def test_on_flat_ground_the_true_margin_is_the_one_shown() -> None:
    """At rest on a slope of 12 deg the hull of the real contacts gives the model's margin."""
    vehicle = tracked(ROBOT, scene('flat', 0))
    data, belts = mujoco.MjData(vehicle.model), Belts.of(vehicle.model)
    tilt = math.radians(12.0)
    gravity = ROBOT.gravity * np.array([0.3 * math.sin(tilt), math.sin(tilt), -math.cos(tilt)])
    vehicle.model.opt.gravity[:] = gravity
    data.qpos[vehicle.position] = data.ctrl[vehicle.motor] = POSTURE
    for _ in range(round(0.8 / BUILD.timestep)):
        drive_step(vehicle, data, belts, (0.0, 0.0))
    attitude = data.xmat[vehicle.root].reshape(3, 3)
    q = data.qpos[vehicle.position]
    shown = margins(ROBOT, q, attitude.T @ gravity).angle.min()
    true = true_margin(
        touching(data), data.subtree_com[vehicle.root], gravity / np.linalg.norm(gravity)
    )
    assert math.degrees(true) == pytest.approx(math.degrees(shown), abs=0.6)


def test_the_true_margin_of_a_square_is_its_closed_form() -> None:
    """Half a metre above a square of 0.4 m the least tilt is atan(0.2 / 0.5); beside it, negative.

    About two points alone nothing is left: the robot already turns.
    """
    square = np.array([[x, y, 0.0] for x in (-0.2, 0.2) for y in (-0.2, 0.2)])
    assert true_margin(square, np.array([0.0, 0.0, 0.5]), DOWN) == pytest.approx(
        math.atan2(0.2, 0.5)
    )
    assert true_margin(square, np.array([0.3, 0.0, 0.5]), DOWN) == pytest.approx(
        -math.atan2(0.1, 0.5)
    )
    line = true_margin(square[:2], np.array([0.0, 0.0, 0.5]), DOWN)
    assert line == pytest.approx(-math.atan2(0.2, 0.5))
    assert math.isnan(true_margin(square[:0], np.zeros(3), DOWN))


def test_an_alert_is_raised_after_its_delay_and_ends_after_its_other() -> None:
    """One look alone raises nothing; what lasts is one alert until it is gone for a second."""
    at = np.linspace(0.0, 4.95, 100)
    on = np.zeros(100, bool)
    on[5] = on[20:30] = on[35:40] = True
    ((start, end),) = alerts(at, on)
    assert (start, end) == pytest.approx((1.1, 2.95))
