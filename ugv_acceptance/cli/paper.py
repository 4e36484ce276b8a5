"""`ugv-acceptance paper`: recomputes every number, table and figure of the paper."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ugv_acceptance.cli.options import Overwrite, RobotFile
from ugv_acceptance.cli.outputs import check_folder, inputs_of
from ugv_acceptance.cli.terminal_output import (
    console_of,
    say,
    status,
    tracked,
    while_read,
    wrote,
)

if TYPE_CHECKING:
    from ugv_acceptance.config import Config
    from ugv_acceptance.report.paper.numbers import Row
    from ugv_acceptance.report.paper.page import Section
    from ugv_acceptance.report.paper.sections import Subject


def paper(
    out: Annotated[Path, typer.Option(help='Folder for paper.html and paper.json.')] = Path(
        'paper'
    ),
    config: RobotFile = None,
    simulate: Annotated[
        bool, typer.Option(help='Also compute the arm in MuJoCo, beside the closed form.')
    ] = True,
    truth: Annotated[
        int,
        typer.Option(help='Random cases compared with tipping in MuJoCo, 0.3 s each.'),
    ] = 0,
    overwrite: Overwrite = False,
) -> None:
    """Reproduce the paper's numbers as a page and as JSON; print which of them match.

    \b
    Examples:
      ugv-acceptance paper
      ugv-acceptance paper --out pages/paper --truth 500
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.cli.output_kinds import PAPER
    from ugv_acceptance.config import load
    from ugv_acceptance.report.paper.joints import check_parts
    from ugv_acceptance.report.paper.numbers import as_json
    from ugv_acceptance.report.paper.page import draw, render
    from ugv_acceptance.report.paper.sections import SECTIONS

    loaded = load(config)
    check_parts(loaded.settings.robot)
    check_folder('--out', out, PAPER, inputs_of(loaded), overwrite=overwrite)
    subject = _subject(loaded, simulate, truth)
    sections: list[Section] = []
    extra: dict[str, Any] = {}
    for build in tracked(SECTIONS.values(), 'computing', len(SECTIONS), 'sections'):
        section, more = build(subject)
        sections.append(section)
        extra |= more
    drawn = draw(sections)
    rows = [row for section in sections for row in section.rows]
    document = as_json(rows, [f'{name}.svg' for name in drawn]) | extra
    pages = {'paper.html': render(loaded.name, sections, drawn)}
    _write(out, document, pages | {f'{name}.svg': svg for name, svg in drawn.items()})
    with while_read():
        _print(rows, subject)
    wrote(*(out / name for name in ('paper.json', 'paper.html', *(f'{one}.svg' for one in drawn))))


def _print(rows: 'list[Row]', subject: 'Subject') -> None:
    """Print how much of the paper was found again, all that differs, and the simulated truth."""
    from rich.markup import escape

    from ugv_acceptance.report.paper.numbers import summary

    console, matches = console_of(), sum(row.match for row in rows)
    outcome = f'{matches} of {len(rows)} numbers of the paper match'
    say(console, outcome)
    for place, count in summary(rows).items():
        say(console, f'{escape(place):34}{count["matches"]:3} of {count["of"]:2} match', 2)
    for row in rows:
        if not row.match:
            text = f'differs: {row.what}: paper {row.paper}, ours {row.ours}: {row.reason}'
            say(console, escape(text), 2)
    for line in subject.truth:
        first, *others = line
        say(console, escape('  '.join([f'{first:32}', *others]).rstrip()), 2, 6)
    say(console, outcome)


def _write(out: Path, document: dict[str, Any], files: dict[str, str]) -> None:
    """Write the page's folder; paper.json comes first, because it marks the folder as ours."""
    import json

    from ugv_acceptance.bag.atomic_files import naming, write_text

    with naming(out):
        out.mkdir(parents=True, exist_ok=True)
    text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
    for name, content in {'paper.json': text + '\n', **files}.items():
        write_text(out / name, content)


def _subject(loaded: 'Config', simulate: bool, truth: int) -> 'Subject':
    import numpy as np

    from ugv_acceptance.report.paper.sections import Subject

    robot, limits = loaded.settings.robot, np.array(loaded.settings.limits.torque)
    if not simulate:
        return Subject(robot, limits)
    from ugv_acceptance.cli.paper_simulation import simulated_arm, simulated_joints, simulated_truth

    torques, f_values = simulated_arm()
    joints = [simulated_joints(robot, free=False)]
    if truth:
        with status('Turning the elbow on the simulated vehicle'):
            joints.append(simulated_joints(robot, free=True))
    lines = simulated_truth(robot, truth) if truth else ()
    return Subject(robot, limits, torques, f_values, lines, joints)
