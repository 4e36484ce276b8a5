"""Recordings of every storage format and compression give the same messages."""

from pathlib import Path
from typing import Any

import pytest
import zstandard
from bag.bag_cases import (
    IMU,
    JOINT_STATE,
    STORE,
    cdr,
    expected,
    imu,
    joint_state,
    rows,
    run,
    write_mcap,
)
from bag.recordings import read, write_folder, write_other, write_with
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from ugv_acceptance import BadBag
from ugv_acceptance.bag.reader import open_bag


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
def test_a_renamed_recording_is_said_to_be_read(tmp_path: Path, storage: StoragePlugin) -> None:
    """Where metadata.yaml lists another name, one finding tells what was read in its place."""
    messages = run(10)
    folder = write_folder(tmp_path / 'bag', messages, storage)
    old = next(p for p in folder.iterdir() if p.suffix in {'.mcap', '.db3'})
    old.rename(new := old.with_name(f'renamed{old.suffix}'))
    bag, batches, _ = read(folder)
    assert rows(batches) == expected(messages)
    (finding,) = bag.findings
    assert finding.endswith(
        f'lists {old.name!r}, which does not exist; {new.name} was read instead'
    )


@pytest.mark.parametrize('parts', [1, 2])
@pytest.mark.parametrize('listed', ['packed', 'unpacked'])
def test_a_part_packed_or_unpacked_later_is_read(tmp_path: Path, parts: int, listed: str) -> None:
    """A file that is there with or without .zstd is the one that metadata.yaml lists."""
    messages = run(20)
    folder = write_folder(tmp_path / 'bag', messages[::parts], StoragePlugin.MCAP)
    if parts == 2:
        write_mcap(folder / 'more.mcap', messages[1::2])
    plain, path = folder / 'bag.mcap', folder / 'metadata.yaml'
    name = 'bag.mcap'
    if listed == 'packed':
        name = 'bag.mcap.zstd'
    else:
        packed = plain.with_name('bag.mcap.zstd')
        packed.write_bytes(zstandard.ZstdCompressor().compress(plain.read_bytes()))
        plain.unlink()
    lines = [f'\n  - {name}', *['\n  - more.mcap'] * (parts - 1)]
    path.write_text(path.read_text().replace('\n  - bag.mcap', ''.join(lines), 1))
    bag, batches, _ = read(folder)
    assert rows(batches) == expected(messages)
    assert not any('missing' in text or 'not read' in text for text in bag.findings)
    assert any(f'file {name!r} does not exist' in text for text in bag.findings)


def test_a_part_that_is_not_read_is_still_said_so(tmp_path: Path) -> None:
    """Of two parts one is renamed: that one is missing, and what lies there is not read."""
    messages = run(20)
    folder = write_folder(tmp_path / 'bag', messages, StoragePlugin.MCAP)
    write_mcap(folder / 'renamed.mcap', run(3))
    path = folder / 'metadata.yaml'
    path.write_text(path.read_text().replace('- bag.mcap', '- bag.mcap\n  - part.mcap', 1))
    bag, batches, _ = read(folder)
    assert rows(batches) == expected(messages)
    assert "metadata.yaml: file 'part.mcap' is missing" in bag.findings
    assert 'metadata.yaml does not list renamed.mcap: it was not read' in bag.findings


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


def test_files_that_metadata_does_not_list_are_told(tmp_path: Path) -> None:
    """A second file in the folder, which metadata.yaml does not name, is no part of it."""
    messages = run(20)
    folder = write_folder(tmp_path / 'bag', messages, StoragePlugin.MCAP)
    write_mcap(folder / 'other.mcap', run(3))
    bag, batches, _ = read(folder)
    assert rows(batches) == expected(messages)
    assert bag.findings == ('metadata.yaml does not list other.mcap: it was not read',)


def test_the_total_of_metadata_is_compared(tmp_path: Path) -> None:
    """A total that is not what the file holds is a finding, although its topics are right."""
    folder = write_folder(tmp_path / 'bag', run(20), StoragePlugin.MCAP)
    path = folder / 'metadata.yaml'
    path.write_text(path.read_text().replace('message_count: 40', 'message_count: 41'))
    bag, _, _ = read(folder)
    assert bag.findings == ('metadata.yaml says 41 messages, found 40',)


def test_files_of_several_formats_are_no_recording(tmp_path: Path) -> None:
    """Files of different formats are refused as parts of one recording."""
    write_other(tmp_path / 'a.db3', run(2))
    parts = [tmp_path / 'a.db3', write_mcap(tmp_path / 'b.mcap', run(2))]
    with pytest.raises(BadBag, match='expected files of one format, got mcap and sqlite3'):
        open_bag(parts)


def test_no_file_at_all_is_no_recording() -> None:
    """An empty list of files is refused as a recording."""
    with pytest.raises(BadBag, match='expected at least one bag, got none'):
        open_bag([])


@pytest.mark.parametrize(
    'other',
    ['run.mcap', 'folder/../run.mcap', 'link.mcap', 'folder', 'copy.mcap', 'run.mcap.zstd'],
)
def test_a_file_given_twice_is_refused(tmp_path: Path, other: str) -> None:
    """By whatever name: its rates and numbers of messages would be twice what was recorded."""
    path = write_mcap(tmp_path / 'run.mcap', run(20))
    (tmp_path / 'folder').mkdir()
    (tmp_path / 'link.mcap').symlink_to(path)
    (tmp_path / 'folder' / 'hard.mcap').hardlink_to(path)
    (tmp_path / 'copy.mcap').write_bytes(path.read_bytes())
    packed = zstandard.ZstdCompressor().compress(path.read_bytes())
    (tmp_path / 'run.mcap.zstd').write_bytes(packed)
    with pytest.raises(BadBag, match='each file once'):
        open_bag([path, tmp_path / other])


def test_a_path_the_system_refuses_is_named() -> None:
    """A name longer than any file's is an error like another, not a trace."""
    with pytest.raises(BadBag, match='cannot be read'):
        open_bag('x' * 5000)


def test_a_broken_compressed_file_is_refused(tmp_path: Path) -> None:
    """A compressed file with another content behind its head says what is broken."""
    path = write_mcap(tmp_path / 'run.mcap', run(20))
    packed = zstandard.ZstdCompressor().compress(path.read_bytes())
    path.write_bytes(packed[:4] + b'\xff' * 40 + packed[44:])
    with pytest.raises(BadBag, match=r'run\.mcap: its zstd data is broken'):
        open_bag(path)


def test_a_file_that_unpacks_without_end_is_refused(tmp_path: Path) -> None:
    """A few kilobytes that unpack to more than any recording would do not fill the disk."""
    path = tmp_path / 'run.mcap.zstd'
    packer = zstandard.ZstdCompressor().compressobj()
    path.write_bytes(b''.join([packer.compress(bytes(65 << 20)), packer.flush()]))
    with pytest.raises(BadBag, match='expected at most 64 MiB unpacked, got more'):
        open_bag(path)


def test_a_topic_of_two_types_is_told(tmp_path: Path) -> None:
    """Channels of one name but of several types are a finding that lists them."""
    first = write_mcap(tmp_path / 'a.mcap', [('/a', IMU, 1, cdr(imu()))])
    second = write_mcap(tmp_path / 'b.mcap', [('/a', JOINT_STATE, 2, cdr(joint_state()))])
    (finding,) = open_bag([first, second]).findings
    assert finding.startswith('/a has channels of several types: ')
    assert f'{IMU} (cdr, 1 messages)' in finding
    assert f'{JOINT_STATE} (cdr, 1 messages)' in finding
