"""Rebuilds the index of an MCAP file whose summary is missing or wrong, from its records."""

import os
from typing import BinaryIO

import numpy as np

from ugv_acceptance import BadBag
from ugv_acceptance.bag.chunks import (
    CHUNK,
    DATA_END,
    FOOTER,
    HEAD_BYTES,
    MAX_CHUNK_BYTES,
    Buffers,
    Walked,
    chunk_head,
    crc32,
    log_times,
    walk,
)
from ugv_acceptance.bag.gather import LEAD, Bytes
from ugv_acceptance.bag.mcap_index import (
    MAGIC,
    McapIndex,
    Piece,
    define,
    definitions,
    pread,
    too_big,
)

_BLOCK = 1 << 20
_GAP = 1 << 14  # between chunks there is little more than message indexes


def scan(file: BinaryIO, max_chunk_bytes: int = MAX_CHUNK_BYTES) -> McapIndex:
    """Make the index of an MCAP file by reading it from its start, up to the first broken record.

    The index's `salvaged` says where and how the file breaks off; what lies before is in the index.
    """
    return _Scan(file, max_chunk_bytes).run()


class _Scan:
    """One scan of a file, which builds its index record by record."""

    def __init__(self, file: BinaryIO, max_chunk_bytes: int) -> None:
        self.file = file
        self.max_chunk_bytes = max_chunk_bytes
        self.size = os.fstat(file.fileno()).st_size
        self.index = McapIndex(self.size)
        self.schemas: dict[int, str] = {}
        self.buffers = Buffers()
        self.ended = False
        self.block = _BLOCK

    def run(self) -> McapIndex:
        pos = len(MAGIC)
        while pos < self.size and not self.ended:
            head = pread(self.file, pos, HEAD_BYTES)
            after = self._chunk(pos, head) if head[0] == CHUNK else self._bare(pos, head)
            if after is None:
                break
            pos = after
        if not self.ended:
            held = sum(self.index.counts.values())
            how = 'is truncated' if pos >= self.size else 'is damaged or truncated'
            self.index.salvaged = (
                f'the file {how} at byte {pos} of {self.size}: '
                f'the {held} messages before that are used'
            )
        return self.index

    def _chunk(self, pos: int, head: bytes) -> int | None:
        """Add a chunk to the index; return the position after it, None if the file ends in it."""
        at = f'chunk at byte {pos}'
        self.block = _GAP
        try:
            parsed = chunk_head(head)
        except BadBag:
            length = int.from_bytes(head[1:9], 'little')
            if len(head) < 9 or pos + 9 + length > self.size:
                return None
            self.index.findings.append(f'{at} not read: its header is damaged')
            return pos + 9 + length
        if pos + parsed.length > self.size:
            return None
        after = pos + parsed.length
        if reason := too_big(parsed, self.max_chunk_bytes):
            self.index.findings.append(f'{at} not read: {reason}')
            return after
        data = self.buffers.packed(parsed.length)
        os.preadv(self.file.fileno(), [data.data[: parsed.length]], pos)
        try:
            records = self.buffers.records(parsed, data)[LEAD : LEAD + parsed.size]
        except BadBag as error:
            self.index.findings.append(f'{at} not used: {error}')
            return after
        walked = walk(records.data)
        if not walked.whole:
            self.index.findings.append(
                f'{at}: damaged at byte {walked.stop} of {parsed.size}, '
                'the records after it are lost'
            )
        times = self._take(records, walked)
        if walked.messages:
            self.index.pieces.append(Piece(pos, parsed.length, *times, parsed))
        return after

    def _bare(self, pos: int, head: bytes) -> int | None:
        """Add a block of records outside chunks; return the position after them, None if broken."""
        size = self.block
        self.block = _BLOCK
        if len(head) >= 9:
            size = max(size, 9 + int.from_bytes(head[1:9], 'little'))
        if pos + size > self.size:
            size = self.size - pos
        if size > max(self.max_chunk_bytes, _BLOCK):
            length = 9 + int.from_bytes(head[1:9], 'little')
            self.index.findings.append(f'record of {length} bytes at byte {pos} not read')
            return pos + length if pos + length <= self.size else None
        data = self.buffers.packed(size)
        os.preadv(self.file.fileno(), [data.data[:size]], pos)
        walked = walk(data.data[:size], chunked=False)
        times = self._take(data[:size], walked)
        if walked.messages:
            self.index.pieces.append(Piece(pos, walked.stop, *times))
        self._end(pos, data, walked)
        return pos + walked.stop if walked.stop else None

    def _end(self, pos: int, data: Bytes, walked: Walked) -> None:
        """Detect the end of the data section and verify its checksum, if it has one."""
        for opcode, at, size in walked.others:
            if opcode == DATA_END and size >= 4:
                crc = int.from_bytes(data[at : at + 4].tobytes(), 'little')
                self.index.protected = bool(crc) and crc == self._crc(pos + at - 9)
                if crc and not self.index.protected:
                    self.index.findings.append(
                        'the checksum (CRC-32) of its data section does not match: '
                        'any of its messages may be damaged'
                    )
            self.ended = self.ended or opcode in (FOOTER, DATA_END)

    def _crc(self, size: int) -> int:
        crc = 0
        for pos in range(0, size, _BLOCK):
            crc = crc32(pread(self.file, pos, min(_BLOCK, size - pos)), crc)
        return crc

    def _take(self, data: Bytes, walked: Walked) -> tuple[int, int]:
        """Add channels and counts to the index; return the first and last log time (ns)."""
        define(self.index, self.schemas, definitions(data.data, walked))
        for channel, offsets in walked.messages.items():
            self.index.counts[channel] = self.index.counts.get(channel, 0) + len(offsets)
        if not walked.messages:
            return 0, 0
        times = np.concatenate([log_times(data, o) for o in walked.messages.values()])
        return int(times.min()), int(times.max())
