"""The parts of `run`: a robot, a monitor, the runner between them, and what is said on the way."""

import math
import os
import random
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.markup import escape
from rich.progress import Progress, TextColumn

from ugv_acceptance import BadConfig

if TYPE_CHECKING:
    from ugv_acceptance.config import Config
    from ugv_acceptance.nodes.runner import Runner
    from ugv_acceptance.plan.plan import Plan, Step
    from ugv_acceptance.run.folder import RunFolder

EXIT = {'PASS': 0, 'FAIL': 1, 'INCONCLUSIVE': 3}
INTERRUPTED = 3
# Seconds for robot and monitor to be there.
START = 30.0
COLOURS = {'PASS': 'green', 'FAIL': 'red', 'INCONCLUSIVE': 'yellow', 'SKIPPED': 'dim'}


@dataclass(frozen=True, slots=True)
class Asked:
    """What the command line asks for; `mode` is sim, robot or operator."""

    plan: Path
    mode: str
    out: Path
    resume: bool = False
    only: tuple[str, ...] = ()
    skip: tuple[str, ...] = ()
    config: Path | None = None
    seed: int = 1
    faults: tuple[str, ...] = ()
    ros_args: tuple[str, ...] = ()


def execute(asked: Asked) -> int:
    """Run the plan; return the exit code."""
    from ugv_acceptance.config import load
    from ugv_acceptance.plan.plan import read_plan
    from ugv_acceptance.run.folder import open_folder

    config = load(asked.config)
    plan = read_plan(asked.plan, config.settings.robot)
    chosen = steps_of(plan, asked)
    folder = open_folder(asked.out, plan, asked.plan, asked.mode, config, resume=asked.resume)
    waiting = [step for step in chosen if folder.done(step) is None]
    console = Console(highlight=False)
    console.print(f'plan {escape(plan.plan)}, sha256 {plan.sha256}', soft_wrap=True)
    if plan.config_sha256 != config.sha256:
        console.print("[yellow]The plan was derived from another state of the robot's files.[/]")
    if len(waiting) < len(chosen):
        console.print(f'{len(chosen) - len(waiting)} of {len(chosen)} steps are done already')
    interrupted = bool(waiting) and _live(asked, config, folder, waiting, console)
    result = folder.finish(config, coverage(config, folder))
    return conclude(result, folder, console, interrupted=interrupted)


def steps_of(plan: 'Plan', asked: Asked) -> list['Step']:
    """Return the steps asked for. Raises BadConfig for a name that is no step and no group."""
    names = {name for step in plan.steps for name in (step.id, step.group)}
    unknown = [name for name in (*asked.only, *asked.skip) if name not in names]
    if unknown:
        raise BadConfig(f'{asked.plan}: expected a step or a group of the plan, got {unknown[0]!r}')
    return [
        step
        for step in plan.steps
        if (not asked.only or {step.id, step.group} & set(asked.only))
        and not {step.id, step.group} & set(asked.skip)
    ]


def _live(
    asked: Asked, config: 'Config', folder: 'RunFolder', waiting: list['Step'], console: Console
) -> bool:
    """Do the steps that wait; return whether that was interrupted."""
    if asked.mode == 'sim':
        # Nobody else's robot moves, nobody else's messages are recorded.
        os.environ['ROS_DOMAIN_ID'] = str(random.SystemRandom().randint(1, 101))
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    with runner(asked, config, folder, console) as made, _bar(len(waiting), console) as bar:
        for step in waiting:
            bar.update(bar.task_ids[0], description=escape(step.id))
            result = made.run(step)
            if result is None:
                return True
            bar.advance(bar.task_ids[0])
            _print_step(result, console)
            if made.guard.watched.dead:
                console.print('[bold red]The monitor is dead: the run ends here.[/]')
                return True
    return False


@contextmanager
def runner(
    asked: Asked, config: 'Config', folder: 'RunFolder', console: Console
) -> Iterator['Runner']:
    """Start the robot (if simulated), the monitor and the runner; end them all, come what may."""
    from ugv_acceptance.nodes.child import child
    from ugv_acceptance.nodes.guard import Guard
    from ugv_acceptance.nodes.hands import Hands
    from ugv_acceptance.nodes.runner import Runner, spinning
    from ugv_acceptance.nodes.running import ros

    args = list(asked.ros_args) or ['--ros-args']
    named = ['-p', f'config:={config.path}']
    with ExitStack() as stack:
        if asked.mode == 'sim':
            stack.enter_context(
                child('simulator', [*args, *named, *_simulated(asked, config, folder)])
            )
        stack.enter_context(child('monitor', [*args, *named]))
        stop = stack.enter_context(ros(list(asked.ros_args)))
        guard = Guard(config, lambda reason: _say_stop(console, reason))
        stack.callback(guard.destroy_node)
        stack.enter_context(spinning(guard))
        hands = Hands(guard, asked.mode, _ask)
        made = Runner(config, folder, guard, hands, stop)
        made.wait_for_all(START)
        yield made


def _simulated(asked: Asked, config: 'Config', folder: 'RunFolder') -> list[str]:
    """Return the simulator's parameters."""
    home = folder.plan.home_deg
    positions = [math.radians(home.get(n, 0.0)) for n in config.settings.robot.joint_names]
    given = ['-p', f'seed:={asked.seed}', '-p', f'home:=[{", ".join(map(repr, positions))}]']
    return [*given, *(['-p', f'faults:=[{", ".join(asked.faults)}]'] if asked.faults else [])]


def _ask(text: str) -> None:
    sys.stderr.write(f'\n{text}\npress Enter when it is done: ')
    sys.stderr.flush()
    sys.stdin.readline()


def _say_stop(console: Console, reason: str) -> None:
    console.print(f'[bold red]STOP[/] motion is frozen: {escape(reason)}', soft_wrap=True)


def _bar(total: int, console: Console) -> Progress:
    bar = Progress(
        *Progress.get_default_columns(),
        TextColumn('{task.completed:.0f} of {task.total:.0f} steps'),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )
    bar.add_task('starting', total=total)
    return bar


def _print_step(result: dict[str, Any], console: Console) -> None:
    verdict = result['verdict']
    console.print(f'[{COLOURS[verdict]}]{verdict:<13}[/]{escape(result["id"])}', soft_wrap=True)
    if verdict != 'PASS':
        for reason in result['reasons']:
            console.print(f'             {escape(reason)}', soft_wrap=True)


def coverage(config: 'Config', folder: 'RunFolder') -> dict[str, Any]:
    """Return the coverage of all recordings in the folder, those of before a resume too."""
    from ugv_acceptance.run.coverage import coverage_of
    from ugv_acceptance.run.verdicts import seen_in

    recordings = [folder.path / 'steps' / s.id for s in folder.plan.steps if folder.done(s)]
    return coverage_of(config, [seen_in(path, config) for path in recordings if path.is_dir()])


def conclude(
    result: dict[str, Any], folder: 'RunFolder', console: Console, *, interrupted: bool
) -> int:
    """Print what came of the run; return the exit code."""
    counts = ', '.join(f'{count} {word}' for word, count in result['counts'].items() if count)
    verdict, covered = result['verdict'], result['coverage']
    console.print(f'[bold {COLOURS[verdict]}]{verdict}[/]: {counts}')
    console.print(
        '{cells_visited} of {cells_reachable} cells of the failure map visited'.format(**covered)
    )
    console.print(f'{escape(str(folder.path))}/report.txt, result.json, steps/', soft_wrap=True)
    if interrupted:
        console.print('interrupted: --resume continues where it ended')
        return INTERRUPTED
    return EXIT[verdict]
