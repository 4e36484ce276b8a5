"""What `watch` prints where there is no terminal: a line where something changes."""

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from ugv_acceptance.cli.watch import recording_feed
from ugv_acceptance.config import load
from ugv_acceptance.console import lines
from ugv_acceptance.console.frame import frame_of
from ugv_acceptance.console.lines import BETWEEN, LISTEN, news_of, show_lines
from ugv_acceptance.console.recording import RecordingFeed
from ugv_acceptance.console.snapshot import Snapshot
from ugv_acceptance.monitoring.drawing import figure_of

BAG = Path(__file__).parents[2] / 'bags' / 'packbot_fail'
GAP = BAG.with_name('packbot_gap')


class Clock:
    """A clock that a sleeper moves on: whoever waits on it takes no time."""

    def __init__(self) -> None:
        self.now = 100.0

    def monotonic(self) -> float:
        """Return the time (s)."""
        return self.now

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        self.now += seconds


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """Return the clock by which lines are printed."""
    made = Clock()
    monkeypatch.setattr(lines, 'time', made)
    return made


@pytest.fixture(scope='module')
def played() -> RecordingFeed:
    """Return the run that tips over, evaluated once."""
    return recording_feed(BAG, load())


def told(clock: Clock, feed: RecordingFeed, seconds: float) -> list[tuple[float, str]]:
    """Return when lines came, and the lines, of at most so many seconds."""
    found: list[tuple[float, str]] = []
    end = clock.now + seconds
    show_lines(feed, lambda line: found.append((clock.now, line)), lambda: clock.now > end)
    return found


def test_a_recording_is_told_to_its_end(clock: Clock, played: RecordingFeed) -> None:
    """Levels as on the page, at most one line a second, and it ends with the recording."""
    feed = replace(played, now=clock.monotonic)
    began = clock.now
    found = told(clock, feed, 1000.0)
    assert clock.now - began == pytest.approx(feed.head.duration, abs=2 * LISTEN)
    times = [when for when, _ in found]
    assert all(b - a >= BETWEEN - 1e-9 for a, b in pairwise(times[:-1]))
    # Behind the time: a number of eight places, its unit and two spaces.
    levels = [line[12:19].strip() for _, line in found]
    assert {'NO DATA', 'OK', 'CAUTION', 'DANGER'} >= set(levels) >= {'OK', 'CAUTION', 'DANGER'}
    danger = next(line for _, line in found if line[12:].startswith('DANGER'))
    assert re.search('; [A-Z ]+ by ', danger)


def test_nothing_new_is_no_line(clock: Clock, played: RecordingFeed) -> None:
    """A robot that does not change prints one line in two minutes."""
    feed = replace(played, now=lambda: 0.0)
    assert len(told(clock, feed, 120.0)) == 1


def test_a_gap_is_one_line_without_a_margin_of_now(clock: Clock) -> None:
    """NO DATA: stop first, then what was known last; that it grows older is no news."""
    gap = recording_feed(GAP, load())
    feed = replace(gap, now=clock.monotonic)
    feed.command('seek', {'to_s': 7.0})
    lines = [line[12:] for _, line in told(clock, feed, 8.0)]
    (silent,) = [line for line in lines if line.startswith('NO DATA')]
    assert silent.startswith('NO DATA  STOP: do not move on these numbers; last known ')
    assert silent.count(' deg') == 1
    assert silent.endswith('quality of service (QoS)')


def test_what_is_assumed_is_told_once(clock: Clock, played: RecordingFeed) -> None:
    """What no verdict covers stands behind the first line that has numbers."""
    feed = replace(played, now=clock.monotonic)
    lines = [line for _, line in told(clock, feed, 10.0)]
    assert [('NOT CHECKED' in line) for line in lines].count(True) == 1
    first = next(line for line in lines if '  OK ' in line)
    assert first.endswith('NOT CHECKED: torque of turret, flipper (no limit known)')


def test_the_age_of_a_silence_is_no_news() -> None:
    """A monitor that is silent is told once, not every second."""
    settings = load().settings
    figure = figure_of(settings.robot)
    frames = [frame_of(Snapshot(k, problem=f'silent for {k} s'), settings, figure) for k in (3, 4)]
    assert news_of(frames[0]) == news_of(frames[1])
    other = frame_of(Snapshot(3, problem='no monitor'), settings, figure)
    assert news_of(other) != news_of(frames[0])
