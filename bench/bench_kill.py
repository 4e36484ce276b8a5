"""Kills a run at random moments (kill -9) and checks what is left: `python -m bench.bench_kill`.

For every kill: seconds it ran and what it was doing (from its journal), steps with a result,
recordings that can be read, whether closed ones are complete, seconds between the last message
recorded and the kill, whether robot and monitor ended too, and whether the run could be continued.
A kill between two recordings can lose no message; one before the folder is there leaves nothing.
"""

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from ugv_acceptance import AcceptanceError, BadBag
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.config import load
from ugv_acceptance.plan.plan import read_plan
from ugv_acceptance.run.folder import open_folder

PLAN = Path(__file__).resolve().parents[1] / 'bags' / 'packbot_short_plan.yaml'
CODE = 'from ugv_acceptance.cli import main; main()'
# Seconds a killed run's children have to end; what may be lost.
PATIENCE, GOAL = 5.0, 1.0


@dataclass(frozen=True)
class Left:
    """The state that a killed run has left behind."""

    doing: str
    steps: int
    readable: int
    recordings: int
    lost: float | None
    ended: bool
    resumable: bool

    @property
    def good(self) -> bool:
        """Whether nothing was lost that had been recorded for longer than the goal."""
        kept = self.lost is None or self.lost <= GOAL
        return kept and self.readable == self.recordings and self.ended and self.resumable


def main() -> None:
    """Kill and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--kills', type=int, default=20)
    parser.add_argument('--earliest', type=float, default=1.0, help='seconds after the start')
    parser.add_argument('--latest', type=float, default=45.0)
    parser.add_argument('--seed', type=int, default=0)
    asked = parser.parse_args()
    rng = random.Random(asked.seed)
    print('  ran s  doing              steps  readable  lost s  others ended  resumable')
    found = []
    for _ in range(asked.kills):
        with tempfile.TemporaryDirectory() as folder:
            after = rng.uniform(asked.earliest, asked.latest)
            left = kill(Path(folder) / 'out', after)
        found.append(left)
        lost = '-' if left.lost is None else f'{left.lost:.2f}'
        readable = f'{left.readable} of {left.recordings}'
        print(
            f'{after:7.1f}  {left.doing:<18}{left.steps:6d}{readable:>10}{lost:>8}'
            f'{left.ended!s:>14}{left.resumable!s:>11}',
            flush=True,
        )
    good = sum(left.good for left in found)
    most = max((left.lost for left in found if left.lost is not None), default=0.0)
    print(f'{good} of {len(found)} good; at most {most:.2f} s lost (goal {GOAL:g} s)')
    sys.exit(good < len(found))


def kill(out: Path, after: float) -> Left:
    """Start a run, kill it and return what was left."""
    env = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    command = [sys.executable, '-c', CODE, 'run', str(PLAN), '--sim', '--out', str(out)]
    said = out.with_name('said')
    with said.open('wb') as file:
        run = subprocess.Popen(
            command, env=env, stdout=file, stderr=subprocess.STDOUT, start_new_session=True
        )
    time.sleep(after)
    if run.poll() is not None:
        raise SystemExit(f'ended by itself with {run.returncode}:\n{said.read_text()}')
    others = [int(p) for p in Path(f'/proc/{run.pid}/task/{run.pid}/children').read_text().split()]
    run.kill()
    killed = time.time()
    run.wait()
    end = time.monotonic() + PATIENCE
    while not all(map(gone, others)) and time.monotonic() < end:
        time.sleep(0.1)
    steps, recordings, readable, lost = recorded(out, killed)
    return Left(
        doing(out),
        steps,
        readable,
        recordings,
        lost,
        all(map(gone, others)),
        resumable(out),
    )


def doing(out: Path) -> str:
    """Return what the run was doing, by its journal."""
    journal = out / 'journal.jsonl'
    if not journal.is_file():
        return 'not begun'
    lines = [json.loads(line) for line in journal.read_text().splitlines()]
    event, step = lines[-1]['event'], lines[-1].get('step', '')
    return {'begun': 'starting', 'attempt': f'step {step[:2]}'}.get(event, f'after {step[:2]}')


def recorded(out: Path, killed: float) -> tuple[int, int, int, float | None]:
    """Return steps done, recordings, those that can be read, and the seconds lost of an open one.

    A recording with metadata.yaml was closed: it has to have every message that it claims.
    """
    steps = len(list(out.glob('steps/*.json')))
    recordings = [p for p in out.glob('steps/*') if p.is_dir()]
    readable, lost = 0, None
    for path in recordings:
        closed = (path / 'metadata.yaml').is_file()
        try:
            bag = open_bag(path)
        except BadBag:
            # Just begun: nothing to read yet, and nothing that could be lost.
            readable += (path / f'{path.name}_0.mcap').stat().st_size == 0
            continue
        # What is closed must be whole; what is not is salvaged up to where it breaks off.
        readable += not (closed and bag.salvaged)
        if not closed:
            lost = killed - (bag.end_ns / 1e9 or bag.paths[0].stat().st_mtime)
    return steps, len(recordings), readable, lost


def resumable(out: Path) -> bool:
    """Return whether --resume continues what is there (or begins where nothing was begun)."""
    config = load()
    try:
        open_folder(
            out, read_plan(PLAN, config.settings.robot), PLAN, 'sim', config, resume=out.exists()
        )
    except AcceptanceError:
        return False
    return True


def gone(pid: int) -> bool:
    """Return whether a process has ended."""
    path = Path(f'/proc/{pid}/stat')
    return not path.exists() or path.read_text().rsplit(')', 1)[1].split()[0] == 'Z'


if __name__ == '__main__':
    main()
