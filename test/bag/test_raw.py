"""Messages of a recording as they were serialised, against rosbags and against what was written."""

from collections import Counter
from pathlib import Path

import pytest
import zstandard
from bag.bag_cases import JOINT_STATE, STORE, cdr, joint_state, run, write_mcap
from bag.recordings import write_with
from mcap.writer import Writer
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from ugv_acceptance.bag.cdr import imu_decoder
from ugv_acceptance.bag.raw import Offered, messages, offered
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.bag.writer import BagWriter, Qos

BAGS = (
    'abitobot',
    'rosbag2_recorded/default',
    'rosbag2_recorded/split',
    'rosbag2_recorded/zstd_small',
    'rosbag2/rosbag2_tests/resources/sqlite3/cdr_test',
)


def of_rosbags(path: Path) -> Counter[tuple[int, str, bytes]]:
    """Return all messages as rosbags reads them."""
    store = get_typestore(Stores.ROS2_JAZZY)
    with AnyReader([path], default_typestore=store) as reader:
        return Counter((time, c.topic, bytes(data)) for c, time, data in reader.messages())


@pytest.mark.parametrize('name', BAGS)
def test_all_messages_are_those_rosbags_reads(shared_bags: Path, name: str) -> None:
    """Every message of every topic, with its log time, in order of log time."""
    path = shared_bags / name
    bag = open_bag(path)
    ours = list(messages(bag, bag.topics))
    assert [m.log_time for m in ours] == sorted(m.log_time for m in ours)
    assert Counter(m[:3] for m in ours) == of_rosbags(path)


def test_ros_1_messages_become_cdr(shared_bags: Path) -> None:
    """A ROS 1 Imu turned into CDR holds the numbers that rosbags reads from the original."""
    path = shared_bags / 'robot_localization' / 'robot_localization_test2.bag'
    bag, decoder = open_bag(path), imu_decoder()
    topic = next(name for name, topic in bag.topics.items() if topic.type.endswith('/Imu'))
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS1_NOETIC)) as reader:
        theirs = [
            (time, vars(vars(reader.deserialize(data, c.msgtype))['linear_acceleration']))
            for c, time, data in reader.messages()
            if c.topic == topic
        ]
    ours = [(m.log_time, decoder.one(m.data)) for m in messages(bag, [topic])]
    assert len(ours) == len(theirs) > 3000
    for (our_time, sample), (time, force) in zip(ours, theirs, strict=True):
        assert our_time == time
        assert sample.linear_acceleration == (force['x'], force['y'], force['z'])


def test_a_recording_comes_back_in_order(tmp_path: Path) -> None:
    """What is written, chunk by chunk, is what is read."""
    written = run(300)
    path = write_mcap(tmp_path / 'run.mcap', written)
    topics = {topic for topic, *_ in written}
    expected = sorted((time, topic, data) for topic, _, time, data in written)
    found = list(messages(open_bag(path), topics))
    assert sorted(message[:3] for message in found) == expected
    assert all(message.published == message.log_time for message in found)


def test_only_the_topics_asked_for_are_read(tmp_path: Path) -> None:
    """Raw reading leaves out topics that were not asked for."""
    written = run(50)
    path = write_mcap(tmp_path / 'run.mcap', written)
    one = written[0][0]
    assert {message.topic for message in messages(open_bag(path), [one])} == {one}


@pytest.mark.parametrize('storage', [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_message_compression_is_undone(tmp_path: Path, storage: StoragePlugin) -> None:
    """Messages compressed one by one come as they were published; a broken one is left out."""
    written = run(20)
    writer = Ros2Writer(tmp_path / 'run', version=9, storage_plugin=storage)
    writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    path = write_with(writer, tmp_path / 'run', written)
    found = list(messages(open_bag(path), {topic for topic, *_ in written}))
    assert [m[:3] for m in found] == [(time, topic, data) for topic, _, time, data in written]


def test_a_broken_compressed_message_is_left_out(tmp_path: Path) -> None:
    """One message that cannot be unpacked loses no other."""
    written = run(5)
    topic, kind, time, data = written[4]
    written[4] = topic, kind, time, zstandard.ZstdCompressor().compress(data)[:-3]
    path = write_mcap(tmp_path / 'run.mcap', written)
    found = [m.log_time for m in messages(open_bag(path), [topic, '/imu/data'])]
    assert found == [t for _, _, t, _ in written if t != time]


def test_what_only_looks_compressed_is_left_alone(tmp_path: Path) -> None:
    """Content that is no CDR is passed on unchanged, even if it begins as compressed data."""
    path, content = tmp_path / 'run.mcap', zstandard.FRAME_HEADER + b'x'
    with path.open('wb') as file:
        writer = Writer(file)
        writer.start('ros2')
        writer.add_message(writer.register_channel('/a', 'json', 0), 1, content, 1)
        writer.finish()  # type: ignore[no-untyped-call]
    assert [m.data for m in messages(open_bag(path), ['/a'])] == [content]


def test_a_garbled_ros_1_message_is_left_out(tmp_path: Path) -> None:
    """One message that is not what its type says loses no other."""
    store, path = get_typestore(Stores.ROS1_NOETIC), tmp_path / 'run.bag'
    with Ros1Writer(path) as writer:
        joints = writer.add_connection('/joint_states', JOINT_STATE, typestore=store)
        for time in (1, 2, 3):
            data = bytes(STORE.cdr_to_ros1(cdr(joint_state()), JOINT_STATE))
            writer.write(joints, time, data[:9] if time == 2 else data)
    found = list(messages(open_bag(path), ['/joint_states']))
    assert [(m.log_time, m.data) for m in found] == [(t, cdr(joint_state())) for t in (1, 3)]


def test_the_quality_of_service_is_that_of_the_recorder(tmp_path: Path) -> None:
    """Reliability and durability come from metadata.yaml."""
    path = tmp_path / 'run'
    with BagWriter(path) as writer:
        writer.add_topic('/a', 'sensor_msgs/msg/Imu', Qos('best_effort', 'transient_local'))
        writer.add_topic('/b', 'sensor_msgs/msg/Imu', Qos())
    found = offered(open_bag(path))
    assert found == {'/a': Offered('best_effort', 'transient_local'), '/b': Offered()}


def test_metadata_of_any_kind_is_survived(tmp_path: Path) -> None:
    """Where metadata.yaml says nothing useful, the file's own word holds."""
    path = tmp_path / 'run'
    with BagWriter(path) as writer:
        writer.add_topic('/a', 'sensor_msgs/msg/Imu', Qos('best_effort'))
    bag = open_bag(path)
    for text in ('', '[]', 'rosbag2_bagfile_information: 3', '{', 'a: &a [*a]', '[' * 800):
        (path / 'metadata.yaml').write_text(text)
        assert offered(bag) == {'/a': Offered('best_effort')}


def test_a_file_alone_tells_the_quality_of_service(tmp_path: Path) -> None:
    """Taken out of its folder, an MCAP file still says what its publishers offered."""
    with BagWriter(tmp_path / 'run') as writer:
        writer.add_topic('/a', 'sensor_msgs/msg/Imu', Qos('best_effort', 'transient_local'))
    alone = (tmp_path / 'run' / 'run_0.mcap').rename(tmp_path / 'alone.mcap')
    assert offered(open_bag(alone)) == {'/a': Offered('best_effort', 'transient_local')}
