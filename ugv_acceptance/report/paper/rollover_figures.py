"""Figures 6 and 7: the orientations, and the postures in which the robot tips over."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.report.paper.joints import PARTS, STOWED, Parts, posture
from ugv_acceptance.report.regions import degree_axes, draw_regions, figure, legend
from ugv_acceptance.studies.bilinear import Grid
from ugv_acceptance.studies.maps import Levels, area_fraction, rollover_map
from ugv_acceptance.studies.orientations import ORIENTATIONS, gravity_of, grounding_angle

# Caution from 10 degrees of tilt left; at 0 the robot tips.
TIP_LEVELS = Levels(10.0, 0.0)


@dataclass(frozen=True, slots=True)
class Panel:
    """One map of Figure 7: right tilt and turret angle in rad, load in kg, flipper position."""

    tilt: float
    forward: bool
    turret: float
    load: float

    @property
    def words(self) -> str:
        """The panel's assumptions as text in two lines."""
        flippers = 'forward' if self.forward else 'stowed'
        turret = 'ahead' if self.turret == 0.0 else 'to the low side'
        load = f'{self.load:g} kg' if self.load else 'no load'
        return (
            f'right tilt {math.degrees(self.tilt):.0f}°, flippers {flippers}\narm {turret}, {load}'
        )


def arm_grid(robot: Robot, q: np.ndarray, steps: int, parts: Parts = PARTS) -> Grid:
    """Return the paper's grid: shoulder from 0 to 180 degrees, elbow over a turn."""
    return Grid(
        robot.joint_names.index(parts.shoulder),
        robot.joint_names.index(parts.elbow),
        np.linspace(0.0, math.pi, steps),
        np.linspace(0.0, 2.0 * math.pi, 2 * steps - 1),
        q,
    )


def panels(load: float) -> list[Panel]:
    """Return the sixteen panels: 30 and 40 degrees, flippers, turret, load (kg)."""
    return [
        Panel(math.radians(tilt), forward, turret, mass)
        for tilt in (30.0, 40.0)
        for forward in (False, True)
        for turret in (0.0, -math.pi / 2.0)
        for mass in (load, 0.0)
    ]


def tilt_left(robot: Robot, panel: Panel, steps: int = 121) -> tuple[Grid, np.ndarray]:
    """Return the grid of a panel and the tilt left (deg) over it."""
    flipper = grounding_angle(robot, PARTS.flipper) if panel.forward else STOWED
    grid = arm_grid(robot, posture(robot, flipper=flipper, turret=panel.turret), steps)
    gravity = gravity_of('right', panel.tilt, robot.gravity)
    found = rollover_map(robot, grid, gravity, Payload(panel.load, robot.payload.cog))
    return grid, np.degrees(found.angle)


def figure_7(robot: Robot, steps: int = 121) -> tuple[Figure, list[dict[str, Any]]]:
    """Return the sixteen maps, and each with the fraction of its area in which the robot tips."""
    made = figure(10.5, 12.6)
    grid_of_axes = made.subplots(4, 4, sharex=True, sharey=True)
    table = []
    for axes, panel in zip(grid_of_axes.flat, panels(robot.payload.mass), strict=True):
        grid, angle = tilt_left(robot, panel, steps)
        draw_regions(axes, np.degrees(grid.x), np.degrees(grid.y), angle, TIP_LEVELS)
        fails = area_fraction(~(angle > 0.0), grid)
        axes.set_title(f'{panel.words}\ntips in {100.0 * fails:.0f} % of the map', fontsize=8.5)
        table.append(
            {
                'tilt_deg': math.degrees(panel.tilt),
                'flippers': 'forward' if panel.forward else 'stowed',
                'turret_deg': math.degrees(panel.turret),
                'load_kg': panel.load,
                'failure_fraction': fails,
                'least_tilt_left_deg': float(np.nanmin(angle)),
            }
        )
    for axes in grid_of_axes[-1]:
        degree_axes(axes, 'shoulder θ₁', '', 60.0)
    for axes in grid_of_axes[:, 0]:
        degree_axes(axes, '', 'elbow θ₂', 60.0)
        axes.yaxis.set_major_locator(axes.yaxis.get_major_locator().__class__(90.0))
    for axes in grid_of_axes[:-1, 0]:
        axes.set_xlabel('')
    words = ('stands, over 10° left', 'caution: up to 10° left', 'tips over')
    legend(made, words, loc='outside lower center', ncols=3, fontsize=10)
    made.suptitle(
        f'Figure 7: {robot.name} at rest on a rigid slope, right side low; solid line: tips, '
        'dotted line: 10° left',
        fontsize=11,
    )
    return made, table


def level_figure(robot: Robot, steps: int = 181) -> tuple[Figure, dict[str, float]]:
    """Return the level-ground maps with load, and the tilt left (deg) at full forward reach."""
    made = figure(8.4, 4.6)
    left: dict[str, float] = {}
    ways = (('stowed', STOWED), ('forward', grounding_angle(robot, PARTS.flipper)))
    for axes, (name, flipper) in zip(made.subplots(1, 2, sharey=True), ways, strict=True):
        grid = arm_grid(robot, posture(robot, flipper=flipper), steps)
        angle = np.degrees(rollover_map(robot, grid, (0.0, 0.0, -robot.gravity)).angle)
        draw_regions(axes, np.degrees(grid.x), np.degrees(grid.y), angle, TIP_LEVELS)
        left[name] = float(angle[0, 0])
        word = 'stands' if angle[0, 0] > 0.0 else 'tips'
        axes.set_title(f'flippers {name}\nfull reach {word}: {angle[0, 0]:.1f}° left')
        for x, y in ((0.0, 0.0), (0.0, 360.0)):
            axes.plot(x, y, 'o', color='black', ms=9, mfc='white', mew=2, clip_on=False, zorder=5)
        degree_axes(axes, 'shoulder θ₁', 'elbow θ₂' if name == 'stowed' else '', 60.0)
    legend(
        made,
        ('stands, over 10° left', 'caution: up to 10° left', 'tips over'),
        loc='outside lower center',
        ncols=3,
    )
    made.suptitle(
        f'{robot.name} on level ground, at rest, {robot.payload.mass:g} kg, arm ahead; '
        'circles: full forward reach',
        fontsize=10,
    )
    return made, left


def figure_6(tilt: float = math.radians(30.0)) -> Figure:
    """Return the named orientations, each seen from behind and from the left."""
    made = figure(9.0, 6.6)
    cells = made.subplots(3, 3)
    for axes, (name, orientation) in zip(cells.flat, ORIENTATIONS.items(), strict=True):
        gx, gy, gz = gravity_of(name, tilt, 1.0)
        # Seen from behind, right is right; seen from the left, the front points to the left.
        _view(axes, -0.75, math.atan2(gy, -gz), 0.404, 'from behind')
        _view(axes, 0.75, -math.atan2(-gx, -gz), 0.69, 'from the left')
        axes.set(xlim=(-1.5, 1.5), ylim=(-0.75, 0.95), aspect='equal')
        axes.set_title(orientation.words, fontsize=10)
        axes.axis('off')
    made.suptitle(
        f'Figure 6: orientations, drawn at {math.degrees(tilt):.0f}°; front of the robot: black',
        fontsize=11,
    )
    return made


def _view(axes: Axes, x: float, roll: float, width: float, words: str) -> None:
    """Draw the chassis on its slope, turned by `roll` (rad, counter-clockwise in the picture)."""
    c, s = math.cos(roll), math.sin(roll)

    def place(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
        return [(x + a * c - b * s, a * s + b * c) for a, b in points]

    half, high = width / 2.0, 0.19
    body = [(-half, 0.0), (half, 0.0), (half, high), (-half, high)]
    axes.plot(*zip(*place([(-0.55, 0.0), (0.55, 0.0)]), strict=True), color='black', lw=1.5)
    axes.plot([x - 0.55, x + 0.55], [0.0, 0.0], color='black', lw=0.7, ls=':')
    axes.add_patch(Polygon(place(body), facecolor='#cccccc', edgecolor='black'))
    if width > 0.5:
        nose = [(-half, 0.0), (-half + 0.1, 0.0), (-half + 0.1, high), (-half, high)]
        axes.add_patch(Polygon(place(nose), facecolor='black'))
        arm = [(0.0, high), (-0.25, high + 0.35), (-0.55, high + 0.2)]
    else:
        arm = [(0.0, high), (0.0, high + 0.35)]
    axes.plot(*zip(*place(arm), strict=True), color='#444444', lw=3)
    axes.text(x, -0.7, words, ha='center', fontsize=8)
