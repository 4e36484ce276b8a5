"""Recordings of every shape: what was written is what is read, in order, and nothing is hidden."""

import hashlib
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard
from bag.bag_cases import (
    IMU,
    INERTIA,
    JOINT_STATE,
    STORE,
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
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, IndexType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from ugv_acceptance import BadBag
from ugv_acceptance.bag.mcap_index import MAGIC
from ugv_acceptance.bag.reader import Bag, Topics, choose_topics, open_bag
from ugv_acceptance.bag.reading import Facts
from ugv_acceptance.evaluation.samples import Batch

BOTH = Topics('/joint_states', '/imu/data', None)


def read(path: Path | list[Path], **options: Any) -> tuple[Bag, list[Batch], Facts]:
    """Bag, batches and facts of a recording's joint states and IMU."""
    bag = open_bag(path, **options)
    reading = bag.batches(choose_topics(bag))
    batches = list(reading)
    return bag, batches, reading.facts


SHAPES: dict[str, dict[str, Any]] = {
    'zstd': {},
    'lz4': {'compression': CompressionType.LZ4},
    'uncompressed': {'compression': CompressionType.NONE},
    'no chunks': {'use_chunking': False},
    'no message indexes': {'index_types': IndexType.CHUNK},
    'no chunk indexes': {'index_types': IndexType.MESSAGE},
    'no statistics': {'use_statistics': False},
    'schemas not repeated': {'repeat_schemas': False},
    'channels not repeated': {'repeat_channels': False},
    'no checksums': {'enable_crcs': False},
    'one chunk': {'chunk_size': 1 << 24},
    'a message a chunk': {'chunk_size': 1},
}


@pytest.mark.parametrize('shape', SHAPES)
@pytest.mark.parametrize('workers', [1, 2])
def test_every_shape_of_mcap(tmp_path: Path, shape: str, workers: int) -> None:
    """However the file is built, the messages are those that rosbags decodes, in order."""
    messages = run(60)
    path = write_mcap(tmp_path / 'run.mcap', messages, **SHAPES[shape])
    bag = open_bag(path)
    reading = bag.batches(choose_topics(bag), workers=workers)
    assert rows(reading) == expected(messages)
    assert reading.facts.counts == {'/joint_states': 60, '/imu/data': 60}
    assert bag.findings == reading.facts.findings == ()
    assert reading.facts.complete


def test_facts_of_a_bag(tmp_path: Path) -> None:
    """Span, counts, types and hash are those of the file."""
    path = write_mcap(tmp_path / 'run.mcap', run(50))
    bag = open_bag(path)
    assert (bag.start_ns, bag.end_ns) == (10**9, 10**9 + 49 * 10**7 + 10**6)
    assert bag.duration_s == pytest.approx(0.491)
    assert {n: (t.type, t.count) for n, t in bag.topics.items()} == {
        '/joint_states': (JOINT_STATE, 50),
        '/imu/data': (IMU, 50),
    }
    assert bag.sha256() == hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize('protected', ['all', 'none'])
def test_protected_says_whether_chunks_carry_checksums(tmp_path: Path, protected: str) -> None:
    """Chunks with checksums are protected, those without are not."""
    path = write_mcap(tmp_path / 'run.mcap', run(30), enable_crcs=protected == 'all')
    assert open_bag(path).protected == protected


def test_parts_are_one_recording(tmp_path: Path) -> None:
    """Several files, given in any order, are read in log time order; some without checksums."""
    messages = run(90)
    first = write_mcap(tmp_path / 'a.mcap', messages[:70])
    second = write_mcap(tmp_path / 'b.mcap', messages[70:], enable_crcs=False)
    bag, batches, _ = read([second, first])
    assert rows(batches) == expected(messages)
    assert bag.protected == 'part'
    digests = [hashlib.sha256(p.read_bytes()).digest() for p in (second, first)]
    assert bag.sha256() == hashlib.sha256(b''.join(digests)).hexdigest()


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=30)
@given(order=st.permutations(range(40)), chunk=st.sampled_from([1, 1000, 5000, 10**6]))
def test_batches_follow_each_other(tmp_path: Path, order: list[int], chunk: int) -> None:
    """However log times jump in the file, no batch begins before the one before it ends."""
    messages: list[Message] = [
        ('/joint_states', JOINT_STATE, 10**6 * i, cdr(joint_state((i, 0)))) for i in order
    ]
    path = write_mcap(tmp_path / 'run.mcap', messages, chunk_size=chunk)
    bag = open_bag(path)
    reading = bag.batches(Topics('/joint_states', None, None))
    last = -1
    seen: list[int] = []
    for batch in reading:
        times = np.concatenate([c.log_time for c in batch.joints])
        assert times.min() >= last
        last = int(times.max())
        seen += times.tolist()
    assert sorted(seen) == sorted(m[2] for m in messages)
    assert reading.facts.late == 0


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
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


def chunk_starts(data: bytes) -> list[int]:
    """Where the Chunk records of an MCAP begin."""
    starts, pos = [], 8
    while pos < len(data) - 8:
        if data[pos] == 6:
            starts.append(pos)
        pos += 9 + struct.unpack_from('<Q', data, pos + 1)[0]
    return starts


def damaged(path: Path, place: int, content: bytes) -> Path:
    """The file with bytes overwritten at a place."""
    data = bytearray(path.read_bytes())
    data[place : place + len(content)] = content
    path.write_bytes(data)
    return path


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


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
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


def write_folder(path: Path, messages: list[Message], storage: StoragePlugin) -> Path:
    """A rosbag2 folder written by rosbags."""
    return write_with(Ros2Writer(path, version=9, storage_plugin=storage), path, messages)


def write_with(writer: Ros2Writer, path: Path, messages: list[Message]) -> Path:
    """The folder after rosbags' writer wrote these messages into it."""
    with writer:
        held: dict[str, Any] = {}
        for topic, kind, time, data in messages:
            if topic not in held:
                held[topic] = writer.add_connection(topic, kind, typestore=STORE)
            writer.write(held[topic], time, data)
    return path


@pytest.mark.parametrize('storage', [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
@pytest.mark.parametrize('metadata', [True, False])
def test_rosbag2_folders(tmp_path: Path, storage: StoragePlugin, metadata: bool) -> None:  # noqa: FBT001
    """A folder of either storage format is read, with or without its metadata.yaml."""
    messages = run(40)
    folder = write_folder(tmp_path / 'bag', messages, storage)
    if not metadata:
        (folder / 'metadata.yaml').unlink()
    bag, batches, facts = read(folder)
    assert rows(batches) == expected(messages)
    assert facts.findings == ()
    assert bag.findings == (() if metadata else ('bag: no metadata.yaml',))
    assert bag.duration_s == pytest.approx(0.391)


def test_many_sqlite_messages_come_in_batches(tmp_path: Path) -> None:
    """An SQLite bag is handed out in blocks, not as one."""
    messages = run(3000, rate=400)
    _, batches, _ = read(write_folder(tmp_path / 'bag', messages, StoragePlugin.SQLITE3))
    assert len(batches) > 1
    assert rows(batches) == expected(messages)


def test_counts_in_metadata_are_compared(tmp_path: Path) -> None:
    """A metadata.yaml that counts otherwise than the file is a finding."""
    folder = write_folder(tmp_path / 'bag', run(10), StoragePlugin.MCAP)
    text = (folder / 'metadata.yaml').read_text()
    (folder / 'metadata.yaml').write_text(text.replace('message_count: 10', 'message_count: 12', 1))
    bag = open_bag(folder)
    assert any('metadata.yaml says' in text for text in bag.findings)


@pytest.mark.parametrize('text', ['', ':', '[1, 2', 'rosbag2_bagfile_information: 3', '\x00'])
def test_broken_metadata_is_a_finding(tmp_path: Path, text: str) -> None:
    """Without usable metadata the files themselves are read."""
    messages = run(10)
    folder = write_folder(tmp_path / 'bag', messages, StoragePlugin.MCAP)
    (folder / 'metadata.yaml').write_text(text)
    bag, batches, _ = read(folder)
    assert rows(batches) == expected(messages)
    assert 'not the metadata' in bag.findings[0]


def test_missing_part_is_a_finding(tmp_path: Path) -> None:
    """A file that metadata.yaml lists and that is not there is named."""
    folder = write_folder(tmp_path / 'bag', run(10), StoragePlugin.MCAP)
    text = (folder / 'metadata.yaml').read_text()
    (folder / 'metadata.yaml').write_text(
        text.replace('- bag.mcap', '- bag.mcap\n  - gone.mcap', 1)
    )
    assert any("'gone.mcap' is missing" in text for text in open_bag(folder).findings)


@pytest.mark.parametrize('storage', [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_file_compression(tmp_path: Path, storage: StoragePlugin) -> None:
    """A file that was compressed as a whole is read like the file itself."""
    messages = run(30)
    folder = write_folder(tmp_path / 'bag', messages, storage)
    path = next(p for p in folder.iterdir() if p.suffix in {'.mcap', '.db3'})
    packed = path.with_name(path.name + '.zstd')
    packed.write_bytes(zstandard.ZstdCompressor().compress(path.read_bytes()))
    _, batches, _ = read(packed)
    assert rows(batches) == expected(messages)


@pytest.mark.parametrize('compressed', [False, True])
def test_ros1_bags(tmp_path: Path, compressed: bool) -> None:  # noqa: FBT001
    """A ROS 1 bag gives the same numbers as the ROS 2 messages it was made from."""
    messages = run(40)
    store = get_typestore(Stores.ROS1_NOETIC)
    writer = Ros1Writer(tmp_path / 'run.bag')
    if compressed:
        writer.set_compression(Ros1Writer.CompressionFormat.BZ2)
    with writer:
        held: dict[str, Any] = {}
        for topic, kind, time, data in messages:
            if topic not in held:
                held[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(held[topic], time, bytes(STORE.cdr_to_ros1(data, kind)))
    bag, batches, facts = read(tmp_path / 'run.bag')
    assert rows(batches) == expected(messages)
    assert facts.findings == ()
    assert bag.end_ns == messages[-1][2]


@pytest.mark.parametrize(
    'content', [b'', b'hello, this is no bag', b'#ROSBAG V2.0\n', b'SQLite format 3\0' + bytes(99)]
)
def test_what_is_no_bag_is_refused(tmp_path: Path, content: bytes) -> None:
    """A file of another kind, or only the start of one, is refused with its name."""
    path = tmp_path / 'thing.mcap'
    path.write_bytes(content)
    with pytest.raises(BadBag, match=r'thing\.mcap'):
        open_bag(path)


@pytest.mark.parametrize('storage', [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_message_compression(tmp_path: Path, storage: StoragePlugin) -> None:
    """A folder whose messages were compressed one by one is read, of either storage format."""
    messages = run(20)
    folder = tmp_path / 'bag'
    writer = Ros2Writer(folder, version=9, storage_plugin=storage)
    writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    _, batches, facts = read(write_with(writer, folder, messages))
    assert rows(batches) == expected(messages)
    assert facts.findings == ()


def test_mcap_of_ros1_messages(tmp_path: Path) -> None:
    """An MCAP converted from ROS 1, with its packing and type names, gives the same numbers."""
    messages = run(20)
    path = tmp_path / 'run.mcap'
    with path.open('wb') as file:
        writer = McapWriter(file)
        writer.start('ros1', 'test')
        channels = {}
        for topic, kind, _, _ in messages[:2]:
            schema = writer.register_schema(kind.replace('/msg/', '/'), 'ros1msg', b'')
            channels[topic] = writer.register_channel(topic, 'ros1', schema)
        for topic, kind, time, data in messages:
            writer.add_message(channels[topic], time, bytes(STORE.cdr_to_ros1(data, kind)), time)
        writer.finish()  # type: ignore[no-untyped-call]
    _, batches, _ = read(path)
    assert rows(batches) == expected(messages)


def test_other_channels_do_not_matter(tmp_path: Path) -> None:
    """Channels without schema, of garbage schemas, of other encodings leave the rest readable."""
    messages = run(20)
    path = tmp_path / 'run.mcap'
    with path.open('wb') as file:
        writer = McapWriter(file, chunk_size=4096)
        writer.start('ros2', 'test')
        odd = writer.register_schema('what?!', 'nothing', b'\xff\x00')
        others = [
            writer.register_channel('/none', 'json', 0),
            writer.register_channel('/odd', 'cdr', odd),
            writer.register_channel('/joint_states/service', 'protobuf', odd),
        ]
        held = {kind: writer.register_schema(kind, 'ros2msg', b'') for kind in (JOINT_STATE, IMU)}
        channels = {t: writer.register_channel(t, 'cdr', held[k]) for t, k, _, _ in messages[:2]}
        for topic, _, time, data in messages:
            writer.add_message(channels[topic], time, data, time)
            writer.add_message(others[time % 3], time, b'\x05' * 40, time)
        writer.finish()  # type: ignore[no-untyped-call]
    bag, batches, facts = read(path)
    assert rows(batches) == expected(messages)
    assert bag.findings == facts.findings == ()
    assert bag.topics['/none'].type == ''


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


def test_missing_path_is_refused(tmp_path: Path) -> None:
    """A path that does not exist is named."""
    with pytest.raises(BadBag, match='no such file'):
        open_bag(tmp_path / 'nothing')


def test_folder_without_a_bag_is_refused(tmp_path: Path) -> None:
    """A folder without any recording says what was expected."""
    with pytest.raises(BadBag, match='expected a rosbag2 folder'):
        open_bag(tmp_path)


def topics_of(tmp_path: Path, held: dict[str, str]) -> Bag:
    """A bag with one message on each of these topics of these types."""
    content = {
        JOINT_STATE: cdr(joint_state()),
        IMU: cdr(imu()),
        INERTIA: cdr(inertia()),
        'std_msgs/msg/Empty': b'\x00\x01\x00\x00\x00',
    }
    messages = [(topic, kind, 5, content[kind]) for topic, kind in held.items()]
    return open_bag(write_mcap(tmp_path / 'run.mcap', messages))


def test_configured_topics_are_chosen(tmp_path: Path) -> None:
    """A configured name, with or without its slash, wins over others of the same type."""
    held = {'/joint_states': JOINT_STATE, '/wheels': JOINT_STATE, '/imu/data': IMU, '/b': IMU}
    chosen = choose_topics(topics_of(tmp_path, held), '/joint_states', 'imu/data')
    assert chosen == Topics('/joint_states', '/imu/data', None)


def test_topics_are_found_by_type(tmp_path: Path) -> None:
    """Where the configured names are absent, the one topic of each type is taken."""
    held = {'/r/joints': JOINT_STATE, '/r/imu': IMU, '/r/load': INERTIA, '/x': 'std_msgs/msg/Empty'}
    assert choose_topics(topics_of(tmp_path, held)) == Topics('/r/joints', '/r/imu', '/r/load')


def test_two_candidates_are_an_error_that_lists_the_bag(tmp_path: Path) -> None:
    """Two topics of the type are not guessed between; the error lists topics, types and counts."""
    bag = topics_of(tmp_path, {'/a': JOINT_STATE, '/b': JOINT_STATE, '/i': IMU})
    with pytest.raises(BadBag, match=rf'/a {JOINT_STATE} 1; /b {JOINT_STATE} 1; /i {IMU} 1'):
        choose_topics(bag)


def test_no_imu_only_where_allowed(tmp_path: Path) -> None:
    """A bag without IMU is an error unless the caller can do without."""
    bag = topics_of(tmp_path, {'/joint_states': JOINT_STATE})
    assert choose_topics(bag, imu_required=False).imu is None
    with pytest.raises(BadBag, match='imu/data'):
        choose_topics(bag)


def test_configured_topic_of_another_type_is_not_taken(tmp_path: Path) -> None:
    """A topic of the configured name but another type does not count."""
    bag = topics_of(tmp_path, {'/joint_states': 'std_msgs/msg/Empty', '/imu/data': IMU})
    with pytest.raises(BadBag, match='joint_states'):
        choose_topics(bag)


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


def test_closing_early_ends_the_threads(tmp_path: Path) -> None:
    """A reader that stops half way can give back its threads and files."""
    reading = open_bag(write_mcap(tmp_path / 'run.mcap', run(400))).batches(BOTH, workers=2)
    next(reading)
    reading.close()
    assert list(reading) == []
    assert not reading.facts.complete
