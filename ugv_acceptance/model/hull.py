"""Convex hulls of a few points, as seen from above.

A recording has many samples but few different hulls: the hull found for one sample is tried on all
the others, which is cheaper than computing each one's own.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache, reduce
from itertools import combinations, pairwise
from typing import Any

import numpy as np

from ugv_acceptance.model.row_selection import ALL, Rows, Values, inner, pick

Point = tuple[float, float, float]
Cycle = tuple[int, ...]

# A polygon thinner than this (m) counts as a line: nothing can stand on it.
THIN = 1e-6
# A place outside the hull is moved to its border, and by this share of the way further inside.
_INWARD = 1e-9
# Three points count as being in one line if twice the area of their triangle is below this (m2).
_SLACK = 1e-12
# Number of hulls tried on all samples; those still without one are then treated one by one.
_TRIES = 50


def pairs(cycle: Cycle) -> Iterator[tuple[int, int]]:
    """Return the edges of a polygon as pairs of contact numbers, counter-clockwise."""
    return pairwise((*cycle, *cycle[:1]))


def _turn(a: Sequence[Any], b: Sequence[Any], c: Sequence[Any]) -> Values:
    """Return twice the signed area of the triangle of three points, seen from above."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


@lru_cache(maxsize=256)
def hull(points: tuple[Point, ...], numbers: tuple[int, ...]) -> Cycle:
    """Return the convex hull seen from above, as a cycle of `numbers`; () if it is degenerate.

    Andrew's monotone chain. `numbers[k]` is the contact number of `points[k]` (m); the cycle runs
    counter-clockwise from its smallest number.
    """
    order = sorted(range(len(points)), key=lambda k: points[k][:2])
    hull: list[int] = []
    for run in (order, order[::-1]):
        base = len(hull)
        for k in run:
            while len(hull) - base >= 2 and _turn(*(points[i] for i in (*hull[-2:], k))) <= _SLACK:
                hull.pop()
            hull.append(k)
        if hull:
            hull.pop()
    corners = [points[k] for k in hull]
    if len(hull) < 3 or _is_thin(corners, max):
        return ()
    cycle = tuple(numbers[k] for k in hull)
    start = cycle.index(min(cycle))
    return cycle[start:] + cycle[:start]


def _is_thin(points: Sequence[Any], greatest: Callable[[list[Any]], Any]) -> Values:
    """Return whether the points are within THIN of one line, seen from above.

    `greatest` is the maximum of a list: of floats for one sample, of arrays for many.
    """
    thickest = greatest([abs(_turn(*three)) for three in combinations(points, 3)])
    square = greatest([(a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 for a, b in combinations(points, 2)])
    return thickest * thickest <= THIN * THIN * square


def largest(values: Sequence[Any]) -> Any:  # noqa: ANN401 - a float, or one a row
    """Return the largest of floats, or of arrays row by row."""
    if all(isinstance(x, float) for x in values):
        return max(values)
    return reduce(np.maximum, values)


def hulls(points: Sequence[Any], active: Cycle, count: int) -> Iterator[tuple[Cycle, Rows]]:
    """Yield each hull of the active points that occurs in `count` samples, with its rows.

    The hull of the first sample is assigned to all samples it fits; then that of the first sample
    left over, and so on.
    """
    if not any(isinstance(x, np.ndarray) for k in active for x in points[k]):
        yield hull(tuple(points[k] for k in active), active), ALL
        return
    left: Rows = ALL
    for _ in range(_TRIES):
        some = pick(tuple(points), left)
        cycle = hull(sample(tuple([some[k] for k in active]), 0), active)
        same = np.array(np.broadcast_to(_is_hull(some, cycle, active), count))
        same[0] = True
        yield cycle, inner(left, ALL if same.all() else np.flatnonzero(same))
        left = inner(left, np.flatnonzero(~same))
        count -= int(same.sum())
        if not count:
            return
    some = pick(tuple(points), left)
    alone = [hull(sample(tuple([some[k] for k in active]), row), active) for row in range(count)]
    for cycle in set(alone):
        yield cycle, inner(left, np.flatnonzero([x == cycle for x in alone]))


def sample(values: Values, row: int) -> Values:
    """Return one row of nested tuples of floats and arrays, as nested tuples of floats."""
    if isinstance(values, tuple):
        return tuple([sample(part, row) for part in values])
    return float(values[row]) if isinstance(values, np.ndarray) else values


def _is_hull(points: Sequence[Any], cycle: Cycle, active: Cycle) -> Values:
    """Return for which samples `cycle` is the hull of the active points, as `hull` finds it."""
    if len(active) < 3:
        return True
    if not cycle:
        return _is_thin([points[k] for k in active], largest)
    good = np.logical_not(_is_thin([points[k] for k in cycle], largest))
    for i, j in pairs(cycle):
        for k in active:
            if k not in {i, j}:
                left = _turn(points[i], points[j], points[k])
                good = good & ((left > _SLACK) if k in cycle else (left >= -_SLACK))
    return good


def drawn_in(points: Values, place: Values) -> tuple[Values, Values]:
    """Return x, y (m) where the line from the points' mean to an outside place exits the hull."""
    middle = [sum(p[k] for p in points) / len(points) for k in range(2)]
    way = [place[k] - middle[k] for k in range(2)]
    furthest: Any = 0.0
    with np.errstate(divide='ignore', invalid='ignore', over='ignore'):
        for a, b in combinations(points, 2):
            edge, start = ([b[k] - a[k] for k in range(2)], [a[k] - middle[k] for k in range(2)])
            across = np.float64(1.0) * (way[0] * edge[1] - way[1] * edge[0])
            part = (start[0] * way[1] - start[1] * way[0]) / across
            reach = (start[0] * edge[1] - start[1] * edge[0]) / across
            hit = abs(part - 0.5) < 0.5 + _INWARD
            furthest = np.maximum(furthest, np.where(hit, reach, 0.0))
    x, y = (middle[k] + (1.0 - _INWARD) * furthest * way[k] for k in range(2))
    return x, y
