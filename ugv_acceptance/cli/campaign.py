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
    progress,
    said_of_work,
    say,
    while_read,
    wrote,
)

if TYPE_CHECKING:
    from ugv_acceptance.campaign.sources import Source
    from ugv_acceptance.campaign.statement import Origin
    from ugv_acceptance.campaign.work import Brief, Done


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
    rehash: Annotated[
        bool,
        typer.Option(
            '--rehash', help='Read every recording again, even one whose files look unchanged.'
        ),
    ] = False,
    overwrite: Overwrite = False,
) -> None:
    """Judge many runs and state what they show: MTBF, availability, success, trend.

    Writes campaign.json, campaign.html and one result for each run into --out. A run that is
    INCONCLUSIVE or cannot be read is counted, never dropped; one that passed with doubts (relaxed
    limits, a waived safeguard, efforts that contradict) is DOUBTFUL, and no success. While a run
    was not judged (a worker died, a scheduler or a network is gone) nothing is stated and the exit
    code is 3: run the same command again to judge the missing runs. A run that has a result is not
    read again while its files look unchanged, unless --rehash. With --require-mtbf the exit
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
    from ugv_acceptance.cli.campaign_text import exit_code, print_campaign, print_effort
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
        rows, effort = carry_out(sources, brief, place, reached, rehash=rehash)
    took = time.monotonic() - began
    said = statement(rows, all_failures(rows, entries), question, origin)
    write(out, said)
    with while_read():
        print_campaign(said)
    print_effort(effort, len(sources), took)
    wrote(out / 'runs', out / 'campaign.json', out / 'campaign.html')
    raise typer.Exit(exit_code(said))


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
