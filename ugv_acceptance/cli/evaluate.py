"""`ugv-acceptance evaluate`: judge recorded runs and print what a person reads in ten seconds."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ugv_acceptance import AcceptanceError

if TYPE_CHECKING:
    from ugv_acceptance.config import Config

EXIT = {'PASS': 0, 'FAIL': 1, 'INCONCLUSIVE': 3}
BAD_INPUT = 2


def evaluate(
    bags: Annotated[
        list[Path],
        typer.Argument(help='rosbag2 folders, .mcap files (parts of a split bag go together), ...'),
    ],
    config: Annotated[
        Path | None,
        typer.Option('--config', '-c', help='YAML file, or the name of one that ships: packbot.'),
    ] = None,
    urdf: Annotated[
        Path | None, typer.Option(help='URDF in place of the one the YAML names.')
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option('--json', help='Write the result to this file.')
    ] = None,
    csv_file: Annotated[
        Path | None, typer.Option('--csv', help='Write the margins over time to this file.')
    ] = None,
    compare_effort: Annotated[
        bool,
        typer.Option('--compare-effort', help='Measured effort beside static torque at rest.'),
    ] = False,
) -> None:
    """Judge recorded runs: margins, alerts and a verdict with its reasons.

    The exit code is 0 for PASS, 1 for FAIL, 2 for bad input, 3 for INCONCLUSIVE; of several bags
    the worst counts. Missing data never passes.

    \b
    Examples:
      ugv-acceptance evaluate bags/packbot_pass
      ugv-acceptance evaluate run_0.mcap run_1.mcap --json result.json --csv margins.csv
      ugv-acceptance evaluate run --config my_robot.yaml --urdf my_robot.urdf --compare-effort
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.bag.result import check_writable, write_json
    from ugv_acceptance.config import load

    loaded = load(config, urdf=urdf)
    groups = recordings(bags)
    check_writable(json_file)
    check_writable(csv_file)
    if csv_file is not None and len(groups) > 1:
        raise AcceptanceError(f'--csv takes the margins of one recording, got {len(groups)}')
    results: list[dict[str, Any]] = []
    codes: list[int] = []
    for paths in groups:
        try:
            result = judge_recording(paths, loaded, csv_file, compare_effort=compare_effort)
        except AcceptanceError as error:
            typer.echo(f'ugv-acceptance: {error}', err=True)
            result = {'verdict': 'BAD INPUT', 'reasons': [str(error)], 'bag': {'path': paths}}
            codes.append(BAD_INPUT)
        else:
            codes.append(EXIT[result['verdict']])
        results.append(result)
    if json_file is not None:
        write_json(json_file, results[0] if len(results) == 1 else results)
    raise typer.Exit(worst(codes))


def worst(codes: list[int]) -> int:
    """Return the exit code of several bags: a failure, then bad input, then inconclusive."""
    return next((code for code in (1, BAD_INPUT, 3) if code in codes), 0)


def recordings(paths: list[Path]) -> list[list[Path]]:
    """Return the paths that belong together: files of one folder that differ only in _NUMBER."""
    groups: dict[tuple[Path, str], list[Path]] = {}
    for path in paths:
        stem, _, number = path.name.partition('.')[0].rpartition('_')
        part = path.is_file() and stem and number.isdigit()
        key = (path.parent, stem) if part else (path, '')
        groups.setdefault(key, []).append(path)
    return list(groups.values())


def judge_recording(
    paths: list[Path], config: 'Config', csv_file: Path | None = None, *, compare_effort: bool
) -> dict[str, Any]:
    """Judge one recording, print its summary, and return its result."""
    from ugv_acceptance.bag.judge import Terms, judge
    from ugv_acceptance.bag.reader import choose_topics, open_bag
    from ugv_acceptance.bag.result import CsvSink
    from ugv_acceptance.cli.summary import print_result, progress_of
    from ugv_acceptance.config.uncertain import sources_from
    from ugv_acceptance.evaluation.effort import EffortComparison

    bag = open_bag(paths)
    wanted = config.topics
    names = (wanted.joint_states.name, wanted.imu.name, wanted.payload.name)
    topics = choose_topics(bag, *names)
    effort = EffortComparison(config.settings)
    sinks = [effort.add] if compare_effort else []
    terms = Terms(sources=sources_from(config), detail=csv_file is not None)
    with (
        CsvSink(csv_file, config.settings, bag.start_ns) as csv,
        progress_of(bag.start_ns, bag.end_ns, sys.stderr) as progress,
    ):
        judged = judge(bag, topics, config.settings, [*sinks, *csv.sinks], progress, terms)
    result = judged.result
    result['robot'] = {
        'name': config.name,
        'serial': config.serial,
        'config': str(config.path),
        'urdf': str(config.urdf_path),
        'sha256': config.sha256,
        'warnings': list(config.warnings),
    }
    if compare_effort:
        result['effort'] = effort.result(bag.start_ns)
    print_result(result)
    return result
