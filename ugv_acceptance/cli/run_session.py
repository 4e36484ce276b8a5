"""Sets `run` up: robot, monitor, runner and folder, and prints its progress."""

import fcntl
import math
import os
import random
import select
import signal
import socket
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.markup import escape
from rich.progress import Progress, TaskID

from ugv_acceptance import AcceptanceError, BadConfig
from ugv_acceptance.cli.terminal_output import (
    again,
    bar_on,
    console_of,
    said_of_work,
    say,
    say_list,
    shown_verdict,
    status,
    wrote,
)

if TYPE_CHECKING:
    from ugv_acceptance.config import Config
    from ugv_acceptance.plan.plan import Plan, Step
    from ugv_acceptance.run.folder import RunFolder
    from ugv_acceptance.run.runner import Runner
    from ugv_acceptance.simulation.faults import Fault


COLOURS = {'PASS': 'green', 'FAIL': 'red', 'INCONCLUSIVE': 'yellow', 'SKIPPED': 'dim'}
# Seconds a step takes besides what its plan says: set-up, ways home, the verdict.
BESIDES = 6.0


@dataclass(slots=True)
class Steps:
    """Shows the progress of the steps; `moved` takes the time (s) that passes in the run."""

    console: Console
    plan: 'Plan'
    waiting: 'Sequence[Step]'
    bar: Progress = field(init=False)
    _task: TaskID = field(init=False)
    _planned: list[float] = field(init=False)
    _number: int = 0
    _now: float = 0.0
    _began: float = 0.0

    def __post_init__(self) -> None:
        from ugv_acceptance.plan.order import durations

        known = dict(zip((s.id for s in self.plan.steps), durations(self.plan), strict=True))
        self._planned = [known[step.id] + BESIDES for step in self.waiting]
        self.bar = bar_on(self.console, '{task.fields[step]}')
        self.bar.disable = not self.console.is_terminal
        self._task = self.bar.add_task('starting', total=sum(self._planned), step='')

    def begin(self, step: 'Step') -> None:
        """Show which step is done now."""
        self._number += 1
        self._began = self._now
        text = f'step {self._number} of {len(self.waiting)}'
        self.bar.update(self._task, description=text, step=escape(step.id))

    def moved(self, now: float) -> None:
        """Advance the display to a time (s) of the run."""
        self._now = now
        if self._number:
            before, planned = self._planned[: self._number - 1], self._planned[self._number - 1]
            self.bar.update(self._task, completed=sum(before) + min(now - self._began, planned))

    def end(self, result: Mapping[str, Any]) -> None:
        """Print the result of the step."""
        self.bar.update(self._task, completed=sum(self._planned[: self._number]))
        verdict, width = result['verdict'], len(str(len(self.waiting)))
        number = f'{self._number:>{width}}/{len(self.waiting)}'
        tried = len(result['earlier']) + 1
        more = f' (attempt {tried})' if tried > 1 else ''
        line = f'{number} [{COLOURS[verdict]}]{verdict:<13}[/]{escape(result["id"])}{more}'
        behind = 2 * width + 2
        say(self.console, line, 0, behind)
        shown = result['reasons'] if verdict != 'PASS' else raised(result)
        for text in shown:
            say(self.console, escape(text), behind)


def raised(result: Mapping[str, Any]) -> list[str]:
    """Return the alerts raised during a step as one line; without alerts, no line."""
    from ugv_acceptance.evaluation.alerts.messages import pattern_words

    begin, _, end = result['window_s']
    during = [a for a in result['alerts'] if begin <= a['start_s'] <= end]
    told = dict.fromkeys(pattern_words('{level} {code} {subject}'.format(**a)) for a in during)
    return [f'raised: {", ".join(told)}'] if told else []


def say_stop(console: Console, reason: str) -> None:
    """Print at once that motion was frozen, and why."""
    say(console, f'[bold red]STOP[/] motion is frozen: {escape(reason)}')


def asking(console: Console) -> Callable[[str, Callable[[], bool]], bool]:
    """Return a function that asks a person to do something and returns whether it was done.

    Enter: done; s and Enter, or the end of the input: not done. It stops waiting once `going()` is
    false.
    """

    def ask(text: str, going: Callable[[], bool]) -> bool:
        say(console, f'[bold]{escape(text)}[/]')
        say(console, 'press Enter when it is done, s and Enter to skip this step')
        answer = b''
        while going():
            if not select.select([0], [], [], 0.1)[0]:
                continue
            letter = os.read(0, 1)
            if not letter:
                return False
            if letter == b'\n':
                return answer.strip().lower() not in {b's', b'skip'}
            answer += letter
        return False

    return ask


def print_result(result: Mapping[str, Any], folder: 'RunFolder', console: Console) -> None:
    """Print the result of the run: verdict, coverage, folder."""
    from ugv_acceptance.run.report import approaches, counts_of

    verdict, covered = result['verdict'], result['coverage']
    outcome = shown_verdict(verdict, counts_of(result))
    say(console, outcome)
    told = approaches(covered)
    if covered['joints']:
        text = '{cells_visited} of {cells_reachable} cells of the failure map visited'
        told = [text.format(**covered), *told]
    say_list(console, told, len(told), '', 2)
    say(console, outcome)
    made = ('result.json', 'report.txt', 'report.html', 'steps')
    wrote(*(folder.path / name for name in made))


EXIT = {'PASS': 0, 'FAIL': 1, 'INCONCLUSIVE': 3}
INTERRUPTED = 3
# Seconds for robot and monitor to be there.
START = 30.0
# ROS domains: above 101 DDS ports meet those Linux lends to any program.
DOMAINS = range(1, 102)


@dataclass(frozen=True, slots=True)
class Asked:
    """The options of the command line; `mode` is sim, robot or operator."""

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
    from ugv_acceptance.cli.output_kinds import RUN
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
    console = console_of()
    say(console, f'plan {escape(plan.plan)}, sha256 {plan.sha256}')
    if plan.config_sha256 != config.sha256:
        say(console, "[yellow]The plan was derived from another state of the robot's files.[/]")
    if len(waiting) < len(chosen):
        say(console, f'{len(chosen) - len(waiting)} of {len(chosen)} steps are done already')
    interrupted = bool(waiting) and _do(asked, config, folder, Steps(console, plan, waiting))
    with status('computing the coverage of the run'):
        result = folder.finish(config, coverage(config, folder))
    folder.note('interrupted' if interrupted else 'finished', verdict=result['verdict'])
    print_result(result, folder, console)
    if interrupted:
        _say_interrupted(asked, out, sum(folder.done(step) is not None for step in chosen), chosen)
        return INTERRUPTED
    return EXIT[result['verdict']]


def _say_interrupted(asked: Asked, out: Path, done: int, chosen: Sequence['Step']) -> None:
    """Say what a run has that was interrupted, and how to go on."""
    more = [*(() if asked.out else ('--out', str(out))), *(() if asked.resume else ('--resume',))]
    console = said_of_work()
    say(console, f'interrupted: {done} of {len(chosen)} steps are done. This goes on:')
    console.print(f'  {escape(again(*more))}', soft_wrap=True)


def plan_of(asked: Asked, config: 'Config') -> 'Plan':
    """Return the plan that was named, else the robot's short one."""
    from ugv_acceptance.plan.derive import Wanted, derive
    from ugv_acceptance.plan.plan import read_plan

    if asked.plan is None:
        return derive(config, Wanted(short=True))
    return read_plan(asked.plan, config.settings.robot)


def folder_of(asked: Asked) -> Path:
    """Return the folder that was named, else the first free one of run, run-2, run-3, ..."""
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
    """Do the steps that have no result yet; return whether that was interrupted."""
    world = _offline if asked.fast else _live
    with shown.bar, world(asked, config, folder, shown) as runner:
        for step in shown.waiting:
            shown.begin(step)
            result = runner.run(step)
            if result is None:
                return True
            shown.end(result)
            if runner.over:
                say(shown.console, f'[bold red]The run ends here:[/] {escape(runner.over)}')
                return True
    return False


@contextmanager
def _live(asked: Asked, config: 'Config', folder: 'RunFolder', shown: Steps) -> Iterator['Runner']:
    """Start the robot (if simulated), the monitor and the runner; always end them all."""
    from ugv_acceptance.nodes.executor import ros, spun_by_thread
    from ugv_acceptance.nodes.runner_world import Guard
    from ugv_acceptance.nodes.subprocess_node import child
    from ugv_acceptance.run.actuation import Hands
    from ugv_acceptance.run.runner import Runner

    args = list(asked.ros_args) or ['--ros-args']
    named = ['-p', f'config:={config.path}']
    with ExitStack() as stack:
        if asked.mode == 'sim':
            stack.enter_context(own_domain())
            simulated = [*args, *named, *_simulated(asked, config, folder)]
            stack.enter_context(child('packbot_simulator', simulated))
        stack.enter_context(child('monitor.node', [*args, *named]))
        stop = stack.enter_context(ros(list(asked.ros_args)))
        guard = Guard(
            config, lambda reason: say_stop(shown.console, reason), shown.moved, asked.mode
        )
        stack.callback(guard.destroy_node)
        stack.enter_context(spun_by_thread(guard))
        hands = Hands(guard, asked.mode, asking(shown.console))
        made = Runner(config, folder, guard, hands, lambda: stop.asked, asked.attempts)
        made.wait_for_all(START)
        yield made


@contextmanager
def _offline(
    asked: Asked, config: 'Config', folder: 'RunFolder', shown: Steps
) -> Iterator['Runner']:
    """Build robot, monitor and runner in this process, in simulated time."""
    from ugv_acceptance.run.actuation import Hands
    from ugv_acceptance.run.runner import Runner
    from ugv_acceptance.run.simulated_robot import VirtualRobot
    from ugv_acceptance.run.simulated_world import Offline

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
    """Take a ROS domain for this run alone: no other robot is heard or moved.

    A lock keeps out other runs; a domain whose discovery port is in use is not taken.
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
    """Return the faults asked for. Raises BadConfig where a text describes none."""
    from ugv_acceptance.run.fault_text import fault_from

    return tuple(fault_from(text, config.settings.robot) for text in asked.faults)


def _simulated(asked: Asked, config: 'Config', folder: 'RunFolder') -> list[str]:
    """Return the simulator's parameters as ROS arguments."""
    positions = ', '.join(map(repr, _home(config, folder)))
    given = ['-p', f'seed:={asked.seed}', '-p', f'home:=[{positions}]']
    return [*given, *(['-p', f'faults:=[{", ".join(asked.faults)}]'] if asked.faults else [])]


def coverage(config: 'Config', folder: 'RunFolder') -> dict[str, Any]:
    """Return the coverage by all recordings in the folder, also those from before a resume."""
    from ugv_acceptance.run.report import coverage_of
    from ugv_acceptance.run.step_verdict import seen_in

    recordings = [folder.path / 'steps' / s.id for s in folder.plan.steps if folder.done(s)]
    return coverage_of(config, [seen_in(path, config) for path in recordings if path.is_dir()])
