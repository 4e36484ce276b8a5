"""Kinds of faults about what is carried and what motors give: payloads, efforts, encoders."""

import math
from dataclasses import replace

import numpy as np
from error_rate.draw import Draw, Made, calm, least_loaded, mass_for, reaching, window
from error_rate.sensing import made, tipped, within
from made.run import Payloads
from made.scene import TRUTH_HZ, Scene, ns, sensed, told
from made.truth import Load

from ugv_acceptance.config import Config

# The configuration carries nothing of its own, so that the messages alone say what is carried.
EMPTY = {'payload.mass_kg': 0.0}


def _overreach(draw: Draw, config: Config, mass: float) -> Scene:
    """Return a run in which the arm stretches out for a while with this load (kg)."""
    start, hold = draw('start_s'), draw('hold_s')
    scene = calm(draw, Load(mass), config)
    pose = np.array(draw.subject.reach)
    goes = float(np.abs(pose - np.array(draw.subject.calm)).max())
    rise = goes * math.pi / 2.0 / math.radians(draw('reach_degps'))
    return reaching(scene, window(scene.joint_time, start, rise, hold))


def payload_unknown(draw: Draw) -> Made:
    """The load is told in an unknown frame, or as no number; it is too heavy for the arm."""
    config = draw.config(EMPTY)
    scene = _overreach(draw, config, mass_for(draw, config, draw('share')))
    joints, imu = sensed(scene, draw.rng)
    (said,) = told(scene, scene.load.mass)
    assert isinstance(said, Payloads)
    word = draw.pick('told')
    if word == 'frame':
        said = replace(said, frame='hand_of_another_robot')
    elif word == 'place nan':
        said = replace(said, com=said.com * math.nan)
    else:
        said = replace(said, mass=said.mass * (math.nan if word == 'nan' else -1.0))
    silent = replace(joints, effort=None)
    return Made([said, silent, imu], tipped(scene), config)


def payload_link_wrong(draw: Draw) -> Made:
    """The configuration lets a link carry that cannot; the true load is too heavy for the arm."""
    true = draw.config(EMPTY)
    scene = _overreach(draw, true, mass_for(draw, true, draw('share')))
    joints, imu = sensed(scene, draw.rng)
    config = draw.config(EMPTY | {'payload.link': true.settings.robot.root})
    parts = [*told(scene, scene.load.mass), replace(joints, effort=None), imu]
    return Made(parts, tipped(scene), config)


def effort_saturated(draw: Draw) -> Made:
    """The motor gives more than its limit for a while, by its own measurement; the rest is well."""
    scene, start, length = calm(draw), draw('start_s'), draw('lasts_s')
    joints, imu = sensed(scene, draw.rng)
    limit, weak = scene.config.settings.limits.torque, scene.subject.weak
    assert weak is not None
    assert joints.effort is not None
    effort = joints.effort.copy()
    rows = within(joints.log, start, length)
    effort[rows, weak] = np.sign(effort[rows, weak]) * draw('share') * limit[weak]
    return made(scene, [replace(joints, effort=effort), imu], 'measured torque above its limit')


def encoder_stuck(draw: Draw) -> Made:
    """The encoder of the weak joint stops while the arm goes on to reach out too far."""
    config = draw.config()
    scene = calm(draw, Load(mass_for(draw, config, draw('share'))), config)
    start, weak = draw('start_s'), scene.subject.weak
    assert weak is not None
    pose = least_loaded(scene)
    swung = abs(pose[weak] - scene.subject.reach[weak])
    rise = swung * math.pi / 2.0 / math.radians(draw('reach_degps'))
    scene = replace(scene, q=np.tile(pose, (len(scene.q), 1)))
    scene = reaching(scene, window(scene.joint_time, start, rise, draw('hold_s')))
    joints, imu = sensed(scene, draw.rng)
    assert joints.velocity is not None
    position, velocity = joints.position.copy(), joints.velocity.copy()
    rows = joints.log >= ns(np.array([start - 0.5]))[0]
    noise = draw('noise_mrad') * 1e-3 * draw.rng.normal(size=int(rows.sum()))
    position[rows, weak] = pose[weak] + noise
    velocity[rows, weak] = 0.0
    stuck = replace(joints, position=position, velocity=velocity)
    return made(scene, [stuck, imu], tipped(scene))


def payload_heavier(draw: Draw) -> Made:
    """More is carried than told: the arm is overloaded, and only the effort shows it."""
    config = draw.config()
    scene = _overreach(draw, config, mass_for(draw, config, draw('share')))
    said = mass_for(draw, config, draw('told_share'))
    return Made([*told(scene, said), *sensed(scene, draw.rng)], tipped(scene), config)


def payload_told_late(draw: Draw) -> Made:
    """What is carried all the time is told only after the arm reached out too far with it."""
    config = draw.config(EMPTY)
    scene = _overreach(draw, config, mass_for(draw, config, draw('share')))
    joints, imu = sensed(scene, draw.rng)
    truth = scene.truth()
    bad = np.flatnonzero((truth.tip < 0.0) | (truth.share.max(1) > 1.0))
    back = float(bad.max(initial=0)) / TRUTH_HZ
    start = min(back + draw('later_s'), float(scene.joint_time[-1]) - 1.0)
    if start <= back:
        msg = f'expected an arm that is back before the end, is out until {back:.1f} s'
        raise ValueError(msg)
    late = told(scene, scene.load.mass, start)
    return Made([*late, replace(joints, effort=None), imu], tipped(scene), config)


def payload_first(draw: Draw) -> Made:
    """The configuration's heavy load counts until the first message, and only for a moment."""
    scene = calm(draw, Load(mass_for(draw, draw.config(), draw('told_share'))))
    shape = 1.0 - window(scene.joint_time, draw('hold_s'), 8.0, 1e3)
    scene = reaching(scene, shape)
    joints, imu = sensed(scene, draw.rng)
    truth = scene.truth()
    if not truth.good(12.0, 0.85):
        msg = f'expected a run that is well, {truth.tip.min():.1f} deg, {truth.share.max():.0%}'
        raise ValueError(msg)
    said = told(scene, scene.load.mass, draw('after_s'))
    return Made([*said, joints, imu], 'all well', scene.config)
