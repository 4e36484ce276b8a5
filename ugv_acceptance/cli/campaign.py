"""`ugv-acceptance campaign`: many recorded runs to one statement of reliability."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ugv_acceptance import AcceptanceError
from ugv_acceptance.cli.outputs import Overwrite, check_folder, inputs_of

if TYPE_CHECKING:
    from ugv_acceptance.campaign.statement import Origin
    from ugv_acceptance.campaign.work import Brief, Done

EXIT = {'PASS': 0, 'FAIL': 1, 'INCONCLUSIVE': 3}


def campaign(
    places: Annotated[
        list[str],
        typer.Argument(metavar='DIR|URL...', help='Folders, recordings, URLs that fsspec knows.'),
    ],
    out: Annotated[
        Path, typer.Option('--out', '-o', help='Folder of results; run again to resume.')
    ] = Path('campaign'),
    config: Annotated[
        Path | None,
        typer.Option('--config', '-c', help='YAML file, or the name of one that ships: packbot.'),
    ] = None,
    urdf: Annotated[
        Path | None, typer.Option(help='URDF in place of the one the YAML names.')
    ] = None,
    criteria: Annotated[
        Path | None,
        typer.Option(help='YAML file of criteria; without it the limits of the configuration.'),
    ] = None,
    failures: Annotated[
        Path | None, typer.Option(help='Failure log a person wrote, YAML or CSV.')
    ] = None,
    confidence: Annotated[
        float, typer.Option(min=0.5, max=0.999, help='Of bounds, tests and demonstrations.')
    ] = 0.8,
    require_mtbf: Annotated[
        float | None, typer.Option(help='MTBF (h) to demonstrate; decides the exit code.')
    ] = None,
    ended_by_failure: Annotated[
        bool, typer.Option('--ended-by-failure', help='It was planned to end with a failure.')
    ] = False,
    compare: Annotated[
        list[str] | None,
        typer.Option(help='NAME=PATTERN of runs, given twice: two robots, two firmwares.'),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help='Processes; all cores if left out.')
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help='Address of a dask.distributed scheduler to work instead.')
    ] = None,
    cluster_wait: Annotated[
        float,
        typer.Option(min=0.0, help='Seconds to wait for a scheduler or workers that are gone.'),
    ] = 60.0,
    overwrite: Overwrite = False,
) -> None:
    """Judge many runs and state what they show: MTBF, availability, success, trend.

    Writes campaign.json, campaign.html and a result a run into --out. A run that is INCONCLUSIVE
    or cannot be read is counted, never dropped. While a run was not judged (a worker died, a
    scheduler or a network is gone) nothing is stated and the exit code is 3: the same command
    again judges what is missing. With --require-mtbf the exit code is 0 where it is demonstrated,
    1 where it is excluded, 3 where neither; else 0 where every run passed, 1 where one failed, 2
    where one could not be read, 3 where one is inconclusive.

    \b
    Examples:
      ugv-acceptance campaign recordings --require-mtbf 96 --failures failures.yaml
      ugv-acceptance campaign s3://bucket/runs --scheduler tcp://head:8786
      ugv-acceptance campaign recordings --compare 'old=*/fw1/*' --compare 'new=*/fw2/*'
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.campaign.failure_log import read_log
    from ugv_acceptance.campaign.pool import cores
    from ugv_acceptance.campaign.run import Place, all_failures, carry_out
    from ugv_acceptance.campaign.sources import find_sources
    from ugv_acceptance.campaign.statement import Question, statement
    from ugv_acceptance.cli.campaign_text import print_campaign, print_effort
    from ugv_acceptance.cli.kinds import CAMPAIGN
    from ugv_acceptance.cli.summary import while_read

    check_requirement(require_mtbf)
    question = Question(confidence, require_mtbf, ended_by_failure, groups_from(compare or []))
    brief, origin = terms_of(config, urdf, criteria)
    entries = read_log(failures) if failures else []
    sources = find_sources(places)
    recorded = [Path(file) for s in sources if not s.remote for file in s.files]
    inputs = inputs_of(brief.config, recorded, criteria=criteria, failures=failures)
    check_folder('--out', out, CAMPAIGN, inputs, overwrite=overwrite)
    began = time.monotonic()
    with progress_bar(len(sources)) as progress:
        place = Place(out, workers or cores(), scheduler, cluster_wait)
        rows, effort = carry_out(sources, brief, place, progress)
    took = time.monotonic() - began
    said = statement(rows, all_failures(rows, entries), question, origin)
    write(out, said)
    with while_read():
        print_campaign(said, out)
        print_effort(effort, len(sources), took)
    raise typer.Exit(exit_code(said))


def exit_code(said: dict[str, Any]) -> int:
    """Return the exit code: that of the requirement if there is one, else of the worst run.

    That of INCONCLUSIVE where nothing could be stated.
    """
    if said['no_statement'] is not None:
        return EXIT['INCONCLUSIVE']
    if said['requirement'] is not None:
        return EXIT[said['requirement']['verdict']]
    worst = (('FAIL', 1), ('BROKEN', 2), ('INCONCLUSIVE', 3))
    return next((code for word, code in worst if said['runs'][word]), 0)


def check_requirement(required: float | None) -> None:
    """Raise AcceptanceError where the MTBF to demonstrate is no time."""
    if required is not None and not 0.0 < required < float('inf'):
        raise AcceptanceError(f'--require-mtbf: expected hours above 0, got {required:g}')


def groups_from(compare: list[str]) -> tuple[tuple[str, str], ...]:
    """Return the two groups (name, pattern). AcceptanceError where there are not two of them."""
    groups = tuple((name, pattern) for name, _, pattern in (c.partition('=') for c in compare))
    if any(not name or not pattern for name, pattern in groups):
        raise AcceptanceError('--compare: expected NAME=PATTERN, such as new=*/fw2/*')
    if len(groups) not in {0, 2}:
        raise AcceptanceError(f'--compare: expected to be given twice, got {len(groups)}')
    return groups


def terms_of(
    config: Path | None, urdf: Path | None, criteria: Path | None
) -> 'tuple[Brief, Origin]':
    """Return by what the runs are judged, and its names and hashes."""
    from ugv_acceptance.campaign.statement import Origin
    from ugv_acceptance.campaign.work import Brief
    from ugv_acceptance.config import load
    from ugv_acceptance.config.criteria import load_criteria

    loaded = load(config, urdf=urdf)
    found = load_criteria(criteria, loaded.settings) if criteria else None
    name = found.name if found else 'limits of the configuration'
    origin = Origin(loaded.name, loaded.sha256, name, found.sha256 if found else None)
    return Brief(loaded, found), origin


def write(out: Path, said: dict[str, Any]) -> None:
    """Write campaign.json and campaign.html."""
    from ugv_acceptance.bag.result import write_json, write_text
    from ugv_acceptance.report.campaign import campaign_page

    write_json(out / 'campaign.json', said)
    write_text(out / 'campaign.html', campaign_page(said))


@contextmanager
def progress_bar(total: int) -> 'Iterator[Callable[[Done], None]]':
    """Show how many runs are ready, and how many not judged, where a person is watching."""
    from rich.console import Console
    from rich.progress import MofNCompleteColumn, Progress

    console = Console(file=sys.stderr)
    with Progress(
        *Progress.get_default_columns(),
        MofNCompleteColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    ) as bar:
        task = bar.add_task('runs', total=total)
        lost = 0

        def advance(done: 'Done') -> None:
            nonlocal lost
            lost += bool(done.lost)
            words = f'runs ({lost} not judged)' if lost else 'runs'
            bar.update(task, advance=1, description=words)

        yield advance
