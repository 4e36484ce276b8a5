"""Runs the hardening trials and prints requirement and result of each: `python -m bench.hardening`.

`--only 1,2` chooses rows, `--share` takes a part of each; the exit code is 1 where a row did not
hold or broke off. Two lines of rows, ten minutes over DDS and what is done to whole processes, run
beside the others and print between them. All takes about an hour on two free cores, the two lines
alone about 25 minutes (`--only 6,9,11`, without the soak 15), `--share 0.5` half of it.
"""

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from traceback import extract_tb

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / 'test'), str(ROOT)]
import conftest  # noqa: E402, F401 (claims a ROS domain before rclpy is imported)
from hardening.outcome import Outcome  # noqa: E402

from bench.hardening.rows import ROWS, Row  # noqa: E402 (the tests' helpers are on the path now)

WORDS = {True: 'yes', False: 'NO', None: 'not done'}


def main() -> None:
    """Try every row and print it when it is done."""
    parser = argparse.ArgumentParser(prog='python -m bench.hardening', description=__doc__)
    parser.add_argument('--only', default='', help='rows, such as 1,2')
    parser.add_argument('--share', type=float, default=1.0, help='part of each row')
    parser.add_argument('--quick', action='store_true', help='a hundredth of each')
    parser.add_argument('--beside', type=int, help='only this line of rows')
    asked = parser.parse_args()
    share = 0.01 if asked.quick else asked.share
    chosen = {int(text) for text in asked.only.split(',') if text}
    rows = [row for row in ROWS if not chosen or row.number in chosen]
    line = asked.beside or 0
    others = {row.beside for row in rows} - {0} if asked.beside is None else set()
    children = [started([*sys.argv[1:], '--beside', str(other)]) for other in sorted(others)]
    if asked.beside is None:
        print(
            '| # | trial | must hold | measured | held | s |\n|---|---|---|---|---|---|', flush=True
        )
    held = [tried(row, share) for row in rows if row.beside == line]
    held += [child.wait() == 0 for child in children]
    raise SystemExit(int(not all(held)))


def started(words: list[str]) -> 'subprocess.Popen[bytes]':
    """Start a line of rows beside this one, in a ROS domain of its own."""
    drop = ('_ROS_WHEELS_BOOTSTRAP_COMPLETE', 'ROS_DOMAIN_ID')
    env = {k: v for k, v in os.environ.items() if k not in drop}
    command = [sys.executable, '-m', 'bench.hardening', *words]
    return subprocess.Popen(command, cwd=ROOT, env=env)


def tried(row: Row, share: float) -> bool:
    """Run a row and print its outcomes; return whether none failed."""
    start, held = time.perf_counter(), True
    for measured, good in outcomes(row, share):
        held = held and good is not False
        took = time.perf_counter() - start
        cells = (row.number, row.trial, row.must_hold, measured, WORDS[good], f'{took:.0f}')
        print('| ' + ' | '.join(map(str, cells)) + ' |', flush=True)
    return held


def outcomes(row: Row, share: float) -> Iterable[Outcome]:
    """Yield a row's outcomes; an exception counts as a failure, and other rows still run."""
    try:
        yield from row.run(share)
    except Exception as error:  # noqa: BLE001 - whatever it is, it is a trial that failed
        where = ' < '.join(frame.name for frame in reversed(extract_tb(error.__traceback__)[-4:]))
        yield Outcome(f'broke off: {error!r} in {where}', held=False)


if __name__ == '__main__':
    main()
