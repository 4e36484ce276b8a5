"""What we record is read by rosbags, by mcap and by ourselves, and survives being killed."""

import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, cast

import pytest
import yaml
from bag.bag_cases import IMU, INERTIA, JOINT_STATE, cdr, expected, inertia, rows, run
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader

from ugv_acceptance import BadBag, BadSample
from ugv_acceptance.bag.reader import choose_topics, open_bag
from ugv_acceptance.bag.writer import BagWriter, Qos


def record(folder: Path, messages: Any, **options: Any) -> Path:
    """A folder recorded with BagWriter; the path of its MCAP."""
    with BagWriter(folder, **options) as writer:
        for topic, kind, time_, data in messages:
            writer.add_topic(topic, kind)
            writer.write(topic, time_, data)
    return writer.path


@pytest.mark.parametrize('compression', ['zstd', 'lz4', ''])
def test_recording_is_read_back(tmp_path: Path, compression: str) -> None:
    """Messages come back in order, all chunks carry checksums, nothing is odd."""
    messages = run(200)
    messages.append(('/payload', INERTIA, messages[-1][2] + 1, cdr(inertia())))
    record(tmp_path / 'bag', messages, compression=compression)
    bag = open_bag(tmp_path / 'bag')
    reading = bag.batches(choose_topics(bag))
    assert rows(reading) == expected(messages)
    assert bag.protected == 'all'
    assert bag.findings == reading.facts.findings == ()


def test_rosbags_reads_the_folder(tmp_path: Path) -> None:
    """The folder reader of rosbags, which is strict about metadata and QoS, gives every message."""
    messages = run(50)
    record(tmp_path / 'bag', messages)
    with Reader(tmp_path / 'bag') as reader:
        held = [(c.topic, c.msgtype, time_, bytes(data)) for c, time_, data in reader.messages()]
        assert reader.message_count == 100
        assert (reader.start_time, reader.end_time - 1) == (messages[0][2], messages[-1][2])
    assert held == messages


def test_rosbags_decodes_the_folder(tmp_path: Path) -> None:
    """The definitions in the file are enough to decode it."""
    record(tmp_path / 'bag', run(5))
    with AnyReader([tmp_path / 'bag']) as reader:
        names = [
            cast('Any', reader.deserialize(data, c.msgtype)).name
            for c, _, data in reader.messages()
            if c.msgtype == JOINT_STATE
        ]
    assert names == [['a', 'bcd']] * 5


def test_mcap_reads_the_file(tmp_path: Path) -> None:
    """The mcap package reads the file by its index and finds every checksum right."""
    messages = run(50)
    path = record(tmp_path / 'bag', messages)
    with path.open('rb') as file:
        reader = make_reader(file, validate_crcs=True)
        held = [(c.topic, s.name, m.log_time, m.data) for s, c, m in reader.iter_messages() if s]
        summary = reader.get_summary()
        assert reader.get_header().profile == 'ros2'
    assert held == messages
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == 100


def test_metadata_is_of_version_9(tmp_path: Path) -> None:
    """metadata.yaml says version, counts, span and QoS as Jazzy writes them."""
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/imu/data', IMU, Qos('best_effort'))
        writer.write('/imu/data', 7, b'\x00\x01\x00\x00')
        writer.write('/imu/data', 9, b'\x00\x01\x00\x00')
    text = (tmp_path / 'bag' / 'metadata.yaml').read_text()
    info = yaml.safe_load(text)['rosbag2_bagfile_information']
    (topic,) = info['topics_with_message_count']
    assert info['version'] == 9
    assert info['duration']['nanoseconds'] == 2
    assert info['relative_file_paths'] == ['bag_0.mcap']
    assert topic['message_count'] == 2
    assert topic['topic_metadata']['offered_qos_profiles'][0]['reliability'] == 'best_effort'


def test_metadata_is_written_beside_and_renamed(tmp_path: Path) -> None:
    """What was there under another name stays as it was: no moment has half a metadata.yaml."""
    with BagWriter(tmp_path / 'bag'):
        old = tmp_path / 'bag' / 'metadata.yaml'
        old.write_text('old')
        (tmp_path / 'kept').hardlink_to(old)
    assert (tmp_path / 'kept').read_text() == 'old'
    assert yaml.safe_load(old.read_text())['rosbag2_bagfile_information']['version'] == 9
    assert sorted(p.name for p in old.parent.iterdir()) == ['bag_0.mcap', 'metadata.yaml']


def test_half_a_second_ends_a_chunk(tmp_path: Path) -> None:
    """Messages are handed to the system at least every half second of log time."""
    with BagWriter(tmp_path / 'bag') as writer:
        for topic, kind, time_, data in run(151):
            writer.add_topic(topic, kind)
            writer.write(topic, time_, data)
        salvaged = open_bag(writer.path)
        held = rows(salvaged.batches(choose_topics(salvaged)))
        assert held == expected(run(151))[: len(held)]
        assert held[-1][0] >= run(151)[-1][2] - 500_000_000
        assert salvaged.salvaged is not None


KILLED = """
import sys
from bag.bag_cases import run
from ugv_acceptance.bag.writer import BagWriter
with BagWriter(sys.argv[1]) as writer:
    for topic, kind, time, data in run(400):
        writer.add_topic(topic, kind)
        writer.write(topic, time, data)
    print('written', flush=True)
    sys.stdin.read()
"""


def test_killed_process_loses_half_a_second_at_most(tmp_path: Path) -> None:
    """A recorder killed with SIGKILL leaves all but the last half second, without metadata."""
    path = [str(Path(__file__).parents[1]), str(Path(__file__).parents[2])]
    code = f'import sys; sys.path[:0] = {path!r}\n{KILLED}'
    process = subprocess.Popen(
        [sys.executable, '-c', code, str(tmp_path / 'bag')],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == b'written\n'
    process.send_signal(signal.SIGKILL)
    process.communicate()
    bag = open_bag(tmp_path / 'bag')
    held = rows(bag.batches(choose_topics(bag)))
    messages = run(400)
    assert held == expected(messages)[: len(held)]
    assert held[-1][0] >= messages[-1][2] - 500_000_000


def test_folder_in_use_is_refused(tmp_path: Path) -> None:
    """A folder with content is never recorded into."""
    (tmp_path / 'note.txt').write_text('mine')
    with pytest.raises(BadBag, match='new or empty folder'):
        BagWriter(tmp_path)


def test_unknown_type_is_refused(tmp_path: Path) -> None:
    """A type that Jazzy does not have is named."""
    with BagWriter(tmp_path / 'bag') as writer, pytest.raises(BadBag, match='my_msgs/msg/Foo'):
        writer.add_topic('/foo', 'my_msgs/msg/Foo')


def test_topic_must_be_declared(tmp_path: Path) -> None:
    """A message of a topic nobody declared is refused."""
    with BagWriter(tmp_path / 'bag') as writer, pytest.raises(BadBag, match='/foo'):
        writer.write('/foo', 1, b'')


def test_topic_keeps_its_type(tmp_path: Path) -> None:
    """A topic cannot be declared again with another type."""
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/a', IMU)
        with pytest.raises(BadBag, match='/a'):
            writer.add_topic('/a', JOINT_STATE)


def test_log_time_must_fit(tmp_path: Path) -> None:
    """A negative log time is refused with its value."""
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/a', IMU)
        with pytest.raises(BadSample, match='-1'):
            writer.write('/a', -1, b'')


def test_recording_is_closed_after_an_error(tmp_path: Path) -> None:
    """An exception in the with block leaves a complete bag of what came before."""

    def fail() -> None:
        with BagWriter(tmp_path / 'bag') as writer:
            writer.add_topic('/imu/data', IMU)
            writer.write('/imu/data', 1, b'\x00\x01\x00\x00')
            raise KeyError('x')

    with pytest.raises(KeyError):
        fail()
    bag = open_bag(tmp_path / 'bag')
    assert (bag.salvaged, bag.topics['/imu/data'].count) == (None, 1)


def test_empty_recording_is_a_bag(tmp_path: Path) -> None:
    """A recording without a message is a bag with its topics."""
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/imu/data', IMU)
    bag = open_bag(tmp_path / 'bag')
    assert (bag.duration_s, bag.topics['/imu/data'].count, bag.findings) == (0.0, 0, ())


def test_flush_hands_over_what_is_held(tmp_path: Path) -> None:
    """After flush every message written is in the file."""
    started = time.time_ns()
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/imu/data', IMU)
        writer.write('/imu/data', started, b'\x00\x01\x00\x00')
        writer.flush()
        assert open_bag(writer.path).topics['/imu/data'].count == 1
