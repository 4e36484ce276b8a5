"""What `record` says: a table that is drawn again or plain lines, what is odd, and the summary."""

import shlex
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.markup import escape
from rich.table import Table

from ugv_acceptance.cli.amounts import size_words, time_words
from ugv_acceptance.cli.terminal_output import print_table, say, table_of

if TYPE_CHECKING:
    from ugv_acceptance.bag.recorder import Recorder
    from ugv_acceptance.nodes.recorder import TopicState

CAUTION = '[bold yellow]CAUTION[/]'
# A disk with less than this many times what stays free, or seconds to go, is a caution.
NEAR, SOON = 2, 600.0
# A rate (Hz) below it is not told in a line.
SLOW = 0.5
# Oddities that stay in sight under the table.
_SHOWN = 5
# Seconds of recording before it is said that something is missing: publishers are being found.
_FOUND = 3.0

Heard = Callable[[], 'Sequence[TopicState]']


@dataclass(slots=True)
class Progress:
    """How a recording stands: seconds, and what it has taken of the disk."""

    recorder: 'Recorder'
    reserve: int
    began: float

    @property
    def seconds(self) -> float:
        """Seconds since it began."""
        return time.monotonic() - self.began

    def left(self) -> float:
        """Return the seconds until the disk is as full as it may be, at the present rate."""
        rate = self.recorder.size / max(self.seconds, 1.0)
        return max(self.recorder.free - self.reserve, 0) / max(rate, 1.0)

    def head(self) -> str:
        """Return seconds, size and what is left of the disk, as text."""
        parts = f' in {self.recorder.parts} files' if self.recorder.parts > 1 else ''
        return (
            f'{time_words(self.seconds)}, {size_words(self.recorder.size)}{parts}, '
            f'{size_words(self.recorder.free)} left on the disk'
        )

    def cautions(self, heard: 'Sequence[TopicState]') -> list[str]:
        """Return what is missing, lost, or near its end, as sentences."""
        found = []
        near = self.recorder.free < NEAR * self.reserve
        if near or (self.seconds > _FOUND and self.left() < SOON):
            found.append(
                f'{size_words(self.recorder.free)} left on the disk, of which '
                f'{size_words(self.reserve)} stay free: recording ends in {time_words(self.left())}'
            )
        if self.recorder.dropped:
            found.append(f'{self.recorder.dropped} messages not recorded: the disk is too slow')
        if self.seconds > _FOUND:
            found += [topic.missing for topic in heard if topic.missing]
        found += [f'{t.name}: {t.lost} messages lost on their way' for t in heard if t.lost]
        return found


class Lines:
    """Prints a line every few seconds, and every caution when it comes up; needs no `screen`."""

    def __init__(self, console: Console, progress: Progress, every: float) -> None:
        self._console, self._progress, self._every = console, progress, every
        self._due, self._cautions = every, set[str]()
        self.screen: AbstractContextManager[object] = nullcontext()

    def tell(self, text: str) -> None:
        """Print what is odd."""
        say(self._console, f'{CAUTION} {escape(text)}')

    def draw(self, heard: 'Sequence[TopicState]') -> None:
        """Print what is due."""
        cautions = {_without_numbers(text): text for text in self._progress.cautions(heard)}
        for what, text in cautions.items():
            if what not in self._cautions:
                self.tell(text)
        self._cautions = set(cautions)
        if self._progress.seconds < self._due:
            return
        self._due = self._progress.seconds + self._every
        rates = ', '.join(f'{topic.name} {topic.rate:.0f} Hz' for topic in heard if topic.messages)
        say(self._console, escape(f'{self._progress.head()}: {rates or "no message yet"}'))


class Panel:
    """A table of topics that is drawn again every second while `screen` is on."""

    def __init__(self, console: Console, progress: Progress) -> None:
        self.screen = Live(console=console, auto_refresh=False)
        self._progress = progress
        self._told: list[str] = []

    def tell(self, text: str) -> None:
        """Keep what is odd in sight."""
        self._told = [*self._told, text][-_SHOWN:]

    def draw(self, heard: 'Sequence[TopicState]') -> None:
        """Draw the present state."""
        cautions = [*self._progress.cautions(heard), *self._told]
        rows: list[RenderableType] = [
            f'[bold]{escape(self._progress.head())}[/]',
            topics_table(heard),
            *(f'{CAUTION} {escape(text)}' for text in cautions),
            '[dim]Ctrl-C ends[/]',
        ]
        self.screen.update(Group(*rows), refresh=True)


def topics_table(heard: 'Sequence[TopicState]', *, over: bool = False) -> Table:
    """Return the topics that were heard as a table; rates are present ones, or (`over`) means."""
    table = table_of('', 'topic', 'messages', 'Hz', 'lost')
    for topic in heard:
        if topic.messages:
            rate, lost = topic.mean if over else topic.rate, str(topic.lost or '')
            table.add_row(escape(topic.name), f'{topic.messages:,}', f'{rate:.1f}', lost)
    return table


def print_summary(
    console: Console, folder: Path, progress: Progress, heard: 'Sequence[TopicState]'
) -> None:
    """Print what was recorded, what is missing of it, and the command that judges it."""
    total = sum(topic.messages for topic in heard)
    typer.echo(f'Recorded {folder}')  # whole, however long: it is to be copied
    say(console, escape(f'{total:,} messages in {progress.head()}'))
    if total:
        print_table(console, topics_table(heard, over=True))
    for text in [t.missing.replace('no message yet', 'no message came') for t in heard]:
        if text:
            say(console, f'{CAUTION} {escape(text)}')
    if total:
        typer.echo(f'Judge it: ugv-acceptance evaluate {shlex.quote(str(folder))}')


def _without_numbers(text: str) -> str:
    return ''.join(c for c in text if not c.isdigit())
