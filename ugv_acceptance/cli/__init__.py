"""The command line, `ugv-acceptance VERB`: one thin module per verb that parses, calls and prints.

In: options and paths as texts, which each verb checks and converts. Out: text, files and the exit
code; every file passes `outputs.py`, which keeps it from replacing an input. The work is done by
the other rooms. A verb's module imports what it needs inside its function, so that --help and
completion are quick. Read `evaluate.py` first, as the pattern of a verb.
"""

import errno
import os
import sys
from importlib import import_module

import typer

from ugv_acceptance import AcceptanceError, __version__
from ugv_acceptance.cli.termination import ended_by_signals

PASS, FAIL, BAD_INPUT, INCONCLUSIVE = range(4)
# A disk that is full, a quota or a limit that is reached, a file system that is read-only.
NO_ROOM = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS})

# In the order in which people meet them; the code of a verb is cli/VERB.py, function VERB.
VERBS = (
    'demo',
    'init',
    'evaluate',
    'verify',
    'campaign',
    'monitor',
    'console',
    'watch',
    'tell',
    'foxglove',
    'replay',
    'plan',
    'run',
    'simulate',
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

app = typer.Typer(
    name='ugv-acceptance',
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
    with ended_by_signals() as told:
        for verb in VERBS:
            module = import_module(f'ugv_acceptance.cli.{verb.replace("-", "_")}')
            settings = getattr(module, 'CONTEXT', None)
            app.command(verb, context_settings=settings)(getattr(module, verb.replace('-', '_')))
        try:
            app()
        except Exception as error:
            # A library being imported may turn the signal into an error of its own.
            if told():
                sys.exit(told())
            sentence = _sentence(error)
            if not sentence:
                raise
            typer.echo(f'ugv-acceptance: {sentence}', err=True)
            sys.exit(BAD_INPUT)


def _sentence(error: Exception) -> str:
    """Return the message of an error that the user can act on; empty for other errors."""
    if isinstance(error, OSError) and error.errno in NO_ROOM:
        where = f'{error.filename}: ' if error.filename else ''
        return f'{where}cannot be written: {error.strerror}'
    return str(error) if isinstance(error, AcceptanceError) else ''


if __name__ == '__main__':
    main()
