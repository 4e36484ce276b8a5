"""The terminal, headless: the same words as the page, by keys alone."""

import asyncio
import math
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest
from textual.pilot import Pilot
from textual.widgets import Input

from ugv_acceptance import BadSample
from ugv_acceptance.cli.watch import recording_feed
from ugv_acceptance.config import Config, load
from ugv_acceptance.console.frame import Plain, frame_of
from ugv_acceptance.console.recording import RecordingFeed
from ugv_acceptance.console.snapshot import AlertRow, Snapshot
from ugv_acceptance.console.terminal import Terminal
from ugv_acceptance.console.terminal_text import cards_of, headline_of, margins_of, now_of
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, LEVELS, WARN
from ugv_acceptance.evaluation.ground import GroundWindow
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.monitoring.drawing import figure_of

CONFIG: Config = load()
BAG = Path(__file__).parents[2] / 'bags' / 'packbot_fail'
# A small terminal, as over SSH.
SMALL = (80, 24)
Look = Callable[[Pilot[None]], Awaitable[None]]


@pytest.fixture(scope='module')
def evaluated() -> RecordingFeed:
    """Return a recording that stands still."""
    made = recording_feed(BAG, CONFIG)
    made.command('pause', {})
    return made


@pytest.fixture
def feed(evaluated: RecordingFeed) -> RecordingFeed:
    """Return a recording that stands still at 26 s."""
    evaluated.command('pause', {})
    evaluated.command('seek', {'to_s': 26.0})
    return evaluated


@dataclass
class Robot:
    """A live robot that stands as a recording does, and a monitor that takes every command."""

    recording: RecordingFeed
    settings: Settings = CONFIG.settings
    told: list[tuple[str, dict[str, Any]]] = field(default_factory=list)

    def describe(self) -> dict[str, Any]:
        """Say that it is live."""
        return {'source': 'live', 'title': 'live'}

    def snapshot(self) -> Snapshot:
        """Return what the recording shows; its cautions may be shelved."""
        shown = self.recording.snapshot()
        offers = {WARN: ('acknowledge', 'shelve'), ERROR: ('acknowledge',)}
        alerts = [replace(row, offers=offers.get(row.level, ())) for row in shown.alerts]
        return replace(shown, source='live', alerts=tuple(alerts))

    def extra(self) -> dict[str, Any]:
        """Add nothing."""
        return {}

    def command(self, do: str, values: dict[str, Any]) -> str:
        """Note a command; refuse to reset."""
        self.told.append((do, values))
        if do == 'reset':
            raise BadSample('refused: reset: TIP_OVER right (DANGER) is active')
        return f'done: {do}'


def use(app: Terminal, look: Look, size: tuple[int, int] = SMALL) -> None:
    """Do something with the terminal on."""

    async def run() -> None:
        async with app.run_test(size=size) as pilot:
            await pilot.pause()
            await look(pilot)

    asyncio.run(run())


async def answer(pilot: Pilot[None], text: str) -> None:
    """Type a line that was asked for."""
    pilot.app.screen.query_one(Input).value = text
    await pilot.press('enter')


def screen(app: Terminal) -> str:
    """Return all text on the screen."""
    return '\n'.join(
        ''.join(segment.text for segment in strip)
        for strip in app.screen._compositor.render_strips()
    )


def frame_now(feed: RecordingFeed) -> Plain:
    """Return the frame of this moment."""
    return frame_of(feed.snapshot(), feed.settings, figure_of(feed.settings.robot))


def test_a_small_terminal_shows_what_matters(feed: RecordingFeed) -> None:
    """At 80 x 24: the headline of the frame, every tilt, the worst joint, the first card."""
    app = Terminal(feed)

    async def look(_: Pilot[None]) -> None:
        frame = frame_now(feed)
        head, shown = frame['headline'], ' '.join(screen(app).split())
        for words in (frame['word'], head['what'], head['number'], head['action'], head['detail']):
            assert words
            assert str(words) in shown
        for row in frame['tilt']:
            assert f'{row["side"].upper()} {row["words"]}'.replace('T -', 'T !! -') in shown
        worst = frame['torque'][frame['worst_joint']]
        assert f'{worst["words"]} of its limit' in shown
        assert frame['cards'][0]['title'] in shown
        # The cause is said once, though the first card has it too.
        assert shown.count(head['cause'].partition(';')[0]) == 1

    use(app, look)


def test_a_recording_is_played_by_keys_and_takes_no_commands(feed: RecordingFeed) -> None:
    """The right arrow goes a second on, space plays, q leaves; what is live is not offered."""
    app = Terminal(feed)

    async def look(pilot: Pilot[None]) -> None:
        assert 'Acknowledge' not in screen(app)
        for key in 'asurpgn1':
            await pilot.press(key)
        assert (app.said, app.chosen, len(app.screen_stack)) == ('', None, 1)
        await pilot.press('right')
        assert feed.head.position == 27.0
        await pilot.press('space')
        assert feed.head.playing
        await pilot.press('q')
        await pilot.pause()
        assert not app.is_running

    use(app, look)


def test_an_operator_tells_the_monitor_by_keys(feed: RecordingFeed) -> None:
    """Each key is a command with name and note; the note counts once; the answer is shown."""
    robot = Robot(feed)
    app = Terminal(robot, who='Ada')
    signed = {'by': 'Ada', 'note': ''}

    async def look(pilot: Pilot[None]) -> None:
        await pilot.press('a')
        assert robot.told.pop() == ('acknowledge', signed)
        await pilot.pause()
        assert 'done: acknowledge' in screen(app)
        await pilot.press('n')
        await answer(pilot, 'Bob')
        await answer(pilot, 'seen')
        await pilot.press('2', 'a')
        second = app.frame['cards'][1]
        seen = {'keys': second['keys'], 'by': 'Bob', 'note': 'seen'}
        assert robot.told.pop() == ('acknowledge', seen)
        await pilot.press('s')
        shelved = next(card for card in app.frame['cards'] if 'shelve' in card['offers'])
        assert robot.told.pop() == ('shelve', {**seen, 'keys': shelved['keys'], 'note': ''})
        await pilot.press('u')
        assert (robot.told, app.said) == ([], 'unshelve: no alert offers that now')
        await pilot.press('r')
        assert app.said == 'refused: reset: TIP_OVER right (DANGER) is active'

    use(app, look)


def test_load_and_ground_are_asked_for(feed: RecordingFeed) -> None:
    """A load is typed with its unit, the ground chosen by its letter; a wrong one is not sent."""
    robot = Robot(feed)
    app = Terminal(robot, who='Ada')

    async def look(pilot: Pilot[None]) -> None:
        await pilot.press('p')
        await answer(pilot, '2.5kg 10cm,0,0')
        assert robot.told.pop()[1] == {
            'mass_kg': 2.5, 'cog_m': [0.1, 0.0, 0.0], 'by': 'Ada', 'note': ''
        }  # fmt: skip
        await pilot.press('p')
        await answer(pilot, 'much')
        assert not robot.told
        assert app.said.startswith('load: expected')
        await pilot.press('g', 's')
        assert robot.told.pop()[1]['kind'] == 'stairs'
        await pilot.press('g', 'down', 'enter')
        assert robot.told.pop()[1]['kind'] == 'uneven'
        await pilot.press('g', 'escape', 'p', 'escape')
        assert not robot.told
        assert len(app.screen_stack) == 1

    use(app, look)


def test_colour_is_for_the_abnormal_and_not_with_no_color(
    feed: RecordingFeed, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At OK the headline is grey; with NO_COLOR nothing on the screen has a colour."""

    def coloured(app: Terminal, y: int) -> bool:
        strip = app.screen._compositor.render_strips()[y]
        styles = [s.style for s in strip if s.style is not None and s.text.strip()]
        found = [c.get_truecolor() for s in styles for c in (s.color, s.bgcolor) if c]
        return any(max(c) - min(c) > 60 for c in found)

    def seen(at: float) -> bool:
        feed.command('seek', {'to_s': at})
        app, found = Terminal(feed), list[bool]()

        async def look(_: Pilot[None]) -> None:
            found.append(coloured(app, 0))

        use(app, look)
        return found[0]

    monkeypatch.delenv('NO_COLOR', raising=False)
    assert (seen(5.0), seen(26.0)) == (False, True)
    monkeypatch.setenv('NO_COLOR', '1')
    assert not seen(26.0)


@pytest.mark.parametrize('at', [5.0, 26.0])
def test_a_plain_terminal_gets_ascii_only(feed: RecordingFeed, at: float) -> None:
    """Where a terminal has no UTF-8 nothing else is drawn; else OK has a check mark."""
    feed.command('seek', {'to_s': at})
    plain, usual = Terminal(feed, plain=True), Terminal(feed)

    async def look(_: Pilot[None]) -> None:
        assert screen(plain).isascii()

    async def check(_: Pilot[None]) -> None:
        assert ('\N{CHECK MARK} OK' in screen(usual)) == (at == 5.0)

    use(plain, look)
    use(usual, check)


def test_without_data_there_are_no_numbers() -> None:
    """NO DATA says the word and to stop, and not one margin."""
    frame = frame_of(Snapshot(1), CONFIG.settings, figure_of(CONFIG.settings.robot))
    said = headline_of(frame, plain=True).plain
    assert 'NO DATA' in said
    assert 'STOP' in said
    assert not any(letter.isdigit() for letter in now_of(frame).plain)
    cells = [list(column.cells) for column in margins_of(frame).columns[:3]]
    assert cells == [['NO DATA']] * 3


def test_names_are_no_markup() -> None:
    """What looks like markup in an alert is shown as it is written."""
    row = AlertRow('k', 'CLOCK', 'imu', ERROR, 'active [i]', '[red]x[/red]', '[b]do[/b]', 0)
    snapshot = replace(Snapshot(1), alerts=(row,))
    frame = frame_of(snapshot, CONFIG.settings, figure_of(CONFIG.settings.robot))
    assert '[red]x[/red]' in headline_of(frame, plain=True).plain
    assert 'active [i]' in cards_of(frame).plain


def test_the_seconds_to_a_limit_and_the_lamps_are_shown(feed: RecordingFeed) -> None:
    """How long until it tips is a number beside the headline; running time and black box below."""
    snapshot = feed.snapshot()
    frame = frame_of(snapshot, feed.settings, figure_of(feed.settings.robot))
    frame |= {'seconds': 4.23, 'seconds_to': 'tipping RIGHT', 'level': LEVELS[WARN]}
    assert '4.2 s to tipping RIGHT' in headline_of(frame, plain=False).plain


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
        frame = frame_now(made)
        assert ('FRONT <=' in now_of(frame).plain) == rough
