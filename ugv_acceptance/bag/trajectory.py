"""Decodes serialised trajectory_msgs/JointTrajectory (CDR), and names one by its contents.

Any bytes give a trajectory or BadSample, nothing else.
"""

import hashlib
import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ugv_acceptance import BadSample
from ugv_acceptance.bag.layout import Cursor
from ugv_acceptance.type_aliases import Floats, Times

TYPE = 'trajectory_msgs/msg/JointTrajectory'
# Points of a trajectory, and joints of a point, beyond which it is not read.
MOST_POINTS, MOST_JOINTS = 10_000, 200
NS = 1_000_000_000
# The fields of a point that hold a number a joint, as they follow each other in a message.
FIELDS = ('positions', 'velocities', 'accelerations', 'effort')


@dataclass(frozen=True, slots=True, eq=False)
class TrajectoryMessage:
    """A decoded trajectory_msgs/JointTrajectory as sent: SI, radians, the signs of messages.

    `stamp` is when it is to begin (ns; 0: at once), `times` (n,) when each point is reached after
    that (ns). `positions` (n, m) is one a name; the others are that or, not given, (n, 0).
    """

    stamp: int
    names: tuple[str, ...]
    times: Times
    positions: Floats
    velocities: Floats
    accelerations: Floats
    effort: Floats

    @property
    def sha256(self) -> str:
        """Its name: the hash of all but its header."""
        fields = (self.positions, self.velocities, self.accelerations, self.effort)
        return trajectory_sha256(self.names, self.times, fields)


def trajectory_sha256(names: Sequence[str], times: Times, fields: Sequence[Floats]) -> str:
    """Return the SHA-256 (hexadecimal) of a trajectory's contents.

    Hashed are each name in UTF-8 with a zero byte, the `times` (n,) as int64 in ns, and the
    `fields` (n, m or 0) positions, velocities, accelerations and effort as float64, point by point,
    all little endian. The bytes of a message do not serve: what stands in its gaps is accidental.
    """
    found = hashlib.sha256(b''.join(name.encode() + b'\0' for name in names))
    found.update(np.ascontiguousarray(times, dtype='<i8').tobytes())
    for field in fields:
        found.update(np.ascontiguousarray(field, dtype='<f8').tobytes())
    return found.hexdigest()


def stamp_of(data: bytes) -> int:
    """Return the header stamp (ns) of a serialised message; 0 where it is too short."""
    if len(data) < 12:
        return 0
    sec, nanosec = struct.unpack_from('<iI' if data[1] == 1 else '>iI', data, 4)
    return int(sec) * NS + int(nanosec)


def trajectory_from(data: bytes) -> TrajectoryMessage:
    """Decode a message; BadSample says which field is wrong with it.

    Bytes behind its end are passed over, as ROS does: its own serialisation leaves some.
    """
    cursor = Cursor(data, 'cdr')
    cursor.skip(8, 'header.stamp', 4)
    cursor.text('header.frame_id')
    number = _some(cursor.count('joint_names'), MOST_JOINTS, 'joint_names', 'joints')
    names = tuple(cursor.text(f'joint_names[{i}]') for i in range(number))
    points = _some(cursor.count('points'), MOST_POINTS, 'points', 'points')
    times = np.empty(points, np.int64)
    rows: tuple[list[tuple[float, ...]], ...] = ([], [], [], [])
    order = '<' if cursor.little else '>'
    length, duration = struct.Struct(f'{order}I'), struct.Struct(f'{order}iI')
    numbers, pos = struct.Struct(f'{order}{number}d'), cursor.pos
    # Not by the cursor: a long trajectory would take three times as long.
    for k in range(points):
        field = FIELDS[0]
        try:
            for field, kept in zip(FIELDS, rows, strict=True):
                pos += -pos & 3
                (count,) = length.unpack_from(data, pos)
                pos += 4
                if count == number and number:
                    pos += 4 - pos & 7  # what is counted begins behind four bytes
                    kept.append(numbers.unpack_from(data, pos))
                    pos += 8 * number
                elif count or field == FIELDS[0]:
                    raise BadSample(_uneven(k, field, number, count))
            field = 'time_from_start'
            sec, nanosec = duration.unpack_from(data, pos)
        except struct.error:
            raise BadSample(f'points[{k}].{field}: the message ends before it') from None
        pos += 8
        times[k] = sec * NS + nanosec
    fields = [_field(points, number, *pair) for pair in zip(FIELDS, rows, strict=True)]
    return TrajectoryMessage(stamp_of(data), names, times, *fields)


def _some(number: int, most: int, where: str, what: str) -> int:
    if not 1 <= number <= most:
        raise BadSample(f'{where}: expected 1 to {most:,} {what}, got {number:,}')
    return number


def _uneven(point: int, field: str, number: int, count: int) -> str:
    kind = 'positions' if field == 'positions' else f'{field}, or none'
    return f'points[{point}].{field}: expected {number} {kind} (one a joint), got {count}'


def _field(points: int, number: int, field: str, rows: list[tuple[float, ...]]) -> Floats:
    """Return the numbers of a field, (n, m), or (n, 0) if no point has them."""
    if not rows:
        return np.empty((points, number if field == 'positions' else 0))
    if len(rows) != points:
        raise BadSample(
            f'points: expected {field} in every point or in none, {len(rows)} of {points} have them'
        )
    return np.array(rows, dtype=np.float64).reshape(points, number)
