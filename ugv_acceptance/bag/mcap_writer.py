"""Writes an MCAP file: chunks with checksums, and an index.

The writer of the mcap package ends a chunk only when it is full, so a process that is killed may
lose minutes of a slow recording; here the caller ends chunks. Records are those of that package.
"""

import struct
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import BinaryIO, Literal

import numpy as np
import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from numpy.typing import NDArray

from ugv_acceptance.bag.blocks import RECORD_HEAD, Block, copy_parts, put_rows
from ugv_acceptance.bag.chunks import crc32, pack
from ugv_acceptance.bag.gather import Offsets
from ugv_acceptance.bag.mcap_index import MAGIC

Compression = Literal['zstd', 'lz4', '']
_MESSAGE = struct.Struct('<BQHIQQ')
_INDEX, _ENTRY = struct.Struct('<BQHI'), struct.Struct('<QQ')


@dataclass(slots=True)
class _Open:
    """The chunk being filled; `at` holds the entries of each channel's MessageIndex."""

    parts: list[bytes | memoryview] = field(default_factory=list)
    size: int = 0
    first: int = 0
    last: int = 0
    at: dict[int, list[bytes]] = field(default_factory=dict)

    def span(self, first: int, last: int) -> None:
        """Take that messages from log time `first` to `last` (ns) are added."""
        if self.at:
            first, last = min(self.first, first), max(self.last, last)
        self.first, self.last = first, last


class McapWriter:
    """Writes MCAP records to `file`, which the caller closes; all times are in ns.

    `level` is that of zstd: 1 is half as fast again as 3, for a twelfth more bytes.
    """

    def __init__(
        self, file: BinaryIO, library: str, compression: Compression = 'zstd', level: int = 3
    ) -> None:
        self._file = file
        self._compression = compression
        self._zstd = zstandard.ZstdCompressor(level=level)
        self._schemas: dict[tuple[str, str, bytes], records.Schema] = {}
        self._channels: list[records.Channel] = []
        self._chunks: list[records.ChunkIndex] = []
        self._counts: dict[int, int] = {}
        self._attachments: list[records.McapRecord] = []
        self._metadata: list[records.McapRecord] = []
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
        chunk.span(log_time, log_time)
        chunk.at.setdefault(channel, []).append(_ENTRY.pack(log_time, chunk.size))
        head = (5, 22 + len(data), channel, self._counts[channel] & 0xFFFFFFFF, log_time, sent)
        self._counts[channel] += 1
        self._append(_MESSAGE.pack(*head))
        self._append(data)

    def messages(self, block: Block, full: int) -> None:
        """Add many messages, as `message` adds one; a chunk ends when it has `full` bytes."""
        ends, done = np.cumsum(RECORD_HEAD.itemsize + block.length), 0
        while done < len(block):
            before = int(ends[done - 1]) if done else 0
            room = full - self._open.size + before
            stop = max(done, int(np.searchsorted(ends, room))) + 1
            self._fill(block.take(slice(done, stop)), ends[done:stop] - before)
            done = stop
            if self._open.size >= full:
                self.end_chunk()

    def _fill(self, block: Block, ends: Offsets) -> None:
        """Add messages to the open chunk; their records end at `ends` (n,) from here."""
        chunk, sizes = self._open, RECORD_HEAD.itemsize + block.length
        at = ends - sizes
        chunk.span(int(block.log_time.min()), int(block.log_time.max()))
        entries = np.stack((block.log_time, at + chunk.size), 1).astype('<i8')
        heads = np.empty(len(block), RECORD_HEAD)
        heads['opcode'], heads['length'] = Opcode.MESSAGE, sizes - 9
        for name in ('channel', 'log_time', 'published'):
            heads[name] = getattr(block, name)
        for channel, rows in _by_channel(block.channel):
            count = self._counts[channel]
            heads['sequence'][rows] = (count + np.arange(len(rows))) & 0xFFFFFFFF
            self._counts[channel] = count + len(rows)
            chunk.at.setdefault(channel, []).append(entries[rows].tobytes())
        out = np.empty(int(ends[-1]), np.uint8)
        put_rows(heads, out, at)
        copy_parts((block.data, block.start), (out, at + RECORD_HEAD.itemsize), block.length)
        self._append(out.data)

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
            entries = b''.join(at)
            head = (Opcode.MESSAGE_INDEX, 6 + len(entries), channel, len(entries))
            out.append(_INDEX.pack(*head) + entries)
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

    def beside(
        self, index: records.AttachmentIndex | records.MetadataIndex, parts: Iterable[bytes]
    ) -> None:
        """Add an attachment or a metadata record: all of its bytes, in parts.

        `index` is what the index says of it; its place in this file is filled in.
        """
        held = self._attachments if isinstance(index, records.AttachmentIndex) else self._metadata
        held.append(replace(index, offset=self._pos))
        for part in parts:
            self._put(part)

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
            (Opcode.ATTACHMENT_INDEX, self._attachments),
            (Opcode.METADATA_INDEX, self._metadata),
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
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_end_time=last,
            message_start_time=first,
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )

    def _append(self, part: bytes | memoryview) -> None:
        self._open.parts.append(part)
        self._open.size += len(part)

    def _put(self, data: bytes) -> None:
        left = memoryview(data)
        while left:  # a file without a buffer may take a part
            left = left[self._file.write(left) :]
        self._pos += len(data)


def _by_channel(channel: NDArray[np.int64]) -> list[tuple[int, NDArray[np.intp]]]:
    """Return each channel with the rows (n,) that are its, in the order in which they begin."""
    order = np.argsort(channel, kind='stable')
    parts = np.split(order, np.flatnonzero(np.diff(channel[order])) + 1)
    return [(int(channel[rows[0]]), rows) for rows in sorted(parts, key=lambda rows: int(rows[0]))]


def _record(record: records.McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data
