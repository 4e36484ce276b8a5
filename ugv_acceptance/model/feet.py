"""What is known of contacts before their place is, and what it costs to stand on them.

Points on the base near the tracks' ground plane are the tracks; a robot that stands on them and
drops onto another point, such as a flipper in the air, has tipped by so much. What rocking a set of
points costs is charged here; which sets there are is found in support.py.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from ugv_acceptance.model.expressions import Number
from ugv_acceptance.model.hull import Cycle, Point, hull, largest, pairs
from ugv_acceptance.model.mechanics import Mechanics
from ugv_acceptance.model.row_selection import Values
from ugv_acceptance.model.tree import in_body, plain

# Rocking (rad) charged for a point that is as far from the plane as the contacts are from their
# middle; for a point that drops by its distance from the tracks; for each radian of a face's
# inclination beyond STEEP (rad): nothing stands on its side.
ROCKING = 10.0
STEEP = math.radians(30.0)
# Beyond this rocking (rad) each radian counts as DEARER: what is so far off the ground is no foot.
FAR = math.radians(25.0)
DEARER = 1.5
# As shares of the contacts' radius: the least distance from the tracks that counts for a drop, and
# how high above the tracks' ground plane a point of the base is one of the tracks.
NEAR = 0.25
BAND = 0.0625
# With as much rocking (rad) as this no margin is left: no edge is ever further than this.
MOST = 0.5 * math.pi
# A point that drops by this share of its distance from the tracks costs MOST: it carries nothing.
HIGH = (FAR + (MOST - FAR) / DEARER) / ROCKING
# A point this far (m) below a plane is still on it.
LEVEL = 1e-9


@dataclass(frozen=True, slots=True)
class Footing:
    """Contact points that can carry a robot together.

    `points` are those on or near the plane of `face` (three of them), `polygon` is the cycle of
    their hull. `rocking` (rad, a float or one a row) is what is taken from every margin until all
    of them carry. `raised`: one of them is below the tracks' ground plane.
    """

    points: Cycle
    face: tuple[int, int, int]
    polygon: Cycle
    rocking: Number
    raised: bool


@dataclass(frozen=True, slots=True, eq=False)
class Feet:
    """What is known of a robot's contacts before their place is.

    `tracks` are the contact numbers on the base and near the tracks' ground plane, which is at
    `plane` (m). Of a point of `others` only what is higher than its height here counts as a drop:
    those of the base may be uneven, those on moving links start at the plane. `lines` are the
    edges of the tracks' polygon: a point (x, y) in m and the outward unit normal. All are empty
    where the base has no polygon, as with legs.

    `moves` says whether a contact is on a moving link.
    `alone` is the footing on the tracks, if they are level: the only one while all others are too
    high to matter, wherever they are. `reach` (m) is the least distance that counts for that; a
    point `sure` (m) above where it starts to count is too high anywhere it can be.
    """

    tracks: Cycle
    plane: float
    others: tuple[tuple[int, float], ...]
    lines: tuple[tuple[float, float, float, float], ...]
    ground: float
    tolerance: float
    moves: bool
    alone: tuple[Footing, ...] = ()
    reach: float = 0.0
    sure: float = math.inf


@lru_cache(maxsize=64)
def feet_of(mechanics: Mechanics) -> Feet:
    """Return the Feet of a robot."""
    robot, frames = mechanics.robot, mechanics.tree.frames
    base = {
        k: plain(in_body(mechanics.tree, contact.link, contact.position)[1])
        for k, contact in enumerate(robot.contacts)
        if frames[contact.link][0] == 0
    }
    moves, tolerance = len(base) < len(robot.contacts), robot.contact_tolerance
    none = Feet((), robot.ground, (), (), robot.ground, tolerance, moves)
    if len(base) < 3:
        return none
    plane = sorted(z for _, _, z in base.values())[2]
    band = BAND * radius_of(list(base.values()))
    tracks = tuple(k for k, (_, _, z) in base.items() if z <= plane + band)
    polygon = hull(tuple(base[k] for k in tracks), tracks)
    if not polygon:
        return none
    others = [(k, plane + band) for k in base if k not in tracks]
    others += [(k, plane) for k in range(len(robot.contacts)) if k not in base]
    lines = tuple(_line(base[i], base[j]) for i, j in pairs(polygon))
    found = replace(none, tracks=tracks, plane=plane, others=tuple(others), lines=lines)
    if max(abs(base[k][2] - plane) for k in tracks) > LEVEL or len(tracks) == len(robot.contacts):
        return found
    i, j, k, *_ = polygon
    raised = plane < robot.ground - tolerance
    alone = Footing(tracks, (i, j, k), polygon, 0.0, raised)
    # No point is further from an edge than both can be from the base's origin.
    span = 2.0 * _furthest(mechanics)
    return replace(found, alone=(alone,), reach=NEAR * span, sure=1.001 * HIGH * span)


def _furthest(mechanics: Mechanics) -> float:
    """Return a distance (m) from the base's origin that no contact exceeds in any posture."""
    tree, found = mechanics.tree, 0.0
    for contact in mechanics.robot.contacts:
        body, point = in_body(tree, contact.link, contact.position)
        length = math.hypot(*plain(point))
        while body:
            if tree.bodies[body].prismatic:
                return math.inf
            length += math.hypot(*tree.bodies[body].offset)
            body = tree.bodies[body].parent
        found = max(found, length)
    return found


def _line(start: Point, end: Point) -> tuple[float, float, float, float]:
    x, y = end[0] - start[0], end[1] - start[1]
    length = math.hypot(x, y)
    return (start[0], start[1], y / length, -x / length)


def height_over(
    point: Sequence[Any], feet: Feet, least: float, greatest: Callable[[list[Any]], Any]
) -> Any:  # noqa: ANN401 - a float, or one a row
    """Return how much higher (m) than it can matter a point is that starts to count at `least`.

    `greatest` is the maximum of a list: of floats for one sample, of arrays for many.
    """
    x, y, z = point
    away = [(x - ax) * nx + (y - ay) * ny for ax, ay, nx, ny in feet.lines]
    return z - least - HIGH * greatest([feet.reach, *away])


def leaning(inclination: Values) -> Values:
    """Return the rocking (rad) charged for a face inclined from the base by so much (rad)."""
    if isinstance(inclination, float):
        return ROCKING * max(inclination - STEEP, 0.0)
    return ROCKING * np.maximum(inclination - STEEP, 0.0)


def radius_of(points: Sequence[Any]) -> Any:  # noqa: ANN401 - a float, or one a row
    """Return the largest horizontal distance (m) of a contact from their mean."""
    x, y = (sum(p[k] for p in points) / len(points) for k in range(2))
    squares = [(p[0] - x) * (p[0] - x) + (p[1] - y) * (p[1] - y) for p in points]
    return largest(squares) ** 0.5


def drops_of(points: Sequence[Any], feet: Feet, radius: Any) -> list[Any]:  # noqa: ANN401
    """Return what each point costs (rad) because a robot on its tracks drops onto it.

    Nothing for points on the base, and without tracks. Floats, or arrays of one a row.
    """
    prices: list[Any] = [0.0] * len(points)
    if not feet.others:
        return prices
    # Flippers below the tracks' plane raise the robot: others then reach the ground earlier.
    raised = largest([0.0, *(feet.plane - points[k][2] for k, _ in feet.others)])
    for k, height in feet.others:
        x, y, z = points[k]
        away = [(x - ax) * nx + (y - ay) * ny for ax, ay, nx, ny in feet.lines]
        reach = -largest([-radius, -largest([NEAR * radius, *away])])
        prices[k] = ROCKING * largest([0.0, z - (height + raised)]) / reach
    return prices


def charged(price: Values) -> Values:
    """Return the rocking (rad) charged for what costs `price` while it is near."""
    if isinstance(price, float):
        return max(price, FAR + DEARER * (price - FAR))
    return np.maximum(price, FAR + DEARER * (price - FAR))
