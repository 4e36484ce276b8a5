"""`ugv-acceptance simulate`: records a robot simulated in MuJoCo, faster than real time."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from ugv_acceptance.cli.completion import FAULTS, SCENARIOS, words_like
from ugv_acceptance.cli.options import ConfigFile
from ugv_acceptance.cli.outputs import check_folder, inputs_of
from ugv_acceptance.cli.terminal_output import (
    complain,
    console_of,
    progress,
    say,
    while_read,
    wrote,
)

if TYPE_CHECKING:
    from ugv_acceptance.model.robot import Robot
    from ugv_acceptance.run.record import Outcome

# Columns of a list's names.
_NAMES = 28
# Links that a warning names.
SHOWN = 8


def simulate(
    scenario: Annotated[
        str,
        typer.Argument(
            help='A scenario by name; --list says which there are.',
            autocompletion=words_like(*SCENARIOS),
        ),
    ] = 'gentle',
    seconds: Annotated[
        float | None,
        typer.Option(
            '--seconds', '-s', help='Simulated seconds; by default the length of the scenario.'
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help='The same seed gives the same messages.')] = 1,
    bag: Annotated[
        Path | None, typer.Option('--bag', '-o', help='New rosbag2 folder to record into.')
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            help='KIND[:SUBJECT][=AMOUNT][@START[-END]], times in s, an angle as 30deg; '
            'may be given several times.',
            autocompletion=words_like(*FAULTS),
        ),
    ] = None,
    config: ConfigFile = None,
    listed: Annotated[
        bool, typer.Option('--list', help='Print scenarios and faults and end.')
    ] = False,
) -> None:
    """Simulate a run and record it as its robot would: joint_states, imu/data, payload.

    Any robot on wheels or tracks; overreach, fetch, swing, reach, grasp and snatch need an arm. The
    exit code is 0 once a run is recorded, tipped over or not; `evaluate` judges the recording.

    \b
    Scenarios: gentle, overreach, fetch (fixed); work, tilt, swing, reach, grasp, snatch, dash,
    climb (drawn by --seed); fault-KIND (gentle with a fault) for every KIND of fault:
    dropped, late, reordered, duplicated, dead, nan, dead-encoder, frozen-encoder, effort-missing,
    imu-bias, wrong-mounting, identity-orientation, clock-jump, second-publisher, heavy-payload,
    weak-motor.

    \b
    Examples:
      ugv-acceptance simulate --list
      ugv-acceptance simulate overreach --seed 2 --bag out/overreach
      ugv-acceptance simulate tilt --config husky.yaml --bag out/tilt
      ugv-acceptance simulate work -s 600 --bag out/work --fault imu-bias@60-90
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    if listed:
        _print_list()
        return
    if bag is None:
        raise typer.BadParameter('expected a folder to record into, got none', param_hint='--bag')
    from ugv_acceptance.cli.output_kinds import RECORDING
    from ugv_acceptance.config import load
    from ugv_acceptance.run.catalogue import case_of
    from ugv_acceptance.run.fault_text import fault_from
    from ugv_acceptance.run.record import record

    loaded = load(config)
    check_folder('--bag', bag, RECORDING, inputs_of(loaded))
    robot = loaded.settings.robot
    faults = tuple(fault_from(text, robot) for text in fault or ())
    case = case_of(scenario, robot, seed, seconds, faults)
    say_balanced(robot)
    began = time.monotonic()
    with progress('simulating', case.scenario.duration) as reached:
        outcome = record(loaded, case, seed, bag, lambda done: reached(done, ''))
    _print_outcome(outcome, bag, outcome.seconds / (time.monotonic() - began))
    wrote(bag)


def say_balanced(robot: 'Robot') -> None:
    """Warn of links whose inertia MuJoCo would refuse."""
    from ugv_acceptance.simulation.inertia import balanced_links

    names = balanced_links(robot)
    if names:
        listed = ', '.join(names[:SHOWN]) + (', ...' if len(names) > SHOWN else '')
        complain(
            f'warning: the inertia of {listed} is not that of a rigid body: the simulation takes '
            'the mean of its three moments; static margins do not use it'
        )


def _print_list() -> None:
    from ugv_acceptance.run.catalogue import names
    from ugv_acceptance.simulation.faults import KINDS

    console = console_of()
    faults = {
        name: f'{kind.words}; subject: {kind.subject}' if kind.subject else kind.words
        for name, kind in KINDS.items()
    }
    with while_read():
        for title, rows in (('scenarios', names()), ('faults', faults)):
            say(console, f'[bold]{title}[/]')
            for name, words in rows.items():
                say(console, escape(f'{name:{_NAMES}}{words}'), 2, _NAMES + 2)


def _print_outcome(outcome: 'Outcome', bag: Path, speed: float) -> None:
    console, tipped = console_of(), outcome.tipped_at
    events = [f'{name} saturated at {at:.2f} s' for name, at in outcome.saturated_at.items()]
    if tipped < float('inf'):
        events.append(f'tipped over at {tipped:.2f} s')
    text = f'{bag}: {outcome.seconds:.1f} s, {outcome.messages} messages, {speed:.0f} x real time'
    say(console, escape(text))
    say(console, escape(f'truth: {"; ".join(events) or "nothing saturated, did not tip"}'))
