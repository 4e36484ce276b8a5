"""Trials of whole processes: killed at random moments, and with their code changed."""

import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from hardening.outcome import Outcome

from bench.hardening.mutation import TESTS, try_some
from bench.hardening.suite import passed

ROOT = Path(__file__).resolve().parents[2]


def kills(share: float) -> Iterable[Outcome]:
    """Kill twenty runs at random moments, and the black box as its tests do."""
    count = max(1, int(20 * share))
    command = [sys.executable, 'bench/bench_kill.py', '--kills', str(count)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    rows = [line.split() for line in done.stdout.splitlines()[1:]]
    # ran, steps, readable, 'of', recordings, messages, lost, whether the others ended
    whole = sum(row[2] == row[4] for row in rows)
    lost = [float(row[6]) for row in rows if row[6] != '-']
    most = max(lost, default=0.0)
    text = f'run: {whole} of {count} left all recordings readable, at most {most:.2f} s lost'
    yield Outcome(text, whole == count == len(rows) and most <= 1.0)
    yield passed(['nodes/test_black_box.py'])


def mutation(share: float) -> Iterable[Outcome]:
    """Change the code of six files and see whether their tests notice."""
    for name, (dead, tried) in try_some(TESTS, 1200 * share, 0).items():
        rate = dead / tried if tried else 0.0
        yield Outcome(f'{name}: {dead} of {tried} killed ({rate:.0%})', rate >= 0.85)
