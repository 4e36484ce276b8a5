"""Which way is up in the axes of an IMU at rest, by its acceleration and by its orientation."""

import math
from dataclasses import dataclass

from ugv_acceptance.configure.evidence import SeenImu
from ugv_acceptance.evaluation.inputs.imu_placing import NO_GRAVITY, UNIT_KINDS, UNIT_SLACK, UNITS
from ugv_acceptance.model.attitude import angle_between
from ugv_acceptance.model.robot import Vector

_G = 9.80665
# Up by acceleration and by orientation that differ by less (rad) are one.
AGREE = math.radians(10.0)


@dataclass(frozen=True, slots=True)
class Up:
    """The directions (unit, sensor axes) that may be up: none if nothing tells, two if they differ.

    `apart` (rad) is by how much acceleration and orientation differ, 0 where one of them is known.
    """

    directions: tuple[Vector, ...]
    apart: float = 0.0
    remarks: tuple[str, ...] = ()


def up_of(imu: SeenImu) -> Up:
    """Return which way is up for an IMU at rest, and what is odd with what it tells."""
    remarks, found = [], []
    force = imu.specific_force
    if force is not None:
        size = math.hypot(*force)
        odd = _odd(size)
        if odd:
            remarks.append(f'the acceleration of {imu.topic} is {size:.2f} at rest: {odd}')
        if size >= NO_GRAVITY and (odd in UNIT_KINDS or imu.orientation is None):
            found.append((force[0] / size, force[1] / size, force[2] / size))
    if imu.orientation is not None:
        # The world's z axis in sensor axes: the last row.
        found.append(imu.orientation[2])
    else:
        remarks.append(f'{imu.topic} has no valid orientation')
    if not found:
        remarks.append(f'{imu.topic} has neither gravity nor a valid orientation')
    apart = float(angle_between(found[0], found[1])) if len(found) > 1 else 0.0
    if apart <= AGREE:
        return Up(tuple(found[:1]), 0.0, tuple(remarks))
    words = f'acceleration and orientation of {imu.topic} differ by {math.degrees(apart):.0f} deg'
    return Up(tuple(found), apart, (*remarks, f'{words} at rest: one of them is wrong'))


def _odd(size: float) -> str:
    """Return what is odd with the size of an acceleration at rest (m/s2 expected), or ''."""
    if size < NO_GRAVITY:
        return UNIT_KINDS[4]
    for unit, kind in UNITS:
        if abs(math.log(size / _G / unit)) < UNIT_SLACK:
            return UNIT_KINDS[int(kind)]
    return 'it is not gravity in any unit'
