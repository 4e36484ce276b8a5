"""`ugv-acceptance run`: carries out a test plan on a simulated or a real robot and judges it."""

from pathlib import Path
from typing import Annotated

import typer

from ugv_acceptance.cli.completion import FAULTS, steps_like, words_like
from ugv_acceptance.cli.options import CONTEXT, ConfigFile, ros_arguments

__all__ = ['CONTEXT', 'run']


def run(
    context: typer.Context,
    plan: Annotated[
        Path | None,
        typer.Argument(help='A plan made by `ugv-acceptance plan`; none: its --short one.'),
    ] = None,
    *,
    sim: Annotated[bool, typer.Option('--sim', help='Start a simulated robot and use it.')] = False,
    robot: Annotated[
        bool, typer.Option('--robot', help='Send trajectories to the arm controller of a robot.')
    ] = False,
    operator: Annotated[
        bool, typer.Option('--operator', help='A person moves the robot and is told how.')
    ] = False,
    fast: Annotated[
        bool,
        typer.Option('--fast', help='With --sim: in simulated time, as fast as it goes, no ROS.'),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option('--out', '-o', help='New folder for recordings and results. [default: run]'),
    ] = None,
    resume: Annotated[
        bool, typer.Option('--resume', help='Continue an interrupted run in that folder.')
    ] = False,
    only: Annotated[
        list[str] | None,
        typer.Option(
            help='Only this step or group; may be given several times.', autocompletion=steps_like
        ),
    ] = None,
    skip: Annotated[
        list[str] | None,
        typer.Option(
            help='Leave out this step or group; may be given several times.',
            autocompletion=steps_like,
        ),
    ] = None,
    config: ConfigFile = None,
    attempts: Annotated[
        int,
        typer.Option(
            min=1, max=100, help='How often a step is tried if messages were missing in it.'
        ),
    ] = 5,
    seed: Annotated[int, typer.Option(min=0, help='Seed of the simulated sensors.')] = 1,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            help='A fault of the simulated robot, written as for simulate, angles as 30deg.',
            autocompletion=words_like(*FAULTS),
        ),
    ] = None,
) -> None:
    """Carry out a plan's steps: move, hold, record, and judge each by its recording.

    Motion freezes at any alert a step does not expect, and when the monitor falls silent. The exit
    code is 0 for PASS, 1 for FAIL, 2 for bad input, 3 for INCONCLUSIVE or interrupted.

    \b
    Examples:
      ugv-acceptance run --sim
      ugv-acceptance run plan.yaml --sim --fast --out out/sim --skip endurance
      ugv-acceptance run plan.yaml --robot --out runs/robot7
      ugv-acceptance run plan.yaml --operator --out runs/robot7 --resume
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    modes = [name for name, on in (('sim', sim), ('robot', robot), ('operator', operator)) if on]
    if len(modes) != 1:
        raise typer.BadParameter(
            f'expected one of --sim, --robot, --operator, got {modes or "none"}'
        )
    if fast and not sim:
        raise typer.BadParameter('expected --fast with --sim: a real robot has its own time')
    if plan is None and not sim:
        raise typer.BadParameter('expected a plan for a robot; only --sim goes without one')
    from ugv_acceptance.cli.run_session import Asked, execute

    asked = Asked(
        plan=plan,
        mode=modes[0],
        out=out,
        fast=fast,
        resume=resume,
        only=tuple(only or ()),
        skip=tuple(skip or ()),
        config=config,
        attempts=attempts,
        seed=seed,
        faults=tuple(fault or ()),
        ros_args=tuple(ros_arguments(context)),
    )
    raise typer.Exit(execute(asked))
