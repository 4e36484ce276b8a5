"""Reads SQLite bags (rosbag2) and ROS 1 bags into the same columns as MCAP.

Messages are put one after another like those in a chunk of an MCAP file, and decoded as such.
SQLite is read with Python's sqlite3: four columns of two tables are enough, also without
metadata.yaml; it joins the messages of many rows itself. ROS 1 bags are read by rosbags, message by
message.
"""

import sqlite3
from collections.abc import Collection, Iterator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

import numpy as np

from ugv_acceptance import BadBag
from ugv_acceptance.bag.gather import HEAD, LEAD, SLACK, Bytes, Offsets, as_records
from ugv_acceptance.bag.mcap_index import Channel
from ugv_acceptance.bag.mcap_source import Piecework, Wanted
from ugv_acceptance.type_aliases import Times

if TYPE_CHECKING:
    from rosbags.rosbag1 import Reader as Ros1Reader

_BLOCK = 4096  # messages a batch
_LAST_ID = (1 << 63) - 1
# Each by itself is found by the index.
_SPAN = 'SELECT (SELECT min(timestamp) FROM messages), (SELECT max(timestamp) FROM messages)'
# Of some rows: the contents with room for a head between them, the log times, and topic and length
# in one number, which is 0 where the content is no blob (for SQLite: number < text < blob).
_JOINED = f"""
    SELECT count(*), CAST(group_concat(data, x'{bytes(HEAD).hex()}') AS BLOB),
        CAST(group_concat(timestamp) AS BLOB),
        CAST(group_concat(((topic_id << 32) | length(data)) * (data >= x'')) AS BLOB)
    FROM messages WHERE id BETWEEN ? AND ? AND topic_id IN """  # noqa: S608 (a number of zeros)
# The oldest of the rows behind an id. The index by time is left after about a block.
_NEXT = """
    SELECT timestamp FROM messages WHERE timestamp >= ? AND +id > ? ORDER BY timestamp LIMIT 1"""
# What a killed writer leaves beside its file, by the end of its name: how that begins, and the size
# up to which it holds nothing.
LEFT_BESIDE = {'-wal': (b'\x37\x7f\x06', 32), '-journal': (b'\xd9\xd5\x05', 0)}
_Message = tuple[int, int, bytes]  # channel, log time in ns, content


@dataclass(slots=True)
class ForeignIndex:
    """The index of an SQLite or ROS 1 file: channels, number of messages of each, time span.

    `first` and `last` are log times in ns; `salvaged` is a sentence if a part is not in the file.
    """

    channels: dict[int, Channel] = field(default_factory=dict)
    counts: dict[int, int] = field(default_factory=dict)
    first: int = 0
    last: int = 0
    salvaged: str | None = None


def open_sqlite(path: Path, name: str) -> ForeignIndex:
    """Read the index of an SQLite bag; BadBag if it is not readable. `name` is for errors."""
    left = _left_beside(path)
    with _sqlite_errors(name, left), closing(_connect(path)) as db:
        held = {str(row[1]) for row in db.execute('PRAGMA table_info(topics)')}
        qos = 'offered_qos_profiles' if 'offered_qos_profiles' in held else "''"
        topics = db.execute(f'SELECT id, name, type, serialization_format, {qos} FROM topics')  # noqa: S608 (one of two words)
        channels = {
            int(i): Channel(int(i), str(n), str(t), str(s), qos=str(q or ''))
            for i, n, t, s, q in topics
        }
        found = db.execute('SELECT topic_id, count(*) FROM messages GROUP BY topic_id')
        counts = {int(i): int(n) for i, n in found}
        first, last = db.execute(_SPAN).fetchone()
    return ForeignIndex(channels, counts, int(first or 0), int(last or 0), left)


def _left_beside(path: Path) -> str | None:
    """Return in words what a killed writer has not written into its file, None if there is none."""
    for end, (magic, empty) in LEFT_BESIDE.items():
        other = path.with_name(path.name + end)
        if not other.is_file() or other.stat().st_size <= empty:
            continue
        with other.open('rb') as file:
            if file.read(len(magic)) == magic:
                return (
                    f'{other.name} beside it was not read, with what its recorder had not yet '
                    f'written into it; sqlite3 {path.name} '
                    '"PRAGMA quick_check" puts the two together'
                )
    return None


def _connect(path: Path) -> sqlite3.Connection:
    # Immutable: the folder may be read-only, and a leftover journal must not be merged.
    return sqlite3.connect(f'file:{quote(str(path))}?mode=ro&immutable=1', uri=True)


class _sqlite_errors:  # noqa: N801 (used like a function)
    """Turns SQLite's errors, and values of an unexpected type, into BadBag."""

    def __init__(self, name: str, left: str | None = None) -> None:
        self.name = name
        self.left = f'; {left}' if left else ''

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, sqlite3.Error | TypeError | ValueError):
            raise BadBag(f'{self.name}: not a readable SQLite bag ({error}){self.left}') from error


def _sqlite_messages(
    path: Path, wanted: Collection[int], after: int | None = None
) -> Iterator[_Message]:
    """Yield messages by log time: all, or those of the rows whose id is more than `after`."""
    rest = '' if after is None else f'AND +id > {after:d} '
    query = (
        'SELECT topic_id, timestamp, data FROM messages '  # noqa: S608 (question marks, a number)
        f'WHERE topic_id IN {_marks(wanted)} {rest}ORDER BY timestamp, id'
    )
    with closing(_connect(path)) as db:
        for channel, log_time, data in db.execute(query, list(wanted)):
            if not isinstance(data, bytes):
                raise TypeError(f'a message is {type(data).__name__}, expected a blob')
            yield int(channel), int(log_time), data


def _marks(wanted: Collection[int]) -> str:
    return f'({",".join("?" * len(wanted))})'


def _ros1(path: Path) -> 'Ros1Reader':
    from rosbags.rosbag1 import Reader  # noqa: PLC0415 - few recordings are of ROS 1

    return Reader(path)


def open_ros1(path: Path, name: str) -> ForeignIndex:
    """Read the index of a ROS 1 bag; BadBag if it is not readable. `name` is for errors."""
    try:
        with _ros1(path) as reader:
            channels = {c.id: Channel(c.id, c.topic, c.msgtype, 'ros1') for c in reader.connections}
            counts = {c.id: c.msgcount for c in reader.connections}
            empty = not reader.message_count
            first, last = (0, 0) if empty else (reader.start_time, reader.end_time - 1)
            return ForeignIndex(channels, counts, first, last)
    except Exception as error:  # rosbags raises anything for a broken file
        raise BadBag(f'{name}: not a readable ROS 1 bag ({error})') from error


def _ros1_messages(path: Path, wanted: Collection[int]) -> Iterator[_Message]:
    with _ros1(path) as reader:
        connections = [c for c in reader.connections if c.id in wanted]
        for connection, log_time, data in reader.messages(connections):
            yield connection.id, log_time, bytes(data)


def foreign_times(storage: str, path: Path, name: str) -> Iterator[tuple[int, list[int]]]:
    """Yield channels with log times (ns) of their messages, in the order of the file.

    A channel may come several times. BadBag where the file cannot be read.
    """
    if storage == 'ros1':
        try:
            with _ros1(path) as reader:
                yield from ((i, [e.time for e in held]) for i, held in reader.indexes.items())
        except Exception as error:  # rosbags raises anything for a broken file
            raise BadBag(f'{name}: not a readable ROS 1 bag ({error})') from error
        return
    with _sqlite_errors(name), closing(_connect(path)) as db:
        rows = db.execute('SELECT topic_id, timestamp FROM messages ORDER BY id')
        while block := rows.fetchmany(_BLOCK):
            held = dict[int, list[int]]()
            for channel, time in block:
                held.setdefault(int(channel), []).append(int(time))
            yield from held.items()


def foreign_messages(
    storage: str, path: Path, name: str, wanted: Collection[int], after: int | None = None
) -> Iterator[_Message]:
    """Yield the messages of the wanted channels by log time; BadBag where reading breaks off.

    Of an SQLite bag, only those of the rows whose id is more than `after`, if it is given.
    """
    messages: Iterator[_Message] = iter(())
    if wanted and storage == 'ros1':
        messages = _ros1_messages(path, wanted)
    elif wanted:
        messages = _sqlite_messages(path, wanted, after)
    while True:
        try:
            message = next(messages)
        except StopIteration:
            return
        except Exception as error:  # rosbags raises anything for a broken file
            raise BadBag(f'{name}: reading ended early ({error})') from error
        yield message


def foreign_blocks(
    storage: str, path: Path, name: str, wanted: Wanted
) -> Iterator[tuple[Piecework, int]]:
    """Yield decoded blocks of messages, each with the first log time (ns) that may follow it.

    If reading breaks off, the file ends there with a finding; what came before is kept.
    """
    until = 0
    try:
        for block in _blocks(storage, path, name, wanted):
            until = block.until
            yield block.decoded(wanted), until
    except BadBag as error:
        yield Piecework(findings=[str(error)]), until


@dataclass(frozen=True, slots=True)
class _Block:
    """Messages one after another in `buffer`, each after HEAD free bytes.

    `channels`, `log_times` (ns) and `lengths` (bytes) have shape (n,); no message of a later block
    was logged before `until` (ns).
    """

    buffer: Bytes
    channels: Offsets
    log_times: Times
    lengths: Offsets
    until: int

    def decoded(self, wanted: Wanted) -> Piecework:
        """Return the decoded messages."""
        work = Piecework()
        # A record has 16 bits for its channel: enough, since the block's own numbers are asked.
        offsets = as_records(self.buffer, self.lengths, self.channels & 0xFFFF, self.log_times)
        size = int((self.lengths + HEAD).sum())
        for channel, (topic, decoder) in wanted.items():
            found = offsets[self.channels == channel]
            if found.size:
                work.add(topic, decoder.records(self.buffer, size, found))
        return work


def _block_of(messages: list[_Message], until: int) -> _Block:
    contents = (data for _, _, data in messages)
    joined = bytearray(HEAD).join((bytes(LEAD), *contents, bytes(SLACK)))
    numbers = [(channel, time, len(data)) for channel, time, data in messages]
    channels, times, lengths = np.array(numbers, np.int64).T
    return _Block(np.frombuffer(joined, np.uint8), channels, times, lengths, until)


def _blocks(storage: str, path: Path, name: str, wanted: Collection[int]) -> Iterator[_Block]:
    after: int | None = None
    if storage == 'sqlite3' and wanted:
        try:
            with closing(_connect(path)) as db:
                for after, block in _joined(db, wanted):  # noqa: B007 (used below)
                    yield block
        except (sqlite3.Error, _IrregularError):
            pass  # row by row, what is still whole is found
        else:
            return
    held: list[_Message] = []
    try:
        for message in foreign_messages(storage, path, name, wanted, after):
            held.append(message)
            if len(held) >= _BLOCK:
                yield _block_of(held, message[1])
                held = []
    except BadBag:
        if held:
            yield _block_of(held, held[-1][1])
        raise
    if held:
        yield _block_of(held, held[-1][1])


class _IrregularError(Exception):
    """A table, or rows of it, that are not as rosbag2 writes them: they are read row by row."""


def _joined(db: sqlite3.Connection, wanted: Collection[int]) -> Iterator[tuple[int, _Block]]:
    """Yield the messages of some rows at a time, by id, with an id up to which all were read."""
    if not _usual(db) or not all(0 < channel < 1 << 31 for channel in wanted):
        raise _IrregularError
    (first,) = db.execute('SELECT min(id) FROM messages').fetchone()
    until, _ = db.execute(_SPAN).fetchone()
    buffer = np.zeros(0, np.uint8)
    while first is not None:
        last = min(first + _BLOCK - 1, _LAST_ID)
        row = db.execute(_JOINED + _marks(wanted), (first, last, *wanted)).fetchone()
        (first,) = db.execute('SELECT min(id) FROM messages WHERE id > ?', (last,)).fetchone()
        if first is not None:
            (until,) = db.execute(_NEXT, (until, last)).fetchone() or (None,)
        if not isinstance(until, int):
            raise _IrregularError
        if not row[0]:
            continue
        if buffer.size < LEAD + HEAD + len(row[1]) + SLACK:
            buffer = np.zeros(LEAD + HEAD + len(row[1]) * 5 // 4 + SLACK, np.uint8)
        yield last, _block_in(buffer, row, until)


def _usual(db: sqlite3.Connection) -> bool:
    """Return whether rows can be found quickly by id and by time."""
    keys = [(row[1], row[2].upper()) for row in db.execute('PRAGMA table_info(messages)') if row[5]]
    by = [
        next(iter(db.execute(f'PRAGMA index_info("{row[1]}")')), (0, 0, ''))[2]
        for row in db.execute('PRAGMA index_list(messages)')
        if not row[4]
    ]
    return keys == [('id', 'INTEGER')] and 'timestamp' in by


def _block_in(buffer: Bytes, row: tuple[int, bytes, bytes, bytes], until: int) -> _Block:
    """Return a block of the rows that SQLite joined, by log time."""
    count, contents, times, packed = row
    log_times, kinds = _numbers(times, count), _numbers(packed, count)
    channels, lengths = kinds >> 32, kinds & 0xFFFFFFFF
    if not kinds.all() or lengths.sum() + HEAD * (count - 1) != len(contents):
        raise _IrregularError
    buffer[LEAD + HEAD :][: len(contents)] = np.frombuffer(contents, np.uint8)
    if (log_times[1:] >= log_times[:-1]).all():
        return _Block(buffer, channels, log_times, lengths, until)
    starts = (np.cumsum(lengths + HEAD) - lengths - HEAD).tolist()
    rows = zip(channels.tolist(), log_times.tolist(), starts, lengths.tolist(), strict=True)
    messages = [(channel, time, contents[at : at + n]) for channel, time, at, n in rows]
    return _block_of(sorted(messages, key=lambda message: message[1]), until)


def _numbers(text: bytes, count: int) -> Offsets:
    """Return the integers (n,) in a text that SQLite joined."""
    if (text or b'').translate(None, b'-,0123456789'):
        raise _IrregularError
    found = np.fromstring(text or b'', np.int64, sep=',')
    if len(found) != count:
        raise _IrregularError
    return found
