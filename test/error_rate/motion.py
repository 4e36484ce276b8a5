"""Kinds of motion that go wrong with sensors that work: fast arms, brakes, turns, falls."""

import math
from dataclasses import replace

import numpy as np
from error_rate.draw import Draw, Made, calm, leaning, mass_for, reaching, window
from error_rate.sensing import SHAKEN, made, tipped
from made.scene import IMU_HZ, QUIET, Noise, Scene, level, sensed, travel
from made.truth import Load, Rocking, inertia_about, rocking

from ugv_acceptance.type_aliases import Floats

# Steps of the rocking's equation within a message of the IMU.
FINE = 20


def fast_swing(draw: Draw) -> Made:
    """The weak joint swings so fast that its motor needs more than its limit, at rest far less."""
    config, weak = draw.config(), draw.subject.weak
    assert weak is not None
    load, robot = Load(mass_for(draw, config, draw('calm_share'))), config.settings.robot
    still = level(draw.subject, config, draw.bounds['seconds'], load)
    name, limit = robot.joint_names[weak], config.settings.limits.torque[weak]
    inertia = float(inertia_about(robot, still.q[:1], name, load)[0])
    omega, share = 2.0 * math.pi * draw('hz'), draw('share')
    size = (share * limit) / (inertia * omega**2)
    if size > 1.2:
        msg = f'expected a swing below 1.2 rad, needs {size:.1f}'
        raise ValueError(msg)
    shape = window(still.joint_time, draw('start_s'), 1.0, draw('lasts_s'))
    q = still.q.copy()
    q[:, weak] += size * shape * np.sin(omega * still.joint_time)
    moved = replace(still, q=q)
    torque = moved.static_torque()
    second = np.gradient(np.gradient(q[:, weak], 0.02), 0.02)
    torque[:, weak] += inertia * second
    moved = replace(moved, torque=torque)
    joints, imu = sensed(moved, draw.rng)
    assert joints.velocity is not None
    velocity = {'told': joints.velocity, 'zero': joints.velocity * 0.0, 'none': None}
    joints = replace(joints, velocity=velocity[draw.pick('velocity')])
    if draw.pick('effort') == 'none':
        joints = replace(joints, effort=None)
    return made(moved, [joints, imu], tipped(moved))


def falls(draw: Draw) -> Made:
    """After good margins the robot leans over its tipping point; every sensor says so."""
    scene = calm(draw)
    shape = window(scene.imu_time, draw('start_s'), draw('rise_s'), draw('hold_s'))
    scene = leaning(draw, scene, shape, math.radians(draw('past_deg')))
    return made(scene, [*sensed(scene, draw.rng)], tipped(scene))


def overloads(draw: Draw) -> Made:
    """The arm reaches out too far with its load; every sensor says so."""
    config = draw.config()
    scene = calm(draw, Load(mass_for(draw, config, draw('share'))))
    scene = reaching(scene, window(scene.joint_time, draw('start_s'), 9.0, draw('hold_s')))
    return made(scene, [*sensed(scene, draw.rng)], tipped(scene))


def _still(draw: Draw) -> tuple[Scene, Rocking, Floats]:
    """Return a robot on level ground with its arm out a part of the way, and how it rocks."""
    config = draw.config()
    load = Load(mass_for(draw, config, draw('load_share')))
    out = draw('out') if draw.subject.arm else 0.0
    pose = np.array(draw.subject.calm) * (1.0 - out) + np.array(draw.subject.reach) * out
    ways = {'front': (1.0, 0.0), 'rear': (-1.0, 0.0), 'left': (0.0, 1.0), 'right': (0.0, -1.0)}
    x, y = ways[draw.pick('over')]
    if draw.subject.arm:
        pose[draw.subject.arm[0]] = math.atan2(y, x)
    brief = replace(level(draw.subject, config, 0.1, load), q=np.tile(pose, (5, 1)))
    low, high = travel(brief)
    if (pose < low).any() or (pose > high).any():
        msg = 'expected a pose within the ranges of the joints'
        raise ValueError(msg)
    if not brief.truth().good(draw.bounds['least_tip_deg'], draw.bounds['most_share']):
        msg = 'expected a pose that is well at rest'
        raise ValueError(msg)
    outward = np.array((x, y, 0.0))
    scene = level(draw.subject, config, draw.bounds['seconds'], load)
    scene = replace(scene, q=np.tile(pose, (len(scene.q), 1)))
    return scene, rocking(config.settings.robot, pose, outward, load), outward


def braked(draw: Draw, least: float, most: float) -> tuple[Scene, float]:
    """Return a run with a hard brake or turn that lifts the other end by `least` to `most` (m)."""
    scene, rocks, outward = _still(draw)
    start, lasts = draw('start_s'), draw('lasts_s')
    if 'lift_m' in draw.bounds:
        hard = _hard_for(rocks, lasts, draw('lift_m'))
    else:
        hard = 9.81 * rocks.inward / rocks.height * draw('of_balance')
    if hard > draw.bounds['most_mps2']:
        msg = f'expected a brake that tyres can give, needs {hard:.1f} m/s2'
        raise ValueError(msg)
    if hard * lasts > draw.bounds['most_mps']:
        msg = f'expected a brake from a speed such robots have, needs {hard * lasts:.1f} m/s'
        raise ValueError(msg)
    draw.drawn['mps2'] = round(hard, 2)
    step = 1.0 / (IMU_HZ * FINE)
    fine: Floats = np.arange(len(scene.roll) * FINE, dtype=np.float64) * step
    pull = _pulse(fine - start, lasts, hard)
    if outward[0]:  # the speed that is braked was gathered gently before
        pull -= 1.0 * ((fine > start - 1.0 - hard * lasts) & (fine < start - 1.0))
    angle, rate = _rocks(rocks, pull, slice(int(start / step), int((start + lasts + 4.0) / step)))
    lift = rocks.width * math.sin(float(angle.max()))
    if not least <= lift <= most:
        msg = f'expected a lift of {least} to {most} m, got {lift:.4f}'
        raise ValueError(msg)
    return _rocked(scene, outward, (pull, angle, rate)), lift


def _pulse(time: Floats, lasts: float, hard: float) -> Floats:
    """Return a deceleration (m/s2) that comes and goes within 50 ms, from time 0 on (s)."""
    return hard * np.clip(np.minimum(time, lasts - time) / 0.05, 0.0, 1.0)


def _hard_for(rocks: Rocking, lasts: float, lift: float) -> float:
    """Return the deceleration (m/s2) that lifts the other end by so much (m)."""
    low = 9.81 * rocks.inward / rocks.height
    high = 4.0 * low
    time: Floats = np.arange(round((lasts + 1.0) * 500), dtype=np.float64) * 2e-3
    for _ in range(14):
        hard = (low + high) / 2.0
        angle, _ = rocks.turned(_pulse(time, lasts, hard), 2e-3)
        low, high = (hard, high) if rocks.width * math.sin(angle.max()) < lift else (low, hard)
    return low


def _rocks(rocks: Rocking, pull: Floats, rows: slice) -> tuple[Floats, Floats]:
    """Return angle and rate on the fine grid: it rocks within `rows`, and then lies or stands."""
    angle, rate = np.zeros_like(pull), np.zeros_like(pull)
    angle[rows], rate[rows] = rocks.turned(pull[rows], 1.0 / (IMU_HZ * FINE))
    last = angle[rows][-1]
    if 0.0 < last < math.pi / 2.0:
        msg = 'expected a robot that stands again or lies, still rocks'
        raise ValueError(msg)
    angle[rows.stop :] = last
    return angle, rate


def _rocked(scene: Scene, outward: Floats, moved: tuple[Floats, Floats, Floats]) -> Scene:
    """Return the scene with what the IMU feels of pull, angle and rate (on the fine grid)."""
    pull, angle, rate = moved
    robot = scene.config.settings.robot
    corners = np.array([c.position for c in robot.contacts if abs(c.position[2]) < 1.0])
    edge = outward * float((corners @ outward).max()) + np.array((0.0, 0.0, robot.ground))
    sensor = np.array(scene.subject.imu_position) - edge
    inward, height = float(-sensor @ outward), float(sensor[2])
    step = 1.0 / (IMU_HZ * FINE)
    turned = np.gradient(rate, step)
    cos, sin = np.cos(angle), np.sin(angle)
    along, rise = inward * cos - height * sin, inward * sin + height * cos
    away = turned * rise + rate**2 * along - pull  # along `outward`, in the world
    lifted = turned * along - rate**2 * rise
    felt_out, felt_up = away * cos - lifted * sin, away * sin + lifted * cos
    mean = [part.reshape(-1, FINE).mean(1) for part in (felt_out, felt_up)]
    accel = mean[0][:, None] * outward + mean[1][:, None] * np.array((0.0, 0.0, 1.0))
    now = angle.reshape(-1, FINE)[:, -1]
    x, y, _ = outward.tolist()
    return replace(scene, accel=scene.accel + accel, roll=-now * y, pitch=now * x)


def brake_lifts(draw: Draw) -> Made:
    """A brake or a turn raises one end of the chassis by 20 mm or more; it comes back."""
    scene, lift = braked(draw, 0.02, 0.15)
    noise = SHAKEN if draw.pick('shaken') == 'yes' else QUIET
    return made(scene, [*sensed(scene, draw.rng, replace(noise, gyro=0.01))], f'lift {lift:.3f} m')


def brake_tips(draw: Draw) -> Made:
    """A brake or a turn tips the robot over for good."""
    scene, _ = braked(draw, 0.2, 2.0)
    return made(scene, [*sensed(scene, draw.rng, replace(QUIET, gyro=0.01))], 'tips over')


def brake_holds(draw: Draw) -> Made:
    """Brakes and turns at which nothing lifts."""
    scene, _ = braked(draw, 0.0, 0.0)
    return made(scene, [*sensed(scene, draw.rng, Noise(gyro=0.01, force=0.15))], 'nothing lifts')
