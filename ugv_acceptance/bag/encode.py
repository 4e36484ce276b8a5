"""Encodes JointState, Imu, InertiaStamped and String messages as CDR, without ROS."""

import struct
from collections.abc import Sequence
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.type_aliases import Floats, Times

Numbers: TypeAlias = Sequence[float] | NDArray[np.float64]

_NS = 1_000_000_000
_STAMP, _COUNT = struct.Struct('<iI'), struct.Struct('<I')
# What fills up to a multiple of four, by the length modulo four.
_PADS = (b'', bytes(3), bytes(2), bytes(1))
_HEAD = b'\x00\x01\x00\x00'  # plain CDR, little endian


def joint_state_cdr(
    stamp_ns: int,
    frame_id: str,
    names: Sequence[str],
    position: Numbers,
    velocity: Numbers = (),
    effort: Numbers = (),
) -> bytes:
    """Encode a sensor_msgs/JointState; SI, radians; each array is empty or as long as `names`."""
    out = message_head(stamp_ns, frame_id, tuple(names))
    for values in (position, velocity, effort):
        put_floats(out, values, counted=True)
    return bytes(out)


class JointStateBytes:
    """A template of a serialised JointState with fixed names, into which numbers are written.

    It holds position and effort. rclpy publishes the bytes as they are; filling a template costs a
    third of making a message object.
    """

    def __init__(self, names: Sequence[str], frame_id: str = '') -> None:
        zeros = [0.0] * len(names)
        self._data = bytearray(joint_state_cdr(0, frame_id, names, zeros, (), zeros))
        self._stamp = struct.Struct('<iI')
        self._floats = struct.Struct(f'<{len(names)}d')
        # CDR (little endian) ends: positions, two counts of four bytes, efforts.
        self._effort_at = len(self._data) - self._floats.size
        self._position_at = self._effort_at - 8 - self._floats.size

    def fill(self, stamp: int, position: Sequence[float], effort: Sequence[float]) -> bytes:
        """Return the message with header `stamp` (ns), `position` and `effort` (one per name)."""
        data = self._data
        self._stamp.pack_into(data, 4, stamp // _NS, stamp % _NS)
        self._floats.pack_into(data, self._position_at, *position)
        self._floats.pack_into(data, self._effort_at, *effort)
        return bytes(data)

    def table(self, stamp: Times, position: Floats, effort: Floats) -> NDArray[np.uint8]:
        """Return the bytes (n, m) of n messages: `stamp` (n,) in ns, tables (n, j) as in `fill`."""
        out = np.repeat(np.frombuffer(self._data, np.uint8)[None], len(stamp), axis=0)
        seconds = np.stack((stamp // _NS, stamp % _NS), 1).astype('<u4')
        for at, values in (
            (4, seconds),
            (self._position_at, position.astype('<f8')),
            (self._effort_at, effort.astype('<f8')),
        ):
            part = np.ascontiguousarray(values).view(np.uint8)
            out[:, at : at + part.shape[1]] = part
        return out


def imu_cdr(
    stamp_ns: int,
    frame_id: str,
    orientation: Numbers,
    angular_velocity: Numbers,
    linear_acceleration: Numbers,
    covariances: tuple[Numbers, Numbers, Numbers] | None = None,
) -> bytes:
    """Encode a sensor_msgs/Imu: quaternion x, y, z, w; rad/s; m/s2.

    `covariances` are of orientation, angular velocity and acceleration, 9 values each, row by row;
    None is all zero, which means "unknown" (REP-145).
    """
    out = message_head(stamp_ns, frame_id, None)
    vectors = ((orientation, 4), (angular_velocity, 3), (linear_acceleration, 3))
    for i, (vector, size) in enumerate(vectors):
        put_floats(out, vector, size)
        put_floats(out, covariances[i] if covariances else (0.0,) * 9, 9)
    return bytes(out)


def inertia_cdr(
    stamp_ns: int,
    frame_id: str,
    mass: float,
    com: Numbers,
    moments: Numbers = (0.0,) * 6,
) -> bytes:
    """Encode a geometry_msgs/InertiaStamped: kg, m, kg m2 (ixx, ixy, ixz, iyy, iyz, izz)."""
    out = message_head(stamp_ns, frame_id, None)
    put_floats(out, (mass,), 1)
    put_floats(out, com, 3)
    put_floats(out, moments, 6)
    return bytes(out)


def string_message(text: str) -> bytes:
    """Encode a std_msgs/String, such as a robot's URDF on /robot_description."""
    out = bytearray(_HEAD)
    put_text(out, text)
    return bytes(out)


def message_head(stamp_ns: int, frame_id: str, names: tuple[str, ...] | None = None) -> bytearray:
    """Return the start of a message: encapsulation, Header, and the names of a JointState."""
    sec, nanosec = divmod(stamp_ns, _NS)
    out = bytearray(_HEAD)
    out += _STAMP.pack(sec, nanosec)
    out += _texts(frame_id, names)
    return out


@lru_cache(maxsize=256)
def _texts(frame_id: str, names: tuple[str, ...] | None) -> bytes:
    """Return frame_id and names encoded; they begin, as all their lengths, at multiples of four."""
    out = bytearray()
    put_text(out, frame_id)
    if names is not None:
        put_count(out, len(names))
        for name in names:
            put_text(out, name)
    return bytes(out)


def put_text(out: bytearray, text: str) -> None:
    """Append a CDR string: its length and its UTF-8 bytes with a final zero."""
    data = text.encode()
    out += _PADS[len(out) & 3] + _COUNT.pack(len(data) + 1) + data + b'\0'


def put_count(out: bytearray, number: int) -> None:
    """Append a uint32, such as a length, aligned to four bytes."""
    out += _PADS[len(out) & 3] + _COUNT.pack(number)


def put_floats(
    out: bytearray, values: Numbers, size: int | None = None, *, counted: bool = False
) -> None:
    """Append float64s: a fixed array of `size`, or a sequence with its length (`counted`).

    Raises ValueError if there are not `size` values.
    """
    number = len(values)
    if size not in (None, number):
        msg = f'expected {size} values, got {number}'
        raise ValueError(msg)
    if counted:
        put_count(out, number)
    if number:
        out += bytes(-(len(out) - 4) % 8)
        out += struct.pack(f'<{number}d', *values)
