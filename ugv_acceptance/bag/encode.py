"""Numbers to CDR (little endian): the bytes of the three messages that bags hold for us."""

import struct
from collections.abc import Sequence
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Numbers: TypeAlias = Sequence[float] | NDArray[np.float64]

_NS = 1_000_000_000
_STAMP = struct.Struct('<iI')


def joint_state_cdr(
    stamp_ns: int,
    frame_id: str,
    names: Sequence[str],
    position: Numbers,
    velocity: Numbers = (),
    effort: Numbers = (),
) -> bytes:
    """A sensor_msgs/JointState; SI units, radians; each array empty or as long as `names`."""
    out = _head(stamp_ns, frame_id, tuple(names))
    for values in (position, velocity, effort):
        _floats(out, values, counted=True)
    return bytes(out)


def imu_cdr(
    stamp_ns: int,
    frame_id: str,
    orientation: Numbers,
    angular_velocity: Numbers,
    linear_acceleration: Numbers,
    covariances: tuple[Numbers, Numbers, Numbers] | None = None,
) -> bytes:
    """A sensor_msgs/Imu: quaternion x, y, z, w; rad/s; m/s2.

    `covariances` of orientation, angular velocity, acceleration, 9 values each row by row; None
    is all zero, which means "unknown" (REP-145).
    """
    out = _head(stamp_ns, frame_id, None)
    vectors = ((orientation, 4), (angular_velocity, 3), (linear_acceleration, 3))
    for i, (vector, size) in enumerate(vectors):
        _floats(out, vector, size)
        _floats(out, covariances[i] if covariances else (0.0,) * 9, 9)
    return bytes(out)


def inertia_cdr(
    stamp_ns: int,
    frame_id: str,
    mass: float,
    com: Numbers,
    moments: Numbers = (0.0,) * 6,
) -> bytes:
    """A geometry_msgs/InertiaStamped: kg, m, and kg m2 (ixx, ixy, ixz, iyy, iyz, izz)."""
    out = _head(stamp_ns, frame_id, None)
    _floats(out, (mass,), 1)
    _floats(out, com, 3)
    _floats(out, moments, 6)
    return bytes(out)


def _head(stamp_ns: int, frame_id: str, names: tuple[str, ...] | None) -> bytearray:
    sec, nanosec = divmod(stamp_ns, _NS)
    out = bytearray(b'\x00\x01\x00\x00')
    out += _STAMP.pack(sec, nanosec)
    out += _texts(frame_id, names)
    return out


@lru_cache(maxsize=256)
def _texts(frame_id: str, names: tuple[str, ...] | None) -> bytes:
    """frame_id and names; both start at a multiple of four and so do all lengths in them."""
    out = bytearray()
    _text(out, frame_id)
    if names is not None:
        _count(out, len(names))
        for name in names:
            _text(out, name)
    return bytes(out)


def _text(out: bytearray, text: str) -> None:
    data = text.encode() + b'\0'
    _count(out, len(data))
    out += data


def _count(out: bytearray, number: int) -> None:
    out += bytes(-len(out) % 4)
    out += number.to_bytes(4, 'little')


def _floats(
    out: bytearray, values: Numbers, size: int | None = None, *, counted: bool = False
) -> None:
    number = len(values)
    if size not in (None, number):
        msg = f'expected {size} values, got {number}'
        raise ValueError(msg)
    if counted:
        _count(out, number)
    if number:
        out += bytes(-(len(out) - 4) % 8)
        out += struct.pack(f'<{number}d', *values)
