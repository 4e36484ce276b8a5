"""The parts of `run`: a robot, a monitor, the runner between them, and the folder of the run."""

import fcntl
import math
import os
import random
import signal
import socket
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.markup import escape

from ugv_acceptance import AcceptanceError, BadConfig
from ugv_acceptance.cli.run_text import Steps, asking, print_result, say_stop

if TYPE_CHECKING:
    from ugv_acceptance.config import Config
    from ugv_acceptance.plan.plan import Plan, Step
    from ugv_acceptance.run.folder import RunFolder
    from ugv_acceptance.run.runner import Runner
    from ugv_acceptance.simulation.faults import Fault

EXIT = {'PASS': 0, 'FAIL': 1, 'INCONCLUSIVE': 3}
INTERRUPTED = 3
# Seconds for robot and monitor to be there.
START = 30.0
# ROS domains: above 101 DDS ports meet those Linux lends to any program.
DOMAINS = range(1, 102)


@dataclass(frozen=True, slots=True)
class Asked:
    """What the command line asks for; `mode` is sim, robot or operator."""

    plan: Path | None
    mode: str
    out: Path | None = None
    fast: bool = False
    resume: bool = False
    only: tuple[str, ...] = ()
    skip: tuple[str, ...] = ()
    config: Path | None = None
    attempts: int = 5
    seed: int = 1
    faults: tuple[str, ...] = ()
    ros_args: tuple[str, ...] = ()


def execute(asked: Asked) -> int:
    """Run the plan; return the exit code."""
    from ugv_acceptance.cli.kinds import RUN
    from ugv_acceptance.cli.outputs import check_folder, inputs_of
    from ugv_acceptance.config import load
    from ugv_acceptance.run.folder import open_folder

    config = load(asked.config)
    plan = plan_of(asked, config)
    chosen = steps_of(plan, asked)
    _faults(asked, config)
    mode = f'{asked.mode}-fast' if asked.fast else asked.mode
    out = folder_of(asked)
    check_folder('--out', out, RUN, inputs_of(config))
    folder = open_folder(out, plan, asked.plan, mode, config, resume=asked.resume)
    waiting = [step for step in chosen if folder.done(step) is None]
    console = Console(highlight=False)
    console.print(f'plan {escape(plan.plan)}, sha256 {plan.sha256}', soft_wrap=True)
    if plan.config_sha256 != config.sha256:
        console.print("[yellow]The plan was derived from another state of the robot's files.[/]")
    if len(waiting) < len(chosen):
        console.print(f'{len(chosen) - len(waiting)} of {len(chosen)} steps are done already')
    interrupted = bool(waiting) and _do(asked, config, folder, Steps(console, plan, waiting))
    with console.status('what the run has covered'):
        result = folder.finish(config, coverage(config, folder))
    folder.note('interrupted' if interrupted else 'finished', verdict=result['verdict'])
    print_result(result, folder, console)
    if interrupted:
        console.print('interrupted: --resume continues where it ended')
        return INTERRUPTED
    return EXIT[result['verdict']]


def plan_of(asked: Asked, config: 'Config') -> 'Plan':
    """Return the plan that was named, else the short one of the robot."""
    from ugv_acceptance.plan.derive import Wanted, derive
    from ugv_acceptance.plan.plan import read_plan

    if asked.plan is None:
        return derive(config, Wanted(short=True))
    return read_plan(asked.plan, config.settings.robot)


def folder_of(asked: Asked) -> Path:
    """Return the folder that was named, else the first of run, run-2, run-3 that is not there."""
    if asked.out is not None or asked.resume:
        return asked.out or Path('run')
    number = 1
    while (out := Path('run' if number == 1 else f'run-{number}')).exists():
        number += 1
    return out


def steps_of(plan: 'Plan', asked: Asked) -> list['Step']:
    """Return the steps asked for. Raises BadConfig for a name that is no step and no group."""
    names = {name for step in plan.steps for name in (step.id, step.group)}
    unknown = [name for name in (*asked.only, *asked.skip) if name not in names]
    if unknown:
        raise BadConfig(f'{plan.plan}: expected a step or a group of the plan, got {unknown[0]!r}')
    return [
        step
        for step in plan.steps
        if (not asked.only or {step.id, step.group} & set(asked.only))
        and not {step.id, step.group} & set(asked.skip)
    ]


def _do(asked: Asked, config: 'Config', folder: 'RunFolder', shown: Steps) -> bool:
    """Do the steps that wait; return whether that was interrupted."""
    world = _offline if asked.fast else _live
    with shown.bar, world(asked, config, folder, shown) as runner:
        for step in shown.waiting:
            shown.begin(step)
            result = runner.run(step)
            if result is None:
                return True
            shown.end(result)
            if runner.over:
                shown.console.print(f'[bold red]The run ends here:[/] {runner.over}')
                return True
    return False


@contextmanager
def _live(asked: Asked, config: 'Config', folder: 'RunFolder', shown: Steps) -> Iterator['Runner']:
    """Start the robot (if simulated), the monitor and the runner; end them all, come what may."""
    from ugv_acceptance.nodes.child import child
    from ugv_acceptance.nodes.guard import Guard, spinning
    from ugv_acceptance.nodes.running import ros
    from ugv_acceptance.run.hands import Hands
    from ugv_acceptance.run.runner import Runner

    args = list(asked.ros_args) or ['--ros-args']
    named = ['-p', f'config:={config.path}']
    with ExitStack() as stack:
        if asked.mode == 'sim':
            stack.enter_context(own_domain())
            simulated = [*args, *named, *_simulated(asked, config, folder)]
            stack.enter_context(child('simulator', simulated))
        stack.enter_context(child('monitor', [*args, *named]))
        stop = stack.enter_context(ros(list(asked.ros_args)))
        guard = Guard(
            config, lambda reason: say_stop(shown.console, reason), shown.moved, asked.mode
        )
        stack.callback(guard.destroy_node)
        stack.enter_context(spinning(guard))
        hands = Hands(guard, asked.mode, asking(shown.console))
        made = Runner(config, folder, guard, hands, lambda: stop.asked, asked.attempts)
        made.wait_for_all(START)
        yield made


@contextmanager
def _offline(
    asked: Asked, config: 'Config', folder: 'RunFolder', shown: Steps
) -> Iterator['Runner']:
    """Make robot, monitor and runner in this process and in simulated time."""
    from ugv_acceptance.run.hands import Hands
    from ugv_acceptance.run.offline import Offline
    from ugv_acceptance.run.runner import Runner
    from ugv_acceptance.run.virtual import VirtualRobot

    stopped: list[int] = []
    virtual = VirtualRobot(config, asked.seed, _faults(asked, config), _home(config, folder))
    before = {
        number: signal.signal(number, lambda number, _: stopped.append(number))
        for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        world = Offline(
            virtual,
            lambda reason: say_stop(shown.console, reason),
            shown.moved,
            lambda: bool(stopped),
        )
        hands = Hands(world, asked.mode, asking(shown.console))
        yield Runner(config, folder, world, hands, world.asked, asked.attempts)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def own_domain() -> Iterator[None]:
    """Take a ROS domain of this machine for oneself: nobody else's robot is heard or moved.

    A lock keeps out whoever asks the same way; a domain whose discovery port is taken is left.
    """
    for domain in random.SystemRandom().sample(DOMAINS, len(DOMAINS)):
        path = Path(tempfile.gettempdir(), f'ugv_acceptance_domain_{domain}.lock')
        with ExitStack() as held:
            try:
                lock = held.enter_context(path.open('wb'))
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                    probe.bind(('', 7400 + 250 * domain))
            except OSError:
                continue
            os.environ['ROS_DOMAIN_ID'] = str(domain)
            os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
            yield
            return
    raise AcceptanceError(f'expected a free ROS domain in {DOMAINS}, all are taken')


def _home(config: 'Config', folder: 'RunFolder') -> tuple[float, ...]:
    home = folder.plan.home_deg
    return tuple(math.radians(home.get(n, 0.0)) for n in config.settings.robot.joint_names)


def _faults(asked: Asked, config: 'Config') -> tuple['Fault', ...]:
    """Return the faults asked for. Raises BadConfig where a text is none."""
    from ugv_acceptance.run.fault_text import fault_from

    return tuple(fault_from(text, config.settings.robot) for text in asked.faults)


def _simulated(asked: Asked, config: 'Config', folder: 'RunFolder') -> list[str]:
    """Return the simulator's parameters."""
    positions = ', '.join(map(repr, _home(config, folder)))
    given = ['-p', f'seed:={asked.seed}', '-p', f'home:=[{positions}]']
    return [*given, *(['-p', f'faults:=[{", ".join(asked.faults)}]'] if asked.faults else [])]


def coverage(config: 'Config', folder: 'RunFolder') -> dict[str, Any]:
    """Return the coverage of all recordings in the folder, those of before a resume too."""
    from ugv_acceptance.run.coverage import coverage_of
    from ugv_acceptance.run.verdicts import seen_in

    recordings = [folder.path / 'steps' / s.id for s in folder.plan.steps if folder.done(s)]
    return coverage_of(config, [seen_in(path, config) for path in recordings if path.is_dir()])
