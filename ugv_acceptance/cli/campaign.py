"""`ugv-acceptance campaign`: judges many recorded runs and states their reliability."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from ugv_acceptance import AcceptanceError
from ugv_acceptance.cli.options import ConfigFile, CriteriaFile, Overwrite, UrdfFile
from ugv_acceptance.cli.outputs import check_folder, inputs_of
from ugv_acceptance.cli.terminal_output import (
    again,
    console_of,
    progress,
    said_of_work,
    say,
    say_list,
    shown_verdict,
    while_read,
    wrote,
)
from ugv_acceptance.report.format import hours_text
from ugv_acceptance.type_aliases import Json

if TYPE_CHECKING:
    from ugv_acceptance.campaign.carry_out import Effort
    from ugv_acceptance.campaign.sources import Source
    from ugv_acceptance.campaign.statement import Origin
    from ugv_acceptance.campaign.work import Brief, Done


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


EXIT = {'PASS': 0, 'FAIL': 1, 'INCONCLUSIVE': 3}
_WORDS = {0: 'PASS', 1: 'FAIL', 2: 'BAD INPUT', 3: 'INCONCLUSIVE'}


def campaign(
    places: Annotated[
        list[str],
        typer.Argument(
            metavar='DIR|URL...', help='Folders, recordings, or URLs (those that fsspec supports).'
        ),
    ],
    out: Annotated[
        Path, typer.Option('--out', '-o', help='Folder of results; run again to resume.')
    ] = Path('campaign'),
    config: ConfigFile = None,
    urdf: UrdfFile = None,
    criteria: CriteriaFile = None,
    failures: Annotated[
        Path | None, typer.Option(help='Failure log written by a person, YAML or CSV.')
    ] = None,
    confidence: Annotated[
        float,
        typer.Option(
            min=0.5, max=0.999, help='Confidence level of bounds, tests and demonstrations.'
        ),
    ] = 0.8,
    require_mtbf: Annotated[
        float | None, typer.Option(help='MTBF (h) to demonstrate; decides the exit code.')
    ] = None,
    ended_by_failure: Annotated[
        bool,
        typer.Option('--ended-by-failure', help='The campaign was planned to end with a failure.'),
    ] = False,
    compare: Annotated[
        list[str] | None,
        typer.Option(help='NAME=PATTERN, given twice: two groups of runs to compare.'),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help='Processes; all cores if left out.')
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help='Address of a dask.distributed scheduler to use instead.')
    ] = None,
    cluster_wait: Annotated[
        float,
        typer.Option(min=0.0, help='Seconds to wait for a scheduler or workers that are gone.'),
    ] = 60.0,
    overwrite: Overwrite = False,
) -> None:
    """Judge many runs and state what they show: MTBF, availability, success, trend.

    Writes campaign.json, campaign.html and one result for each run into --out. A run that is
    INCONCLUSIVE or cannot be read is counted, never dropped; one that passed with doubts (relaxed
    limits, a waived safeguard, efforts that contradict) is DOUBTFUL, and no success. While a run
    was not judged (a worker died, a scheduler or a network is gone) nothing is stated and the exit
    code is 3: run the same command again to judge the missing runs. With --require-mtbf the exit
    code is 0 if the MTBF is demonstrated, 1 if it is excluded, 3 otherwise; without it 0 if every
    run passed, 1 if one failed, 2 if one could not be read, 3 if one is inconclusive or doubtful.

    \b
    Examples:
      ugv-acceptance campaign recordings --require-mtbf 96 --failures log.yaml
      ugv-acceptance campaign s3://bucket/runs --scheduler tcp://head:8786
      ugv-acceptance campaign runs --compare 'old=*/fw1/*' --compare 'new=*/fw2/*'
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.campaign.carry_out import Place, all_failures, carry_out
    from ugv_acceptance.campaign.failure_log import read_log
    from ugv_acceptance.campaign.pool import cores
    from ugv_acceptance.campaign.sources import find_sources
    from ugv_acceptance.campaign.statement import Question, statement
    from ugv_acceptance.cli.output_kinds import CAMPAIGN

    check_requirement(require_mtbf)
    question = Question(confidence, require_mtbf, ended_by_failure, groups_from(compare or []))
    entries = read_log(failures) if failures else []
    sources = find_sources(places)
    brief, origin = terms_of(config, urdf, criteria, sources)
    recorded = [Path(file) for s in sources if not s.remote for file in s.files]
    inputs = inputs_of(brief.config, recorded, criteria=criteria, failures=failures)
    check_folder('--out', out, CAMPAIGN, inputs, overwrite=overwrite)
    began = time.monotonic()
    with counted_runs(out, len(sources)) as reached:
        place = Place(out, workers or cores(), scheduler, cluster_wait)
        rows, effort = carry_out(sources, brief, place, reached)
    took = time.monotonic() - began
    said = statement(rows, all_failures(rows, entries), question, origin)
    write(out, said)
    with while_read():
        print_campaign(said)
    print_effort(effort, len(sources), took)
    wrote(out / 'runs', out / 'campaign.json', out / 'campaign.html')
    raise typer.Exit(exit_code(said))


def exit_code(said: dict[str, Any]) -> int:
    """Return the exit code: that of the requirement if there is one, else of the worst run.

    The code of INCONCLUSIVE where nothing could be stated.
    """
    if said['no_statement'] is not None:
        return EXIT['INCONCLUSIVE']
    if said['requirement'] is not None:
        return EXIT[said['requirement']['verdict']]
    worst = (('FAIL', 1), ('BROKEN', 2), ('INCONCLUSIVE', 3), ('DOUBTFUL', 3))
    return next((code for word, code in worst if said['runs'][word]), 0)


def check_requirement(required: float | None) -> None:
    """Raise AcceptanceError where the MTBF to demonstrate is not a positive number of hours."""
    if required is not None and not 0.0 < required < float('inf'):
        raise AcceptanceError(f'--require-mtbf: expected hours above 0, got {required:g}')


def groups_from(compare: list[str]) -> tuple[tuple[str, str], ...]:
    """Return the groups (name, pattern): two or none. Raises AcceptanceError for anything else."""
    groups = tuple((name, pattern) for name, _, pattern in (c.partition('=') for c in compare))
    if any(not name or not pattern for name, pattern in groups):
        raise AcceptanceError('--compare: expected NAME=PATTERN, such as new=*/fw2/*')
    if len(groups) not in {0, 2}:
        raise AcceptanceError(f'--compare: expected to be given twice, got {len(groups)}')
    return groups


def terms_of(
    config: Path | None,
    urdf: Path | None,
    criteria: Path | None,
    sources: 'Sequence[Source]' = (),
) -> 'tuple[Brief, Origin]':
    """Return the configuration and criteria that runs are judged by, with names and hashes.

    A configuration without a URDF takes the description that the first run recorded: a campaign is
    of one robot, and every run is held against it.
    """
    from ugv_acceptance.bag.recording import open_recording
    from ugv_acceptance.campaign.sources import local_paths
    from ugv_acceptance.campaign.statement import Origin
    from ugv_acceptance.campaign.work import Brief
    from ugv_acceptance.config import description_topic, load
    from ugv_acceptance.config.criteria import load_criteria
    from ugv_acceptance.offline.own_robot import robot_of

    if sources and description_topic(config, urdf=urdf) is not None:
        with local_paths(sources[0]) as paths:
            loaded = robot_of(open_recording(paths), config, urdf=urdf)
    else:
        loaded = load(config, urdf=urdf)
    found = load_criteria(criteria, loaded.settings) if criteria else None
    name = found.name if found else 'limits of the configuration'
    origin = Origin(loaded.name, loaded.sha256, name, found.sha256 if found else None)
    return Brief(loaded, found), origin


def write(out: Path, said: dict[str, Any]) -> None:
    """Write campaign.json and campaign.html into the folder."""
    from ugv_acceptance.bag.atomic_files import write_json, write_text
    from ugv_acceptance.report.campaign import campaign_page

    write_json(out / 'campaign.json', said)
    write_text(out / 'campaign.html', campaign_page(said))


@contextmanager
def counted_runs(out: Path, total: int) -> 'Iterator[Callable[[Done], None]]':
    """Show how many runs are done and how many not judged; when it is stopped, how to go on."""
    done = lost = 0
    with progress('runs', total, 'runs') as reached:

        def advance(one: 'Done') -> None:
            nonlocal done, lost
            done, lost = done + 1, lost + bool(one.lost)
            reached(done, f'({lost} not judged)' if lost else '')

        try:
            yield advance
        except SystemExit:
            held = done - lost
            _say_stopped(out, held, total)
            raise


def _say_stopped(out: Path, held: int, total: int) -> None:
    """Say what a campaign has that was stopped, and how to go on."""
    console = said_of_work()
    say(
        console,
        f'stopped: {held} of {total} runs are judged, their results are in '
        f'{escape(str(out / "runs"))}. This judges the other {total - held}:',
    )
    console.print(f'  {escape(again())}', soft_wrap=True)
