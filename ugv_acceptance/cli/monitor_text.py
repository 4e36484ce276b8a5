"""Runs the monitor in this process and shows what it says: lines, or a table drawn in place."""

import math
import time
from collections import Counter
from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from typing import TYPE_CHECKING

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.markup import escape
from rich.table import Table

from ugv_acceptance.cli.terminal_output import say
from ugv_acceptance.evaluation.alerts.messages import level_words
from ugv_acceptance.evaluation.ground import ground_words
from ugv_acceptance.report.format import short_name

if TYPE_CHECKING:
    from ugv_acceptance.monitoring.diagnostics import Status
    from ugv_acceptance.nodes.monitor.node import Monitor

# How often each alert was raised, by code, subject and level.
Raised = Counter[tuple[str, str, str]]

COLOURS = ('bold green', 'bold yellow', 'bold red', 'bold magenta')
# Columns before the words of a line.
_BEHIND = 21
# Lines of alerts that stay in sight under the table.
_SHOWN = 8


class Lines:
    """Prints every change of an alert, and the verdict when it changes and every few seconds."""

    def __init__(self, console: Console, every: float) -> None:
        self._console = console
        self._every = every
        self._next = 0.0
        self._level = -1
        self.began = time.monotonic()
        self.raised: Raised = Counter()

    def __call__(self, kind: str, status: 'Status') -> None:
        """Print an alert or a verdict of the monitor."""
        now = time.monotonic()
        if kind == 'alert':
            count(self.raised, status)
            self._print(now, status)
        elif status.level != self._level or now >= self._next:
            self._level, self._next = status.level, now + self._every
            self._print(now, status)

    def _print(self, now: float, status: 'Status') -> None:
        text = f'{now - self.began:8.2f} s  {mark(status.level)}  {escape(status.message)}'
        say(self._console, text, 0, _BEHIND)


class Panel:
    """A table of margins redrawn a few times a second, with alerts as lines below it."""

    def __init__(self, console: Console) -> None:
        self._live = Live(console=console, refresh_per_second=4, auto_refresh=False)
        self._lines: list[str] = []
        self._verdict = ''
        self.raised: Raised = Counter()

    def __enter__(self) -> 'Panel':  # noqa: PYI034 - Self is Python 3.11
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._live.stop()

    def __call__(self, kind: str, status: 'Status') -> None:
        """Keep an alert or a verdict of the monitor for the next drawing."""
        text = f'{mark(status.level)}  {escape(status.message)}'
        if kind == 'alert':
            count(self.raised, status)
            self._lines.append(f'[dim]{time.strftime("%H:%M:%S")}[/]  {text}')
            del self._lines[:-_SHOWN]
        else:
            self._verdict = text

    def draw(self, monitor: 'Monitor') -> None:
        """Draw the monitor's present state."""
        rows: list[RenderableType] = [
            self._verdict,
            table_of(monitor),
            *self._lines,
            '[dim]Ctrl-C ends[/]',
        ]
        self._live.update(Group(*rows), refresh=True)


def count(raised: Raised, status: 'Status') -> None:
    """Count an alert if the status says that it was raised."""
    said = status.values
    if said['state'] == 'raised':
        raised[str(said['code']), str(said['subject']), str(said['level'])] += 1


def mark(level: int) -> str:
    """Return a level as coloured text of fixed width, readable without colour too."""
    return f'[{COLOURS[level]}]{level_words(level):<7}[/]'


def table_of(monitor: 'Monitor') -> Table:
    """Return the newest margins of a monitor as a table."""
    table = Table(box=None, pad_edge=False, padding=(0, 2))
    for heading in ('margin', 'now', 'limit', 'left'):
        table.add_column(heading, justify='left' if heading == 'margin' else 'right')
    session = monitor.session
    margins = session.evaluator.margins if session else None
    if session is None or margins is None:
        table.add_row('no margins: an input is missing or cannot be used', '', '', '')
        return table
    settings = session.settings
    rows = zip(settings.robot.joint_names, margins.torque, settings.limits.torque, strict=True)
    for name, torque, limit in rows:
        if math.isfinite(limit):
            left = f'{limit - abs(torque):.1f}'
            table.add_row(escape(short_name(name)), f'{torque:.1f}', f'{limit:.1f}', left)
    if settings.judges_tilt:
        table.add_row('ground', ground_words(settings.ground.kind), '', '')
    most = '<= ' if settings.ground.rough else ''
    for side, angle in zip(('front', 'left', 'rear', 'right'), margins.angle, strict=True):
        least = math.degrees(settings.limits.tip_error)
        table.add_row(
            f'tip to the {side} (deg)', '', f'{least:.1f}', f'{most}{math.degrees(angle):.1f}'
        )
    return table


def watch(
    config: str | None,
    urdf: str | None,
    ros_args: list[str],
    console: Console,
    every: float = 5.0,
    until: Callable[[], bool] | None = None,
    *,
    plain: bool = False,
) -> Raised:
    """Run the monitor in this process until it is interrupted; return the alerts it raised.

    With `until`, it ends when that is true; an interrupt before that ends the process.
    """
    from ugv_acceptance.nodes.executor import end, ros, spin
    from ugv_acceptance.nodes.monitor.node import build

    panel = Panel(console) if console.is_terminal and not plain else None
    shown = panel or Lines(console, every)
    with ros(ros_args) as stop, panel or nullcontext():
        node = build(config, urdf, shown)
        node.bring_up()
        if panel is not None:
            node.create_timer(0.25, partial(panel.draw, node), clock=node.steady)
        spin(node, stop, until or (lambda: False))
        end(node)
        if until is not None:
            stop.leave()
    return shown.raised
