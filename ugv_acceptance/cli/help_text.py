"""The help of the verbs and the words of a wrong usage, from a verb's docstring and its options.

Sentences are wrapped for the page they are shown on, not as the docstring is; lines of examples
(after a backspace, as click has it) stay as they are written.
"""

import inspect
import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from ugv_acceptance.cli.plain_text import WIDEST, columns_of, is_terminal, takes_colour

KEPT = '\b'
# What typer raises where the options do not fit; it has no name for all of them.
USAGE: type[Exception] = next(
    base for base in typer.BadParameter.__mro__ if base.__name__ == 'ClickException'
)


def help_of(function: Callable[..., Any]) -> str:
    """Return the help of a verb: its docstring, a paragraph a line; examples as they stand."""
    paragraphs = inspect.cleandoc(function.__doc__ or '').split('\n\n')
    return '\n\n'.join(
        part.removeprefix(KEPT).strip('\n') if part.startswith(KEPT) else ' '.join(part.split())
        for part in paragraphs
    )


def usage_text(error: Any) -> str:  # noqa: ANN401 - typer's own class has no public name
    """Return a wrong usage as one line: of which verb, what is wrong, where it says more.

    Empty where no word was given and the help is printed instead.
    """
    context = getattr(error, 'ctx', None)
    if context is None or not error.format_message():
        return str(error.format_message())
    verb = context.command_path.partition(' ')[2]
    about, path = (f'{verb}: ' if verb else ''), context.command_path
    return f'{about}{_plain(error).rstrip(".")}; `{path} --help` says more'


# A value of the wrong kind, as the library that checks it says so.
_WRONG = re.compile(
    r"Invalid value for '?(?P<option>--?[\w-]+)[^:]*: Input should be (?P<what>[^,]*)"
)


def _plain(error: Any) -> str:  # noqa: ANN401 - see usage_text
    """Return what is wrong as option, what was expected, and what came where that is known."""
    message: str = error.format_message()
    wrong = _WRONG.match(message)
    if wrong is None:
        return message
    what = wrong['what'].replace('a valid integer', 'a whole number').replace('a valid', 'a')
    told: list[Any] = getattr(error.__cause__ or error.__context__, 'errors', list)()
    got = f', got {told[0]["input"]}' if told else ''
    return f'{wrong["option"]}: expected {what}{got}'


def _fit_page() -> None:
    """Tell typer's help of the stream it goes to: its columns, and whether it has colour."""
    from typer import rich_utils

    stream = sys.stdout
    drawn = is_terminal(stream)
    rich_utils.FORCE_TERMINAL = drawn
    rich_utils.MAX_WIDTH = min(columns_of(stream), WIDEST)
    system: Any = None if not takes_colour(stream) else 'auto' if drawn else 'standard'
    rich_utils.COLOR_SYSTEM = system


def _folders_here(values: Iterable[object]) -> int:
    """Return how many paths among a verb's values, alone or in lists, are the current folder."""
    lists = [value if isinstance(value, list | tuple) else (value,) for value in values]
    return sum(isinstance(one, Path) and one == Path() for some in lists for one in some)


class Verb(TyperCommand):
    """A verb whose help fits the page it is shown on, and which takes no empty path."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - as below
        """Parse the words; a usage error where a path is empty, as an unset variable leaves it."""
        words = [word.rpartition('=')[2] if word[:1] == '-' else word for word in args]
        rest: list[str] = super().parse_args(ctx, args)
        # Path('') is the current folder.
        here = [word for word in words if word and Path(word) == Path()]
        if '' in words and _folders_here(ctx.params.values()) > len(here):
            ctx.fail('expected a path, got ""')
        return rest

    def format_help(self, ctx: Any, formatter: Any) -> None:  # noqa: ANN401 - classes of typer's
        """Write the help."""
        _fit_page()
        super().format_help(ctx, formatter)


class Group(TyperGroup):
    """The program; its help fits the page it is shown on."""

    def format_help(self, ctx: Any, formatter: Any) -> None:  # noqa: ANN401 - classes of typer's
        """Write the help."""
        _fit_page()
        super().format_help(ctx, formatter)
