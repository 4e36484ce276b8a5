"""The doctor's visit: is there ROS, what is heard, what it means."""

from importlib.util import find_spec
from pathlib import Path

from rich.console import Console
from rich.markup import escape

COLOURS = {'OK': 'bold green', 'WARN': 'bold yellow', 'FAIL': 'bold red'}
FINE, AILING = 0, 1
_NO_ROS = (
    'no rclpy: source /opt/ros/jazzy/setup.bash, or install the wheels: '
    'pip install ros-jazzy-rclpy ros-jazzy-rmw-fastrtps-cpp ros-jazzy-common-interfaces'
)


def consult(config: Path | None, urdf: Path | None, seconds: float, args: list[str]) -> int:
    """Print what is found and return the exit code: 1 where something fails."""
    from ugv_acceptance.config import load

    console = Console(highlight=False)
    if find_spec('rclpy') is None:
        tell(console, 'FAIL', 'ROS', 'not found', _NO_ROS)
        return AILING
    from ugv_acceptance.nodes.examination import examine
    from ugv_acceptance.nodes.listening import listen

    loaded = load(config, urdf=urdf)
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
