"""Kinds of faults in what sensors send: silence, repeats, units, contradictions, mountings."""

import math
from dataclasses import replace

import numpy as np
from error_rate.draw import Draw, Made, calm, leaning, mass_for, reaching, window
from made.run import EPOCH, NS, Imu, Joints, Part
from made.scene import Noise, Scene, sensed, told
from made.truth import G, Load
from scipy.spatial.transform import Rotation

from ugv_acceptance.type_aliases import Floats, Times

SHAKEN = Noise(gyro=0.15, force=1.0)


def made(scene: Scene, parts: list[Part], truth: str) -> Made:
    """Return a run with the payload told from its beginning."""
    return Made([*told(scene, scene.load.mass), *parts], truth, scene.config)


def tipped(scene: Scene) -> str:
    """Return in words how far the robot really went; ValueError if it kept its limit."""
    truth = scene.truth()
    least, most = float(truth.tip.min()), float(truth.share.max())
    if least > 0.0 and most < 1.0:
        msg = f'expected a run that goes wrong, kept {least:.1f} deg and {most:.0%}'
        raise ValueError(msg)
    return f'{least:.1f} deg of tilt left, {most:.0%} of a torque limit'


def within(
    time: Times, start: float, length: float
) -> 'np.ndarray[tuple[int], np.dtype[np.bool_]]':
    """Return which log times (ns) are within so many seconds from `start` (s) on."""
    found = (time - EPOCH >= start * NS) & (time - EPOCH < (start + length) * NS)
    return np.asarray(found)


def _blind_lean(draw: Draw) -> tuple[Scene, float, float]:
    """Return a robot that leans over its tipping point and back within a window (start, s)."""
    start, length = draw('start_s'), draw('blind_s')
    scene = calm(draw)
    shape = window(scene.imu_time, start + 0.05, length / 4.0, length / 2.0 - 0.1)
    return leaning(draw, scene, shape, math.radians(draw('past_deg'))), start, length


def _blind_reach(draw: Draw) -> tuple[Scene, float, float]:
    start, length = draw('start_s'), draw('blind_s')
    config = draw.config()
    scene = calm(draw, Load(mass_for(draw, config, draw('share'))))
    shape = window(scene.joint_time, start + 0.05, length / 4.0, length / 2.0 - 0.1)
    return reaching(scene, shape), start, length


def imu_silent(draw: Draw) -> Made:
    """The robot rolls over its tipping point and back while the IMU is silent."""
    scene, start, length = _blind_lean(draw)
    joints, imu = sensed(scene, draw.rng)
    return made(scene, [joints, imu.kept(~within(imu.log, start, length))], tipped(scene))


def joints_silent(draw: Draw) -> Made:
    """The arm reaches out too far and back while the joint states are silent."""
    scene, start, length = _blind_reach(draw)
    joints, imu = sensed(scene, draw.rng)
    return made(scene, [joints.kept(~within(joints.log, start, length)), imu], tipped(scene))


def both_silent(draw: Draw) -> Made:
    """Nothing is heard for a while; nobody knows what happened."""
    scene, start, length = calm(draw), draw('start_s'), draw('blind_s')
    parts = [part.kept(~within(part.log, start, length)) for part in sensed(scene, draw.rng)]
    return made(scene, [*parts], 'nothing seen for a while')


def _held(time: Times, start: float, length: float) -> Times:
    """Return for each message which one it repeats: itself, or the last before the window."""
    rows = np.arange(len(time))
    frozen = within(time, start, length)
    return np.where(frozen, max(int(np.argmax(frozen)) - 1, 0), rows)


def imu_frozen(draw: Draw) -> Made:
    """The robot leans over its tipping point and back while the IMU repeats one message."""
    scene, start, length = _blind_lean(draw)
    joints, imu = sensed(scene, draw.rng)
    rows = _held(imu.log, start, length)
    stuck = replace(imu.kept(rows), log=imu.log)
    stuck = replace(stuck, stamp=imu.log) if draw.pick('stamps') == 'running' else stuck
    return made(scene, [joints, stuck], tipped(scene))


def joints_repeated(draw: Draw) -> Made:
    """The arm reaches out too far and back while the driver repeats one JointState."""
    scene, start, length = _blind_reach(draw)
    joints, imu = sensed(scene, draw.rng)
    stuck = replace(joints.kept(_held(joints.log, start, length)), log=joints.log)
    return made(scene, [stuck, imu], tipped(scene))


def _stuck_level(scene: Scene, draw: Draw, noise: Noise) -> tuple[Joints, Imu]:
    """Return messages whose orientation stands near level (yaw apart) while the rest is true."""
    joints, imu = sensed(scene, draw.rng, noise)
    level = Rotation.from_euler('z', draw('yaw_deg'), degrees=True) * scene.subject.mounting
    stuck = np.tile(level.as_quat(), (len(imu.log), 1))
    return joints, replace(imu, orientation=stuck)


def _leans_all_run(draw: Draw) -> Scene:
    lean, aim = math.radians(draw('lean_deg')), draw.rng.uniform(0.0, 2.0 * math.pi)
    scene = calm(draw)
    roll, pitch = lean * math.cos(aim), lean * math.sin(aim)
    return replace(scene, roll=scene.roll * 0.0 + roll, pitch=scene.pitch * 0.0 + pitch)


def gyro_deg_stuck(draw: Draw) -> Made:
    """The gyro says deg/s, the orientation is stuck, and the robot leans all the time."""
    scene = _leans_all_run(draw)
    joints, imu = _stuck_level(scene, draw, Noise(gyro=0.0))
    rate = np.degrees(imu.rate) + draw('gyro_degps') * draw.rng.normal(size=imu.rate.shape)
    return made(scene, [joints, replace(imu, rate=rate)], 'an orientation wrong by the lean')


def shaken_stuck(draw: Draw) -> Made:
    """The base shakes, the orientation is stuck, and the robot leans all the time."""
    scene = _leans_all_run(draw)
    joints, imu = _stuck_level(scene, draw, SHAKEN)
    return made(scene, [joints, imu], 'an orientation wrong by the lean')


def stuck_from(draw: Draw) -> Made:
    """The orientation stops where it was; then the robot leans over and stays so for a while."""
    scene, start, hold = calm(draw), draw('start_s'), draw('hold_s')
    shape = window(scene.imu_time, start + 1.0, draw('rise_s'), hold)
    scene = leaning(draw, scene, shape, math.radians(draw('past_deg')))
    joints, imu = sensed(scene, draw.rng, SHAKEN)
    rows = _held(imu.log, start, 100.0)
    return made(scene, [joints, replace(imu, orientation=imu.orientation[rows])], tipped(scene))


def tilt_offset(draw: Draw) -> Made:
    """The orientation is off by a constant tilt; the robot never rests."""
    scene = calm(draw)
    joints, imu = sensed(scene, draw.rng, SHAKEN)
    off = Rotation.from_euler('xy', [draw('offset_deg'), draw('other_deg')], degrees=True)
    turned = (off * Rotation.from_quat(imu.orientation)).as_quat()
    return made(scene, [joints, replace(imu, orientation=turned)], 'an orientation that is off')


def degrees_at_rest(draw: Draw) -> Made:
    """Positions come in degrees; the arm does not move."""
    scene = calm(draw)
    scene = replace(scene, q=np.tile(scene.q[0], (len(scene.q), 1)))
    joints, imu = sensed(scene, draw.rng)
    return made(scene, [_in_degrees(joints), imu], 'degrees for radians')


def degrees_moving(draw: Draw) -> Made:
    """Positions come in degrees while the arm moves; the robot is well."""
    scene = calm(draw)
    joints, imu = sensed(scene, draw.rng)
    return made(scene, [_in_degrees(joints), imu], 'degrees for radians, all well')


def _in_degrees(joints: Joints) -> Joints:
    assert joints.velocity is not None
    return replace(
        joints, position=np.degrees(joints.position), velocity=np.degrees(joints.velocity)
    )


def disagreeing(draw: Draw) -> Made:
    """At rest the orientation says a lean that the accelerometer does not; the robot is well."""
    scene, start = calm(draw), draw('start_s')
    scene = replace(scene, accel=scene.accel * 0.0, yaw=scene.yaw * 0.0)
    joints, imu = sensed(scene, draw.rng)
    lean = Rotation.from_euler('x', draw('lean_deg'), degrees=True)
    wrong = (lean * Rotation.from_quat(imu.orientation)).as_quat()
    late = imu.log - EPOCH >= start * NS
    orientation = np.where(late[:, None], wrong, imu.orientation)
    return made(scene, [joints, replace(imu, orientation=orientation)], 'all well')


def mounted_wrongly(draw: Draw) -> Made:
    """The IMU sits upside down or at 90 deg, which nobody told; the robot is well."""
    scene = calm(draw)
    turn = {'upside down': (180, 0), 'on its side': (90, 0), 'on end': (0, 90)}
    roll, pitch = turn[draw.pick('mounted')]
    subject = replace(
        scene.subject,
        mounting=Rotation.from_euler('xy', (roll, pitch), degrees=True) * scene.subject.mounting,
    )
    joints, imu = sensed(replace(scene, subject=subject), draw.rng)
    alone = draw.pick('orientation') == 'none'
    return made(
        scene, [joints, replace(imu, covariances=(-1.0, 0.0, 0.0)) if alone else imu], 'all well'
    )


def never_at_rest(draw: Draw) -> Made:
    """There is an accelerometer alone, and the base shakes all the time."""
    scene = calm(draw)
    joints, imu = sensed(scene, draw.rng, SHAKEN)
    found = made(scene, [joints, replace(imu, covariances=(-1.0, 0.0, 0.0))], 'nothing to check by')
    return replace(found, pardon=r'never[^"]*rest')


def orientation_useless(draw: Draw) -> Made:
    """The orientation tells nothing, and the robot really leans over its tipping point."""
    scene, start = calm(draw), draw('start_s')
    shape = window(scene.imu_time, start, 3.0, draw('hold_s'))
    scene = leaning(draw, scene, shape, math.radians(draw('past_deg')))
    joints, imu = sensed(scene, draw.rng)
    said: dict[str, Floats] = {
        'zero': np.zeros(4),
        'nan': np.full(4, math.nan),
        'norm 196': np.array((100.0, 100.0, 100.0, 92.0)),
        'identity': np.array((0.0, 0.0, 0.0, 1.0)),
    }
    word = draw.pick('orientation')
    if word == 'covariance -1':
        return made(scene, [joints, replace(imu, covariances=(-1.0, 0.0, 0.0))], tipped(scene))
    orientation = np.tile(said[word], (len(imu.log), 1))
    return made(scene, [joints, replace(imu, orientation=orientation)], tipped(scene))


def broken_imu(draw: Draw) -> Made:
    """The IMU sends for a while what cannot be true, or its acceleration never is."""
    scene, start, length = calm(draw), draw('start_s'), draw('blind_s')
    joints, imu = sensed(scene, draw.rng)
    rows, word = within(imu.log, start, length)[:, None], draw.pick('value')
    all_run = np.ones_like(rows)
    changes = {
        'all nan': (rows, imu.orientation * math.nan, imu.force * math.nan),
        'all 1e308': (rows, imu.orientation * 0 + 1e308, imu.force * 0 + 1e308),
        'raw counts': (rows, imu.orientation, imu.force * 16384.0 / G),
        'force nan': (rows, imu.orientation, imu.force * math.nan),
        'in g': (all_run, imu.orientation, imu.force / G),
        'zero, in g': (all_run, imu.orientation * 0.0, imu.force / G),
        'no gravity': (all_run, imu.orientation, imu.force * 1e-3),
    }
    if word == 'frame':
        return made(scene, [joints, replace(imu, frame='other_imu')], 'the IMU of another frame')
    where, orientation, force = changes[word]
    broken = imu.with_values(
        np.where(where, orientation, imu.orientation), imu.rate, np.where(where, force, imu.force)
    )
    return made(scene, [joints, broken], 'numbers that cannot be true')


def broken_joints(draw: Draw) -> Made:
    """The driver of the joints sends for a while what cannot be used."""
    scene, start, length = calm(draw), draw('start_s'), draw('blind_s')
    joints, imu = sensed(scene, draw.rng)
    rows, word, names = within(joints.log, start, length), draw.pick('value'), joints.names
    good, bad = joints.kept(~rows), joints.kept(rows)
    values = {'nan': math.nan, 'infinite': math.inf, '1e308': 1e308}
    renamed = {
        'all renamed': tuple(f'x_{name}' for name in names),
        'one renamed': (f'x_{names[0]}', *names[1:]),
        'one twice': (names[1], *names[1:]),
        'empty names': ('',) * len(names),
        'no names': (),
    }
    if word in values:
        position = bad.position.copy()
        position[:, 0] = values[word]
        bad = replace(bad, position=position)
    elif word in renamed:
        bad = replace(bad, names=renamed[word])
    elif word == 'fewer positions':
        bad = replace(bad, position=bad.position[:, :-1])
    else:
        bad = replace(bad, position=bad.position[:, :0])
    return made(scene, [good, bad, imu], 'numbers that cannot be used')
