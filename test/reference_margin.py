"""The least tip-over margin by brute force, written from its definition: an oracle for the model.

Every face of the lower hull is tried with every set of points nearest to it; what it costs to rock
until such a set touches is taken off the least angle about its edges (docs/model.md, section 4).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
from numpy.typing import ArrayLike

from ugv_acceptance.type_aliases import Floats

# What is charged for rocking by a share of a distance, and for each radian of a face's slope beyond
# FREE_SLOPE (rad). A charge above DEAR (rad) grows faster by this factor.
COST, FREE_SLOPE, DEAR, FACTOR = 10.0, np.radians(30.0), np.radians(25.0), 1.5
MOST = np.radians(90.0)
# Shares of a radius: how far a drop is counted at least, and how high a track may be above others.
LEAST_REACH, UNEVEN = 1.0 / 4.0, 1.0 / 16.0
# A point no further (m) below a face's plane does not keep the face from being one of the hull.
LEVEL = 1e-9


@dataclass(frozen=True, slots=True)
class Found:
    """The least margin (rad; minus infinity if nothing stands), its points, their rocking (rad)."""

    margin: float
    points: tuple[int, ...]
    rocking: float


def reference_margin(
    points: ArrayLike,
    cog: ArrayLike,
    gravity: ArrayLike,
    fixed: Sequence[int] = (),
) -> Found:
    """Return the margin of a robot on contact points (n, 3), under gravity in base axes (3,).

    `fixed` are the points of the base.
    """
    at, centre, down = (np.asarray(x, dtype=float) for x in (points, cog, gravity))
    best = Found(-np.inf, (), np.inf)
    found = list(footings(at, fixed))
    # Rocking by a quarter turn leaves no margin: it counts only where there is no other footing.
    most = max(MOST, min((rocking for _, rocking in found), default=0.0))
    for chosen, rocking in found:
        if rocking >= MOST and rocking > most:
            continue
        margin = least_edge(at, chosen, centre, down) - rocking
        if margin > best.margin:
            best = Found(float(margin), tuple(sorted(chosen)), float(rocking))
    return best


def footings(points: Floats, fixed: Sequence[int]) -> Iterator[tuple[tuple[int, ...], float]]:
    """Yield every set of points the robot may stand on, with what its rocking costs (rad)."""
    radius = reach(points)
    drop = drops(points, fixed)
    for face in combinations(range(len(points)), 3):
        normal = upwards(points[list(face)])
        if normal is None:
            continue
        heights = (points - points[face[0]]) @ normal
        heights[list(face)] = 0.0
        if heights.min() < -LEVEL:
            continue
        costs = np.maximum(COST * heights / radius, drop)
        others = [k for k in np.argsort(costs, kind='stable') if k not in face]
        slope = np.arctan2(np.hypot(normal[0], normal[1]), normal[2])
        lean = COST * max(0.0, float(slope) - FREE_SLOPE)
        for count in range(len(others) + 1):
            chosen = (*face, *(int(k) for k in others[:count]))
            charge = max(0.0, float(costs[list(chosen)].max()))
            yield chosen, charge + (FACTOR - 1.0) * max(0.0, charge - DEAR) + lean


def reach(points: Floats) -> float:
    """Return the largest horizontal distance (m) of a contact from the contacts' mean."""
    return float(np.linalg.norm(points[:, :2] - points[:, :2].mean(axis=0), axis=1).max())


def drops(points: Floats, fixed: Sequence[int]) -> Floats:
    """Return what is charged (rad) for each point (n,) that a robot on its tracks drops onto."""
    found: Floats = np.zeros(len(points))
    if len(fixed) < 3:
        return found
    base = points[list(fixed)]
    plane = sorted(base[:, 2])[2]
    high = plane + UNEVEN * reach(base)
    tracks = [k for k in fixed if points[k, 2] <= high]
    outer = [(i, j) for i, j in permutations(tracks, 2) if _is_edge(points, tracks, i, j)]
    others = set(range(len(points))) - set(tracks)
    if len(outer) < 3 or not others:
        return found
    raised = max(0.0, *(plane - points[k, 2] for k in others))
    for k in others:
        away = [-_turn(points[i], points[j], points[k]) / _length(points, i, j) for i, j in outer]
        size = np.clip(max(away), LEAST_REACH * reach(points), reach(points))
        level = (high if k in fixed else plane) + raised
        found[k] = COST * max(0.0, points[k, 2] - level) / size
    return found


def _length(points: Floats, i: int, j: int) -> float:
    """Return the distance (m) of two points, seen from above."""
    return float(np.linalg.norm((points[j] - points[i])[:2]))


def upwards(corners: Floats) -> Floats | None:
    """Return the unit normal of three points (3, 3) that points up; None if they have none."""
    normal: Floats = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    size = np.linalg.norm(normal)
    if size < LEVEL or abs(normal[2]) < LEVEL * size:
        return None
    upward: Floats = normal / np.copysign(size, normal[2])
    return upward


def least_edge(points: Floats, chosen: Sequence[int], cog: Floats, gravity: Floats) -> float:
    """Return the least angle (rad) about the edges of the chosen points' hull, seen from above."""
    angles = []
    for i, j in permutations(chosen, 2):
        if _is_edge(points, chosen, i, j):
            along = (points[j] - points[i]) / np.linalg.norm(points[j] - points[i])
            arm, pull = (v - along * (v @ along) for v in (points[i] - cog, gravity))
            angles.append(np.arctan2(along @ np.cross(arm, pull), arm @ pull))
    return float(min(angles)) if len(angles) >= 3 else -np.inf


def _is_edge(points: Floats, chosen: Sequence[int], i: int, j: int) -> bool:
    """Return whether all chosen points are left of i -> j, or between the two."""
    a, b = points[i, :2], points[j, :2]
    for k in chosen:
        turn = _turn(a, b, points[k, :2])
        between = (points[k, :2] - a) @ (points[k, :2] - b) <= 0.0
        if turn < -1e-12 or (turn <= 1e-12 and not between):
            return False
    return True


def _turn(a: Floats, b: Floats, c: Floats) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
