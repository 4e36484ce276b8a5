"""Options that several verbs share, and the arguments after --ros-args."""

from pathlib import Path
from typing import Annotated

import typer

from ugv_acceptance.cli.completion import GROUNDS, configs_like, words_like

# For the verbs that run nodes: what typer does not know is kept for ROS.
CONTEXT = {'allow_extra_args': True, 'ignore_unknown_options': True}

ConfigFile = Annotated[
    Path | None,
    typer.Option(
        '--config',
        '-c',
        help='YAML file, or the name of one that ships: packbot.',
        autocompletion=configs_like,
    ),
]
# The same where a verb is about a robot and reads no recording.
RobotFile = Annotated[
    Path | None,
    typer.Option(
        '--config',
        '-c',
        help='YAML file of the robot, or its name.',
        autocompletion=configs_like,
    ),
]
UrdfFile = Annotated[Path | None, typer.Option(help='URDF in place of the one the YAML names.')]
CriteriaFile = Annotated[
    Path | None,
    typer.Option(help='YAML file of criteria; without it the limits of the configuration.'),
]
GroundKinds = Annotated[
    list[str] | None,
    typer.Option(
        '--ground',
        help='Kind of ground: flat, uneven, stairs; for a time: stairs=12s..40s (repeatable).',
        autocompletion=words_like(*GROUNDS),
    ),
]
PayloadMass = Annotated[str, typer.Option(help='Mass of the payload: 4 (kg) or "10 lb".')]
Verbose = Annotated[
    bool, typer.Option('--verbose', '-v', help='Print all there is, not a dozen lines.')
]
Overwrite = Annotated[
    bool,
    typer.Option('--overwrite', help='Replace files that exist, whatever they are; never inputs.'),
]


def dash(path: Path | None) -> Path | None:
    """Return the path of an output: `-` is standard output."""
    return Path('/dev/stdout') if path == Path('-') else path


def ros_arguments(context: typer.Context) -> list[str]:
    """Return the arguments for ROS; a usage error for any that is not after --ros-args."""
    if context.args and context.args[0] != '--ros-args':
        raise typer.BadParameter(
            f'{context.args[0]!r} is not an option; arguments for ROS come after --ros-args'
        )
    return list(context.args)
