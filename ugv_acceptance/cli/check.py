"""`ugv-acceptance check TRAJECTORY`: whether the arm may move so, with this load and ground."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape

from ugv_acceptance.cli.completion import poses_like
from ugv_acceptance.cli.options import (
    CONTEXT,
    GroundKinds,
    PayloadMass,
    RobotFile,
    ros_arguments,
)

if TYPE_CHECKING:
    from ugv_acceptance.config import Config
    from ugv_acceptance.evaluation.planned_motion import CheckedMotion, Conditions, Trajectory
    from ugv_acceptance.evaluation.planned_motion.answer import JointUse, TiltLeft

__all__ = ['CONTEXT', 'check']

VERSION = 1
# Exit codes by verdict.
CODES = {'PERMITTED': 0, 'REFUSED': 1, 'NOT_KNOWN': 3}


def check(
    context: typer.Context,
    trajectory: Annotated[
        Path,
        typer.Argument(
            help='YAML file of a JointTrajectory (-: standard input), or a recording with one.'
        ),
    ],
    config: RobotFile = None,
    posture: Annotated[
        str,
        typer.Option(
            help='Where the joints stand at the start: POSE or joint=30deg,...; the joints that '
            'move: without it at the first point.',
            autocompletion=poses_like,
        ),
    ] = '',
    tilt: Annotated[
        str,
        typer.Option(
            help='Tilt of the base: roll=10deg,pitch=5deg; positive pitch lowers the front. '
            'Without it, level.'
        ),
    ] = '',
    payload: PayloadMass = '',
    at: Annotated[
        str,
        typer.Option(
            help='Centre of gravity of the load in its link: 10cm,0,0; without it, as configured.'
        ),
    ] = '',
    ground: GroundKinds = None,
    topic: Annotated[
        str, typer.Option(help="The trajectory's topic in a recording, if it has several.")
    ] = '',
    when: Annotated[
        str, typer.Option(help='Which of a topic: the last one at that time, such as 12.5s.')
    ] = '',
    as_json: Annotated[bool, typer.Option('--json', help='Print JSON, not text.')] = False,
    live: Annotated[
        bool, typer.Option('--live', help='Ask the running monitor: the robot as it stands now.')
    ] = False,
) -> None:
    """May the arm move so? Judges a planned motion before the robot carries it out.

    Least tilt left, most torque, ranges, speeds and the ground along a JointTrajectory, the
    reaction of the moving arm included. It commands nothing.

    Exit codes: 0 permitted, 1 refused, 2 bad input or usage, 3 not known.

    \b
    Examples:
      ugv-acceptance check reach.yaml --posture flipper_joint=180deg
      ugv-acceptance check reach.yaml -c packbot_eod --posture STOW --payload 2
      ugv-acceptance check reach.yaml --payload 2.5kg --at 10cm,0,0 --json
      ugv-acceptance check reach.yaml --tilt roll=10deg,pitch=-5deg
      ugv-acceptance check reach.yaml -c my_robot.yaml --ground stairs
      ugv-acceptance check run/ --topic /arm_controller/joint_trajectory
      ugv-acceptance check reach.yaml --live --ros-args -r __ns:=/robot1
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.cli.check_request import conditions_of, ground_kind, trajectory_of
    from ugv_acceptance.cli.robot_description import payload_doubts, warn
    from ugv_acceptance.config import load
    from ugv_acceptance.evaluation.planned_motion import check_motion

    options = {'posture': posture, 'tilt': tilt, 'payload': payload, 'at': at}
    ros_args = ros_arguments(context)
    if live or ros_args:
        from ugv_acceptance.cli.check_live import check_live

        entered = [name for name, given in options.items() if given]
        entered += ['config'] * (config is not None) + ['ground'] * bool(ground)
        planned = trajectory_of(trajectory, topic, when)
        raise typer.Exit(check_live(planned, ros_args, entered, live=live, as_json=as_json))
    kind = ground_kind(ground)
    loaded = load(config)
    planned = trajectory_of(trajectory, topic, when)
    conditions = conditions_of(loaded.settings, planned, options, kind)
    warn(payload_doubts(loaded.settings.robot, payload))
    found = check_motion(loaded.settings, planned, conditions)
    told = conditions_words(loaded, conditions, options)
    if as_json:
        import json

        typer.echo(json.dumps(values_of(loaded, found, conditions, told), indent=2))
    else:
        print_answer(str(trajectory), loaded, planned, found, told)
    raise typer.Exit(CODES[found.verdict])


def conditions_words(
    loaded: 'Config', conditions: 'Conditions', options: dict[str, str]
) -> tuple[str, ...]:
    """Return the conditions in words, and which of them nobody entered."""
    from ugv_acceptance.cli.robot_description import tilt_from
    from ugv_acceptance.evaluation.ground import ground_words

    roll, pitch = (math.degrees(x) for x in tilt_from(options['tilt']))
    level = f'roll {roll:g} deg, pitch {pitch:g} deg'
    mass = conditions.payload.mass if conditions.payload else math.nan
    entered = '' if options['payload'] else ' (as configured)'
    kind = conditions.ground or loaded.settings.ground.kind
    return (
        level if options['tilt'] else 'level (not entered)',
        f'payload {mass:g} kg{entered}',
        f'ground {ground_words(kind)}',
    )


def print_answer(
    source: str,
    loaded: 'Config',
    planned: 'Trajectory',
    found: 'CheckedMotion',
    told: tuple[str, ...],
) -> None:
    """Print the answer: verdict, conditions, why not, least margins, what was not checked."""
    from ugv_acceptance.cli.terminal_output import console_of, say, shown_verdict

    console, points = console_of(), len(planned.times)
    say(console, shown_verdict(found.verdict.replace('_', ' '), source))
    say(console, escape(f'{loaded.name}; {"; ".join(told)}'), 2)
    for reason in found.reasons:
        say(console, escape(reason), 2)
    for caution in found.cautions:
        say(console, escape(f'CAUTION: {caution}'), 2)
    _print_margins(console, found, points)
    for text in found.not_checked:
        say(console, escape(f'NOT CHECKED: {text}'), 2)


def _print_margins(console: Console, found: 'CheckedMotion', points: int) -> None:
    """Print the least tilt left and the most torque of each joint."""
    from ugv_acceptance.cli.terminal_output import print_table, say, table_of
    from ugv_acceptance.evaluation.margin_words import number_beside, share_words, tipping_words
    from ugv_acceptance.evaluation.planned_motion.words import when

    for text, tilt in (('least tilt', found.tilt), ('taken cautiously', found.cautious)):
        if tilt is not None:
            place = when(tilt.time, tilt.point, points)
            say(console, escape(f'{text}: {tipping_words(tilt.side, tilt.angle)} {place}'), 2)
    if not found.joints:
        return
    table = table_of('', 'joint', 'most torque', 'limit', 'used', 'at s', 'to point')
    for use in found.joints:
        unit = 'N' if use.slides else 'N m'
        table.add_row(
            escape(use.joint),
            f'{number_beside(use.torque, use.limit)} {unit}',
            f'{use.limit:g} {unit}',
            share_words(use.share),
            f'{use.time:.2f}',
            str(use.point),
        )
    print_table(console, table)


def values_of(
    loaded: 'Config', found: 'CheckedMotion', conditions: 'Conditions', told: tuple[str, ...]
) -> dict[str, Any]:
    """Return the answer as plain values: SI units, angles in keys that end in _deg."""
    from ugv_acceptance import __version__
    from ugv_acceptance.evaluation.permitted_limits import limits_hash

    load = conditions.payload
    return {
        'version': VERSION,
        'tool_version': __version__,
        'verdict': found.verdict,
        'reasons': list(found.reasons),
        'cautions': list(found.cautions),
        'tilt_left': _tilt(found.tilt),
        'tilt_left_cautious': _tilt(found.cautious),
        'joints': [_use(use) for use in found.joints],
        'not_checked': list(found.not_checked),
        'duration_s': found.duration,
        'moments': found.samples,
        'conditions': {
            'words': list(told),
            'gravity_mps2': conditions.gravity,
            'payload_kg': load.mass if load else None,
            'payload_cog_m': load.cog if load else None,
            'ground': conditions.ground or loaded.settings.ground.kind,
        },
        'config_sha256': loaded.sha256,
        'limits_hash': limits_hash(loaded.settings),
    }


def _tilt(tilt: 'TiltLeft | None') -> dict[str, Any] | None:
    if tilt is None:
        return None
    degrees = math.degrees(tilt.angle)
    return {'deg': degrees, 'side': tilt.side, 'time_s': tilt.time, 'point': tilt.point}


def _use(use: 'JointUse') -> dict[str, Any]:
    return {
        'joint': use.joint,
        'torque': use.torque,
        'limit': use.limit,
        'unit': 'N' if use.slides else 'N m',
        'share': use.share,
        'time_s': use.time,
        'point': use.point,
    }
