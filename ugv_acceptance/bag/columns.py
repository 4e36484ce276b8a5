"""Messages of one channel to columns: whole stretches at a time where their layout is regular.

The records of a chunk are gathered as rows of equal length, one memcpy each. Every byte that must
not vary is compared with the layout learnt from an earlier message; rows that differ are tried
with the other layouts known and in the end decoded one by one. Either way gives the same numbers.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, TypeAlias, TypeVar, cast

import numpy as np
import zstandard
from numpy.typing import NDArray

from ugv_acceptance import BadSample
from ugv_acceptance.bag.cdr import IMU, JOINT_STATE, PAYLOAD, Decoder, Kind, Layout, Wire
from ugv_acceptance.evaluation.samples import (
    Batch,
    Floats,
    ImuColumns,
    JointStateColumns,
    PayloadColumns,
    Times,
)

Columns: TypeAlias = JointStateColumns | ImuColumns | PayloadColumns
AnyColumns = TypeVar('AnyColumns', JointStateColumns, ImuColumns, PayloadColumns)
Bytes: TypeAlias = NDArray[np.uint8]
Key: TypeAlias = tuple[Any, ...]

LEAD = 8  # bytes kept free in front of a chunk's records, so that a row may begin before the first
SLACK = 8  # and behind them, so that a row may end after the last
HEAD = 31  # opcode, length, channel, sequence, log time, publish time
_BEFORE = 5  # a row starts this far before its record: then CDR's origin is a multiple of 8
_GUESSES = 8  # layouts learnt a chunk before the rest goes message by message
_MAX_PLANS = 16
_MAX_MESSAGE = 1 << 24


def batch(columns: Iterable[Columns]) -> Batch:
    """One batch of these columns, of whatever types."""
    held = list(columns)
    return Batch(
        [c for c in held if isinstance(c, JointStateColumns)],
        [c for c in held if isinstance(c, ImuColumns)],
        [c for c in held if isinstance(c, PayloadColumns)],
    )


def select(columns: AnyColumns, rows: NDArray[Any] | slice) -> AnyColumns:
    """The given rows of `columns`."""
    arrays = {
        f.name: value[rows]
        for f in fields(columns)
        if isinstance(value := getattr(columns, f.name), np.ndarray)
    }
    return replace(columns, **arrays)


@dataclass(frozen=True, slots=True)
class Decoded:
    """What came of some messages of one topic.

    `malformed` could not be decoded, `reason` says why the first could not; `broken` are index
    entries at which there is no message of this channel.
    """

    columns: list[Columns]
    count: int = 0
    malformed: int = 0
    reason: str = ''
    broken: int = 0


@dataclass(frozen=True, slots=True)
class _Raw:
    """Messages alike: `place` is their place among the messages of the call."""

    place: NDArray[np.int64]
    log_time: Times
    stamp: Times
    blocks: tuple[Floats, ...]


def _joint_states(key: Key, log_time: Times, stamp: Times, blocks: Sequence[Floats]) -> Columns:
    floats = [block.astype(np.float64, order='C') for block in blocks]
    return JointStateColumns(key[0], log_time, stamp, *floats)


def _imu(key: Key, log_time: Times, stamp: Times, blocks: Sequence[Floats]) -> Columns:
    v = blocks[0]
    wanted = (slice(0, 4), slice(13, 16), slice(25, 28), 4, 16, 28)
    arrays = [v[:, part].astype(np.float64, order='C') for part in wanted]
    return ImuColumns(key[0], log_time, stamp, *arrays)


def _payload(key: Key, log_time: Times, stamp: Times, blocks: Sequence[Floats]) -> Columns:
    v = blocks[0]
    arrays = [v[:, part].astype(np.float64, order='C') for part in (0, slice(1, 4))]
    return PayloadColumns(key[0], log_time, stamp, *arrays)


_COLUMNS: dict[str, Callable[[Key, Times, Times, Sequence[Floats]], Columns]] = {
    JOINT_STATE.type: _joint_states,
    IMU.type: _imu,
    PAYLOAD.type: _payload,
}


def _key(kind: Kind[Any], layout: Layout) -> Key:
    """What messages that share columns have in common."""
    return (layout.names, layout.widths) if kind is JOINT_STATE else (layout.frame_id,)


class _Plan:
    """A layout turned into a row: which words must equal which, and where the numbers lie."""

    __slots__ = ('key', 'record', 'regions', 'row', 'width', 'words')

    def __init__(self, kind: Kind[Any], layout: Layout, channel: int) -> None:
        self.key = _key(kind, layout)
        self.record = HEAD + layout.length
        self.words = -(-(_BEFORE + self.record) // 8)
        self.width = 8 * self.words
        order = '<' if layout.little else '>'
        data = _BEFORE + HEAD
        names = [f'block{i}' for i in range(len(layout.blocks))]
        self.row = np.dtype(
            {
                'names': ['log_time', 'sec', 'nanosec', *names],
                'formats': ['<i8', f'{order}i4', f'{order}u4']
                + [(f'{order}f8', (n,)) for n in layout.widths],
                'offsets': [_BEFORE + 15, data + layout.stamp, data + layout.stamp + 4]
                + [data + offset if n else 0 for offset, n in layout.blocks],
                'itemsize': self.width,
            }
        )
        self.regions = self._regions(layout, channel)

    def _regions(self, layout: Layout, channel: int) -> list[tuple[slice, Any, Any]]:
        """Stretches of words that hold constant bytes: where, the words expected, which bits."""
        text = np.zeros(self.width, np.uint8)
        mask = np.zeros(self.width, np.uint8)
        head = b'\x05' + (self.record - 9).to_bytes(8, 'little') + channel.to_bytes(2, 'little')
        data = [(_BEFORE + HEAD + offset, piece) for offset, piece in layout.constant]
        for offset, piece in [(_BEFORE, head), *data]:
            text[offset : offset + len(piece)] = np.frombuffer(piece, np.uint8)
            mask[offset : offset + len(piece)] = 0xFF
        words, bits = text.view(np.uint64), mask.view(np.uint64)
        held = np.flatnonzero(bits)
        runs = np.split(held, np.flatnonzero(np.diff(held) > 3) + 1)
        parts = [slice(int(run[0]), int(run[-1]) + 1) for run in runs]
        return [(part, words[part], bits[part]) for part in parts]

    def rows(self, buffer: Bytes, offsets: NDArray[np.int64]) -> NDArray[Any]:
        """The records at `offsets` as rows of bytes; they must lie inside the buffer."""
        starts = buffer.size - self.width - (LEAD - _BEFORE) + 1
        everywhere = np.ndarray(
            (starts,), f'V{self.width}', buffer, offset=LEAD - _BEFORE, strides=(1,)
        )
        return everywhere[offsets]

    def matches(self, rows: NDArray[Any]) -> NDArray[np.bool_] | None:
        """Which rows have this layout; None if all have."""
        words = rows.view(np.uint64).reshape(len(rows), self.words)
        differs = [(words[:, part] ^ text, bits) for part, text, bits in self.regions]
        if not any((np.bitwise_or.reduce(d, axis=0) & bits).any() for d, bits in differs):
            return None
        bad = np.zeros(len(rows), np.bool_)
        for d, bits in differs:
            bad |= (d & bits).any(axis=1)
        return ~bad

    def raw(self, rows: NDArray[Any], place: NDArray[np.int64]) -> _Raw:
        """The numbers of rows that match."""
        row = rows.view(self.row)
        stamp = row['sec'].astype(np.int64)
        stamp *= 1_000_000_000
        stamp += row['nanosec']
        names = (self.row.names or ())[3:]
        return _Raw(place, row['log_time'].astype(np.int64), stamp, tuple(row[n] for n in names))


class ColumnDecoder:
    """Turns messages of one channel into columns; remembers the layouts it has met.

    ROS 1's packing and compressed messages mean message by message. Safe to use from several
    threads.
    """

    def __init__(self, kind: Kind[Any], channel: int = 0, wire: Wire = 'cdr') -> None:
        self.kind = kind
        self.channel = channel
        self.regular = wire == 'cdr'
        self._one = Decoder(kind, wire)
        self._plans: tuple[_Plan, ...] = ()

    def records(self, buffer: Bytes, size: int, offsets: NDArray[np.int64]) -> Decoded:
        """Decode the message records at `offsets` (increasing) in a chunk.

        The chunk's `size` bytes of records begin at `buffer[LEAD]` and offsets count from there;
        the buffer has SLACK bytes behind them.
        """
        found: list[tuple[Key, _Raw]] = []
        pending = np.arange(len(offsets))
        if self.regular:
            for plan in self._plans:
                pending = self._try(plan, buffer, size, offsets, pending, found)
                if not pending.size:
                    break
            for _ in range(_GUESSES):
                plan_ = self._guess(buffer, size, offsets, pending)
                if plan_ is None:
                    break
                pending = self._try(plan_, buffer, size, offsets, pending, found)
        return self._rest(buffer, size, offsets, pending, found)

    def _try(
        self,
        plan: _Plan,
        buffer: Bytes,
        size: int,
        offsets: NDArray[np.int64],
        pending: NDArray[np.int64],
        found: list[tuple[Key, _Raw]],
    ) -> NDArray[np.int64]:
        """Take the pending messages that have the plan's layout; the others stay pending."""
        fit = int(np.searchsorted(offsets[pending], size - plan.record, 'right'))
        inside, beyond = pending[:fit], pending[fit:]
        if not fit:
            return pending
        rows = plan.rows(buffer, offsets[inside])
        good = plan.matches(rows)
        if good is None:
            found.append((plan.key, plan.raw(rows, inside)))
            return beyond
        if good.any():
            found.append((plan.key, plan.raw(rows[good], inside[good])))
        return np.concatenate((inside[~good], beyond))

    def _guess(
        self, buffer: Bytes, size: int, offsets: NDArray[np.int64], pending: NDArray[np.int64]
    ) -> _Plan | None:
        """The layout of the first pending message, if it is one."""
        data = self._message(buffer, size, int(offsets[pending[0]])) if pending.size else None
        if data is None:
            return None
        try:
            layout, _, _ = self._one.raw(data)
        except BadSample:
            return None
        plan = _Plan(self.kind, layout, self.channel)
        self._plans = (plan, *self._plans)[:_MAX_PLANS]
        return plan

    def _message(self, buffer: Bytes, size: int, offset: int) -> bytes | None:
        """A message's own bytes, or None where there is no message of this channel."""
        head = buffer[LEAD + offset : LEAD + offset + 11].tobytes()
        length = int.from_bytes(head[1:9], 'little')
        channel = int.from_bytes(head[9:11], 'little')
        if head[0] != 5 or channel != self.channel or not 22 <= length <= size - offset - 9:
            return None
        return buffer[LEAD + offset + HEAD : LEAD + offset + 9 + length].tobytes()

    def _rest(
        self,
        buffer: Bytes,
        size: int,
        offsets: NDArray[np.int64],
        pending: NDArray[np.int64],
        found: list[tuple[Key, _Raw]],
    ) -> Decoded:
        """Decode what is pending one by one and put all together in the order it came."""
        messages: list[tuple[int, int, bytes]] = []
        for place in pending.tolist():
            offset = int(offsets[place])
            data = self._message(buffer, size, offset)
            if data is not None:
                at = LEAD + offset + 15
                log_time = int(buffer[at : at + 8].view('<i8')[0])
                messages.append((place, log_time, data))
        one, malformed, reason = self._one_by_one(messages)
        columns, count = _assemble(self.kind, found + one)
        return Decoded(columns, count, malformed, reason, len(pending) - len(messages))

    def messages(self, messages: Iterable[tuple[int, bytes]]) -> Decoded:
        """Decode (log time in ns, bytes) one by one."""
        placed = ((place, log, data) for place, (log, data) in enumerate(messages))
        one, malformed, reason = self._one_by_one(placed)
        columns, count = _assemble(self.kind, one)
        return Decoded(columns, count, malformed, reason)

    def _one_by_one(
        self, messages: Iterable[tuple[int, int, bytes]]
    ) -> tuple[list[tuple[Key, _Raw]], int, str]:
        malformed, reason = 0, ''
        groups: dict[Key, list[tuple[int, int, int, list[tuple[float, ...]]]]] = {}
        for place, log_time, packed in messages:
            try:
                layout, stamp, blocks = self._one.raw(_plain(packed))
            except BadSample as error:
                malformed += 1
                reason = reason or str(error)
                continue
            groups.setdefault(_key(self.kind, layout), []).append((place, log_time, stamp, blocks))
        return [(key, _raw_of(rows)) for key, rows in groups.items()], malformed, reason


def _plain(data: bytes) -> bytes:
    """The message itself where rosbag2 compressed it (compression_mode: message)."""
    if data[:4] != zstandard.FRAME_HEADER:
        return data
    try:
        if zstandard.frame_content_size(data) > _MAX_MESSAGE:
            raise BadSample(f'message claims more than {_MAX_MESSAGE} bytes')
        return zstandard.ZstdDecompressor().decompress(data, max_output_size=_MAX_MESSAGE)
    except zstandard.ZstdError as error:
        raise BadSample(f'message: its zstd data is broken ({error})') from error


def _raw_of(rows: list[tuple[int, int, int, list[tuple[float, ...]]]]) -> _Raw:
    place, log_time, stamp, blocks = zip(*rows, strict=True)
    widths = [len(block) for block in blocks[0]]
    arrays = [
        np.array([b[i] for b in blocks], np.float64).reshape(len(rows), width)
        for i, width in enumerate(widths)
    ]
    times = (np.array(t, np.int64) for t in (place, log_time, stamp))
    return _Raw(*times, tuple(arrays))


def _assemble(kind: Kind[Any], found: list[tuple[Key, _Raw]]) -> tuple[list[Columns], int]:
    """Columns, one a key in order of first appearance, each in the order its messages came."""
    groups: dict[Key, list[_Raw]] = {}
    for key, raw in sorted(found, key=lambda item: int(item[1].place[0])):
        groups.setdefault(key, []).append(raw)
    columns = []
    for key, raws in groups.items():
        raw = raws[0] if len(raws) == 1 else _merged(raws)
        columns.append(_COLUMNS[kind.type](key, raw.log_time, raw.stamp, raw.blocks))
    return columns, sum(len(raw.place) for _, raw in found)


def _merged(raws: list[_Raw]) -> _Raw:
    order = np.argsort(np.concatenate([raw.place for raw in raws]), kind='stable')
    names = ('place', 'log_time', 'stamp')
    times = [np.concatenate([getattr(raw, name) for raw in raws])[order] for name in names]
    widths = range(len(raws[0].blocks))
    blocks = [np.concatenate([raw.blocks[i] for raw in raws])[order] for i in widths]
    return _Raw(times[0], times[1], times[2], tuple(cast('list[Floats]', blocks)))
