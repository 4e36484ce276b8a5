"""Kinds of good runs: nothing is wrong that matters, so nothing but PASS may come."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
from error_rate.draw import Draw, Made, calm
from error_rate.sensing import SHAKEN, made, within
from made.run import NS, Imu, Joints, Payloads
from made.scene import QUIET, Noise, sensed, told

WELL = 'all well'


def ordinary(draw: Draw) -> Made:
    """Ordinary work with sensors that work."""
    scene = calm(draw)
    return made(scene, [*sensed(scene, draw.rng)], WELL)


def lossy(draw: Draw) -> Made:
    """Messages get lost one by one."""
    scene, share = calm(draw), draw('loss')
    parts = [p.kept(draw.rng.random(len(p.log)) >= share) for p in sensed(scene, draw.rng)]
    return made(scene, [*parts], WELL)


def jittery(draw: Draw) -> Made:
    """Messages arrive late, each by another time, and so out of their order."""
    scene, most = calm(draw), draw('jitter_ms') * 1e-3

    def late(part: Joints | Imu) -> Joints | Imu:
        delay = (draw.rng.random(len(part.log)) * most * NS).astype(np.int64)
        return replace(part, log=part.log + delay)

    return made(scene, [late(part) for part in sensed(scene, draw.rng)], WELL)


def vibrating(draw: Draw) -> Made:
    """An engine or tracks shake the base all the time."""
    scene = calm(draw)
    noise = Noise(gyro=draw('gyro_radps'), force=draw('force_mps2'))
    return made(scene, [*sensed(scene, draw.rng, noise)], WELL)


def encoder_noise(draw: Draw) -> Made:
    """The encoders are coarse or noisy."""
    scene = calm(draw)
    joints, imu = sensed(scene, draw.rng, replace(QUIET, encoder=draw('noise_mrad') * 1e-3))
    if draw.pick('step') == 'coarse':
        step = math.radians(0.1)
        joints = replace(joints, position=np.round(joints.position / step) * step)
    return made(scene, [joints, imu], WELL)


def short_silence(draw: Draw) -> Made:
    """Now and then an input is silent for a fraction of half a second."""
    scene = calm(draw)
    joints, imu = sensed(scene, draw.rng)
    for start in np.arange(5.0, 55.0, 10.0).tolist():
        at, length = start + draw('start_s'), draw('silent_s')
        joints = joints.kept(~within(joints.log, at, length))
        imu = imu.kept(~within(imu.log, at + 3.0, length))
    return made(scene, [joints, imu], WELL)


def noise_free(draw: Draw) -> Made:
    """A simulator that knows no noise; the IMU of a robot at rest never varies."""
    scene = calm(draw)
    if draw.pick('rests') == 'yes':
        still = replace(scene, q=np.tile(scene.q[0], (len(scene.q), 1)))
        scene = replace(still, accel=scene.accel * 0.0, yaw=scene.yaw * 0.0)
    none = Noise(0.0, 0.0, 0.0, 0.0, 0.0)
    return made(scene, [*sensed(scene, draw.rng, none)], WELL)


def effort_meanings(draw: Draw) -> Made:
    """The effort is no torque, or there is none; that concerns no margin."""
    scene = calm(draw)
    joints, imu = sensed(scene, draw.rng)
    assert joints.effort is not None
    effort, word = joints.effort, draw.pick('effort')
    other = {
        'nan': effort * math.nan,
        'zero': effort * 0.0,
        'denormal': effort * 0.0 + 5e-324,
        'sign': -effort,
        'current': effort * draw('scale'),
        'percent': effort * 2.0 * draw('scale'),
        'constant': np.tile(effort[0], (len(effort), 1)),
        'without gravity': effort - scene.static_torque(),
        'none': None,
    }
    return made(scene, [replace(joints, effort=other[word]), imu], WELL)


def payload_prefixed(draw: Draw) -> Made:
    """The payload is told in the right frame below a prefix of tf."""
    scene = calm(draw)
    said = [
        replace(p, frame=f'{draw.pick("prefix")}{p.frame}') if isinstance(p, Payloads) else p
        for p in told(scene, scene.load.mass)
    ]
    return Made([*said, *sensed(scene, draw.rng)], WELL, scene.config)


def no_uncertainty(draw: Draw) -> Made:
    """The configuration says nothing of uncertainties, which must be told."""
    config = draw.config({'uncertainty': None})
    scene = calm(draw, config=config)
    return made(scene, [*sensed(scene, draw.rng)], WELL)


def no_imu(draw: Draw) -> Made:
    """The robot has no IMU, which the configuration says: it stands level."""
    config = draw.config({'topics.imu': None, 'imu.attitude': 'level'})
    scene = calm(draw)
    joints, _ = sensed(scene, draw.rng)
    return Made([*told(scene, scene.load.mass), joints], WELL, config)


def no_joint_states(draw: Draw) -> Made:
    """The robot tells no joints, which the configuration says; its posture is declared."""
    scene, names = calm(draw), draw.config().settings.robot.joint_names
    scene = replace(scene, q=np.tile(scene.q[0], (len(scene.q), 1)))
    held = dict(zip(names, scene.q[0].tolist(), strict=True))
    changes = {'topics.joint_states': None, 'joints': None, 'held': held}
    known = draw.subject.document.get('uncertainty', {})
    sure = {key: value for key, value in known.items() if not key.endswith('.offset_deg')}
    config = draw.config(changes | ({'uncertainty': sure} if sure else {}))
    _, imu = sensed(scene, draw.rng)
    return Made([*told(scene, scene.load.mass), imu], WELL, config)


def payload_configured(draw: Draw) -> Made:
    """The load is that of the configuration; no message tells another."""
    scene = calm(draw)
    config = draw.config({'payload.mass_kg': round(scene.load.mass, 6)})
    return Made([*sensed(scene, draw.rng)], WELL, config)


def odd_names(draw: Draw) -> Made:
    """Names change their order, foreign names come between, joints come in parts."""
    scene, word = calm(draw), draw.pick('names')
    joints, imu = sensed(scene, draw.rng)
    count = len(joints.names)
    if word == 'foreign':
        other = replace(joints, names=tuple(f'arm9_{n}' for n in joints.names))
        return made(scene, [joints, other, imu], WELL)
    if word == 'orders':
        turned = _columns(joints, [*range(1, count), 0])
        return made(
            scene, [joints.kept(slice(0, None, 2)), turned.kept(slice(1, None, 2)), imu], WELL
        )
    halves = [_columns(joints, list(range(a, b))) for a, b in pairwise((0, count // 2, count))]
    return made(scene, [*halves, imu], WELL)


def _columns(joints: Joints, which: list[int]) -> Joints:
    assert joints.velocity is not None
    assert joints.effort is not None
    return replace(
        joints,
        names=tuple(joints.names[k] for k in which),
        position=joints.position[:, which],
        velocity=joints.velocity[:, which],
        effort=joints.effort[:, which],
    )


def orientation_missing(draw: Draw) -> Made:
    """The IMU has no orientation and says so, or it tells nothing; the robot is well."""
    scene = calm(draw)
    joints, imu = sensed(scene, draw.rng)
    word = draw.pick('orientation')
    if word == 'covariance -1':
        return made(scene, [joints, replace(imu, covariances=(-1.0, 0.0, 0.0))], WELL)
    said = {'zero': 0.0, 'nan': math.nan}[word]
    return made(scene, [joints, replace(imu, orientation=imu.orientation * 0.0 + said)], WELL)


def shaken_drive(draw: Draw) -> Made:
    """The robot drives and turns on a shaking base."""
    scene = calm(draw)
    return made(scene, [*sensed(scene, draw.rng, SHAKEN)], WELL)
