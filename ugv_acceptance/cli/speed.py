"""`ugv-acceptance speed`: prints the joint speeds up to which the static model holds."""

from typing import TYPE_CHECKING, Annotated

import typer

from ugv_acceptance.cli.options import PayloadMass, RobotFile, poses_like

if TYPE_CHECKING:
    from ugv_acceptance.model.robot import Robot


def speed(
    config: RobotFile = None,
    posture: Annotated[
        str,
        typer.Option(
            help='Posture held while each joint turns: POSE or joint=30deg,...; by default all.',
            autocompletion=poses_like,
        ),
    ] = '',
    payload: PayloadMass = '',
    reference: Annotated[
        float, typer.Option(help="The static model's own error, N m (rms): 1.0 as in the paper.")
    ] = 1.0,
    critical: Annotated[
        float, typer.Option(help='Critical value of F; 0: computed for 5 % and the samples.')
    ] = 0.0,
    samples: Annotated[int, typer.Option(min=3, help='Postures; the paper takes 201.')] = 201,
    as_json: Annotated[bool, typer.Option('--json', help='Print JSON, not a table.')] = False,
) -> None:
    """Print the speed of each joint, moving alone, up to which an F-test accepts the static model.

    Use the speeds as the `static_speed` limits of the monitor's configuration.

    \b
    Examples:
      ugv-acceptance speed
      ugv-acceptance speed --payload 0 --reference 0.5
      ugv-acceptance speed --posture shoulder_joint=30deg --critical 1.227
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    import json
    import math

    import numpy as np

    from ugv_acceptance import BadConfig
    from ugv_acceptance.cli.robot_description import (
        payload_doubts,
        payload_from,
        posture_from,
        warn,
    )
    from ugv_acceptance.config import load
    from ugv_acceptance.studies.axes import check_stands_still
    from ugv_acceptance.studies.postures import random_postures, sweeps
    from ugv_acceptance.studies.validity import critical_value, speed_limit

    robot = load(config).settings.robot
    check_stands_still(robot, 'speed')
    if not robot.joint_names:
        raise BadConfig(
            f'speed: expected measured joints, {robot.name} has none: without joints that move, '
            'no speed of them bounds the static model'
        )
    if reference <= 0.0:
        raise BadConfig(f'--reference: expected an error > 0 N m, got {reference:g}')
    load_carried, doubts = payload_from(robot, payload), payload_doubts(robot, payload)
    bound = critical or critical_value(samples=samples)
    if bound <= 1.0:
        raise BadConfig(f'--critical: expected a value > 1, got {bound:g}')
    if posture:
        sets = sweeps(robot, posture_from(robot, posture), samples)
    else:
        sets = [random_postures(robot, samples, seed=0)] * len(robot.joint_names)
    limits = [
        float(speed_limit(robot, q, load_carried, reference, bound)[k]) for k, q in enumerate(sets)
    ]
    warn(doubts)
    if as_json:
        degrees = [math.degrees(x) if np.isfinite(x) else None for x in limits]
        found = dict(zip(robot.joint_names, degrees, strict=True))
        document = {'critical_value': bound, 'speed_deg_s': found, 'warnings': doubts}
        typer.echo(json.dumps(document, indent=2))
        return
    typer.echo(
        f'{robot.name}, {load_carried.mass:g} kg, '
        f'error of the static model {reference:g} N m, F < {bound:.4f}'
    )
    wide = max(24, *(len(name) + 1 for name in robot.joint_names))
    for name, limit in zip(robot.joint_names, limits, strict=True):
        typer.echo(f'  {name:{wide}}{_speed(robot, name, limit)}')


def _speed(robot: 'Robot', name: str, limit: float) -> str:
    import math

    if not math.isfinite(limit):
        return '     any'
    slides = robot.joint(name).slides
    return f'{limit:8.3f} m/s' if slides else f'{math.degrees(limit):8.1f} deg/s'
