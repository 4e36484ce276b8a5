"""Decodes and encodes tf2_msgs/TFMessage, the message of /tf_static, without ROS (CDR or ROS 1)."""

import math
import struct
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from ugv_acceptance import BadSample
from ugv_acceptance.bag.encode import put_count, put_floats, put_text
from ugv_acceptance.bag.layout import Cursor, Wire
from ugv_acceptance.model.attitude import rotation_of
from ugv_acceptance.model.robot import Matrix, Vector

TYPE = 'tf2_msgs/msg/TFMessage'
TOPIC = '/tf_static'
# A quaternion's norm may be this far from 1: drivers print it with few digits.
_NORM_SLACK = 0.01
# No message has so many transforms.
_MOST = 10_000


class TransformSample(NamedTuple):
    """Where `child` is in `parent`: its origin (m), and the rotation of its axes into parent's."""

    parent: str
    child: str
    xyz: Vector
    rotation: Matrix


def transforms_of(data: bytes, wire: Wire = 'cdr') -> tuple[TransformSample, ...]:
    """Decode a tf2_msgs/TFMessage; BadSample says what is wrong with which field."""
    cursor = Cursor(data, wire)
    number = cursor.count('transforms')
    if number > _MOST or number * 56 > len(data):
        msg = f'transforms: {number} transforms do not fit in {len(data)} bytes'
        raise BadSample(msg)
    return tuple(_transform(cursor, data, f'transforms[{k}]') for k in range(number))


def _transform(cursor: Cursor, data: bytes, where: str) -> TransformSample:
    if cursor.wire == 'ros1':
        cursor.skip(4, f'{where}.header.seq')
    cursor.skip(8, f'{where}.header.stamp', 4)
    parent = cursor.text(f'{where}.header.frame_id')
    child = cursor.text(f'{where}.child_frame_id')
    at, _ = cursor.floats(7, f'{where}.transform')
    x, y, z, *quaternion = struct.unpack_from(f'{"<" if cursor.little else ">"}7d', data, at)
    norm = math.sqrt(math.fsum(v * v for v in quaternion))
    if not abs(norm - 1.0) <= _NORM_SLACK or not all(map(math.isfinite, (x, y, z))):
        msg = f'{where}: expected finite numbers and a unit quaternion, got norm {norm:g}'
        raise BadSample(msg)
    return TransformSample(parent, child, (x, y, z), rotation_of(*(v / norm for v in quaternion)))


def transforms_cdr(
    transforms: Iterable[tuple[str, str, Sequence[float], Sequence[float]]],
) -> bytes:
    """Encode a tf2_msgs/TFMessage: parent, child, origin (m), quaternion x, y, z, w of each."""
    rows = list(transforms)
    out = bytearray(b'\x00\x01\x00\x00')
    put_count(out, len(rows))
    for parent, child, xyz, quaternion in rows:
        put_count(out, 0)
        put_count(out, 0)
        put_text(out, parent)
        put_text(out, child)
        put_floats(out, (*xyz, *quaternion), 7)
    return bytes(out)
