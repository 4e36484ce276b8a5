"""ROS arguments as rcl can read them: it refuses a list that has integers and doubles, `[0, 0.5]`.

In what `-p` gives and in files of parameters the integers of such a list become doubles. Nothing
else is touched; a file is copied for as long as rclpy reads it.
"""

import re
import sys
import tempfile
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import rclpy
from rclpy.signals import SignalHandlerOptions

from ugv_acceptance import BadConfig
from ugv_acceptance.config.yaml_numbers import with_doubles

_VALUE, _FILE = ('-p', '--param'), '--params-file'
# Where in rcl's own source text an error arose: of no use to who wrote the argument.
_PLACE = re.compile(r', at \S+:[0-9]+')


def initialise(args: Sequence[str] | None) -> None:
    """Initialise rclpy with the arguments behind a program's name; None: those of this process.

    Raises BadConfig where they cannot be read. Signals are left to the caller.
    """
    given = sys.argv[1:] if args is None else args
    with tempfile.TemporaryDirectory(prefix='ugv_acceptance_') as folder:
        try:
            rclpy.init(
                args=[*readable(given, Path(folder))],
                signal_handler_options=SignalHandlerOptions.NO,
            )
        except RuntimeError as error:
            said = _PLACE.sub('', str(error)).removeprefix('failed to initialize rcl: ')
            raise BadConfig(f'ROS arguments: {" ".join(said.split())}') from None


def readable(args: Sequence[str], folder: Path) -> Iterator[str]:
    """Yield arguments that rcl can read; copies of files of parameters are put into `folder`."""
    for k, (before, argument) in enumerate(pairwise(['', *args])):
        name, assigned, value = argument.partition(':=')
        if before in _VALUE and assigned:
            yield name + assigned + with_doubles(value)
        elif before == _FILE and (text := _text_of(Path(argument))) != (new := with_doubles(text)):
            copy = folder / f'{k}.yaml'
            copy.write_text(new, encoding='utf-8')
            yield str(copy)
        else:
            yield argument


def _text_of(path: Path) -> str:
    try:
        return path.read_text(encoding='utf-8')
    except (OSError, ValueError):
        return ''  # rcl says what is wrong with it
