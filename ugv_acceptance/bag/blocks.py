"""Serialised messages as columns over one buffer, so that many are copied and merged at a time."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.bag.gather import Bytes, Offsets
from ugv_acceptance.type_aliases import Times

# A message: log time and publish time (ns), channel, content.
Message: TypeAlias = tuple[int, int, int, bytes]
# A Message record of MCAP before its content; `length` is of what follows itself.
RECORD_HEAD = np.dtype(
    [
        ('opcode', 'u1'),
        ('length', '<u8'),
        ('channel', '<u2'),
        ('sequence', '<u4'),
        ('log_time', '<u8'),
        ('published', '<u8'),
    ]
)


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Serialised messages, one row each: log and publish time (n,) in ns, channel (n,), content.

    The content of a message is `length` (n,) bytes of `data` from byte `start` (n,) on.
    """

    log_time: Times
    published: Times
    channel: NDArray[np.int64]
    start: Offsets
    length: Offsets
    data: Bytes

    def __len__(self) -> int:
        """Return the number of messages."""
        return len(self.log_time)

    def take(self, rows: NDArray[Any] | slice) -> 'Block':
        """Return some messages: by number, in that order, by a mask, or by a slice."""
        return Block(
            self.log_time[rows],
            self.published[rows],
            self.channel[rows],
            self.start[rows],
            self.length[rows],
            self.data,
        )

    def packed(self) -> 'Block':
        """Return the messages with their contents one after another, in their order."""
        ends = np.cumsum(self.length)
        start = ends - self.length
        data = np.empty(int(ends[-1]) if len(ends) else 0, np.uint8)
        if len(ends):
            copy_parts((self.data, self.start), (data, start), self.length)
        return replace(self, start=start, data=data)

    def messages(self) -> Iterator[Message]:
        """Yield the messages one by one."""
        data = self.data.data
        columns = (self.log_time, self.published, self.channel, self.start, self.length)
        for *times, channel, start, length in zip(*(c.tolist() for c in columns), strict=True):
            yield *times, channel, bytes(data[start : start + length])


def block_of(messages: Sequence[Message]) -> Block:
    """Return single messages as one block."""
    log_time, published, channel, contents = zip(*messages, strict=True) if messages else [()] * 4
    length = np.array([len(content) for content in contents], np.int64)
    time, sent, of = (np.array(column, np.int64) for column in (log_time, published, channel))
    data = np.frombuffer(b''.join(contents), np.uint8)
    return Block(time, sent, of, np.cumsum(length) - length, length, data)


def joined(blocks: Sequence[Block]) -> Block:
    """Return the messages of all blocks, one block after another, over one buffer."""
    blocks = [block for block in blocks if len(block)] or blocks[:1]
    if len(blocks) == 1:
        return blocks[0]
    parts, starts, size = [], [], 0
    for block in blocks:
        first, last = int(block.start.min()), int((block.start + block.length).max())
        parts.append(block.data[first:last])
        starts.append(block.start - first + size)
        size += last - first
    names = ('log_time', 'published', 'channel', 'length')
    time, published, channel, length = (
        np.concatenate([getattr(block, name) for block in blocks]) for name in names
    )
    return Block(time, published, channel, np.concatenate(starts), length, np.concatenate(parts))


def merged(streams: Sequence[Iterable[Block]]) -> Iterator[Block]:
    """Merge streams of blocks by log time, as heapq.merge merges their messages.

    Of the same moment the messages of an earlier stream come first. A message that is late in its
    own stream comes at once after the one before it.
    """
    heads = [_Head(iter(stream)) for stream in streams]
    while heads := [head for head in heads if head.fill()]:
        # What comes next in a stream is not before the last message that is known of it.
        until = min((head.last for head in heads if not head.whole), default=None)
        ready = [head.before(until) for head in heads]
        keys = np.concatenate([key for _, key in ready])
        if len(keys):
            yield joined([block for block, _ in ready]).take(np.argsort(keys, kind='stable'))


def record_heads(data: Bytes) -> NDArray[Any]:
    """Return the head of a Message record at every place of a buffer from which one may begin."""
    size = RECORD_HEAD.itemsize
    return np.ndarray(len(data) - size + 1, RECORD_HEAD, data, strides=(1,))


def put_rows(rows: NDArray[Any], out: Bytes, at: Offsets) -> None:
    """Copy each of `rows` (n,) to its place `at` (n,) in a buffer."""
    size = rows.itemsize
    _everywhere(out, size)[at] = rows.view(f'V{size}')


def copy_parts(source: tuple[Bytes, Offsets], target: tuple[Bytes, Offsets], size: Offsets) -> None:
    """Copy `size` (n,) bytes each from (buffer, places) to (buffer, places), alike ones at once."""
    (data, start), (out, at) = source, target
    order = np.argsort(size, kind='stable')
    for rows in np.split(order, np.flatnonzero(np.diff(size[order])) + 1):
        count = int(size[rows[0]])
        if count and len(rows) > 1:
            _everywhere(out, count)[at[rows]] = _everywhere(data, count)[start[rows]]
        elif count:
            a, b = int(at[rows[0]]), int(start[rows[0]])
            out[a : a + count] = data[b : b + count]


def _everywhere(buffer: Bytes, size: int) -> NDArray[Any]:
    """Return the `size` bytes from every place of a buffer on, as one element each."""
    return np.ndarray(len(buffer) - size + 1, f'V{size}', buffer, strides=(1,))


class _Head:
    """The messages of a stream that are known and not yet merged, with the times to merge by."""

    def __init__(self, blocks: Iterator[Block]) -> None:
        self._blocks = blocks
        self._held: list[Block] = []
        self._keys = np.zeros(0, np.int64)
        self.whole = False

    @property
    def last(self) -> int:
        return int(self._keys[-1])

    def fill(self) -> bool:
        """Read on until the messages known are not all of one moment; return whether any are."""
        while not self.whole and (not len(self._keys) or self._keys[0] == self._keys[-1]):
            block = next(self._blocks, None)
            if block is None:
                self.whole = True
            elif len(block):
                # Never falling, so that a late message stays where it is in its stream.
                start = max(int(block.log_time[0]), self.last if len(self._keys) else _NEVER)
                keys = np.maximum.accumulate(np.append(start, block.log_time))[1:]
                self._held.append(block)
                self._keys = np.concatenate((self._keys, keys))
        return bool(len(self._keys))

    def before(self, until: int | None) -> tuple[Block, Times]:
        """Remove and return the messages before `until` (ns; None: all), and their times."""
        count = len(self._keys) if until is None else int(np.searchsorted(self._keys, until))
        block, keys = joined(self._held), self._keys
        self._held, self._keys = [block.take(slice(count, None))], keys[count:]
        return block.take(slice(count)), keys[:count]


_NEVER = np.iinfo(np.int64).min
