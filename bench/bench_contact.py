"""What a contact that is off by millimetres does to the margin, before and now, and against MuJoCo.

Prints the margins of PackBot with one contact lowered, the largest step of the margin as contacts
move, and margins of random robots on uneven feet beside simulated tips. Draws the figure of
docs/model.md into a folder.

    nice python -m bench.bench_contact [cases] [folder]
"""

import sys
import time
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from bench.contact_cases import (
    KINDS,
    LAST,
    headings_of,
    lowered,
    random_case,
    robot_of,
    truth_of,
)
from ugv_acceptance.config import load
from ugv_acceptance.model.hull import hull, pairs
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.stability import stability
from ugv_acceptance.processes import Workers
from ugv_acceptance.report.regions import figure, png_of
from ugv_acceptance.simulation.vehicle import gravity_on_slope
from ugv_acceptance.type_aliases import Floats

DOWN = np.array((0.0, 0.0, -9.81))
TOLERANCE = 0.001  # m: what the rule before took for the ground
MILLIMETRES = (0.0, 0.9, 1.5, 5.0, 20.0)
MOVED = np.arange(-50, 51) * 1e-4  # m: how far a contact is moved for the steps
STOWED, NEAR, GROUNDED = (np.pi, *np.radians((-13.0, -14.92)))
# Postures of PackBot: joint positions (rad) and load (kg).
POSTURES = {
    'stowed': ((0.0, 2.0, -2.5, STOWED), 4.0),
    'raised on the flippers': ((0.0, 2.0, -2.5, np.radians(-40.0)), 4.0),
    'stretched, flippers stowed': ((0.0, 0.0, 0.0, STOWED), 4.0),
    'stretched, flippers forward': ((0.0, 0.0, 0.0, 0.0), 4.0),
    'flippers on the ground': ((0.0, 1.0, -0.5, GROUNDED), 4.0),
    'flippers 8 mm above it': ((0.0, 1.0, -0.5, NEAR), 4.0),
}


def main() -> None:
    """Print the three tables and draw the figure."""
    count = int(sys.argv[1]) if sys.argv[1:] else 600
    folder = Path(sys.argv[2] if sys.argv[2:] else 'docs/images')
    robot = load().settings.robot
    print_lowered(robot)
    print_steps(robot)
    print_truth(count)
    (folder / 'contact_continuity.png').write_bytes(continuity_figure(robot))


def before(points: Floats, cog: Floats, gravity: Floats, ground: float = 0.0) -> Floats:
    """Return the least margins (rad) by the rule before, under gravities (m, 3): NaN for none.

    What is no more than TOLERANCE above the tracks' plane stands; where a point is below it, what
    is near the face of the lower hull that lies under the centre of gravity.
    """
    heights = points[:, 2] - ground
    if heights.min() < -TOLERANCE:
        heights = _above_face(points, cog)
    near = tuple(int(k) for k in np.flatnonzero(heights <= TOLERANCE))
    corners = hull(tuple(tuple(points[k].tolist()) for k in near), near)
    angles = np.full((1, len(gravity)), np.nan)
    edges = [_about(points[i], points[j], cog, gravity) for i, j in pairs(corners)]
    least: Floats = np.min(edges or angles, axis=0)
    return least


def _above_face(points: Floats, cog: Floats) -> Floats:
    """Return the heights (m) above the face of the lower hull under the centre of gravity.

    Where that lies outside all points: of the face over which the line to it leaves them.
    """
    middle = points[:, :2].mean(axis=0)
    for share in np.linspace(1.0, 0.0, 1001):
        place = middle + share * (cog[:2] - middle)
        for a, b, c in combinations(points, 3):
            normal = np.cross(b - a, c - a)
            heights: Floats = (points - a) @ normal * np.sign(normal[2])
            turns = [_turn(p, q, place) for p, q in ((a, b), (b, c), (c, a))]
            if heights.min() >= -1e-12 and (min(turns) >= 0.0 or max(turns) <= 0.0):
                return heights / np.linalg.norm(normal)
    return np.full(len(points), np.inf)


def _turn(a: Floats, b: Floats, place: Floats) -> float:
    return float((b[0] - a[0]) * (place[1] - a[1]) - (b[1] - a[1]) * (place[0] - a[0]))


def _about(start: Floats, end: Floats, cog: Floats, gravity: Floats) -> Floats:
    along = (end - start) / np.linalg.norm(end - start)
    square = (start - cog) - along * (along @ (start - cog))
    angle: Floats = np.arctan2(-gravity @ np.cross(square, along), gravity @ square)
    return angle


def now(robot: Robot, q: ArrayLike, gravity: Floats, payload: Payload | None = None) -> Floats:
    """Return the least margins (rad) of this project's model under gravities (m, 3)."""
    positions = np.tile(np.asarray(q, dtype=float), (len(gravity), 1))
    angles = stability(robot, positions, gravity, payload).angle
    least: Floats = np.min(np.array(angles, dtype=float), axis=0)
    return least


def of_both(robot: Robot, posture: str, gravity: Floats) -> tuple[float, float]:
    """Return the margins (deg) of a posture before and now."""
    q, mass = POSTURES[posture]
    load_ = Payload(mass, robot.payload.cog)
    place = posture_of(mechanics_of(robot), q, mass, load_.cog)
    points, cog = np.array(place.contacts), np.array(place.cog)
    old = before(points, cog, gravity[None], robot.ground)[0]
    return float(np.degrees(old)), float(np.degrees(now(robot, q, gravity[None], load_)[0]))


def print_lowered(robot: Robot) -> None:
    """Print the margins of PackBot with its rear left contact lowered."""
    print('PackBot, 4 kg, level: least margin (deg) before -> now, rear_left lowered by mm')
    print(' ' * 28 + ''.join(f'{mm:>17g}' for mm in MILLIMETRES))
    for posture in POSTURES:
        cells = []
        for mm in MILLIMETRES:
            old, new = of_both(lowered(robot, 'rear_left', mm / 1e3), posture, DOWN)
            cells.append(f'{old:7.1f} -> {new:6.1f}')
        print(f'{posture:28}' + ''.join(f'{c:>17}' for c in cells))


def print_steps(robot: Robot) -> None:
    """Print the largest step of the margin as one coordinate of a contact moves by 0.1 mm."""
    print('\nPackBot: largest step (deg) while any coordinate moves +/- 5 mm by 0.1 mm')
    print(f'{"":28}{"before":>10}{"now":>10}')
    steps = np.zeros((len(POSTURES), 2))
    for number in range(len(robot.contacts)):
        for axis in range(3):
            moved = _moved(robot, number, axis)
            curves = np.array([[of_both(r, p, DOWN) for p in POSTURES] for r in moved])
            steps = np.fmax(steps, np.nanmax(np.abs(np.diff(curves, axis=0)), axis=0))
    for posture, (old, new) in zip(POSTURES, steps, strict=True):
        print(f'{posture:28}{old:10.2f}{new:10.2f}')


def _moved(robot: Robot, number: int, axis: int) -> list[Robot]:
    """Return robots with one coordinate (of its link) of one contact moved by MOVED."""
    found = []
    for by in MOVED:
        contacts = list(robot.contacts)
        at = list(contacts[number].position)
        at[axis] += float(by)
        contacts[number] = replace(contacts[number], position=(at[0], at[1], at[2]))
        found.append(replace(robot, contacts=tuple(contacts)))
    return found


@dataclass(frozen=True, slots=True)
class Result:
    """A case's tilt at which it tipped towards the side where it tips first, with the margins.

    All in degrees, of the rule before and of now: `margin` is what was shown on the level, `over`
    the most that was shown above what was left, on the way to the tip towards the case's heading.
    """

    kind: str
    tilt: float
    margin: tuple[float, float]
    over: tuple[float, float]


def result_of(seed: int) -> Result | None:
    """Return what became of the case of a seed; None if it does not stand on the level."""
    case = random_case(seed)
    first = truth_of(case, headings_of(case.points))
    if not first.rests:
        return None
    robot, once = robot_of(case), truth_of(case)
    tilts = np.array([tilt for tilt, _ in once.rests])
    down = np.array(
        [gravity_on_slope(9.81, t, case.heading) @ attitude for t, attitude in once.rests]
    )
    shown = [before(case.points, case.cog, down), now(robot, (0.0,), down)]
    over = [_most_above(s, min(once.tilt, LAST) - tilts) for s in shown]
    level = np.degrees(np.nan_to_num([s[0] for s in shown]))  # no margin: none is left
    tilt = float(np.degrees(min(first.tilt, LAST)))
    return Result(case.kind, tilt, (level[0], level[1]), (over[0], over[1]))


def _most_above(shown: Floats, left: Floats) -> float:
    """Return the most (deg) that was shown above what was left, up to the first zero."""
    ends = [k for k, (a, b) in enumerate(pairwise(shown)) if not (a > 0.0 and b > 0.0)]
    upto = ends[0] + 1 if ends else len(shown)
    return float(np.degrees(np.nan_to_num(shown - left, nan=-np.inf)[:upto].max()))


def print_truth(count: int) -> None:
    """Print how far the margins of random robots on uneven feet are from simulated tips."""
    start = time.perf_counter()
    with Workers(2) as pool:
        found = [r for r in pool.map(result_of, range(count), chunksize=4) if r]
    took = time.perf_counter() - start
    print(f'\n{len(found)} robots on uneven feet, seeds 0 to {count - 1}, {took:.0f} s')
    print('margin on the level less the least tilt that tips (turn of 5 deg), % of the cases:')
    head = f'{"":22}{"":>8}{"> 2":>7}{"> 1":>7}{"< -2":>7}{"< -5":>7}{"< -10":>7}{"< -20":>7}'
    print(head + f'{"most":>7}{"median":>8}   shown - left > 2 on the way')
    for kind in (*KINDS, 'all'):
        some = [r for r in found if kind in {r.kind, 'all'}]
        for which, name in enumerate(('before', 'now')):
            error = np.array([min(r.margin[which], 75.0) - r.tilt for r in some])
            over = np.array([r.over[which] for r in some])
            shares = [np.mean(error > x) for x in (2.0, 1.0)]
            shares += [np.mean(error < x) for x in (-2.0, -5.0, -10.0, -20.0)]
            cells = ''.join(f'{100.0 * s:7.1f}' for s in shares)
            print(
                f'{kind if not which else "":22}{name:>8}{cells}{error.max():7.1f}'
                f'{np.median(error):8.2f}{100.0 * np.mean(over > 2.0):10.1f}'
            )


def continuity_figure(robot: Robot) -> bytes:
    """Return the figure: the margin over the height of one contact, before and now (PNG)."""
    made = figure(7.2, 2.6)
    heights = np.arange(-60, 61) * 1e-4
    names = ('stowed', 'raised on the flippers', 'stretched, flippers forward')
    for axes, name in zip(made.subplots(1, 3), names, strict=True):
        curve = [of_both(lowered(robot, 'rear_left', -z), name, DOWN) for z in heights]
        old, new = np.array(curve).T
        axes.plot(heights * 1e3, old, color='#888888', linestyle=':', label='before')
        axes.plot(heights * 1e3, new, color='black', label='now')
        axes.axhline(0.0, color='#cc4444', linewidth=0.6)
        axes.set_title(name, fontsize=9.0)
        axes.set_xlabel('rear_left higher by (mm)')
    made.axes[0].set_ylabel('least margin (deg)')
    made.axes[0].legend()
    return png_of(made)


if __name__ == '__main__':
    main()
