"""Writes an MCAP file: chunks with checksums, and an index.

The writer of the mcap package ends a chunk only when it is full, so a process that is killed may
lose minutes of a slow recording; here the caller ends chunks. Records are those of that package.
"""

import struct
from dataclasses import dataclass, field
from typing import BinaryIO, Literal

import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode

from ugv_acceptance.bag.chunks import crc32, pack
from ugv_acceptance.bag.mcap_index import MAGIC

Compression = Literal['zstd', 'lz4', '']
_MESSAGE = struct.Struct('<BQHIQQ')


@dataclass(slots=True)
class _Open:
    """The chunk being filled; `at` holds (log time, offset) of each message by channel id."""

    parts: list[bytes] = field(default_factory=list)
    size: int = 0
    first: int = 0
    last: int = 0
    at: dict[int, list[tuple[int, int]]] = field(default_factory=dict)


class McapWriter:
    """Writes MCAP records to `file`, which the caller closes; all times are in ns."""

    def __init__(self, file: BinaryIO, library: str, compression: Compression = 'zstd') -> None:
        self._file = file
        self._compression = compression
        self._zstd = zstandard.ZstdCompressor(level=3)
        self._schemas: dict[tuple[str, str, bytes], records.Schema] = {}
        self._channels: list[records.Channel] = []
        self._chunks: list[records.ChunkIndex] = []
        self._counts: dict[int, int] = {}
        self._open = _Open()
        self._pos = 0
        self._put(MAGIC + _record(records.Header('ros2', library)))

    @property
    def written(self) -> int:
        """Number of bytes written, up to the end of the last whole record."""
        return self._pos

    @property
    def counts(self) -> dict[int, int]:
        """Number of messages written, by channel id."""
        return self._counts

    @property
    def pending(self) -> tuple[int, int] | None:
        """Bytes and first log time of the messages in the open chunk, None if it has none."""
        return (self._open.size, self._open.first) if self._open.at else None

    def channel(self, topic: str, type_: str, schema: str, metadata: dict[str, str]) -> int:
        """Create a channel of a ROS 2 type and return its id; `schema` is the type's definition."""
        known = self._schema(type_, 'ros2msg', schema.encode())
        return self._add(topic, 'cdr', metadata, known)

    def copy(self, channel: records.Channel, schema: records.Schema | None) -> int:
        """Create a channel like one of another file and return its id; `schema` may be None."""
        known = 0 if schema is None else self._schema(schema.name, schema.encoding, schema.data)
        return self._add(channel.topic, channel.message_encoding, channel.metadata, known)

    def _schema(self, name: str, encoding: str, data: bytes) -> int:
        key = (name, encoding, data)
        if key not in self._schemas:
            number = len(self._schemas) + 1
            self._schemas[key] = records.Schema(number, data, encoding, name)
            self._append(_record(self._schemas[key]))
        return self._schemas[key].id

    def _add(self, topic: str, encoding: str, metadata: dict[str, str], schema: int) -> int:
        number = len(self._channels) + 1
        channel = records.Channel(number, topic, encoding, metadata, schema)
        self._channels.append(channel)
        self._counts[number] = 0
        self._append(_record(channel))
        return number

    def message(
        self, channel: int, log_time: int, data: bytes, published: int | None = None
    ) -> None:
        """Add a message to the open chunk; `published` is by default the log time."""
        sent = log_time if published is None else published
        chunk = self._open
        if chunk.at:
            chunk.first, chunk.last = min(chunk.first, log_time), max(chunk.last, log_time)
        else:
            chunk.first = chunk.last = log_time
        chunk.at.setdefault(channel, []).append((log_time, chunk.size))
        head = (5, 22 + len(data), channel, self._counts[channel] & 0xFFFFFFFF, log_time, sent)
        self._counts[channel] += 1
        self._append(_MESSAGE.pack(*head))
        self._append(data)

    def end_chunk(self) -> None:
        """Write the open chunk, unless it is empty, and flush it to the operating system."""
        chunk = self._open
        if not chunk.size:
            return
        self._open = _Open()
        content = b''.join(chunk.parts)
        packed = pack(self._compression, content, self._zstd)
        start = self._pos
        record = records.Chunk(
            self._compression, packed, chunk.last, chunk.first, crc32(content), len(content)
        )
        # One write for chunk and indexes: a process that is killed seldom leaves a part of one.
        out = [_record(record)]
        length = end = len(out[0])
        offsets = {}
        for channel, at in chunk.at.items():
            offsets[channel] = start + end
            out.append(_record(records.MessageIndex(channel, at)))
            end += len(out[-1])
        self._put(b''.join(out))
        self._chunks.append(
            records.ChunkIndex(
                length,
                start,
                self._compression,
                len(packed),
                chunk.last,
                self._pos - start - length,
                offsets,
                chunk.first,
                len(content),
            )
        )
        self._file.flush()

    def span(self) -> tuple[int, int]:
        """Return the first and last log time of the chunks written; (0, 0) without messages."""
        held = [c for c in self._chunks if c.message_index_offsets]
        if not held:
            return 0, 0
        return min(c.message_start_time for c in held), max(c.message_end_time for c in held)

    def finish(self) -> None:
        """Write the open chunk and the summary, which completes the file."""
        self.end_chunk()
        self._put(_record(records.DataEnd(0)))
        start = self._pos
        summary = b''
        offsets = []
        groups: list[tuple[Opcode, list[records.McapRecord]]] = [
            (Opcode.SCHEMA, list(self._schemas.values())),
            (Opcode.CHANNEL, list(self._channels)),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, list(self._chunks)),
        ]
        for opcode, group in groups:
            content = b''.join(_record(record) for record in group)
            if content:
                offsets.append(records.SummaryOffset(opcode, start + len(summary), len(content)))
            summary += content
        offset_start = start + len(summary)
        summary += b''.join(_record(offset) for offset in offsets)
        footer = struct.pack('<BQQQ', Opcode.FOOTER, 20, start, offset_start)
        self._put(summary + footer + struct.pack('<I', crc32(summary + footer)) + MAGIC)
        self._file.flush()

    def _statistics(self) -> records.Statistics:
        first, last = self.span()
        return records.Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_end_time=last,
            message_start_time=first,
            metadata_count=0,
            schema_count=len(self._schemas),
        )

    def _append(self, part: bytes) -> None:
        self._open.parts.append(part)
        self._open.size += len(part)

    def _put(self, data: bytes) -> None:
        left = memoryview(data)
        while left:  # a file without a buffer may take a part
            left = left[self._file.write(left) :]
        self._pos += len(data)


def _record(record: records.McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data
