"""The support polygon: which contact points stand on the ground, and the edges between them.

On a rigid flat ground the robot stands on the points that reach the tracks' ground plane; when a
point (a flipper's tip) reaches below that plane, it stands on the face of the points' lower hull
under the centre of gravity. A polygon is a cycle of contact numbers, counter-clockwise from above.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from typing import Any, Union

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.model.robot import Robot

Point = tuple[float, float, float]
Cycle = tuple[int, ...]
Mask = NDArray[np.bool_]
Rows = Union[slice, NDArray[np.intp]]

ALL = slice(None)

# A polygon thinner than this (m) has no inside that could be stood on.
THIN = 1e-6
# Slack (m2) with which a known cycle is still the hull of slightly moved points.
_SLACK = 1e-12


@dataclass(frozen=True, slots=True)
class Support:
    """How a sample stands on the ground.

    `polygon` is the cycle of contacts it stands on: empty where fewer than three points stand or
    all in one line. `standing` is the number of contact points on the ground; `raised` says that
    the robot stands on points below the tracks' plane.
    """

    polygon: Cycle
    standing: int
    raised: bool


def support_of(robot: Robot, points: Sequence[Point], cog: Point) -> Support:
    """Return the support of one sample from its contact points and centre of gravity (m)."""
    lowest = min((z for _, _, z in points), default=robot.ground)
    if lowest < robot.ground - robot.contact_tolerance:
        return _face_below(points, cog, robot.contact_tolerance)
    top = robot.ground + robot.contact_tolerance
    active = tuple(k for k, point in enumerate(points) if point[2] <= top)
    return Support(_hull(tuple(points), active), len(active), False)


def supports_of(
    robot: Robot, contacts: Sequence[Any], cog: Any, count: int
) -> list[tuple[Rows, Support]]:
    """Return the supports of `count` samples, each with the rows that share it.

    The support of the first sample is taken by all samples it fits; so on until none is left.
    """
    points = [tuple(np.broadcast_to(x, count) for x in point) for point in contacts]
    centre = tuple(np.broadcast_to(x, count) for x in cog)
    height = np.array([point[2] for point in points]).reshape(-1, count) - robot.ground
    raised = (height < -robot.contact_tolerance).any(axis=0)
    active = height <= robot.contact_tolerance
    found: list[tuple[Rows, Support]] = []
    left = np.ones(count, dtype=np.bool_)
    while left.any():
        first = int(left.argmax())
        one = [(float(x[first]), float(y[first]), float(z[first])) for x, y, z in points]
        x, y, z = (float(c[first]) for c in centre)
        support = support_of(robot, one, (x, y, z))
        same = left & (raised == support.raised)
        if support.raised:
            same &= _is_face(points, centre, support, robot.contact_tolerance)
        else:
            same &= (active == active[:, first : first + 1]).all(axis=0)
            same &= _is_hull(points, support.polygon, np.flatnonzero(active[:, first]))
        same[first] = True
        left &= ~same
        found.append((ALL if same.all() else np.flatnonzero(same), support))
    return found


@lru_cache(maxsize=256)
def _hull(points: tuple[Point, ...], active: tuple[int, ...]) -> Cycle:
    """Return the convex hull seen from above (Andrew's monotone chain); () where it is degenerate."""
    order = sorted(active, key=lambda k: points[k][:2])
    chain: list[int] = []
    for run in (order, order[::-1]):
        base = len(chain)
        for k in run:
            while len(chain) - base >= 2 and _turn(points, chain[-2], chain[-1], k) <= _SLACK:
                chain.pop()
            chain.append(k)
        if chain:
            chain.pop()
    if len(chain) < 3 or _width(points, chain) < THIN:
        return ()
    return tuple(chain)


def _turn(points: Sequence[Any], a: int, b: int, c: int) -> Any:
    """Return twice the signed area of the triangle of three points, seen from above."""
    (ax, ay, _), (bx, by, _), (cx, cy, _) = points[a], points[b], points[c]
    return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)


def _width(points: Sequence[Point], chain: Sequence[int]) -> float:
    """Return twice the polygon's area over its longest side: how thin it is (m)."""
    area = sum(_turn(points, chain[0], a, b) for a, b in zip(chain[1:], chain[2:], strict=False))
    longest = max(math.dist(points[a][:2], points[b][:2]) for a, b in combinations(chain, 2))
    return float(area / longest) if longest else 0.0


def _face_below(points: Sequence[Point], cog: Point, tolerance: float) -> Support:
    """Return the face of the lower hull under (or nearest to) the centre of gravity."""
    best: tuple[float, Cycle, int] = (-math.inf, (), 0)
    for triple in combinations(range(len(points)), 3):
        above = _height_above(points, *triple)
        if above is None or min(above) < -tolerance:
            continue
        active = tuple(k for k, h in enumerate(above) if h <= tolerance)
        cycle = _hull(tuple(points), active)
        inside = [_turn([points[i], points[j], cog], 0, 1, 2) for i, j in pairs(cycle)]
        best = max(best, (min(inside, default=-math.inf), cycle, len(active)))
    return Support(best[1], best[2], True)


def _height_above(points: Sequence[Any], i: int, j: int, k: int) -> list[Any] | None:
    """Return how far every point lies above the plane of three, along base z; None: it is upright."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = points[i], points[j], points[k]
    nx = (by - ay) * (cz - az) - (bz - az) * (cy - ay)
    ny = (bz - az) * (cx - ax) - (bx - ax) * (cz - az)
    nz = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    if np.min(np.abs(nz)) < THIN**2:
        return None
    return [(z - az) + ((x - ax) * nx + (y - ay) * ny) / nz for x, y, z in points]


def pairs(cycle: Cycle) -> Iterator[tuple[int, int]]:
    """Return the edges of a polygon, counter-clockwise."""
    return zip(cycle, cycle[1:] + cycle[:1], strict=True)


def _is_hull(points: Sequence[Any], cycle: Cycle, active: Iterable[int]) -> Mask | bool:
    """Return where `cycle` is the hull of the active points: none lies outside one of its edges."""
    active = list(active)
    if len(active) < 3:
        return True
    if not cycle:  # points in one line: whether they stay so is asked of each sample
        return False
    good: Mask | bool = True
    for i, j in pairs(cycle):
        for k in active:
            if k not in (i, j):
                good = good & (_turn(points, i, j, k) >= -_SLACK)
    return good


def _is_face(points: Sequence[Any], cog: Any, support: Support, tolerance: float) -> Mask | bool:
    """Return where the support is the face of the lower hull under the centre of gravity."""
    cycle = support.polygon
    above = _height_above(points, *cycle[:3]) if cycle else None
    if above is None:
        return False
    inside = np.all([_turn([points[i], points[j], cog], 0, 1, 2) > 0 for i, j in pairs(cycle)], 0)
    on = np.sum([h <= tolerance for h in above], axis=0) == support.standing
    corners = np.all([above[k] <= tolerance for k in cycle], axis=0)
    good: Mask = inside & on & corners & (np.min(above, axis=0) >= -tolerance)
    active = [k for k, h in enumerate(above) if k in cycle or (h[good] <= tolerance).any()]
    return good & _is_hull(points, cycle, active)
