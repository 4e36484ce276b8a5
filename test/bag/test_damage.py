"""Recordings that are cut off, damaged or hostile: what is whole is read, what is lost is told."""

import sqlite3
import struct
from contextlib import closing, suppress
from pathlib import Path

import pytest
from bag.bag_cases import (
    JOINT_STATE,
    Message,
    cdr,
    expected,
    joint_state,
    rows,
    run,
    write_mcap,
)
from bag.recordings import BOTH, SHAPES, chunk_starts, damaged, read, write_other
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType

from ugv_acceptance import BadBag
from ugv_acceptance.bag.mcap_index import MAGIC
from ugv_acceptance.bag.raw import messages as messages_of
from ugv_acceptance.bag.reader import choose_topics, open_bag


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(
    cut=st.integers(0, 12000), shape=st.sampled_from(['zstd', 'lz4', 'uncompressed', 'no chunks'])
)
def test_cut_file_is_salvaged(tmp_path: Path, cut: int, shape: str) -> None:
    """Cut anywhere, what lies before is read and is a start of the recording, and it is said so."""
    messages = run(40)
    path = write_mcap(tmp_path / 'run.mcap', messages, **SHAPES[shape])
    data = path.read_bytes()
    cut = min(cut, len(data) - 1)
    path.write_bytes(data[:cut])
    try:
        bag = open_bag(path)
    except BadBag:
        assert cut < len(MAGIC)
        return
    found = rows(bag.batches(BOTH))
    assert found == expected(messages)[: len(found)]
    assert bag.salvaged is not None or len(found) == len(messages)
    assert sum(topic.count for topic in bag.topics.values()) == len(found)


def test_cut_at_six_tenths_keeps_whole_chunks(tmp_path: Path) -> None:
    """A file cut at 60 % gives nearly 60 % of its messages and the place where it breaks."""
    path = write_mcap(tmp_path / 'run.mcap', run(400), compression=CompressionType.NONE)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) * 6 // 10])
    bag, batches, _ = read(path)
    assert 400 < len(rows(batches)) < 500
    assert bag.salvaged is not None
    assert f'of {len(data) * 6 // 10}' in bag.salvaged


def test_chunk_with_wrong_checksum_is_not_used(tmp_path: Path) -> None:
    """A flipped bit in a chunk loses that chunk alone; the finding names it and what is lost."""
    messages = run(100)
    path = write_mcap(tmp_path / 'run.mcap', messages, compression=CompressionType.NONE)
    start = chunk_starts(path.read_bytes())[1]
    damaged(path, start + 3000, b'\x55\xaa')
    bag, batches, facts = read(path)
    found = rows(batches)
    assert bag.findings == ()
    assert set(found) < set(expected(messages))
    assert f'chunk at byte {start} not used: its checksum' in facts.findings[0]
    lost = len(messages) - len(found)
    assert lost > 0
    in_joints = 100 - facts.counts['/joint_states']
    assert f'{in_joints} of /joint_states' in facts.findings[0]
    assert f'{lost - in_joints} of /imu/data' in facts.findings[0]
    assert any('the index counts 100 messages' in text for text in facts.findings)


def test_unprotected_damage_is_seen_where_it_breaks_records(tmp_path: Path) -> None:
    """Zeros over part of an unprotected chunk lose the messages under them, which are counted."""
    messages = run(100)
    options = {'compression': CompressionType.NONE, 'enable_crcs': False}
    path = write_mcap(tmp_path / 'run.mcap', messages, **options)
    start = chunk_starts(path.read_bytes())[1]
    damaged(path, start + 2000, bytes(1500))
    bag, batches, facts = read(path)
    assert bag.protected == 'none'
    found = rows(batches)
    # A message whose head is whole may still hold zeros: without a checksum nobody can tell.
    assert len(messages) - 8 < len(found) < len(messages)
    assert any('messages lost' in text for text in facts.findings)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(
    place=st.integers(8, 11000),
    content=st.binary(min_size=1, max_size=12),
    shape=st.sampled_from(['zstd', 'lz4', 'uncompressed', 'no chunks', 'no checksums']),
)
def test_no_damage_crashes_or_hangs(tmp_path: Path, place: int, content: bytes, shape: str) -> None:
    """Bytes overwritten anywhere give fewer messages, findings or BadBag, nothing else."""
    path = write_mcap(tmp_path / 'run.mcap', run(40), **SHAPES[shape])
    damaged(path, place % path.stat().st_size, content)
    try:
        bag = open_bag(path)
        reading = bag.batches(choose_topics(bag, imu_required=False))
    except BadBag:
        return
    assert len(rows(reading)) <= 80
    assert reading.facts.complete
    assert sum(1 for _ in messages_of(bag, bag.topics)) <= 80


def test_wrong_message_index_is_not_believed(tmp_path: Path) -> None:
    """A message index that points elsewhere is found out and the records are walked."""
    messages = run(30)
    path = write_mcap(tmp_path / 'run.mcap', messages, chunk_size=1 << 20)
    data = path.read_bytes()
    index = chunk_starts(data)[0]
    index += 9 + struct.unpack_from('<Q', data, index + 1)[0]
    damaged(path, index + 15 + 8 + 16 * 4, (77).to_bytes(8, 'little'))
    _, batches, facts = read(path)
    assert rows(batches) == expected(messages)
    assert any('message index' in text for text in facts.findings)


def test_chunk_that_claims_too_much_is_refused(tmp_path: Path) -> None:
    """A chunk above the limit is left out with a finding; a higher limit lets it in."""
    path = write_mcap(tmp_path / 'run.mcap', run(200), chunk_size=1 << 20)
    bag = open_bag(path, max_chunk_bytes=1 << 14)
    assert 'MiB' in bag.findings[0]
    assert rows(bag.batches(BOTH)) == []
    assert len(rows(open_bag(path).batches(BOTH))) == 400


def test_chunk_that_claims_a_tebibyte_is_refused(tmp_path: Path) -> None:
    """A head that claims 2^40 bytes allocates nothing."""
    path = write_mcap(tmp_path / 'run.mcap', run(20), chunk_size=1 << 20)
    start = chunk_starts(path.read_bytes())[0]
    damaged(path, start + 25, (1 << 40).to_bytes(8, 'little'))
    bag, batches, _ = read(path)
    assert rows(batches) == []
    assert '1048576 MiB' in bag.findings[0]


def test_malformed_messages_are_counted(tmp_path: Path) -> None:
    """Messages that are not what their type says are left out, counted, with the first reason."""
    messages = run(10)
    messages[4] = ('/joint_states', JOINT_STATE, messages[4][2], b'\x00\x01\x00\x00garbage')
    path = write_mcap(tmp_path / 'run.mcap', messages)
    _, batches, facts = read(path)
    assert len(rows(batches)) == 19
    count, reason = facts.malformed['/joint_states']
    assert count == 1
    assert 'header' in reason
    assert any('1 of 10 messages are malformed' in text for text in facts.findings)


@pytest.mark.parametrize(
    'content', [b'', b'hello, this is no bag', b'#ROSBAG V2.0\n', b'SQLite format 3\0' + bytes(99)]
)
def test_what_is_no_bag_is_refused(tmp_path: Path, content: bytes) -> None:
    """A file of another kind, or only the start of one, is refused with its name."""
    path = tmp_path / 'thing.mcap'
    path.write_bytes(content)
    with pytest.raises(BadBag, match=r'thing\.mcap'):
        open_bag(path)


def test_missing_path_is_refused(tmp_path: Path) -> None:
    """A path that does not exist is named."""
    with pytest.raises(BadBag, match='no such file'):
        open_bag(tmp_path / 'nothing')


def test_folder_without_a_bag_is_refused(tmp_path: Path) -> None:
    """A folder without any recording says what was expected."""
    with pytest.raises(BadBag, match='expected a rosbag2 folder'):
        open_bag(tmp_path)


@pytest.mark.parametrize('broken', [False, True])
def test_checksum_of_the_data_section(tmp_path: Path, broken: bool) -> None:  # noqa: FBT001
    """A file without chunks is protected by the checksum of its data section, if it is right."""
    path = write_mcap(tmp_path / 'run.mcap', run(20), use_chunking=False, enable_data_crcs=True)
    if broken:
        data = path.read_bytes()
        damaged(path, data.index(b'imu\0') + 40, b'\x99')
    bag = open_bag(path)
    assert bag.protected == ('none' if broken else 'all')
    assert [('checksum' in text) for text in bag.findings] == ([True] if broken else [])


def test_topics_not_wanted_are_not_unpacked(tmp_path: Path) -> None:
    """A broken chunk that holds only other topics is never looked into."""
    other: list[Message] = [('/other', JOINT_STATE, i, cdr(joint_state())) for i in range(40)]
    messages = run(20)
    path = write_mcap(tmp_path / 'run.mcap', other + messages, chunk_size=6000)
    damaged(path, chunk_starts(path.read_bytes())[0] + 100, b'\xff' * 20)
    bag = open_bag(path)
    reading = bag.batches(BOTH)
    assert rows(reading) == expected(messages)
    assert reading.facts.findings == ()


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(
    place=st.integers(0, 30000),
    content=st.binary(min_size=1, max_size=12),
    storage=st.sampled_from(['cut db3', 'db3', 'cut bag', 'bag']),
)
def test_no_damage_of_other_formats_crashes(
    tmp_path: Path, place: int, content: bytes, storage: str
) -> None:
    """SQLite and ROS 1 bags damaged anywhere give fewer messages, findings or BadBag."""
    suffix = storage.rsplit(maxsplit=1)[-1]
    path = tmp_path / f'whole.{suffix}'
    if not path.exists():
        write_other(path, run(20))
    data = bytearray(path.read_bytes())
    place %= len(data)
    data[place : place + len(content)] = content
    broken = tmp_path / f'broken.{suffix}'
    broken.write_bytes(data[:place] if storage.startswith('cut') else data)
    try:
        bag = open_bag(broken)
        reading = bag.batches(choose_topics(bag, imu_required=False))
    except BadBag as error:
        assert broken.name in str(error)  # noqa: PT017 (one of the two ways that are right)
        return
    assert len(rows(reading)) <= 40
    assert reading.facts.complete
    with suppress(BadBag):
        assert sum(1 for _ in messages_of(bag, bag.topics)) <= 40


def test_sqlite_message_that_is_a_number(tmp_path: Path) -> None:
    """A number where a message should be ends the reading with a finding and takes no memory."""
    path = tmp_path / 'run.db3'
    write_other(path, run(20))
    with closing(sqlite3.connect(path)) as db:
        db.execute('UPDATE messages SET data = 1000000000000 WHERE id = 30')
        db.commit()
    bag = open_bag(path)
    reading = bag.batches(BOTH)
    assert rows(reading) == expected(run(20))[:29]
    assert 'expected a blob' in reading.facts.findings[0]
    with pytest.raises(BadBag, match=r'run\.db3: reading ended early .*expected a blob'):
        list(messages_of(bag, bag.topics))
