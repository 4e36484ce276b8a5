"""The sections of the page that computes the paper again, in the paper's order."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ugv_acceptance.evaluation.taxonomy import HUMAN, Source
from ugv_acceptance.model.blocks import Floats
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.report.arm_figures import (
    Simulated,
    disagreement,
    figure_4,
    figure_5,
    paper_grid,
    safe_fractions,
)
from ugv_acceptance.report.capacity_figures import (
    Capability,
    drag_figure,
    drag_table,
    lift_figure,
    lift_table,
)
from ugv_acceptance.report.page import Picture, Section
from ugv_acceptance.report.paper_numbers import (
    family,
    ideal_row,
    speed_rows,
    table_1_rows,
    table_2_rows,
    torque_rows,
)
from ugv_acceptance.report.rollover_figures import check_parts, figure_6, figure_7, level_figure
from ugv_acceptance.report.safe_range import one_sided_table

Extra = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Subject:
    """What the page is about: a robot with its torque limits (N m), and what a simulation gave.

    `simulated` are the arm's torques in a multi-body simulation, `simulated_f` the F values (8, 2)
    from it; `truth` lines of a table that compares the rollover map with simulated tipping.
    """

    robot: Robot
    limits: Floats
    simulated: Simulated | None = None
    simulated_f: Floats | None = None
    truth: Sequence[Sequence[str]] = ()


Built = tuple[Section, Extra]


def taxonomy(_: Subject) -> Built:
    """Return Figure 1."""
    physical = [s.value for s in Source if s not in HUMAN]
    human = [s.value for s in Source if s in HUMAN]
    table = [['source', 'categories'], ['physical', ', '.join(physical)], ['human', ', '.join(human)]]
    text = 'Every alert and every record of a campaign is filed under one of these.'
    return Section('Figure 1: where failures come from', [text], tables=[table]), {}


def worst_case(_: Subject) -> Built:
    """Return Table 1 and the ranges of equations (4) to (8)."""
    text = (
        'Equation (3): the extrema of both torques lie at sin(θ₁ + θ₂) = 0. Link 2 then points to the '
        'side to which link 1 leans; upright, to either side. For any other robot the same question is '
        'answered by the three numbers c₀ + R cos(q − φ) that describe a torque over one joint.'
    )
    sides = (
        'Equations (5) to (8) bound only +T. A motor fails at −T as well. The table gives the safe θ₂ at '
        'T₁ = T₂ = 30 N m in both readings; they differ wherever the torque reaches −30 N m.'
    )
    return (
        Section(
            'Equations (1) to (8) and Table 1: worst cases and safe ranges',
            [text, sides],
            [*table_1_rows(), *torque_rows()],
            [one_sided_table(30.0)],
        ),
        {},
    )


def dynamic(subject: Subject) -> Built:
    """Return Figure 4."""
    caption = (
        'Static torque by equations (1) and (2); dynamic torque by the recursive Newton-Euler algorithm '
        'with the centres of gravity that give Table 2. At 7.2°/s the motion itself adds 0.02 N m; what '
        'is seen between line and marks is the offset of the centres of gravity.'
    )
    if subject.simulated is not None:
        caption += ' Crosses: the same arm in MuJoCo.'
    picture = Picture('figure_4', figure_4(subject.simulated), caption)
    return Section('Figure 4: static and dynamic torque', pictures=[picture]), {}


def statistics(subject: Subject) -> Built:
    """Return Table 2, the critical value and the speed."""
    fits = family()
    span = [fits.offset2[0] * 1e3, fits.offset2[-1] * 1e3]
    first = [fits.positive.min() * 1e3, fits.positive.max() * 1e3]
    mirror = [fits.negative.min() * 1e3, fits.negative.max() * 1e3]
    text = [
        'All 16 cells follow from rigid-body dynamics once the links’ centres of gravity are not at '
        'mid-link. The offsets that give every cell form two narrow bands: link 2 by '
        f'{span[0]:.2f} to {span[1]:.2f} mm, and link 1 by {first[0]:.2f} to {first[1]:.2f} mm or by '
        f'{mirror[1]:.2f} to {mirror[0]:.2f} mm; across a band link 1 may vary by no more than 0.015 mm. '
        f'The page uses +{47.28} and {-2.28} mm.',
        'What this means: the paper’s ADAMS model “accounts for all center of gravity locations”; its '
        'static model puts them at mid-link. The reference error at 1°/s is therefore a difference at '
        'rest, 1.0 N m at joint 1 (47 mm × 2.5 kg × g × cos 30°) and 0.04 N m at joint 2. Joint 2 feels '
        'nothing of a constant rate of its own, so its F is 1.0 at every speed. The offsets are a fit: '
        'any error at rest of that size and shape gives the same table.',
        'A flaw of the statistic: with both centres of gravity at mid-link the reference error is nearly '
        'zero and F = (speed / 1°/s)⁴ without bound. F compares the motion with whatever else is wrong '
        'with the static model: the worse the model, the faster the robot may move. The verb speed '
        'therefore asks for the static model’s own error in N m.',
    ]
    tables = []
    if subject.simulated_f is not None:
        tables.append(_simulated_table(subject.simulated_f))
    rows = [*table_2_rows(), ideal_row(), *speed_rows()]
    return Section('Table 2: up to which speed the static model holds', text, rows, tables), {}


def _simulated_table(found: Floats) -> list[list[str]]:
    head = ['F from MuJoCo torques', '1°/s', '5', '7.2', '36', '72', '108', '144', '180']
    return [head] + [
        [f'joint {k + 1}', *(f'{value:.1f}' for value in found[:, k])] for k in range(found.shape[1])
    ]


def torque_regions(_: Subject) -> Built:
    """Return Figure 5."""
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
    """Return Figure 6."""
    caption = 'The named orientations, for --orientation of the verb map.'
    picture = Picture('figure_6', figure_6(), caption)
    return Section('Figure 6: orientations', pictures=[picture]), {}


def rollover(subject: Subject) -> Built:
    """Return Figure 7, level ground, and the comparison with simulated truth."""
    check_parts(subject.robot)
    seven, table = figure_7(subject.robot)
    level, left = level_figure(subject.robot)
    text = [
        'The paper omits the platform; its numbers here come from public sources and carry their '
        'uncertainty in the URDF. The shoulder’s place on the deck is assumed.',
        f'On level ground at full forward reach with {subject.robot.payload.mass:g} kg the robot has '
        f'{left["stowed"]:.1f}° of tilt left with stowed flippers, and {left["forward"]:.1f}° with '
        'flippers forward: negative means that it tips on the level.',
    ]
    pictures = [
        Picture('figure_7', seven, 'Tilt left before the robot tips about the nearest edge.'),
        Picture('level_ground', level, 'The same on level ground.'),
    ]
    tables = [subject.truth] if subject.truth else []
    section = Section('Figure 7: rollover', text, tables=tables, pictures=pictures)
    return section, {'figure_7': table, 'level_full_reach_tilt_left_deg': left}


def capability(subject: Subject) -> Built:
    """Return dragging and lifting capability."""
    drag, lift = drag_table(subject.robot, subject.limits), lift_table(subject.robot, subject.limits)
    text = [
        'The further tests that the paper names. Each bound is exact: torques and tipping moments are '
        'linear in the force, friction is a quadratic. The load hangs at the gripper; friction 0.7 and '
        'the hitch (at the rear, 0.095 m high) are assumed.',
    ]
    pictures = [
        Picture('drag', drag_figure(subject.robot, subject.limits), 'Dragging with the arm.'),
        Picture('lift', lift_figure(subject.robot, subject.limits), 'Lifting with and without flippers.'),
    ]
    section = Section(
        'Dragging and lifting capability', text, tables=[_table(drag), _table(lift)], pictures=pictures
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
