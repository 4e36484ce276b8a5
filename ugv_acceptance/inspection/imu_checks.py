"""Checks of an IMU on a robot that stands still: unit, gravity, mounting, frame, orientation."""

import math
from collections.abc import Iterator, Sequence
from statistics import fmean, median

from ugv_acceptance.bag.cdr import ImuSample
from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.inputs.frames import same_frame
from ugv_acceptance.evaluation.inputs.imu_mount import NAMELESS, mounted
from ugv_acceptance.evaluation.margin_words import rate_words
from ugv_acceptance.evaluation.settings import UNKNOWN as UNPLACED
from ugv_acceptance.evaluation.settings import ImuInput
from ugv_acceptance.inspection.heard import FAIL, OK, WARN, Finding, Heard
from ugv_acceptance.model.attitude import (
    angle_between,
    up_from_acceleration,
    up_from_orientation,
)
from ugv_acceptance.model.robot import Matrix, Vector

# The tilt (rad) a floor may have.
LEVEL = math.radians(15)


def check_imu(heard: Heard, config: Config) -> Iterator[Finding]:
    """Yield what is wrong with an IMU at rest: unit, sign, mounting, frame, orientation."""
    samples = heard.samples if heard.still is None else heard.still
    if not samples:
        text = 'nowhere does it stand still for a second: gravity cannot be judged'
        yield Finding(WARN, 'imu', text, 'record a second of standing still')
        return
    imu, g = config.settings.imu, config.settings.robot.gravity
    spin = median(math.hypot(*sample.angular_velocity) for sample in samples)
    if not spin <= imu.rest_rate:
        text = (
            'angular velocity is NaN'
            if math.isnan(spin)
            else f'the robot turns at {rate_words(spin, "rad/s")}'
        )
        yield Finding(WARN, 'imu', f'{text}: gravity cannot be judged', 'let it stand still')
        return
    ax, ay, az = (fmean(sample.linear_acceleration[k] for sample in samples) for k in range(3))
    size = math.sqrt(ax * ax + ay * ay + az * az)
    yield _gravity(size, g)
    found = mounted(config.settings, samples[-1].frame_id)
    if found is None:
        yield _unplaced(config, samples[-1].frame_id)
    elif found.joints:
        names = ', '.join(config.settings.robot.joint_names[j] for j in found.joints)
        yield Finding(OK, 'imu mounting', f'on {found.link}, which {names} moves: not judged here')
    else:
        up: Vector = up_from_acceleration(ax, ay, az, found.rotation)
        if size > g / 2:
            yield _mounting(up)
        yield from _orientation(samples, imu, found.rotation, up, known=abs(size - g) <= 0.15 * g)
    expected, frames = config.topics.imu.frame_id, {sample.frame_id for sample in heard.samples}
    if expected is not None and not all(same_frame(frame, expected) for frame in frames):
        text = f'frame_id is {", ".join(sorted(frames)) or "empty"}, expected {expected}'
        yield Finding(WARN, 'imu frame', text, 'check that this is the IMU whose mounting is given')


def _unplaced(config: Config, frame: str) -> Finding:
    """Return that nobody says how the IMU is mounted, as far as the URDF tells."""
    if config.settings.imu.placed == UNPLACED:
        text, do = 'declared as unknown', 'set imu.mounting_rpy_deg'
    elif not frame:
        text, do = NAMELESS, 'set imu.mounting_rpy_deg, or let the driver name its frame'
    else:
        text = f'its frame {frame!r} is no link of the URDF'
        do = 'unless /tf_static tells it, set imu.mounting_rpy_deg'
    return Finding(WARN, 'imu mounting', text, do)


def _gravity(size: float, g: float) -> Finding:
    about, seen = 'imu gravity', f'at rest the acceleration is {size:.2f} m/s2'
    if abs(size - g) <= 0.05 * g:
        return Finding(OK, about, seen)
    if abs(size - 1.0) <= 0.15:
        return Finding(FAIL, about, seen, 'it is in g: let the driver send m/s2 (REP-145)')
    if size <= 0.15 * g:
        return Finding(
            FAIL, about, seen, 'gravity was subtracted: let the driver send raw acceleration'
        )
    return Finding(FAIL, about, seen, f'expected {g:.2f}: calibrate it, or check its unit')


def _mounting(up: Vector) -> Finding:
    tilt = math.acos(max(-1.0, min(1.0, up[2])))
    about, seen = 'imu mounting', f'the robot leans {math.degrees(tilt):.1f} deg by acceleration'
    if tilt <= LEVEL:
        return Finding(OK, about, seen)
    if tilt >= math.pi - LEVEL:
        do = 'upside down, or the sign is wrong (+g up at rest, REP-145): set imu.mounting_rpy_deg'
        return Finding(FAIL, about, seen, do)
    return Finding(WARN, about, seen, 'if it stands level, set imu.mounting_rpy_deg')


def _orientation(
    samples: Sequence[ImuSample], imu: ImuInput, mounting: Matrix, up: Vector, *, known: bool
) -> Iterator[Finding]:
    about, last = 'imu orientation', samples[-1]
    x, y, z, w = last.orientation
    size = math.sqrt(x * x + y * y + z * z + w * w)
    do = 'set imu.attitude: accelerometer, or let the driver send an orientation'
    if last.orientation_covariance_0 == -1.0:
        yield Finding(WARN, about, 'not given (covariance -1): the accelerometer is used', do)
    elif not abs(size - 1.0) <= 0.01:
        yield Finding(FAIL, about, f'the quaternion has norm {size:.3g}, expected 1', do)
    elif x == y == z == 0.0:
        yield Finding(WARN, about, 'always the identity: taken for not given', do)
    elif known:
        angle = angle_between(up_from_orientation(x, y, z, w, mounting), up)
        seen = f'{math.degrees(angle):.1f} deg from the acceleration'
        if angle <= imu.agreement:
            yield Finding(OK, about, seen)
        else:
            do = 'check imu.mounting_rpy_deg and the axes of the driver (REP-103: z up)'
            yield Finding(FAIL, about, seen, do)
