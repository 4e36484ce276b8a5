"""Chunks of an MCAP file: parses their head, decompresses them, walks over their records."""

import importlib
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

import lz4.frame  # type: ignore[import-untyped]
import numpy as np
import zstandard

from ugv_acceptance import BadBag
from ugv_acceptance.bag.gather import LEAD, SLACK, Bytes, Offsets
from ugv_acceptance.bag.lz4_frame import Lz4
from ugv_acceptance.type_aliases import Times

FOOTER, MESSAGE, CHUNK, MESSAGE_INDEX, DATA_END = 2, 5, 6, 7, 15
MAX_CHUNK_BYTES = 64 << 20
_RECORD = struct.Struct('<BQ')
_MESSAGE = struct.Struct('<BQH')
_HEAD = struct.Struct('<BQqqQII')
HEAD_BYTES = _HEAD.size + 32 + 8  # enough for any compression we know


def _optional(name: str) -> ModuleType | None:
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


# Optional, for speed: zlib's CRC-32 costs a third of zstd's decompression, ISA-L's a thirtieth.
_isal = _optional('isal.isal_zlib')
crc32: Callable[..., int] = _isal.crc32 if _isal else zlib.crc32


@dataclass(frozen=True, slots=True)
class ChunkHead:
    """The head of a Chunk record: its size in the file, times, compression and checksum.

    `length` is of the whole chunk (bytes); `first`, `last` are log times (ns); `data` is the offset
    of its `packed` bytes of records, which unpack to `size` bytes; a `crc` of 0 means none.
    """

    length: int
    first: int
    last: int
    size: int
    crc: int
    compression: str
    data: int
    packed: int


def chunk_head(head: bytes) -> ChunkHead:
    """Parse the first bytes of a Chunk record; BadBag if they are not the head of a chunk."""
    try:
        opcode, length, first, last, size, crc, text = _HEAD.unpack_from(head)
        compression = head[_HEAD.size : _HEAD.size + text].decode('ascii')
        (packed,) = struct.unpack_from('<Q', head, _HEAD.size + text)
    except (struct.error, UnicodeDecodeError) as error:
        raise BadBag('expected the header of a chunk, which is truncated or damaged') from error
    data = _HEAD.size + text + 8
    if opcode != CHUNK or data + packed > length + 9:
        raise BadBag(f'expected a chunk of {data + packed} bytes, got record {opcode} of {length}')
    return ChunkHead(length + 9, first, last, size, crc, compression, data, packed)


class Buffers:
    """The buffers and decompressors of one reading thread, which grow to the largest chunk."""

    def __init__(self) -> None:
        self._packed = np.zeros(1 << 16, np.uint8)
        self._records = np.zeros(1 << 16, np.uint8)
        self._zstd = zstandard.ZstdDecompressor()
        self._lz4 = Lz4()

    def packed(self, size: int) -> Bytes:
        """Return a buffer with room for `size` bytes of the file and SLACK bytes after them."""
        if self._packed.size < size + SLACK:
            self._packed = np.zeros(size + size // 4 + SLACK, np.uint8)
        return self._packed

    def records(self, head: ChunkHead, chunk: Bytes) -> Bytes:
        """Return a buffer with the chunk's unpacked records, `head.size` bytes from index LEAD on.

        `chunk` holds the Chunk record and SLACK bytes after it. The next call overwrites the
        buffer. Raises BadBag if the chunk does not unpack to what its head says.
        """
        stop = head.data + head.packed
        if head.compression == '':
            if head.size != head.packed:
                raise BadBag(f'expected {head.size} bytes of records, got {head.packed}')
            out = chunk[head.data - LEAD : stop + SLACK]
        else:
            if self._records.size < LEAD + head.size + SLACK:
                room = head.size + head.size // 4
                self._records = np.zeros(LEAD + room + SLACK, np.uint8)
            out = self._records
            self.unpack(
                head.compression, chunk.data[head.data : stop], out.data[LEAD:][: head.size]
            )
        if head.crc and crc32(out.data[LEAD : LEAD + head.size]) != head.crc:
            raise BadBag('its checksum (CRC-32) does not match its content')
        return out

    def unpack(self, compression: str, source: memoryview, target: memoryview) -> None:
        """Decompress `source` into `target`; BadBag unless it fills it exactly."""
        if compression == 'zstd':
            got = self._unzstd(source, target)
        elif compression == 'lz4':
            got = self._lz4.unpack(source, target)
        else:
            raise BadBag(f'compression {compression!r} is not known, expected zstd or lz4')
        if got != len(target):
            raise BadBag(f'expected {len(target)} bytes unpacked, got {got}')

    def _unzstd(self, source: memoryview, target: memoryview) -> int:
        got = 0
        try:
            # Directly into the buffer, in one call if the frame holds its size.
            with self._zstd.stream_reader(source) as stream:
                while part := stream.readinto(target[got:]):
                    got += part
                return got + len(stream.read(1))
        except zstandard.ZstdError as error:
            raise BadBag(f'its zstd data is broken ({error})') from error


def pack(compression: str, content: bytes, zstd: zstandard.ZstdCompressor) -> bytes:
    """Compress the records of a chunk by 'zstd' or 'lz4'; '' leaves them as they are."""
    if compression == 'zstd':
        return zstd.compress(content)
    if compression == 'lz4':
        return bytes(lz4.frame.compress(content))
    return content


@dataclass(frozen=True, slots=True)
class Walked:
    """The result of a walk over records: offsets of messages by channel id, and other records.

    Offsets are in bytes from the walk's start, increasing. `others` are (opcode, offset of content,
    length of content); `stop` is where the walk ended, `whole` whether that is the end of the data.
    """

    messages: dict[int, Offsets]
    others: list[tuple[int, int, int]]
    stop: int
    whole: bool


def walk(data: memoryview, *, chunked: bool = True) -> Walked:
    """Walk over the records in `data`, up to one that is cut off or invalid.

    Outside chunks (`chunked` false) the walk also ends before a Chunk and after a Footer.
    """
    found: dict[int, list[int]] = {}
    others = []
    pos, end = 0, len(data)
    message, record = _MESSAGE.unpack_from, _RECORD.unpack_from
    while pos + 11 <= end:
        opcode, length, channel = message(data, pos)
        if pos + 9 + length > end or opcode == 0 or (opcode == CHUNK and not chunked):
            break
        if opcode == MESSAGE:
            if length < 22:
                break
            if channel in found:
                found[channel].append(pos)
            else:
                found[channel] = [pos]
        else:
            others.append((opcode, pos + 9, length))
            if opcode == FOOTER and not chunked:
                pos += 9 + length
                break
        pos += 9 + length
    else:
        # The rest is too short for a message but may be an empty record of another kind.
        if pos + 9 <= end and pos + 9 + record(data, pos)[1] <= end and data[pos] > MESSAGE:
            pos += 9 + record(data, pos)[1]
    arrays = {channel: np.array(offsets, np.int64) for channel, offsets in found.items()}
    return Walked(arrays, others, pos, pos == end)


def log_times(data: Bytes, offsets: Offsets) -> Offsets:
    """Return the log times (n,) in ns of the message records at `offsets` (n,) of `data`."""
    every = np.ndarray((data.size - 22,), '<i8', data, offset=15, strides=(1,))
    return every[offsets].astype(np.int64)


def _entries(data: bytes | memoryview, channel: int) -> Offsets | None:
    """Return log time (ns) and offset, in turn, of a MessageIndex record; None if it is another."""
    if len(data) < 15:
        return None
    opcode, length, found = _MESSAGE.unpack_from(data)
    (size,) = struct.unpack_from('<I', data, 11)
    if opcode != MESSAGE_INDEX or found != channel or size % 16 or size + 6 > length:
        return None
    if 15 + size > len(data):
        return None
    return np.frombuffer(data, '<i8', size // 8, 15)


def indexed_times(data: bytes | memoryview, channel: int) -> Times | None:
    """Return the log times (n,) in ns in a MessageIndex record; None if it is not one of it."""
    entries = _entries(data, channel)
    return None if entries is None else entries[::2].astype(np.int64)


def indexed(data: bytes | memoryview, channel: int) -> Offsets | None:
    """Return the message offsets in a MessageIndex record; None if it is not one of `channel`."""
    entries = _entries(data, channel)
    if entries is None:
        return None
    offsets = entries[1::2].astype(np.int64)
    if offsets.size and (offsets[0] < 0 or (offsets[1:] <= offsets[:-1]).any()):
        offsets = np.unique(offsets)
        offsets = offsets[offsets >= 0]
    return offsets
