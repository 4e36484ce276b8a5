"""Decodes all messages of one layout in a chunk at once, and compares every constant byte.

A gather copies the same range of bytes of every record, one small memcpy each, into a contiguous
array; the records themselves may lie anywhere. Constants are compared a word at a time; bits that
may vary (padding, stamps) are masked out.
"""

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.bag.layout import Layout
from ugv_acceptance.type_aliases import Floats, Times

Bytes: TypeAlias = NDArray[np.uint8]
Offsets: TypeAlias = NDArray[np.int64]
Words: TypeAlias = NDArray[np.uint64]
Span: TypeAlias = tuple[int, int, int]  # block, first and last + 1 of its float64

LEAD = 8  # bytes kept free in front of a chunk's records, so that a row may begin before the first
SLACK = 8  # and behind them, so that a row may end after the last
HEAD = 31  # opcode, length, channel, sequence, log time, publish time
_MESSAGE = 5  # opcode of a message record
_HEADS = np.dtype(
    [
        ('opcode', 'u1'),
        ('length', '<i8'),
        ('channel', '<u2'),
        ('sequence', '<u4'),
        ('log_time', '<i8'),
        ('publish_time', '<i8'),
    ]
)
_BEFORE = 5  # a row starts this far before its record: then CDR's origin is a multiple of 8


def as_records(
    buffer: Bytes, lengths: Offsets, channels: int | Offsets, log_times: Times
) -> Offsets:
    """Make the n messages in a buffer look like those in a chunk; return their records' offsets.

    They lie one after another from `buffer[LEAD]` on, with HEAD bytes free before each, into which
    the head of a message record is written; `lengths` (n,) are of what is between.
    """
    heads = np.zeros(len(lengths), _HEADS)
    heads['opcode'], heads['length'], heads['channel'] = _MESSAGE, lengths + (HEAD - 9), channels
    heads['log_time'] = heads['publish_time'] = log_times
    offsets = np.cumsum(lengths + HEAD) - (lengths + HEAD)
    _items(buffer, LEAD, HEAD)[offsets] = heads.view(f'V{HEAD}')
    return offsets


def contents(
    buffer: Bytes, size: int, offsets: Offsets, channel: int
) -> tuple[NDArray[np.bool_], Offsets, Offsets, Times]:
    """Return which records at `offsets` (n,) of a chunk of `size` bytes are a channel's messages.

    And of these (k,) where in the buffer their contents begin, their lengths, and log times (ns).
    """
    room = size - HEAD - offsets
    good = room >= 0
    heads = np.zeros(len(offsets), _HEADS)
    if good.any():
        heads[good] = _items(buffer, LEAD, HEAD)[offsets[good]].view(_HEADS)
    lengths = heads['length'] - (HEAD - 9)
    good &= (heads['opcode'] == _MESSAGE) & (heads['channel'] == channel)
    good &= (lengths >= 0) & (lengths <= room)
    return good, offsets[good] + (LEAD + HEAD), lengths[good], heads['log_time'][good]


@dataclass(slots=True)
class _Region:
    """`size` words of a row from word `start` that hold constants to compare.

    `tile` holds the expected words and the bits to compare, repeated for as many messages as were
    met at a time, so that comparing is one long loop instead of a short one per message. It is
    replaced as a whole, since several threads use it.
    """

    start: int
    size: int
    tile: tuple[Words, Words]

    def differs(self, words: Words) -> Words:
        """Return the bits of `words` (n, size) that differ from the expected ones."""
        n = len(words)
        text, bits = self.tile
        if len(text) < n:
            text, bits = (np.repeat(part[:1], n, axis=0) for part in (text, bits))
            self.tile = text, bits
        wrong = words ^ text[:n]
        wrong &= bits[:n]
        return wrong


class Gather:
    """The gather operations for one layout; `record` is the size of a whole record in bytes.

    `spans` are the parts of the layout's blocks that are wanted; () means all blocks. Threads may
    share one.
    """

    def __init__(self, layout: Layout, channel: int, spans: tuple[Span, ...] = ()) -> None:
        self.record = HEAD + layout.length
        self.order = '<' if layout.little else '>'
        self._data = _BEFORE + HEAD
        wanted = spans or tuple((i, 0, n) for i, n in enumerate(layout.widths))
        self._spans = [
            (self._data + layout.blocks[block][0] + 8 * first, last - first)
            for block, first, last in wanted
        ]
        self._regions = self._find(layout, channel)
        self._times = np.dtype(
            {
                'names': ['log_time', 'sec', 'nanosec'],
                'formats': ['<i8', f'{self.order}i4', f'{self.order}u4'],
                'offsets': [_BEFORE + 15, self._data + layout.stamp, self._data + layout.stamp + 4],
                'itemsize': 8 * self._regions[0].size,
            }
        )

    def _find(self, layout: Layout, channel: int) -> list[_Region]:
        """Return the regions of constants; the first is all before the first block, with times."""
        width = -(-(_BEFORE + self.record) // 8) * 8
        text, mask = np.zeros(width, np.uint8), np.zeros(width, np.uint8)
        head = b'\x05' + (self.record - 9).to_bytes(8, 'little') + channel.to_bytes(2, 'little')
        data = [(self._data + offset, piece) for offset, piece in layout.constant]
        for offset, piece in [(_BEFORE, head), *data]:
            text[offset : offset + len(piece)] = np.frombuffer(piece, np.uint8)
            mask[offset : offset + len(piece)] = 0xFF
        words, bits = text.view(np.uint64), mask.view(np.uint64)
        blocks = [self._data + offset for offset, n in layout.blocks if n]
        first = min([*blocks, width]) // 8
        held = [i for i in np.flatnonzero(bits).tolist() if i >= first]
        starts = [i for i in held if i - 1 not in held]
        stops = [i + 1 for i in held if i + 1 not in held]
        parts = [(0, first), *zip(starts, stops, strict=True)]
        return [_Region(a, b - a, (words[None, a:b], bits[None, a:b])) for a, b in parts]

    def matching(self, buffer: Bytes, offsets: Offsets) -> tuple[NDArray[np.bool_] | None, Words]:
        """Return which records have this layout (None: all), and their words before the blocks."""
        good: NDArray[np.bool_] | None = None
        first: Words | None = None
        for region in self._regions:
            words = _gather(buffer, offsets, 8 * region.start, 8 * region.size, 'u8')
            first = words if first is None else first
            wrong = region.differs(words)
            if wrong.max() == 0:
                continue
            fits: NDArray[np.bool_] = np.logical_not(wrong.any(axis=1))
            good = fits if good is None else good & fits
        assert first is not None  # noqa: S101 (there is always a first region)
        return good, first

    def times(self, words: Words) -> tuple[Times, Times]:
        """Return log times and stamps (n,) in ns, from the words that `matching` returned."""
        rows = words.view(self._times)[:, 0]
        stamp = rows['sec'].astype(np.int64)
        stamp *= 1_000_000_000
        stamp += rows['nanosec']
        return rows['log_time'].astype(np.int64), stamp

    def blocks(self, buffer: Bytes, offsets: Offsets) -> tuple[Floats, ...]:
        """Return the wanted numbers of matching records, one array (n, width) for each span."""
        return tuple(
            _gather(buffer, offsets, start, 8 * n, f'{self.order}f8').astype(np.float64, copy=False)
            if n
            else np.zeros((len(offsets), 0))
            for start, n in self._spans
        )


def _gather(buffer: Bytes, offsets: Offsets, start: int, size: int, kind: str) -> NDArray[Any]:
    """Return `size` bytes from byte `start` of every row, as (n, size / 8) numbers of `kind`."""
    found = _items(buffer, LEAD - _BEFORE + start, size)[offsets]
    return found.view(kind).reshape(len(offsets), size // 8)


def _items(buffer: Bytes, base: int, size: int) -> NDArray[Any]:
    """Return the `size` bytes from every byte on from `base` as an item, without a copy."""
    return np.ndarray((buffer.size - base - size + 1,), f'V{size}', buffer, base, (1,))
