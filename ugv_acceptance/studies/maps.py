"""Maps over two joints: torque utilisation and tip-over margin, and where they fail.

Computed from 3 x 3 forms (bilinear.py), which is fast; the tip-over margin by the general functions
of room model where the support polygon changes over the map.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ugv_acceptance.model.edges import side_of
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.stability import stability
from ugv_acceptance.model.statics import centre_of_gravity, static_torque
from ugv_acceptance.model.support import flat_polygon, pairs
from ugv_acceptance.studies.bilinear import Grid, along_rows, evaluate, form_of, is_sum_form
from ugv_acceptance.studies.windows import Mask, window_between
from ugv_acceptance.type_aliases import Floats

SAFE, CAUTION, FAILURE = range(3)
CLASSES = ('safe', 'caution', 'failure')
# Rows per block: so few rows of 2001 cells and their temporaries stay in the cache.
_ROWS = 16


@dataclass(frozen=True, slots=True)
class Levels:
    """Levels of a margin: at or below `failure` it fails, at or below `caution` it warns."""

    caution: float
    failure: float


@dataclass(frozen=True, slots=True, eq=False)
class TipMap:
    """Tip-over margin over a grid: smallest tilt left and the side to which the robot would tip.

    `angle` (n, m) in rad, NaN where there is no margin; `side` (n, m) is a number in SIDES.
    """

    angle: Floats
    side: NDArray[np.int8]


@dataclass(frozen=True, slots=True, eq=False)
class TipForms:
    """Each tip edge's angle as atan2 of two forms: `sine` and `cosine` (edges, 3, 3).

    `side` (edges,) is the number in SIDES of the side each edge lies on.
    """

    sine: Floats
    cosine: Floats
    side: NDArray[np.int8]


def classes(margin: Floats, caution: float, failure: float) -> NDArray[np.uint8]:
    """Return SAFE, CAUTION or FAILURE of each margin (larger is better); NaN is a FAILURE."""
    found = np.full(margin.shape, FAILURE, dtype=np.uint8)
    found[margin > failure] = CAUTION
    found[margin > caution] = SAFE
    return found


def torque_forms(
    robot: Robot, grid: Grid, gravity: ArrayLike, payload: Payload | None = None
) -> Floats:
    """Return the static torque of every joint (N m) over the grid as forms (j, 3, 3)."""
    return form_of(robot, grid, lambda q: static_torque(robot, q, gravity, payload))


def within_limits(
    robot: Robot, grid: Grid, forms: Floats, limits: ArrayLike, workers: int = 2
) -> Mask:
    """Return whether every |torque| is at most its limit (j,), shape (n, m)."""
    bounds = np.broadcast_to(np.asarray(limits, dtype=np.float64), len(forms))
    judged = [(form, float(bound)) for form, bound in zip(forms, bounds, strict=True)]
    judged = [(form, bound) for form, bound in judged if np.abs(form).sum() > bound]
    windows: list[_Window] = []
    if _equal_steps(robot, grid):
        sums = [(form, bound) for form, bound in judged if is_sum_form(form)]
        judged = [(form, bound) for form, bound in judged if not is_sum_form(form)]
        for form, bound in sums:
            _add_window(windows, along_rows(robot, grid, form)[:, 0], form[1, 1:], bound)
    masks = [_window_mask(grid, window) for window in windows]
    ok = masks[0] if masks else np.ones((len(grid.x), len(grid.y)), dtype=np.bool_)
    for mask in masks[1:]:
        ok &= mask
    for form, bound in judged:
        _by_rows(len(grid.x), workers, _within(robot, grid, form, bound, ok))
    return ok


@dataclass(slots=True, eq=False)
class _Window:
    """Bounds `lower` and `upper` (n,) on g(a + b) = wave[0] cos(a + b) + wave[1] sin(a + b).

    One of each for every position a of the first joint.
    """

    wave: Floats
    lower: Floats
    upper: Floats


def _add_window(windows: list[_Window], of_row: Floats, wave: Floats, bound: float) -> None:
    """Add the condition |of_row + g| <= bound; joints with the same g share one window.

    Shoulder and elbow do, for example.
    """
    for known in windows:
        if np.abs(known.wave - wave).max() <= 1e-14 * np.abs(wave).max():
            np.maximum(known.lower, -bound - of_row, out=known.lower)
            np.minimum(known.upper, bound - of_row, out=known.upper)
            return
    windows.append(_Window(wave, -bound - of_row, bound - of_row))


def _window_mask(grid: Grid, window: _Window) -> Mask:
    step = grid.y[1] - grid.y[0]
    total = grid.x[0] + grid.y[0] + step * np.arange(len(grid.x) + len(grid.y) - 1)
    table = window.wave[0] * np.cos(total) + window.wave[1] * np.sin(total)
    return window_between(table, window.lower, window.upper)


def _within(
    robot: Robot, grid: Grid, form: Floats, bound: float, ok: Mask
) -> Callable[[slice], None]:
    def run(rows: slice) -> None:
        within = np.abs(evaluate(robot, grid, form, rows)) <= bound
        ok[rows] &= within

    return run


def _equal_steps(robot: Robot, grid: Grid) -> bool:
    slides = [robot.joint(robot.joint_names[k]).slides for k in (grid.first, grid.second)]
    steps = np.concatenate([np.diff(grid.x), np.diff(grid.y)])
    return not any(slides) and bool(np.ptp(steps) < 1e-12)


def _by_rows(count: int, workers: int, run: Callable[[slice], None]) -> None:
    blocks = [slice(k, min(k + _ROWS, count)) for k in range(0, count, _ROWS)]
    if min(workers, len(blocks)) == 1:
        for block in blocks:
            run(block)
        return
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(run, blocks))


def utilisation_map(robot: Robot, grid: Grid, forms: Floats, limits: ArrayLike) -> Floats:
    """Return the largest |torque| / limit over the joints (n, m): 1 is saturation."""
    bounds = np.broadcast_to(np.asarray(limits, dtype=np.float64), len(forms))
    worst = np.zeros((len(grid.x), len(grid.y)))
    for form, bound in zip(forms, bounds, strict=True):
        np.maximum(worst, np.abs(evaluate(robot, grid, form)) / bound, out=worst)
    return worst


def tip_forms(
    robot: Robot, grid: Grid, gravity: ArrayLike, payload: Payload | None = None
) -> TipForms | None:
    """Return the tip edges' forms; None if the support polygon changes over the grid."""
    g = np.asarray(gravity, dtype=np.float64)
    cog = form_of(robot, grid, lambda q: centre_of_gravity(robot, q, payload))
    points = _fixed_contacts(robot, grid)
    if points is None or g[2] >= 0.0:
        return None
    polygon = flat_polygon(mechanics_of(robot), [tuple(point.tolist()) for point in points])
    if not polygon:
        return None
    sine, cosine, side = [], [], []
    for i, j in pairs(polygon):
        start, along = points[i], points[j] - points[i]
        along /= np.linalg.norm(along)
        square = g - along * (along @ g)
        sine.append(_affine(cog, start, -np.cross(along, g)))
        cosine.append(_affine(cog, start, square))
        side.append(side_of(float(along[1]), -float(along[0])))
    return TipForms(np.array(sine), np.array(cosine), np.array(side, dtype=np.int8))


def _affine(cog: Floats, start: Floats, direction: Floats) -> Floats:
    """Return the form (3, 3) of (start - cog) . direction, from the forms `cog` (3, 3, 3)."""
    form: Floats = -np.einsum('kab,k->ab', cog, direction)
    form[0, 0] += start @ direction
    return form


def _fixed_contacts(robot: Robot, grid: Grid) -> list[Floats] | None:
    """Return the contact points (m, `base_link`); None if one moves with a joint of the grid."""
    mechanics = mechanics_of(robot)
    if {grid.first, grid.second} & {joint for joint, _ in mechanics.carried}:
        return None
    posture = posture_of(mechanics, [float(x) for x in grid.q], 0.0, (0.0, 0.0, 0.0))
    return [np.array(point, dtype=np.float64) for point in posture.contacts]


def rollover_map(
    robot: Robot,
    grid: Grid,
    gravity: ArrayLike,
    payload: Payload | None = None,
    workers: int = 2,
) -> TipMap:
    """Return the tilt left about the nearest tip edge over the grid, and the side it lies on."""
    forms = tip_forms(robot, grid, gravity, payload)
    if forms is None:
        return _general(robot, grid, gravity, payload, workers)
    angle = np.empty((len(grid.x), len(grid.y)))
    side = np.empty(angle.shape, dtype=np.int8)

    def run(rows: slice) -> None:
        sine = evaluate(robot, grid, forms.sine, rows)
        edges = np.arctan2(sine, evaluate(robot, grid, forms.cosine, rows))
        worst = edges[0]
        at = np.full(worst.shape, forms.side[0], dtype=np.int8)
        for edge, name in zip(edges[1:], forms.side[1:], strict=True):
            at[edge < worst] = name
            np.minimum(worst, edge, out=worst)
        angle[rows], side[rows] = worst, at

    _by_rows(len(grid.x), workers, run)
    return TipMap(angle, side)


def _general(
    robot: Robot, grid: Grid, gravity: ArrayLike, payload: Payload | None, workers: int
) -> TipMap:
    found = stability(robot, grid.postures(), gravity, payload, workers)
    edges: Any = np.stack([np.asarray(x) for x in found.angle])
    side = np.where(np.isnan(edges), np.inf, edges).argmin(axis=0)
    return TipMap(edges.min(axis=0), side.astype(np.int8))


def stands(robot: Robot, grid: Grid, forms: TipForms, angle: float = 0.0) -> Mask:
    """Return whether the tilt left about every edge is above `angle` (rad, >= 0), shape (n, m).

    Tests sin(force angle - angle) > 0, which needs no arc tangent. That is the same as long as
    gravity points below the base, where the force angle stays above `angle` less half a turn.
    """
    turned = forms.sine * np.cos(angle) - forms.cosine * np.sin(angle)
    ok = np.empty((len(grid.x), len(grid.y)), dtype=np.bool_)

    def run(rows: slice) -> None:
        ok[rows] = (evaluate(robot, grid, turned, rows) > 0.0).all(axis=0)

    _by_rows(len(grid.x), 2, run)
    return ok


def area_fraction(mask: Mask, grid: Grid) -> float:
    """Return the fraction of the map's area where `mask` (n, m) is True (trapezoidal rule)."""
    rows = _integral(mask.astype(np.float64), grid.y)
    area = (grid.x[-1] - grid.x[0]) * (grid.y[-1] - grid.y[0])
    return float(_integral(rows, grid.x) / area)


def _integral(values: Floats, at: Floats) -> Floats:
    """Integrate over the last axis by the trapezoidal rule."""
    total: Floats = (np.diff(at) * (values[..., 1:] + values[..., :-1]) / 2.0).sum(axis=-1)
    return total
