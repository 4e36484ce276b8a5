"""The console in a terminal, drawn by Textual from the same frames as the page."""

from collections.abc import Callable
from typing import Any, ClassVar

from rich.table import Table
from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Footer, Input, OptionList, Static

from ugv_acceptance import AcceptanceError
from ugv_acceptance.console.frame import Plain, frame_of
from ugv_acceptance.console.snapshot import Awaited, Feed
from ugv_acceptance.console.terminal_text import (
    cards_of,
    headline_of,
    inputs_of,
    lamps_of,
    margins_of,
    now_of,
)
from ugv_acceptance.console.typed import load_from
from ugv_acceptance.evaluation.ground import KINDS
from ugv_acceptance.monitoring.drawing import figure_of

# Seconds between drawings: a terminal over SSH shows no more. A feed is asked more often, as by a
# page: it judges silence by when it was asked.
PERIOD = 0.2
LISTEN = 0.05
# Cards that a key can choose.
_KEYS = '123456789'
# What is asked for, with what the line begins with.
ASKED = {
    'payload': 'Load carried, and where in its link if that changed: 2.5kg 10cm,0,0',
    'name': 'Your name, which stands beside what you do',
    'note': 'Note for your next command, such as why',
}


class Ask(ModalScreen[str | None]):
    """Asks for a line of text; None: the person changed their mind."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding('escape', 'dismiss(None)', 'Never mind')]

    def __init__(self, question: str, before: str = '') -> None:
        super().__init__()
        self._question, self._before = question, before

    def compose(self) -> ComposeResult:
        """Yield the question and the line."""
        yield Static(self._question, markup=False)
        yield Input(self._before)

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Take the line."""
        self.dismiss(event.value)


class Choose(ModalScreen[str | None]):
    """Asks for one of some words, which arrows and Enter choose, or their first letters."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding('escape', 'dismiss(None)', 'Never mind')]

    def __init__(self, question: str, words: tuple[str, ...]) -> None:
        super().__init__()
        self._question, self._words = question, words

    def compose(self) -> ComposeResult:
        """Yield the question and the words."""
        yield Static(self._question, markup=False)
        yield OptionList(*self._words)

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Take the word that was chosen."""
        self.dismiss(self._words[event.option_index])

    def on_key(self, event: Any) -> None:  # noqa: ANN401 - Textual's key event
        """Take the word that begins with the letter, and with no other."""
        found = [word for word in self._words if word.startswith(event.character or ' ')]
        if len(found) == 1:
            event.stop()
            self.dismiss(found[0])


class Terminal(App[None]):
    """Shows a feed until the user leaves or `asked` to end; `frame` is the one shown now.

    `who` stands beside every command of the operator, `note` beside the next. `plain`: a terminal
    that shows ASCII only.
    """

    CSS = """
    #headline, #now, #lamps { height: auto; padding: 0 1; }
    #now { border-top: ascii $foreground 20%; border-bottom: ascii $foreground 20%; }
    #cards, #margins, #inputs { height: auto; padding: 0 1; }
    #margins { margin-top: 1; }
    #lamps { background: $boost; }
    Ask, Choose { align: center middle; }
    Ask > *, Choose > * { width: 100%; height: auto; padding: 0 1; }
    Ask > Static, Choose > Static { background: $boost; }
    Input, Input:focus { border: ascii $foreground; }
    OptionList, OptionList:focus { border: ascii $foreground; max-height: 8; }
    .plain { scrollbar-size-vertical: 0; }
    """
    ENABLE_COMMAND_PALETTE = False
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding('a', 'ask("acknowledge")', 'Acknowledge'),
        Binding('s', 'ask("shelve")', 'Shelve'),
        Binding('u', 'ask("unshelve")', 'Unshelve'),
        Binding('r', 'ask("reset")', 'Reset'),
        Binding('p', 'payload', 'Load'),
        Binding('g', 'ground', 'Ground'),
        Binding('n', 'sign', 'Name'),
        Binding('space', 'play', 'Play/pause', key_display='space'),
        Binding('left', 'jump(-1)', '-1 s', key_display='left'),
        Binding('right', 'jump(1)', '+1 s', key_display='right'),
        *(Binding(key, f'pick({key})', show=False) for key in _KEYS),
        Binding('escape,0', 'pick(0)', show=False),
        Binding('q', 'quit', 'Leave'),
        # A terminal in use by Textual sends no signal for it.
        Binding('ctrl+c', 'quit', 'Leave', show=False, priority=True),
    ]

    def __init__(
        self,
        feed: Feed,
        asked: Callable[[], bool] = lambda: False,
        who: str = 'watch',
        *,
        plain: bool = False,
    ) -> None:
        super().__init__()
        self.feed, self._asked = feed, asked
        self.frame: Plain = {}
        self.said = self.note = ''
        self.who, self.plain = who, plain
        self.chosen: str | None = None
        self._parts: dict[str, Static] = {}
        self._awaited: list[Awaited] = []
        self._figure = figure_of(feed.settings.robot)
        self._snapshot = feed.snapshot()
        self._source = str(feed.describe()['source'])

    def compose(self) -> ComposeResult:
        """Yield the widgets of the screen."""
        yield Static(id='headline')
        yield Static(id='now')
        with VerticalScroll(classes='plain' if self.plain else ''):
            yield Static(id='cards')
            yield Static(id='margins')
            yield Static(id='inputs')
        yield Static(id='lamps')
        yield Footer()

    def on_mount(self) -> None:
        """Draw now, and again every PERIOD (s)."""
        self.title = str(self.feed.describe()['title'])
        self._parts = {str(part.id): part for part in self.query(Static) if part.id}
        self._draw()
        self.set_interval(LISTEN, self._listen)
        self.set_interval(PERIOD, self._draw)

    def check_action(
        self,
        action: str,
        parameters: tuple[object, ...],  # noqa: ARG002 - Textual's signature
    ) -> bool:
        """Return whether the current feed supports an action: a recording takes no commands."""
        if action in {'ask', 'payload', 'ground', 'sign', 'pick'}:
            return self._source == 'live'
        if action in {'play', 'jump'}:
            return self._source == 'bag'
        return True

    def action_pick(self, number: int) -> None:
        """Choose a card by its number, for the next command; 0: none, so all."""
        cards = [*self.frame['cards'], *self.frame['past']]
        self.chosen = cards[number - 1]['key'] if 0 < number <= len(cards) else None
        self._draw()

    def action_ask(self, do: str) -> None:
        """Send a command about the chosen card, else all alerts; shelving takes the first fit."""
        cards = [*self.frame['cards'], *self.frame['past']]
        mine = [card for card in cards if card['key'] == self.chosen]
        if not mine and do in {'shelve', 'unshelve'}:
            mine = [card for card in cards if do in card['offers']][:1]
            if not mine:
                self._say(f'{do}: no alert offers that now')
                return
        self._command(do, {'keys': mine[0]['keys']} if mine else {})
        self.chosen = None

    def action_payload(self) -> None:
        """Ask for the load that is carried, and tell the monitor."""
        self.push_screen(Ask(ASKED['payload']), self._load)

    def _load(self, typed: str | None) -> None:
        if not typed:
            return
        try:
            mass, place = load_from(typed)
        except AcceptanceError as error:
            self._say(str(error))
            return
        cog = self.frame['payload']['cog_m'] if place is None else list(place)
        self._command('payload', {'mass_kg': mass, 'cog_m': cog})

    def action_ground(self) -> None:
        """Ask what the robot stands on, and tell the monitor."""
        self.push_screen(Choose('What does the robot stand on?', KINDS), self._stand)

    def _stand(self, kind: str | None) -> None:
        if kind is not None:
            self._command('ground', {'kind': kind})

    def action_sign(self) -> None:
        """Ask who is at the keys, and for a note to the next command."""

        def named(who: str | None) -> None:
            if who is not None:
                self.who = who.strip() or self.who
                self.push_screen(Ask(ASKED['note'], self.note), noted)

        def noted(note: str | None) -> None:
            self.note = self.note if note is None else note.strip()
            self._draw()

        self.push_screen(Ask(ASKED['name'], self.who), named)

    def action_play(self) -> None:
        """Play or pause a recording."""
        self._command('pause' if self.frame['playback']['playing'] else 'play', {})

    def action_jump(self, seconds: int) -> None:
        """Go some seconds forward or back in a recording."""
        self._command('seek', {'to_s': self.frame['playback']['position_s'] + seconds})

    def _command(self, do: str, values: dict[str, Any]) -> None:
        signed = {'by': self.who, 'note': self.note} if self._source == 'live' else {}
        try:
            said = self.feed.command(do, values | signed)
        except AcceptanceError as error:
            said = str(error)
        else:
            self.note = ''
        if not isinstance(said, str):
            self._awaited.append(said)
            said = self.said
        self._listen()
        self._say(said)

    def _say(self, text: str) -> None:
        self.said = text
        self._draw()

    def _listen(self) -> None:
        if self._asked():
            self.exit()
        self._snapshot = self.feed.snapshot()
        for asked in tuple(self._awaited):
            try:
                said = asked()
            except AcceptanceError as error:
                said = str(error)
            if said is not None:
                self._awaited.remove(asked)
                self._say(said)

    def _draw(self) -> None:
        frame = frame_of(self._snapshot, self.feed.settings, self._figure) | self.feed.extra()
        self.frame = frame
        lamps = lamps_of(frame)
        if self._source == 'live':
            lamps.append(f'   as {self.who}{f", note: {self.note}" if self.note else ""}')
        lamps.append(f'\n{self.said}' if self.said else '', 'bold')
        drawn: dict[str, Text | Table] = {
            'headline': headline_of(frame, plain=self.plain),
            'now': now_of(frame),
            'cards': cards_of(frame, self.chosen),
            'margins': margins_of(frame),
            'inputs': inputs_of(frame),
            'lamps': lamps,
        }
        for name, content in drawn.items():
            self._parts[name].update(content)
