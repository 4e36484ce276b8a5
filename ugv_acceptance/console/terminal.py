"""The console in a terminal, drawn by Textual from the same frames as the page."""

from collections.abc import Callable
from typing import Any, ClassVar

from rich.table import Table
from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.widgets import Footer, Static

from ugv_acceptance import BadSample
from ugv_acceptance.console.frame import Plain, frame_of
from ugv_acceptance.console.snapshot import Feed
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, LEVELS, OK, STALE, WARN
from ugv_acceptance.monitoring.drawing import figure_of

# Seconds between drawings: a terminal over SSH shows no more. A feed is asked more often, as by a
# page: it judges silence by when it was asked.
PERIOD = 0.2
LISTEN = 0.05
# Level -> style and sign: colour is never the only sign.
LOOKS = {
    LEVELS[OK]: ('bold white on dark_green', '(OK)'),
    LEVELS[WARN]: ('bold black on yellow', '/!\\'),
    LEVELS[ERROR]: ('bold white on dark_red', '<!>'),
    LEVELS[STALE]: ('bold black on grey70', '[?]'),
}
_BAR = 20


class Terminal(App[None]):
    """Shows a feed until the user leaves or `asked` to end; `frame` is the one shown now."""

    CSS = """
    #verdict { height: auto; min-height: 4; padding: 0 1; }
    #alerts, #margins, #inputs { height: auto; padding: 1 1 0 1; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding('a', 'ask("acknowledge")', 'Acknowledge all'),
        Binding('r', 'ask("reset")', 'Reset'),
        Binding('space', 'play', 'Play/pause'),
        Binding('left', 'jump(-1)', '-1 s'),
        Binding('right', 'jump(1)', '+1 s'),
        Binding('q', 'quit', 'Leave'),
        # A terminal in use by Textual sends no signal for it.
        Binding('ctrl+c', 'quit', 'Leave', show=False, priority=True),
    ]

    def __init__(self, feed: Feed, asked: Callable[[], bool] = lambda: False) -> None:
        super().__init__()
        self.feed, self._asked = feed, asked
        self.frame: Plain = {}
        self.said = ''
        self._figure = figure_of(feed.settings.robot)
        self._snapshot = feed.snapshot()
        self._live = bool(feed.describe()['source'] == 'live')

    def compose(self) -> ComposeResult:
        """Yield the widgets of the screen."""
        yield Static(id='verdict')
        with VerticalScroll():
            yield Static(id='alerts')
            yield Static(id='margins')
            yield Static(id='inputs')
        yield Footer()

    def on_mount(self) -> None:
        """Draw now, and again every PERIOD (s)."""
        self.title = str(self.feed.describe()['title'])
        self._draw()
        self.set_interval(LISTEN, self._listen)
        self.set_interval(PERIOD, self._draw)

    def check_action(
        self,
        action: str,
        parameters: tuple[object, ...],  # noqa: ARG002 - Textual's signature
    ) -> bool:
        """Return whether the current feed supports an action."""
        if action == 'ask':
            return self._live
        if action in {'play', 'jump'}:
            return not self._live
        return True

    def action_ask(self, do: str) -> None:
        """Send a command about alerts to the monitor."""
        self._command(do, {})

    def action_play(self) -> None:
        """Play or pause a recording."""
        self._command('pause' if self.frame['playback']['playing'] else 'play', {})

    def action_jump(self, seconds: int) -> None:
        """Go some seconds forward or back in a recording."""
        self._command('seek', {'to_s': self.frame['playback']['position_s'] + seconds})

    def _command(self, do: str, values: dict[str, Any]) -> None:
        try:
            self.said = self.feed.command(do, values)
        except BadSample as error:
            self.said = str(error)
        self._listen()
        self._draw()

    def _listen(self) -> None:
        if self._asked():
            self.exit()
        self._snapshot = self.feed.snapshot()

    def _draw(self) -> None:
        frame = frame_of(self._snapshot, self.feed.settings, self._figure) | self.feed.extra()
        self.frame = frame
        self.query_one('#verdict', Static).update(verdict_of(frame, self.said))
        self.query_one('#alerts', Static).update(alerts_of(frame))
        self.query_one('#margins', Static).update(margins_of(frame))
        self.query_one('#inputs', Static).update(inputs_of(frame))


def verdict_of(frame: Plain, said: str = '') -> Text:
    """Return the verdict as text: word, sign, cause, advice, remaining margins."""
    style, sign = LOOKS[frame['level']]
    text = Text()
    text.append(f' {sign} {frame["word"]} {sign} ', style)
    text.append(f'  {where_of(frame)}{said}\n', 'dim')
    text.append(f'{frame["cause"]}\n', 'bold')
    if frame['advice']:
        text.append(f'DO: {frame["advice"]}\n')
    if frame['left']:
        text.append(f'now: {frame["left"]}')
    return text


def where_of(frame: Plain) -> str:
    """Return the position in a recording as text; '' for a live robot."""
    head = frame.get('playback')
    if head is None:
        return ''
    return f'{head["position_s"]:.1f} s{"" if head["playing"] else ", paused"}  '


def alerts_of(frame: Plain) -> Table:
    """Return the alerts as a table: level, text, advice, state."""
    table = Table('Alert', 'What', 'What to do', 'State', box=None, expand=True, padding=(0, 1))
    for row in frame['alerts']:
        word = Text(str(row['word']), LOOKS[row['level']][0])
        # Texts, so that no name is taken for markup.
        cells = [Text(str(row[key])) for key in ('text', 'advice', 'state')]
        table.add_row(word, *cells)
    if not frame['alerts']:
        table.add_row('none', '', '', '')
    return table


def margins_of(frame: Plain) -> Table:
    """Return torques and tilt left as a table; empty where the margins are not known."""
    table = Table('Margin', 'Now', 'Limit', '', box=None, padding=(0, 1))
    if frame['level'] == LEVELS[STALE]:
        table.add_row(*([frame['word']] * 3))
        return table
    ground = frame['ground']
    if ground['words']:
        table.add_row('ground', Text(str(ground['words'])), '', '')
    for row in frame['tilt']:
        left = row['left_deg']
        most = 'at most ' if ground['rough'] else ''
        now = 'no edge' if left is None else f'{most}{left:.1f} deg left'
        table.add_row(f'tip to the {row["side"]}', now, '', '')
    for row in frame['torque']:
        if row['limit'] is not None and row['use'] is not None:
            bar = '#' * min(_BAR, round(row['use'] * _BAR))
            cells = (
                f'{row["torque"]:.1f}',
                f'{row["limit"]:g}',
                f'{bar:.<{_BAR}} {row["use"]:.0%}',
            )
            table.add_row(Text(str(row['joint'])), *cells)
    return table


def inputs_of(frame: Plain) -> Table:
    """Return the inputs as a table."""
    table = Table('Input', 'State', 'Rate', 'Published by', box=None, padding=(0, 1))
    for row in frame['inputs']:
        state = row['text'] or ('arriving' if row['level'] == LEVELS[OK] else 'silent')
        rate = '-' if row['rate_hz'] is None else f'{row["rate_hz"]:.0f} Hz'
        cells = (row['topic'], state, rate, ', '.join(row['publishers']))
        table.add_row(*(Text(str(cell)) for cell in cells))
    return table
