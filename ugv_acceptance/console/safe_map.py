"""The safe map of two joints: where the arm may go, with everything else as it is now."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance import BadSample
from ugv_acceptance.console.frame import Plain, number
from ugv_acceptance.console.snapshot import Snapshot
from ugv_acceptance.evaluation.least_margins import least_tilt, most_used
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import stability
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.studies.axes import map_axes
from ugv_acceptance.studies.bilinear import Grid, grid_of, why_not_alone
from ugv_acceptance.studies.maps import (
    CAUTION,
    FAILURE,
    classes,
    rollover_map,
    torque_forms,
    utilisation_map,
)

# Classes of a cell; the page's colours and hatches follow this order.
SAFE_CELL, CAUTION_CELL, TORQUE_CELL, TIP_CELL, BOTH_CELL = range(5)
CELLS = 73
# Changes smaller than this (rad, m; m/s2; kg) do not make a new map.
_STEP = 0.01
# How far (m) a joint that slides without limits is shown to each side.
_SLIDE = 1.0


Axes = tuple[str, str]


@dataclass(frozen=True, slots=True)
class MapKey:
    """All that a map depends on, rounded so that noise does not cause a new map."""

    axes: Axes
    numbers: tuple[float, ...]


def axes_of(settings: Settings, wanted: tuple[str, str] | None = None) -> Axes | None:
    """Return the two joints of a map: those wanted, else the two of the arm.

    None where a robot has no two joints whose map would say where it may go: a rover, legs.
    Raises BadSample where a wanted joint is not one of the robot's, or both are the same.
    """
    robot = settings.robot
    names = robot.joint_names
    if wanted is not None:
        if len(set(wanted)) != 2 or not set(wanted) <= set(names):
            raise BadSample(f'map: expected two of {", ".join(names)}, got {" and ".join(wanted)}')
        for name in wanted:
            if why := why_not_alone(robot, name):
                raise BadSample(f'map: expected a joint that moves alone, got {name}: {why}')
        return wanted
    found = map_axes(robot, settings.limits.torque)
    return (found[0], found[1]) if len(found) == 2 else None


def key_of(snapshot: Snapshot, settings: Settings, axes: Axes | None) -> MapKey | None:
    """Return the key of a snapshot's map; None: no map, or posture or attitude is not known."""
    if axes is None:
        return None
    others = [
        q
        for name, q in zip(settings.robot.joint_names, snapshot.q, strict=False)
        if name not in axes
    ]
    load = snapshot.payload
    numbers = (*snapshot.gravity, *others, load.mass, *load.cog)
    if not snapshot.q or not all(map(math.isfinite, numbers)):
        return None
    steps = (5 * _STEP,) * 3 + (_STEP,) * (len(numbers) - 3)
    rounded = [round(x / step) * step for x, step in zip(numbers, steps, strict=True)]
    return MapKey(axes, tuple(rounded))


def safe_map(snapshot: Snapshot, settings: Settings, axes: Axes) -> Plain:
    """Return the map as JSON: ranges (rad; m) and one digit a cell, rows of the first joint."""
    grid = _grid(snapshot, settings, axes)
    cells = _cells(snapshot, settings, grid)
    return {
        'x': axes[0],
        'y': axes[1],
        'x_range': [float(grid.x[0]), float(grid.x[-1])],
        'y_range': [float(grid.y[0]), float(grid.y[-1])],
        'rows': len(grid.x),
        'columns': len(grid.y),
        'cells': (cells + ord('0')).tobytes().decode('ascii'),
    }


def probe(
    snapshot: Snapshot, settings: Settings, axes: Axes | None, at: tuple[float, float]
) -> Plain:
    """Return the margins of a posture in which the two joints stand `at` (rad; m), as JSON.

    Raises BadSample where the rest of the posture is not known or `at` is not two numbers.
    """
    if axes is None:
        raise BadSample('map: expected a robot with two joints to map, this one has none')
    if key_of(snapshot, settings, axes) is None or not all(map(math.isfinite, at)):
        raise BadSample('map: expected a known posture and two numbers')
    robot, load = settings.robot, snapshot.payload
    q = list(snapshot.q)
    for name, value in zip(axes, at, strict=True):
        q[robot.joint_names.index(name)] = value
    torque = static_torque(robot, q, snapshot.gravity, load)
    angle: Any = stability(robot, q, snapshot.gravity, load).angle
    side, least = least_tilt(angle)
    joint, use = most_used(torque, settings)
    return {
        'at': [number(x) for x in at],
        'tilt_deg': number(math.degrees(least)),
        'side': side,
        'use': number(use),
        'joint': joint,
    }


def _grid(snapshot: Snapshot, settings: Settings, axes: Axes) -> Grid:
    ranges = [settings.robot.joint(name).travel(_SLIDE) for name in axes]
    q = np.nan_to_num(np.array(snapshot.q))
    return grid_of(settings.robot, axes, ranges, (CELLS, CELLS), q)


def _cells(snapshot: Snapshot, settings: Settings, grid: Grid) -> NDArray[np.uint8]:
    robot, limits, load = settings.robot, settings.limits, snapshot.payload
    gravity = snapshot.gravity
    forms = torque_forms(robot, grid, gravity, load)
    used = utilisation_map(robot, grid, forms, np.array(limits.torque))
    torque = classes(-used, -limits.torque_warn, -limits.torque_error)
    if robot.contacts:
        tilt = rollover_map(robot, grid, gravity, load, workers=1).angle
        tip = classes(tilt, limits.tip_warn, limits.tip_error)
    else:
        tip = np.zeros_like(torque)
    cells = np.where((torque == CAUTION) | (tip == CAUTION), CAUTION_CELL, SAFE_CELL)
    cells[torque == FAILURE] = TORQUE_CELL
    cells[tip == FAILURE] = TIP_CELL
    cells[(torque == FAILURE) & (tip == FAILURE)] = BOTH_CELL
    return cells.astype(np.uint8)
