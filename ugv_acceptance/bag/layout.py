"""Learns the layout of a serialised message (CDR or ROS 1) by walking it once.

Every length and text in a message is part of its layout; the rest is a stamp and blocks of float64.
Any bytes give a layout or BadSample, nothing else.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from ugv_acceptance import BadSample

Wire: TypeAlias = Literal['cdr', 'ros1']
_MAX_PADDING = 3  # some writers pad the whole message to a multiple of four


Names: TypeAlias = tuple[str, ...]
Blocks: TypeAlias = list[tuple[int, int]]


@dataclass(frozen=True, slots=True)
class Layout:
    """Where the numbers of a message are, and the constant bytes that determine this.

    `constant` holds (offset, bytes) of lengths and texts; `blocks` (offset, count) of the float64
    arrays; `stamp` the offset of sec and nanosec. Offsets are in bytes from the message's start,
    `length` is the message's; `little` means little endian.
    """

    length: int
    little: bool
    frame_id: str
    names: tuple[str, ...]
    stamp: int
    constant: tuple[tuple[int, bytes], ...]
    blocks: tuple[tuple[int, int], ...]

    @property
    def widths(self) -> tuple[int, ...]:
        """Number of float64 in each block."""
        return tuple(count for _, count in self.blocks)


class Cursor:
    """Walks over a message and records its constant bytes; BadSample where it is too short."""

    def __init__(self, data: bytes, wire: Wire) -> None:
        self.data = data
        self.wire = wire
        self.constant: list[tuple[int, bytes]] = []
        self.little = True
        self.pos = 0
        self.origin = 0
        if wire == 'cdr':
            self._encapsulation()

    def _encapsulation(self) -> None:
        head = self.data[:4]
        if len(head) < 4 or head[0] != 0 or head[1] not in (0, 1):
            msg = f'encapsulation: expected plain CDR (00 00 or 00 01), got {head.hex(" ")!r}'
            raise BadSample(msg)
        self.little = head[1] == 1
        self.pos = self.origin = 4
        self._note(0, 2)  # the two option bytes may say anything

    def _note(self, start: int, stop: int) -> None:
        last = self.constant[-1] if self.constant else (0, b'')
        piece = bytes(self.data[start:stop])
        if self.constant and last[0] + len(last[1]) == start:
            self.constant[-1] = (last[0], last[1] + piece)
        elif piece:
            self.constant.append((start, piece))

    def skip(self, size: int, where: str, align: int = 1) -> int:
        """Skip the next `size` bytes, aligned to `align`, and return their offset."""
        start = self.pos
        if self.wire == 'cdr':
            start += -(start - self.origin) % align
        if start + size > len(self.data):
            msg = f'{where}: needs bytes {start}..{start + size}, message has {len(self.data)}'
            raise BadSample(msg)
        self.pos = start + size
        return start

    def count(self, where: str) -> int:
        """Read a length (uint32), which is part of the layout."""
        start = self.skip(4, where, 4)
        self._note(start, start + 4)
        order: Literal['little', 'big'] = 'little' if self.little else 'big'
        return int.from_bytes(self.data[start : start + 4], order)

    def text(self, where: str) -> str:
        """Read a string, which is part of the layout."""
        size = self.count(where)
        start = self.skip(size, where)
        self._note(start, start + size)
        raw = bytes(self.data[start : start + size])
        if self.wire == 'cdr' and size:
            if raw[-1]:
                msg = f'{where}: text {raw[:40]!r} does not end in a zero byte'
                raise BadSample(msg)
            raw = raw[:-1]
        try:
            return raw.decode()
        except UnicodeDecodeError as error:
            msg = f'{where}: text {raw[:40]!r} is not UTF-8'
            raise BadSample(msg) from error

    def floats(self, number: int, where: str) -> tuple[int, int]:
        """Skip a block of `number` float64; return its offset and number."""
        if not number:
            return self.pos, 0
        return self.skip(8 * number, where, 8), number


def joint_state_body(cursor: Cursor) -> tuple[Names, Blocks]:
    """Walk the body of a sensor_msgs/JointState: names and three blocks.

    Velocities or efforts that are not one a name belong to nobody knows which: they count as not
    given, and the positions are whole all the same.
    """
    number = cursor.count('name')
    if number * 4 > len(cursor.data):
        msg = f'name: {number} names do not fit in {len(cursor.data)} bytes'
        raise BadSample(msg)
    names = tuple(cursor.text(f'name[{i}]') for i in range(number))
    blocks = []
    for where in ('position', 'velocity', 'effort'):
        values = cursor.count(where)
        if where == 'position' and values not in (0, number):
            raise BadSample(_unequal(number, values))
        at = cursor.floats(values, where)
        blocks.append(at if values == number else (at[0], 0))
    return names, blocks


def _unequal(names: int, positions: int) -> str:
    """Return in words that there are not as many positions as names."""
    if not names:
        return f'name: the names are empty, but there are {positions} positions'
    return f'position: expected {names} values (one a name) or none, got {positions}'


def imu_body(cursor: Cursor) -> tuple[Names, Blocks]:
    """Walk the body of a sensor_msgs/Imu: one block of 37 float64 without a gap."""
    return (), [cursor.floats(37, 'orientation to linear_acceleration_covariance')]


def payload_body(cursor: Cursor) -> tuple[Names, Blocks]:
    """Walk the body of a geometry_msgs/InertiaStamped: one block of mass, centre, six moments."""
    return (), [cursor.floats(10, 'inertia')]


def learn(
    body: Callable[[Cursor], tuple[Names, Blocks]], data: bytes, wire: Wire = 'cdr'
) -> Layout:
    """Return the layout of one message; BadSample says which field is wrong."""
    cursor = Cursor(data, wire)
    if wire == 'ros1':
        cursor.skip(4, 'header.seq')
    stamp = cursor.skip(8, 'header.stamp', 4)
    frame_id = cursor.text('header.frame_id')
    names, blocks = body(cursor)
    if len(data) - cursor.pos > (_MAX_PADDING if wire == 'cdr' else 0):
        msg = f'expected the message to end at byte {cursor.pos}, it has {len(data)}'
        raise BadSample(msg)
    return Layout(
        len(data), cursor.little, frame_id, names, stamp, tuple(cursor.constant), tuple(blocks)
    )
