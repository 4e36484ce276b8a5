"""On which contact points a robot can stand: its footings.

On rigid ground a robot rests on a face of the lower convex hull of its contact points. Nobody knows
contacts to a millimetre, and on the real ground a robot rocks until further points touch as well.
So the points near a face carry with it, at the price of the rocking that takes: a margin then moves
as little as the contacts do. A robot that stands on its tracks and drops onto flippers in the air
has tipped: these too have a price. Which footing counts is decided by gravity (stability.py).

A polygon is a cycle of contact numbers, counter-clockwise as seen from above.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce
from itertools import chain, combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.model.expressions import (
    Number,
    Scalar,
    Vec,
    copysign,
    cross,
    dot,
    scale,
    sqrt,
    subtract,
)
from ugv_acceptance.model.hull import THIN, Cycle, Point, hull, hulls, pairs
from ugv_acceptance.model.kernels import Kernel, compile_kernel
from ugv_acceptance.model.mechanics import Mechanics
from ugv_acceptance.model.row_selection import ALL, Rows, Values, groups, pick
from ugv_acceptance.model.tree import in_body
from ugv_acceptance.type_aliases import Floats

__all__ = [
    'ALL',
    'MOST',
    'Cycle',
    'Footing',
    'Point',
    'Rows',
    'flat_polygon',
    'footings_of',
    'many_footings',
    'pairs',
]

# Rocking (rad) charged for a point that is as far from the plane as the contacts are from their
# middle; for a point that drops by its distance from the tracks; for each radian of a face's
# inclination beyond STEEP (rad): nothing stands on its side.
ROCKING = 10.0
STEEP = math.radians(30.0)
# Beyond this rocking (rad) each radian counts as DEARER: what is so far off the ground is no foot.
FAR = math.radians(25.0)
DEARER = 1.6
# As shares of the contacts' radius: the least distance from the tracks that counts for a drop, and
# how high above the tracks' ground plane a point of the base is one of the tracks.
NEAR = 0.25
BAND = 0.0625
# With as much rocking (rad) as this no margin is left: no edge is ever further than this.
MOST = 0.5 * math.pi
# A point this far (m) below a plane is still on it.
_LEVEL = 1e-9


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
    """

    tracks: Cycle
    plane: float
    others: tuple[tuple[int, float], ...]
    lines: tuple[tuple[float, float, float, float], ...]
    ground: float
    tolerance: float


@lru_cache(maxsize=64)
def feet_of(mechanics: Mechanics) -> Feet:
    """Return the Feet of a robot."""
    robot, frames = mechanics.robot, mechanics.tree.frames
    none = Feet((), robot.ground, (), (), robot.ground, robot.contact_tolerance)
    base = {
        k: _plain(in_body(mechanics.tree, contact.link, contact.position)[1])
        for k, contact in enumerate(robot.contacts)
        if frames[contact.link][0] == 0
    }
    if len(base) < 3:
        return none
    plane = max(robot.ground, sorted(z for _, _, z in base.values())[2])
    band = BAND * _radius(list(base.values()))
    tracks = tuple(k for k, (_, _, z) in base.items() if z <= plane + band)
    polygon = hull(tuple(base[k] for k in tracks), tracks)
    if not polygon:
        return none
    others = [(k, plane + band) for k in base if k not in tracks]
    others += [(k, plane) for k in range(len(robot.contacts)) if k not in base]
    lines = tuple(_line(base[i], base[j]) for i, j in pairs(polygon))
    return Feet(tracks, plane, tuple(others), lines, robot.ground, robot.contact_tolerance)


def _line(start: Point, end: Point) -> tuple[float, float, float, float]:
    x, y = end[0] - start[0], end[1] - start[1]
    length = math.hypot(x, y)
    return (start[0], start[1], y / length, -x / length)


def _plain(point: Vec) -> Point:
    x, y, z = (float(c) for c in point)  # type: ignore[arg-type]  # numbers in, numbers out
    return (x, y, z)


def flat_polygon(mechanics: Mechanics, points: Sequence[Point]) -> Cycle:
    """Return the polygon of a robot that stands flat on its tracks, whatever gravity is.

    () if it is raised, or points near the ground might carry it as well: gravity then decides.
    """
    footings = footings_of(mechanics, points)
    if len(footings) != 1 or footings[0].raised or footings[0].rocking != 0.0:
        return ()
    return footings[0].polygon


# Of one sample: a set of points as bits, its rocking (rad) and its face.
_Found = tuple[int, float, tuple[int, int, int]]


def footings_of(mechanics: Mechanics, points: Sequence[Point]) -> tuple[Footing, ...]:
    """Return the footings of one sample that can matter, the least rocking first.

    From its contact points (m, `base_link`); () where they are fewer than three, or in one line.
    """
    return _footings(tuple(map(tuple, points)), feet_of(mechanics))


@lru_cache(maxsize=1024)
def _footings(points: tuple[Point, ...], feet: Feet) -> tuple[Footing, ...]:
    if len(points) < 3:
        return ()
    found: dict[Cycle, Footing] = {}
    sets = sorted(_sets(points, feet), key=lambda one: (one[1], one[0]))
    for bits, rocking, face in sets:
        if rocking >= MOST and rocking > sets[0][1]:
            break
        near = _numbers(bits, len(points))
        polygon = hull(tuple([points[k] for k in near]), near)
        if polygon and polygon not in found:
            raised = min([points[k][2] for k in near]) < feet.ground - feet.tolerance
            found[polygon] = Footing(near, face, polygon, rocking, raised)
    return tuple(found.values())


def _sets(points: Sequence[Point], feet: Feet) -> Iterator[_Found]:
    """Yield the sets of points on and near each face of the lower hull of one sample."""
    radius = max(_radius(points), THIN)
    charge, drops = ROCKING / radius, _drops(points, feet, radius)
    for face, others in _faces(len(points)):
        at = [x for k in (*face, *others) for x in points[k]]
        area, upright, *heights = _face_kernel(len(others)).one(*at)
        if area <= THIN**2 or min(heights, default=0.0) < -_LEVEL:
            continue
        lean = _lean(math.acos(min(upright, 1.0)))
        price, bits, height = max([drops[k] for k in face]), _bits(face), 0.0
        order = sorted(zip(heights, others, strict=True))
        for place in range(len(order) + 1):
            if place:
                height, k = order[place - 1]
                bits, price = bits | 1 << k, max(price, charge * height, drops[k])
            if place == len(order) or order[place][0] - max(height, 0.0) >= _LEVEL:
                yield bits, _charged(price) + lean, face


def _lean(inclination: Values) -> Values:
    """Return the rocking (rad) charged for a face inclined from the base by so much (rad)."""
    if isinstance(inclination, float):
        return ROCKING * max(inclination - STEEP, 0.0)
    return ROCKING * np.maximum(inclination - STEEP, 0.0)


def _radius(points: Sequence[Any]) -> Any:  # noqa: ANN401 - a float, or one a row
    """Return the largest horizontal distance (m) of a contact from their mean."""
    x, y = (sum(p[k] for p in points) / len(points) for k in range(2))
    squares = [(p[0] - x) * (p[0] - x) + (p[1] - y) * (p[1] - y) for p in points]
    return _largest(squares) ** 0.5


def _drops(points: Sequence[Any], feet: Feet, radius: Any) -> list[Any]:  # noqa: ANN401
    """Return what each point costs (rad) because a robot on its tracks drops onto it.

    Nothing for points on the base, and without tracks. Floats, or arrays of one a row.
    """
    prices: list[Any] = [0.0] * len(points)
    if not feet.others:
        return prices
    # Flippers below the tracks' plane raise the robot: others then reach the ground earlier.
    raised = _largest([0.0, *(feet.ground - points[k][2] for k, _ in feet.others)])
    for k, height in feet.others:
        x, y, z = points[k]
        away = [(x - ax) * nx + (y - ay) * ny for ax, ay, nx, ny in feet.lines]
        reach = -_largest([-radius, -_largest([NEAR * radius, *away])])
        prices[k] = ROCKING * _largest([0.0, z - (height + raised)]) / reach
    return prices


def _charged(price: Values) -> Values:
    """Return the rocking (rad) charged for what costs `price` while it is near."""
    if isinstance(price, float):
        return max(price, FAR + DEARER * (price - FAR))
    return np.maximum(price, FAR + DEARER * (price - FAR))


def _largest(values: Sequence[Any]) -> Any:  # noqa: ANN401 - a float, or one a row
    if all(isinstance(x, float) for x in values):
        return max(values)
    return reduce(np.maximum, values)


@lru_cache(maxsize=16)
def _faces(count: int) -> tuple[tuple[tuple[int, int, int], Cycle], ...]:
    """Return all triples of `count` points, each with the points that are not of it."""
    whole = range(count)
    return tuple((f, tuple(k for k in whole if k not in f)) for f in combinations(whole, 3))


@lru_cache(maxsize=16)
def _face_kernel(others: int) -> Kernel:
    """Return the kernel of the plane of three points and the heights of `others` above it.

    It takes the coordinates (m) of the three and of the others, and returns twice the triangle's
    area (m2), the cosine of the plane's inclination, and each height (m), square to the plane.
    """

    def formula(*inputs: Scalar) -> list[Scalar]:
        a, *rest = [(inputs[k], inputs[k + 1], inputs[k + 2]) for k in range(0, 9 + 3 * others, 3)]
        from_a: list[Vec] = [subtract(p, a) for p in rest]
        normal = cross(from_a[0], from_a[1])
        area = sqrt(dot(normal, normal))
        up = scale(normal, copysign(1.0, normal[2]) / (area + 1e-300))  # never divided by 0
        return [area, up[2], *(dot(p, up) for p in from_a[2:])]

    return compile_kernel(formula, [f'x{k}' for k in range(9 + 3 * others)])


def _bits(numbers: Sequence[int]) -> int:
    return sum(1 << k for k in numbers)


def _numbers(bits: int, count: int) -> Cycle:
    return tuple([k for k in range(count) if bits >> k & 1])


def many_footings(
    mechanics: Mechanics, contacts: Sequence[Any], count: int
) -> list[tuple[Rows, Footing]]:
    """Return the footings of `count` samples, each with the rows that have it.

    Each coordinate (m) is a float or an array (count,) of finite numbers. A row has several
    footings where points are near a face. Least rocking first.
    """
    points, feet = tuple(map(tuple, contacts)), feet_of(mechanics)
    if not any(isinstance(x, np.ndarray) for x in chain.from_iterable(points)):
        return [(ALL, footing) for footing in _footings(points, feet)]
    if len(points) < 3:
        return []
    row, bits, rocking, face = _table(points, feet, count)
    parts = []
    for code, at, _ in groups(bits * len(_faces(len(points))) + face):
        number, of = divmod(code, len(_faces(len(points))))
        near = _numbers(number, len(points))
        some, price = row[at], rocking[at]
        for cycle, part in hulls(pick(points, some), near, len(some)):
            if cycle:
                parts.append((some[part], price[part], near, of, cycle))
    return list(_cheapest(feet, points, parts, count))


def _table(points: Sequence[Any], feet: Feet, count: int) -> tuple[NDArray[Any], ...]:
    """Return row, set of points (as bits), rocking (rad) and face of all footings of many rows.

    The columns are ordered by set and row; of several faces with one set the cheapest counts.
    """
    columns: list[tuple[NDArray[Any], ...]] = []
    radius = np.maximum(_radius(points), THIN)
    charge = np.broadcast_to(ROCKING / radius, count)
    drops = [np.broadcast_to(price, count) for price in _drops(points, feet, radius)]
    for number, (face, others) in enumerate(_faces(len(points))):
        found = _near_face(points, (face, others), (charge, drops), count)
        columns += [(*some, np.full(len(some[0]), number)) for some in found]
    if not columns:
        none = np.empty(0, np.intp)
        return none, none, np.empty(0), none
    row, bits, rocking, of = (np.concatenate(parts) for parts in zip(*columns, strict=True))
    least = np.full(count, np.inf)
    np.minimum.at(least, row, rocking)
    matters = np.flatnonzero(rocking <= np.maximum(least, np.nextafter(MOST, 0.0))[row])
    order = matters[np.lexsort((of[matters], rocking[matters], row[matters], bits[matters]))]
    row, bits, rocking, of = (column[order] for column in (row, bits, rocking, of))
    first = np.ones(len(row), np.bool_)
    first[1:] = (row[1:] != row[:-1]) | (bits[1:] != bits[:-1])
    return row[first], bits[first], rocking[first], of[first]


def _near_face(
    points: Sequence[Any],
    of: tuple[tuple[int, int, int], Cycle],
    measures: tuple[Floats, Sequence[Floats]],
    count: int,
) -> list[tuple[NDArray[Any], NDArray[Any], Floats]]:
    """Return row, set of points and rocking of the sets near one triple, where it is a face."""
    face, others = of
    kernel = _face_kernel(len(others))
    area, upright, *heights = kernel.run(*(x for k in (*face, *others) for x in points[k]))
    lowest = reduce(np.minimum, heights, np.inf)
    rows = np.flatnonzero(np.broadcast_to((area > THIN**2) & (lowest >= -_LEVEL), count))
    if not len(rows):
        return []
    charge, drops = measures[0][rows], np.array(measures[1])[:, rows]
    lean = _lean(np.arccos(np.minimum(np.broadcast_to(upright, count)[rows], 1.0)))
    price = drops[list(face)].max(axis=0)
    table = np.array([np.broadcast_to(h, count)[rows] for h in heights]).reshape(-1, len(rows))
    order = np.argsort(table, axis=0, kind='stable')
    table = np.take_along_axis(table, order, 0)
    bits, height, found = np.full(len(rows), _bits(face)), np.zeros(len(rows)), []
    numbers = np.array([1 << k for k in others], dtype=np.int64)
    for place in range(len(others) + 1):
        if place:
            k, height = order[place - 1], table[place - 1]
            bits, drop = bits | numbers[k], drops[np.array(others)[k], np.arange(len(rows))]
            price = np.maximum(np.maximum(price, charge * height), drop)
        some: Rows = ALL
        if place < len(others):
            some = np.flatnonzero(table[place] - np.maximum(height, 0.0) >= _LEVEL)
        found.append((rows[some], bits[some], (_charged(price) + lean)[some]))
    return found


def _cheapest(
    feet: Feet, points: Values, parts: Sequence[tuple[Any, ...]], count: int
) -> Iterator[tuple[Rows, Footing]]:
    """Yield the footings of parts (rows, rocking, points, face, polygon): a polygon once a row."""
    floor = feet.ground - feet.tolerance
    least: dict[Cycle, Floats] = {}
    for rows, price, _, _, cycle in parts:
        best = least.setdefault(cycle, np.full(count, np.inf))
        best[rows] = np.minimum(best[rows], price)
    for found, prices, near, of, cycle in sorted(parts, key=lambda part: float(part[1].min())):
        best = least[cycle]
        kept = np.flatnonzero(prices == best[found])
        rows, price = found[kept], prices[kept]
        best[rows] = -1.0  # taken
        lowest = reduce(np.minimum, [points[k][2] for k in near])
        raised = (np.broadcast_to(lowest, count)[rows] < floor).astype(np.int8)
        for below, part, size in groups(raised):
            rocking = price[part] if price[part].any() else 0.0
            face = _faces(len(points))[of][0]
            yield (
                ALL if size == count else rows[part],
                Footing(near, face, cycle, rocking, bool(below)),
            )
