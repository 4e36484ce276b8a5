"""Prints all of a result in a terminal: every margin, input and alert, and what efforts say."""

import math
import re
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ugv_acceptance.cli.terminal_output import (
    COLOURS,
    print_table,
    say,
    say_list,
    shown_verdict,
    table_of,
)
from ugv_acceptance.evaluation.alerts.messages import level_words
from ugv_acceptance.report.alert_lines import worst_words
from ugv_acceptance.report.format import (
    carrying_lines,
    ground_line,
    is_bound,
    missing_text,
    not_checked_lines,
    number_text,
    seconds_text,
    short_name,
)

Result = dict[str, Any]

# No limit of a list.
ALL = 1_000_000_000
LISTED = '(-v lists them)'
# Letters of a joint's name in a table of 80 columns.
_NAME = 24
# More messages than this have a rate, if they can be used.
_FEW = 100
# Said of an alert that rests only on a sensor found to be wrong.
DOUBTFUL = ' (by a sensor that is contradicted: it decides nothing)'
# Where a sentence has said the most of it.
_CLAUSE = re.compile(r'(?<!tipping)[:;,] ')
# Levels of alerts, the least severe first.
SEVERITY = ('OK', 'WARN', 'STALE', 'ERROR')


def print_details(result: Result, console: Console) -> None:
    """Print what the short text leaves out."""
    if ground_line(result):
        say(console, escape(ground_line(result)), 2)
    unchecked = not_checked_lines(result)
    if unchecked:
        say(console, '[bold]NOT CHECKED:[/]', 2)
    say_list(console, unchecked, ALL, '', 4)
    if result['criteria']['path'] is not None:
        _print_criteria(result['criteria']['results'], console)
    print_table(console, _margins(result))
    say_list(console, carrying_lines(result), ALL, '', 0)
    _print_data(result, console)
    _print_alerts(result, console)


def _print_criteria(outcomes: list[dict[str, Any]], console: Console) -> None:
    for outcome in outcomes:
        say(
            console, shown_verdict(outcome['verdict'], f'{outcome["name"]}: {outcome["demand"]}'), 2
        )


def _margins(result: Result) -> Table:
    table = table_of('', 'margin', 'worst', 'limit', 'left', 'at', 'in violation')
    for name, joint in result['torque'].items():
        unit = joint['unit']
        table.add_row(
            escape(short_name(name, _NAME)),
            _number(joint['max_abs'], unit),
            _number(joint['limit'], unit),
            _number(joint['min_margin'], unit),
            _number(joint['time_of_min_s'], 's', 2),
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
        _number(stability['time_of_min_s'], 's', 2),
        _number(stability['time_in_violation_s'], 's', 2),
    )
    return table


def _number(value: float | None, unit: str, digits: int = 1) -> str:
    return '-' if value is None else f'{value:.{digits}f} {unit}'


def checksum_words(bag: Result) -> str:
    """Return whether a changed byte of a recording would be noticed."""
    words = {'all': 'every chunk has a checksum', 'part': 'some chunks have no checksum'}
    return words.get(bag['protected'], 'no checksums: a changed byte would go unnoticed')


def _print_data(result: Result, console: Console) -> None:
    coverage, bag = result['coverage'], result['bag']
    say(
        console,
        f'evaluated {coverage["evaluated_s"]:.1f} of {coverage["duration_s"]:.1f} s '
        f'({share_of(coverage["fraction"])}); {checksum_words(bag)}',
    )
    for key in ('joint_states', 'imu'):
        say(console, escape(input_line(key, result['inputs'][key], result)), 2)
    if bag['salvaged']:
        say(console, f'damaged: {escape(bag["salvaged"])}', 2)
    say_list(console, bag['findings'], ALL, '', 2)


def input_line(key: str, source: Result, result: Result) -> str:
    """Return what came on an input, and what is wrong with it."""
    if source['topic'] is None:
        return f'{key}: not read'
    rate = source['rate_hz']
    faults = ', '.join([*source['faults'], *_malformed(source)])
    missing = missing_text(source, result['coverage']['duration_s'])
    return (
        f'{source["topic"]}: {counted(source["messages"], "message")}'
        + (f' at {rate:.0f} Hz' if rate else '')
        + (f', {missing}' if missing else '')
        + _gaps(source)
        + ('; none contains a joint of this robot' if is_foreign(key, source) else '')
        + (f'; {faults}' if faults else '')
    )


def is_foreign(key: str, source: Result) -> bool:
    """Return whether joint states came but none was usable, as those of another robot."""
    return bool(key == 'joint_states' and source['messages'] > _FEW and not source['rate_hz'])


def _gaps(source: Result) -> str:
    count = source['gaps']
    return f', {counted(count, "gap")} of up to {source["longest_gap_s"]:.2f} s' if count else ''


def _malformed(source: Result) -> list[str]:
    count = source['malformed']
    return [f'{count} malformed ({source["malformed_reason"]})'] if count else []


def _print_alerts(result: Result, console: Console) -> None:
    alerts = result['alerts']
    if not alerts:
        say(console, 'no alerts')
        return
    say(console, f'{counted(len(alerts), "alert")}:')
    for alert in alerts:
        print_alert(alert, console)
    most = max(SEVERITY.index(alert['level']) for alert in alerts)
    worst = {a['code']: a['advice'] for a in alerts if SEVERITY.index(a['level']) == most}
    if any(worst.values()):
        say(console, 'what to do:')
    for code, advice in worst.items():
        if advice:
            say(console, f'{code}: {escape(advice)}', 4, 8)


def print_effort(result: Result, console: Console, most: int) -> None:
    """Print what efforts mean and say, then efforts at rest beside static torques."""
    check = result['model_check']
    say(console, 'what the measured efforts mean:')
    loads = [_load_line(load) for load in check['loads']]
    told = [joint['sentence'] for joint in check['joints'].values()]
    say_list(console, [*told, *loads, *check['findings']], ALL, '', 2)
    joints = [(name, plateaus) for name, plateaus in result['effort'].items() if plateaus]
    if not joints:
        say(console, 'no measured effort at rest to compare')
        return
    joints.sort(key=lambda joint: -max(abs(p['effort_per_kg']) for p in joint[1]))
    lines = [
        _plateau_line(name, p)
        for name, plateaus in joints
        for p in plateaus
        if p['effort_per_kg'] or abs(p['difference']) > 1.0
    ]
    say(console, 'measured effort and static torque at rest:')
    say_list(console, lines, most, LISTED, 2)
    count = counted(sum(len(p) for _, p in joints), 'interval')
    say(console, f'{count} at rest in total: --json FILE lists them', 2)


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
        f'{name}  {p["start_s"]:.0f}-{p["end_s"]:.0f} s  measured {p["measured"]:.1f}, '
        f'model {p["model"]:.1f}, difference {p["difference"]:+.1f} {p["unit"]}'
    )
    return f'{text}: saturated: the effort stays at a limit' if p['saturated'] else text


def at_time(seconds: float | None) -> str:
    """Return a time (s) as the end of a sentence; empty where it is not known."""
    return '' if seconds is None else f' at {seconds:.2f} s'


def share_of(fraction: float) -> str:
    """Return a share, cut: only the whole reads 100 %."""
    return f'{math.floor(1000.0 * fraction + 1e-9) / 10.0:g} %'


def print_alert(alert: Result, console: Console, *, short: bool = False) -> None:
    """Print an alert: when, level, code, and its worst value with its own time.

    `short`: without its limit, and of a sentence that needs several lines the first clause.
    """
    head = f'{seconds_text(alert["start_s"])} to {seconds_text(alert["end_s"])}'
    level, text = level_words(alert['level']), worst_words(alert) if short else alert['message']
    if short and len(f'    {head}  {level}  {alert["code"]}  {text}') > console.width:
        text = _CLAUSE.split(text, maxsplit=1)[0]
    text = escape(f'{alert["code"]}  {text}{DOUBTFUL if alert["doubtful"] else ""}')
    say(console, f'{head}  [{COLOURS[level]}]{level}[/]  {text}', 4, 8)


def counted(count: int, one: str, many: str = '') -> str:
    """Return a number of things as text; `many`: their plural, where it is not `one` and an s."""
    return f'{count} {one if count == 1 else many or f"{one}s"}'
