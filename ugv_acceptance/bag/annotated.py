"""Copies the messages of a recording into one MCAP file and adds further topics.

Both are merged in order of log time, so that only a chunk or two is held in memory.
"""

import os
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np
from mcap import records
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader

from ugv_acceptance import BadBag, __version__
from ugv_acceptance.bag.atomic_files import is_stream, naming, whole
from ugv_acceptance.bag.beside_messages import extras
from ugv_acceptance.bag.blocks import Block, merged
from ugv_acceptance.bag.mcap_index import pread
from ugv_acceptance.bag.mcap_writer import McapWriter
from ugv_acceptance.bag.raw import blocks_of, lanes
from ugv_acceptance.bag.reader import Bag
from ugv_acceptance.bag.reading import Member, normal_type
from ugv_acceptance.bag.writer import definition_of

CHUNK = 1 << 20
# What the mcap package raises for a broken file.
_BROKEN = (McapError, OSError, ValueError, KeyError, struct.error)


def write_annotated(
    path: Path,
    bag: Bag,
    types: Mapping[str, str],
    said: Iterable[Block],
    progress: Callable[[int], None] = lambda _: None,
) -> int:
    """Write a copy of a recording with the messages `said` added; return the number copied.

    `types` gives the ROS 2 type of each added topic, whose place in it (0, 1, ...) is the channel
    of a message in `said`. They are in order of log time, except for messages that are late on
    purpose; `progress` is called with the log time reached (ns). Attachments and metadata records
    are copied as well. Every chunk has a checksum. The file gets its name only when it is complete.
    Raises AcceptanceError if it cannot be written.
    """
    with naming(path), whole(path) as file:
        writer = McapWriter(file, f'ugv_acceptance {__version__}', level=1)
        count = _write(writer, bag, types, said, progress)
        writer.finish()
        file.flush()
        if not is_stream(path):
            os.fsync(file.fileno())
    return count


def _write(
    writer: McapWriter,
    bag: Bag,
    types: Mapping[str, str],
    said: Iterable[Block],
    progress: Callable[[int], None],
) -> int:
    own = dict(enumerate(_new(writer, name, kind) for name, kind in types.items()))
    # Every file's channels are created now, at the new file's beginning.
    channels = {id(member): _channels(writer, member) for member in bag.members}
    for member in bag.members:
        _copy_beside(writer, member)
    streams = [
        chain.from_iterable(_copied(bag, member, channels[id(member)]) for member in lane)
        for lane in lanes(bag.members)
    ]
    for block in merged([*streams, (_renumbered(part, own) for part in said)]):
        writer.messages(block, CHUNK)
        progress(int(block.log_time[-1]))
    return sum(count for channel, count in writer.counts.items() if channel not in own.values())


def _copy_beside(writer: McapWriter, member: Member) -> None:
    """Copy the attachments and metadata records of a file, byte by byte."""
    if member.storage != 'mcap':
        return
    with member.content.open('rb') as file:
        for extra in extras(file):
            end = extra.start + extra.index.length
            places = range(extra.start, end, CHUNK)
            writer.beside(extra.index, (pread(file, at, min(CHUNK, end - at)) for at in places))


def _copied(bag: Bag, member: Member, channels: Mapping[int, int]) -> Iterator[Block]:
    """Yield one file's messages, with the numbers that its channels have in the new file."""
    # The reader has reported already where a file breaks off.
    with suppress(BadBag):
        for block in blocks_of(member, set(bag.topics)):
            yield _renumbered(block, channels)


def _renumbered(block: Block, channels: Mapping[int, int]) -> Block:
    """Return the messages whose channel has another number in the new file, with that number."""
    old = np.array(sorted(channels), np.int64)
    if not len(old):
        return block.take(slice(0))
    place = np.minimum(np.searchsorted(old, block.channel), len(old) - 1)
    new = np.array([channels[number] for number in old.tolist()], np.int64)[place]
    known = old[place] == block.channel
    block = replace(block, channel=new)
    return block if known.all() else block.take(known)


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
