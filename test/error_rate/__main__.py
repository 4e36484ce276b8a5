"""Measures how often a verdict is wrong: `make error-rate`, or `python test/error_rate`.

Runs are made by kinds.yaml, half faulted and half good, and judged; every result is a line of
out/error_rate/results.jsonl. A run that is broken off goes on where it was. `--short` makes one run
of each kind. The exit code is 1 where any verdict was wrong.
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / 'test'), str(ROOT)]
from error_rate import measure  # noqa: E402 (the helpers are on the path now)
from error_rate.plan import Plan, short_of  # noqa: E402
from made.subjects import ROBOTS  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.progress import MofNCompleteColumn, Progress, TimeElapsedColumn  # noqa: E402

from ugv_acceptance.report.error_rate import FILE  # noqa: E402

RESULTS = ROOT / 'out' / 'error_rate' / 'results.jsonl'
# Exit codes: a verdict was wrong; the file of results is of something else; Ctrl-C.
MISSED, OTHER, STOPPED = 1, 2, 130


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(prog='error_rate', description=__doc__)
    parser.add_argument('--runs', type=int, default=4000, help='how many, half of them faulted')
    parser.add_argument('--short', action='store_true', help='one run of each kind')
    parser.add_argument('--each', type=int, default=1, help='with --short: so many of each kind')
    parser.add_argument('--out', type=Path, default=RESULTS, help='file of results (JSON lines)')
    parser.add_argument('--workers', type=int, default=2, help='processes')
    parser.add_argument(
        '--write', action='store_true', help='put the table into docs and the report'
    )
    parser.add_argument('--show', type=int, default=20, help='wrong verdicts that are listed')
    asked = parser.parse_args()
    plan, console = Plan(), Console(soft_wrap=True, highlight=False)
    numbers = short_of(plan, asked.each) if asked.short else list(range(asked.runs))
    out = asked.out.with_stem('short') if asked.short and asked.out == RESULTS else asked.out
    out.parent.mkdir(parents=True, exist_ok=True)
    console.print(f'kinds.yaml, SHA-256 {plan.sha256}, seed {plan.content["seed"]}', markup=False)
    if not ROBOTS.is_dir():
        console.print(f'NOT HERE: {ROBOTS}; PackBot alone, no wheeled robots of others')
    try:
        lines = run(numbers, out, asked.workers, console)
    except measure.OtherResultsError as error:
        console.print(str(error), markup=False)
        raise SystemExit(OTHER) from None
    except KeyboardInterrupt:
        console.print(f'stopped; the same command goes on: {out}', markup=False)
        raise SystemExit(STOPPED) from None
    for text in measure.table(lines):
        console.print(text, markup=False)
    if asked.write:
        page = ROOT / 'docs' / 'error_rate.md'
        text = measure.published(page.read_text(encoding='utf-8'), lines)
        page.write_text(text, encoding='utf-8')
        told = json.dumps(measure.published_rates(lines), indent=2)
        (ROOT / 'ugv_acceptance' / 'report' / FILE).write_text(told + '\n', encoding='utf-8')
    bad = [line for line in lines if line['wrong']]
    for line in bad[: asked.show]:
        console.print(
            f'{line["number"]} {line["kind"]} {line.get("robot", "")}: {line["wrong"]}, '
            f'{line["verdict"]}: {line["reason"]}',
            markup=False,
        )
    raise SystemExit(MISSED if bad else 0)


def run(numbers: list[int], out: Path, workers: int, console: Console) -> list[dict[str, object]]:
    """Judge the runs with a bar that shows how far it is."""
    columns = (*Progress.get_default_columns(), MofNCompleteColumn(), TimeElapsedColumn())
    there = len({x['number'] for x in measure.lines_of(out)} & set(numbers))
    with (
        tempfile.TemporaryDirectory(prefix='ugv_acceptance_error_rate_') as folder,
        Progress(*columns, console=console, disable=not console.is_terminal) as bar,
    ):
        task = bar.add_task('runs', total=len(numbers), completed=there)
        return measure.measure(out, numbers, Path(folder), workers, lambda: bar.advance(task))


if __name__ == '__main__':
    main()
