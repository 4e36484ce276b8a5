"""Reads and decodes the chunks of one MCAP file, each independently of the others."""

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ugv_acceptance import BadBag
from ugv_acceptance.bag.chunks import MAX_CHUNK_BYTES, Buffers, indexed, walk
from ugv_acceptance.bag.columns import ColumnDecoder, Columns, Decoded
from ugv_acceptance.bag.gather import LEAD, Bytes, Offsets
from ugv_acceptance.bag.mcap_index import MAGIC, McapIndex, NoIndex, Piece, from_summary, pread
from ugv_acceptance.bag.salvage import scan


@dataclass(slots=True)
class Piecework:
    """The result of decoding one piece: columns, counts by topic, and findings.

    `malformed` holds by topic the number of malformed messages and the first one's reason.
    """

    columns: list[Columns] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)
    malformed: dict[str, tuple[int, str]] = field(default_factory=dict)
    findings: list[str] = field(default_factory=list)

    def add(self, topic: str, decoded: Decoded) -> None:
        """Add what was decoded of one topic."""
        self.columns += decoded.columns
        self.counts[topic] = self.counts.get(topic, 0) + decoded.count + decoded.malformed
        if decoded.malformed:
            number, reason = self.malformed.get(topic, (0, decoded.reason))
            self.malformed[topic] = (number + decoded.malformed, reason)


Wanted = dict[int, tuple[str, ColumnDecoder]]  # channel id -> topic and decoder


def open_mcap(file: BinaryIO, name: str, max_chunk_bytes: int = MAX_CHUNK_BYTES) -> McapIndex:
    """Return the index of an MCAP file, from its summary or, if that is unusable, by scanning.

    Raises BadBag if it is not an MCAP file; `name` is for errors.
    """
    magic = pread(file, 0, len(MAGIC))
    if magic != MAGIC:
        size = os.fstat(file.fileno()).st_size
        raise BadBag(f'{name}: expected an MCAP file, got {size} bytes that begin {magic!r}')
    try:
        return from_summary(file, max_chunk_bytes)
    except BadBag as error:
        index = scan(file, max_chunk_bytes)
        if not isinstance(error, NoIndex):
            index.findings.insert(0, f'scanned from its start because {error}')
        return index


@dataclass(frozen=True, slots=True)
class Unpacked:
    """A piece that was unpacked: its `size` bytes of records from `records[LEAD]` on.

    `offsets` returns those of a channel's messages, None if its index is wrong. Or a sentence about
    why the piece is `lost`.
    """

    piece: Piece
    records: Bytes = field(default_factory=lambda: np.zeros(0, np.uint8))
    size: int = 0
    offsets: Callable[[int], Offsets | None] = lambda _: None
    lost: str = ''


class McapSource:
    """An MCAP file and its wanted channels; a thread may unpack while another decodes.

    The file is open from the first to the last of its `pieces` that is unpacked, or until `close`:
    a recording may have been split into more files than may be open.
    """

    def __init__(self, path: Path, name: str, index: McapIndex, wanted: Wanted) -> None:
        self.name = name
        self.index = index
        self.wanted = wanted
        self._path = path
        self._file: BinaryIO | None = None
        # Those that may hold a wanted message.
        self.pieces = [
            piece
            for piece in index.pieces
            if piece.indexes is None or not wanted.keys().isdisjoint(piece.indexes)
        ]
        self._left = len(self.pieces)

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def unpack(self, piece: Piece, buffers: Buffers) -> Unpacked:
        """Read one piece into `buffers` and unpack it; damage in it becomes a finding."""
        file = self._file = self._file or self._path.open('rb')
        try:
            return Unpacked(piece, *self._records(file, piece, buffers))
        except BadBag as error:
            at = f'{self.name}: chunk at byte {piece.start}'
            return Unpacked(piece, lost=f'{at} not used: {error}{self._lost(file, piece)}')
        finally:
            self._left -= 1
            if not self._left:
                self.close()

    def decode(self, unpacked: Unpacked) -> Piecework:
        """Decode one piece as long as the buffers that hold it are not used again."""
        work = Piecework()
        if unpacked.lost:
            work.findings.append(unpacked.lost)
            return work
        records, size = unpacked.records, unpacked.size
        broken = 0
        results: list[tuple[str, Decoded]] = []
        for channel, (topic, decoder) in self.wanted.items():
            found = unpacked.offsets(channel)
            if found is not None and found.size:
                results.append((topic, decoder.records(records, size, found)))
                broken += results[-1][1].broken
            elif found is None:
                broken += 1
        if broken:
            what = f'{self.name}: chunk at byte {unpacked.piece.start}: {broken}'
            results = self._walked(records, size, results, work, what)
        for topic, decoded in results:
            work.add(topic, decoded)
        return work

    def _records(
        self, file: BinaryIO, piece: Piece, buffers: Buffers
    ) -> tuple[Bytes, int, Callable[[int], Offsets | None]]:
        """Return a buffer with a piece's records, their size, and a channel's offsets function."""
        total = piece.length + piece.index_length
        if piece.head is None:
            packed = buffers.packed(LEAD + total)
            _read(file, packed[LEAD : LEAD + total], piece.start)
            return packed, total, _walked_offsets(packed, total)
        packed = buffers.packed(total)
        _read(file, packed[:total], piece.start)
        records = buffers.records(piece.head, packed)
        if piece.indexes is None:
            return records, piece.head.size, _walked_offsets(records, piece.head.size)
        return records, piece.head.size, _index_offsets(packed[:total], piece)

    def _walked(
        self,
        records: Bytes,
        size: int,
        by_index: list[tuple[str, Decoded]],
        work: Piecework,
        what: str,
    ) -> list[tuple[str, Decoded]]:
        """Decode by walking the records, after the message index pointed to non-messages."""
        walked = walk(records.data[LEAD : LEAD + size])
        if not walked.whole:
            work.findings.append(
                f'{what} messages lost: its index is wrong, '
                f'and its records are damaged at byte {walked.stop} of {size}'
            )
            return by_index
        work.findings.append(
            f'{what} entries of its message index are wrong; its records were used'
        )
        return [
            (topic, decoder.records(records, size, walked.messages[channel]))
            for channel, (topic, decoder) in self.wanted.items()
            if channel in walked.messages
        ]

    def _lost(self, file: BinaryIO, piece: Piece) -> str:
        """Return a text on how many messages an unusable piece holds, '' if there is no index."""
        if piece.indexes is None:
            return ''
        data = pread(file, piece.start + piece.length, piece.index_length)
        counts = []
        for channel, at in piece.indexes.items():
            found = indexed(data[at - piece.start - piece.length :], channel)
            known = self.index.channels.get(channel)
            if found is not None and known:
                counts.append(f'{len(found)} of {known.topic}')
        return f'; lost with it: {", ".join(counts)}' if counts else ''


def _read(file: BinaryIO, target: Bytes, start: int) -> None:
    got = os.preadv(file.fileno(), [target.data], start)
    if got != target.size:
        raise BadBag(f'expected {target.size} bytes of the file, got {got}')


def _walked_offsets(records: Bytes, size: int) -> Callable[[int], Offsets | None]:
    messages = walk(records.data[LEAD : LEAD + size]).messages
    return lambda channel: messages.get(channel, np.zeros(0, np.int64))


def _index_offsets(data: Bytes, piece: Piece) -> Callable[[int], Offsets | None]:
    indexes = piece.indexes or {}

    def offsets(channel: int) -> Offsets | None:
        at = indexes.get(channel)
        if at is None:
            return np.zeros(0, np.int64)
        return indexed(data.data[at - piece.start :], channel)

    return offsets
