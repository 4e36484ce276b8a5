"""How every verb prints: consoles, wrapped sentences, tables, progress, files written.

Results go to standard output; what is said about the work (progress, files written, warnings) goes
to standard error, so that a pipe holds the result alone.
"""

import os
import re
import shlex
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

import typer
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from ugv_acceptance.cli.plain_text import (
    WIDEST,
    columns_of,
    has_utf8,
    is_terminal,
    takes_colour,
)

COLOURS = {
    **dict.fromkeys(('PASS', 'OK', 'PERMITTED'), 'bold green'),
    **dict.fromkeys(('FAIL', 'DANGER', 'BAD INPUT', 'BROKEN', 'REFUSED'), 'bold red'),
    **dict.fromkeys(('INCONCLUSIVE', 'CAUTION', 'DOUBTFUL', 'NOT KNOWN'), 'bold yellow'),
    'NO DATA': 'bold magenta',
}
MARKS = {
    **dict.fromkeys(('PASS', 'PERMITTED'), '[OK]'),
    **dict.fromkeys(('FAIL', 'REFUSED'), '[X]'),
    **dict.fromkeys(('INCONCLUSIVE', 'NOT KNOWN'), '[?]'),
    'BAD INPUT': '[!]',
}
# What standard output is called as a file.
_STDOUT = {'/dev/stdout', '/dev/fd/1', '/proc/self/fd/1'}
# A word; a number and its unit are one.
_WORD = re.compile(r'\S*\d (?:N m|deg/s|rad/s|m/s|deg|kg|Hz|min|h|s|m|N|J|%)(?!\w)\S*|\S+')
# Seconds between lines of progress where nothing may be drawn in place.
_EVERY = 10.0


def console_of(stream: TextIO | None = None) -> Console:
    """Return a console of a stream, standard output if none is given."""
    stream = stream or sys.stdout
    drawn, colour = is_terminal(stream), takes_colour(stream)
    # 'auto' asks the terminal; a stream that is none but is to have colour gets the plain ones.
    system: Any = None if not colour else 'auto' if drawn else 'standard'
    return Console(
        file=stream,
        force_terminal=drawn,
        color_system=system,
        no_color=not colour,
        width=columns_of(stream),
        legacy_windows=False,
        highlight=False,
        emoji=False,
    )


def said_of_work() -> Console:
    """Return the console for what is said about the work: standard error."""
    return console_of(sys.stderr)


def say(console: Console, markup: str, indent: int = 0, hang: int | None = None) -> None:
    """Print a sentence, wrapped at words: its first line at `indent`, the others at `hang`.

    A word that is longer than a line, such as a path, stays whole. `markup` is rich's; lines in it
    are wrapped each by itself.
    """
    behind = indent + 2 if hang is None else hang
    text = Text.from_markup(markup, emoji=False)
    for line in text.split('\n', allow_blank=True):
        for k, part in enumerate(_folded(line, min(console.width, WIDEST), indent, behind)):
            lead = Text(' ' * (behind if k else indent) if part else '')
            # No width: what is too long for a line goes out whole.
            console.print(lead + part, soft_wrap=True)


def _folded(text: Text, width: int, indent: int, hang: int) -> list[Text]:
    """Return the lines of a text: as many words in each as fit."""
    parts, start, end, room = [], 0, 0, width - indent
    for word in _WORD.finditer(text.plain):
        if end and word.end() - start > room:
            parts.append(text[start:end])
            start, room = word.start(), width - hang
        end = word.end()
    return [*parts, text[start:end]]


def say_list(console: Console, lines: Sequence[str], most: int, more: str, indent: int = 4) -> None:
    """Print sentences (plain text), `most` at most; `more` is said of the rest: "reasons"."""
    for line in lines[:most]:
        say(console, escape(line), indent)
    left = len(lines) - most
    if left > 0:
        say(console, f'and {left} more {more}', indent)


def shown_verdict(word: str, text: str) -> str:
    """Return a verdict as markup: its mark and word in colour, then what it is about."""
    return f'[{COLOURS[word]}]{escape(MARKS[word])} {word}[/]  {escape(text)}'


def table_of(title: str, *columns: str, names: int = 1, header: bool = True) -> Table:
    """Return an empty table: first columns of names, folded where they are long, then numbers."""
    table = Table(
        title=title or None,
        title_justify='left',
        title_style='bold',
        box=box.SIMPLE_HEAD if header else None,
        show_edge=False,
        pad_edge=False,
        show_header=header,
    )
    for k, column in enumerate(columns):
        name = k < names
        table.add_column(
            column, justify='left' if name else 'right', overflow='fold', no_wrap=not name
        )
    return table


def print_table(console: Console, table: Table) -> None:
    """Print a table without blanks at the ends of its lines, and an empty line after it."""
    with console.capture() as captured:
        console.print(table)
    text = '\n'.join(line.rstrip() for line in captured.get().splitlines())
    console.out(text.strip('\n') + '\n', highlight=False)


def wrote(*paths: Path | None) -> None:
    """Say which files were written, one line each, on standard error; None: none was asked for."""
    from ugv_acceptance.bag.atomic_files import is_stream

    for path in paths:
        if path is not None and not is_stream(path):
            typer.echo(f'Wrote {path}', err=True)


def result_console(*written: Path | None) -> Console:
    """Return the console of the result: standard error where a file goes to standard output."""
    return console_of(sys.stderr if {str(path) for path in written} & _STDOUT else sys.stdout)


def again(*more: str) -> str:
    """Return the command line as it was typed, with more words, for a shell."""
    words = ['ugv-acceptance', *sys.argv[1:]]
    at = words.index('--ros-args') if '--ros-args' in words else len(words)
    return shlex.join([*words[:at], *more, *words[at:]])


def complain(text: str) -> None:
    """Print an error or a warning: one line, wrapped at words if a person reads it."""
    sentence = f'ugv-acceptance: {text}'
    if sys.stderr.isatty():
        say(said_of_work(), escape(sentence))
    else:
        typer.echo(sentence, err=True)


@contextmanager
def status(text: str) -> Iterator[None]:
    """Say on a terminal what is being done while it takes its time."""
    console = said_of_work()
    if console.is_terminal:
        with console.status(text, spinner='dots' if has_utf8(sys.stderr) else 'line'):
            yield
        return
    if sys.stderr.isatty():
        typer.echo(f'{text} ...', err=True)
    yield


def bar_on(console: Console, *columns: str) -> Progress:
    """Return a progress bar of 80 columns at most; `columns` are rich's texts after the bar."""
    return Progress(
        TextColumn('{task.description}'),
        BarColumn(bar_width=20),
        TextColumn('{task.percentage:>3.0f}%'),
        TimeRemainingColumn(compact=True),
        *map(TextColumn, columns),
        console=console,
        transient=True,
    )


@contextmanager
def progress(doing: str, total: float, unit: str = 's') -> Iterator[Callable[[float, str], None]]:
    """Show how much is done, on standard error and on a terminal only.

    Yields a function of what is done (of `total`) and a note. Where no escape sequence may be sent
    (NO_COLOR) a line says it every ten seconds.
    """
    console = said_of_work()
    if not console.is_terminal:  # a disabled bar of older rich still prints an empty line
        yield _lines(doing, total, unit) if sys.stderr.isatty() else _nothing
        return
    with bar_on(console, f'{{task.completed:.0f}} of {{task.total:.0f}} {unit}') as bar:
        task = bar.add_task(doing, total=total)

        def reached(done: float, note: str = '') -> None:
            bar.update(task, completed=done, description=f'{doing} {note}'.rstrip())

        yield reached


def _nothing(_done: float, _note: str = '') -> None:
    """Show nothing."""


def _lines(doing: str, total: float, unit: str) -> Callable[[float, str], None]:
    """Return a function that says what is done, in a line every ten seconds."""
    due = time.monotonic() + _EVERY

    def reached(done: float, note: str = '') -> None:
        nonlocal due
        if time.monotonic() >= due:
            due = time.monotonic() + _EVERY
            text = f'{doing}: {done:.0f} of {total:.0f} {unit}'
            typer.echo(f'{text} {note}'.rstrip(), err=True)

    return reached


@contextmanager
def while_read() -> Iterator[None]:
    """Print until the reader closes the pipe (`| head`), which changes no exit code."""
    try:
        yield
        sys.stdout.flush()
    except (BrokenPipeError, SystemExit):  # newer rich turns the first into the second
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def tracked(items: Iterable[Any], doing: str, total: int, unit: str) -> Iterator[Any]:
    """Yield the items, showing how many are done."""
    with progress(doing, total, unit) as reached:
        for k, item in enumerate(items):
            yield item
            reached(k + 1, '')
