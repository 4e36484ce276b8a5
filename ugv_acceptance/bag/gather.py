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
_TOGETHER = 32  # messages compared at a time
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


@dataclass(frozen=True, slots=True)
class _Check:
    """The words of a section from `start` on that hold constants to compare.

    `text` are the expected words and `bits` what of them to compare, repeated for some messages, so
    that comparing is a few long loops instead of a short one per message.
    """

    start: int
    size: int
    text: Words
    bits: Words

    def differs(self, words: Words) -> bool:
        """Return whether any row of the section's `words` (n, m) is not as expected."""
        words = words[:, self.start : self.start + self.size]
        if self.size == 1:
            return bool(((words ^ self.text[0]) & self.bits[0]).max())
        flat = words.reshape(-1)
        whole = len(flat) // len(self.text) * len(self.text)
        return self._wrong(flat[:whole].reshape(-1, len(self.text))) or self._wrong(
            flat[whole:].reshape(-1, self.size)
        )

    def _wrong(self, words: Words) -> bool:
        """Return whether any row differs: a bit is right in all if it is in OR and AND of them."""
        if not len(words):
            return False
        text, bits = self.text[: words.shape[1]], self.bits[: words.shape[1]]
        some, every = np.bitwise_or.reduce(words), np.bitwise_and.reduce(words)
        some ^= text
        every ^= text
        some |= every
        some &= bits
        return bool(some.max())

    def fits(self, words: Words) -> NDArray[np.bool_]:
        """Return which rows of the section's `words` (n, m) are as expected."""
        words = words[:, self.start : self.start + self.size]
        wrong = (words ^ self.text[: self.size]) & self.bits[: self.size]
        return np.logical_not(wrong.any(axis=1))


@dataclass(frozen=True, slots=True)
class _Section:
    """`size` words of a row from word `start`, which are gathered together, and their constants."""

    start: int
    size: int
    checks: tuple[_Check, ...]


class Gather:
    """The gather operations for one layout; `record` is the size of a whole record in bytes.

    `parts` are those of the layout's blocks that are wanted; () means all blocks. A record is
    gathered in sections: all before the first block, with the times, then each run of words that
    are wanted or constant. Threads may share one.
    """

    def __init__(self, layout: Layout, channel: int, parts: tuple[Span, ...] = ()) -> None:
        self.record = HEAD + layout.length
        self.order = '<' if layout.little else '>'
        self._data = _BEFORE + HEAD
        wanted = parts or tuple((i, 0, n) for i, n in enumerate(layout.widths))
        spans = [
            ((self._data + layout.blocks[block][0]) // 8 + first, last - first)
            for block, first, last in wanted
        ]
        self._sections = self._find(layout, channel, spans)
        self._spans = [(*self._place(start), number) for start, number in spans]
        self._times = np.dtype(
            {
                'names': ['log_time', 'sec', 'nanosec'],
                'formats': ['<i8', f'{self.order}i4', f'{self.order}u4'],
                'offsets': [_BEFORE + 15, self._data + layout.stamp, self._data + layout.stamp + 4],
                'itemsize': 8 * self._sections[0].size,
            }
        )

    def _find(self, layout: Layout, channel: int, spans: list[tuple[int, int]]) -> list[_Section]:
        """Return the sections; the first is all before the first block."""
        width = -(-(_BEFORE + self.record) // 8) * 8
        text, mask = np.zeros(width, np.uint8), np.zeros(width, np.uint8)
        head = b'\x05' + (self.record - 9).to_bytes(8, 'little') + channel.to_bytes(2, 'little')
        data = [(self._data + offset, piece) for offset, piece in layout.constant]
        for offset, piece in [(_BEFORE, head), *data]:
            text[offset : offset + len(piece)] = np.frombuffer(piece, np.uint8)
            mask[offset : offset + len(piece)] = 0xFF
        words, bits = text.view(np.uint64), mask.view(np.uint64)
        first = min([*(self._data + offset for offset, n in layout.blocks if n), width]) // 8
        constant = {i for i in np.flatnonzero(bits).tolist() if i >= first}
        wanted = {start + i for start, n in spans for i in range(n)}
        sections = [_Section(0, first, (_check(0, words[:first], bits[:first]),))]
        for a, b in _runs(constant | wanted):
            held = _runs(constant & set(range(a, b)))
            checks = tuple(_check(c - a, words[c:d], bits[c:d]) for c, d in held)
            sections.append(_Section(a, b - a, checks))
        return sections

    def matching(
        self, buffer: Bytes, offsets: Offsets
    ) -> tuple[NDArray[np.bool_] | None, list[Words]]:
        """Return which records have this layout (None: all), and the words of their sections.

        Without words if it is none of them, which the first section tells of other messages.
        """
        good: NDArray[np.bool_] | None = None
        held = []
        for section in self._sections:
            words = _gather(buffer, offsets, 8 * section.start, 8 * section.size)
            held.append(words)
            for check in section.checks:
                if check.differs(words):
                    fits = check.fits(words)
                    good = fits if good is None else good & fits
                    if not good.any():
                        return good, []
        return good, held if good is None else [words[good] for words in held]

    def times(self, held: list[Words]) -> tuple[Times, Times]:
        """Return log times and stamps (n,) in ns, from the words that `matching` returned."""
        rows = held[0].view(self._times)[:, 0]
        stamp = rows['sec'].astype(np.int64)
        stamp *= 1_000_000_000
        stamp += rows['nanosec']
        return rows['log_time'].astype(np.int64), stamp

    def blocks(self, held: list[Words]) -> tuple[Floats, ...]:
        """Return the wanted numbers of matching records, one array (n, width) for each part."""
        numbers = [words.view(f'{self.order}f8') for words in held]
        return tuple(
            numbers[place][:, at : at + n].astype(np.float64, copy=False)
            if n
            else np.zeros((len(held[0]), 0))
            for place, at, n in self._spans
        )

    def _place(self, word: int) -> tuple[int, int]:
        """Return the section in which a word is, and where in it."""
        place = max(i for i, section in enumerate(self._sections) if section.start <= word)
        return place, word - self._sections[place].start


def _check(start: int, text: Words, bits: Words) -> _Check:
    return _Check(start, len(text), np.tile(text, _TOGETHER), np.tile(bits, _TOGETHER))


def _runs(held: set[int]) -> list[tuple[int, int]]:
    """Return each run of successive numbers: its first and its last + 1."""
    firsts = sorted(i for i in held if i - 1 not in held)
    return list(zip(firsts, sorted(i + 1 for i in held if i + 1 not in held), strict=True))


def _gather(buffer: Bytes, offsets: Offsets, start: int, size: int) -> Words:
    """Return `size` bytes from byte `start` of every row, as (n, size / 8) words."""
    found = _items(buffer, LEAD - _BEFORE + start, size)[offsets]
    return found.view(np.uint64).reshape(len(offsets), size // 8)


def _items(buffer: Bytes, base: int, size: int) -> NDArray[Any]:
    """Return the `size` bytes from every byte on from `base` as an item, without a copy."""
    return np.ndarray((buffer.size - base - size + 1,), f'V{size}', buffer, base, (1,))
