"""kill -9 of a run at random moments: what was left each time. `python bench/bench_kill.py`.

For every kill: seconds it ran, steps with a result, recordings that can be read, messages in them,
seconds between the last message and the kill, and whether robot and monitor ended too.
"""

import argparse
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from ugv_acceptance import BadBag
from ugv_acceptance.bag.reader import open_bag

PLAN = Path(__file__).resolve().parents[1] / 'bags' / 'packbot_short_plan.yaml'
CODE = 'from ugv_acceptance.cli import main; main()'


def main() -> None:
    """Kill and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--kills', type=int, default=20)
    parser.add_argument('--earliest', type=float, default=8.0, help='seconds after the start')
    parser.add_argument('--latest', type=float, default=40.0)
    parser.add_argument('--seed', type=int, default=0)
    asked = parser.parse_args()
    rng = random.Random(asked.seed)
    print('  ran s  steps  readable  messages  lost s  others ended')
    for _ in range(asked.kills):
        with tempfile.TemporaryDirectory() as folder:
            kill(Path(folder) / 'out', rng.uniform(asked.earliest, asked.latest))


def kill(out: Path, after: float) -> None:
    """Start a run, kill it and print what was left."""
    env = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    command = [sys.executable, '-c', CODE, 'run', str(PLAN), '--sim', '--out', str(out)]
    run = subprocess.Popen(
        command,
        env=env,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    time.sleep(after)
    if run.poll() is not None:
        raise SystemExit(f'{" ".join(command)}: ended by itself with {run.returncode}')
    others = [int(p) for p in Path(f'/proc/{run.pid}/task/{run.pid}/children').read_text().split()]
    run.kill()
    killed = time.time()
    run.wait()
    time.sleep(3.0)
    ended = all(gone(pid) for pid in others)
    steps = len(list((out / 'steps').glob('*.json')))
    recordings = [p for p in (out / 'steps').glob('*') if p.is_dir()]
    counts, newest = [], 0
    for path in recordings:
        try:
            bag = open_bag(path)
        except BadBag:
            continue
        counts.append(sum(topic.count for topic in bag.topics.values()))
        newest = max(newest, bag.end_ns)
    # Between two steps nothing is recorded, so nothing can be lost.
    open_now = [p for p in recordings if not (p / 'metadata.yaml').is_file()]
    lost = f'{killed - newest / 1e9:.2f}' if open_now and newest else '-'
    readable = f'{len(counts)} of {len(recordings)}'
    print(f'{after:7.1f}{steps:7d}{readable:>10}{sum(counts):10d}{lost:>8}  {ended}', flush=True)


def gone(pid: int) -> bool:
    """Return whether a process has ended."""
    path = Path(f'/proc/{pid}/stat')
    return not path.exists() or path.read_text().rsplit(')', 1)[1].split()[0] == 'Z'


if __name__ == '__main__':
    main()
