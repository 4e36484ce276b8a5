"""Prints a result in a terminal: the verdict first and last, its reasons, the worst of each margin.

A dozen lines; what they leave out is counted, and `verbose` prints it. Reasons of a verdict,
doubts, and that something was not checked are never left out altogether.
"""

import math
from collections.abc import Sequence

from rich.console import Console
from rich.markup import escape

from ugv_acceptance.cli.result_details import (
    ALL,
    LISTED,
    SEVERITY,
    Result,
    at_time,
    checksum_words,
    counted,
    input_line,
    is_foreign,
    print_alert,
    print_details,
    print_effort,
    share_of,
)
from ugv_acceptance.cli.terminal_output import (
    COLOURS,
    console_of,
    say,
    say_list,
    shown_verdict,
    while_read,
)
from ugv_acceptance.evaluation.alerts.messages import level_words
from ugv_acceptance.evaluation.margin_words import share_words, tipping_words
from ugv_acceptance.report.format import (
    assumed_line,
    doubts_of,
    ground_line,
    is_bound,
    missing_text,
    origin_line,
)

__all__ = ['print_result', 'print_results', 'while_read']

# In the short text: reasons, doubts, warnings, alerts, findings about the data, efforts.
_REASONS, _DOUBTS, _WARNINGS, _ALERTS, _FINDINGS, _EFFORTS = 3, 2, 1, 3, 3, 11
# A share of the recording from which on nothing is worth a number.
_WHOLE = 0.995
# Letters of what was not checked, in the short text.
_UNCHECKED = 150
# What is at stake is told before what may be wrong with the data.
_RANK = {'TIP_OVER': 0, 'TORQUE_LIMIT': 1}


def print_result(result: Result, console: Console | None = None, *, verbose: bool = False) -> None:
    """Print one result of `evaluate`."""
    print_results([result], console, verbose=verbose)


def print_results(
    results: Sequence[Result], console: Console | None = None, *, verbose: bool = False
) -> None:
    """Print results of `evaluate`; at the end the verdicts once more, one line a recording."""
    console = console or console_of()
    for result in results:
        if 'criteria' in result:
            _print_result(result, console, verbose=verbose)
    for result in results:
        console.print(_headline(result), soft_wrap=True)


def _headline(result: Result) -> str:
    paths = result['bag']['path']
    more = len(paths) - 1
    text = f'{paths[0]}{f" and {more} more" if more else ""}'
    return shown_verdict(result['verdict'], text)


def _print_result(result: Result, console: Console, *, verbose: bool) -> None:
    console.print(_headline(result), soft_wrap=True)
    most = ALL if verbose else _REASONS
    say_list(console, result['reasons'], most, f'reasons {LISTED}', 2)
    given = (origin_line(result), assumed_line(result)) if verbose else (_given_line(result),)
    say_list(console, given, ALL, '', 2)
    _print_marked(console, 'doubt', doubts_of(result), ALL if verbose else _DOUBTS)
    _print_marked(console, 'warning', _warnings(result), ALL if verbose else _WARNINGS)
    (print_details if verbose else _print_short)(result, console)
    if 'effort' in result:
        print_effort(result, console, ALL if verbose else _EFFORTS)


def _warnings(result: Result) -> list[str]:
    """Return what is odd with the robot's own files: margins are only as good as these."""
    return list(result['robot']['warnings'])


def _print_marked(console: Console, mark: str, lines: Sequence[str], most: int) -> None:
    for line in lines[:most]:
        say(console, f'[bold yellow]{mark}:[/] {escape(line)}', 2)
    if len(lines) > most:
        say(console, f'and {len(lines) - most} more {mark}s {LISTED}', 2)


def _print_short(result: Result, console: Console) -> None:
    if result['criteria']['path'] is not None:
        say(console, escape(_criteria_counted(result['criteria']['results'])), 2)
    worst = _worst_of(result['alerts'])[:_ALERTS]
    for line in (*_least(result, worst), ground_line(result), _data_line(result)):
        if line:
            say(console, escape(line), 2)
    say_list(console, _troubles(result), _FINDINGS, f'findings {LISTED}', 2)
    _print_worst_alerts(result, worst, console)
    unchecked = _unchecked(result)
    if unchecked:
        say(console, f'[bold]NOT CHECKED:[/] {escape(unchecked)}', 2)
    say(console, escape(_left_out(result, len(worst))), 2)


def _criteria_counted(outcomes: Sequence[Result]) -> str:
    missed = [o['name'] for o in outcomes if o['verdict'] != 'PASS']
    text = f'{len(outcomes) - len(missed)} of {len(outcomes)} criteria met'
    if not missed:
        return text
    named = ', '.join(missed[:_REASONS])
    more = len(missed) - _REASONS
    return f'{text}; not: {named}' + (f' and {more} more {LISTED}' if more > 0 else '')


def _least(result: Result, told: Sequence[Result]) -> list[str]:
    """Return the most used joint and the least tilt left, each with its own time.

    What one of the alerts says that are `told` is not said twice.
    """
    said = {(alert['code'], alert['subject']) for alert in told}
    lines = []
    limited = [(n, j) for n, j in result['torque'].items() if j['limit'] and j['max_abs']]
    if limited:
        name, joint = max(limited, key=lambda one: one[1]['max_abs'] / one[1]['limit'])
        share = share_words(joint['max_abs'] / joint['limit'])
        most = f'{joint["max_abs"]:.1f} of {joint["limit"]:.1f} {joint["unit"]}'
        if ('TORQUE_LIMIT', name) not in said:
            lines.append(f'{name} {share} of its limit ({most}){at_time(joint["time_of_min_s"])}')
    stability = result['stability']
    if stability['min_angle_deg'] is not None and ('TIP_OVER', stability['edge']) not in said:
        angle = math.radians(stability['min_angle_deg'])
        bound = 'at most ' if is_bound(result) and angle > 0.0 else ''
        words = tipping_words(stability['edge'] or '', angle)
        lines.append(f'{bound}{words}{at_time(stability["time_of_min_s"])}')
    return lines


def _data_line(result: Result) -> str:
    coverage = result['coverage']
    part = f' ({share_of(coverage["fraction"])})' if coverage['fraction'] < _WHOLE else ''
    text = f'{coverage["evaluated_s"]:.1f} of {coverage["duration_s"]:.1f} s evaluated{part}'
    return text if result['alerts'] else f'{text}; no alerts'


def _given_line(result: Result) -> str:
    """Return what a recording is of: simulated or real, and a robot known how well."""
    assumed = result['robot']['assumed']
    if assumed is None:
        words = "the robot's configuration does not say which numbers are assumed"
    elif not assumed:
        words = 'no number of the robot is only assumed'
    else:
        words = f'{counted(len(assumed), "number")} of the robot assumed, not measured'
    return f'{origin_line(result)}; {words}'


def _troubles(result: Result) -> list[str]:
    """Return what is wrong with the data, a sentence each."""
    bag = result['bag']
    found = [f'damaged: {bag["salvaged"]}'] if bag['salvaged'] else []
    if bag['protected'] != 'all':
        found.append(checksum_words(bag))
    told = ((key, result['inputs'][key]) for key in ('joint_states', 'imu'))
    odd = (input_line(key, source, result) for key, source in told if _is_odd(key, source, result))
    return [*found, *odd, *bag['findings']]


def _is_odd(key: str, source: Result, result: Result) -> bool:
    missing = missing_text(source, result['coverage']['duration_s'])
    troubled = missing or source['gaps'] or source['faults'] or source['malformed']
    return bool(source['topic'] is not None and (troubled or is_foreign(key, source)))


def _print_worst_alerts(result: Result, worst: Sequence[Result], console: Console) -> None:
    """Print how many alerts there were, and the worst, a line each."""
    alerts = result['alerts']
    if not alerts:
        return
    level = level_words(worst[0]['level'])
    count = sum(alert['level'] == worst[0]['level'] for alert in alerts)
    of_them = f'{count} of them ' if count < len(alerts) else 'all ' if count > 1 else ''
    text = f'{counted(len(alerts), "alert")}, {of_them}[{COLOURS[level]}]{level}[/]'
    say(console, f'{text}; the worst:' if len(worst) < len(alerts) else f'{text}:', 2)
    for alert in worst:
        print_alert(alert, console, short=True)


def _worst_of(alerts: Sequence[Result]) -> list[Result]:
    """Return the alerts of the highest level: the worst of each kind and part, gravest first."""
    most = max((SEVERITY.index(alert['level']) for alert in alerts), default=0)
    kept: dict[tuple[str, str], Result] = {}
    for alert in alerts:
        if SEVERITY.index(alert['level']) == most:
            key = alert['code'], alert['subject']
            kept[key] = max(kept.get(key, alert), alert, key=_weight)
    return sorted(kept.values(), key=lambda a: (_RANK.get(a['code'], 2), a['start_s']))


def _weight(alert: Result) -> tuple[float, float]:
    """Return how bad an alert is beside others of its kind: by its worst value, by its length."""
    peak, end = alert['peak'] or 0.0, alert['end_s']
    worst = {'TIP_OVER': -peak, 'TORQUE_LIMIT': abs(peak)}.get(alert['code'], 0.0)
    return worst, math.inf if end is None else end - alert['start_s']


def _unchecked(result: Result) -> str:
    """Return what no number tells: as many names as fit in two lines, and how many more."""
    names = [one['what'] for one in result['not_checked']]
    kept: list[str] = []
    for name in names:
        if kept and len('; '.join([*kept, name])) > _UNCHECKED:
            break
        kept.append(name)
    more = len(names) - len(kept)
    return '; '.join(kept) + (f'; and {more} more' if more else '')


def _left_out(result: Result, shown: int) -> str:
    """Return what only the long text says, counted; `shown` alerts are in the short one."""
    counts = (
        (len(result['alerts']) - shown, 'alert', ''),
        (len(result['not_checked']), 'reason of NOT CHECKED', 'reasons of NOT CHECKED'),
        (len(result['robot']['assumed'] or ()), 'assumed number', ''),
        (len(result.get('carrying', ())), 'joint that carried it', 'joints that carried it'),
    )
    told = [counted(count, one, many) for count, one, many in counts if count]
    return f'{", ".join(told) or "all margins"} left out: -v lists them'
