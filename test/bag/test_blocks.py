"""SQLite bags and messages compressed one by one give the columns that MCAP chunks give."""

import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard
from bag.bag_cases import (
    IMU,
    INERTIA,
    JOINT_STATE,
    Message,
    cdr,
    expected,
    imu,
    inertia,
    joint_state,
    rows,
    run,
    write_mcap,
)
from bag.recordings import damaged, read, write_other

from ugv_acceptance.bag.reader import Topics, choose_topics, open_bag
from ugv_acceptance.bag.reading import Facts
from ugv_acceptance.evaluation.samples import Batch

Row = tuple[int, int, Any, Any]  # id, topic, timestamp, data


def motley(count: int = 400) -> list[Message]:
    """Messages of several layouts, byte orders and frames; some empty, cut off or garbled."""
    messages: list[Message] = []
    for i in range(count):
        time = 10**9 + i * 10**6
        names = [f'joint{k}' for k in range(i % 3)]
        joints = cdr(joint_state((i, 1), 'f' * (i % 2), names, [[i] * len(names), (), ()]))
        moving = cdr(imu((i, 2), 'imu' * (i % 5 % 2)), little=bool(i % 4))
        odd = {7: b'', 11: joints[:-5], 13: b'\x00\x01' + bytes(6), 17: joints + bytes(9)}
        messages.append(('/joint_states', JOINT_STATE, time, odd.get(i % 40, joints)))
        messages.append(('/imu/data', IMU, time + 10, moving[: 60 if i % 50 == 9 else None]))
        if i % 60 == 5:
            messages.append(('/payload', INERTIA, time + 20, cdr(inertia((i, 3)))))
    return messages


def compressed(messages: list[Message]) -> list[Message]:
    """The messages as rosbag2 compresses them singly; frames of several kinds, and broken ones."""
    packers = [
        zstandard.ZstdCompressor(),
        zstandard.ZstdCompressor(write_content_size=False),
        zstandard.ZstdCompressor(write_checksum=True, level=9),
    ]
    out = []
    for i, (topic, kind, time, data) in enumerate(messages):
        packed = packers[i // 90 % 3].compress(data)
        if i % 100 == 33:
            packed = packed[:-2]
        if i % 100 == 66:
            packed = packers[0].compress(packed)  # twice: what is in it is no message
        out.append((topic, kind, time, data if i % 100 == 99 else packed))
    return out


def in_order(batches: list[Batch]) -> list[Any]:
    """The rows of batches, in the columns of which messages are by time."""
    for batch in batches:
        of_each: list[Any] = [*batch.joints, *batch.imu, *batch.payload]
        assert all((np.diff(columns.log_time) >= 0).all() for columns in of_each)
    return rows(batches)


def findings(facts: Facts) -> tuple[Any, ...]:
    """What reading found, but for the name of the file."""
    return facts.counts, facts.malformed, facts.late, facts.findings


def db3(path: Path, stored: list[Row], *, index: bool = True, key: str = 'PRIMARY KEY') -> Path:
    """An SQLite bag of these rows, with or without the usual index and key."""
    with closing(sqlite3.connect(path)) as db, db:
        db.execute('CREATE TABLE topics(id INTEGER, name TEXT, type TEXT, serialization_format)')
        db.execute(f'CREATE TABLE messages(id INTEGER {key}, topic_id INTEGER, timestamp, data)')
        if index:
            db.execute('CREATE INDEX timestamp_idx ON messages (timestamp ASC)')
        kinds = {1: ('/joint_states', JOINT_STATE), 70001: ('/imu/data', IMU)}
        topics = [(number, *kind, 'cdr') for number, kind in kinds.items()]
        db.executemany('INSERT INTO topics VALUES (?, ?, ?, ?)', topics)
        db.executemany('INSERT INTO messages VALUES (?, ?, ?, ?)', stored)
    return path


def stored(messages: list[Message], step: int = 1) -> list[Row]:
    """Rows of the messages in their order, of every `step`-th id."""
    topics = {'/joint_states': 1, '/imu/data': 70001}
    return [(1 + k * step, topics[t], time, data) for k, (t, _, time, data) in enumerate(messages)]


@pytest.mark.parametrize('packed', [False, True])
@pytest.mark.parametrize('suffix', ['db3', 'mcap'])
def test_columns_of_every_form_are_those_one_by_one(
    tmp_path: Path,
    suffix: str,
    packed: bool,  # noqa: FBT001
) -> None:
    """Whatever the messages are, form and compression change neither columns nor findings."""
    plain = motley()
    messages = compressed(plain) if packed else plain
    path = tmp_path / f'run.{suffix}'
    if suffix == 'mcap':
        write_mcap(path, messages)
    else:
        write_other(path, messages)
    bag = open_bag(path)
    reading = bag.batches(Topics('/joint_states', '/imu/data', '/payload'))
    found = in_order(list(reading))
    # A message a chunk: nothing is decoded together.
    single = open_bag(write_mcap(tmp_path / 'single.mcap', messages, chunk_size=1))
    one_by_one = single.batches(Topics('/joint_states', '/imu/data', '/payload'))
    assert found == rows(one_by_one)
    assert len(found) > 500
    assert findings(reading.facts) == findings(one_by_one.facts)


def test_compressed_messages_are_what_rosbags_makes_of_them(tmp_path: Path) -> None:
    """Frames with and without their size, with checksums, beside messages that are none."""
    messages = run(300)
    packed = compressed(messages)
    whole = [m for i, m in enumerate(messages) if i % 100 not in {33, 66}]
    _, batches, facts = read(write_mcap(tmp_path / 'run.mcap', packed))
    assert in_order(batches) == expected(whole)
    assert {topic: number for topic, (number, _) in facts.malformed.items()} == {
        '/joint_states': 6,
        '/imu/data': 6,
    }


def test_rows_of_many_blocks_come_whole(tmp_path: Path) -> None:
    """Blocks of rows, with gaps between their ids, lose and repeat nothing."""
    messages = run(3000)
    _, batches, facts = read(db3(tmp_path / 'run.db3', stored(messages, step=3)))
    assert in_order(batches) == expected(messages)
    assert facts.findings == ()
    assert len(batches) > 2


@pytest.mark.parametrize('far', [7, 5000])
def test_rows_out_of_order_come_by_time(tmp_path: Path, far: int) -> None:
    """Rows that were not stored by time come in order of time, also from another block."""
    messages = run(3000)
    order = list(range(len(messages)))
    order[100], order[100 + far] = order[100 + far], order[100]
    path = db3(tmp_path / 'run.db3', stored([messages[i] for i in order]))
    _, batches, facts = read(path)
    assert in_order(batches) == expected(messages)
    assert facts.late == 0


@pytest.mark.parametrize(('index', 'key'), [(False, 'PRIMARY KEY'), (True, ''), (False, '')])
def test_tables_made_by_others_are_read(tmp_path: Path, index: bool, key: str) -> None:  # noqa: FBT001
    """Without the index or the key that rosbag2 makes, the messages are the same."""
    messages = run(50)
    _, batches, facts = read(db3(tmp_path / 'run.db3', stored(messages), index=index, key=key))
    assert in_order(batches) == expected(messages)
    assert facts.findings == ()


ODD: dict[str, Callable[[Row], Row]] = {
    'text': lambda row: (*row[:3], 'text'),
    'an empty text': lambda row: (*row[:3], ''),
    'a text of bytes': lambda row: (*row[:3], '\x00\x01\x00\x00'),
    'a number': lambda row: (*row[:3], 5),
    'no content': lambda row: (*row[:3], None),
    'a time that is none': lambda row: (*row[:2], b'noon', row[3]),
}


@pytest.mark.parametrize('name', ODD)
def test_a_row_of_an_odd_type_ends_the_bag(tmp_path: Path, name: str) -> None:
    """A row that holds no message is told, and what was logged before it is kept."""
    messages = run(2500)
    table = stored(messages)
    table[4700] = ODD[name](table[4700])
    path = db3(tmp_path / 'run.db3', stored(messages))
    bag = open_bag(path)
    with closing(sqlite3.connect(path)) as db, db:
        db.execute('UPDATE messages SET timestamp = ?, data = ? WHERE id = 4701', table[4700][2:])
    reading = bag.batches(choose_topics(bag))
    found = in_order(list(reading))
    assert any('run.db3: reading ended early' in text for text in reading.facts.findings)
    assert (sum(reading.facts.counts.values()), reading.facts.late) == (len(found), 0)
    kept = messages[:4700] + (messages[4701:] if name == 'a time that is none' else [])
    assert found == expected(kept)


def test_a_damaged_sqlite_file_keeps_what_is_before(tmp_path: Path) -> None:
    """Where pages of the file are lost, the messages before are read and the loss is told."""
    messages = run(4000)
    path = db3(tmp_path / 'run.db3', stored(messages))
    bag = open_bag(path)
    damaged(path, path.stat().st_size // 2, b'\xff' * 4096)
    reading = bag.batches(choose_topics(bag))
    found = rows(reading)
    assert 1000 < len(found) < len(messages)
    assert found == expected(messages)[: len(found)]
    assert any('reading ended early' in text for text in reading.facts.findings)


def test_a_frame_that_claims_too_much_is_malformed(tmp_path: Path) -> None:
    """A few bytes that claim gigabytes are not believed, and cost only themselves."""
    messages = run(20)
    bomb = b'\x28\xb5\x2f\xfd\xe0' + (1 << 40).to_bytes(8, 'little') + bytes(8)
    topic, kind, time, _ = messages[4]
    packed = compressed(messages)
    packed[4] = (topic, kind, time, bomb)
    _, batches, facts = read(write_mcap(tmp_path / 'run.mcap', packed))
    assert in_order(batches) == expected([*messages[:4], *messages[5:33], *messages[34:]])
    assert facts.malformed['/joint_states'][0] == 1
    assert 'claims more than' in facts.malformed['/joint_states'][1]
