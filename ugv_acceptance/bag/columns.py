"""Decodes the messages of one channel into columns, many at once if they have the same layout.

Every byte that must not vary is compared with the layout learnt from an earlier message; messages
that differ are tried with the other known layouts, and finally decoded one by one. Both ways give
the same numbers. Some columns are views, to save a copy, so not all are contiguous.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, TypeAlias, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance import BadSample
from ugv_acceptance.bag.cdr import IMU, JOINT_STATE, PAYLOAD, Decoder, Kind
from ugv_acceptance.bag.gather import (
    HEAD,
    LEAD,
    Bytes,
    Gather,
    Offsets,
    Span,
    as_records,
    contents,
)
from ugv_acceptance.bag.layout import Layout, Wire
from ugv_acceptance.bag.packed import plain, unpack
from ugv_acceptance.evaluation.samples import Batch, ImuColumns, JointStateColumns, PayloadColumns
from ugv_acceptance.type_aliases import Floats, Times

Columns: TypeAlias = JointStateColumns | ImuColumns | PayloadColumns
AnyColumns = TypeVar('AnyColumns', bound=Columns)
Key: TypeAlias = tuple[Any, ...]
_Row: TypeAlias = tuple[int, int, int, list[tuple[float, ...]]]  # place, log time, stamp, spans

_GUESSES = 8  # layouts learnt a chunk before the rest goes message by message
_MAX_PLANS = 16


def batch(columns: Iterable[Columns]) -> Batch:
    """Return a Batch of columns of any types."""
    held = list(columns)
    return Batch(
        [c for c in held if isinstance(c, JointStateColumns)],
        [c for c in held if isinstance(c, ImuColumns)],
        [c for c in held if isinstance(c, PayloadColumns)],
    )


# Of each type the fields that are one value for all rows.
_COMMON = {JointStateColumns: ('names',), ImuColumns: ('frame_id',), PayloadColumns: ('frame_id',)}
_NAMES = {kind: tuple(f.name for f in fields(kind)) for kind in _COMMON}


def select(columns: AnyColumns, rows: NDArray[Any] | slice) -> AnyColumns:
    """Return the given rows of `columns`."""
    kind = type(columns)
    values = ((name, getattr(columns, name)) for name in _NAMES[kind])
    return kind(*(value if name in _COMMON[kind] else value[rows] for name, value in values))


@dataclass(frozen=True, slots=True)
class Decoded:
    """The columns decoded from some messages of one topic, and the numbers of bad messages.

    `count` messages were decoded, `malformed` could not be (`reason` says why the first could not);
    `broken` index entries do not point to a message of this channel.
    """

    columns: list[Columns]
    count: int = 0
    malformed: int = 0
    reason: str = ''
    broken: int = 0


@dataclass(frozen=True, slots=True)
class _Raw:
    """The times and float64 blocks of n messages of one layout.

    `place` (n,) is their position among the messages of the call.
    """

    place: NDArray[np.int64]
    log_time: Times
    stamp: Times
    blocks: tuple[Floats, ...]


def _joint_states(key: Key, log_time: Times, stamp: Times, blocks: Sequence[Floats]) -> Columns:
    return JointStateColumns(key[0], log_time, stamp, *blocks)


def _imu(key: Key, log_time: Times, stamp: Times, blocks: Sequence[Floats]) -> Columns:
    q, w, a = blocks
    vectors = (q[:, :4], w[:, :3], a[:, :3])
    return ImuColumns(key[0], log_time, stamp, *vectors, q[:, 4], w[:, 3], a[:, 3])


def _payload(key: Key, log_time: Times, stamp: Times, blocks: Sequence[Floats]) -> Columns:
    return PayloadColumns(key[0], log_time, stamp, blocks[0][:, 0], blocks[0][:, 1:])


@dataclass(frozen=True, slots=True)
class _Shape:
    """How a type's columns are made: the spans of its blocks (() means all) and the constructor."""

    spans: tuple[Span, ...]
    columns: Callable[[Key, Times, Times, Sequence[Floats]], Columns]


_SHAPES = {
    JOINT_STATE.type: _Shape((), _joint_states),
    # each vector with element 0 of the covariance that follows it
    IMU.type: _Shape(((0, 0, 5), (0, 13, 17), (0, 25, 29)), _imu),
    PAYLOAD.type: _Shape(((0, 0, 4),), _payload),
}


def _key(kind: Kind[Any], layout: Layout) -> Key:
    """Return what messages must have in common to share columns: names and widths, or frame."""
    return (layout.names, layout.widths) if kind is JOINT_STATE else (layout.frame_id,)


class ColumnDecoder:
    """Decodes messages of one channel into columns; remembers the layouts it has seen.

    ROS 1 messages and singly compressed messages are decoded one by one. Safe to use from several
    threads.
    """

    def __init__(self, kind: Kind[Any], channel: int = 0, wire: Wire = 'cdr') -> None:
        self.kind = kind
        self.channel = channel
        self.regular = wire == 'cdr'
        self._shape = _SHAPES[kind.type]
        self._one = Decoder(kind, wire)
        self._plans: tuple[_Plan, ...] = ()

    def records(self, buffer: Bytes, size: int, offsets: Offsets) -> Decoded:
        """Decode the message records at `offsets` (increasing) in a chunk.

        The chunk's `size` bytes of records begin at `buffer[LEAD]` and offsets count from there;
        the buffer has SLACK bytes behind them.
        """
        jobs = [_Job(buffer, size, offsets, np.arange(len(offsets)))]
        if self.regular:
            self._at_once(jobs[0])
            if unpacked := jobs[0].unpack(self.channel):
                self._at_once(unpacked)
                jobs.append(unpacked)
        return self._rest(jobs)

    def _at_once(self, job: '_Job') -> None:
        """Decode pending messages whose layouts are known, and those of a few new ones."""
        for plan in self._plans:
            job.attempt(plan)
            if not job.pending.size:
                return
        for _ in range(_GUESSES):
            guess = self._guess(job)
            if guess is None:
                return
            job.attempt(guess)

    def _guess(self, job: '_Job') -> '_Plan | None':
        """Learn and return the layout of the first pending message; None if it is not valid."""
        data = job.message(self.channel, int(job.pending[0])) if job.pending.size else None
        if data is None:
            return None
        try:
            layout, _, _ = self._one.raw(data)
        except BadSample:
            return None
        gather = Gather(layout, self.channel, self._shape.spans)
        plan = _Plan(_key(self.kind, layout), gather)
        self._plans = (plan, *self._plans)[:_MAX_PLANS]
        return plan

    def _rest(self, jobs: 'Sequence[_Job]') -> Decoded:
        """Decode the pending messages one by one; return all decoded ones in their order."""
        rest = [message for job in jobs for message in job.rest(self.channel)]
        one, malformed, reason = self._one_by_one(sorted(rest)) if rest else ([], 0, '')
        columns, count = self._assemble([part for job in jobs for part in job.found] + one)
        broken = sum(job.pending.size for job in jobs) - len(rest)
        return Decoded(columns, count, malformed, reason, broken)

    def _one_by_one(
        self, messages: Iterable[tuple[int, int, bytes, bool]]
    ) -> tuple[list[tuple[Key, _Raw]], int, str]:
        malformed, reason = 0, ''
        groups: dict[Key, list[_Row]] = {}
        for place, log_time, data, packed in messages:
            try:
                layout, stamp, blocks = self._one.raw(plain(data) if packed else data)
            except BadSample as error:
                malformed += 1
                reason = reason or str(error)
                continue
            spans = [blocks[i][first:last] for i, first, last in self._shape.spans] or blocks
            groups.setdefault(_key(self.kind, layout), []).append((place, log_time, stamp, spans))
        return [(key, _raw_of(rows)) for key, rows in groups.items()], malformed, reason

    def _assemble(self, found: list[tuple[Key, _Raw]]) -> tuple[list[Columns], int]:
        """Return one set of columns per key, by first appearance, and the number of messages."""
        groups: dict[Key, list[_Raw]] = {}
        for key, raw in sorted(found, key=lambda item: int(item[1].place[0])):
            groups.setdefault(key, []).append(raw)
        columns = []
        for key, raws in groups.items():
            raw = raws[0] if len(raws) == 1 else _merged(raws)
            columns.append(self._shape.columns(key, raw.log_time, raw.stamp, raw.blocks))
        return columns, sum(len(raw.place) for _, raw in found)


@dataclass(frozen=True, slots=True)
class _Plan:
    """A layout seen before: the key of its columns, and its gather operation."""

    key: Key
    gather: Gather


@dataclass(slots=True)
class _Job:
    """The decoding of a chunk's messages: positions still `pending`, and those `found`.

    Of messages that have been unpacked, `place` is their position among the packed ones.
    """

    buffer: Bytes
    size: int
    offsets: Offsets
    pending: Offsets
    place: Offsets | None = None
    found: list[tuple[Key, _Raw]] = field(default_factory=list)

    def attempt(self, plan: _Plan) -> None:
        """Decode the pending messages that have the plan's layout; the others stay pending."""
        if not self.pending.size:
            return
        everything = self.pending.size == self.offsets.size
        offsets = self.offsets if everything else self.offsets[self.pending]
        fit = offsets.size
        if offsets[-1] > self.size - plan.gather.record:
            fit = int(np.searchsorted(offsets, self.size - plan.gather.record, 'right'))
        if not fit:
            return
        inside, offsets = self.pending[:fit], offsets[:fit]
        good, held = plan.gather.matching(self.buffer, offsets)
        left = self.pending[fit:]
        if good is not None:
            left = np.concatenate((inside[~good], left))
            inside = inside[good]
        if inside.size:
            place = inside if self.place is None else self.place[inside]
            times, blocks = plan.gather.times(held), plan.gather.blocks(held)
            self.found.append((plan.key, _Raw(place, *times, blocks)))
        self.pending = left

    def message(self, channel: int, place: int) -> bytes | None:
        """Return a message's content, None if there is no message of this channel."""
        start = LEAD + int(self.offsets[place])
        head = self.buffer[start : start + 11].tobytes()
        length = int.from_bytes(head[1:9], 'little')
        found = int.from_bytes(head[9:11], 'little')
        room = LEAD + self.size - start - 9
        if head[0:1] != b'\x05' or found != channel or not 22 <= length <= room:
            return None
        return self.buffer[start + HEAD : start + 9 + length].tobytes()

    def rest(self, channel: int) -> Iterator[tuple[int, int, bytes, bool]]:
        """Yield place, log time (ns), content, "may be packed" of what is pending and a message."""
        for at in self.pending.tolist():
            data = self.message(channel, at)
            if data is not None:
                start = LEAD + int(self.offsets[at]) + 15
                log_time = int(self.buffer[start : start + 8].view('<i8')[0])
                place = at if self.place is None else int(self.place[at])
                yield place, log_time, data, self.place is None

    def unpack(self, channel: int) -> '_Job | None':
        """Take the pending messages that are compressed singly, and return the job to decode them.

        None if there is none of them, or one is broken.
        """
        if not self.pending.size:
            return None
        offsets = self.offsets[self.pending]
        good, starts, lengths, times = contents(self.buffer, self.size, offsets, channel)
        found = unpack(self.buffer, starts, lengths)
        if found is None:
            return None
        good[good] = found.which
        place, self.pending = self.pending[good], self.pending[~good]
        at = as_records(found.buffer, found.sizes, channel, times[found.which])
        size = int(at[-1]) + HEAD + int(found.sizes[-1])
        return _Job(found.buffer, size, at, np.arange(len(at)), place)


def _raw_of(rows: list[_Row]) -> _Raw:
    place, log_time, stamp, blocks = zip(*rows, strict=True)
    widths = [len(block) for block in blocks[0]]
    arrays = [
        np.array([b[i] for b in blocks], np.float64).reshape(len(rows), width)
        for i, width in enumerate(widths)
    ]
    times = [np.array(t, np.int64) for t in (place, log_time, stamp)]
    return _Raw(times[0], times[1], times[2], tuple(arrays))


def _merged(raws: list[_Raw]) -> _Raw:
    order = np.argsort(np.concatenate([raw.place for raw in raws]), kind='stable')
    names = ('place', 'log_time', 'stamp')
    times = [np.concatenate([getattr(raw, name) for raw in raws])[order] for name in names]
    widths = range(len(raws[0].blocks))
    blocks = [np.concatenate([raw.blocks[i] for raw in raws])[order] for i in widths]
    return _Raw(times[0], times[1], times[2], tuple(cast('list[Floats]', blocks)))
