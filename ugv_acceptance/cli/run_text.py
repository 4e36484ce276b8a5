"""What `run` says on the way: steps done, time left, what stopped it, what it covered."""

import os
import select
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

if TYPE_CHECKING:
    from ugv_acceptance.plan.plan import Plan, Step
    from ugv_acceptance.run.folder import RunFolder

COLOURS = {'PASS': 'green', 'FAIL': 'red', 'INCONCLUSIVE': 'yellow', 'SKIPPED': 'dim'}
# Seconds a step takes besides what its plan says: set-up, ways home, the verdict.
BESIDES = 6.0


@dataclass(slots=True)
class Steps:
    """Shows the steps as they are done; `moved` takes the time (s) that passes in the run."""

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
        self.bar = Progress(
            TextColumn('{task.description}'),
            BarColumn(bar_width=20),
            TimeRemainingColumn(compact=True),
            TextColumn('left  {task.fields[step]}'),
            console=self.console,
            transient=True,
            disable=not self.console.is_terminal,
        )
        self._task = self.bar.add_task('starting', total=sum(self._planned), step='')

    def begin(self, step: 'Step') -> None:
        """Show the step that is done now."""
        self._number += 1
        self._began = self._now
        text = f'step {self._number} of {len(self.waiting)}'
        self.bar.update(self._task, description=text, step=escape(step.id))

    def moved(self, now: float) -> None:
        """Take the time (s) of the run."""
        self._now = now
        if self._number:
            before, planned = self._planned[: self._number - 1], self._planned[self._number - 1]
            self.bar.update(self._task, completed=sum(before) + min(now - self._began, planned))

    def end(self, result: Mapping[str, Any]) -> None:
        """Print what came of the step."""
        self.bar.update(self._task, completed=sum(self._planned[: self._number]))
        verdict, width = result['verdict'], len(str(len(self.waiting)))
        number = f'{self._number:>{width}}/{len(self.waiting)}'
        tried = len(result['earlier']) + 1
        again = f' (attempt {tried})' if tried > 1 else ''
        line = f'{number} [{COLOURS[verdict]}]{verdict:<13}[/]{escape(result["id"])}{again}'
        self.console.print(line, soft_wrap=True)
        shown = result['reasons'] if verdict != 'PASS' else raised(result)
        for text in shown:
            self.console.print(f'{" " * (2 * width + 2)}{escape(text)}', soft_wrap=True)


def raised(result: Mapping[str, Any]) -> list[str]:
    """Return the alerts that a step raised while it was done, in one line; none: no line."""
    begin, _, end = result['window_s']
    during = [a for a in result['alerts'] if begin <= a['start_s'] <= end]
    told = dict.fromkeys('{level} {code} {subject}'.format(**a) for a in during)
    return [f'raised: {", ".join(told)}'] if told else []


def say_stop(console: Console, reason: str) -> None:
    """Say at once that motion was frozen."""
    console.print(f'[bold red]STOP[/] motion is frozen: {escape(reason)}', soft_wrap=True)


def asking(console: Console) -> Callable[[str, Callable[[], bool]], bool]:
    """Return what tells a person what to do and returns whether it was done.

    Enter: done; s and Enter, or the end of the input: not done. While it waits it hears `going`.
    """

    def ask(text: str, going: Callable[[], bool]) -> bool:
        console.print(f'[bold]{escape(text)}[/]', soft_wrap=True)
        console.print('press Enter when it is done, s and Enter to skip this step')
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
    """Print what came of the run: the verdict, what it covered, where it is."""
    from ugv_acceptance.run.report import approaches, counts_of

    verdict, covered = result['verdict'], result['coverage']
    console.print(f'[bold {COLOURS[verdict]}]{verdict}[/]: {counts_of(result)}', soft_wrap=True)
    console.print(
        '{cells_visited} of {cells_reachable} cells of the failure map visited'.format(**covered)
    )
    for line in approaches(covered):
        console.print(line, soft_wrap=True)
    console.print(
        f'{escape(str(folder.path))}/report.html, report.txt, result.json, steps/', soft_wrap=True
    )
