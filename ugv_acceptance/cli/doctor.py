"""`ugv-acceptance doctor`: checks a set-up and says what to do."""

from pathlib import Path
from typing import Annotated

import typer

from ugv_acceptance.cli.ros_arguments import CONTEXT, ros_arguments

__all__ = ['CONTEXT', 'doctor']


def doctor(
    context: typer.Context,
    config: Annotated[
        Path | None,
        typer.Option('--config', '-c', help='YAML file, or the name of one that ships: packbot.'),
    ] = None,
    urdf: Annotated[
        Path | None, typer.Option(help='URDF in place of the one the YAML names.')
    ] = None,
    seconds: Annotated[float, typer.Option(help='How long to listen.')] = 5.0,
) -> None:
    """Check a set-up: ROS, topics, rates, QoS, joint names, IMU. One line each, with advice.

    Let the robot stand still meanwhile. The exit code is 0 where all is OK or a warning, else 1.

    \b
    Examples:
      ugv-acceptance doctor
      ugv-acceptance doctor --config my_robot.yaml --seconds 10 --ros-args -r __ns:=/robot1
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.cli.consultation import consult

    raise typer.Exit(consult(config, urdf, seconds, ros_arguments(context)))
