"""The command line, `ugv-acceptance VERB`: one thin module per verb that parses, calls and prints.

In: options and paths as texts, which each verb checks and converts. Out: text, files and the exit
code; every file passes `outputs.py`, which keeps it from replacing an input. The work is done by
the other rooms. A verb's module imports what it needs inside its function, so that --help and
completion are quick. Read `evaluate.py` first, as the pattern of a verb.
"""

import atexit
import errno
import gc
import os
import sys
from collections.abc import Sequence
from importlib import import_module

import typer

from ugv_acceptance import AcceptanceError, __version__
from ugv_acceptance.cli.help_text import USAGE, Group, Verb, help_of, usage_text
from ugv_acceptance.cli.plain_text import prepare
from ugv_acceptance.cli.termination import ended_by_signals

PASS, FAIL, BAD_INPUT, INCONCLUSIVE = range(4)
# A disk that is full, a quota or a limit that is reached, a file system that is read-only.
NO_ROOM = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS})

# In the names of variables by which a shell asks for completions.
COMPLETE = '_UGV_ACCEPTANCE'

# In the order in which people meet them; the code of a verb is cli/VERB.py, function VERB.
VERBS = (
    'demo',
    'init',
    'info',
    'evaluate',
    'verify',
    'campaign',
    'monitor',
    'record',
    'console',
    'watch',
    'tell',
    'foxglove',
    'replay',
    'plan',
    'run',
    'simulate',
    'drill',
    'check',
    'model',
    'map',
    'paper',
    'speed',
    'risk',
    'doctor',
)

# Read by NumPy when it is imported. Products here are of few columns: threads that share one wait
# for each other longer than they work: up to a tenth of what judging a recording costs.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
# Read by pydantic, which else looks for plugins of its own in everything that is installed.
os.environ.setdefault('PYDANTIC_DISABLE_PLUGINS', '__all__')
# Objects that are made before the garbage collector looks for some to free. A start makes 80,000,
# and all of them stay.
COLLECT_SELDOM = 100_000

PROGRAM = 'ugv-acceptance'

app = typer.Typer(
    name=PROGRAM,
    cls=Group,
    rich_markup_mode='rich',
    help='Acceptance monitoring of unmanned ground vehicles: torque and tip-over margins.',
    epilog='Exit codes: 0 pass, 1 fail, 2 bad input, 3 inconclusive, 130 or 143 interrupted.',
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f'ugv-acceptance {__version__}')
        raise typer.Exit


@app.callback()
def _options(
    version: bool = typer.Option(
        False, '--version', callback=_version, is_eager=True, help='Print the version and exit.'
    ),
) -> None:
    """Acceptance monitoring of unmanned ground vehicles: torque and tip-over margins."""


def main() -> None:
    """Run the command line; an error the user can act on gives one line and exit code 2."""
    gc.set_threshold(COLLECT_SELDOM)
    atexit.register(gc.freeze)  # what is left goes with the process
    prepare()
    with ended_by_signals() as told:
        for verb in verbs_for(asked_words()):
            add(verb)
        try:
            sys.exit(app(prog_name=PROGRAM, standalone_mode=False))
        except Exception as error:
            # A library being imported may turn the signal into an error of its own.
            if told():
                sys.exit(told())
            sentence = _sentence(error)
            if sentence is None:
                raise
            from ugv_acceptance.cli.terminal_output import complain

            if sentence:
                complain(sentence)
            sys.exit(BAD_INPUT)


def add(verb: str) -> None:
    """Make a verb known to the command line."""
    module = import_module(f'ugv_acceptance.cli.{verb.replace("-", "_")}')
    function = getattr(module, verb.replace('-', '_'))
    settings, told = getattr(module, 'CONTEXT', None), help_of(function)
    app.command(verb, cls=Verb, context_settings=settings, help=told)(function)


def asked_words() -> list[str]:
    """Return the words that were typed after the program; those of a shell that completes them."""
    if f'{COMPLETE}_COMPLETE' not in os.environ:
        return sys.argv[1:]
    from ugv_acceptance.cli.completion import typed_words

    return typed_words()


def verbs_for(words: Sequence[str]) -> Sequence[str]:
    """Return the verbs whose modules are needed: the one that is named, or all."""
    if '--version' in words[:1]:
        return ()
    first = next((word for word in words if not word.startswith('-')), '')
    return (first,) if first in VERBS else VERBS


def _sentence(error: Exception) -> str | None:
    """Return the message of an error that the user can act on; None for other errors."""
    if isinstance(error, OSError) and error.errno in NO_ROOM:
        where = f'{error.filename}: ' if error.filename else ''
        return f'{where}cannot be written: {error.strerror}'
    if isinstance(error, USAGE):
        return usage_text(error)
    if isinstance(error, typer.Abort):
        return 'expected an answer, the input has ended'
    return str(error) if isinstance(error, AcceptanceError) else None


if __name__ == '__main__':
    main()
