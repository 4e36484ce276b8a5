"""Measures the error rate: makes runs of a plan, judges them, keeps a line a run, and counts."""

import json
import os
import re
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from error_rate.plan import GOOD, Drawn, Kind, Plan, code_hash
from made.judged import EXIT_2, FAIL, INCONCLUSIVE, PASS, Verdict, judged
from made.run import messages_of, write
from scipy.stats import beta

from ugv_acceptance import AcceptanceError
from ugv_acceptance.processes import Workers

WRONG_PASS, WRONG_FAIL, NOT_PASSED, NOT_FAILED = 'wrong PASS', 'wrong FAIL', 'not passed', 'missed'
# Marks in docs/error_rate.md, between which the table stands.
MARK_BEGIN, MARK_END = '<!-- table -->', '<!-- end of the table -->'
# Runs given to the workers ahead of those that are done.
AHEAD = 8


class OtherResultsError(Exception):
    """A file holds results of another plan, program or maker of runs."""


def wrong(kind: Kind, verdict: str, *, pardoned: bool) -> str:
    """Return what is wrong with a verdict on a run of a kind; '' where it is right.

    'missed' is an event that really happened and came out as INCONCLUSIVE: not right, nor unsafe.
    """
    if verdict in kind.expected.verdicts or (verdict == PASS and pardoned):
        return ''
    if kind.half == GOOD:
        return WRONG_FAIL if verdict == FAIL else NOT_PASSED
    if verdict == PASS:
        return WRONG_PASS
    return WRONG_FAIL if verdict == FAIL else NOT_FAILED


def judge(drawn: Drawn, folder: Path) -> tuple[Verdict, bool]:
    """Write a run's file in `folder` and return its verdict, and whether a PASS is pardoned."""
    made = drawn.made
    path = write(folder / f'{os.getpid()}.mcap', messages_of(made.parts))
    criteria = None
    if made.criteria is not None:
        criteria = folder / f'{os.getpid()}_criteria.yaml'
        criteria.write_text(yaml.safe_dump(dict(made.criteria)), encoding='utf-8')
    verdict = judged(path, made.config, criteria, full=bool(made.pardon))
    pardon = made.pardon and re.search(made.pardon, verdict.told, re.IGNORECASE)
    return verdict, bool(pardon)


def one(number: int, folder: Path) -> dict[str, Any]:
    """Make and judge the run of a number; return its line. What broke off counts as such."""
    start, kind = time.perf_counter(), _plan().kind_of(number)
    line: dict[str, Any] = {'number': number, 'kind': kind.name, 'half': kind.half}
    try:
        drawn = _plan().run(number, folder)
        verdict, pardoned = judge(drawn, folder)
    except AcceptanceError as error:  # a configuration that is refused is a verdict too
        fault = wrong(kind, EXIT_2, pardoned=False)
        return line | {'verdict': EXIT_2, 'wrong': fault, 'reason': str(error)}
    except Exception as error:  # noqa: BLE001 - whatever it is, it is counted, and others go on
        return line | {'verdict': 'broke off', 'wrong': 'broke off', 'reason': repr(error)}
    return line | {
        'robot': drawn.robot,
        'verdict': verdict.word,
        'wrong': wrong(kind, verdict.word, pardoned=pardoned),
        'reason': verdict.reason,
        'truth': drawn.made.truth,
        'numbers': dict(drawn.numbers),
        'seconds': round(time.perf_counter() - start, 3),
    }


_PLANS: list[Plan] = []


def _plan() -> Plan:
    if not _PLANS:
        _PLANS.append(Plan())
    return _PLANS[0]


def head() -> dict[str, str]:
    """Return the first line of a file of results: hashes of plan, program, and maker of runs."""
    return {
        'kinds_sha256': _plan().sha256,
        'program_sha256': code_hash('ugv_acceptance'),
        'maker_sha256': code_hash('test/made', 'test/error_rate'),
    }


def lines_of(path: Path) -> list[dict[str, Any]]:
    """Return the lines of a file of results; a last line that a kill cut short is left out."""
    if not path.exists():
        return []
    texts = path.read_text(encoding='utf-8').splitlines()
    found = [line for line in map(_line, texts) if line]
    if found and found[0] != head():
        msg = f'{path}: expected results of this plan, program and maker of runs; move it away'
        raise OtherResultsError(msg)
    return found[1:]


def _line(text: str) -> dict[str, Any]:
    try:
        read: dict[str, Any] = json.loads(text)
    except json.JSONDecodeError:
        return {}
    return read


def measure(
    path: Path, numbers: Sequence[int], folder: Path, workers: int, told: Callable[[], None]
) -> list[dict[str, Any]]:
    """Judge the runs of `numbers` that the file has not, and return the lines of all of them.

    `told` is called for each run that is done.
    """
    before = lines_of(path)
    done = {line['number'] for line in before}
    rest = [n for n in numbers if n not in done]
    fresh = not path.exists() or path.stat().st_size == 0
    with path.open('a', encoding='utf-8') as file:
        if fresh:
            file.write(json.dumps(head()) + '\n')
        elif not path.read_bytes().endswith(b'\n'):
            file.write('\n')
        for line in _judged(rest, folder, workers):
            file.write(json.dumps(line) + '\n')
            file.flush()
            before.append(line)
            told()
    wanted = set(numbers)
    return [line for line in before if line['number'] in wanted]


def _judged(numbers: Iterable[int], folder: Path, workers: int) -> Iterator[dict[str, Any]]:
    """Yield the lines of runs in the order in which they are done."""
    waiting = iter(numbers)
    with Workers(workers) as pool:
        running = {pool.submit(one, n, folder) for _, n in zip(range(AHEAD), waiting)}  # noqa: B905
        while running:
            finished, running = wait(running, return_when=FIRST_COMPLETED)
            for number in [n for _, n in zip(finished, waiting, strict=False)]:
                running.add(pool.submit(one, number, folder))
            for future in finished:
                yield future.result()


@dataclass(frozen=True, slots=True)
class Count:
    """What came of runs: verdicts, what was wrong with them, and how many there were."""

    name: str
    row: str
    lines: tuple[dict[str, Any], ...]

    def of(self, key: str, value: str) -> int:
        """Return how many lines have this value."""
        return sum(line[key] == value for line in self.lines)

    @property
    def cells(self) -> list[str]:
        """The line of the table: verdicts, what was wrong, and bounds of its rate."""
        n = len(self.lines)
        words = (PASS, FAIL, INCONCLUSIVE, EXIT_2)
        faults = (WRONG_PASS, WRONG_FAIL, NOT_PASSED, NOT_FAILED)
        bad = sum(bool(line['wrong']) for line in self.lines)
        return [
            self.name,
            self.row,
            str(n),
            *(str(self.of('verdict', w)) for w in words),
            *(str(self.of('wrong', w)) for w in faults),
            f'{bad}/{n} <= {upper(bad, n):.2%}' if n else '-',
        ]


HEADINGS = (
    *('kind', 'row', 'n', PASS, FAIL, INCONCLUSIVE, EXIT_2),
    *(WRONG_PASS, WRONG_FAIL, NOT_PASSED, NOT_FAILED, 'wrong, upper 95 % bound'),
)


def upper(count: int, n: int) -> float:
    """Return the exact (Clopper-Pearson) one-sided upper 95 % bound of a rate."""
    return 1.0 if count >= n else float(beta.ppf(0.95, count + 1, n - count))


def table(lines: Sequence[dict[str, Any]]) -> list[str]:
    """Return the table as Markdown: a line a kind, then the three rates that matter."""
    rows = ['| ' + ' | '.join(HEADINGS) + ' |', '|' + '---|' * len(HEADINGS)]
    for kind in _plan().kinds.values():
        own = tuple(line for line in lines if line['kind'] == kind.name)
        if own:
            rows.append('| ' + ' | '.join(Count(kind.name, kind.row, own).cells) + ' |')
    return [*rows, '', *summary(lines)]


def published(page: str, lines: Sequence[dict[str, Any]]) -> str:
    """Return a page of the documentation with the table of these lines between its two marks."""
    before, rest = page.split(MARK_BEGIN)
    after = rest.split(MARK_END)[1]
    named = '\n'.join(f'{key.replace("_", " ")}: `{value}`  ' for key, value in head().items())
    text = '\n'.join(['', f'{len(lines)} runs.', '', named, '', *table(lines), '', ''])
    return before + MARK_BEGIN + text + MARK_END + after


@dataclass(frozen=True, slots=True)
class Rate:
    """Of `runs` runs, `wrong` did what they must not."""

    what: str
    did: str
    runs: int
    wrong: int

    @property
    def line(self) -> str:
        """The rate with its exact upper bound, as a line of a list."""
        bound = f'upper 95 % bound {upper(self.wrong, self.runs):.2%}'
        return f'- {self.runs} {self.what}: {self.wrong} {self.did} ({bound})'

    @property
    def json(self) -> dict[str, Any]:
        """The rate for JSON."""
        most = upper(self.wrong, self.runs)
        return {
            'what': self.what,
            'did': self.did,
            'runs': self.runs,
            'wrong': self.wrong,
            'most': most,
        }


def rates(lines: Sequence[dict[str, Any]]) -> list[Rate]:
    """Return the rates that the goals are about."""
    plan = _plan()
    may_pass = {n for n, k in plan.kinds.items() if PASS in k.expected.verdicts}
    may_fail = {n for n, k in plan.kinds.items() if FAIL in k.expected.verdicts}
    groups: tuple[tuple[str, str, str, set[str], str | None], ...] = (
        ('runs that must not pass', 'passed', WRONG_PASS, may_pass, None),
        ('runs that must not fail', 'failed', WRONG_FAIL, may_fail, None),
        ('good runs', 'not passed', '', set(), GOOD),
    )
    found = []
    for what, did, fault, left_out, half in groups:
        own = [x for x in lines if x['kind'] not in left_out and half in (None, x['half'])]
        bad = sum(bool(x['wrong']) if not fault else x['wrong'] == fault for x in own)
        if own:
            found.append(Rate(what, did, len(own), bad))
    return found


def published_rates(lines: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the rates as the report prints them, with what they were measured on."""
    kinds = len({line['kind'] for line in lines})
    return {**head(), 'kinds': kinds, 'rates': [rate.json for rate in rates(lines)]}


def summary(lines: Sequence[dict[str, Any]]) -> list[str]:
    """Return the rates that the goals are about as lines, and what the runs were of."""
    found = [rate.line for rate in rates(lines)]
    broke = sum(x['wrong'] == 'broke off' for x in lines)
    robots = sorted({x.get('robot', '') for x in lines} - {''})
    return [*found, f'- broke off: {broke}', f'- robots: {", ".join(robots)}']
