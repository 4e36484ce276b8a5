"""`ugv-acceptance model`: shows the robot as its files describe it, and margins in one posture."""

from typing import Annotated

import typer

from ugv_acceptance import BadConfig
from ugv_acceptance.cli.completion import joints_like, poses_like
from ugv_acceptance.cli.options import ConfigFile, PayloadMass, UrdfFile


def model(
    config: ConfigFile = None,
    urdf: UrdfFile = None,
    posture: Annotated[
        str,
        typer.Option(
            help='POSE or joint=30deg,... or POSE,joint=30deg,...; left out: at 0, or amid a range '
            'without it.',
            autocompletion=poses_like,
        ),
    ] = '',
    tilt: Annotated[
        str,
        typer.Option(
            help='Tilt of the base: roll=10deg,pitch=5deg; positive pitch lowers the front.'
        ),
    ] = '',
    payload: PayloadMass = '',
    power_loss: Annotated[
        bool,
        typer.Option(
            '--power-loss', help='Simulate in MuJoCo whether limp joints tip the robot from here.'
        ),
    ] = False,
    braked: Annotated[
        str,
        typer.Option(
            help='With --power-loss: joints whose brakes close without power, NAME,NAME.',
            autocompletion=joints_like,
        ),
    ] = '',
    as_json: Annotated[bool, typer.Option('--json', help='Print JSON, not tables.')] = False,
) -> None:
    """Print the robot as configured, and its margins in one posture.

    Links, masses, joints, limits, contact points, support polygon, tilt left to each side.

    \b
    Examples:
      ugv-acceptance model
      ugv-acceptance model --posture shoulder_joint=30deg,flipper_joint=180deg
      ugv-acceptance model -c packbot_eod --posture STOW,shoulder_joint=90deg
      ugv-acceptance model --tilt roll=10deg,pitch=-5deg --payload 2
      ugv-acceptance model --posture shoulder_joint=60deg --power-loss
      ugv-acceptance model --config my_robot.yaml --urdf my_robot.urdf --json
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.cli.model_text import print_tables
    from ugv_acceptance.cli.power_loss import describe_power_loss, print_power_loss
    from ugv_acceptance.cli.robot_description import describe, payload_doubts, warn
    from ugv_acceptance.config import load

    loaded = load(config, urdf=urdf)
    description = describe(loaded, posture, tilt, payload)
    warn(payload_doubts(loaded.settings.robot, payload))
    if braked and not power_loss:
        raise BadConfig('--braked: expected --power-loss beside it')
    if power_loss:
        description['power_loss'] = describe_power_loss(loaded, posture, tilt, payload, braked)
    if as_json:
        import json

        typer.echo(json.dumps(description, indent=2))
    else:
        print_tables(description)
        if power_loss:
            print_power_loss(description['power_loss'])
