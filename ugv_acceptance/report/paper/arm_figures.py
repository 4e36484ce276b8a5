"""Figures 4 and 5: the planar arm's torques over a turn, and its regions of failure."""

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MultipleLocator

from ugv_acceptance.model.statics import inverse_dynamics, static_torque
from ugv_acceptance.report.paper.numbers import DOWN, Simulated
from ugv_acceptance.report.regions import degree_axes, figure
from ugv_acceptance.studies.bilinear import Grid, form_of, level_curves
from ugv_acceptance.studies.intervals import Intervals, length
from ugv_acceptance.studies.maps import torque_forms, within_limits
from ugv_acceptance.studies.offsets import OFFSET1, OFFSET2
from ugv_acceptance.studies.planar import PAPER, arm_robot, paper_arm, planar_torque, safe_theta2
from ugv_acceptance.studies.validity import paper_sweep
from ugv_acceptance.studies.windows import Mask
from ugv_acceptance.type_aliases import Floats

THRESHOLDS = (30.0, 50.0, 70.0)
TURN = 2.0 * math.pi


def figure_4(simulated: Simulated | None = None) -> Figure:
    """Return static and dynamic torque over theta_2 at theta_1 = pi/6, 7.2 deg/s."""
    made = figure(7.2, 4.4)
    axes = made.subplots()
    for low, high in ((50.0, 90.0), (-90.0, -50.0)):
        axes.axhspan(low, high, facecolor='#e7a9a0', hatch='////', edgecolor='#999999', lw=0.0)
    _torque_curves(axes, simulated)
    for height, words in (
        (56.0, '+50 N m: saturation above'),
        (-56.0, '-50 N m: saturation below'),
    ):
        axes.text(180.0, height, words, ha='center', va='center', backgroundcolor='white')
    degree_axes(axes, 'second joint θ₂', '')
    axes.yaxis.set_major_formatter('{x:.0f}')
    axes.yaxis.set_major_locator(MultipleLocator(25.0))
    axes.set(xlim=(0.0, 360.0), ylim=(-80.0, 80.0), ylabel='joint torque, N m')
    axes.set_title('Figure 4: planar arm, θ₁ = 30°, 4 kg load, θ₂ moving through a turn in 50 s')
    axes.legend(loc='upper center', bbox_to_anchor=(0.5, -0.16), ncols=3)
    return made


def _marks(shade: str) -> dict[str, Any]:
    return {'mfc': 'none', 'color': shade, 'ms': 5}


def _torque_curves(axes: Axes, simulated: Simulated | None) -> None:
    q, rates = paper_sweep(math.pi / 6.0), np.array([0.0, math.radians(7.2)])
    static = static_torque(paper_arm(), q, DOWN)
    moving = inverse_dynamics(paper_arm(OFFSET1, OFFSET2), q, rates, np.zeros(2), DOWN)
    theta2 = np.degrees(q[:, 1])
    looks = (('-', 'o', 'x', 'black'), ('--', 's', '+', '#1f5f8b'))
    for joint, (dash, mark, cross, shade) in enumerate(looks):
        name, marks = f'joint {joint + 1}', _marks(shade)
        axes.plot(theta2, static[:, joint], dash, color=shade, lw=1.6, label=f'{name}, static')
        label = f'{name}, dynamic 7.2°/s'
        axes.plot(theta2[::8], moving[::8, joint], mark, label=label, **marks)
        if simulated is not None:
            at, torque = np.degrees(simulated.theta2)[4::8], simulated.torque[4::8, joint]
            axes.plot(at, torque, cross, label=f'{name}, MuJoCo', **marks)


def paper_grid(steps: int = 401) -> Grid:
    """Return the grid of Figure 5: theta_1 from 0 to pi, theta_2 over a turn."""
    return Grid(
        0, 1, np.linspace(0.0, math.pi, steps), np.linspace(0.0, TURN, 2 * steps - 1), np.zeros(2)
    )


def safe_masks(grid: Grid) -> dict[float, Mask]:
    """Return where both torques stay within each threshold (N m)."""
    robot = arm_robot(PAPER)
    forms = torque_forms(robot, grid, DOWN)
    return {limit: within_limits(robot, grid, forms, limit) for limit in THRESHOLDS}


def safe_fractions(grid: Grid) -> dict[float, tuple[float, float]]:
    """Return the safe fraction for each threshold: from closed-form intervals, from cells."""
    fractions = {}
    for limit, mask in safe_masks(grid).items():
        exact = [length(safe_theta2(PAPER, float(t), limit, limit)) / TURN for t in grid.x]
        # Trapezoidal weights, for both: the ends of the range are half cells.
        weight_x, weight_y = _weights(len(grid.x)), _weights(len(grid.y))
        fractions[limit] = (float(weight_x @ exact), float(weight_x @ mask @ weight_y))
    return fractions


def _weights(n: int) -> Floats:
    weights = np.ones(n)
    weights[[0, -1]] = 0.5
    scaled: Floats = weights / (n - 1)
    return scaled


def disagreement(grid: Grid) -> dict[float, int]:
    """Return the number of cells where closed form and map differ, per threshold (N m)."""
    found = {}
    for limit, mask in safe_masks(grid).items():
        wrong = 0
        for row, theta1 in zip(mask, grid.x, strict=True):
            intervals = safe_theta2(PAPER, float(theta1), limit, limit)
            inside = np.zeros(len(grid.y), dtype=np.bool_)
            for start, end in intervals:
                inside |= (grid.y >= start) & (grid.y <= end)
            wrong += int((inside != row).sum())
        found[limit] = wrong
    return found


def figure_5() -> Figure:
    """Return the regions of failure for 30, 50 and 70 N m with their closed-form boundaries."""
    grid = paper_grid()
    theta1, theta2 = np.meshgrid(grid.x, grid.y, indexing='ij')
    worst = np.max(np.abs(planar_torque(PAPER, theta1, theta2)), axis=0)
    made = figure(7.2, 5.6)
    axes = made.subplots()
    axes.contourf(
        np.degrees(grid.x),
        np.degrees(grid.y),
        worst.T,
        levels=[-1.0, *THRESHOLDS, 1e3],
        colors=('#ffffff', '#fff0c2', '#f3cdb2', '#e0948a'),
        hatches=('', '..', '//', 'xxxx'),
    )
    _boundaries(axes, grid)
    words = ('safe at 30 N m', 'fails 30, safe at 50', 'fails 50, safe at 70', 'fails 70 N m')
    _key(axes, words)
    degree_axes(axes, 'first joint θ₁ (0°: forward, 180°: backward)', 'second joint θ₂', 30.0)
    axes.yaxis.set_major_locator(MultipleLocator(60.0))
    axes.set(xlim=(0.0, 180.0), ylim=(0.0, 360.0))
    axes.set_title(
        'Figure 5: planar arm, 4 kg, level ground, at rest: |τ₁| and |τ₂| against 30, 50, 70 N m\n'
        'thick lines: closed-form boundaries of joint 1 (solid) and joint 2 (dashed)'
    )
    return made


def _boundaries(axes: Axes, grid: Grid) -> None:
    robot = arm_robot(PAPER)
    forms = form_of(robot, grid, lambda q: static_torque(robot, q, DOWN))
    for limit in THRESHOLDS:
        for joint, dash in ((0, '-'), (1, '--')):
            for sign in (1.0, -1.0):
                for curve in level_curves(robot, grid, forms[joint], sign * limit):
                    _plot(axes, grid.x, curve, dash, f'{limit:.0f}' if joint == 0 else '')


def _plot(axes: Axes, x: Floats, curve: Floats, dash: str, label: str) -> None:
    jump = np.abs(np.diff(curve, prepend=curve[0])) > 1.0
    curve = np.where(jump, np.nan, curve)
    axes.plot(np.degrees(x), np.degrees(curve), dash, color='black', lw=1.3)
    known = np.flatnonzero(np.isfinite(curve))
    if label and len(known) > 20:
        k = known[len(known) // 2]
        axes.text(
            np.degrees(x[k]),
            np.degrees(curve[k]),
            f'{label} N m',
            ha='center',
            va='center',
            fontsize=8,
            bbox={'facecolor': 'white', 'edgecolor': 'none', 'pad': 1.0},
        )


def _key(axes: Axes, words: tuple[str, ...]) -> None:
    looks = zip(
        ('#ffffff', '#fff0c2', '#f3cdb2', '#e0948a'), ('', '..', '//', 'xxxx'), words, strict=True
    )
    handles = [Patch(facecolor=c, hatch=h, edgecolor='#666666', label=w) for c, h, w in looks]
    axes.legend(handles=handles, loc='upper center', bbox_to_anchor=(0.5, -0.1), ncols=4)


def _words(intervals: Intervals) -> str:
    if not intervals:
        return 'none'
    return ', '.join(f'{math.degrees(a):.1f}° to {math.degrees(b):.1f}°' for a, b in intervals)


def one_sided_table(limit: float) -> list[list[str]]:
    """Return theta_1 against the safe theta_2 with |tau| <= `limit` (N m) and with tau <= limit."""
    table = [['θ₁', f'|τ| ≤ {limit:g} N m', f'τ ≤ {limit:g} N m (the paper)', 'they']]
    for degrees in range(0, 181, 30):
        theta1 = math.radians(degrees)
        both = safe_theta2(PAPER, theta1, limit, limit)
        one = safe_theta2(PAPER, theta1, limit, limit, two_sided=False)
        same = 'agree' if both == one else 'differ'
        table.append([f'{degrees}°', _words(both), _words(one), same])
    return table
