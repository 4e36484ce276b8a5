"""The sections of the paper's page, in the paper's order."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ugv_acceptance.evaluation.alerts.failure_source import HUMAN, FailureSource
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.report.paper.arm_figures import (
    disagreement,
    figure_4,
    figure_5,
    one_sided_table,
    paper_grid,
    safe_fractions,
)
from ugv_acceptance.report.paper.capacity_figures import (
    Capability,
    drag_figure,
    drag_table,
    lift_figure,
    lift_table,
)
from ugv_acceptance.report.paper.joints import check_parts
from ugv_acceptance.report.paper.numbers import (
    Simulated,
    family,
    ideal_row,
    speed_rows,
    table_1_rows,
    table_2_rows,
    torque_rows,
)
from ugv_acceptance.report.paper.page import Picture, Section
from ugv_acceptance.report.paper.prose import (
    CAPABILITY,
    FIGURE_4,
    MULTI_BODY,
    ROLLOVER,
    STATISTICS,
    WORST_CASE,
)
from ugv_acceptance.report.paper.rollover_figures import figure_6, figure_7, level_figure
from ugv_acceptance.studies.offsets import OFFSET1, OFFSET2
from ugv_acceptance.type_aliases import Floats

Extra = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Subject:
    """The data of the page: a robot with its torque limits (N m), and simulation results.

    `simulated` are the arm's torques in a multi-body simulation, `simulated_f` the F values (8, 2)
    from it, `truth` the lines of a table that compares the rollover map with simulated tipping,
    `joints` tables of what each joint of the simulated vehicle bears.
    """

    robot: Robot
    limits: Floats
    simulated: Simulated | None = None
    simulated_f: Floats | None = None
    truth: Sequence[Sequence[str]] = ()
    joints: Sequence[Sequence[Sequence[str]]] = ()


Built = tuple[Section, Extra]


def taxonomy(_: Subject) -> Built:
    """Return the section of Figure 1, the taxonomy of failures."""
    physical = [s.value for s in FailureSource if s not in HUMAN]
    human = [s.value for s in FailureSource if s in HUMAN]
    table = [
        ['source', 'categories'],
        ['physical', ', '.join(physical)],
        ['human', ', '.join(human)],
    ]
    text = 'Every alert and every record of a campaign is filed under one of these.'
    return Section('Figure 1: where failures come from', [text], tables=[table]), {}


def worst_case(_: Subject) -> Built:
    """Return the section of Table 1 and the ranges of equations (4) to (8)."""
    return (
        Section(
            'Equations (1) to (8) and Table 1: worst cases and safe ranges',
            WORST_CASE,
            [*table_1_rows(), *torque_rows()],
            [one_sided_table(30.0)],
        ),
        {},
    )


def dynamic(subject: Subject) -> Built:
    """Return the section of Figure 4, static against dynamic torque."""
    caption = FIGURE_4
    if subject.simulated is not None:
        caption += ' Crosses: the same arm in MuJoCo.'
    picture = Picture('figure_4', figure_4(subject.simulated), caption)
    text = MULTI_BODY if subject.joints else ()
    title = 'Figure 4: static and dynamic torque'
    return Section(title, text, tables=subject.joints, pictures=[picture]), {}


def statistics(subject: Subject) -> Built:
    """Return the section of Table 2, the critical value and the acceptable speed."""
    text = [part.format(**_spans()) for part in STATISTICS]
    tables = []
    if subject.simulated_f is not None:
        tables.append(_simulated_table(subject.simulated_f))
    rows = [*table_2_rows(), ideal_row(), *speed_rows()]
    return Section('Table 2: up to which speed the static model holds', text, rows, tables), {}


def _spans() -> dict[str, float]:
    """Return the ends (mm) of the ranges of link offsets that give Table 2, and the pair used."""
    fits = family()
    return {
        'second_low': fits.offset2[0] * 1e3,
        'second_high': fits.offset2[-1] * 1e3,
        'low': fits.positive.min() * 1e3,
        'high': fits.positive.max() * 1e3,
        'mirror_low': fits.negative.max() * 1e3,
        'mirror_high': fits.negative.min() * 1e3,
        'first': OFFSET1 * 1e3,
        'second': OFFSET2 * 1e3,
    }


def _simulated_table(found: Floats) -> list[list[str]]:
    head = ['F from MuJoCo torques', '1°/s', '5', '7.2', '36', '72', '108', '144', '180']
    return [head] + [
        [f'joint {k + 1}', *(f'{value:.1f}' for value in found[:, k])]
        for k in range(found.shape[1])
    ]


def torque_regions(_: Subject) -> Built:
    """Return the section of Figure 5, the regions of torque failure."""
    grid = paper_grid()
    fractions, wrong = safe_fractions(grid), disagreement(grid)
    cells = len(grid.x) * len(grid.y)
    table = [['threshold', 'safe area, closed form', 'safe area, map', 'cells judged differently']]
    table += [
        [f'{limit:g} N m', f'{exact:.4f}', f'{counted:.4f}', f'{wrong[limit]} of {cells}']
        for limit, (exact, counted) in fractions.items()
    ]
    caption = 'The boundaries are drawn from the closed form, the areas from the map.'
    picture = Picture('figure_5', figure_5(), caption)
    extra = {f'{limit:g}': exact for limit, (exact, _) in fractions.items()}
    section = Section('Figure 5: failure and safe regions', tables=[table], pictures=[picture])
    return section, {'safe_fraction': extra}


def orientations(_: Subject) -> Built:
    """Return the section of Figure 6, the orientations."""
    caption = 'The named orientations, for --orientation of the verb map.'
    picture = Picture('figure_6', figure_6(), caption)
    return Section('Figure 6: orientations', pictures=[picture]), {}


def rollover(subject: Subject) -> Built:
    """Return the section of Figure 7, level ground, and simulated tip-overs."""
    check_parts(subject.robot)
    seven, table = figure_7(subject.robot)
    level, left = level_figure(subject.robot)
    load = subject.robot.payload.mass
    text = [part.format(load=load, **left) for part in ROLLOVER]
    pictures = [
        Picture('figure_7', seven, 'Tilt left before the robot tips about the nearest edge.'),
        Picture('level_ground', level, 'The same on level ground.'),
    ]
    tables = [subject.truth] if subject.truth else []
    section = Section('Figure 7: rollover', text, tables=tables, pictures=pictures)
    return section, {'figure_7': table, 'level_full_reach_tilt_left_deg': left}


def capability(subject: Subject) -> Built:
    """Return the section on pulling and lifting capability."""
    drag, lift = (
        drag_table(subject.robot, subject.limits),
        lift_table(subject.robot, subject.limits),
    )
    pictures = [
        Picture('drag', drag_figure(subject.robot, subject.limits), 'Dragging with the arm.'),
        Picture(
            'lift', lift_figure(subject.robot, subject.limits), 'Lifting with and without flippers.'
        ),
    ]
    section = Section(
        'Dragging and lifting capability',
        CAPABILITY,
        tables=[_table(drag), _table(lift)],
        pictures=pictures,
    )
    return section, {'drag': [_line(c) for c in drag], 'lift': [_line(c) for c in lift]}


def _table(rows: Sequence[Capability]) -> list[list[str]]:
    head = ['what', 'flippers', 'largest', 'first', 'shoulder, elbow']
    return [head] + [
        [
            row.what,
            row.flippers,
            f'{row.best:.1f} {row.unit}' if math.isfinite(row.best) else 'no bound',
            row.cause,
            '' if row.at_deg is None else f'{row.at_deg[0]:.0f}°, {row.at_deg[1]:.0f}°',
        ]
        for row in rows
    ]


def _line(row: Capability) -> dict[str, Any]:
    best = row.best if np.isfinite(row.best) else None
    return {'what': row.what, 'flippers': row.flippers, row.unit: best, 'first': row.cause}


# In the order of the page; each takes the subject and gives a section and what it adds to the JSON.
SECTIONS: dict[str, Callable[[Subject], Built]] = {
    'taxonomy': taxonomy,
    'worst cases': worst_case,
    'dynamics': dynamic,
    'statistics': statistics,
    'torque regions': torque_regions,
    'orientations': orientations,
    'rollover': rollover,
    'capability': capability,
}
