"""Chunks of an MCAP: their header, decompression into a reused buffer, the walk over records."""

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


# Only saves time: zlib's CRC-32 costs a third of zstd's decompression, ISA-L's a thirtieth.
_isal = _optional('isal.isal_zlib')
crc32: Callable[..., int] = _isal.crc32 if _isal else zlib.crc32


@dataclass(frozen=True, slots=True)
class ChunkHead:
    """Head of a Chunk record; `data` is where its records begin, counted from the chunk's start.

    `first`, `last` are log times in ns; `size` what the records' `packed` bytes unpack to; a `crc`
    of 0 says there is none.
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
    """Parse the first bytes of a Chunk record; BadBag where it is none."""
    try:
        opcode, length, first, last, size, crc, text = _HEAD.unpack_from(head)
        compression = head[_HEAD.size : _HEAD.size + text].decode('ascii')
        (packed,) = struct.unpack_from('<Q', head, _HEAD.size + text)
    except (struct.error, UnicodeDecodeError) as error:
        raise BadBag('expected the head of a chunk, which is cut off or garbled') from error
    data = _HEAD.size + text + 8
    if opcode != CHUNK or data + packed > length + 9:
        raise BadBag(f'expected a chunk of {data + packed} bytes, got record {opcode} of {length}')
    return ChunkHead(length + 9, first, last, size, crc, compression, data, packed)


class Buffers:
    """The two buffers of one reading thread, which grow to the largest chunk met."""

    def __init__(self) -> None:
        self._packed = np.zeros(1 << 16, np.uint8)
        self._records = np.zeros(1 << 16, np.uint8)
        self._zstd = zstandard.ZstdDecompressor()
        self._lz4 = Lz4()

    def packed(self, size: int) -> Bytes:
        """Room for `size` bytes of the file, and SLACK behind them."""
        if self._packed.size < size + SLACK:
            self._packed = np.zeros(size + size // 4 + SLACK, np.uint8)
        return self._packed

    def records(self, head: ChunkHead, chunk: Bytes) -> Bytes:
        """The chunk's records, `head.size` bytes from index LEAD on.

        `chunk` holds the Chunk record, with SLACK bytes behind it. What is returned is overwritten
        by the next call. BadBag where the chunk cannot be unpacked to what its head promises.
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
        """Decompress `source` so that it fills `target`, else BadBag."""
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
            # Straight into the buffer, in one go where the frame says its size.
            with self._zstd.stream_reader(source) as stream:
                while part := stream.readinto(target[got:]):
                    got += part
                return got + len(stream.read(1))
        except zstandard.ZstdError as error:
            raise BadBag(f'its zstd data is broken ({error})') from error


def pack(compression: str, content: bytes, zstd: zstandard.ZstdCompressor) -> bytes:
    """The records of a chunk compressed; '' leaves them as they are."""
    if compression == 'zstd':
        return zstd.compress(content)
    if compression == 'lz4':
        return bytes(lz4.frame.compress(content))
    return content


@dataclass(frozen=True, slots=True)
class Walked:
    """What a walk over records found: message offsets a channel (increasing), other records.

    `others` are (opcode, offset of content, length of content); `stop` is where the walk ended,
    `whole` whether that is the end. All offsets count from the walk's start.
    """

    messages: dict[int, Offsets]
    others: list[tuple[int, int, int]]
    stop: int
    whole: bool


def walk(data: memoryview, *, chunked: bool = True) -> Walked:
    """Walk the records in `data`; ends at one that is cut off or, in a chunk, impossible.

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
        # What is left is too short for a message but may be an empty record of another kind.
        if pos + 9 <= end and pos + 9 + record(data, pos)[1] <= end and data[pos] > MESSAGE:
            pos += 9 + record(data, pos)[1]
    arrays = {channel: np.array(offsets, np.int64) for channel, offsets in found.items()}
    return Walked(arrays, others, pos, pos == end)


def log_times(data: Bytes, offsets: Offsets) -> Offsets:
    """Log times in ns of the message records at `offsets` of `data`."""
    every = np.ndarray((data.size - 22,), '<i8', data, offset=15, strides=(1,))
    return every[offsets].astype(np.int64)


def indexed(data: bytes | memoryview, channel: int) -> Offsets | None:
    """Offsets in a MessageIndex record that must be of `channel`; None where it is not one."""
    if len(data) < 15:
        return None
    opcode, length, found = _MESSAGE.unpack_from(data)
    (size,) = struct.unpack_from('<I', data, 11)
    if opcode != MESSAGE_INDEX or found != channel or size % 16 or size + 6 > length:
        return None
    if 15 + size > len(data):
        return None
    offsets = np.frombuffer(data, '<i8', size // 8, 15)[1::2].astype(np.int64)
    if offsets.size and (offsets[0] < 0 or (offsets[1:] <= offsets[:-1]).any()):
        offsets = np.unique(offsets)
        offsets = offsets[offsets >= 0]
    return offsets
