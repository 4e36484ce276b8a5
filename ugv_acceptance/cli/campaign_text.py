"""A campaign as a person reads it: runs, hours, failures, MTBF, what is still to run."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ugv_acceptance.report.numbers import hours_text

if TYPE_CHECKING:
    from ugv_acceptance.campaign.run import Effort

Json = dict[str, Any]

VERDICTS = ('PASS', 'FAIL', 'INCONCLUSIVE', 'BROKEN')
MARKS = {'PASS': '[OK]', 'FAIL': '[X]', 'INCONCLUSIVE': '[?]'}
_MOST_BROKEN = 8


def print_campaign(said: Json, out: Path, console: Console | None = None) -> None:
    """Print the statement of a campaign."""
    console = console or Console(highlight=False)
    table = Table(box=None, pad_edge=False, padding=(0, 2), show_header=False)
    for what, text in lines(said):
        table.add_row(escape(what), escape(text))
    console.print(table)
    for word, what in (('BROKEN', 'could not be read'), ('NOT_JUDGED', 'were not judged')):
        runs = [run for run in said['each_run'] if run['verdict'] == word]
        for run in runs[:_MOST_BROKEN]:
            text = f'    {word} {run["name"]}: {run["reasons"][0]}'
            console.print(escape(text), soft_wrap=True)
        if len(runs) > _MOST_BROKEN:
            console.print(f'    and {len(runs) - _MOST_BROKEN} more that {what}')
    console.print(f'    {escape(str(out / "campaign.json"))}, campaign.html', soft_wrap=True)


def lines(said: Json) -> list[tuple[str, str]]:
    """Return the statement as pairs of what and how much."""
    runs, share = said['runs'], f'{said["confidence"]:.0%}'
    hours, failed = said['hours'], said['failures']
    verdicts = ', '.join(f'{runs[word]} {word}' for word in VERDICTS)
    if runs['NOT_JUDGED']:
        verdicts += f', {runs["NOT_JUDGED"]} NOT_JUDGED'
    found = [
        ('runs', f'{runs["total"]}: {verdicts}; copies counted once: {runs["copies"]}'),
        (
            'time',
            f'{hours_text(hours["judged"])} judged of {hours_text(hours["recorded"])} recorded',
        ),
        (
            'failures',
            f'{failed["chargeable"]} chargeable'
            + ''.join(f'; {count} {name}' for name, count in failed['class'].items()),
        ),
    ]
    if said['no_statement']:
        again = 'the same command again judges what is missing'
        return [*found, ('statement', f'{said["no_statement"]}; {again}')]
    found += [
        ('MTBF', mtbf_text(said['mtbf_h'], share)),
        (
            'success',
            f'{interval_percent(said["success"])} at {share} (what is unclear is no success)',
        ),
        ('trend', trend_text(said['trend'])),
    ]
    if said['availability']['repairs_known']:
        found.append(('availability', f'{interval_percent(said["availability"])} at {share}'))
    if said['endurance']:
        found.append(('longest run', endurance_text(said['endurance'], share)))
    if said['requirement']:
        found.append(('requirement', requirement_text(said['requirement'], share)))
    if said['comparison']:
        found += comparison_lines(said['comparison'], said['confidence'])
    return found


def mtbf_text(found: Json, share: str) -> str:
    """Return an MTBF with its bounds."""
    value = 'no failure' if found['value'] is None else hours_text(found['value'])
    high = 'no upper bound' if found['high'] is None else hours_text(found['high'])
    return (
        f'{value}, {share} interval {hours_text(found["low"])} to {high};'
        f' at least {hours_text(found["demonstrated"])} at {share}'
    )


def interval_percent(found: Json) -> str:
    """Return a share with its bounds."""
    value = 'unknown' if found['value'] is None else f'{found["value"]:.1%}'
    return f'{value}, {found["low"]:.1%} to {found["high"]:.1%}'


def trend_text(found: Json) -> str:
    """Return whether failures grow rarer."""
    law = found['power_law']
    if law is None:
        return 'fewer than 3 failures: no trend'
    word = 'constant rate plausible' if found['constant_rate_plausible'] else 'rate NOT constant'
    return (
        f'growth slope {law["beta"]:.2f} ({law["low"]:.2f} to {law["high"]:.2f}),'
        f' Laplace {law["laplace"]:+.2f} (p {law["laplace_p"]:.2f}): {word}'
    )


def endurance_text(found: Json, share: str) -> str:
    """Return what the longest run shows by itself."""
    return (
        f'{hours_text(found["hours"])} with {found["failures"]} failures alone shows MTBF'
        f' >= {hours_text(found["demonstrated_h"])} at {share}'
    )


def requirement_text(found: Json, share: str) -> str:
    """Return whether an MTBF is shown, and what is missing."""
    start = f'{MARKS[found["verdict"]]} MTBF {found["mtbf_h"]:g} h at {share}'
    words = {'PASS': 'demonstrated', 'FAIL': 'excluded', 'INCONCLUSIVE': 'not demonstrated'}
    text = f'{start}: {words[found["verdict"]]}'
    if found['verdict'] == 'PASS':
        return text
    return (
        f'{text}; {hours_text(found["still_to_run_h"])} still to run without another failure,'
        f' {hours_text(found["still_to_run_after_one_more_failure_h"])} with one more'
    )


def comparison_lines(found: Json, confidence: float) -> list[tuple[str, str]]:
    """Return two groups beside each other, and whether a difference was shown."""
    first, second = found['groups']
    rows = [('comparison', _group_text(first)), ('', _group_text(second))]
    order = f'{second["name"]} over {first["name"]}'
    for name, key in (('MTBF', 'mtbf'), ('odds of a pass', 'success')):
        test = found[key]
        ratio = 'unknown' if test['ratio'] is None else f'{test["ratio"]:.3g}'
        shown = 'a difference' if test['p'] < 1.0 - confidence else 'no difference shown'
        text = f'{order} {ratio}: {shown} at {confidence:.0%} (p {test["p"]:.3f}; power '
        rows.append((f'  {name}', f'{text}{test["power"]:.0%})'))
    return rows


def _group_text(group: Json) -> str:
    return (
        f'{group["name"]}: {group["failures"]} failures in {hours_text(group["hours"])},'
        f' {group["passed"]} of {group["runs"]} passed'
    )


def print_effort(effort: 'Effort', runs: int, seconds: float) -> None:
    """Print how fast the runs were judged, and how many were found judged."""
    rate = 3600.0 / max(seconds, 1e-9)
    text = f'    {effort.judged} of {runs} judged anew in {seconds:.1f} s'
    if effort.judged:
        text += f': {effort.judged * rate:.0f} bags/h, {effort.size / 1e9 * rate:.2f} GB/h'
    Console(highlight=False).print(text, soft_wrap=True)
