"""Figures of pulling and lifting: how much, and which limit ends it, over the arm's range."""

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.report.paper.joints import PARTS, STOWED, posture
from ugv_acceptance.report.paper.rollover_figures import arm_grid
from ugv_acceptance.report.regions import degree_axes, figure
from ugv_acceptance.studies.capacity import (
    CAUSES,
    NOTHING,
    SATURATION,
    SLIP,
    TIP,
    lift_capacity,
    pull_capacity,
)
from ugv_acceptance.studies.orientations import grounding_angle
from ugv_acceptance.type_aliases import Floats

Causes = NDArray[np.int8]

# Tracks on dry, firm ground: assumed.
FRICTION = 0.7
# A hitch at the rear of the chassis at the height of the axles (m): assumed.
HITCH = (-0.345, 0.0, 0.095)
WORDS = ('a joint saturates first', 'the robot tips first', 'the tracks slip first')
_SHADES = {SATURATION: ('#cfe3f3', '////'), TIP: ('#e7a9a0', '..'), SLIP: ('#ffffff', '')}


@dataclass(frozen=True, slots=True)
class Capability:
    """One line of the tables: a way to pull or lift, its best value over the map, its limit."""

    what: str
    flippers: str
    best: float
    unit: str
    cause: str
    at_deg: tuple[float, float] | None = None


def flipper_ways(robot: Robot) -> dict[str, float]:
    """Return the two flipper angles (rad) to compare, by name."""
    return {'stowed': STOWED, 'forward': grounding_angle(robot, PARTS.flipper)}


def drag_table(robot: Robot, limits: Floats, friction: float = FRICTION) -> list[Capability]:
    """Return the largest horizontal pull (N) from hitch and gripper, level ground, no load."""
    empty = Payload(0.0, robot.payload.cog)
    down = np.array([0.0, 0.0, -robot.gravity])
    rows = []
    for name, flipper in flipper_ways(robot).items():
        # The arm folded back over the deck; what is dragged behind pulls the robot backwards.
        folded = posture(robot, flipper=flipper, shoulder=math.pi, elbow=math.pi)
        hitch = pull_capacity(
            robot, folded, down, (-1.0, 0.0, 0.0), limits, friction, HITCH, payload=empty
        )
        cause = CAUSES[int(hitch.cause)]
        rows.append(Capability('pull from the hitch', name, float(hitch.force), 'N', cause))
        grid = arm_grid(robot, posture(robot, flipper=flipper), 61)
        pull = pull_capacity(
            robot, grid.postures(), down, (1.0, 0.0, 0.0), limits, friction, payload=empty
        )
        rows.append(
            _best('pull at the gripper', name, 'N', (grid.x, grid.y), pull.force, pull.cause)
        )
    return rows


def lift_table(robot: Robot, limits: Floats) -> list[Capability]:
    """Return the largest payload (kg) anywhere and at full reach, level ground."""
    down = np.array([0.0, 0.0, -robot.gravity])
    strong = np.full(len(robot.joint_names), np.inf)
    rows = []
    for name, flipper in flipper_ways(robot).items():
        grid = arm_grid(robot, posture(robot, flipper=flipper), 61)
        for words, bounds in (('', limits), (', unlimited torque', strong)):
            mass, cause = lift_capacity(robot, grid.postures(), down, bounds)
            reach = Capability(
                f'lift at full forward reach{words}',
                name,
                float(mass[0, 0]),
                'kg',
                CAUSES[int(cause[0, 0])],
                (0.0, 0.0),
            )
            # Over its own support polygon nothing tips: the smallest over the map says more.
            least = np.unravel_index(int(mass.argmin()), mass.shape)
            at = (math.degrees(grid.x[least[0]]), math.degrees(grid.y[least[1]]))
            worst = CAUSES[int(cause[least])]
            rows += [
                reach,
                Capability(f'lift in any posture{words}', name, float(mass.min()), 'kg', worst, at),
            ]
    return rows


def _best(
    what: str, flippers: str, unit: str, axes: tuple[Floats, Floats], value: Floats, cause: Causes
) -> Capability:
    k, m = np.unravel_index(int(np.argmax(np.where(np.isfinite(value), value, -1.0))), value.shape)
    at = (math.degrees(axes[0][k]), math.degrees(axes[1][m]))
    return Capability(what, flippers, float(value[k, m]), unit, CAUSES[int(cause[k, m])], at)


def draw_capacity(
    axes: Axes, x: Floats, y: Floats, value: Floats, cause: Causes, levels: list[float], unit: str
) -> None:
    """Draw contours of capacity over areas hatched by the limit that ends it (n, m)."""
    shown = np.where(cause == NOTHING, SLIP, cause)
    for key, (colour, hatch) in _SHADES.items():
        if (shown == key).any():  # one area a cause: between two there is no third
            inside = (shown == key).T.astype(np.float64)
            axes.contourf(x, y, inside, levels=[0.5, 1.5], colors=[colour], hatches=[hatch])
    top = max(levels) * 2.0
    lines = axes.contour(
        x, y, np.minimum(value, top).T, levels=levels, colors='black', linewidths=1.1
    )
    texts = axes.clabel(lines, fmt=f'%g {unit}', fontsize=8)
    for text in texts:
        text.set_bbox({'facecolor': 'white', 'edgecolor': 'none', 'pad': 0.8})


def drag_figure(robot: Robot, limits: Floats, friction: float = FRICTION) -> Figure:
    """Return the largest horizontal pull at the gripper over the arm's range."""
    made = figure(9.0, 4.9)
    empty = Payload(0.0, robot.payload.cog)
    pairs = zip(made.subplots(1, 2, sharey=True), flipper_ways(robot).items(), strict=True)
    for axes, (name, flipper) in pairs:
        grid = arm_grid(robot, posture(robot, flipper=flipper), 121)
        down = (0.0, 0.0, -robot.gravity)
        found = pull_capacity(
            robot, grid.postures(), down, (1.0, 0.0, 0.0), limits, friction, payload=empty
        )
        draw_capacity(
            axes,
            np.degrees(grid.x),
            np.degrees(grid.y),
            found.force,
            found.cause,
            [25.0, 50.0, 75.0, 100.0, 150.0],
            'N',
        )
        axes.set_title(f'flippers {name}')
        degree_axes(axes, 'shoulder θ₁', 'elbow θ₂' if name == 'stowed' else '', 60.0)
    _cause_key(made)
    made.suptitle(
        f'{robot.name}: largest horizontal pull at the gripper, what is dragged lies ahead; '
        f'level, no load,\nfriction {friction:g} (assumed), torque limits {_limits(limits)}',
        fontsize=10,
    )
    return made


def lift_figure(robot: Robot, limits: Floats) -> Figure:
    """Return the largest payload over the arm's range, with and without torque limits."""
    made = figure(9.0, 9.0)
    cells = made.subplots(2, 2, sharex=True, sharey=True)
    strong = np.full(len(robot.joint_names), np.inf)
    for row, (words, bounds) in zip(
        cells, ((_limits(limits), limits), ('unlimited torque', strong)), strict=True
    ):
        for axes, (name, flipper) in zip(row, flipper_ways(robot).items(), strict=True):
            grid = arm_grid(robot, posture(robot, flipper=flipper), 121)
            down = (0.0, 0.0, -robot.gravity)
            mass, cause = lift_capacity(robot, grid.postures(), down, bounds)
            levels = [2.0, 4.0, 6.0, 8.0, 12.0]
            draw_capacity(axes, np.degrees(grid.x), np.degrees(grid.y), mass, cause, levels, 'kg')
            axes.set_title(f'flippers {name}, {words}')
            degree_axes(axes, '', '', 60.0)
    for axes in cells[-1]:
        axes.set_xlabel('shoulder θ₁')
    for axes in cells[:, 0]:
        axes.set_ylabel('elbow θ₂')
    _cause_key(made, ('a joint saturates first', 'the robot tips first', 'nothing ends it'))
    made.suptitle(
        f'{robot.name}: largest payload at the gripper, level ground, at rest', fontsize=10
    )
    return made


def _limits(limits: Floats) -> str:
    known = sorted({float(x) for x in limits if np.isfinite(x)})
    return ' and '.join(f'{x:g}' for x in known) + ' N m' if known else 'none'


def _cause_key(made: Figure, words: tuple[str, ...] = WORDS) -> None:

    handles = [
        Patch(facecolor=colour, hatch=hatch, edgecolor='#666666', label=word)
        for (colour, hatch), word in zip(_SHADES.values(), words, strict=True)
    ]
    made.legend(handles=handles, loc='outside lower center', ncols=3)
