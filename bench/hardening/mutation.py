"""Mutation testing of model/ and evaluation/: one change at a time, and whether tests notice it.

`python -m bench.hardening.mutation --count 300 --seed 0 [PATTERN ...]` draws mutants from all files
that match, prints each survivor and a table. First all tests run once to learn which ran what line;
a mutant is then tried in a forked copy of this process by the tests that ran its line, those of its
own file first, then the quickest, until one fails or PATIENCE of them passed. So what is said to
survive may still be noticed by a slower test: the rate is a lower bound.
"""

import argparse
import hashlib
import json
import os
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from fnmatch import fnmatch
from functools import partial
from importlib import import_module
from itertools import accumulate
from pathlib import Path
from random import Random
from typing import Any

import coverage
import hypothesis
import pytest

from bench.hardening.mutants import EQUIVALENT, Mutant, mutants, mutated

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = 'ugv_acceptance'
FILES = ('model/*.py', 'evaluation/**/*.py')
# A part for each job; what a mutant is tried by is chosen among these.
TESTS = (
    ('test/model', 'test/studies'),
    ('test/evaluation',),
)
PARTS = (PACKAGE, 'test', 'msg_configs', 'urdf', 'bags', 'docs')
# Seconds of tests that a mutant is tried by, and seconds after which it hangs.
PATIENCE, HANGS = 40.0, 90.0
OPTIONS = ('-q', '-x', '-p', 'no:cacheprovider', '-p', 'no:xdist')
PROFILE = '--hypothesis-profile=mutants'
# What tests import before they begin: paid for once, before the forks.
COMMON = ('config', 'bag', 'evaluation.live', 'simulation.scenarios')

Lines = dict[str, list[str]]  # line -> the tests that ran it


@dataclass(slots=True)
class Seen:
    """A pytest plugin: seconds of each test, and the context of coverage while it runs."""

    measured: coverage.Coverage
    seconds: dict[str, float] = field(default_factory=dict)

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        """Name the context after the test."""
        start = time.perf_counter()
        self.measured.switch_context(item.nodeid)
        yield
        self.measured.switch_context('')
        self.seconds[item.nodeid] = time.perf_counter() - start


@dataclass(frozen=True, slots=True)
class Reach:
    """The tests that ran each line of a file, and how long each takes."""

    tests: Mapping[str, Lines]
    seconds: dict[str, float]

    def of(self, mutant: Mutant) -> list[str]:
        """Return the tests to try a mutant with, its file's own first, then the quickest."""
        by_line = self.tests.get(mutant.file, {})
        lines = [str(line) for line in mutant.lines if any(by_line.get(str(line), ()))]
        ran = {test for line in lines or by_line for test in by_line[line] if test}
        found = ran or set(self.seconds)  # of a file without functions only imports ran a line
        own = f'/test_{Path(mutant.file).stem}.py::'
        ordered = sorted(found, key=lambda test: (own not in test, self.seconds[test]))
        total = accumulate(self.seconds[test] for test in ordered)
        return [test for test, sum_ in zip(ordered, total, strict=True) if sum_ < PATIENCE]


def copied(folder: Path) -> Path:
    """Return a copy of the files that the tests need."""
    for part in PARTS:
        shutil.copytree(ROOT / part, folder / part)
    shutil.copy(ROOT / 'pyproject.toml', folder)
    return folder


def forked(work: Callable[[], int], copy: Path) -> int:
    """Start `work` in a forked copy of this process and of the code; return its process id."""
    pid = os.fork()
    if pid:
        return pid
    code = 70
    try:
        os.setsid()
        out = os.open(copy / 'log', os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(out, 1)
        os.dup2(out, 2)
        os.chdir(copy)
        sys.path[:0] = [str(copy)]
        code = work()
    finally:
        os._exit(code)


def learn(copies: list[Path], cache: Path) -> Reach:
    """Run all tests once and return which lines each ran; exit where one fails."""
    if cache.exists():
        return Reach(*json.loads(cache.read_text('utf-8')))
    pairs = list(zip(copies, TESTS, strict=False))
    started = [(forked(partial(measure, copy, chosen), copy), copy) for copy, chosen in pairs]
    tests, seconds = defaultdict[str, Lines](lambda: defaultdict(list)), dict[str, float]()
    for pid, copy in started:
        if os.waitpid(pid, 0)[1]:
            raise SystemExit(f'tests fail without a mutant: {(copy / "log").read_text("utf-8")}')
        seconds |= json.loads((copy / 'seconds').read_text('utf-8'))
        ran = coverage.CoverageData(str(copy / '.coverage'))
        ran.read()
        for file in ran.measured_files():
            lines = tests[str(Path(file).relative_to(copy / PACKAGE))]
            for line, names in ran.contexts_by_lineno(file).items():
                lines[str(line)] += names
    cache.parent.mkdir(parents=True, exist_ok=True)
    cache.write_text(json.dumps((tests, seconds)), 'utf-8')
    return Reach(tests, seconds)


def measure(copy: Path, chosen: Iterable[str]) -> int:
    """Run a part of the tests under coverage and write which lines each ran."""
    measured = coverage.Coverage(str(copy / '.coverage'), source=[PACKAGE], config_file=False)
    seen = Seen(measured)
    measured.start()
    code = pytest.main([*OPTIONS, PROFILE, *chosen], plugins=[seen])
    measured.stop()
    measured.save()
    (copy / 'seconds').write_text(json.dumps(seen.seconds), 'utf-8')
    return int(code)


def state() -> str:
    """Return a hash of the code and the tests as they stand."""
    paths = sorted(path for part in PARTS[:2] for path in (ROOT / part).rglob('*.py'))
    return hashlib.sha256(b''.join(path.read_bytes() for path in paths)).hexdigest()[:16]


def trial(copy: Path, mutant: Mutant, tests: list[str]) -> tuple[int, Callable[[], None]]:
    """Start the tests of a mutant; return the process id and a function that undoes the change."""
    path = copy / PACKAGE / mutant.file
    whole = path.read_text('utf-8')
    path.write_text(mutated(whole, mutant.place), 'utf-8')

    def work() -> int:
        sys.dont_write_bytecode = True
        resource.setrlimit(resource.RLIMIT_AS, (6 << 30, 6 << 30))
        return int(pytest.main([*OPTIONS, PROFILE, *tests]))

    def undo() -> None:
        path.write_text(whole, 'utf-8')

    return forked(work, copy), undo


def killed(copies: list[Path], waiting: list[Mutant], reach: Reach) -> Iterator[tuple[Mutant, int]]:
    """Try mutants, one in each copy at a time; yield each with the exit code of its tests."""
    running = dict[int, tuple[Mutant, Path, Callable[[], None], float]]()
    free, waiting = list(copies), list(waiting)
    try:
        while waiting or running:
            while waiting and free:
                mutant = waiting.pop(0)
                if not (tests := reach.of(mutant)):
                    yield mutant, 0
                    continue
                copy = free.pop()
                pid, undo = trial(copy, mutant, tests)
                running[pid] = mutant, copy, undo, time.monotonic() + HANGS
            for pid, (mutant, copy, undo, end) in list(running.items()):
                done, status = os.waitpid(pid, os.WNOHANG)
                if not done and time.monotonic() > end:  # a loop without end is noticed
                    os.killpg(pid, signal.SIGKILL)
                    done, status = os.waitpid(pid, 0)
                if done:
                    del running[pid]
                    undo()
                    free.append(copy)
                    yield mutant, status
            time.sleep(0.005)
    finally:
        for pid in running:
            os.killpg(pid, signal.SIGKILL)


def ready() -> None:
    """Import what tests import, except our own modules, which a mutant's process reads anew."""
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    settings: dict[str, Any] = {'deadline': None, 'derandomize': True, 'database': None}
    phases = (hypothesis.Phase.explicit, hypothesis.Phase.generate)
    hypothesis.settings.register_profile('mutants', phases=phases, **settings)
    for name in COMMON:
        import_module(f'{PACKAGE}.{name}')
    for name in [name for name in sys.modules if name.split('.')[0] == PACKAGE]:
        del sys.modules[name]


def drawn(patterns: Iterable[str], count: int, seed: int) -> list[Mutant]:
    """Return `count` mutants of the files that match, drawn at random from all of them."""
    folder = ROOT / PACKAGE
    names = sorted(str(path.relative_to(folder)) for path in folder.rglob('*.py'))
    chosen = [name for name in names if any(fnmatch(name, pattern) for pattern in patterns)]
    every = [m for name in chosen for m in mutants(name, (folder / name).read_text('utf-8'))]
    every = [m for m in every if (m.file, m.function, m.change) not in EQUIVALENT]
    Random(seed).shuffle(every)
    return every[:count]


def try_some(
    patterns: Iterable[str] = FILES, count: int = 300, seed: int = 0
) -> dict[str, tuple[int, int]]:
    """Try mutants drawn at random; print survivors; return (killed, tried) of each file."""
    tried, dead = Counter[str](), Counter[str]()
    waiting = drawn(patterns, count, seed)
    ready()
    with tempfile.TemporaryDirectory() as folder:
        copies = [copied(Path(folder).resolve() / str(k)) for k in range(len(TESTS))]
        reach = learn(copies, ROOT / 'out' / 'mutation' / f'{state()}.json')
        with suppress(KeyboardInterrupt):  # what was tried until then is told
            for mutant, status in killed(copies, waiting, reach):
                tried[mutant.file] += 1
                dead[mutant.file] += status != 0
                if not status:
                    print(f'survived: {mutant.text}', file=sys.stderr, flush=True)
                if tried.total() % 50 == 0:
                    print(f'{tried.total()} of {len(waiting)} tried', file=sys.stderr, flush=True)
    return {file: (dead[file], tried[file]) for file in sorted(tried)}


def main() -> None:
    """Print survivors, the table, and what was left out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('patterns', nargs='*', default=FILES, help='such as model/hull.py')
    parser.add_argument('--count', type=int, default=300)
    parser.add_argument('--seed', type=int, default=0)
    asked = parser.parse_args()
    start = time.monotonic()
    found = try_some(asked.patterns, asked.count, asked.seed)
    found['all'] = tuple(map(sum, zip(*found.values(), strict=True)))  # type: ignore[assignment]
    print('| file | killed | of | share |\n|---|---|---|---|')
    for file, (dead, tried) in found.items():
        print(f'| {file} | {dead} | {tried} | {dead / tried:.0%} |')
    print(f'{time.monotonic() - start:.0f} s; left out as equivalent:')
    for (file, function, change), why in EQUIVALENT.items():
        print(f'{file} {function}: {change}: {why}')


if __name__ == '__main__':
    main()
