"""`ugv-acceptance doctor`: checks a ROS set-up and says what to do."""

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape

from ugv_acceptance.cli.options import CONTEXT, ConfigFile, UrdfFile, ros_arguments

COLOURS = {'OK': 'bold green', 'WARN': 'bold yellow', 'FAIL': 'bold red'}
FINE, AILING = 0, 1
_NO_ROS = (
    'no rclpy: source /opt/ros/jazzy/setup.bash, or install the wheels: '
    'pip install ros-jazzy-rclpy ros-jazzy-rmw-fastrtps-cpp ros-jazzy-common-interfaces'
)


def consult(config: Path | None, urdf: Path | None, seconds: float, args: list[str]) -> int:
    """Print the findings and return the exit code: 1 if any has failed."""
    console = Console(highlight=False)
    if find_spec('rclpy') is None:
        tell(console, 'FAIL', 'ROS', 'not found', _NO_ROS)
        return AILING
    from ugv_acceptance.nodes.doctor.checks import examine
    from ugv_acceptance.nodes.doctor.probe import listen
    from ugv_acceptance.nodes.monitor.own_description import load_live

    loaded = load_live(config, urdf, args)
    console.print(f'Listening for {seconds:g} s; let the robot stand still.')
    levels = []
    for finding in examine(listen(loaded.topics, seconds, args), loaded):
        tell(console, finding.level, finding.about, finding.seen, finding.do)
        levels.append(finding.level)
    failed, warned = levels.count('FAIL'), levels.count('WARN')
    console.print(f'{len(levels)} checks: {failed} failed, {warned} warnings')
    return AILING if failed else FINE


def tell(console: Console, level: str, about: str, seen: str, do: str) -> None:
    """Print one finding."""
    advice = f' [dim]->[/] {escape(do)}' if do else ''
    text = f'[{COLOURS[level]}]{level:<4}[/] {escape(about)}: {escape(seen)}{advice}'
    console.print(text, soft_wrap=True)


__all__ = ['CONTEXT', 'doctor']


def doctor(
    context: typer.Context,
    config: ConfigFile = None,
    urdf: UrdfFile = None,
    seconds: Annotated[float, typer.Option(help='How long to listen.')] = 5.0,
) -> None:
    """Check a set-up: ROS, topics, rates, QoS, joint names, IMU. One line each, with advice.

    Let the robot stand still meanwhile. The exit code is 0 if no check fails, else 1.

    \b
    Examples:
      ugv-acceptance doctor
      ugv-acceptance doctor -c my_robot.yaml --seconds 10 --ros-args -r __ns:=/r1
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.cli.doctor import consult

    raise typer.Exit(consult(config, urdf, seconds, ros_arguments(context)))
