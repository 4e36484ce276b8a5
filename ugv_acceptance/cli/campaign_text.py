"""Words of a campaign's statement in a terminal: its verdict first and last, each number a line."""

from typing import TYPE_CHECKING

from rich.markup import escape

from ugv_acceptance.cli.terminal_output import (
    console_of,
    said_of_work,
    say,
    say_list,
    shown_verdict,
)
from ugv_acceptance.report.format import hours_text
from ugv_acceptance.type_aliases import Json

if TYPE_CHECKING:
    from ugv_acceptance.campaign.carry_out import Effort

VERDICTS = ('PASS', 'FAIL', 'INCONCLUSIVE', 'DOUBTFUL', 'BROKEN')
_MOST_BROKEN = 8
# Columns of the names before the statement's values.
_NAMES = 13
# Verdicts whose runs are named with the reason, and what they have in common.
_NAMED = {
    'DOUBTFUL': 'passed with doubts',
    'BROKEN': 'could not be read',
    'NOT_JUDGED': 'were not judged',
}
EXIT = {'PASS': 0, 'FAIL': 1, 'INCONCLUSIVE': 3}
_WORDS = {0: 'PASS', 1: 'FAIL', 2: 'BAD INPUT', 3: 'INCONCLUSIVE'}


def exit_code(said: Json) -> int:
    """Return the exit code: that of the requirement if there is one, else of the worst run.

    The code of INCONCLUSIVE where nothing could be stated.
    """
    if said['no_statement'] is not None:
        return EXIT['INCONCLUSIVE']
    if said['requirement'] is not None:
        return EXIT[said['requirement']['verdict']]
    worst = (('FAIL', 1), ('BROKEN', 2), ('INCONCLUSIVE', 3), ('DOUBTFUL', 3))
    return next((code for word, code in worst if said['runs'][word]), 0)


def print_campaign(said: Json) -> None:
    """Print the statement of a campaign; its verdict first and last."""
    console = console_of()
    verdict = shown_verdict(_WORDS[exit_code(said)], verdict_text(said))
    say(console, verdict)
    for what, text in lines(said):
        say(console, f'{what:{_NAMES}}{escape(text)}', 2, 2 + _NAMES)
    for word, what in _NAMED.items():
        runs = [run for run in said['each_run'] if run['verdict'] == word]
        told = [f'{word} {run["name"]}: {run["reasons"][0]}' for run in runs]
        say_list(console, told, _MOST_BROKEN, f'that {what} (campaign.json lists them)', 2)
    say(console, verdict)


def verdict_text(said: Json) -> str:
    """Return what the verdict of a campaign is about: its requirement, or what its runs came to."""
    if said['no_statement'] is not None:
        return 'nothing is stated: runs are missing'
    if said['requirement'] is not None:
        return requirement_text(said['requirement'], f'{said["confidence"]:.0%}')
    runs = said['runs']
    counts = ', '.join(f'{runs[word]} {word}' for word in VERDICTS if runs[word])
    return f'{runs["total"]} runs: {counts or "none"}'


def lines(said: Json) -> list[tuple[str, str]]:
    """Return the statement but its requirement as pairs of a name and a value."""
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
        again = 'run the same command again to judge the missing runs'
        return [*found, ('statement', f'{said["no_statement"]}; {again}')]
    found += [
        ('MTBF', mtbf_text(said['mtbf_h'], share)),
        (
            'success',
            f'{success_text(said["success"])} at {share} (only PASS counts as success)',
        ),
        ('trend', trend_text(said['trend'])),
    ]
    if said['availability']['repairs_known']:
        text = interval_percent(said['availability'])
        shown = f'at least {said["availability"]["demonstrated"]:.1%}'
        found.append(('availability', f'{text}; {shown} at {share}'))
    if said['endurance']:
        found.append(('longest run', endurance_text(said['endurance'], share)))
    if said['comparison']:
        found += comparison_lines(said['comparison'], said['confidence'])
    return found


def mtbf_text(found: Json, share: str) -> str:
    """Return an MTBF with its bounds as text."""
    value = 'no failure' if found['value'] is None else hours_text(found['value'])
    high = 'no upper bound' if found['high'] is None else hours_text(found['high'])
    return (
        f'{value}, {share} interval {hours_text(found["low"])} to {high};'
        f' at least {hours_text(found["demonstrated"])} at {share}'
    )


def interval_percent(found: Json) -> str:
    """Return a share with its bounds as text in percent."""
    value = 'unknown' if found['value'] is None else f'{found["value"]:.1%}'
    return f'{value}, {found["low"]:.1%} to {found["high"]:.1%}'


def success_text(found: Json) -> str:
    """Return how many of all runs passed, and their share with its bounds, as text."""
    return f'{found["passed"]} of {found["runs"]} runs: {interval_percent(found)}'


def trend_text(found: Json) -> str:
    """Return whether failures become rarer, as text."""
    law = found['power_law']
    if law is None:
        return 'fewer than 3 failures: no trend'
    word = 'constant rate plausible' if found['constant_rate_plausible'] else 'rate NOT constant'
    return (
        f'growth slope {law["beta"]:.2f} ({law["low"]:.2f} to {law["high"]:.2f}),'
        f' Laplace {law["laplace"]:+.2f} (p {law["laplace_p"]:.2f}): {word}'
    )


def endurance_text(found: Json, share: str) -> str:
    """Return the MTBF that the longest run demonstrates by itself, as text."""
    return (
        f'{hours_text(found["hours"])} with {found["failures"]} failures alone shows MTBF'
        f' >= {hours_text(found["demonstrated_h"])} at {share}'
    )


def requirement_text(found: Json, share: str) -> str:
    """Return whether the required MTBF is demonstrated, and the hours missing, as text."""
    start = f'MTBF {found["mtbf_h"]:g} h at {share}'
    words = {'PASS': 'demonstrated', 'FAIL': 'excluded', 'INCONCLUSIVE': 'not demonstrated'}
    text = f'{start}: {words[found["verdict"]]}'
    if found['verdict'] == 'PASS':
        return text
    return (
        f'{text}; {hours_text(found["still_to_run_h"])} still to run without another failure,'
        f' {hours_text(found["still_to_run_after_one_more_failure_h"])} with one more'
    )


def comparison_lines(found: Json, confidence: float) -> list[tuple[str, str]]:
    """Return the two groups side by side, and whether a difference was shown."""
    first, second = found['groups']
    rows = [('comparison', _group_text(first)), ('', _group_text(second))]
    order = f'{second["name"]} over {first["name"]}'
    passed = [f'{group["passed"]} of {group["runs"]} passed' for group in (second, first)]
    for name, key, words in (
        ('MTBF', 'mtbf', f'{order} {_ratio_text(found["mtbf"])}'),
        ('success', 'success', f'{passed[0]}, and {passed[1]}'),
    ):
        test = found[key]
        shown = 'a difference' if test['p'] < 1.0 - confidence else 'no difference shown'
        text = f'{words}: {shown} at {confidence:.0%} (p {test["p"]:.3f}; power '
        rows.append((f'  {name}', f'{text}{test["power"]:.0%})'))
    return rows


def _ratio_text(test: Json) -> str:
    """Return a ratio with its interval: one without bounds is not printed as a number."""
    if test['high'] is None and not test['low']:
        return 'unknown'
    value = 'unknown' if test['ratio'] is None else f'{test["ratio"]:.3g}'
    high = 'no upper bound' if test['high'] is None else f'{test["high"]:.3g}'
    return f'{value} ({test["low"]:.3g} to {high})'


def _group_text(group: Json) -> str:
    return (
        f'{group["name"]}: {group["failures"]} failures in {hours_text(group["hours"])},'
        f' {group["passed"]} of {group["runs"]} passed'
    )


def print_effort(effort: 'Effort', runs: int, seconds: float) -> None:
    """Say how fast the runs were judged, and how many already had a result."""
    rate = 3600.0 / max(seconds, 1e-9)
    text = f'{effort.judged} of {runs} newly judged in {seconds:.1f} s'
    if effort.judged:
        text += f': {effort.judged * rate:.0f} bags/h, {effort.size / 1e9 * rate:.2f} GB/h'
    say(said_of_work(), text)
    if effort.unchanged:
        say(said_of_work(), unchanged_text(effort.unchanged, runs, effort.since))
    if effort.odd:
        say(said_of_work(), effort.odd)


def unchanged_text(unchanged: int, runs: int, since: str) -> str:
    """Return how many runs were taken as they were, by the look of their files, and since when."""
    moment = since[:16].replace('T', ' ')
    return (
        f'{unchanged} of {runs} not read again: size, time and inode or ETag of their files are'
        f' unchanged since they were read (the first {moment} UTC); --rehash reads all'
    )
