"""Writes the files `evaluate` is asked for: report, PDF, JUnit XML, tables, criteria."""

from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ugv_acceptance import AcceptanceError
from ugv_acceptance.type_aliases import Json

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from ugv_acceptance.cli.outputs import Output
    from ugv_acceptance.config import Config
    from ugv_acceptance.evaluation.downsampling import StripRecorder
    from ugv_acceptance.evaluation.ground import Ground
    from ugv_acceptance.evaluation.settings import Settings
    from ugv_acceptance.offline.evaluation import Evaluation


@dataclass(frozen=True, slots=True)
class Papers:
    """The output files that the user asked for, and the criteria a recording is judged by.

    `ground` is what the ground of the recording was, None: as configuration and criteria say.
    """

    report: Path | None = None
    pdf: Path | None = None
    csv: Path | None = None
    parquet: Path | None = None
    criteria: Path | None = None
    init_criteria: Path | None = None
    annotate: Path | None = None
    ground: 'Ground | None' = None

    @property
    def paged(self) -> bool:
        """Whether a report is asked for, as HTML or PDF."""
        return self.report is not None or self.pdf is not None

    def outputs(self, recordings: int) -> list['Output']:
        """Return the files to write. Raises AcceptanceError if one fits a single run only."""
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


def evaluate_files(
    paths: list[Path],
    config: 'Config | Path',
    papers: Papers,
    *,
    compare_effort: bool = False,
    identity: 'Mapping[str, str] | None' = None,
) -> 'Evaluation':
    """Evaluate one recording, write the files asked for, and return the evaluation.

    `config` is a path where the recording has to tell the robot's URDF.
    """
    from ugv_acceptance.bag.recording import open_recording
    from ugv_acceptance.cli.terminal_output import wrote
    from ugv_acceptance.evaluation.downsampling import StripRecorder
    from ugv_acceptance.offline.evaluate import evaluate
    from ugv_acceptance.offline.judge import Options
    from ugv_acceptance.offline.output import CsvSink, ParquetSink
    from ugv_acceptance.offline.own_robot import robot_of

    recording = open_recording(paths)
    robot = robot_of(recording, config) if isinstance(config, Path) else config
    settings = robot.settings
    start, end = recording.start_ns, recording.bag.end_ns
    recorder = StripRecorder(settings, start) if papers.paged else None
    with (
        CsvSink(papers.csv, settings, start) as csv,
        ParquetSink(papers.parquet, settings, start) as parquet,
        reading(start, end) as progress,
    ):
        takers = [*csv.sinks, *parquet.sinks]
        detail = bool(takers)
        takers += [recorder.add] if recorder else []
        found = evaluate(
            recording,
            config=robot,
            criteria=papers.criteria,
            ground=papers.ground,
            identity=identity,
            options=Options(tuple(takers), progress, detail, compare_effort),
        )
    wrote(papers.csv, papers.parquet)
    if papers.annotate is not None:
        annotate(papers.annotate, found)
    write_papers(papers, found.result, recorder, settings)
    return found


@contextmanager
def reading(start: int, end: int) -> 'Iterator[Callable[[int], None]]':
    """Show how far a recording is read; yields a function of the log time (ns) reached."""
    from ugv_acceptance.cli.terminal_output import progress

    with progress('reading', max(end - start, 1) / 1e9, 's of the recording') as reached:
        yield lambda now: reached((now - start) / 1e9, '')


def annotate(path: Path, evaluation: 'Evaluation') -> None:
    """Write a copy of the recording with margins, alerts and verdict added, for viewers."""
    from ugv_acceptance.bag.annotated import write_annotated
    from ugv_acceptance.cli.terminal_output import wrote
    from ugv_acceptance.offline.annotation import Annotation

    told, bag = Annotation(evaluation), evaluation.recording.bag
    with reading(bag.start_ns, bag.end_ns) as progress:
        write_annotated(path, bag, told.types, told.said(), progress)
    wrote(path)


def write_papers(
    papers: Papers, result: Json, recorder: 'StripRecorder | None', settings: 'Settings'
) -> None:
    """Write the report, the PDF and the proposed criteria of one recording."""
    if recorder is not None:
        from ugv_acceptance.bag.atomic_files import write_text
        from ugv_acceptance.cli.terminal_output import wrote
        from ugv_acceptance.config.identity import PARTS
        from ugv_acceptance.report.acceptance import acceptance_page

        html = acceptance_page(result, recorder.strips(), settings, PARTS)
        if papers.report is not None:
            write_text(papers.report, html)
            wrote(papers.report)
        if papers.pdf is not None:
            _write_pdf(papers.pdf, html)
    if papers.init_criteria is not None:
        _propose(papers.init_criteria, result)


def _propose(path: Path, result: Json) -> None:
    """Write criteria that a good run meets; for any other print why not, the verdict stands."""
    from ugv_acceptance.bag.atomic_files import write_text
    from ugv_acceptance.cli.terminal_output import complain, wrote
    from ugv_acceptance.config.seal import sealed
    from ugv_acceptance.evaluation.criteria.proposal import proposed_criteria

    if result['verdict'] == 'PASS':
        write_text(path, sealed(proposed_criteria(result, result['robot']['name'])))
        wrote(path)
    else:
        complain(f'--init-criteria: expected a run that passes, got {result["verdict"]}')


def _write_pdf(path: Path, html: str) -> None:
    """Write the PDF; without WeasyPrint print that and go on: the verdict does not need it."""
    from ugv_acceptance.bag.atomic_files import write_bytes
    from ugv_acceptance.cli.terminal_output import complain, wrote
    from ugv_acceptance.report.acceptance import pdf_of

    try:
        write_bytes(path, pdf_of(html))
    except AcceptanceError as error:
        complain(str(error))
    else:
        wrote(path)


def write_junit(path: Path, results: list[Json]) -> None:
    """Write the JUnit XML of all recordings."""
    from ugv_acceptance.bag.atomic_files import write_bytes
    from ugv_acceptance.report.junit import junit_of

    write_bytes(path, junit_of(results))
