"""The support polygon: which contact points stand on the ground, and the edges between them.

On rigid flat ground the robot stands on the points that reach the tracks' ground plane; when a
point (a flipper's tip) reaches below that plane, it stands on the face of the points' lower convex
hull that lies under the centre of gravity. A polygon is a cycle of contact numbers,
counter-clockwise as seen from above.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.model.hull import (
    Cycle,
    Point,
    carries,
    drawn_in,
    heights_above,
    hull,
    hulls,
    pairs,
    sample,
    triple_under,
    triples,
    triples_under,
)
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.row_selection import ALL, Rows, Values, groups, inner, pick

__all__ = ['ALL', 'Cycle', 'Point', 'Rows', 'Support', 'pairs', 'support_of', 'supports_of']


@dataclass(frozen=True, slots=True)
class Support:
    """Which contact points a robot stands on.

    `polygon` is the cycle of contact numbers: empty if fewer than three points stand, or all in one
    line. `standing` is the number of contact points on the ground; `raised` means that the robot
    stands on points below the tracks' plane. `known` is False if a coordinate is not finite.
    """

    polygon: Cycle
    standing: int
    raised: bool
    known: bool = True


# A plane belongs to the lower hull if no point lies further below it than this (m).
_LEVEL = 1e-12
# Number of triples tried on all samples; those still without a face are then searched one by one.
_TRIES = 4
_UNKNOWN = Support((), 0, raised=False, known=False)


def support_of(robot: Robot, points: Sequence[Point], cog: Point) -> Support:
    """Return the support of one sample from its contact points and centre of gravity (m)."""
    if not math.isfinite(sum(chain.from_iterable(points), sum(cog))):
        return _UNKNOWN
    tolerance = robot.contact_tolerance
    heights = [z - robot.ground for _, _, z in points]
    raised = bool(heights) and min(heights) < -tolerance
    if raised:
        triple = triple_under(points, cog) or triple_under(points, drawn_in(points, cog))
        if triple is None:
            return Support((), len(points), raised)
        heights = heights_above(points, *triple)
    active = tuple([k for k, height in enumerate(heights) if height <= tolerance])
    return Support(hull(tuple([points[k] for k in active]), active), len(active), raised)


def supports_of(
    robot: Robot, contacts: Sequence[Any], cog: Values, count: int
) -> list[tuple[Rows, Support]]:
    """Return the distinct supports of `count` samples, each with the rows that share it.

    Each coordinate (m) is a float or an array (count,); every row appears once.
    """
    points, centre, tolerance = tuple(map(tuple, contacts)), tuple(cog), robot.contact_tolerance
    finite = np.isfinite(sum(_distinct([*chain.from_iterable(points), *centre])))
    lowest = reduce(np.minimum, _distinct([z for _, _, z in points]), np.inf)
    raised = lowest - robot.ground < -tolerance
    regimes = np.broadcast_to(np.where(finite, raised, 2), count)
    found: dict[Support, list[Any]] = {}
    for regime, rows, size in groups(regimes):
        some, at = pick((points, centre), rows)
        if regime == 2:
            parts: Iterable[tuple[Support, Rows]] = [(_UNKNOWN, ALL)]
        elif regime == 1:
            parts = _lying(some, _faces(tolerance, some, at, size), raised=True)
        else:
            pattern = _pattern([z - robot.ground for _, _, z in some], tolerance)
            whole = np.broadcast_to(np.asarray(pattern, dtype=np.int64), size)
            parts = _lying(some, whole, raised=False)
        for support, part in parts:
            found.setdefault(support, []).append(inner(rows, part))
    return [
        (rows[0] if len(rows) == 1 else np.concatenate(rows), support)
        for support, rows in found.items()
    ]


def _distinct(values: Sequence[Any]) -> list[Any]:
    """Return the values without repeated objects: points of one link often share an array."""
    return list({id(x): x for x in values}.values())


def _pattern(heights: Sequence[Any], tolerance: float) -> Values:
    """Return which points are no higher than `tolerance` (m): bit k of the number is point k."""
    return sum(((h <= tolerance) * (1 << k) for k, h in enumerate(heights)), 0)


def _faces(tolerance: float, points: Values, cog: Values, count: int) -> NDArray[np.int64]:
    """Return each sample's points on the face of the lower hull under (or nearest to) the cog.

    As bits (see `_pattern`), shape (count,); -1 if the points have no such face.
    """
    patterns = _faces_under(tolerance, points, cog, count)
    outside = np.flatnonzero(patterns < 0)
    if outside.size:
        some, centre = pick((points, cog), outside)
        inside = drawn_in(some, centre)
        patterns[outside] = _faces_under(tolerance, some, inside, outside.size)
    return patterns


def _faces_under(tolerance: float, points: Values, place: Values, count: int) -> NDArray[np.int64]:
    """Return `_faces` for a place inside the hull, shape (count,); -1 where it lies outside.

    The triple found for one sample is tried on all: the hull is convex, so where no point lies
    below the triple's plane no other triple is lower. Samples that fit none are searched in full.
    """
    patterns, left = np.full(count, -1), np.arange(count)
    for _ in range(_TRIES):
        if not left.size:
            return patterns
        some, at = pick((points, place), ALL if left.size == count else left)
        triple = triple_under(*sample((some, at), left.size // 2))
        if triple is None:
            break
        with np.errstate(divide='ignore', invalid='ignore', over='ignore'):
            heights = heights_above(some, *triple)  # where these three are in one line, too
        fits = reduce(np.logical_and, [h >= -_LEVEL for h in heights], carries(some, at, triple))
        fits = np.broadcast_to(fits, left.size)
        found = np.broadcast_to(_pattern(heights, tolerance), left.size)
        patterns[left[fits]] = found[fits]
        left = left[~fits]
    some, at = pick((points, place), left)
    for number, rows, _ in groups(triples_under(some, at, left.size)):
        if number >= 0:
            triple = triples(len(points))[number]
            patterns[left[rows]] = _pattern(heights_above(pick(some, rows), *triple), tolerance)
    return patterns


def _lying(
    points: Values, patterns: NDArray[np.int64], *, raised: bool
) -> Iterator[tuple[Support, Rows]]:
    """Yield the supports on the points whose bits are set in `patterns`, with their rows."""
    for pattern, rows, size in groups(patterns):
        if pattern < 0:
            yield Support((), len(points), raised), rows
            continue
        active = tuple(k for k in range(len(points)) if pattern >> k & 1)
        for cycle, part in hulls(pick(points, rows), active, size):
            yield Support(cycle, len(active), raised), inner(rows, part)
