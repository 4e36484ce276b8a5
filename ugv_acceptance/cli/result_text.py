"""Prints a result in a terminal: the verdict, its reasons, and the worst of each margin."""

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TextIO

from rich.console import Console
from rich.markup import escape
from rich.progress import Progress, TextColumn
from rich.table import Table

from ugv_acceptance.evaluation.alerts.messages import level_words
from ugv_acceptance.report.format import (
    assumed_line,
    carrying_lines,
    doubts_of,
    ground_line,
    is_bound,
    missing_text,
    not_checked_lines,
    number_text,
    origin_line,
)
from ugv_acceptance.report.training import training_lines

COLOURS = {'PASS': 'bold green', 'FAIL': 'bold red', 'INCONCLUSIVE': 'bold yellow'}
MARKS = {'PASS': '[OK]', 'FAIL': '[X]', 'INCONCLUSIVE': '[?]'}
_MOST_ALERTS = 12
_MOST_EFFORTS = 11
_MOST_WARNINGS = 6
# More messages than this have a rate, if they can be used.
_FEW = 100
# Said of an alert that rests only on a sensor found to be wrong.
DOUBTFUL = ' (by a sensor that is contradicted: it decides nothing)'
# Levels of alerts, the least severe first.
_SEVERITY = ('OK', 'WARN', 'STALE', 'ERROR')


@contextmanager
def progress_of(start: int, end: int, stream: TextIO) -> Iterator[Callable[[int], None]]:
    """Show how far a recording is read (log times, ns), if the output is a terminal."""
    console = Console(file=stream)
    if not console.is_terminal:  # a disabled bar of older rich still prints an empty line
        yield lambda _: None
        return
    with Progress(
        *Progress.get_default_columns(),
        TextColumn('{task.fields[seconds]:.0f} s of the recording'),
        console=console,
        transient=True,
    ) as progress:
        task = progress.add_task('reading', total=max(end - start, 1), seconds=0.0)

        def reached(now: int) -> None:
            progress.update(task, completed=now - start, seconds=(now - start) / 1e9)

        yield reached


@contextmanager
def while_read() -> Iterator[None]:
    """Print until the reader closes the pipe (`| head`), which changes no exit code."""
    try:
        yield
        sys.stdout.flush()
    except (BrokenPipeError, SystemExit):  # newer rich turns the first into the second
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def print_result(result: dict[str, Any], console: Console | None = None) -> None:
    """Print a result of `evaluate`."""
    console = console or Console(highlight=False)
    word = result['verdict']
    paths = result['bag']['path']
    heading = f'\n[{COLOURS[word]}]{escape(MARKS[word])} {word}[/]  {escape(paths[0])}'
    console.print(heading, soft_wrap=True)
    for reason in result['reasons'][:5]:
        console.print(f'    {escape(reason)}', soft_wrap=True)
    if len(result['reasons']) > 5:
        console.print(f'    and {len(result["reasons"]) - 5} more reasons')
    said = filter(None, (origin_line(result), assumed_line(result), ground_line(result)))
    for line in [*said, *training_lines(result)]:
        console.print(f'    {escape(line)}', soft_wrap=True)
    unchecked = not_checked_lines(result)
    if unchecked:
        console.print('    [bold]NOT CHECKED:[/]')
    for line in unchecked:
        console.print(f'      {escape(line)}', soft_wrap=True)
    for doubt in doubts_of(result):
        console.print(f'    [bold yellow]doubt:[/] {escape(doubt)}', soft_wrap=True)
    _print_warnings(result['robot']['warnings'] if 'robot' in result else (), console)
    if result['criteria']['path'] is not None:
        _print_criteria(result['criteria']['results'], console)
    console.print(_margins(result))
    for line in carrying_lines(result):
        console.print(escape(line), soft_wrap=True)
    _print_data(result, console)
    _print_alerts(result, console)
    if 'effort' in result:
        _print_effort(result, console)


def _print_warnings(warnings: Sequence[str], console: Console) -> None:
    """Print what is odd with the robot's own files: margins are only as good as these."""
    for text in warnings[:_MOST_WARNINGS]:
        console.print(f'    [bold yellow]warning:[/] {escape(text)}', soft_wrap=True)
    more = len(warnings) - _MOST_WARNINGS
    if more > 0:
        console.print(f'    and {more} more warnings (`ugv-acceptance model` lists them)')


def _print_criteria(outcomes: list[dict[str, Any]], console: Console) -> None:
    for outcome in outcomes:
        word = outcome['verdict']
        mark = f'[{COLOURS[word]}]{escape(MARKS[word]):5}[/]'
        text = f'{outcome["name"]}: {outcome["demand"]}'
        console.print(f'  {mark} {escape(text)}', soft_wrap=True)


def _margins(result: dict[str, Any]) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 2))
    for heading in ('margin', 'worst', 'limit', 'left', 'at', 'in violation'):
        table.add_column(heading, justify='left' if heading == 'margin' else 'right')
    for name, joint in result['torque'].items():
        unit = joint['unit']
        table.add_row(
            escape(name),
            _number(joint['max_abs'], unit),
            _number(joint['limit'], unit),
            _number(joint['min_margin'], unit),
            _number(joint['time_of_min_s'], 's'),
            _number(joint['time_in_violation_s'], 's', 2),
        )
    stability = result['stability']
    unread = result['inputs']['imu']['topic'] is None
    edge = 'not checked' if unread else stability['edge'] or 'no polygon'
    table.add_row(
        f'tip-over ({edge})',
        '',
        '',
        ('<= ' if is_bound(result) else '') + _number(stability['min_angle_deg'], 'deg'),
        _number(stability['time_of_min_s'], 's'),
        _number(stability['time_in_violation_s'], 's', 2),
    )
    return table


def _number(value: float | None, unit: str, digits: int = 1) -> str:
    return '-' if value is None else f'{value:.{digits}f} {unit}'


def _print_data(result: dict[str, Any], console: Console) -> None:
    coverage, bag = result['coverage'], result['bag']
    console.print(
        f'evaluated {coverage["evaluated_s"]:.1f} of {coverage["duration_s"]:.1f} s '
        f'({coverage["fraction"]:.1%}); '
        + {'all': 'every chunk has a checksum', 'part': 'some chunks have no checksum'}.get(
            bag['protected'], 'no checksums: a changed byte would go unnoticed'
        ),
        soft_wrap=True,
    )
    for key in ('joint_states', 'imu'):
        source = result['inputs'][key]
        if source['topic'] is None:
            console.print(f'  {key}: not read')
            continue
        rate = source['rate_hz']
        faults = ', '.join([*source['faults'], *_malformed(source)])
        missing = missing_text(source, coverage['duration_s'])
        count = source['messages']
        console.print(
            f'  {escape(str(source["topic"]))}: {count} message{"s" * (count != 1)}'
            + (f' at {rate:.0f} Hz' if rate else '')
            + (f', {missing}' if missing else '')
            + _gaps(source)
            + ('; none contains a joint of this robot' if _foreign(key, source) else '')
            + (f'; {escape(faults)}' if faults else ''),
            soft_wrap=True,
        )
    if bag['salvaged']:
        console.print(f'  damaged: {escape(bag["salvaged"])}', soft_wrap=True)
    for finding in bag['findings'][:5]:
        console.print(f'  {escape(finding)}', soft_wrap=True)


def _foreign(key: str, source: dict[str, Any]) -> bool:
    """Return whether joint states came but none was usable, as those of another robot."""
    return bool(key == 'joint_states' and source['messages'] > _FEW and not source['rate_hz'])


def _gaps(source: dict[str, Any]) -> str:
    count = source['gaps']
    if not count:
        return ''
    return f', {count} gap{"s" * (count > 1)} of up to {source["longest_gap_s"]:.2f} s'


def _malformed(source: dict[str, Any]) -> list[str]:
    count = source['malformed']
    return [f'{count} malformed ({source["malformed_reason"]})'] if count else []


def _print_alerts(result: dict[str, Any], console: Console) -> None:
    alerts = result['alerts']
    if not alerts:
        console.print('no alerts')
        return
    console.print(f'{len(alerts)} alert{"s" * (len(alerts) > 1)}:')
    for alert in alerts[:_MOST_ALERTS]:
        end = 'the end' if alert['end_s'] is None else f'{alert["end_s"]:.2f} s'
        level = level_words(alert['level'])
        console.print(
            f'  {alert["start_s"]:8.2f} to {end:>9}  {level:7}  {alert["code"]:16}  '
            f'{escape(alert["message"])}' + (DOUBTFUL if alert['doubtful'] else ''),
            soft_wrap=True,
        )
    if len(alerts) > _MOST_ALERTS:
        console.print(f'  and {len(alerts) - _MOST_ALERTS} more (--json FILE lists all)')
    most = max(_SEVERITY.index(alert['level']) for alert in alerts)
    worst = {a['code']: a['advice'] for a in alerts if _SEVERITY.index(a['level']) == most}
    for code, advice in list(worst.items())[:3]:
        console.print(f'  {code}: {escape(advice)}', soft_wrap=True)


def _print_effort(result: dict[str, Any], console: Console) -> None:
    """Print what efforts mean and say, then efforts at rest beside static torques."""
    check = result['model_check']
    console.print('what the measured efforts mean:')
    for joint in check['joints'].values():
        console.print(f'  {escape(joint["sentence"])}', soft_wrap=True)
    for load in check['loads']:
        console.print(f'  {_load_line(load)}', soft_wrap=True)
    for finding in check['findings']:
        console.print(f'  {escape(finding)}', soft_wrap=True)
    joints = [(name, plateaus) for name, plateaus in result['effort'].items() if plateaus]
    if not joints:
        console.print('no measured effort at rest to compare')
        return
    joints.sort(key=lambda joint: -max(abs(p['effort_per_kg']) for p in joint[1]))
    lines = [
        _plateau_line(name, p)
        for name, plateaus in joints
        for p in plateaus
        if p['effort_per_kg'] or abs(p['difference']) > 1.0
    ]
    console.print('measured effort and static torque at rest:')
    for line in lines[:_MOST_EFFORTS]:
        console.print(line, soft_wrap=True)
    console.print(
        f'  {sum(len(p) for _, p in joints)} intervals at rest in total: --json FILE lists them'
    )


def _load_line(load: dict[str, Any]) -> str:
    mass = load['mass_kg']
    return (
        f'{load["start_s"]:.0f}-{load["end_s"]:.0f} s: payload {max(mass["value"], 0.0):.2f} kg '
        f'(95 %: {max(mass["low"], 0.0):.2f} to {max(mass["high"], 0.0):.2f} kg) by measured '
        f'efforts, {number_text(load["declared_kg"], 2)} kg declared'
    )


def _plateau_line(name: str, plateau: dict[str, Any]) -> str:
    p = plateau
    text = (
        f'  {escape(name)}  {p["start_s"]:.0f}-{p["end_s"]:.0f} s  measured {p["measured"]:.1f}, '
        f'model {p["model"]:.1f}, difference {p["difference"]:+.1f} {p["unit"]}'
    )
    return f'{text}: saturated: the effort stays at a limit' if p['saturated'] else text
