"""`ugv-acceptance doctor [BAG]`: checks a ROS set-up, or a recording, and says what to do."""

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.markup import escape

from ugv_acceptance.cli.completion import recordings_like
from ugv_acceptance.cli.options import CONTEXT, ConfigFile, UrdfFile, ros_arguments
from ugv_acceptance.cli.terminal_output import console_of, progress, said_of_work, say

if TYPE_CHECKING:
    from ugv_acceptance.inspection.heard import Finding

COLOURS = {'OK': 'bold green', 'CAUTION': 'bold yellow', 'FAIL': 'bold red'}
FINE, AILING = 0, 1
_NO_ROS = (
    'no rclpy: source /opt/ros/jazzy/setup.bash, or install the wheels: '
    'pip install ros-jazzy-rclpy ros-jazzy-rmw-fastrtps-cpp ros-jazzy-common-interfaces'
)


def read(bag: Path, config: Path | None, urdf: Path | None, *, everything: bool) -> int:
    """Print the findings about a recording and return the exit code: 1 if any has failed."""
    from ugv_acceptance.bag.recording import open_recording
    from ugv_acceptance.inspection.recorded import examine_recording
    from ugv_acceptance.offline.own_robot import robot_of

    recording = open_recording(bag)
    robot = robot_of(recording, config, urdf=urdf)
    with progress('reading', recording.duration_s) as reached:
        checked = examine_recording(
            recording, robot, everything=everything, reached=lambda seconds: reached(seconds, '')
        )
    if checked.until_s is not None:
        text = f'The first {checked.until_s:.0f} s were read; --all reads the rest.'
        say(said_of_work(), text)
    return _print(checked.findings)


def consult(config: Path | None, urdf: Path | None, seconds: float, args: list[str]) -> int:
    """Print the findings and return the exit code: 1 if any has failed."""
    console = console_of()
    if find_spec('rclpy') is None:
        tell(console, 'FAIL', 'ROS', 'not found', _NO_ROS)
        return AILING
    from ugv_acceptance.nodes.doctor.checks import examine
    from ugv_acceptance.nodes.doctor.network import network
    from ugv_acceptance.nodes.doctor.probe import listen
    from ugv_acceptance.nodes.monitor.own_description import load_live

    loaded = load_live(config, urdf, args)
    say(said_of_work(), f'Listening for {seconds:g} s; let the robot stand still.')
    around = listen(loaded.topics, seconds, args)
    return _print([*examine(around, loaded), *network(around)])


def _print(findings: 'Sequence[Finding]') -> int:
    """Print findings between what they come to, and return the exit code."""
    console = console_of()
    outcome = _outcome(findings)
    say(console, outcome)
    for finding in findings:
        tell(console, finding.level, finding.about, finding.seen, finding.do)
    say(console, outcome)
    return AILING if any(finding.level == 'FAIL' for finding in findings) else FINE


def _outcome(findings: 'Sequence[Finding]') -> str:
    """Return what the checks came to, as markup: how many, and which have failed."""
    failed = [finding.about for finding in findings if finding.level == 'FAIL']
    warned = sum(finding.level == 'CAUTION' for finding in findings)
    colour = COLOURS['FAIL' if failed else 'CAUTION' if warned else 'OK']
    named = f': {", ".join(failed)}' if failed else ''
    counts = f'{len(failed)} failed{named}; {warned} warning{"s" * (warned != 1)}'
    return f'[{colour}]{len(findings)} checks[/]: {escape(counts)}'


def tell(console: Console, level: str, about: str, seen: str, do: str) -> None:
    """Print one finding."""
    advice = f' [dim]->[/] {escape(do)}' if do else ''
    text = f'[{COLOURS[level]}]{level:<7}[/] {escape(about)}: {escape(seen)}{advice}'
    say(console, text, 0, 8)


__all__ = ['CONTEXT', 'doctor']


def doctor(
    context: typer.Context,
    bag: Annotated[
        Path | None,
        typer.Argument(
            help='Recording to check; without one, the live robot.',
            autocompletion=recordings_like,
        ),
    ] = None,
    config: ConfigFile = None,
    urdf: UrdfFile = None,
    seconds: Annotated[float, typer.Option(help='How long to listen.')] = 5.0,
    everything: Annotated[
        bool, typer.Option('--all', help='Read a long recording to its end, not its beginning.')
    ] = False,
) -> None:
    """Check a set-up: ROS, topics, rates, QoS, joint names, IMU. One line each, with advice.

    Let the robot stand still meanwhile. Of a recording, the same checks look where it stood still,
    and what evaluate finds wrong with its inputs is told too. The exit code is 0 if no check fails,
    1 if one does, 2 if a recording cannot be read.

    \b
    Examples:
      ugv-acceptance doctor
      ugv-acceptance doctor bags/packbot_pass
      ugv-acceptance doctor -c my_robot.yaml --seconds 10 --ros-args -r __ns:=/r1
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    # Where no recording is given, click takes --ros-args for it.
    if bag is not None and str(bag) == '--ros-args':
        context.args, bag = [str(bag), *context.args], None
    arguments = ros_arguments(context)
    if bag is not None:
        raise typer.Exit(read(bag, config, urdf, everything=everything))
    raise typer.Exit(consult(config, urdf, seconds, arguments))
