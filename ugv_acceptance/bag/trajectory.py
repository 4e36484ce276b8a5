"""Decodes serialised trajectory_msgs/JointTrajectory (CDR), and names one by its contents.

Any bytes give a trajectory or BadSample, nothing else.
"""

import hashlib
import struct
from dataclasses import dataclass, field

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
    that (ns), `positions` (n, m) one a name. The others are None where no point has any; a point
    without is a row of NaN. `sha256` names it by its contents, all but the header: see _Points.
    """

    stamp: int
    names: tuple[str, ...]
    times: Times
    positions: Floats
    velocities: Floats | None
    accelerations: Floats | None
    effort: Floats | None
    sha256: str


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
    count = _some(cursor.count('points'), MOST_POINTS, 'points', 'points')
    points = _Points(data, number, little=cursor.little)
    points.hashed.extend(name.encode() + b'\0' for name in names)
    points.read(cursor.pos, count)
    rates, accelerations, effort = (_filled(points.rows[name], number) for name in FIELDS[1:])
    return TrajectoryMessage(
        stamp_of(data),
        names,
        np.array(points.times, np.int64),
        np.array(points.rows[FIELDS[0]], np.float64).reshape(count, number),
        rates,
        accelerations,
        effort,
        hashlib.sha256(b''.join(points.hashed)).hexdigest(),
    )


def _some(number: int, most: int, where: str, what: str) -> int:
    if not 1 <= number <= most:
        raise BadSample(f'{where}: expected 1 to {most:,} {what}, got {number:,}')
    return number


def _filled(rows: list[tuple[float, ...]], number: int) -> Floats | None:
    """Return numbers (n, m), a row of NaN where a point has none; None where no point has any."""
    if not any(rows):
        return None
    return np.array([row or (np.nan,) * number for row in rows], np.float64)


@dataclass(slots=True)
class _Points:
    """Reads the points of a message with `number` joints.

    `hashed` is what a trajectory is named by: each name in UTF-8 and a zero byte; then, of each
    point, each of FIELDS as its length (uint32) and its numbers (float64), and the time from the
    start (int64, ns), all little endian. The bytes of the message itself do not serve: in its gaps
    stands what was there by accident.
    """

    data: bytes
    number: int
    little: bool
    times: list[int] = field(default_factory=list)
    rows: dict[str, list[tuple[float, ...]]] = field(
        default_factory=lambda: {n: [] for n in FIELDS}
    )
    hashed: list[bytes] = field(default_factory=list)

    def read(self, pos: int, count: int) -> None:
        """Read `count` points from byte `pos` on; a cursor would take three times as long."""
        data, number, order = self.data, self.number, '<' if self.little else '>'
        length, duration = struct.Struct(f'{order}I'), struct.Struct(f'{order}iI')
        numbers, packed = struct.Struct(f'{order}{number}d'), struct.Struct(f'<I{number}d')
        none, time, keep = bytes(4), struct.Struct('<q'), self.hashed.append
        for k in range(count):
            name = ''
            try:
                for name, rows in self.rows.items():
                    pos += -pos & 3
                    (found,) = length.unpack_from(data, pos)
                    pos += 4
                    row: tuple[float, ...] = ()
                    if found == number:
                        pos += 4 - pos & 7  # what is aligned is the distance from byte 4
                        row = numbers.unpack_from(data, pos)
                        pos += 8 * number
                    elif found or name == FIELDS[0]:
                        raise BadSample(_uneven(k, name, number, found))
                    rows.append(row)
                    keep(packed.pack(number, *row) if row else none)
                name = 'time_from_start'
                sec, nanosec = duration.unpack_from(data, pos)
            except struct.error:
                raise BadSample(f'points[{k}].{name}: the message ends before it') from None
            pos += 8
            self.times.append(sec * NS + nanosec)
            keep(time.pack(self.times[-1]))


def _uneven(point: int, name: str, number: int, count: int) -> str:
    kind = 'positions' if name == FIELDS[0] else f'{name}, or none'
    return f'points[{point}].{name}: expected {number} {kind} (one a joint), got {count}'
