"""Speed of reading the same messages from other formats than chunks, as a ratio to MCAP.

Makes the bag of bench_reading (MCAP, zstd), writes its messages into an SQLite bag and into bags
whose messages are compressed one by one, and reads each in turn, every time in a new process.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from bench.bench_reading import make
from ugv_acceptance.bag.raw import messages
from ugv_acceptance.bag.reader import open_bag

MCAP = 'MCAP, zstd chunks'
FORMS: dict[str, tuple[StoragePlugin, bool]] = {
    'SQLite': (StoragePlugin.SQLITE3, False),
    'MCAP, messages compressed': (StoragePlugin.MCAP, True),
    'SQLite, messages compressed': (StoragePlugin.SQLITE3, True),
}


def copy(source: Path, target: Path, storage: StoragePlugin, *, compressed: bool) -> None:
    """Write the messages of a bag into another format, with rosbags."""
    store = get_typestore(Stores.ROS2_JAZZY)
    bag = open_bag(source)
    writer = Writer(target, version=9, storage_plugin=storage)
    if compressed:
        writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    with writer:
        held: dict[str, Any] = {
            name: writer.add_connection(name, topic.type, typestore=store)
            for name, topic in bag.topics.items()
        }
        for message in messages(bag, held):
            writer.write(held[message.topic], message.log_time, message.data)


def read(path: Path) -> dict[str, float]:
    """Figures of reading a bag into columns with one thread, in a process of its own."""
    script = Path(__file__).with_name('bench_reading.py')
    command = [sys.executable, str(script), '--job', 'columns, 1 worker', '--bag', str(path)]
    env = {**os.environ, 'OPENBLAS_NUM_THREADS': '1'}
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=env)
    figures: dict[str, float] = json.loads(done.stdout)
    return figures


def main() -> None:
    """Make the bags, read them in turn, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=360, help='length of the recording')
    parser.add_argument('--rounds', type=int, default=5)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        paths = {MCAP: Path(folder) / 'bag'}
        count = make(paths[MCAP], given.seconds, 'zstd', heavy=False)
        for k, (name, (storage, compressed)) in enumerate(FORMS.items()):
            paths[name] = Path(folder) / f'bag{k}'
            copy(paths[MCAP], paths[name], storage, compressed=compressed)
        rounds = [{name: read(path) for name, path in paths.items()} for _ in range(given.rounds)]
    if any(run['count'] != count for each in rounds for run in each.values()):
        raise SystemExit(f'expected {count} messages from each')
    print(f'{count} messages; medians of {given.rounds}, ratios to MCAP in the same round')
    print(f'{"":30s} {"cpu s":>8s} {"us/msg":>8s} {"x MCAP":>8s} {"RSS MiB":>8s}')
    for name in paths:
        cpu = statistics.median(each[name]['cpu'] for each in rounds)
        ratio = statistics.median(each[name]['cpu'] / each[MCAP]['cpu'] for each in rounds)
        rss = max(each[name]['rss'] for each in rounds)
        print(f'{name:30s} {cpu:8.3f} {cpu / count * 1e6:8.2f} {ratio:8.2f} {rss:8.0f}')


if __name__ == '__main__':
    main()
