"""`ugv-acceptance model`: what the tool believes the robot is, and its margins in one posture."""

from pathlib import Path
from typing import Annotated

import typer


def model(
    config: Annotated[
        Path | None,
        typer.Option('--config', '-c', help='YAML file, or the name of one that ships: packbot.'),
    ] = None,
    urdf: Annotated[
        Path | None, typer.Option(help='URDF in place of the one the YAML names.')
    ] = None,
    posture: Annotated[str, typer.Option(help='joint=30deg,...; joints left out are at 0.')] = '',
    tilt: Annotated[
        str, typer.Option(help='roll=10deg,pitch=5deg; positive pitch lowers the front.')
    ] = '',
    payload: Annotated[str, typer.Option(help='Mass of the payload: 4 (kg) or "10 lb".')] = '',
    as_json: Annotated[bool, typer.Option('--json', help='Print JSON, not tables.')] = False,
) -> None:
    """Print what the tool believes the robot is, and its margins in one posture.

    Links, masses, joints, limits, contact points, support polygon, tilt left to each side.

    \b
    Examples:
      ugv-acceptance model
      ugv-acceptance model --posture shoulder_joint=30deg,flipper_joint=180deg
      ugv-acceptance model --tilt roll=10deg,pitch=-5deg --payload 2
      ugv-acceptance model --config my_robot.yaml --urdf my_robot.urdf --json
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.cli.robot_description import describe, payload_doubts, warn
    from ugv_acceptance.cli.robot_tables import print_tables
    from ugv_acceptance.config import load

    loaded = load(config, urdf=urdf)
    description = describe(loaded, posture, tilt, payload)
    warn(payload_doubts(loaded.settings.robot, payload))
    if as_json:
        import json

        typer.echo(json.dumps(description, indent=2))
    else:
        print_tables(description)
