"""`ugv-acceptance speed`: prints the joint speeds up to which the static model holds."""

from typing import TYPE_CHECKING, Annotated

import typer

from ugv_acceptance.cli.completion import poses_like
from ugv_acceptance.cli.options import PayloadMass, RobotFile

if TYPE_CHECKING:
    from ugv_acceptance.model.robot import Robot
    from ugv_acceptance.type_aliases import Floats


# Letters of a joint's name, for a table of 80 columns.
_NAME = 58


def speed(
    config: RobotFile = None,
    posture: Annotated[
        str,
        typer.Option(
            help='Posture held while each joint turns: joint=30deg,...; by default all postures.',
            autocompletion=poses_like,
        ),
    ] = '',
    payload: PayloadMass = '',
    reference: Annotated[
        float, typer.Option(help="The static model's own error, N m (rms): 1.0 as in the paper.")
    ] = 1.0,
    critical: Annotated[
        float,
        typer.Option(help='F above which the static model is rejected; 0: at 5 %, by --samples.'),
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
        warn,
    )
    from ugv_acceptance.config import load
    from ugv_acceptance.studies.validity import critical_value, speed_limit

    robot = load(config).settings.robot
    _check(robot)
    if reference <= 0.0:
        raise BadConfig(f'--reference: expected an error > 0 N m, got {reference:g}')
    load_carried, doubts = payload_from(robot, payload), payload_doubts(robot, payload)
    bound = critical or critical_value(samples=samples)
    if bound <= 1.0:
        raise BadConfig(f'--critical: expected a value > 1, got {bound:g}')
    limits = [
        float(speed_limit(robot, q, load_carried, reference, bound)[k])
        for k, q in enumerate(_postures(robot, posture, samples))
    ]
    warn(doubts)
    if as_json:
        known = [x if np.isfinite(x) else None for x in limits]
        pairs = [(robot.joint(n), x) for n, x in zip(robot.joint_names, known, strict=True)]
        turns = {j.name: x and math.degrees(x) for j, x in pairs if not j.slides}
        slides = {j.name: x for j, x in pairs if j.slides}
        document = {'critical_value': bound, 'speed_deg_s': turns, 'warnings': doubts}
        document |= {'speed_m_s': slides} if slides else {}
        typer.echo(json.dumps(document, indent=2))
        return
    _print(robot, limits, f'{load_carried.mass:g} kg, {_model_words(reference, bound)}')


def _model_words(reference: float, bound: float) -> str:
    return f'error of the static model {reference:g} N m, F < {bound:.4f}'


def _print(robot: 'Robot', limits: 'list[float]', given: str) -> None:
    from rich.markup import escape

    from ugv_acceptance.cli.terminal_output import console_of, say
    from ugv_acceptance.report.format import short_name

    console = console_of()
    say(console, escape(f'{robot.name}, {given}'))
    shown = [short_name(name, _NAME) for name in robot.joint_names]
    wide = max(24, *(len(name) + 1 for name in shown))
    for name, label, limit in zip(robot.joint_names, shown, limits, strict=True):
        console.print(escape(f'  {label:{wide}}{_speed(robot, name, limit)}'), soft_wrap=True)


def _check(robot: 'Robot') -> None:
    """Raise BadConfig for a robot whose joints do not move, or carry it as legs do."""
    from ugv_acceptance import BadConfig
    from ugv_acceptance.studies.axes import check_stands_still

    check_stands_still(robot, 'speed')
    if not robot.joint_names:
        raise BadConfig(
            f'speed: expected measured joints, {robot.name} has none: without joints that move, '
            'no speed of them bounds the static model'
        )


def _postures(robot: 'Robot', posture: str, samples: int) -> 'list[Floats]':
    """Return the postures (n, j) of each joint's motion: its sweep, or all that there are."""
    from ugv_acceptance.cli.robot_description import posture_from
    from ugv_acceptance.studies.postures import random_postures, sweeps

    if posture:
        return sweeps(robot, posture_from(robot, posture), samples)
    return [random_postures(robot, samples, seed=0)] * len(robot.joint_names)


def _speed(robot: 'Robot', name: str, limit: float) -> str:
    import math

    if not math.isfinite(limit):
        return '     any'
    slides = robot.joint(name).slides
    return f'{limit:8.3f} m/s' if slides else f'{math.degrees(limit):8.1f} deg/s'
