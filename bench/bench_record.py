"""What `record` costs and loses: `python -m bench.bench_record` (two minutes; more with kills).

For 200 + 400 and 1000 + 1000 messages a second: processor time against that of a process that only
subscribes, messages lost. With `--kills N`, kill -9 at random moments: seconds lost before the kill
and whether the recording can be read.
"""

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from ugv_acceptance import BadBag
from ugv_acceptance.bag.raw import messages
from ugv_acceptance.bag.reader import open_bag

HERE = Path(__file__).resolve().parent
CODE = 'from ugv_acceptance.cli import main; main()'
TICKS = os.sysconf('SC_CLK_TCK')
# Rates (Hz) of joint states and IMU; the goal of seconds lost; seconds a process needs to come up.
RATES, GOAL, PATIENCE = ((200, 400), (1000, 1000)), 0.5, 60.0
INPUTS = '/joint_states', '/imu/data'


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=10.0, help='of each measurement')
    parser.add_argument('--kills', type=int, default=0)
    parser.add_argument('--split', default='', help='while it is killed, such as 200kB')
    parser.add_argument('--seed', type=int, default=0)
    asked = parser.parse_args()
    if asked.kills:
        sys.exit(not killed(asked.kills, asked.split, asked.seed))
    print('joints + IMU    subscriber    record    ratio    sent    recorded    missing')
    for joints, imu in RATES:
        print(cost(joints, imu, asked.seconds), flush=True)


def cost(joints: int, imu: int, seconds: float) -> str:
    """Return a row: CPU of both processes at the same time, their ratio, messages sent and not."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'run'
        with (
            child(str(HERE / 'live_listener.py'), 'raw') as listener,
            child('-c', CODE, 'record', '--out', str(path)) as recorder,
        ):
            until(path.is_dir)
            both = listener, recorder
            for process in both:
                settle(process)
            before = [cpu(process.pid) for process in both]
            words = [str(HERE / 'live_load.py'), str(joints), str(imu), str(seconds)]
            with child(*words) as load:
                sent = sum(json.loads(load.communicate()[0]))
            now = [cpu(process.pid) for process in both]
            recorder.terminate()
            recorder.wait()
        bag = open_bag(path)
        held = sum(bag.topics[name].count for name in INPUTS)
    plain, busy = ((b - a) / seconds for a, b in zip(before, now, strict=True))
    return (
        f'{joints:5d} + {imu:<5d}{100 * plain:12.1f} %{100 * busy:8.1f} %{busy / plain:9.2f}'
        f'{sent:8d}{held:12d}{sent - held:11d}'
    )


def settle(process: 'subprocess.Popen[bytes]') -> None:
    """Wait until a process has come up: it takes next to nothing while nothing comes."""
    before, now = -1.0, 0.0
    while now - before > 0.05:
        time.sleep(2.0)
        before, now = now, cpu(process.pid)


def killed(times: int, split: str, seed: int) -> bool:
    """Kill a recorder so many times and print what was left; return whether all was good."""
    rng, lost = random.Random(seed), list[float]()
    print('  ran s    size kB    messages    lost s    readable')
    with (
        tempfile.TemporaryDirectory() as folder,
        child(str(HERE / 'live_load.py'), '200', '400', str(times * 90.0)),
    ):
        for k in range(times):
            path, after = Path(folder) / f'run_{k}', rng.uniform(0.5, 8.0)
            words = ['--split', split] if split else []
            with child('-c', CODE, 'record', '--out', str(path), *words) as process:
                until(partial(_begun, path))
                time.sleep(after)
                process.kill()
                end = time.time_ns()
            found = left_in(path, end)
            lost.append(found[1] if found else float('inf'))
            size = sum(file.stat().st_size for file in path.iterdir()) / 1e3
            number = found[0] if found else 0
            print(
                f'{after:7.2f}{size:11.0f}{number:12d}{lost[-1]:10.3f}'
                f'{"yes" if found else "NO":>12}',
                flush=True,
            )
    good = sum(seconds <= GOAL for seconds in lost)
    print(f'{good} of {times} good; at most {max(lost):.3f} s lost (goal {GOAL:g} s)')
    return good == times


def _begun(path: Path) -> bool:
    return any(file.stat().st_size > 2_000 for file in path.glob('*.mcap'))


def left_in(path: Path, end: int) -> tuple[int, float] | None:
    """Return messages and the seconds before `end` (ns) that are missing; None: unreadable."""
    try:
        times = [message.log_time for message in messages(open_bag(path), INPUTS)]
    except BadBag:
        return None
    return len(times), (end - max(times)) / 1e9


def until(condition: Callable[[], object]) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            sys.exit('expected a process to come up, it did not')
        time.sleep(0.05)


def cpu(pid: int) -> float:
    """Return the processor time (s) that a process has taken."""
    fields = Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


@contextmanager
def child(*words: str) -> Iterator['subprocess.Popen[bytes]']:
    """Run Python with these words for a while."""
    env = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    pipe = subprocess.PIPE
    process = subprocess.Popen(
        [sys.executable, *words], env=env, stdout=pipe, stderr=subprocess.DEVNULL
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()


if __name__ == '__main__':
    main()
