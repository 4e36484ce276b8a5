"""Moves header stamps of a recording to the time of its replay.

A stamp moves by the time between recording and replay, and advances at the rate of the replay.
Topics of one clock move alike, so that their differences stay. A topic whose stamps are far from
when they were logged has another clock than the recorder's, such as a simulation's.
"""

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from typing import Any

from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Header

NS = 1_000_000_000
# The latest time (ns) that a stamp can hold.
_LAST = 2**31 * NS - 1
# A clock this far (ns) from the recorder's is another clock; one nearer is wrong, and stays so.
FAR = 3600 * NS
# Clocks far from the recorder's that differ by less (ns) are one, whose topics may be late.
SAME = 10 * NS
# A simulation may run faster or slower: drift (ns) of its clock that is not followed.
DRIFT = NS // 2
_HEADER = 'std_msgs/Header'
Move = Callable[[int], int]


@dataclass(slots=True)
class _Clock:
    """A clock that is `offset` (ns) ahead of the recorder's, measured by the topic `leader`."""

    offset: int = 0
    leader: str = ''
    stamp: int = 0

    def follow(self, offset: int, stamp: int) -> None:
        if stamp != self.stamp and abs(offset - self.offset) > DRIFT:
            self.offset = offset
        self.stamp = stamp


@dataclass(slots=True)
class Stamps:
    """Moves the stamps of one round of a replay from `first` (ns, logged) to `began` (ns, now).

    `leaders` are the topics whose stamps advance, so that they measure a clock.
    """

    first: int
    began: int
    rate: float
    leaders: frozenset[str]
    _recorder: _Clock = field(default_factory=_Clock)
    _others: list[_Clock] = field(default_factory=list)
    _clocks: dict[str, _Clock] = field(default_factory=dict)

    def of(self, topic: str, logged: int, stamp: int) -> Move:
        """Return what moves the stamps of a message, by its first stamp and log time (ns)."""
        if topic not in self._clocks and stamp:
            self._clocks[topic] = self._clock(topic, stamp - logged)
        clock = self._clocks.get(topic, self._recorder)
        if clock.leader == topic and stamp:
            clock.follow(stamp - logged, stamp)
        origin = clock.offset + self.first

        def move(stamp: int) -> int:
            # Zero means that no time was given.
            return self.began + int((stamp - origin) / self.rate) if stamp else 0

        return move

    def _clock(self, topic: str, offset: int) -> _Clock:
        if abs(offset) <= FAR:
            return self._recorder
        for clock in self._others:
            if abs(offset - clock.offset) <= SAME:
                return clock
        leads = topic in self.leaders
        clock = _Clock(offset, topic if leads else '')
        if leads:
            self._others.append(clock)
        return clock


def stamp_of(data: bytes) -> int:
    """Return the stamp (ns) of a serialised message that starts with a Header; 0: too short."""
    if len(data) < 12:
        return 0
    sec, nanosec = struct.unpack_from(f'{_order(data)}iI', data, 4)
    return int(sec) * NS + int(nanosec)


def restamped(data: bytes, move: Move) -> bytes:
    """Return a serialised message that starts with a Header, its stamp (ns) moved.

    A stamp cannot be before 1970 or after 2038. A message too short for one stays as it is.
    """
    if len(data) < 12:
        return data
    stamp = struct.pack(f'{_order(data)}iI', *divmod(_bounded(move(stamp_of(data))), NS))
    return data[:4] + stamp + data[12:]


def _order(data: bytes) -> str:
    return '<' if data[1] & 1 else '>'


def _bounded(stamp: int) -> int:
    return min(max(stamp, 0), _LAST)


@dataclass(frozen=True, slots=True)
class Stamped:
    """The places of headers in messages of a type: at the start, and inside (such as in tf's)."""

    kind: Any
    first: bool
    inside: bool

    def moved(self, data: bytes, topic: str, logged: int, stamps: Stamps) -> bytes:
        """Return a serialised message with its stamps moved; a broken one stays as it is."""
        if not self.inside:
            return restamped(data, stamps.of(topic, logged, stamp_of(data))) if self.first else data
        try:
            message = deserialize_message(data, self.kind)
        except Exception:  # noqa: BLE001 - whatever is wrong with it, its listeners are to see it
            return data
        headers = list(_headers(message))
        told = [(h, h.stamp.sec * NS + h.stamp.nanosec) for h in headers]
        if not any(stamp for _, stamp in told):
            return data
        move = stamps.of(topic, logged, next(stamp for _, stamp in told if stamp))
        for header, stamp in told:
            header.stamp.sec, header.stamp.nanosec = divmod(_bounded(move(stamp)), NS)
        moved: bytes = serialize_message(message)
        return moved


def stamped(kind: Any) -> Stamped:  # noqa: ANN401 - a message class
    """Return the places of headers in messages of a class."""
    fields = list(kind.get_fields_and_field_types().values())
    first = bool(fields) and fields[0] == _HEADER
    return Stamped(kind, first, any(map(_has_header, fields[1:] if first else fields)))


@cache
def _has_header(field_type: str) -> bool:
    """Return whether a field's type, such as sequence<geometry_msgs/Pose, 3>, has a header."""
    name = field_type.removeprefix('sequence<').rstrip('>').partition(',')[0].partition('[')[0]
    if name == _HEADER:
        return True
    package, _, kind = name.partition('/')
    if not kind:
        return False
    fields = getattr(import_module(f'{package}.msg'), kind).get_fields_and_field_types()
    return any(map(_has_header, fields.values()))


def _headers(message: Any) -> Iterator[Header]:  # noqa: ANN401 - a message
    for name, kind in message.get_fields_and_field_types().items():
        if not _has_header(kind):
            continue
        value = getattr(message, name)
        for part in value if isinstance(value, list) else [value]:
            if isinstance(part, Header):
                yield part
            else:
                yield from _headers(part)
