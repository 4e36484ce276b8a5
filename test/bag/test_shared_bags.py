"""Recordings that others made: each is read as rosbags reads it, and none crashes or hangs."""

from pathlib import Path
from typing import Any

import pytest
from bag.bag_cases import IMU, INERTIA, JOINT_STATE, SHARED, numbers, rows
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from ugv_acceptance import BadBag
from ugv_acceptance.bag.reader import Bag, Topics, choose_topics, open_bag

SUFFIXES = {'.mcap', '.db3', '.bag', '.zstd'}
CONFORMANCE = SHARED / 'conformance'

pytestmark = pytest.mark.skipif(
    not SHARED.is_dir(), reason=f'recordings of others are not here: {SHARED}'
)


def recordings() -> list[Path]:
    """Every file of a recording, and every folder with metadata, except the conformance files."""
    files = [p for p in SHARED.rglob('*') if p.suffix in SUFFIXES and p.is_file()]
    folders = [p.parent for p in SHARED.rglob('metadata.yaml')]
    return sorted(p for p in {*files, *folders} if CONFORMANCE not in p.parents)


def named(path: Path) -> str:
    """A path as it appears in a test's name."""
    return str(path.relative_to(SHARED))


def all_topics(bag: Bag) -> list[Topics]:
    """Every topic of the bag that we read, each on its own."""
    found = []
    for name, topic in bag.topics.items():
        if topic.encoding in {'cdr', 'ros1'}:
            found += [Topics(name, None, None)] if topic.type == JOINT_STATE else []
            found += [Topics(None, name, None)] if topic.type == IMU else []
            found += [Topics(None, None, name)] if topic.type == INERTIA else []
    return found


def by_rosbags(path: Path, topic: str) -> list[Any]:
    """(log time, numbers) of a topic as rosbags reads it."""
    store = get_typestore(Stores.ROS2_JAZZY)
    with AnyReader([path], default_typestore=store) as reader:
        connections = [c for c in reader.connections if c.topic == topic]
        return [
            (time, numbers(reader.deserialize(data, c.msgtype)))
            for c, time, data in reader.messages(connections)
        ]


@pytest.mark.parametrize('path', recordings(), ids=named)
def test_any_recording_is_read_or_refused(path: Path) -> None:
    """Every recording is read to its end or refused with a sentence that names it."""
    try:
        bag = open_bag(path)
    except BadBag as error:
        assert path.name in str(error)  # noqa: PT017 (one of the two ways that are right)
        return
    for topics in all_topics(bag):
        reading = bag.batches(topics)
        held = rows(reading)
        (count,) = reading.facts.counts.values()
        malformed = sum(n for n, _ in reading.facts.malformed.values())
        assert len(held) == count - malformed
        assert count == bag.topics[next(iter(reading.facts.counts))].count
        assert reading.facts.complete


READABLE = (
    'abitobot',
    'fuse_turtlebot3/fuse_turtlebot3.bag',
    'robot_localization/robot_localization_test1.bag',
    'robot_localization/robot_localization_test2.bag',
    'mixed/rosbag2parquet_array_msgs',
    'mixed/rosbags_rs_mcap',
    'mixed/rosbags_rs_sqlite3',
    'rosbag2_recorded/default',
    'rosbag2_recorded/fastwrite',
    'rosbag2_recorded/rb_written',
    'rosbag2_recorded/split',
    'rosbag2_recorded/zstd_small',
)


@pytest.mark.parametrize('name', READABLE)
def test_numbers_equal_rosbags(name: str) -> None:
    """Every number of every message we read is the one that rosbags reads."""
    path = SHARED / name
    bag = open_bag(path)
    chosen = all_topics(bag)
    assert chosen
    for topics in chosen:
        (topic,) = [t for t in (topics.joint_states, topics.imu, topics.payload) if t]
        assert rows(bag.batches(topics)) == by_rosbags(path, topic)


def test_recording_that_was_killed_is_salvaged() -> None:
    """A recorder killed with kill -9 leaves 53 messages, and the bag says where it breaks."""
    bag = open_bag(SHARED / 'rosbag2_recorded' / 'killed' / 'killed_0.mcap')
    assert len(rows(bag.batches(choose_topics(bag)))) == 53
    assert bag.salvaged is not None
    assert 'at byte' in bag.salvaged


def test_abitobot_cut_at_six_tenths(tmp_path: Path) -> None:
    """Cut at 60 %, all whole chunks before the break are read: 3583 of 6578 messages."""
    (source,) = (SHARED / 'abitobot').glob('*.mcap')
    data = source.read_bytes()
    path = tmp_path / 'cut.mcap'
    path.write_bytes(data[: len(data) * 6 // 10])
    bag = open_bag(path)
    assert len(rows(bag.batches(choose_topics(bag)))) == 3583
    assert bag.salvaged is not None


def test_abitobot_says_that_it_is_unprotected() -> None:
    """rosbag2 writes no chunk checksums, and the bag says so."""
    assert open_bag(SHARED / 'abitobot').protected == 'none'


def test_folder_whose_qos_differs_keeps_its_messages() -> None:
    """The talker bag, of which rosbags' folder reader silently gives nothing, keeps all."""
    folder = SHARED / 'rosbag2' / 'rosbag2_py' / 'test' / 'resources' / 'mcap' / 'talker'
    assert sum(topic.count for topic in open_bag(folder).topics.values()) == 20


def test_all_conformance_files_are_opened() -> None:
    """All 656 combinations of optional sections open, and count as many messages as they hold."""
    paths = sorted(CONFORMANCE.glob('*.mcap'))
    assert len(paths) == 656
    for path in paths:
        bag = open_bag(path)
        messages = {'OneMessage': 1, 'TenMessages': 10, 'TenMessagesOneAttachment': 10}
        held = sum(topic.count for topic in bag.topics.values())
        assert held == messages.get(path.stem.split('-')[0], 0), path.name
        assert bag.salvaged is None
        assert not bag.findings
