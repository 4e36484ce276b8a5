"""Trials of whole processes: killed at random moments, and with their code changed."""

import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from hardening.outcome import Outcome

from bench.hardening.mutants import EQUIVALENT
from bench.hardening.mutation import try_some

ROOT = Path(__file__).resolve().parents[2]


def kills(share: float) -> Iterable[Outcome]:
    """Kill twenty runs at random moments."""
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


def mutation(share: float) -> Iterable[Outcome]:
    """Change the code of two rooms, 300 times in all, and see whether the tests notice."""
    found = try_some(count=max(30, int(300 * share)))
    for room in ('model', 'evaluation'):
        mine = {file: n for file, n in found.items() if file.startswith(room)}
        dead, tried = (sum(n) for n in zip(*mine.values(), strict=True))
        each = ', '.join(f'{Path(file).stem} {k}/{n}' for file, (k, n) in mine.items())
        text = f'{room}/: {dead} of {tried} killed ({dead / tried:.0%}): {each}'
        yield Outcome(text, dead >= 0.85 * tried)
    yield Outcome(f'{len(EQUIVALENT)} more can be seen by nobody and were left out', held=True)
