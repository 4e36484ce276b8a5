"""The index of an MCAP file (its channels and chunks), read from the file's summary.

salvage.py makes the same index by scanning a file whose summary is missing or wrong.
"""

import os
import struct
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import BinaryIO, TypeVar

from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError

from ugv_acceptance import BadBag
from ugv_acceptance.bag.chunks import (
    HEAD_BYTES,
    MAX_CHUNK_BYTES,
    ChunkHead,
    Walked,
    chunk_head,
    crc32,
)

MAGIC = b'\x89MCAP0\r\n'
# Key of a channel's metadata that says where its messages come from, and its one value.
ORIGIN, SIMULATED = 'origin', 'simulated'
# That of the quality of service which its publishers offered.
QOS = 'offered_qos_profiles'
UNKNOWN = '?'  # the type of a channel whose schema was not found
_OFFSET = struct.Struct('<HQ')  # of a channel's message index
_FOOTER_BYTES = 29 + len(MAGIC)
_MAX_SUMMARY_BYTES = 1 << 30


@dataclass(frozen=True, slots=True)
class Channel:
    """A channel of one file: topic, ROS type ('' if it has no schema), encoding of messages.

    `origin` is what its metadata say its messages come from, `qos` what its publishers offered (as
    YAML): '' where they say nothing.
    """

    id: int
    topic: str
    type: str
    encoding: str
    origin: str = ''
    qos: str = ''


@dataclass(frozen=True, slots=True)
class Piece:
    """A part of a file that can be read on its own: a chunk, or message records without a chunk.

    `start`, `length` in bytes; `first`, `last` log times in ns; `head` is None without a chunk;
    `indexes` gives the position of each channel's MessageIndex in the file, None without one.
    """

    start: int
    length: int
    first: int
    last: int
    head: ChunkHead | None = None
    indexes: dict[int, int] | None = None
    index_length: int = 0


@dataclass(slots=True)
class McapIndex:
    """The index of one MCAP file: channels, pieces, and `counts` of messages by channel id.

    `protected` says that the whole data section has a correct checksum, which is verified only if
    the file is scanned anyway. `salvaged` is a sentence if the file breaks off; `findings` are
    sentences about what is odd.
    """

    size: int
    channels: dict[int, Channel] = field(default_factory=dict)
    pieces: list[Piece] = field(default_factory=list)
    counts: dict[int, int] = field(default_factory=dict)
    protected: bool = False
    salvaged: str | None = None
    findings: list[str] = field(default_factory=list)


Record = TypeVar('Record')


def pread(file: BinaryIO, start: int, length: int) -> bytes:
    """Read `length` bytes of the file from `start`, fewer at its end."""
    return os.pread(file.fileno(), max(length, 0), start)


def parse(read: Callable[[ReadDataStream], Record], content: bytes, what: str) -> Record:
    """Parse the content of a record; BadBag if it is garbled. `what` names it in the error."""
    try:
        return read(_Content(content))
    except (McapError, struct.error, ValueError, KeyError) as error:
        raise BadBag(f'{what}: damaged record ({error!r})') from error


class _Content(ReadDataStream):
    """The content of a record, as the mcap package reads it, without a file object in between."""

    def __init__(self, content: bytes) -> None:
        self._content = content
        self._count = 0

    def read(self, length: int) -> bytes:
        """Return the next `length` bytes; fewer at the end, and an error beyond it."""
        if length == 0:
            return b''
        data = self._content[self._count : self._count + length]
        if not data:
            raise EndOfFile
        self._count += len(data)
        return data

    def read_prefixed_string(self) -> str:
        """Return the text that follows its length."""
        start = self._count + 4
        stop = start + int.from_bytes(self._content[start - 4 : start], 'little')
        if stop > len(self._content) or start > len(self._content):
            return super().read_prefixed_string()  # which says what is missing
        self._count = stop
        return self._content[start:stop].decode()


def define(index: McapIndex, schemas: dict[int, str], found: Iterable[tuple[int, bytes]]) -> None:
    """Add Schema and Channel records (opcode, content) to `index`; garbled ones become findings."""
    for opcode, content in found:
        try:
            if opcode == 3:
                schema = parse(records.Schema.read, content, 'schema')
                schemas[schema.id] = schema.name
            elif opcode == 4:
                channel = parse(records.Channel.read, content, 'channel')
                index.channels[channel.id] = Channel(
                    channel.id,
                    channel.topic,
                    schemas.get(channel.schema_id, UNKNOWN) if channel.schema_id else '',
                    channel.message_encoding,
                    channel.metadata.get(ORIGIN, ''),
                    channel.metadata.get(QOS, ''),
                )
        except BadBag as error:  # noqa: PERF203 (one garbled record spoils no other)
            index.findings.append(str(error))


def definitions(data: memoryview, walked: Walked) -> list[tuple[int, bytes]]:
    """Return the Schema and Channel records found by a walk, schemas first."""
    held = [(op, bytes(data[at : at + n])) for op, at, n in walked.others if op in (3, 4)]
    return sorted(held, key=lambda item: item[0])


class NoIndex(BadBag):
    """An intact file that was written without an index: it is scanned, without a finding."""


def from_summary(file: BinaryIO, max_chunk_bytes: int = MAX_CHUNK_BYTES) -> McapIndex:
    """Read the index from a file's summary; BadBag says why the summary cannot be used."""
    size = os.fstat(file.fileno()).st_size
    summary = _summary(file, size)
    index = McapIndex(size)
    schemas: dict[int, str] = {}
    chunks: list[records.ChunkIndex] = []
    statistics: records.Statistics | None = None
    pos = 0
    while pos + 9 <= len(summary):
        opcode, length = summary[pos], int.from_bytes(summary[pos + 1 : pos + 9], 'little')
        content = summary[pos + 9 : pos + 9 + length]
        if len(content) < length:
            raise BadBag('its summary is truncated')
        if opcode in (3, 4):
            define(index, schemas, [(opcode, content)])
        elif opcode == 8:
            chunks.append(_chunk_index(content))
        elif opcode == 11:
            statistics = parse(records.Statistics.read, content, 'statistics')
        pos += 9 + length
    _check(index, chunks, statistics)
    index.pieces = _pieces(index, file, chunks, max_chunk_bytes)
    return index


def _chunk_index(content: bytes) -> records.ChunkIndex:
    """Parse the index of a chunk; of many topics, the package would take most of opening a file."""
    length = int.from_bytes(content[32:36], 'little')
    usual = length % 10 == 0 and 36 + length <= len(content)
    without = content[:32] + bytes(4) + content[36 + length :] if usual else content
    index: records.ChunkIndex = parse(records.ChunkIndex.read, without, 'chunk index')
    if usual:
        index.message_index_offsets = dict(_OFFSET.iter_unpack(content[36 : 36 + length]))
    return index


def _summary(file: BinaryIO, size: int) -> bytes:
    footer = pread(file, max(size - _FOOTER_BYTES, 0), _FOOTER_BYTES)
    if size < len(MAGIC) + _FOOTER_BYTES or footer[-8:] != MAGIC or footer[0] != 2:
        raise BadBag('it has no closing MCAP records')
    start, _, crc = struct.unpack_from('<QQI', footer, 9)
    length = size - _FOOTER_BYTES - start
    if not start:
        raise NoIndex('it has no summary')
    if start < len(MAGIC) or not 0 <= length <= _MAX_SUMMARY_BYTES:
        raise BadBag(f'its footer points to byte {start} of {size} for the summary')
    summary = pread(file, start, length)
    if crc and crc32(summary + footer[:25]) != crc:
        raise BadBag('the checksum (CRC-32) of its summary does not match')
    return summary


def _check(
    index: McapIndex, chunks: list[records.ChunkIndex], statistics: records.Statistics | None
) -> None:
    """Raise BadBag unless the summary holds all that reading by index needs."""
    if statistics is None:
        raise NoIndex('its summary has no statistics')
    counts = {c: n for c, n in statistics.channel_message_counts.items() if n}
    missing = sorted(set(counts) - set(index.channels))
    if missing:
        raise NoIndex(f'its summary does not describe channels {missing}')
    if any(index.channels[c].type == UNKNOWN for c in counts):
        raise NoIndex('its summary does not name the types of its channels')
    if statistics.message_count and not counts:
        raise NoIndex('its statistics do not count by channel')
    if not chunks and statistics.message_count:
        raise NoIndex('it lists no chunks')
    if len(chunks) != statistics.chunk_count:
        raise BadBag(
            f'its summary lists {len(chunks)} chunks, its statistics {statistics.chunk_count}'
        )
    index.counts = counts
    if sum(counts.values()) != statistics.message_count:
        index.findings.append(
            f'statistics: {statistics.message_count} messages in all, '
            f'{sum(counts.values())} in its channels'
        )


def _pieces(
    index: McapIndex, file: BinaryIO, chunks: list[records.ChunkIndex], max_chunk_bytes: int
) -> list[Piece]:
    pieces = []
    before = len(MAGIC)
    for chunk in sorted(chunks, key=lambda c: c.chunk_start_offset):
        start = chunk.chunk_start_offset
        at = f'chunk at byte {start}'
        if start < before or start + chunk.chunk_length > index.size:
            raise BadBag(f'its index places a {at}, inside another or outside the file')
        head = chunk_head(pread(file, start, HEAD_BYTES))
        if head.length != chunk.chunk_length:
            raise BadBag(f'{at}: the index says {chunk.chunk_length} bytes, it has {head.length}')
        before = start + head.length
        if too_big(head, max_chunk_bytes):
            index.findings.append(f'{at} not read: {too_big(head, max_chunk_bytes)}')
            continue
        pieces.append(_indexed_piece(chunk, start, head, index.size))
    return pieces


def _indexed_piece(chunk: records.ChunkIndex, start: int, head: ChunkHead, size: int) -> Piece:
    stop = start + head.length
    length = chunk.message_index_length
    offsets = chunk.message_index_offsets
    inside = offsets and stop <= min(offsets.values()) <= max(offsets.values()) < stop + length
    if not inside or stop + length > size or length > head.length + (1 << 20):
        return Piece(start, head.length, head.first, head.last, head)
    return Piece(start, head.length, head.first, head.last, head, offsets, length)


def too_big(head: ChunkHead, max_chunk_bytes: int) -> str:
    """Return why a chunk is refused for its size, '' if it is not."""
    if max(head.size, head.packed) <= max_chunk_bytes:
        return ''
    claimed = max(head.size, head.packed) / (1 << 20)
    return f'it claims {claimed:.0f} MiB, at most {max_chunk_bytes / (1 << 20):.0f} are allowed'
