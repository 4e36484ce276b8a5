"""The terminal, headless: the same words as the page, by keys alone."""

import asyncio
import math
from dataclasses import replace
from pathlib import Path

import pytest

from ugv_acceptance.cli.watch import recording_feed
from ugv_acceptance.config import Config, load
from ugv_acceptance.console.frame import frame_of
from ugv_acceptance.console.recording import RecordingFeed
from ugv_acceptance.console.snapshot import AlertRow, Snapshot
from ugv_acceptance.console.terminal import Terminal, alerts_of, margins_of, verdict_of
from ugv_acceptance.evaluation.alerts.state_machine import ERROR
from ugv_acceptance.evaluation.ground import GroundWindow
from ugv_acceptance.monitoring.drawing import figure_of

CONFIG: Config = load()
BAG = Path(__file__).parents[2] / 'bags' / 'packbot_fail'


@pytest.fixture
def feed() -> RecordingFeed:
    """Return a recording that stands still at 26 s."""
    made = recording_feed(BAG, CONFIG)
    made.command('pause', {})
    made.command('seek', {'to_s': 26.0})
    return made


def screen(app: Terminal) -> str:
    """Return all text on the screen."""
    return '\n'.join(
        ''.join(segment.text for segment in strip)
        for strip in app.screen._compositor.render_strips()
    )


def test_it_says_what_the_page_says(feed: RecordingFeed) -> None:
    """Word, cause, advice and what is left on the screen are those of the frame."""

    async def look() -> None:
        app = Terminal(feed)
        async with app.run_test(size=(160, 50)) as pilot:
            await pilot.pause()
            frame = frame_of(feed.snapshot(), feed.settings, figure_of(feed.settings.robot))
            shown = ' '.join(screen(app).split())
            for key in ('word', 'cause', 'advice', 'left'):
                assert str(frame[key]) in shown
            assert frame['word'] == 'DANGER'

    asyncio.run(look())


def test_keys_play_and_seek(feed: RecordingFeed) -> None:
    """The right arrow goes a second on, space plays, q leaves."""

    async def use() -> None:
        app = Terminal(feed)
        async with app.run_test(size=(120, 40)) as pilot:
            await pilot.press('right')
            assert feed.head.position == 27.0
            await pilot.press('space')
            assert feed.head.playing
            await pilot.press('q')
            await pilot.pause()
            assert not app.is_running

    asyncio.run(use())


def test_without_data_there_are_no_numbers() -> None:
    """NO DATA shows the word and not one margin."""
    frame = frame_of(Snapshot(1), CONFIG.settings, figure_of(CONFIG.settings.robot))
    assert 'NO DATA' in verdict_of(frame).plain
    cells = [list(column.cells) for column in margins_of(frame).columns[:3]]
    assert cells == [['NO DATA']] * 3


def test_names_are_no_markup() -> None:
    """What looks like markup in an alert is shown as it is written."""
    row = AlertRow('k', 'CLOCK', 'imu', ERROR, 'active', '[red]x[/red]', '[b]do[/b]', 0)
    snapshot = replace(Snapshot(1), alerts=(row,))
    frame = frame_of(snapshot, CONFIG.settings, figure_of(CONFIG.settings.robot))
    shown = [str(next(iter(column.cells))) for column in alerts_of(frame).columns]
    assert shown[1:3] == ['[red]x[/red]', '[b]do[/b]']
    assert '[red]x[/red]' in verdict_of(frame).plain


def test_the_ground_stands_above_the_tilt_left(feed: RecordingFeed) -> None:
    """The kind of ground is told; on stairs each number of degrees is at most so much."""

    def cells(snapshot: Snapshot) -> list[list[str]]:
        frame = frame_of(snapshot, feed.settings, figure_of(feed.settings.robot))
        table = margins_of(frame)
        return [[str(cell) for cell in column.cells] for column in table.columns[:2]]

    names, now = cells(feed.snapshot())
    assert (names[0], now[0]) == ('ground', 'flat (not entered)')
    assert not any('at most' in text for text in now)
    _, now = cells(replace(feed.snapshot(), ground='stairs', rough=True))
    assert now[0] == 'stairs'
    assert any(text.startswith('at most ') for text in now)


def test_a_recording_shows_the_ground_of_each_moment() -> None:
    """In a window on stairs a recording shows an upper bound and the cautious margin."""
    windows = (GroundWindow('stairs', 2.0, 5.0),)
    ground = replace(CONFIG.settings.ground, windows=windows)
    made = recording_feed(BAG, replace(CONFIG, settings=replace(CONFIG.settings, ground=ground)))
    made.command('pause', {})
    for at, words, rough in ((1.0, 'flat (not entered)', False), (3.0, 'stairs', True)):
        made.command('seek', {'to_s': at})
        shown = made.snapshot()
        assert (shown.ground, shown.rough) == (words, rough)
        assert math.isfinite(shown.cautious) == rough
