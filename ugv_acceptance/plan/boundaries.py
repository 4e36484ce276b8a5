"""Test postures on both sides of every boundary of the torque and rollover maps.

A boundary is a joint's limit in one direction, or the tilt left towards one side; each has a
warning, a limit and, for tilt, the tip-over itself.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ugv_acceptance.plan.arm_paths import Routes
from ugv_acceptance.plan.plan import ROBOT, SIMULATION, Step
from ugv_acceptance.plan.search import Arm, Found, Mask, look, spread_out
from ugv_acceptance.plan.writing import Setup, hold_step
from ugv_acceptance.studies.orientations import ORIENTATIONS
from ugv_acceptance.type_aliases import Floats

# Where a posture lies relative to the limit, its band (share of the limit; deg of tilt left),
# where it is tested (robot or simulation), and the action.
TORQUE = (
    ('below the warning', (0.70, 0.765), ROBOT),
    ('just inside', (0.90, 0.97), ROBOT),
    ('just outside', (1.04, 1.15), SIMULATION),
)
TILT = (
    ('before the warning', (10.8, 13.0), ROBOT, 'hold'),
    ('just inside', (6.0, 9.0), ROBOT, 'hold'),
    ('beyond the limit', (1.0, 4.0), SIMULATION, 'hold'),
    ('tips over', (-8.0, -2.5), SIMULATION, 'tip'),
)
SIDES = ('nose-down', 'nose-up', 'right', 'left')
# Least tilt left (deg) where torque is tested, most use of torque where tilt is.
STEADY, STRONG = 8.0, 0.75
# Steeper ramps (rad), in simulation only, for boundaries that no lesser tilt reaches.
STEEPER = (math.radians(32.0), math.radians(37.0))


def torque_boundary(routes: Routes, points: int, loads: Sequence[float]) -> Iterator[Step]:
    """Yield steps that hold postures below and above each joint's torque limit, for each load (kg).

    Each joint is tested pushing either way.
    """
    arm, level = routes.arm, ('level', 0.0)
    for load in loads:
        found = look(arm, arm.grid, level, load)
        steady = found.tilt > math.radians(STEADY)
        for joint in arm.judged:
            share = found.share[:, arm.robot.joint_names.index(joint)]
            limit = arm.settings.limits.torque[arm.robot.joint_names.index(joint)]
            for sign, word in ((1.0, 'plus'), (-1.0, 'minus')):
                for title, (low, high), where in TORQUE:
                    rows = (share * sign > low) & (share * sign < high) & steady
                    rows &= found.most < high
                    if where == ROBOT:
                        rows &= routes.paths(level, load).reachable
                    name = joint.removesuffix('_joint')
                    text = f'{name} torque {title}, limit {word} {limit:g} N m'
                    purpose = f'the torque map says "{title}" at {load:g} kg: check it'
                    setup = Setup('torque boundary', load, where=where)
                    yield from _spread(arm, found, rows, points, setup, text, purpose)


def tip_boundary(
    routes: Routes, points: int, loads: Sequence[float], tilts: tuple[float, float]
) -> Iterator[Step]:
    """Yield steps that hold postures on either side of each tilt limit, the arm turned downhill."""
    low, high = tilts
    gentle = (low, (low + high) / 2.0, high)
    for name in SIDES:
        turret = routes.arm.turret_at(ORIENTATIONS[name].heading or 0.0)
        for title, band, where, action in TILT:
            ramps = (gentle,) if where == ROBOT else (gentle, *((s,) for s in STEEPER))
            best = _richest(routes, (name, turret), ramps, loads, band, reached=where == ROBOT)
            if best is None:
                continue
            load, tilt, found, rows = best
            setup = Setup('rollover boundary', load, (name, tilt), where, action)
            text = f'rollover {title}, {ORIENTATIONS[name].words}'
            purpose = f'the rollover map says "{title}": check it'
            yield from _spread(routes.arm, found, rows, points, setup, text, purpose)


def _richest(
    routes: Routes,
    side: tuple[str, float],
    ramps: Sequence[Sequence[float]],
    loads: Sequence[float],
    band: tuple[float, float],
    *,
    reached: bool,
) -> tuple[float, float, Found, Mask] | None:
    """Return load, tilt, margins and rows of the set-up with most postures in the band (deg left).

    The first group of ramps (rad) with any such posture is taken; `reached`: only postures with a
    safe path count. None where there is none.
    """
    name, turret = side
    arm = routes.arm
    grid: Floats = routes.paths(('level', 0.0), 0.0, turret).q
    for group in ramps:
        found: list[tuple[int, float, float, Found, Mask]] = []
        for load in loads:
            for tilt in group:
                seen = look(arm, grid, (name, tilt), load)
                left = np.degrees(seen.tilt)
                rows = (left > band[0]) & (left < band[1]) & (seen.most < STRONG)
                if reached:
                    rows &= routes.paths((name, tilt), load, turret).reachable
                if rows.any():
                    found.append((int(rows.sum()), load, tilt, seen, rows))
        if found:
            return max(found, key=lambda f: f[0])[1:]
    return None


def _spread(
    arm: Arm, found: Found, rows: Mask, count: int, setup: Setup, title: str, purpose: str
) -> Iterator[Step]:
    places = np.flatnonzero(rows)
    for number, k in enumerate(spread_out(found.q[places], count, arm.columns), 1):
        text = f'{title} {number}' if count > 1 else title
        yield hold_step(arm, setup, found, int(places[k]), text, purpose)
