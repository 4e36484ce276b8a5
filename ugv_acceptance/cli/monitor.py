"""`ugv-acceptance monitor`: runs the live monitor from a plain shell."""

from pathlib import Path
from typing import Annotated

import typer

from ugv_acceptance.cli.options import CONTEXT, ConfigFile, UrdfFile, ros_arguments

__all__ = ['CONTEXT', 'monitor']


def monitor(
    context: typer.Context,
    config: ConfigFile = None,
    urdf: UrdfFile = None,
    every: Annotated[
        float, typer.Option(help='Seconds between lines where the output is no terminal.')
    ] = 5.0,
    plain: Annotated[
        bool, typer.Option('--plain', help='Print lines, even on a terminal.')
    ] = False,
) -> None:
    """Watch a robot: margins, verdict and alerts as they come. Ctrl-C ends.

    \b
    Examples:
      ugv-acceptance monitor
      ugv-acceptance monitor --config my_robot.yaml --ros-args -r __ns:=/robot1
      ugv-acceptance monitor --ros-args -p use_sim_time:=true -p publish_rate:=0.0
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.cli.monitor_text import watch
    from ugv_acceptance.cli.terminal_output import console_of

    watch(_text(config), _text(urdf), ros_arguments(context), console_of(), every, plain=plain)


def _text(path: Path | None) -> str | None:
    return None if path is None else str(path)
