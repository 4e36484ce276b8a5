"""What `watch` prints where there is no terminal: a line where something changes."""

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from ugv_acceptance.cli.watch import recording_feed
from ugv_acceptance.config import load
from ugv_acceptance.console import lines
from ugv_acceptance.console.lines import BETWEEN, LISTEN, show_lines
from ugv_acceptance.console.recording import RecordingFeed

BAG = Path(__file__).parents[2] / 'bags' / 'packbot_fail'


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


def told(clock: Clock, feed: RecordingFeed, seconds: float) -> list[tuple[float, str]]:
    """Return when lines came, and the lines, of at most so many seconds."""
    found: list[tuple[float, str]] = []
    end = clock.now + seconds
    show_lines(feed, lambda line: found.append((clock.now, line)), lambda: clock.now > end)
    return found


def test_a_recording_is_told_to_its_end(clock: Clock) -> None:
    """Levels as on the page, at most one line a second, and it ends with the recording."""
    feed = replace(recording_feed(BAG, load()), now=clock.monotonic)
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


def test_nothing_new_is_no_line(clock: Clock) -> None:
    """A robot that does not change for an hour prints one line."""
    feed = replace(recording_feed(BAG, load()), now=lambda: 0.0)
    assert len(told(clock, feed, 600.0)) == 1
