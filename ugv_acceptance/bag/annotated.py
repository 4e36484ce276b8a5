"""Copies a recording message by message into one MCAP file and adds further topics.

Both are merged in order of log time, so that only a chunk or two is held in memory.
"""

import heapq
import os
import struct
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path

from mcap import records
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader

from ugv_acceptance import BadBag, __version__
from ugv_acceptance.bag.atomic_files import is_stream, naming, whole
from ugv_acceptance.bag.mcap_writer import McapWriter
from ugv_acceptance.bag.raw import Logged, messages_of
from ugv_acceptance.bag.reader import Bag
from ugv_acceptance.bag.reading import Member, normal_type
from ugv_acceptance.bag.writer import definition_of

CHUNK = 1 << 20
# Messages between two calls of `progress`.
STRIDE = 4096
# What the mcap package raises for a broken file.
_BROKEN = (McapError, OSError, ValueError, KeyError, struct.error)


@dataclass(frozen=True, slots=True)
class Said:
    """A message to add to a recording: log time (ns), topic, content as CDR."""

    log_time: int
    topic: str
    data: bytes


def write_annotated(
    path: Path,
    bag: Bag,
    types: dict[str, str],
    said: Iterable[Said],
    progress: Callable[[int], None] = lambda _: None,
) -> int:
    """Write a copy of a recording with the messages `said` added; return the number copied.

    `types` gives the ROS 2 type of each added topic, `said` is in order of log time, except for
    messages that are late on purpose; `progress` is called with the log time reached (ns). Every
    chunk has a checksum. The file gets its name only when it is complete. Raises AcceptanceError if
    it cannot be written.
    """
    with naming(path), whole(path) as file:
        writer = McapWriter(file, f'ugv_acceptance {__version__}')
        count = _write(writer, bag, types, said, progress)
        writer.finish()
        file.flush()
        if not is_stream(path):
            os.fsync(file.fileno())
    return count


def _write(
    writer: McapWriter,
    bag: Bag,
    types: dict[str, str],
    said: Iterable[Said],
    progress: Callable[[int], None],
) -> int:
    own = {name: _new(writer, name, kind) for name, kind in types.items()}
    streams: list[Iterable[_Copy | Said]] = [_copied(writer, bag, m) for m in bag.members]
    count = 0
    merged = heapq.merge(*streams, said, key=attrgetter('log_time'))
    for k, message in enumerate(merged):
        if isinstance(message, Said):
            writer.message(own[message.topic], message.log_time, message.data)
        else:
            logged, channel = message.logged, message.channel
            writer.message(channel, logged.log_time, logged.data, logged.published)
            count += 1
        if (held := writer.pending) and held[0] >= CHUNK:
            writer.end_chunk()
        if not k % STRIDE:
            progress(message.log_time)
    return count


@dataclass(frozen=True, slots=True)
class _Copy:
    """A recorded message and its channel in the new file."""

    log_time: int
    logged: Logged
    channel: int


def _copied(writer: McapWriter, bag: Bag, member: Member) -> Iterator[_Copy]:
    """Return one file's messages; its channels are created now, at the new file's beginning."""
    channels = _channels(writer, member)
    messages = _readable(messages_of(member, set(bag.topics)))
    return (_Copy(m.log_time, m, channels[m.channel]) for m in messages if m.channel in channels)


def _readable(messages: Iterator[Logged]) -> Iterator[Logged]:
    """Yield messages up to where their file breaks off, which the reader has reported already."""
    with suppress(BadBag):
        yield from messages


def _channels(writer: McapWriter, member: Member) -> dict[int, int]:
    """Return the new channel id for each channel of a file that is copied."""
    if member.storage == 'mcap':
        schemas, channels = _definitions(member)
        return {k: writer.copy(c, schemas.get(c.schema_id)) for k, c in channels.items()}
    return {k: _new(writer, c.topic, c.type) for k, c in member.index.channels.items()}


def _new(writer: McapWriter, topic: str, kind: str) -> int:
    """Return the id of a new channel; a type unknown to Jazzy is written without its definition."""
    kind = normal_type(kind)
    try:
        text, type_hash = definition_of(kind)
    except BadBag:
        return writer.copy(records.Channel(0, topic, 'cdr', {'type': kind}, 0), None)
    return writer.channel(topic, kind, text, {'topic_type_hash': type_hash})


def _definitions(
    member: Member,
) -> tuple[dict[int, records.Schema], dict[int, records.Channel]]:
    """Return the schemas and channels of an MCAP file, from its summary or else by scanning it."""
    with member.content.open('rb') as file:
        try:
            summary = make_reader(file).get_summary()
        except _BROKEN:
            summary = None
        if summary is not None and _says_all(member, summary.schemas, summary.channels):
            return dict(summary.schemas), dict(summary.channels)
        file.seek(0)
        schemas: dict[int, records.Schema] = {}
        channels: dict[int, records.Channel] = {}
        with suppress(*_BROKEN):  # the reader has reported where the file breaks off
            for record in StreamReader(file).records:
                if isinstance(record, records.Schema):
                    schemas[record.id] = record
                elif isinstance(record, records.Channel):
                    channels[record.id] = record
    return schemas, channels


def _says_all(
    member: Member, schemas: dict[int, records.Schema], channels: dict[int, records.Channel]
) -> bool:
    there = set(member.index.channels) <= set(channels)
    return there and all(c.schema_id in (0, *schemas) for c in channels.values())
