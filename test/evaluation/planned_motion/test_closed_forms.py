"""The margins of a planned motion against closed forms of one joint, and against Pinocchio."""

import math

import numpy as np
import pinocchio as pin
import pytest
from evaluation.planned_motion.motions import (
    BASE,
    HALF,
    HIGH,
    LONG,
    MASS,
    level,
    one_joint,
    settings_of,
    way,
)
from robots import tracked

from ugv_acceptance.evaluation.planned_motion import REFUSED, check_motion
from ugv_acceptance.evaluation.planned_motion.path import Knots, path_of, samples_of
from ugv_acceptance.evaluation.planned_motion.request import CORNER
from ugv_acceptance.model.mechanics import mechanics_of
from ugv_acceptance.model.moving_arm import moving
from ugv_acceptance.model.robot import Payload

G = 9.81


def test_a_slow_motion_needs_what_the_arm_weighs_at_its_level_place() -> None:
    """M g l where the arm is level, on a way whose ends are above and below it."""
    found = check_motion(settings_of(one_joint()), way([-0.4], [60.0]), level(0.5))
    assert found.joint is not None
    assert found.joint.torque == pytest.approx(MASS * G * LONG, rel=2e-3)
    assert found.joint.time == pytest.approx(60.0 * 0.5 / 0.9, abs=2.5)


@pytest.mark.parametrize('up', [1.0, -1.0])
def test_an_acceleration_costs_its_inertia(up: float) -> None:
    """A cubic from rest to rest begins with 6 way / time^2: torque m g l cos q + m l^2 a."""
    start, change, time = 0.3, 0.3 * up, 0.5
    given = way([start + change], [time], [0.0])
    found = check_motion(settings_of(one_joint()), given, level(start))
    first = MASS * LONG * (G * math.cos(start) + LONG * 6.0 * change / time**2)
    last = MASS * LONG * (G * math.cos(start + change) - LONG * 6.0 * change / time**2)
    assert found.joint is not None
    assert found.joint.torque == pytest.approx(max(abs(first), abs(last)), rel=1e-9)


def test_a_change_of_rate_at_once_is_spread_over_the_time_of_a_drive() -> None:
    """Straight points: the start costs m l^2 rate / CORNER more than the arm's weight."""
    start, rate = 0.3, 0.2
    found = check_motion(settings_of(one_joint()), way([start + rate], [1.0]), level(start))
    needs = MASS * LONG * (G * math.cos(start) + LONG * rate / CORNER)
    assert found.joint is not None
    assert found.joint.torque == pytest.approx(needs, rel=1e-6)
    assert found.joint.time == 0.0


def test_points_so_close_that_they_are_a_curve_cost_its_acceleration() -> None:
    """0.01 s apart without velocities: as the curve itself, not its corners one by one."""
    times = np.arange(1, 201) * 0.01
    turn = np.pi * times / 2.0
    given = way((0.3 + 0.4 * (1.0 - np.cos(turn))).tolist(), times.tolist())
    found = check_motion(settings_of(one_joint()), given, level(0.3))
    curve = 0.4 * (np.pi / 2.0) ** 2
    needs = MASS * LONG * (G * math.cos(0.3) + LONG * curve)
    assert found.joint is not None
    assert found.joint.torque == pytest.approx(needs, rel=0.02)


def test_the_reaction_of_the_arm_tips_as_its_moment_says() -> None:
    """Under acceleration the tilt left to the rear is that of weight and reaction together."""
    start, change, time, rate = math.pi / 2.0, -0.5, 0.4, -1.0
    given = way([start + change, start - 0.9], [time, 3.0], [rate, 0.0])
    found = check_motion(settings_of(one_joint()), given, level(start))
    # The arm stands upright and is pushed ahead: it pushes back with m l a, at the height it has.
    first = 6.0 * change / time**2 - 2.0 * rate / time
    push, weight = MASS * LONG * abs(first), (BASE + MASS) * G
    high = (BASE * 0.2 + MASS * (HIGH + LONG)) / (BASE + MASS)
    shift = push * (HIGH + LONG - high) / weight
    left = math.atan2(HALF - shift, high) - math.atan2(push, weight)
    assert found.tilt is not None
    assert (found.tilt.side, found.tilt.time) == ('rear', 0.0)
    assert found.tilt.angle == pytest.approx(left, abs=1e-9)


def test_a_motion_that_stops_hard_tips_and_is_refused() -> None:
    """Straight to its last point and stopped within CORNER: the arm pulls the robot over."""
    given = way([1.0], [0.25])
    found = check_motion(settings_of(one_joint(), torque=1e6), given, level(2.0))
    assert found.verdict == REFUSED
    assert any('past tipping' in reason for reason in found.reasons)
    slow = check_motion(settings_of(one_joint(), torque=1e6), way([1.0], [5.0]), level(2.0))
    assert slow.verdict == 'PERMITTED'


def _free(robot: object) -> tuple[pin.Model, pin.Data]:
    """Return the tracked robot on a free base in Pinocchio, from the same numbers."""
    model = pin.Model()
    names = {'base_link': model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), 'free')}
    places = {'base_link': pin.SE3.Identity()}
    links = {link.name: link for link in robot.links}  # type: ignore[attr-defined]
    for joint in robot.joints:  # type: ignore[attr-defined]
        at = places[joint.parent] * pin.SE3(np.array(joint.rotation), np.array(joint.xyz))
        if joint.kind == 'fixed':
            names[joint.child], places[joint.child] = names[joint.parent], at
            continue
        kind = pin.JointModelRevoluteUnaligned(np.array(joint.axis))
        names[joint.child] = model.addJoint(names[joint.parent], kind, at, joint.name)
        places[joint.child] = pin.SE3.Identity()
    for name, link in links.items():
        inertia = pin.Inertia(link.mass, np.array(link.cog), np.array(link.inertia))
        if link.mass:
            model.appendBodyToJoint(names[name], inertia, places[name])
    return model, model.createData()


@pytest.mark.parametrize('seed', range(5))
def test_torques_and_what_the_ground_holds_are_pinocchios(seed: int) -> None:
    """Newton-Euler of a base that stands still: joint torques, and force and moment on the base."""
    rng, robot = np.random.default_rng(seed), tracked()
    model, data = _free(robot)
    order = [model.getJointId(name) for name in robot.joint_names]
    q, v, a = (rng.normal(size=len(order)) for _ in range(3))
    down = np.array([1.0, -2.0, -9.3])
    model.gravity.linear = down
    full, rate, more = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
    for k, joint in enumerate(order):
        full[model.joints[joint].idx_q] = q[k]
        rate[model.joints[joint].idx_v], more[model.joints[joint].idx_v] = v[k], a[k]
    tau = pin.rnea(model, data, full, rate, more)
    found = moving(mechanics_of(robot), (q.tolist(), v.tolist(), a.tolist()), tuple(down.tolist()),
                   Payload(0.0, (0.0, 0.0, 0.0)))  # fmt: skip
    assert found.torque == pytest.approx([tau[model.joints[j].idx_v] for j in order], abs=1e-9)
    mass, cog = found.posture.mass, np.array(found.posture.cog)
    force = -np.array(found.gravity) * mass
    assert force == pytest.approx(tau[:3], abs=1e-9)
    # The same moment about both axes along the ground; that about the upright one is left out.
    assert np.cross(cog, force)[:2] == pytest.approx(tau[3:5], abs=1e-9)


@pytest.mark.parametrize('kind', ['linear', 'cubic', 'quintic'])
def test_the_way_passes_its_points_as_they_say(kind: str) -> None:
    """Positions always; rates and accelerations where both points of a way have them."""
    rng = np.random.default_rng(3)
    time, none = np.array([0.0, 0.7, 1.0, 2.5]), np.full((4, 2), np.nan)
    q, v, a = (rng.normal(size=(4, 2)) for _ in range(3))
    knots = Knots(time, q, none if kind == 'linear' else v, a if kind == 'quintic' else none)
    seen = samples_of(path_of(knots), np.full(3, 20))
    for k in range(3):
        inside = np.flatnonzero((seen.point == k + 2) & (seen.time > time[k]))
        last = inside[np.isclose(seen.time[inside], time[k + 1])][0]
        assert seen.position[last] == pytest.approx(q[k + 1])
        if kind != 'linear':
            assert seen.rate[last] == pytest.approx(v[k + 1])
        if kind == 'quintic':
            assert seen.acceleration[last] == pytest.approx(a[k + 1])
