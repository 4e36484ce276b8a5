"""`ugv-acceptance evaluate`: judges recorded runs and prints the verdict with its reasons."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ugv_acceptance import AcceptanceError
from ugv_acceptance.cli.options import (
    ConfigFile,
    CriteriaFile,
    GroundKinds,
    Overwrite,
    UrdfFile,
    Verbose,
    dash,
)
from ugv_acceptance.cli.outputs import Input, Output, check_outputs, inputs_of

if TYPE_CHECKING:
    from ugv_acceptance.cli.evidence import Papers
    from ugv_acceptance.config import Config
    from ugv_acceptance.offline.training import TrainingRecord
    from ugv_acceptance.type_aliases import Json

EXIT = {'PASS': 0, 'FAIL': 1, 'INCONCLUSIVE': 3}
BAD_INPUT = 2


def evaluate(
    bags: Annotated[
        list[Path],
        typer.Argument(help='rosbag2 folders, .mcap files (parts of a split bag go together), ...'),
    ],
    config: ConfigFile = None,
    urdf: UrdfFile = None,
    json_file: Annotated[
        Path | None,
        typer.Option('--json', callback=dash, help='Write the result to this file; -: print it.'),
    ] = None,
    csv_file: Annotated[
        Path | None,
        typer.Option('--csv', callback=dash, help='Write the margins over time to this file.'),
    ] = None,
    compare_effort: Annotated[
        bool,
        typer.Option(
            '--compare-effort', help='Compare measured effort with static torque at rest.'
        ),
    ] = False,
    criteria: CriteriaFile = None,
    ground: GroundKinds = None,
    init_criteria: Annotated[
        Path | None, typer.Option(help='Propose criteria from this (good) run in this file.')
    ] = None,
    identity: Annotated[
        str | None,
        typer.Option(help='For the report: operator=..,robot_serial=..,place=.. or a YAML file.'),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(help='Write a report to sign, one HTML file.')
    ] = None,
    pdf: Annotated[Path | None, typer.Option(help='The report as PDF (needs weasyprint).')] = None,
    junit: Annotated[
        Path | None, typer.Option(help='Write JUnit XML, one case a criterion.')
    ] = None,
    parquet: Annotated[
        Path | None, typer.Option(help='Write the margins over time as Parquet (needs pyarrow).')
    ] = None,
    annotate: Annotated[
        Path | None,
        typer.Option(help='Write the recording with margins, verdict and alerts beside it (MCAP).'),
    ] = None,
    drill: Annotated[
        list[Path] | None,
        typer.Option(help="The record of an operator's drill, for the report; several allowed."),
    ] = None,
    verbose: Verbose = False,
    overwrite: Overwrite = False,
) -> None:
    """Judge recorded runs: margins, alerts and a verdict with its reasons.

    The exit code is 0 for PASS, 1 for FAIL, 2 for bad input, 3 for INCONCLUSIVE; of several bags
    the worst counts. Missing data never passes.

    \b
    Examples:
      ugv-acceptance evaluate bags/packbot_pass
      ugv-acceptance evaluate run_0.mcap run_1.mcap --json r.json --csv m.csv
      ugv-acceptance evaluate run -c robot.yaml --urdf robot.urdf --compare-effort
      ugv-acceptance evaluate run --criteria site.yaml --report r.html -v
      ugv-acceptance evaluate run --annotate run_judged.mcap
      ugv-acceptance evaluate run --ground stairs=12s..40s
      ugv-acceptance evaluate run --drill ada.json --report r.html
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.bag.atomic_files import write_json
    from ugv_acceptance.cli import output_kinds as kinds
    from ugv_acceptance.cli.evidence import Papers, write_junit
    from ugv_acceptance.cli.ground_option import ground_from
    from ugv_acceptance.cli.result_text import print_results
    from ugv_acceptance.cli.terminal_output import result_console, while_read, wrote
    from ugv_acceptance.config import description_topic, load
    from ugv_acceptance.config.files import find
    from ugv_acceptance.config.identity import file_of, identity_from

    under, drilled = ground_from(ground), _drills(drill or ())
    papers = Papers(
        report, pdf, csv_file, parquet, criteria, init_criteria, annotate, under, drilled
    )
    groups = recordings(bags)
    told = description_topic(config, urdf=urdf) is not None
    robot = find(config) if config and told else load(config, urdf=urdf)
    of_all = [Output('--json', json_file, kinds.RESULT), Output('--junit', junit, kinds.JUNIT)]
    inputs = inputs_of(robot, bags, criteria=criteria, identity=file_of(identity))
    inputs += [Input('the record of a drill', path) for path in drill or ()]
    check_outputs([*of_all, *papers.outputs(len(groups))], inputs, overwrite=overwrite)
    entered = identity_from(identity)
    judged = [_judged(one, robot, papers, compare_effort, entered) for one in groups]
    results, codes = [result for result, _ in judged], [code for _, code in judged]
    if json_file is not None:
        write_json(json_file, results[0] if len(results) == 1 else results)
    if junit is not None:
        write_junit(junit, results)
    with while_read():
        print_results(results, result_console(json_file, csv_file, junit), verbose=verbose)
    wrote(json_file, junit)
    raise typer.Exit(worst(codes))


def _drills(paths: list[Path] | tuple[Path, ...]) -> 'tuple[TrainingRecord, ...]':
    """Return the records of drills."""
    if not paths:
        return ()
    from ugv_acceptance.drill.record import training_record

    return tuple(training_record(path) for path in paths)


def _judged(
    paths: list[Path],
    robot: 'Config | Path',
    papers: 'Papers',
    compare_effort: bool,
    identity: dict[str, str],
) -> 'tuple[Json, int]':
    """Return the result of one recording and its exit code; of one that cannot be read, why."""
    from ugv_acceptance.cli.evidence import evaluate_files
    from ugv_acceptance.cli.terminal_output import complain

    try:
        result = evaluate_files(
            paths, robot, papers, compare_effort=compare_effort, identity=identity
        ).result
    except AcceptanceError as error:
        complain(str(error))
        why = {'verdict': 'BAD INPUT', 'reasons': [str(error)], 'bag': {'path': paths}}
        return why, BAD_INPUT
    return result, EXIT[result['verdict']]


def worst(codes: list[int]) -> int:
    """Return the exit code of several bags: of a FAIL, else of bad input, else of INCONCLUSIVE."""
    return next((code for code in (1, BAD_INPUT, 3) if code in codes), 0)


def recordings(paths: list[Path]) -> list[list[Path]]:
    """Return the paths that belong together: files of one folder that differ only in _NUMBER."""
    from ugv_acceptance.bag.metadata import part_of

    groups: dict[tuple[Path, str], list[Path]] = {}
    for path in paths:
        part = part_of(path.name) if path.is_file() else None
        key = (path.parent, part[0]) if part else (path, '')
        groups.setdefault(key, []).append(path)
    return list(groups.values())
