"""Reads SQLite bags (rosbag2) and ROS 1 bags, message by message, into the same columns as MCAP.

SQLite is read with Python's sqlite3: four columns of two tables are enough, also without
metadata.yaml. ROS 1 bags are read by rosbags.
"""

import sqlite3
from collections.abc import Collection, Iterator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import quote

from rosbags.rosbag1 import Reader as Ros1Reader

from ugv_acceptance import BadBag
from ugv_acceptance.bag.mcap_index import Channel
from ugv_acceptance.bag.mcap_source import Piecework, Wanted

_BLOCK = 4096  # messages a batch
_Message = tuple[int, int, bytes]  # channel, log time in ns, content


@dataclass(slots=True)
class ForeignIndex:
    """The index of an SQLite or ROS 1 file: channels, number of messages of each, time span.

    `first` and `last` are log times in ns.
    """

    channels: dict[int, Channel] = field(default_factory=dict)
    counts: dict[int, int] = field(default_factory=dict)
    first: int = 0
    last: int = 0


def open_sqlite(path: Path, name: str) -> ForeignIndex:
    """Read the index of an SQLite bag; BadBag if it is not readable. `name` is for errors."""
    with _sqlite_errors(name), closing(_connect(path)) as db:
        held = {str(row[1]) for row in db.execute('PRAGMA table_info(topics)')}
        qos = 'offered_qos_profiles' if 'offered_qos_profiles' in held else "''"
        topics = db.execute(f'SELECT id, name, type, serialization_format, {qos} FROM topics')  # noqa: S608 (one of two words)
        channels = {
            int(i): Channel(int(i), str(n), str(t), str(s), qos=str(q or ''))
            for i, n, t, s, q in topics
        }
        found = db.execute('SELECT topic_id, count(*) FROM messages GROUP BY topic_id')
        counts = {int(i): int(n) for i, n in found}
        first, last = db.execute('SELECT min(timestamp), max(timestamp) FROM messages').fetchone()
    return ForeignIndex(channels, counts, int(first or 0), int(last or 0))


def _connect(path: Path) -> sqlite3.Connection:
    # Immutable: the folder may be read-only, and a leftover journal must not be merged.
    return sqlite3.connect(f'file:{quote(str(path))}?mode=ro&immutable=1', uri=True)


class _sqlite_errors:  # noqa: N801 (used like a function)
    """Turns SQLite's errors, and values of an unexpected type, into BadBag."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, sqlite3.Error | TypeError | ValueError):
            raise BadBag(f'{self.name}: not a readable SQLite bag ({error})') from error


def _sqlite_messages(path: Path, wanted: Collection[int]) -> Iterator[_Message]:
    marks = ','.join('?' * len(wanted))
    query = (
        'SELECT topic_id, timestamp, data FROM messages '  # noqa: S608 (only question marks)
        f'WHERE topic_id IN ({marks}) ORDER BY timestamp, id'
    )
    with closing(_connect(path)) as db:
        for channel, log_time, data in db.execute(query, list(wanted)):
            if not isinstance(data, bytes):
                raise TypeError(f'a message is {type(data).__name__}, expected a blob')
            yield int(channel), int(log_time), data


def open_ros1(path: Path, name: str) -> ForeignIndex:
    """Read the index of a ROS 1 bag; BadBag if it is not readable. `name` is for errors."""
    try:
        with Ros1Reader(path) as reader:
            channels = {c.id: Channel(c.id, c.topic, c.msgtype, 'ros1') for c in reader.connections}
            counts = {c.id: c.msgcount for c in reader.connections}
            empty = not reader.message_count
            first, last = (0, 0) if empty else (reader.start_time, reader.end_time - 1)
            return ForeignIndex(channels, counts, first, last)
    except Exception as error:  # rosbags raises anything for a broken file
        raise BadBag(f'{name}: not a readable ROS 1 bag ({error})') from error


def _ros1_messages(path: Path, wanted: Collection[int]) -> Iterator[_Message]:
    with Ros1Reader(path) as reader:
        connections = [c for c in reader.connections if c.id in wanted]
        for connection, log_time, data in reader.messages(connections):
            yield connection.id, log_time, bytes(data)


_MESSAGES = {'sqlite3': _sqlite_messages, 'ros1': _ros1_messages}


def foreign_times(storage: str, path: Path, name: str) -> Iterator[tuple[int, list[int]]]:
    """Yield channels with log times (ns) of their messages, in the order of the file.

    A channel may come several times. BadBag where the file cannot be read.
    """
    if storage == 'ros1':
        try:
            with Ros1Reader(path) as reader:
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
    storage: str, path: Path, name: str, wanted: Collection[int]
) -> Iterator[_Message]:
    """Yield the messages of the wanted channels by log time; BadBag where reading breaks off."""
    messages = _MESSAGES[storage](path, wanted) if wanted else iter(())
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
    """Yield decoded blocks of messages by log time, each with its last message's log time (ns).

    If reading breaks off, the file ends there with a finding; what came before is kept.
    """
    block: list[_Message] = []
    broken = ''
    try:
        for message in foreign_messages(storage, path, name, wanted):
            block.append(message)
            if len(block) >= _BLOCK:
                yield _decode(block, wanted), block[-1][1]
                block = []
    except BadBag as error:
        broken = str(error)
    work = _decode(block, wanted)
    if broken:
        work.findings.append(broken)
    yield work, block[-1][1] if block else 0


def _decode(block: list[_Message], wanted: Wanted) -> Piecework:
    work = Piecework()
    for channel, (topic, decoder) in wanted.items():
        mine = [(log_time, data) for c, log_time, data in block if c == channel]
        if mine:
            work.add(topic, decoder.messages(mine))
    return work
