"""`ugv-acceptance watch [BAG]`: shows the console in a terminal, such as over SSH."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ugv_acceptance import BadConfig, pip_install
from ugv_acceptance.cli.options import CONTEXT, ros_arguments
from ugv_acceptance.cli.tell import login_name
from ugv_acceptance.cli.termination import asked_to_end

if TYPE_CHECKING:
    from ugv_acceptance.config import Config
    from ugv_acceptance.console.recording import RecordingFeed
    from ugv_acceptance.console.snapshot import Feed

__all__ = ['CONTEXT', 'watch']


def _given(path: Path | None) -> Path | None:
    """Return None for an empty path, such as a launch file's default."""
    return None if path == Path() else path


Recording = Annotated[
    Path | None, typer.Argument(help='Recording to show; without one, the live robot.')
]
RobotFile = Annotated[
    Path | None,
    typer.Option(
        '--config',
        '-c',
        callback=_given,
        help='YAML file, or the name of one that ships: packbot.',
    ),
]
Urdf = Annotated[
    Path | None,
    typer.Option(callback=_given, help='URDF in place of the one the YAML names.'),
]


def watch(
    context: typer.Context,
    bag: Recording = None,
    config: RobotFile = None,
    urdf: Urdf = None,
    by: Annotated[str, typer.Option(help='Who is at the keys; without it, the login name.')] = '',
) -> None:
    """Show verdict, alerts and margins in the terminal, in the words of the console. q leaves.

    Of a live robot a acknowledges (all, or the card chosen by its number), s shelves, u unshelves,
    r resets, p tells the load, g the ground, n your name and a note.

    Without a terminal, a line is printed whenever something changes, at most one a second.

    \b
    Examples:
      ugv-acceptance watch
      ugv-acceptance watch bags/packbot_fail
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    lines = not all(file.isatty() for file in (sys.stdin, sys.stdout, sys.stderr))
    if not lines:
        need('textual')
    with feed_of(context, bag, config, urdf) as (feed, asked):
        if lines:
            from ugv_acceptance.cli.result_text import while_read
            from ugv_acceptance.console.lines import show_lines

            with while_read():
                show_lines(feed, partial(print, flush=True), asked)
        else:
            from ugv_acceptance.console.terminal import Terminal

            Terminal(feed, asked, by or login_name(), plain=not shows_unicode()).run()


def shows_unicode() -> bool:
    """Return whether the terminal takes more than ASCII."""
    return 'utf' in (sys.stdout.encoding or '').lower()


def need(*libraries: str) -> None:
    """Raise BadConfig where a library of the extra `console` is not installed."""
    missing = [name for name in libraries if find_spec(name) is None]
    if missing:
        text = f'expected {", ".join(missing)}, found none: {pip_install("console")}'
        raise BadConfig(text)


@contextmanager
def feed_of(
    context: typer.Context, bag: Path | None, config: Path | None, urdf: Path | None
) -> 'Iterator[tuple[Feed, Callable[[], bool]]]':
    """Yield the feed to show, of a recording or the live robot, and a function for when to end."""
    from ugv_acceptance.bag.recording import open_recording
    from ugv_acceptance.offline.own_robot import robot_of

    # Where no bag is given, click takes --ros-args for it.
    if bag is not None and str(bag) == '--ros-args':
        context.args, bag = [str(bag), *context.args], None
    ros = ros_arguments(context)
    if bag is not None:
        recording = recording_feed(bag, robot_of(open_recording(bag), config, urdf=urdf))
        with asked_to_end() as asked:
            yield recording, asked
        return
    from ugv_acceptance.nodes.console_feed import live_feed
    from ugv_acceptance.nodes.monitor.own_description import load_live

    with live_feed(load_live(config, urdf, ros), ros) as (feed, stop):
        yield feed, lambda: stop.asked


def recording_feed(bag: Path, config: 'Config') -> 'RecordingFeed':
    """Return an evaluated recording as a feed."""
    from ugv_acceptance.bag.recording import open_recording
    from ugv_acceptance.console.recording import RecordingFeed, shown_recording

    return RecordingFeed(shown_recording(open_recording(bag), config))
