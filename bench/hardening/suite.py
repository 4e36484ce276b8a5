"""Trials that the test suite makes against real ROS, processes and sockets: run and counted."""

import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterable
from importlib.util import find_spec
from pathlib import Path

from hardening.outcome import Outcome

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / 'ugv_acceptance'
# Share (%) of lines and branches that tests must run: of what decides a verdict, and of the rest.
LEAST = dict.fromkeys(('model', 'studies', 'evaluation', 'bag'), 95)
LEAST_ELSEWHERE = 85


def of_tests(*chosen: str, words: str = '') -> Callable[[float], Iterable[Outcome]]:
    """Return a trial that runs these files of test/, limited to tests that match `words`."""

    def run(_share: float) -> Iterable[Outcome]:
        yield passed(chosen, words)

    return run


def passed(chosen: Iterable[str], words: str = '', *options: str) -> Outcome:
    """Run tests and return how many passed as an outcome."""
    command = [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider', *options]
    command += [str(Path('test', name)) for name in chosen]
    command += ['-k', words] if words else []
    env = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=3600, env=env
    )
    counts = re.findall(r'\d+ (?:passed|failed|skipped|error)', done.stdout)
    failed = re.findall(r'^(?:FAILED|ERROR) (\S+)', done.stdout, re.MULTILINE)
    return Outcome('; '.join([', '.join(counts) or 'no test ran', *failed]), done.returncode == 0)


def branches(_share: float) -> Iterable[Outcome]:
    """Measure the coverage of lines and branches of every room, by all tests but the browser's."""
    if find_spec('pytest_cov') is None:
        yield Outcome('needs pytest-cov, which is not installed', None)
        return
    yield passed(['.'], '', '--cov', '--cov-report=', '-n', '3', '--ignore-glob=*test_page_of_*')
    for room in sorted(path.parent.name for path in PACKAGE.glob('*/__init__.py')):
        yield _covered(room)


def _covered(room: str) -> Outcome:
    command = [sys.executable, '-m', 'coverage', 'report', f'--include={PACKAGE / room}/*']
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    found = re.search(r'^TOTAL.* (\d+)%', done.stdout, re.MULTILINE)
    share, least = int(found[1]) if found else 0, LEAST.get(room, LEAST_ELSEWHERE)
    return Outcome(f'{room}/: {share} % of lines and branches, of {least} %', share >= least)
