"""A recording as columns of numbers, and the MCAP file of it: 9,000 messages in some 30 ms."""

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from ugv_acceptance.bag.encode import imu_cdr, inertia_cdr, joint_state_cdr
from ugv_acceptance.bag.mcap_writer import McapWriter
from ugv_acceptance.bag.writer import definition_of
from ugv_acceptance.type_aliases import Floats

Times = NDArray[np.int64]
# A mask, places or a slice of messages.
Keep = NDArray[np.bool_] | NDArray[np.int64] | slice
JOINT_STATE = 'sensor_msgs/msg/JointState'
IMU = 'sensor_msgs/msg/Imu'
INERTIA = 'geometry_msgs/msg/InertiaStamped'
NS = 1_000_000_000
EPOCH = 1_750_000_000 * NS
# Log time (ns) that a chunk spans at most.
CHUNK = NS // 2
# Values that no recording holds: where they are found in a template, numbers are filled in.
_MARK = 1.2345e250


class Message(NamedTuple):
    """A serialised message with its log time (ns)."""

    log: int
    topic: str
    type: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Joints:
    """JointState messages of one layout: log time and stamp (n,) in ns, the rest (n, names).

    `velocity` and `effort` None: left out of the messages.
    """

    names: tuple[str, ...]
    log: Times
    stamp: Times
    position: Floats
    velocity: Floats | None = None
    effort: Floats | None = None
    topic: str = '/joint_states'

    def kept(self, keep: Keep) -> 'Joints':
        """Return those messages alone: a mask, places or a slice."""
        speed = None if self.velocity is None else self.velocity[keep]
        effort = None if self.effort is None else self.effort[keep]
        held = (self.log[keep], self.stamp[keep], self.position[keep], speed, effort)
        return Joints(self.names, *held, self.topic)

    def messages(self) -> list[Message]:
        """Return the messages in the order of the columns."""
        tables = [self.position, self.velocity, self.effort]
        marked = [[] if t is None else [_MARK * (i + 1)] * t.shape[1] for i, t in enumerate(tables)]
        template = joint_state_cdr(0, '', self.names, *marked)
        pairs = zip(marked, tables, strict=True)
        filled = [(template.index(_bytes(m)), t) for m, t in pairs if t is not None and m]
        return _messages(self, JOINT_STATE, template, filled)


@dataclass(frozen=True, slots=True)
class Imu:
    """Imu messages: quaternion x, y, z, w (n, 4), rate (n, 3) rad/s, specific force (n, 3) m/s2.

    `covariances` are the first elements of the three covariances; -1 means "not given".
    """

    log: Times
    stamp: Times
    orientation: Floats
    rate: Floats
    force: Floats
    frame: str = 'imu_link'
    covariances: tuple[float, float, float] = (0.0, 0.0, 0.0)
    topic: str = '/imu/data'

    def kept(self, keep: Keep) -> 'Imu':
        """Return those messages alone: a mask, places or a slice."""
        felt = (self.orientation[keep], self.rate[keep], self.force[keep])
        return replace(self, log=self.log[keep], stamp=self.stamp[keep]).with_values(*felt)

    def with_values(self, orientation: Floats, rate: Floats, force: Floats) -> 'Imu':
        """Return the same messages with other numbers."""
        return replace(self, orientation=orientation, rate=rate, force=force)

    def messages(self) -> list[Message]:
        """Return the messages in the order of the columns."""
        tables = (self.orientation, self.rate, self.force)
        marked = [[_MARK * (i + 1)] * t.shape[1] for i, t in enumerate(tables)]
        first = [(c, *(0.0,) * 8) for c in self.covariances]
        covariances = first[0], first[1], first[2]
        template = imu_cdr(0, self.frame, marked[0], marked[1], marked[2], covariances)
        pairs = zip(marked, tables, strict=True)
        filled = [(template.index(_bytes(m)), t) for m, t in pairs]
        return _messages(self, IMU, template, filled)


@dataclass(frozen=True, slots=True)
class Payloads:
    """Payload messages: mass (n,) in kg, centre of gravity (n, 3) in m in the axes of `frame`."""

    log: Times
    mass: Floats
    com: Floats
    frame: str = 'gripper_link'
    topic: str = '/payload'

    def messages(self) -> list[Message]:
        """Return the messages in the order of the columns."""
        rows = zip(self.log.tolist(), self.mass.tolist(), self.com.tolist(), strict=True)
        return [
            Message(t, self.topic, INERTIA, inertia_cdr(t, self.frame, mass, com))
            for t, mass, com in rows
        ]


Part = Joints | Imu | Payloads


@dataclass(frozen=True, slots=True)
class Form:
    """How a file holds its messages, where it is not as rosbag2 writes it.

    `encoding` is that of the messages, `schema` that of the definitions, which `empty` leaves out;
    `types` are other names for types. `silent` are topics (name, type) that have no message.
    """

    encoding: str = 'cdr'
    schema: str = 'ros2msg'
    empty: bool = False
    types: dict[str, str] = field(default_factory=dict)
    silent: tuple[tuple[str, str], ...] = ()


PLAIN = Form()


def _bytes(values: Sequence[float]) -> bytes:
    return struct.pack(f'<{len(values)}d', *values)


def _messages(
    part: Joints | Imu, kind: str, template: bytes, tables: list[tuple[int, Floats]]
) -> list[Message]:
    """Fill stamps and tables (place in the template, rows of numbers) into copies of a template."""
    count, size = len(part.log), len(template)
    content = np.tile(np.frombuffer(template, np.uint8), (count, 1))
    stamp = np.stack([part.stamp // NS, part.stamp % NS], axis=1).astype('<u4')
    content[:, 4:12] = stamp.view(np.uint8)
    for place, table in tables:
        raw = np.ascontiguousarray(table, dtype='<f8').view(np.uint8)
        content[:, place : place + raw.shape[1]] = raw
    data = content.tobytes()
    return [
        Message(t, part.topic, kind, data[k * size : (k + 1) * size])
        for k, t in enumerate(part.log.tolist())
    ]


def messages_of(parts: Iterable[Part]) -> list[Message]:
    """Return the messages of all parts in the order of their log times."""
    return sorted((m for part in parts for m in part.messages()), key=lambda m: m.log)


def write(path: Path, messages: Iterable[Message], form: Form = PLAIN) -> Path:
    """Write messages, in their order, as one MCAP file."""
    channels: dict[str, int] = {}
    with path.open('wb') as file:
        writer = McapWriter(file, 'ugv_acceptance test')
        for topic, kind in form.silent:
            channels[topic] = _channel(writer, topic, kind, form)
        for log, topic, kind, data in messages:
            if topic not in channels:
                channels[topic] = _channel(writer, topic, kind, form)
            if writer.pending and abs(log - writer.pending[1]) >= CHUNK:
                writer.end_chunk()
            writer.message(channels[topic], log, data)
        writer.finish()
    return path


def _channel(writer: McapWriter, topic: str, kind: str, form: Form) -> int:
    text = b'' if form.empty or form.schema != 'ros2msg' else definition_of(kind)[0].encode()
    name = form.types.get(kind, kind)
    known = Schema(id=0, data=text, encoding=form.schema, name=name)
    return writer.copy(Channel(0, topic, form.encoding, {}, 0), known)
