"""Decodes single serialised messages (CDR or ROS 1) of JointState, Imu and InertiaStamped.

A message's layout, that is every length and text in it, is learnt once by walking it. Later
messages of the same layout are unpacked by one precompiled `struct.Struct`; all bytes that define
the layout are compared on every message, so a message is never decoded by a wrong layout. No ROS
installation is needed.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from operator import itemgetter
from typing import Any, Generic, NamedTuple, TypeVar

from ugv_acceptance.bag.layout import (
    Blocks,
    Cursor,
    Layout,
    Names,
    Wire,
    imu_body,
    joint_state_body,
    learn,
    payload_body,
)

NS = 1_000_000_000
_MAX_LAYOUTS = 256


class JointStateSample(NamedTuple):
    """A decoded sensor_msgs/JointState; SI, radians, `stamp` in ns.

    Each of `position`, `velocity`, `effort` is empty or as long as `names`; velocities and efforts
    of another length are left out. Messages with equal
    names share one `names` object.
    """

    stamp: int
    frame_id: str
    names: tuple[str, ...]
    position: tuple[float, ...]
    velocity: tuple[float, ...]
    effort: tuple[float, ...]


class ImuSample(NamedTuple):
    """A decoded sensor_msgs/Imu: quaternion x, y, z, w, rad/s, m/s2, `stamp` in ns.

    `*_covariance_0` is element 0 of each covariance: -1 means "not measured" (REP-145).
    """

    stamp: int
    frame_id: str
    orientation: tuple[float, ...]
    angular_velocity: tuple[float, ...]
    linear_acceleration: tuple[float, ...]
    orientation_covariance_0: float
    angular_velocity_covariance_0: float
    linear_acceleration_covariance_0: float


class PayloadSample(NamedTuple):
    """A decoded geometry_msgs/InertiaStamped: mass (kg), centre of gravity (m) in `frame_id`."""

    stamp: int
    frame_id: str
    mass: float
    com: tuple[float, ...]


def _joint_state(layout: Layout, stamp: int, blocks: list[tuple[float, ...]]) -> JointStateSample:
    return JointStateSample(stamp, layout.frame_id, layout.names, *blocks)


def _imu(layout: Layout, stamp: int, blocks: list[tuple[float, ...]]) -> ImuSample:
    v = blocks[0]
    return ImuSample(stamp, layout.frame_id, v[0:4], v[13:16], v[25:28], v[4], v[16], v[28])


def _payload(layout: Layout, stamp: int, blocks: list[tuple[float, ...]]) -> PayloadSample:
    v = blocks[0]
    return PayloadSample(stamp, layout.frame_id, v[0], v[1:4])


Sample = TypeVar('Sample', bound=JointStateSample | ImuSample | PayloadSample)


@dataclass(frozen=True, slots=True)
class Kind(Generic[Sample]):
    """A message type that can be decoded: its ROS 2 name, the walk over its body, its sample.

    `body` walks what follows the header; `sample` makes the sample from layout, stamp and numbers.
    """

    type: str
    body: Callable[[Cursor], tuple[Names, Blocks]]
    sample: Callable[[Layout, int, list[tuple[float, ...]]], Sample]


JOINT_STATE = Kind('sensor_msgs/msg/JointState', joint_state_body, _joint_state)
IMU = Kind('sensor_msgs/msg/Imu', imu_body, _imu)
PAYLOAD = Kind('geometry_msgs/msg/InertiaStamped', payload_body, _payload)


class _Unpacker:
    """A layout compiled to one `struct` call, which also unpacks the constant bytes to compare."""

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
    """Decodes messages of one kind one at a time; remembers the layouts it has seen.

    `one(data)` returns the sample or raises BadSample, never anything else. Equal `names` and
    `frame_id` of two samples are the same object.
    """

    def __init__(self, kind: Kind[Sample], wire: Wire = 'cdr') -> None:
        self.kind = kind
        self.wire = wire
        self._known: dict[int, list[_Unpacker]] = {}
        self._texts: dict[object, Any] = {}
        self._layouts = 0

    def one(self, data: bytes) -> Sample:
        """Decode the message in `data`; BadSample says what is wrong with which field."""
        layout, stamp, blocks = self.raw(data)
        return self.kind.sample(layout, stamp, blocks)

    def raw(self, data: bytes) -> tuple[Layout, int, list[tuple[float, ...]]]:
        """Return layout, stamp in ns and the float64 blocks of the message in `data`."""
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
        layout = learn(self.kind.body, data, self.wire)
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
    """Return a new decoder of sensor_msgs/JointState in CDR."""
    return Decoder(JOINT_STATE)


def imu_decoder() -> Decoder[ImuSample]:
    """Return a new decoder of sensor_msgs/Imu in CDR."""
    return Decoder(IMU)


def payload_decoder() -> Decoder[PayloadSample]:
    """Return a new decoder of geometry_msgs/InertiaStamped in CDR."""
    return Decoder(PAYLOAD)
