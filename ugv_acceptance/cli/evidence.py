"""What an evaluation leaves behind: a report, PDF, JUnit XML, tables, proposed criteria."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ugv_acceptance import AcceptanceError, __version__
from ugv_acceptance.type_aliases import Json

if TYPE_CHECKING:
    from ugv_acceptance.bag.reader import Bag, Topics
    from ugv_acceptance.cli.outputs import Output
    from ugv_acceptance.config import Config
    from ugv_acceptance.evaluation.criteria.criteria import CriteriaSet
    from ugv_acceptance.evaluation.downsampling import StripRecorder
    from ugv_acceptance.evaluation.settings import Settings
    from ugv_acceptance.offline.evaluate import Judgement


@dataclass(frozen=True, slots=True)
class Papers:
    """The files of one recording a user asked for, and the criteria it is judged by."""

    report: Path | None = None
    pdf: Path | None = None
    csv: Path | None = None
    parquet: Path | None = None
    criteria: Path | None = None
    init_criteria: Path | None = None
    annotate: Path | None = None

    @property
    def paged(self) -> bool:
        """Whether a report is asked for, as HTML or PDF."""
        return self.report is not None or self.pdf is not None

    def outputs(self, recordings: int) -> list['Output']:
        """Return the files to write. AcceptanceError where one is of one run, but asked of more."""
        from ugv_acceptance.cli import output_kinds as kinds
        from ugv_acceptance.cli.outputs import Output

        found = [
            Output('--report', self.report, kinds.REPORT),
            Output('--pdf', self.pdf, kinds.PDF),
            Output('--csv', self.csv, kinds.MARGINS),
            Output('--parquet', self.parquet, kinds.PARQUET),
            Output('--init-criteria', self.init_criteria, kinds.CRITERIA),
            Output('--annotate', self.annotate, kinds.ANNOTATED),
        ]
        for output in found:
            if output.path is not None and recordings != 1:
                raise AcceptanceError(f'{output.option} takes one recording, got {recordings}')
        return found


def judge_files(
    paths: list[Path], config: 'Config', papers: Papers, *, compare_effort: bool = False
) -> tuple[Json, 'StripRecorder | None']:
    """Return the result of one recording, and its strips where a report is asked for."""
    from ugv_acceptance.bag.atomic_files import CsvSink
    from ugv_acceptance.bag.reader import choose_topics, open_bag
    from ugv_acceptance.cli.result_text import progress_of
    from ugv_acceptance.config.uncertain import sources_from
    from ugv_acceptance.evaluation.downsampling import StripRecorder
    from ugv_acceptance.evaluation.effort.plateaus import EffortComparison
    from ugv_acceptance.offline.acknowledgements import add_acknowledgements
    from ugv_acceptance.offline.evaluate import Terms, judge
    from ugv_acceptance.offline.parquet import ParquetSink

    settings, wanted = config.settings, config.topics
    terms = Terms(
        criteria_of(papers, settings),
        sources_from(config),
        detail=papers.csv is not None or papers.parquet is not None,
    )
    bag = open_bag(paths)
    names = (wanted.joint_states.name, wanted.imu.name, wanted.payload.name)
    topics = choose_topics(bag, *names)
    effort, recorder = EffortComparison(settings), StripRecorder(settings, bag.start_ns)
    wishes = ((effort.add, compare_effort), (recorder.add, papers.paged))
    sinks = [sink for sink, asked in wishes if asked]
    with (
        CsvSink(papers.csv, settings, bag.start_ns) as csv,
        ParquetSink(papers.parquet, settings, bag.start_ns) as parquet,
        progress_of(bag.start_ns, bag.end_ns, sys.stderr) as progress,
    ):
        takers = [*sinks, *csv.sinks, *parquet.sinks]
        judgement = judge(bag, topics, settings, takers, progress, terms)
    result = judgement.result
    if papers.annotate is not None:
        annotate(papers.annotate, bag, topics, judgement, config)
    complete(result, bag, config)
    add_acknowledgements(result, bag)
    if compare_effort:
        result['effort'] = effort.result(bag.start_ns)
    return result, recorder if papers.paged else None


def annotate(
    path: Path, bag: 'Bag', topics: 'Topics', judgement: 'Judgement', config: 'Config'
) -> None:
    """Write the recording with its judgement beside it, for viewers."""
    from ugv_acceptance.bag.annotated import write_annotated
    from ugv_acceptance.cli.result_text import progress_of
    from ugv_acceptance.offline.annotation import Annotation

    robot = config.serial or config.name
    told = Annotation(bag, topics, config.settings, judgement, robot)
    with progress_of(bag.start_ns, bag.end_ns, sys.stderr) as progress:
        write_annotated(path, bag, told.types, told.said(), progress)


def criteria_of(papers: Papers, settings: 'Settings') -> 'CriteriaSet | None':
    """Return the criteria of the file that was given; None: the limits of the configuration."""
    from ugv_acceptance.config.criteria import load_criteria

    return None if papers.criteria is None else load_criteria(papers.criteria, settings)


def complete(result: Json, bag: 'Bag', config: 'Config') -> None:
    """Add to a result what it was made with: robot, software, when it was recorded."""
    import platform
    from datetime import datetime, timezone

    import numpy as np

    result['robot'] = {
        'name': config.name,
        'serial': config.serial,
        'config': str(config.path),
        'urdf': str(config.urdf_path),
        'sha256': config.sha256,
        'warnings': list(config.warnings),
    }
    result['software'] = {
        'version': __version__,
        'numpy': np.__version__,
        'python': platform.python_version(),
    }
    began = datetime.fromtimestamp(bag.start_ns // 10**9, timezone.utc)
    result['recorded'] = began.strftime('%Y-%m-%d %H:%M:%S UTC') if bag.start_ns else None


def write_papers(
    papers: Papers, result: Json, recorder: 'StripRecorder | None', settings: 'Settings'
) -> None:
    """Write the report, the PDF and the proposed criteria of one recording."""
    if recorder is not None:
        from ugv_acceptance.bag.atomic_files import write_text
        from ugv_acceptance.config.identity import PARTS
        from ugv_acceptance.report.acceptance import acceptance_page

        html = acceptance_page(result, recorder.strips(), settings, PARTS)
        if papers.report is not None:
            write_text(papers.report, html)
        if papers.pdf is not None:
            _write_pdf(papers.pdf, html)
    if papers.init_criteria is not None:
        _propose(papers.init_criteria, result)


def _propose(path: Path, result: Json) -> None:
    """Write criteria that a good run meets; of any other say so and go on: its verdict stands."""
    from ugv_acceptance.bag.atomic_files import write_text
    from ugv_acceptance.config.seal import sealed
    from ugv_acceptance.evaluation.criteria.proposal import proposed_criteria

    if result['verdict'] == 'PASS':
        write_text(path, sealed(proposed_criteria(result, result['robot']['name'])))
    else:
        text = f'--init-criteria: expected a run that passes, got {result["verdict"]}'
        typer.echo(f'ugv-acceptance: {text}', err=True)


def _write_pdf(path: Path, html: str) -> None:
    """Write the PDF; without WeasyPrint say so and go on: the verdict does not depend on it."""
    from ugv_acceptance.bag.atomic_files import write_bytes
    from ugv_acceptance.report.acceptance import pdf_of

    try:
        write_bytes(path, pdf_of(html))
    except AcceptanceError as error:
        typer.echo(f'ugv-acceptance: {error}', err=True)


def write_junit(path: Path, results: list[Json]) -> None:
    """Write the JUnit XML of all recordings."""
    from ugv_acceptance.bag.atomic_files import write_bytes
    from ugv_acceptance.report.junit import junit_of

    write_bytes(path, junit_of(results))
