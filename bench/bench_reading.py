"""Speed of reading a bag into columns, against unpacking alone and against other readers.

Makes a rosbag2 folder (JointState of 6 joints at 200 Hz, Imu at 400 Hz, values quantised like real
sensors, 1 MiB chunks with checksums), then runs every reader in turn, each in a process of its own.
CPU time is the figure to quote, as a ratio to the floor of the same round; imports are not counted.
"""

import argparse
import ctypes.util
import importlib.util
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from ugv_acceptance.bag.chunks import Buffers
from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.mcap_source import open_mcap
from ugv_acceptance.bag.mcap_writer import Compression
from ugv_acceptance.bag.reader import choose_topics, open_bag
from ugv_acceptance.bag.writer import BagWriter

JOINTS = ('flipper', 'shoulder', 'elbow', 'turret', 'head_pan', 'head_tilt')
T0 = 1_760_000_000_000_000_000
IMAGE = 'sensor_msgs/msg/CompressedImage'
Rows = NDArray[np.uint8]


def quantised(values: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Values as a sensor with this resolution gives them."""
    return np.asarray(np.round(values / step) * step)


def patched(template: bytes, times: NDArray[np.int64], fields: dict[int, Any]) -> Rows:
    """One row a message: the template with its stamp and some float64 fields replaced."""
    out = np.repeat(np.frombuffer(template, np.uint8)[None], len(times), 0)
    stamp = np.stack([times // 10**9, times % 10**9], 1).astype('<u4')
    out[:, 4:12] = stamp.view(np.uint8)
    for offset, values in fields.items():
        data = np.ascontiguousarray(values, '<f8').view(np.uint8).reshape(len(times), -1)
        out[:, offset : offset + data.shape[1]] = data
    return out


def joint_rows(times: NDArray[np.int64], rng: np.random.Generator) -> Rows:
    """Serialised joint states: encoders, velocities and efforts of slow motions."""
    marks = [[1.5e-300 + i] * 6 for i in range(3)]
    template = joint_state_cdr(0, '', [f'{name}_joint' for name in JOINTS], *marks)
    phase = (times - T0)[:, None] * 1e-9 * (0.05 + 0.03 * np.arange(6)) + np.arange(6)
    noise = rng.normal(0, 1, (3, *phase.shape))
    values = (
        quantised(1.4 * np.sin(phase) + 2e-4 * noise[0], 2 * np.pi / 16384),
        quantised(0.1 * np.cos(phase) + 2e-3 * noise[1], 1e-3),
        quantised(40 * np.cos(1.4 * np.sin(phase)) + 0.3 * noise[2], 1e-2),
    )
    places = [template.index(np.float64(mark[0]).tobytes()) for mark in marks]
    return patched(template, times, dict(zip(places, values, strict=True)))


def imu_rows(times: NDArray[np.int64], rng: np.random.Generator) -> Rows:
    """Serialised IMU messages: a full double orientation, quantised rates and accelerations."""
    spread = [s * np.eye(3).ravel() for s in (1e-4, 2e-5, 3e-3)]
    still = ((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    template = imu_cdr(0, 'imu_link', *still, (spread[0], spread[1], spread[2]))
    seconds = (times - T0) * 1e-9
    roll = 0.1 * np.sin(0.1 * seconds) + rng.normal(0, 1e-4, len(times))
    yaw = 0.15 * seconds
    quaternion = np.stack(
        [
            np.sin(roll) * np.cos(yaw),
            np.sin(roll) * np.sin(yaw),
            np.cos(roll) * np.sin(yaw),
            np.cos(roll) * np.cos(yaw),
        ],
        1,
    )
    rates = quantised(rng.normal(0, 0.02, (len(times), 3)), np.deg2rad(250) / 32768)
    gravity = 9.81 * np.stack([0 * roll, np.sin(2 * roll), np.cos(2 * roll)], 1)
    force = quantised(gravity + rng.normal(0, 0.05, gravity.shape), 4 * 9.80665 / 32768)
    head = len(template) - 8 * 37
    return patched(template, times, {head: quaternion, head + 104: rates, head + 200: force})


def make(folder: Path, seconds: float, compression: Compression, *, heavy: bool) -> int:
    """Record the bag; return the number of messages of joints and IMU."""
    rng = np.random.default_rng(1)
    count = 0
    pool = rng.integers(0, 256, 1 << 24, dtype=np.uint8).tobytes()
    image_head = bytes.fromhex('00010000') + bytes(8) + b'\x01\0\0\0\0\0\0\0\x05\0\0\0jpeg\0\0\0\0'
    with BagWriter(folder, compression=compression, flush_s=1e9) as writer:
        writer.add_topic('/joint_states', 'sensor_msgs/msg/JointState')
        writer.add_topic('/imu/data', 'sensor_msgs/msg/Imu')
        writer.add_topic('/camera/image/compressed', IMAGE)
        for start in np.arange(0.0, seconds, 10.0):
            number = round(min(10.0, seconds - start) * 400)
            times = T0 + round(start * 1e9) + np.arange(number) * 2_500_000
            imu = imu_rows(times, rng)
            joints = joint_rows(times[::2], rng)
            logged = (times + rng.integers(100_000, 300_000, number)).tolist()
            for k, log_time in enumerate(logged):
                if heavy and k % 40 == 0:
                    at = int(rng.integers(0, len(pool) - 50_000))
                    body = image_head + (50_000).to_bytes(4, 'little') + pool[at : at + 50_000]
                    writer.write('/camera/image/compressed', log_time, body)
                writer.write('/imu/data', log_time, imu[k].tobytes())
                if k % 2 == 0:
                    writer.write('/joint_states', log_time + 50_000, joints[k // 2].tobytes())
            count += number + len(joints)
    return count


Unpack = Callable[[str, memoryview, memoryview], None]


def system_lz4() -> Unpack | None:
    """The system's own liblz4, the least cost of unpacking a frame; None where there is none."""
    found = ctypes.util.find_library('lz4')
    if found is None:
        return None
    library = ctypes.CDLL(found)
    context, other = ctypes.c_void_p(), Buffers().unpack
    library.LZ4F_createDecompressionContext(ctypes.byref(context), 100)

    def unpack(compression: str, source: memoryview, target: memoryview) -> None:
        if compression != 'lz4':
            other(compression, source, target)
            return
        packed = (ctypes.c_char * len(source)).from_buffer(source)
        out = (ctypes.c_char * len(target)).from_buffer(target)
        done, used = ctypes.c_size_t(len(target)), ctypes.c_size_t(len(source))
        library.LZ4F_decompress(context, out, ctypes.byref(done), packed, ctypes.byref(used), None)
        if done.value != len(target):
            raise SystemExit(f'liblz4: expected {len(target)} bytes, got {done.value}')

    return unpack


def floor(path: Path) -> Callable[[], int]:
    """Read every chunk into one buffer and unpack it into another, nothing else."""
    with path.open('rb') as file:
        index = open_mcap(file, path.name)
    heads = [(piece.start, piece.head) for piece in index.pieces if piece.head]
    largest = max(head.size for _, head in heads)
    source = memoryview(bytearray(max(head.length for _, head in heads)))
    target = memoryview(bytearray(largest))
    unpack = system_lz4() or Buffers().unpack

    def run() -> int:
        total = 0
        with path.open('rb') as file:
            for start, head in heads:
                os.preadv(file.fileno(), [source[: head.length]], start)
                if head.compression:
                    packed = source[head.data : head.data + head.packed]
                    unpack(head.compression, packed, target[: head.size])
                total += head.size
        return total

    return run


def columns(workers: int) -> Callable[[Path], Callable[[], int]]:
    """Our reader: opened, topics chosen, every message into columns."""

    def prepare(path: Path) -> Callable[[], int]:
        def run() -> int:
            bag = open_bag(path)
            reading = bag.batches(choose_topics(bag), workers=workers)
            count = 0
            for batch in reading:
                count += sum(len(joints.log_time) for joints in batch.joints)
                count += sum(len(imu.log_time) for imu in batch.imu)
            return count

        return run

    return prepare


def rosbags(path: Path) -> Callable[[], int]:
    """The rosbags library: every wanted message as an object, its fields into arrays."""
    store: Any = get_typestore(Stores.ROS2_JAZZY)

    def run() -> int:
        held: dict[str, list[Any]] = {'/joint_states': [], '/imu/data': []}
        with Reader(path.parent) as reader:
            wanted = [c for c in reader.connections if c.topic in held]
            for connection, _, data in reader.messages(wanted):
                m = store.deserialize_cdr(data, connection.msgtype)
                if connection.topic == '/joint_states':
                    held[connection.topic].append((m.position, m.velocity, m.effort))
                else:
                    q, w, a = m.orientation, m.angular_velocity, m.linear_acceleration
                    held[connection.topic].append(
                        (q.x, q.y, q.z, q.w, w.x, w.y, w.z, a.x, a.y, a.z)
                    )
        return sum(len(np.array(rows)) for rows in held.values())

    return run


def rerun(path: Path) -> Callable[[], int]:
    """The native reader of rerun-sdk (Rust): its lists of numbers as arrays, without a copy."""
    from rerun.chunk import McapReader  # type: ignore[import-not-found]  # noqa: PLC0415 (optional)

    def run() -> int:
        wanted = ['^/joint_states$', '^/imu/data$']
        reader = McapReader(path, decoders=['ros2msg'], include_topic_regex=wanted)
        count = 0
        for chunk in reader.stream():
            table = chunk.to_record_batch()
            for name, column in zip(table.schema.names, table.columns, strict=True):
                if name.endswith((':scalars', ':orientation')):
                    count += len(column.flatten().to_numpy(zero_copy_only=False))
        return count

    return run


def baglab(path: Path) -> Callable[[], int]:
    """The native reader of baglab-mcap-backend (C++): the wanted fields, an array or list each."""
    from baglab_mcap_backend import (  # type: ignore[import-not-found]  # noqa: PLC0415 (optional)
        BagReader,
    )

    vectors = {'orientation': 'xyzw', 'angular_velocity': 'xyz', 'linear_acceleration': 'xyz'}
    fields = {
        '/joint_states': ['position', 'velocity', 'effort'],
        '/imu/data': [f'{name}.{axis}' for name, axes in vectors.items() for axis in axes],
    }

    def run() -> int:
        found = BagReader(str(path)).read_topics(list(fields), fields)
        return sum(len(topic['__timestamps__']) for topic in found.values())

    return run


JOBS: dict[str, Callable[[Path], Callable[[], int]]] = {
    'floor': floor,
    'columns, 1 worker': columns(1),
    'columns, 2 workers': columns(2),
    'rosbags': rosbags,
    'rerun-sdk': rerun,
    'baglab': baglab,
}
OPTIONAL = {'rerun-sdk': 'rerun', 'baglab': 'baglab_mcap_backend'}


def job(name: str, path: Path) -> None:
    """Run one reader in this process and print its figures as JSON."""
    run = JOBS[name](path)
    cpu, wall = time.process_time(), time.perf_counter()
    count = run()
    figures = {
        'count': count,
        'cpu': time.process_time() - cpu,
        'wall': time.perf_counter() - wall,
        'rss': resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }
    print(json.dumps(figures))


def measure(path: Path, rounds: int, names: list[str]) -> dict[str, list[dict[str, float]]]:
    """Figures of every reader, in turn, `rounds` times; of a slow one once."""
    out: dict[str, list[dict[str, float]]] = {name: [] for name in names}
    for turn in range(rounds):
        for name in names:
            if turn and name in {'rosbags', 'baglab'}:
                continue
            command = [sys.executable, __file__, '--job', name, '--bag', str(path)]
            # One thread for linear algebra: its idle threads would be counted as CPU time.
            env = {**os.environ, 'OPENBLAS_NUM_THREADS': '1'}
            done = subprocess.run(command, capture_output=True, text=True, check=False, env=env)
            if done.returncode:
                print(f'{name}: {done.stderr.strip().splitlines()[-1]}')
                continue
            out[name].append(json.loads(done.stdout))
    return out


def table(figures: dict[str, list[dict[str, float]]], count: int) -> None:
    """Medians; ratios to the floor of the same round."""
    heads = ('cpu s', 'wall s', 'cpu/floor', 'wall/floor', 'RSS MiB')
    print(' ' * 20, *(f'{head:>10s}' for head in heads))
    base = figures['floor']
    for name, runs in figures.items():
        if not runs:
            continue
        if name.startswith(('columns', 'rosbags')) and any(run['count'] != count for run in runs):
            raise SystemExit(f'{name}: expected {count} messages, got {runs[0]["count"]}')
        cpu, wall, rss = (statistics.median(run[k] for run in runs) for k in ('cpu', 'wall', 'rss'))
        pairs = list(zip(runs, base, strict=False))
        by_cpu = statistics.median(run['cpu'] / low['cpu'] for run, low in pairs)
        by_wall = statistics.median(run['wall'] / low['wall'] for run, low in pairs)
        cells = ' '.join(f'{value:10.3f}' for value in (cpu, wall, by_cpu, by_wall))
        print(f'{name:20s} {cells} {rss:10.0f}')


def main() -> None:
    """Make the bag, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=360, help='length of the recording')
    parser.add_argument('--compression', choices=['zstd', 'lz4', 'none'], default='zstd')
    parser.add_argument('--heavy', action='store_true', help='with 50 kB images at 10 Hz beside')
    parser.add_argument('--rounds', type=int, default=5)
    parser.add_argument('--only-ours', action='store_true', help='leave other readers out')
    parser.add_argument('--job', choices=JOBS, help=argparse.SUPPRESS)
    parser.add_argument('--bag', type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.job:
        job(given.job, given.bag)
        return
    names = [n for n in JOBS if not (given.only_ours and n in {'rosbags', *OPTIONAL})]
    for name, module in OPTIONAL.items():
        if importlib.util.find_spec(module) is None and name in names:
            names.remove(name)
            print(f'{name} is not installed: left out')
    with tempfile.TemporaryDirectory() as folder:
        compression: Compression = '' if given.compression == 'none' else given.compression
        bag = Path(folder) / 'bag'
        count = make(bag, given.seconds, compression, heavy=given.heavy)
        path = bag / 'bag_0.mcap'
        size = path.stat().st_size / 1e6
        using = 'checksums by isal' if importlib.util.find_spec('isal') else 'checksums by zlib'
        print(f'{count} messages, {size:.0f} MB {given.compression}, {using}')
        table(measure(path, given.rounds, names), count)


if __name__ == '__main__':
    main()
