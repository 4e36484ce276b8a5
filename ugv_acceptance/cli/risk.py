"""`ugv-acceptance risk`: the probability that a joint saturates or the robot tips."""

from pathlib import Path
from typing import Annotated

import typer

from ugv_acceptance.cli.completion import poses_like
from ugv_acceptance.cli.options import RobotFile


def risk(
    config: RobotFile = None,
    posture: Annotated[
        str,
        typer.Option(
            help='Posture: POSE or joint=30deg,...; if left out, the arm anywhere in its range.',
            autocompletion=poses_like,
        ),
    ] = '',
    vary: Annotated[
        list[str] | None,
        typer.Option(
            help='NAME=LOW..HIGH (uniform) or NAME=MEAN+-SD (normal), angles as 10deg, rates as '
            '7deg/s; may be given again.'
        ),
    ] = None,
    mission: Annotated[
        Path | None, typer.Option(help='JSON with phases: name, posture, vary, times.')
    ] = None,
    samples: Annotated[
        float, typer.Option(min=100, max=1e11, help='Number of samples, such as 1e6.')
    ] = 1e6,
    seed: Annotated[int, typer.Option(min=0, help='The same seed gives the same numbers.')] = 0,
    workers: Annotated[
        int, typer.Option(min=1, help='Number of processes; used from 4e6 samples on.')
    ] = 2,
    as_json: Annotated[bool, typer.Option('--json', help='Print JSON, not tables.')] = False,
) -> None:
    """Estimate the probability that a joint saturates or the robot tips, by random sampling.

    Slope, heading, load, masses, posture and rates are drawn at random. Without --vary, the slope
    is uniform from 0 to 30 deg, heading any, the payload from 0 to the configured one, rates normal
    with a standard deviation of 7.2 deg/s, masses and centres of gravity as the configuration's
    `uncertainty` says. Names to vary: slope, heading, JOINT.position, JOINT.rate, JOINT.limit,
    JOINT.x, LINK.mass, LINK.x, payload.mass, payload.x, and the like with y and z.

    \b
    Examples:
      ugv-acceptance risk
      ugv-acceptance risk --posture shoulder_joint=60deg --vary slope=0deg..20deg
      ugv-acceptance risk --vary payload.mass=4kg+-0.2kg --samples 1e8
      ugv-acceptance risk --mission mission.json --json
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    import json

    from rich.markup import escape

    from ugv_acceptance.cli.risk_study import (
        as_document,
        doubts,
        mission_lines,
        phase_lines,
        phases_from,
    )
    from ugv_acceptance.cli.robot_description import warn
    from ugv_acceptance.cli.terminal_output import console_of, progress, say, while_read
    from ugv_acceptance.config import load
    from ugv_acceptance.studies.risk import run

    phases = phases_from(load(config), posture, vary or [], mission)
    warn(doubted := doubts(phases))
    count = int(samples)
    results = []
    for phase in phases:
        with progress(phase.name, count, 'samples') as reached:
            results.append(
                run(phase.study, count, seed, workers, lambda done, told=reached: told(done, ''))  # type: ignore[misc]
            )
    if as_json:
        typer.echo(json.dumps(as_document(phases, results) | {'warnings': doubted}, indent=2))
        return
    texts = [phase_lines(phase, found) for phase, found in zip(phases, results, strict=True)]
    # The answer once more, where it does not scroll away.
    texts += [mission_lines(phases, results)] if mission is not None else [texts[0][:1]]
    with while_read():
        for line in (line for text in texts for line in text):
            say(console_of(), escape(line), 0, len(line) - len(line.lstrip()) + 4)
