"""Levels as people read them: OK, CAUTION, DANGER, NO DATA; files for machines keep theirs."""

import csv
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from cli.here import ugv as here_ugv

from ugv_acceptance.cli.monitor_text import mark
from ugv_acceptance.evaluation.alerts.messages import (
    LEVELS_FOR_PEOPLE,
    level_words,
    pattern_words,
)
from ugv_acceptance.evaluation.alerts.state_machine import LEVELS

MAIN = 'from ugv_acceptance.cli import main; main()'
# A level's name in ROS, as a word of its own: the code INPUT_STALE holds none.
FOR_MACHINES = re.compile(r'\b(WARN|ERROR|STALE)\b')
SITE = """
name: site
version: 1
criteria:
  no danger: {alert: any, level: ERROR, expect: absent}
  a warning: {alert: SLIDE, level: WARN, expect: raised}
"""


def here(*arguments: object) -> str:
    """Run a verb of one process in this one and return what it printed."""
    done = here_ugv(*arguments)
    assert done.returncode != 2, done.stderr
    return done.stdout


def ugv(*arguments: object) -> str:
    """Run the command in a process of its own and return what it printed."""
    command = [sys.executable, '-c', MAIN, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode != 2, done.stderr
    return done.stdout


def words_of(text: str) -> set[str]:
    """Return the levels for people, but OK, that a text names."""
    return set(re.findall(r'\b(CAUTION|DANGER|NO DATA)\b', text))


def test_each_level_has_one_word() -> None:
    """One table, by number and by name; a pattern of a plan keeps code and subject."""
    assert [level_words(k) for k in range(4)] == ['OK', 'CAUTION', 'DANGER', 'NO DATA']
    assert list(LEVELS_FOR_PEOPLE) == list(LEVELS)
    assert level_words('STALE') == 'NO DATA'
    assert pattern_words('ERROR TIP_OVER left') == 'DANGER TIP_OVER left'
    assert pattern_words('WARN') == 'CAUTION'


@pytest.mark.parametrize('level', range(4))
def test_the_live_monitor_shows_the_word(level: int) -> None:
    """In its table and in its lines, all of one width."""
    shown = re.sub(r'\[[^]]*\]', '', mark(level))
    assert (shown.strip(), len(shown)) == (LEVELS_FOR_PEOPLE[LEVELS[level]], 7)


@pytest.mark.parametrize(
    ('name', 'shown'), [('packbot_fail', {'CAUTION', 'DANGER'}), ('packbot_gap', {'NO DATA'})]
)
def test_a_judged_recording_is_told_in_words(
    name: str, shown: set[str], repository: Path, tmp_path: Path
) -> None:
    """Printed, by criteria of a file too, and in the report; JSON and CSV keep the names of ROS."""
    bag, site = repository / 'bags' / name, tmp_path / 'site.yaml'
    site.write_text(SITE)
    files = [tmp_path / name for name in ('r.html', 'r.json', 'm.csv')]
    options = zip(('--report', '--json', '--csv'), files, strict=True)
    printed = here('evaluate', bag, '-v', *(x for pair in options for x in pair))
    judged = here('evaluate', bag, '-v', '--criteria', site)
    for text in (printed, judged, files[0].read_text()):
        assert not FOR_MACHINES.search(text)
        assert words_of(text) >= shown
    levels = {alert['level'] for alert in json.loads(files[1].read_text())['alerts']}
    assert levels == {k for k, word in LEVELS_FOR_PEOPLE.items() if word in shown}
    rows = list(csv.DictReader(files[2].read_text().splitlines()))
    assert not any(words_of(' '.join(map(str, row.values()))) for row in rows)


def test_a_plan_is_told_in_words_and_written_in_those_of_ros(tmp_path: Path) -> None:
    """Table and card say what the monitor will show; the YAML keeps patterns as they are read."""
    plan, card = tmp_path / 'plan.yaml', tmp_path / 'card.html'
    printed = here('plan', '--short', '-o', plan, '--card', card)
    for text in (printed, card.read_text()):
        assert not FOR_MACHINES.search(text)
        assert words_of(text) >= {'CAUTION', 'DANGER'}
    patterns = re.findall(r'^ +- ([A-Z].*)$', plan.read_text(), re.MULTILINE)
    assert any(map(FOR_MACHINES.search, patterns))
    assert not any(map(words_of, patterns))


def test_a_run_is_told_in_words(repository: Path, tmp_path: Path) -> None:
    """What was raised, printed and in the report; its result for machines keeps the names."""
    plan, out = repository / 'bags' / 'packbot_short_plan.yaml', tmp_path / 'out'
    printed = ugv('run', plan, '--sim', '--fast', '--out', out)
    reports = [(out / name).read_text() for name in ('report.txt', 'report.html')]
    for text in (printed, *reports):
        assert not FOR_MACHINES.search(text)
    assert words_of(printed) >= {'CAUTION'}
    steps = json.loads((out / 'result.json').read_text())['steps']
    levels = {alert['level'] for step in steps for alert in step.get('alerts', ())}
    assert levels <= set(LEVELS)
    assert levels


def test_a_recording_is_watched_in_words(repository: Path) -> None:
    """Lines where there is no terminal."""
    printed = ugv('watch', repository / 'bags' / 'packbot_gap')
    assert not FOR_MACHINES.search(printed)
    assert words_of(printed) >= {'NO DATA'}
