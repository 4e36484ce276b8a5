"""Makes every case in a folder and prints name, what must come, and what came.

`python test/cases OUT`; without OUT the recordings are thrown away. With `--shared` the cases of
../shared/bags/cases are judged as well. The exit code is 1 where anything is not as it must be.
"""

import argparse
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / 'test'), str(ROOT)]
from cases.table import GIVEN, MADE, SHARED, Case  # noqa: E402 (the helpers are on the path now)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('out', nargs='?', type=Path, help='keep the recordings in this new folder')
    parser.add_argument('--shared', action='store_true', help='also those of ../shared')
    asked = parser.parse_args()
    if asked.out is not None and asked.out.exists() and any(asked.out.iterdir()):
        parser.error(f'{asked.out}: expected a new or empty folder')
    cases = list(MADE.values())
    if asked.shared and not SHARED.is_dir():
        sys.stdout.write(f'not here: {SHARED}\n')
    elif asked.shared:
        cases += GIVEN.values()
    sys.stdout.write('| case | must come | came | as it must |\n|---|---|---|---|\n')
    with tempfile.TemporaryDirectory() as scratch:
        wrong = [line(case, asked.out or Path(scratch)) for case in cases]
    sys.stdout.write(f'{wrong.count(False)} of {len(wrong)} as they must be\n')
    raise SystemExit(int(any(wrong)))


def line(case: Case, out: Path) -> bool:
    """Print the line of a case; return whether anything is wrong."""
    folder = out / (f'{case.name}_shared' if case.shared else case.name)
    folder.mkdir(parents=True, exist_ok=True)
    verdict = case.verdict(folder)
    wrong = case.expected.wrong(verdict)
    name = f'{case.name} (shared)' if case.shared else case.name
    cells = (name, case.expected.words, verdict.word, f'NO: {wrong}' if wrong else 'yes')
    sys.stdout.write('| ' + ' | '.join(c.replace('|', '\\|') for c in cells) + ' |\n')
    return bool(wrong)


if __name__ == '__main__':
    main()
