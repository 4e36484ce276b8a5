"""Trials of whole processes: runs killed at random moments, and mutation testing of the code."""

import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from hardening.outcome import Outcome

ROOT = Path(__file__).resolve().parents[2]


def kills(share: float) -> Iterable[Outcome]:
    """Kill twenty runs at random moments."""
    count = max(1, int(20 * share))
    command = [sys.executable, 'bench/bench_kill.py', '--kills', str(count)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    said = (done.stdout or done.stderr).strip().splitlines()
    yield Outcome(f'run: {said[-1] if said else "nothing said"}', done.returncode == 0)


def mutation(share: float) -> Iterable[Outcome]:
    """Change the code of model/ and evaluation/ at 300 places and see whether the tests notice."""
    words = ('--count', f'{300 * share:.0f}', '--seed', '16')
    command = [sys.executable, '-m', 'bench.hardening.mutation', *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    found = re.search(r'^\| all \| (\d+) \| (\d+) ', done.stdout, re.MULTILINE)
    if found is None:
        yield Outcome(f'broke off: {done.stderr.strip().splitlines()[-1:]}', held=False)
        return
    # Those that live are to be read.
    for line in re.findall(r'^survived.*', done.stderr, re.MULTILINE):
        print(line, file=sys.stderr, flush=True)
    dead, tried = map(int, found.groups())
    yield Outcome(f'{dead} of {tried} killed ({dead / tried:.0%})', dead / tried >= 0.85)
