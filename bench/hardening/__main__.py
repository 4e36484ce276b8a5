"""Prints what was tried, what must hold, and what was measured: `python -m bench.hardening`.

`--only 1,2` chooses rows, `--quick` takes a hundredth of each; the exit code is 1 where a row did
not hold.
"""

import argparse
import os
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / 'test'), str(ROOT)]
os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')

from bench.hardening.rows import ROWS  # noqa: E402 (the tests' helpers are on the path now)

WORDS = {True: 'yes', False: 'NO', None: 'not done'}


def main() -> None:
    """Try every row and print it when it is done."""
    parser = argparse.ArgumentParser(prog='python -m bench.hardening', description=__doc__)
    parser.add_argument('--only', default='', help='rows, such as 1,2')
    parser.add_argument('--quick', action='store_true', help='a hundredth of each')
    asked = parser.parse_args()
    chosen = {int(text) for text in asked.only.split(',') if text}
    print('| # | trial | must hold | measured | held | s |\n|---|---|---|---|---|---|', flush=True)
    failed = False
    for row in ROWS:
        if chosen and row.number not in chosen:
            continue
        start = time.perf_counter()
        for measured, held in row.run(0.01 if asked.quick else 1.0):
            failed = failed or held is False
            took = time.perf_counter() - start
            cells = (row.number, row.trial, row.must_hold, measured, WORDS[held], f'{took:.0f}')
            print('| ' + ' | '.join(map(str, cells)) + ' |', flush=True)
    raise SystemExit(int(failed))


if __name__ == '__main__':
    main()
