"""`ugv-acceptance record`: records a running robot, with all that `evaluate` needs."""

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ugv_acceptance import AcceptanceError, BadConfig
from ugv_acceptance.cli.amounts import bytes_of, seconds_of, size_or_time
from ugv_acceptance.cli.options import CONTEXT, ConfigFile, UrdfFile, ros_arguments

if TYPE_CHECKING:
    from ugv_acceptance.bag.recorder import Recorder, Room
    from ugv_acceptance.bag.recordings_kept import Keep
    from ugv_acceptance.cli.record_status import Lines, Panel, Progress
    from ugv_acceptance.config import Topics
    from ugv_acceptance.nodes.recorder import RecorderNode

__all__ = ['CONTEXT', 'record']

# Seconds between looks at how much the recordings take that stay.
PRUNE = 10.0


@dataclass(frozen=True, slots=True)
class Asked:
    """What was asked for: robot and topics, where to and how long, what to print."""

    robot: str
    topics: 'Topics'
    folder: Path
    room: 'Room'
    keep: 'Keep | None'
    extra: tuple[str, ...]
    seconds: float | None
    every: float
    plain: bool


def record(
    context: typer.Context,
    config: ConfigFile = None,
    urdf: UrdfFile = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help='New folder to record into; without it, the name of the robot and the time (UTC).'
        ),
    ] = None,
    topics: Annotated[
        list[str] | None, typer.Option(help='A further topic to record (repeatable).')
    ] = None,
    split: Annotated[
        list[str] | None,
        typer.Option(help='Begin a new file after so much: 1GB, 10min (repeatable).'),
    ] = None,
    keep: Annotated[
        str,
        typer.Option(
            help='Recordings of this robot that stay in this folder: 20, or 50GB; older ones are '
            'DELETED. Not with --out.'
        ),
    ] = '',
    duration: Annotated[str, typer.Option(help='End after so long: 90s, 10min, 2h.')] = '',
    leave: Annotated[
        str, typer.Option(help='End when less than this is free on the disk.')
    ] = '500MB',
    every: Annotated[
        float, typer.Option(min=0.1, help='Seconds between lines where there is no terminal.')
    ] = 10.0,
    plain: Annotated[
        bool, typer.Option('--plain', help='Print lines, even on a terminal.')
    ] = False,
) -> None:
    """Record a running robot: the inputs, its URDF, its fixed frames, the monitor's words.

    Nothing is decoded, nothing is replaced. Killed at any moment, it loses at most half a second.
    Ctrl-C ends it. Exit codes: 0 done, 2 bad input, or the disk has no more room: what was
    recorded until then is whole.

    \b
    Examples:
      ugv-acceptance record
      ugv-acceptance record -c my_robot.yaml --out runs/ramp_3 --duration 10min
      ugv-acceptance record --split 1GB --split 10min --keep 50GB
      ugv-acceptance record --topics /camera_info --ros-args -r __ns:=/robot1
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.bag.recorder import Room
    from ugv_acceptance.config import name_and_topics

    size, seconds = _split_of(split or ())
    room = Room(size, seconds, bytes_of(leave, '--leave'))
    kept = _keep_of(keep, out)
    lasts = seconds_of(duration, '--duration') if duration else None
    arguments = ros_arguments(context)
    name, named = name_and_topics(config, urdf=urdf)
    folder = _folder(out, name, config, urdf)
    asked = Asked(name, named, folder, room, kept, tuple(topics or ()), lasts, every, plain)
    trouble = carry_out(asked, arguments)
    if trouble:
        raise AcceptanceError(f'{folder}: recording has ended: {trouble}')


def _split_of(texts: 'tuple[str, ...] | list[str]') -> tuple[int | None, float | None]:
    sizes, times = list[int](), list[float]()
    for text in texts:
        size, seconds = size_or_time(text, '--split')
        sizes += [] if size is None else [size]
        times += [] if seconds is None else [seconds]
    return min(sizes, default=None), min(times, default=None)


def _keep_of(text: str, out: Path | None) -> 'Keep | None':
    from ugv_acceptance.bag.recordings_kept import Keep

    if not text:
        return None
    if out is not None:
        raise BadConfig('--keep: expected without --out: recordings it names are not known again')
    if text.strip().isdecimal():
        if int(text) < 1:
            raise BadConfig(f'--keep: expected at least 1 recording, the present one, got {text}')
        return Keep(count=int(text))
    return Keep(size=bytes_of(text, '--keep'))


def _folder(out: Path | None, name: str, config: Path | None, urdf: Path | None) -> Path:
    from ugv_acceptance.bag.recordings_kept import new_folder
    from ugv_acceptance.cli.output_kinds import RECORDING
    from ugv_acceptance.cli.outputs import check_folder, inputs_of

    folder = out or new_folder(name, time.time_ns())
    check_folder('--out', folder, RECORDING, inputs_of(config, URDF=urdf))
    return folder


def carry_out(asked: Asked, arguments: list[str]) -> str:
    """Record until it is interrupted, over, or cannot go on; return why it could not."""
    from ugv_acceptance.bag.recorder import Recorder
    from ugv_acceptance.cli.record_status import Lines, Panel, Progress, print_summary
    from ugv_acceptance.cli.terminal_output import complain, console_of, said_of_work
    from ugv_acceptance.nodes.executor import end, ros, spin
    from ugv_acceptance.nodes.recorder import RecorderNode, check_topic

    for extra in asked.extra:
        check_topic(extra)
    # Before it looks at the room on the disk: that is what old recordings are deleted for.
    _prune(asked, complain)
    with ros(arguments) as stop:
        recorder = Recorder(asked.folder, asked.room)
        progress = Progress(recorder, asked.room.reserve, time.monotonic())
        console = said_of_work()
        drawn = console.is_terminal and not asked.plain
        shown = Panel(console, progress) if drawn else Lines(console, progress, asked.every)
        try:
            with shown.screen:
                node = RecorderNode(recorder, asked.topics, asked.extra, shown.tell)
                node.create_timer(1.0, _drawing(shown, node), clock=node.steady)
                node.create_timer(PRUNE, partial(_prune, asked, shown.tell), clock=node.steady)
                spin(node, stop, lambda: _is_over(recorder, progress, asked.seconds))
                node.close()
        finally:
            recorder.close()
        print_summary(console_of(), asked.folder, progress, node.heard)
        end(node)
    return recorder.trouble


def _drawing(shown: 'Lines | Panel', node: 'RecorderNode') -> Callable[[], None]:
    """Return what draws the present state; a reader who has gone does not end the recording."""

    def draw() -> None:
        with suppress(OSError):
            shown.draw(node.heard)

    return draw


def _is_over(recorder: 'Recorder', progress: 'Progress', seconds: float | None) -> bool:
    return bool(recorder.trouble) or (seconds is not None and progress.seconds >= seconds)


def _prune(asked: Asked, tell: Callable[[str], None]) -> None:
    """Delete older recordings, if that was asked for, and say which."""
    if asked.keep is None:
        return
    from ugv_acceptance.bag.recordings_kept import prune

    try:
        for path in prune(asked.robot, asked.keep, asked.folder):
            tell(f'deleted {path}, as --keep asks')
    except (AcceptanceError, OSError) as error:
        tell(f'--keep: {error}')
