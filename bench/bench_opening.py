"""Time to open a recording of many topics, against reading its summary with the mcap package.

Makes one minute of joint states, IMU and `--topics` other topics of 10 Hz, as a large robot has
them, and opens it with this package, with mcap (the summary only) and with rosbags.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader

from bench.bench_reading import T0, imu_rows, joint_rows
from ugv_acceptance.bag.reader import choose_topics, open_bag
from ugv_acceptance.bag.writer import BagWriter

OTHERS = (
    'nav_msgs/msg/Odometry',
    'geometry_msgs/msg/TwistStamped',
    'sensor_msgs/msg/Temperature',
    'diagnostic_msgs/msg/DiagnosticArray',
    'std_msgs/msg/Float64',
    'sensor_msgs/msg/BatteryState',
    'tf2_msgs/msg/TFMessage',
    'sensor_msgs/msg/PointCloud2',
)


def make(folder: Path, topics: int, seconds: int = 60) -> None:
    """Record the bag: IMU at 400 Hz, joints at 200 Hz, the others at 10 Hz each."""
    times = T0 + np.arange(seconds * 400) * 2_500_000
    rng = np.random.default_rng(1)
    imu, joints = imu_rows(times, rng), joint_rows(times[::2], rng)
    body = bytes.fromhex('00010000') + bytes(range(96))
    names = [f'/robot/part_{k}/state' for k in range(topics)]
    with BagWriter(folder, flush_s=1e9) as writer:
        writer.add_topic('/joint_states', 'sensor_msgs/msg/JointState')
        writer.add_topic('/imu/data', 'sensor_msgs/msg/Imu')
        for k, name in enumerate(names):
            writer.add_topic(name, OTHERS[k % len(OTHERS)])
        for k, log_time in enumerate(times.tolist()):
            writer.write('/imu/data', log_time, imu[k].tobytes())
            if k % 2 == 0:
                writer.write('/joint_states', log_time, joints[k // 2].tobytes())
            for name in names[k % 40 :: 40]:
                writer.write(name, log_time, body)


def ours(path: Path) -> None:
    """Open the recording and choose its topics."""
    choose_topics(open_bag(path))


def summary(path: Path) -> None:
    """Read the summary of its file with the mcap package."""
    with next(path.glob('*.mcap')).open('rb') as file:
        make_reader(file).get_summary()


def rosbags(path: Path) -> None:
    """Open it with rosbags."""
    with Reader(path):
        pass


JOBS: dict[str, Callable[[Path], None]] = {
    'mcap, summary only (floor)': summary,
    'ours, open and choose topics': ours,
    'rosbags': rosbags,
}


def main() -> None:
    """Make the bag, open it in turn, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--topics', type=int, default=1000)
    parser.add_argument('--rounds', type=int, default=5)
    parser.add_argument('--job', choices=JOBS, help=argparse.SUPPRESS)
    parser.add_argument('--bag', type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.job:
        start = time.process_time()
        JOBS[given.job](given.bag)
        print(json.dumps(time.process_time() - start))
        return
    figures: dict[str, list[float]] = {name: [] for name in JOBS}
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / 'bag'
        make(bag, given.topics)
        for _ in range(given.rounds):
            for name, runs in figures.items():
                command = [sys.executable, '-m', 'bench.bench_opening']
                command += ['--job', name, '--bag', str(bag)]
                done = subprocess.run(command, capture_output=True, text=True, check=True)
                runs.append(json.loads(done.stdout))
    print(f'{given.topics} topics beside joints and IMU, 1 minute; CPU time, {given.rounds} rounds')
    floor = figures['mcap, summary only (floor)']
    for name, runs in figures.items():
        ratio = statistics.median(run / low for run, low in zip(runs, floor, strict=True))
        print(
            f'{name:30s} best {min(runs):.3f} s, median {statistics.median(runs):.3f} s, ', end=''
        )
        print(f'{ratio:.2f} x floor')


if __name__ == '__main__':
    main()
