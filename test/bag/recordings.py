"""Recordings made, damaged and read for the tests of the reader."""

import struct
from pathlib import Path
from typing import Any

from bag.bag_cases import (
    STORE,
    Message,
)
from mcap.writer import CompressionType, IndexType
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from ugv_acceptance.bag.reader import Bag, Topics, choose_topics, open_bag
from ugv_acceptance.bag.reading import Facts
from ugv_acceptance.evaluation.samples import Batch

BOTH = Topics('/joint_states', '/imu/data', None)

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


def read(path: Path | list[Path], **options: Any) -> tuple[Bag, list[Batch], Facts]:
    """Bag, batches and facts of a recording's joint states and IMU."""
    bag = open_bag(path, **options)
    reading = bag.batches(choose_topics(bag))
    batches = list(reading)
    return bag, batches, reading.facts


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


def chunk_starts(data: bytes | bytearray) -> list[int]:
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


def write_other(path: Path, messages: list[Message]) -> None:
    """A single SQLite (.db3) or ROS 1 (.bag) file, by its suffix."""
    if path.suffix == '.db3':
        folder = write_folder(path.with_suffix(''), messages, StoragePlugin.SQLITE3)
        (source,) = folder.glob('*.db3')
        source.rename(path)
        return
    store = get_typestore(Stores.ROS1_NOETIC)
    with Ros1Writer(path) as writer:
        held: dict[str, Any] = {}
        for topic, kind, time, data in messages:
            if kind not in store.fielddefs:  # ROS 1 has it in a package that rosbags leaves out
                store.register({kind: STORE.fielddefs[kind]})
            if topic not in held:
                held[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(held[topic], time, bytes(STORE.cdr_to_ros1(data, kind)))
