"""Decodes what robots say of themselves in CDR: std_msgs/String and tf2_msgs/TFMessage."""

import struct
from typing import NamedTuple

from ugv_acceptance import BadSample
from ugv_acceptance.bag.layout import Cursor

STRING, TF = 'std_msgs/msg/String', 'tf2_msgs/msg/TFMessage'
_LEAST = 8 + 2 * 4 + 7 * 8  # bytes of a transform with empty names


class Transform(NamedTuple):
    """Where a frame `child` is in `frame`: x, y, z (m) and a quaternion x, y, z, w; stamp in ns."""

    stamp: int
    frame: str
    child: str
    place: tuple[float, ...]
    rotation: tuple[float, ...]


def string_of(data: bytes) -> str:
    """Return the text of a std_msgs/String; BadSample if it is none."""
    cursor = Cursor(data, 'cdr')
    return cursor.text('data')


def transforms_of(data: bytes) -> tuple[Transform, ...]:
    """Return the transforms of a tf2_msgs/TFMessage; BadSample says which field is wrong."""
    cursor = Cursor(data, 'cdr')
    number = cursor.count('transforms')
    if number * _LEAST > len(data):
        raise BadSample(f'transforms: {number} do not fit in {len(data)} bytes')
    return tuple(_transform(cursor, f'transforms[{i}]') for i in range(number))


def _transform(cursor: Cursor, where: str) -> Transform:
    order = '<' if cursor.little else '>'
    at = cursor.skip(8, f'{where}.header.stamp', 4)
    sec, nanosec = struct.unpack_from(f'{order}iI', cursor.data, at)
    frame = cursor.text(f'{where}.header.frame_id')
    child = cursor.text(f'{where}.child_frame_id')
    start, number = cursor.floats(7, f'{where}.transform')
    values = struct.unpack_from(f'{order}{number}d', cursor.data, start)
    return Transform(sec * 1_000_000_000 + nanosec, frame, child, values[:3], values[3:])
