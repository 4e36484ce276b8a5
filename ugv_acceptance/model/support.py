"""The support polygon: which contact points stand on the ground, and the edges between them.

On a rigid flat ground the robot stands on the points that reach the tracks' ground plane; when a
point (a flipper's tip) reaches below that plane, it stands on the face of the points' lower hull
under the centre of gravity. A polygon is a cycle of contact numbers, counter-clockwise from above.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.model.mechanics import Posture
from ugv_acceptance.model.robot import Robot

Point = tuple[float, float, float]
Cycle = tuple[int, ...]
Mask = NDArray[np.bool_]
Counts = NDArray[np.int64]

# A polygon thinner than this (m) has no inside that could be stood on.
THIN = 1e-6
# Slack (m2) with which a known cycle is still the hull of slightly moved points.
_SLACK = 1e-12


@dataclass(frozen=True, slots=True)
class Edge:
    """A tip edge between two contact points; `where` masks the samples that have it (None: all)."""

    start: int
    end: int
    where: Mask | None = None


@dataclass(frozen=True, slots=True)
class Support:
    """The edges of the support polygons of a posture's samples.

    `standing` is the number of contact points on the ground, `corners` that of the polygon: 0 where
    fewer than three points stand or all in one line, which leaves no edge. `raised` says that the
    robot stands on points below the tracks' plane.
    """

    edges: tuple[Edge, ...]
    standing: int | Counts
    corners: int | Counts
    raised: bool | Mask


def support_of(robot: Robot, posture: Posture) -> Support:
    """Return the support polygon of a posture: of one sample (floats) or of every sample (arrays)."""
    numbers = [x for point in (*posture.contacts, posture.cog) for x in point]
    count = max((len(x) for x in numbers if isinstance(x, np.ndarray)), default=0)
    if count:
        return _support_of_many(robot, posture, count)
    cycle, standing, raised = polygon(robot, posture.contacts, posture.cog)  # type: ignore[arg-type]  # floats
    return Support(_edges(cycle), standing, len(cycle), raised)


def polygon(robot: Robot, points: Sequence[Point], cog: Point) -> tuple[Cycle, int, bool]:
    """Return the polygon one sample stands on, how many points stand, and whether it is raised."""
    heights = [z - robot.ground for _, _, z in points]
    if heights and min(heights) < -robot.contact_tolerance:
        cycle, standing = _face_below(points, cog, robot.contact_tolerance)
        return cycle, standing, True
    active = [k for k, h in enumerate(heights) if h <= robot.contact_tolerance]
    return _hull(points, active), len(active), False


def _hull(points: Sequence[Point], active: Sequence[int]) -> Cycle:
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


def _face_below(points: Sequence[Point], cog: Point, tolerance: float) -> tuple[Cycle, int]:
    """Return the face of the lower hull under (or nearest to) the centre of gravity."""
    best: tuple[float, Cycle, int] = (-math.inf, (), 0)
    for triple in combinations(range(len(points)), 3):
        above = _height_above(points, *triple)
        if above is None or min(above) < -tolerance:
            continue
        active = [k for k, h in enumerate(above) if h <= tolerance]
        cycle = _hull(points, active)
        inside = [_turn([points[i], points[j], cog], 0, 1, 2) for i, j in _pairs(cycle)]
        best = max(best, (min(inside, default=-math.inf), cycle, len(active)))
    return best[1], best[2]


def _height_above(points: Sequence[Any], i: int, j: int, k: int) -> list[Any] | None:
    """Return how far every point lies above the plane of three, along base z; None: it is upright."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = points[i], points[j], points[k]
    nx = (by - ay) * (cz - az) - (bz - az) * (cy - ay)
    ny = (bz - az) * (cx - ax) - (bx - ax) * (cz - az)
    nz = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    if np.min(np.abs(nz)) < THIN**2:
        return None
    return [(z - az) + ((x - ax) * nx + (y - ay) * ny) / nz for x, y, z in points]


def _pairs(cycle: Cycle) -> Iterator[tuple[int, int]]:
    return zip(cycle, cycle[1:] + cycle[:1], strict=True)


def _edges(cycle: Cycle) -> tuple[Edge, ...]:
    return tuple(Edge(i, j) for i, j in _pairs(cycle))


def _support_of_many(robot: Robot, posture: Posture, count: int) -> Support:
    """Return the supports of arrays: samples that share a polygon are found together.

    The polygon of the first sample is taken by all samples it fits; so on until none is left.
    """
    points = [tuple(np.broadcast_to(x, count) for x in point) for point in posture.contacts]
    cog = tuple(np.broadcast_to(x, count) for x in posture.cog)
    height = np.array([point[2] for point in points]).reshape(-1, count) - robot.ground
    raised = (height < -robot.contact_tolerance).any(axis=0)
    active = height <= robot.contact_tolerance
    standing, corners = active.sum(axis=0), np.zeros(count, dtype=np.int64)
    masks: dict[tuple[int, int], Mask] = {}
    left = np.ones(count, dtype=np.bool_)
    while left.any():
        first = int(left.argmax())
        one = [(float(x[first]), float(y[first]), float(z[first])) for x, y, z in points]
        cycle, number, up = polygon(robot, one, tuple(float(x[first]) for x in cog))  # type: ignore[arg-type]
        same = left & (raised == up)
        if up:
            same &= _is_face(points, cog, cycle, number, robot.contact_tolerance)
            standing[same] = number
        else:
            same &= (active == active[:, first : first + 1]).all(axis=0)
            same &= _is_hull(points, cycle, np.flatnonzero(active[:, first]))
        same[first] = True
        corners[same] = len(cycle)
        for pair in _pairs(cycle):
            masks[pair] = masks[pair] | same if pair in masks else same
        left &= ~same
    edges = tuple(Edge(i, j, None if m.all() else m) for (i, j), m in masks.items())
    return Support(edges, standing, corners, raised)


def _is_hull(points: Sequence[Any], cycle: Cycle, active: Iterable[int]) -> Mask | bool:
    """Return where `cycle` is the hull of the active points: none lies outside one of its edges."""
    active = list(active)
    if len(active) < 3:
        return True
    if not cycle:  # points in one line: whether they stay so is asked of each sample
        return False
    good: Mask | bool = True
    for i, j in _pairs(cycle):
        for k in active:
            if k not in (i, j):
                good = good & (_turn(points, i, j, k) >= -_SLACK)
    return good


def _is_face(
    points: Sequence[Any], cog: Any, cycle: Cycle, standing: int, tolerance: float
) -> Mask | bool:
    """Return where `cycle` is the face of the lower hull under the centre of gravity."""
    above = _height_above(points, *cycle[:3]) if cycle else None
    if above is None:
        return False
    inside = np.all([_turn([points[i], points[j], cog], 0, 1, 2) > 0 for i, j in _pairs(cycle)], 0)
    on = np.sum([h <= tolerance for h in above], axis=0) == standing
    corners = np.all([above[k] <= tolerance for k in cycle], axis=0)
    good: Mask = inside & on & corners & (np.min(above, axis=0) >= -tolerance)
    active = [k for k, h in enumerate(above) if k in cycle or (h[good] <= tolerance).any()]
    return good & _is_hull(points, cycle, active)
