"""`ugv-acceptance monitor`: the live monitor from a plain shell."""

from pathlib import Path
from typing import Annotated

import typer

from ugv_acceptance.cli.ros_arguments import CONTEXT, ros_arguments

__all__ = ['CONTEXT', 'monitor']


def monitor(
    context: typer.Context,
    config: Annotated[
        Path | None,
        typer.Option('--config', '-c', help='YAML file, or the name of one that ships: packbot.'),
    ] = None,
    urdf: Annotated[
        Path | None, typer.Option(help='URDF in place of the one the YAML names.')
    ] = None,
    every: Annotated[
        float, typer.Option(help='Seconds between lines where the output is no terminal.')
    ] = 5.0,
    plain: Annotated[bool, typer.Option('--plain', help='Lines, also on a terminal.')] = False,
) -> None:
    """Watch a robot: margins, verdict and alerts as they come. Ctrl-C ends.

    \b
    Examples:
      ugv-acceptance monitor
      ugv-acceptance monitor --config my_robot.yaml --ros-args -r __ns:=/robot1
      ugv-acceptance monitor --ros-args -p use_sim_time:=true -p publish_rate:=0.0
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from rich.console import Console

    from ugv_acceptance.cli.live_view import watch

    # None: whether the output is a terminal decides.
    console = Console(highlight=False, force_terminal=False if plain else None)
    watch(_text(config), _text(urdf), ros_arguments(context), console, every)


def _text(path: Path | None) -> str | None:
    return None if path is None else str(path)
