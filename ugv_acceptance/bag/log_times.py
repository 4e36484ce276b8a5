"""When the messages of every topic were logged: rates and gaps, from the indexes where there are.

Nothing is unpacked where an MCAP file has message indexes, so a large recording takes little.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import BinaryIO

import numpy as np

from ugv_acceptance import BadBag
from ugv_acceptance.bag.chunks import Buffers, indexed_times, log_times, walk
from ugv_acceptance.bag.foreign import foreign_times
from ugv_acceptance.bag.gather import LEAD
from ugv_acceptance.bag.mcap_index import McapIndex, Piece, pread
from ugv_acceptance.bag.reader import Bag
from ugv_acceptance.bag.reading import Member
from ugv_acceptance.type_aliases import Times


@dataclass(slots=True)
class LogTimes:
    """The log times (ns) of one topic: how many, from when to when, the longest gap and its start.

    `backwards` is how far (ns) they jump back at most, 0 if they never do; `periods` pairs a median
    period of a part of the recording with the number of messages it is of.
    """

    count: int = 0
    first: int = 0
    last: int = 0
    gap: int = 0
    gap_from: int = 0
    backwards: int = 0
    periods: list[tuple[float, int]] = field(default_factory=list)
    _newest: int | None = None

    @property
    def rate(self) -> float | None:
        """Messages a second (Hz) by the median period; None for less than two messages."""
        if not self.periods:
            return None
        # The median of the parts' medians, each as often as it has messages.
        ordered = sorted(self.periods)
        reached = np.cumsum([number for _, number in ordered])
        period = ordered[int(np.searchsorted(reached, reached[-1] / 2))][0]
        return 1e9 / period if period > 0.0 else None

    def take(self, times: Times) -> None:
        """Add the next log times (n,) in ns, in the order of the file."""
        if not len(times):
            return
        low, high = int(times.min()), int(times.max())
        self.first = min(self.first, low) if self.count else low
        self.last = max(self.last, high)
        self.count += len(times)
        before = [] if self._newest is None else [self._newest]
        steps = np.diff(np.concatenate([np.array(before, np.int64), times]))
        self._newest = int(times[-1])
        if not len(steps):
            return
        widest = int(steps.argmax())
        if steps[widest] > self.gap:
            self.gap = int(steps[widest])
            self.gap_from = int(times[widest - len(before) + 1]) - self.gap
        self.backwards = max(self.backwards, -int(steps.min()))
        self.periods.append((float(np.median(steps)), len(steps)))


def log_times_of(
    bag: Bag, reached: Callable[[float], None] = lambda _: None
) -> dict[str, LogTimes]:
    """Return the log times of every topic with messages; `reached` gets the share read (0 to 1).

    What cannot be read is left out: opening or evaluating the recording has said so.
    """
    found: dict[str, LogTimes] = {}
    members = sorted(bag.members, key=lambda member: member.span() or (0, 0))
    for k, member in enumerate(members):
        topics = {channel.id: channel.topic for channel in member.index.channels.values()}
        for channel, times, share in _times_of(member):
            if channel in topics:
                found.setdefault(topics[channel], LogTimes()).take(times)
            reached((k + share) / len(members))
    return found


def _times_of(member: Member) -> Iterator[tuple[int, Times, float]]:
    """Yield channels with log times (n,) in ns, and the share of the file that was read."""
    if not isinstance(member.index, McapIndex):
        total, done = max(sum(member.index.counts.values()), 1), 0
        for channel, held in foreign_times(member.storage, member.content, member.name):
            done += len(held)
            yield channel, np.array(held, np.int64), done / total
        return
    buffers = Buffers()
    pieces = sorted(member.index.pieces, key=lambda piece: piece.start)
    with member.content.open('rb') as file:
        for k, piece in enumerate(pieces):
            held_by = _indexed(file, piece)
            if held_by is None:
                held_by = _walked(file, piece, buffers)
            for channel, times in held_by.items():
                yield channel, times, (k + 1) / len(pieces)


def _indexed(file: BinaryIO, piece: Piece) -> dict[int, Times] | None:
    """Return the log times by channel of a chunk's message indexes; None if these are of no use."""
    if piece.indexes is None:
        return None
    after = piece.start + piece.length
    data = pread(file, after, piece.index_length)
    found = {}
    for channel, at in piece.indexes.items():
        times = indexed_times(memoryview(data)[at - after :], channel)
        if times is None:
            return None
        found[channel] = times
    return found


def _walked(file: BinaryIO, piece: Piece, buffers: Buffers) -> dict[int, Times]:
    packed = buffers.packed(LEAD + piece.length)
    start = 0 if piece.head is not None else LEAD
    content = pread(file, piece.start, piece.length)
    packed.data[start : start + len(content)] = content
    try:
        records = packed if piece.head is None else buffers.records(piece.head, packed)
    except BadBag:  # reported where its messages are read
        return {}
    size = piece.length if piece.head is None else piece.head.size
    data = records[LEAD : LEAD + size]
    return {c: log_times(data, offsets) for c, offsets in walk(data.data).messages.items()}
