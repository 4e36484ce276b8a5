"""`ugv-acceptance plan`: derives a test plan and an operator's card from the robot's model."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ugv_acceptance.cli.options import ConfigFile, Overwrite, dash
from ugv_acceptance.cli.outputs import Output, check_outputs, inputs_of
from ugv_acceptance.cli.terminal_output import result_console, say, while_read, wrote

if TYPE_CHECKING:
    from rich.console import Console

    from ugv_acceptance.plan.plan import Plan, Step


def plan(
    *,
    out: Annotated[
        Path | None,
        typer.Option('--out', '-o', callback=dash, help='Write the plan to this YAML file.'),
    ] = None,
    card: Annotated[
        Path | None, typer.Option(help='Write the operator card to this HTML file.')
    ] = None,
    existing: Annotated[
        Path | None, typer.Option('--from', help='Take this plan instead of deriving one.')
    ] = None,
    config: ConfigFile = None,
    tilt: Annotated[
        str, typer.Option(help='Tilt of the ramp for the orientations, 1deg to 45deg.')
    ] = '10deg',
    points: Annotated[
        int, typer.Option(min=1, max=20, help='Points on each side of a boundary.')
    ] = 1,
    hours: Annotated[float, typer.Option(min=0.01, help='Length of the endurance part.')] = 6.0,
    short: Annotated[
        bool, typer.Option('--short', help='One step of each kind, for a demonstration.')
    ] = False,
    overwrite: Overwrite = False,
) -> None:
    """Derive what to test: worst postures, both sides of every limit, loads, speeds, endurance.

    Of a robot without an arm: ramps in every direction and driving. Steps that would exceed a
    limit are marked for simulation only. Without --out the steps are just listed.

    \b
    Examples:
      ugv-acceptance plan -o plan.yaml --card card.html
      ugv-acceptance plan --from plan.yaml --card card.html
      ugv-acceptance plan -c my_robot.yaml --tilt 15deg --points 3 -o plan.yaml
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.bag.atomic_files import write_text
    from ugv_acceptance.cli import output_kinds as kinds
    from ugv_acceptance.cli.robot_description import warn
    from ugv_acceptance.config import load
    from ugv_acceptance.plan.derive import Wanted, derive, notes_of
    from ugv_acceptance.plan.plan import plan_text, read_plan
    from ugv_acceptance.studies.axes import check_drives

    loaded = load(config)
    outputs = [Output('--out', out, kinds.PLAN), Output('--card', card, kinds.CARD)]
    check_outputs(outputs, inputs_of(loaded, plan=existing), overwrite=overwrite)
    check_drives(loaded.settings.robot, 'plan')
    if existing is not None:
        made = read_plan(existing, loaded.settings.robot)
    else:
        wanted = Wanted(_ramp(tilt), points=points, endurance=hours * 3600.0, short=short)
        made = derive(loaded, wanted)
        warn(f'{loaded.name}: {note}' for note in notes_of(loaded))
    with while_read():
        _print(made, result_console(out, card))
    if out is not None:
        write_text(out, plan_text(made))
    if card is not None:
        from ugv_acceptance.plan.card import card_of

        write_text(card, card_of(made, loaded))
    wrote(out, card)


def _ramp(tilt: str) -> float:
    """Return the tilt (rad) of the ramp. Raises BadConfig for an angle out of range."""
    import math

    from ugv_acceptance import BadConfig
    from ugv_acceptance.config import quantity

    angle = quantity(tilt, 'angle', f'--tilt {tilt}')
    if not 1.0 <= round(math.degrees(angle), 6) <= 45.0:
        raise BadConfig(f'--tilt: expected an angle from 1deg to 45deg, got {tilt}')
    return angle


def _print(made: 'Plan', console: 'Console') -> None:
    """Print the plan: how much there is to do, then each step by its id and what belongs to it."""
    from rich.markup import escape

    from ugv_acceptance.plan.order import duration
    from ugv_acceptance.report.format import time_text

    count = f'{len(made.steps)} step{"s" * (len(made.steps) != 1)}'
    length = time_text(duration(made), digits=2)
    summary = f'plan {escape(made.plan)}: {count}, {length} of motion and holding'
    say(console, summary)
    for step in made.steps:
        say(console, f'[bold]{escape(step.id)}[/]', 2)
        say(console, escape(_step(step)), 6, 6)
    say(console, f'{summary}\nsha256 {made.sha256}')


def _step(step: 'Step') -> str:
    """Return where a step is done, with what, and what is expected."""
    from ugv_acceptance.evaluation.alerts.messages import pattern_words
    from ugv_acceptance.evaluation.margin_words import share_words

    use, tilt = step.expected.get('use'), step.expected.get('tilt_left_deg')
    ground, must = step.ground, ', '.join(map(pattern_words, step.alerts.must))
    lies = f'{ground.orientation} {ground.tilt_deg:g} deg' if ground.tilt_deg else 'level'
    told = (
        f'{step.where}, {lies}, {step.payload_kg:g} kg',
        '' if use is None else f'use {share_words(use)}',
        '' if tilt is None else f'tilt left {tilt:.1f} deg',
        must and f'must raise {must}',
    )
    return '; '.join(filter(None, told))
