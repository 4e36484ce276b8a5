"""One serialised message to numbers: CDR (and ROS 1's packing) of the three types we read.

A message's layout, that is every length and text in it, is learnt once by walking it. Later
messages of the same layout are unpacked by one precompiled `struct.Struct`; all bytes that make
the layout are compared on every message, so a message is never decoded by a layout that is not
its own. No ROS installation is needed.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from operator import itemgetter
from typing import Any, Generic, Literal, NamedTuple, TypeVar

from ugv_acceptance import BadSample

Wire = Literal['cdr', 'ros1']

NS = 1_000_000_000
_MAX_LAYOUTS = 256
_MAX_PADDING = 3  # some writers pad the whole message to a multiple of four


class JointStateSample(NamedTuple):
    """A sensor_msgs/JointState; SI, radians; `names` is one object for all messages alike.

    Each of `position`, `velocity`, `effort` is empty or as long as `names`.
    """

    stamp: int
    frame_id: str
    names: tuple[str, ...]
    position: tuple[float, ...]
    velocity: tuple[float, ...]
    effort: tuple[float, ...]


class ImuSample(NamedTuple):
    """A sensor_msgs/Imu; quaternion x, y, z, w; `*_covariance_0` is element 0 of the covariance."""

    stamp: int
    frame_id: str
    orientation: tuple[float, ...]
    angular_velocity: tuple[float, ...]
    linear_acceleration: tuple[float, ...]
    orientation_covariance_0: float
    angular_velocity_covariance_0: float
    linear_acceleration_covariance_0: float


class PayloadSample(NamedTuple):
    """A geometry_msgs/InertiaStamped: mass in kg, centre of gravity in m, in `frame_id`."""

    stamp: int
    frame_id: str
    mass: float
    com: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Layout:
    """Where the numbers of a message lie, and the bytes that say so.

    `constant` holds (offset, bytes) of lengths and texts; `blocks` (offset, count) of the float64
    arrays; `stamp` the offset of sec and nanosec. Offsets are in bytes from the message's start.
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


class _Cursor:
    """Walks a message and notes what is constant; every step is checked against the end."""

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
        """Offset of the next `size` bytes, which are passed over."""
        start = self.pos
        if self.wire == 'cdr':
            start += -(start - self.origin) % align
        if start + size > len(self.data):
            msg = f'{where}: needs bytes {start}..{start + size}, message has {len(self.data)}'
            raise BadSample(msg)
        self.pos = start + size
        return start

    def count(self, where: str) -> int:
        """A length or count, which is part of the layout."""
        start = self.skip(4, where, 4)
        self._note(start, start + 4)
        order: Literal['little', 'big'] = 'little' if self.little else 'big'
        return int.from_bytes(self.data[start : start + 4], order)

    def text(self, where: str) -> str:
        """A string, which is part of the layout."""
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
        """A block of `number` float64."""
        if not number:
            return self.pos, 0
        return self.skip(8 * number, where, 8), number


def _joint_state_body(cursor: _Cursor) -> tuple[tuple[str, ...], list[tuple[int, int]]]:
    number = cursor.count('name')
    if number * 4 > len(cursor.data):
        msg = f'name: {number} names do not fit in {len(cursor.data)} bytes'
        raise BadSample(msg)
    names = tuple(cursor.text(f'name[{i}]') for i in range(number))
    blocks = []
    for where in ('position', 'velocity', 'effort'):
        values = cursor.count(where)
        if values not in (0, number):
            msg = f'{where}: expected 0 or {number} values (one a name), got {values}'
            raise BadSample(msg)
        blocks.append(cursor.floats(values, where))
    return names, blocks


def _imu_body(cursor: _Cursor) -> tuple[tuple[str, ...], list[tuple[int, int]]]:
    return (), [cursor.floats(37, 'orientation to linear_acceleration_covariance')]


def _payload_body(cursor: _Cursor) -> tuple[tuple[str, ...], list[tuple[int, int]]]:
    return (), [cursor.floats(10, 'inertia')]


def _joint_state(layout: Layout, stamp: int, blocks: list[tuple[float, ...]]) -> JointStateSample:
    return JointStateSample(stamp, layout.frame_id, layout.names, *blocks)


def _imu(layout: Layout, stamp: int, blocks: list[tuple[float, ...]]) -> ImuSample:
    v = blocks[0]
    return ImuSample(stamp, layout.frame_id, v[0:4], v[13:16], v[25:28], v[4], v[16], v[28])


def _payload(layout: Layout, stamp: int, blocks: list[tuple[float, ...]]) -> PayloadSample:
    v = blocks[0]
    return PayloadSample(stamp, layout.frame_id, v[0], v[1:4])


Sample = TypeVar('Sample', JointStateSample, ImuSample, PayloadSample)


@dataclass(frozen=True, slots=True)
class Kind(Generic[Sample]):
    """A message type: its ROS 2 name, how to walk what follows the header, how to hand it out."""

    type: str
    body: Callable[[_Cursor], tuple[tuple[str, ...], list[tuple[int, int]]]]
    sample: Callable[[Layout, int, list[tuple[float, ...]]], Sample]


JOINT_STATE = Kind('sensor_msgs/msg/JointState', _joint_state_body, _joint_state)
IMU = Kind('sensor_msgs/msg/Imu', _imu_body, _imu)
PAYLOAD = Kind('geometry_msgs/msg/InertiaStamped', _payload_body, _payload)


def learn(kind: Kind[Any], data: bytes, wire: Wire = 'cdr') -> Layout:
    """Walk one message; BadSample says at which field it breaks."""
    cursor = _Cursor(data, wire)
    if wire == 'ros1':
        cursor.skip(4, 'header.seq')
    stamp = cursor.skip(8, 'header.stamp', 4)
    frame_id = cursor.text('header.frame_id')
    names, blocks = kind.body(cursor)
    if len(data) - cursor.pos > (_MAX_PADDING if wire == 'cdr' else 0):
        msg = f'{kind.type}: ends at byte {cursor.pos}, message has {len(data)}'
        raise BadSample(msg)
    return Layout(
        len(data), cursor.little, frame_id, names, stamp, tuple(cursor.constant), tuple(blocks)
    )


class _Unpacker:
    """A layout compiled to one `struct` call."""

    __slots__ = ('blocks', 'expected', 'layout', 'pick', 'stamp', 'unpack')

    def __init__(self, layout: Layout, data: bytes, wire: Wire) -> None:
        parts = [(offset, f'{len(text)}s', 1) for offset, text in layout.constant]
        parts.append((layout.stamp, 'iI' if wire == 'cdr' else 'II', 2))
        parts += [(offset, f'{n}d', n) for offset, n in layout.blocks if n]
        form = ['<' if layout.little else '>']
        pos = index = 0
        at: dict[int, int] = {}
        for offset, code, values in sorted(parts):
            form.append(f'{offset - pos}x{code}')
            pos = offset + struct.calcsize(form[0] + code)
            at[offset] = index
            index += values
        form.append(f'{layout.length - pos}x')
        self.layout = layout
        self.unpack = struct.Struct(''.join(form)).unpack
        self.stamp = at[layout.stamp]
        self.blocks = [slice(at[o], at[o] + n) if n else slice(0, 0) for o, n in layout.blocks]
        self.pick = itemgetter(*(at[offset] for offset, _ in layout.constant))
        self.expected = self.pick(self.unpack(data))


class Decoder(Generic[Sample]):
    """Decodes messages of one kind one at a time; remembers the layouts it has met.

    `one(data)` returns the sample or raises BadSample, never anything else. `names` and
    `frame_id` of two samples are the same object where they are equal.
    """

    def __init__(self, kind: Kind[Sample], wire: Wire = 'cdr') -> None:
        self.kind = kind
        self.wire = wire
        self._known: dict[int, list[_Unpacker]] = {}
        self._texts: dict[object, Any] = {}
        self._layouts = 0

    def one(self, data: bytes) -> Sample:
        """The sample in `data`; BadSample says what is wrong where."""
        layout, stamp, blocks = self.raw(data)
        return self.kind.sample(layout, stamp, blocks)

    def raw(self, data: bytes) -> tuple[Layout, int, list[tuple[float, ...]]]:
        """Layout, stamp in ns and the float64 blocks of the message in `data`."""
        for known in self._known.get(len(data), ()):
            values = known.unpack(data)
            if known.pick(values) == known.expected:
                break
        else:
            known = self._learn(data)
            values = known.unpack(data)
        stamp = values[known.stamp] * NS + values[known.stamp + 1]
        return known.layout, stamp, [values[block] for block in known.blocks]

    def _learn(self, data: bytes) -> _Unpacker:
        layout = learn(self.kind, data, self.wire)
        if self._layouts >= _MAX_LAYOUTS:  # a publisher whose texts never repeat
            self._known.clear()
            self._texts.clear()
            self._layouts = 0
        names = self._texts.setdefault(layout.names, layout.names)
        frame_id = self._texts.setdefault(layout.frame_id, layout.frame_id)
        layout = Layout(
            layout.length,
            layout.little,
            frame_id,
            names,
            layout.stamp,
            layout.constant,
            layout.blocks,
        )
        known = _Unpacker(layout, data, self.wire)
        self._known.setdefault(layout.length, []).insert(0, known)
        self._layouts += 1
        return known


def joint_state_decoder() -> Decoder[JointStateSample]:
    """A decoder of sensor_msgs/JointState."""
    return Decoder(JOINT_STATE)


def imu_decoder() -> Decoder[ImuSample]:
    """A decoder of sensor_msgs/Imu."""
    return Decoder(IMU)


def payload_decoder() -> Decoder[PayloadSample]:
    """A decoder of geometry_msgs/InertiaStamped."""
    return Decoder(PAYLOAD)
