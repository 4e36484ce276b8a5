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
from dataclasses import replace
from functools import lru_cache, reduce
from itertools import chain, combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.model.expressions import (
    Scalar,
    Vec,
    copysign,
    cross,
    dot,
    scale,
    sqrt,
    subtract,
)
from ugv_acceptance.model.feet import (
    LEVEL,
    MOST,
    ROCKING,
    Feet,
    Footing,
    charged,
    drops_of,
    feet_of,
    height_over,
    leaning,
    radius_of,
)
from ugv_acceptance.model.hull import THIN, Cycle, Point, hull, hulls, largest, pairs
from ugv_acceptance.model.kernels import Kernel, compile_kernel
from ugv_acceptance.model.mechanics import Mechanics
from ugv_acceptance.model.row_selection import ALL, Rows, Values, groups, pick
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


def flat_polygon(mechanics: Mechanics, points: Sequence[Point]) -> Cycle:
    """Return the polygon of a robot that stands flat on its tracks, whatever gravity is.

    () if it is raised, or points near the ground might carry it as well: gravity then decides.
    """
    footings = footings_of(mechanics, points)
    if len(footings) != 1 or footings[0].raised or footings[0].rocking != 0.0:
        return ()
    return footings[0].polygon


# Prices (rad) that differ by less are the same.
_SAME = 1e-9
# Of one sample: a set of points as bits, its rocking (rad) and its face.
_Found = tuple[int, float, tuple[int, int, int]]


def footings_of(
    mechanics: Mechanics, points: Sequence[Point], *, moved: bool = False
) -> tuple[Footing, ...]:
    """Return the footings of one sample that can matter, the least rocking first.

    From its contact points (m, `base_link`); () where they are fewer than three, or in one line.
    `moved`: those of the base are not just where the robot has them.
    """
    feet = feet_of(mechanics)
    if (
        feet.alone
        and not moved
        and (
            min([points[k][2] - z for k, z in feet.others]) > feet.sure
            or min([height_over(points[k], feet, z, max) for k, z in feet.others]) > 0.0
        )
    ):
        return feet.alone
    return _footings(tuple(map(tuple, points)), feet)


@lru_cache(maxsize=1024)
def _footings(points: tuple[Point, ...], feet: Feet) -> tuple[Footing, ...]:
    if len(points) < 3:
        return ()
    found: dict[Cycle, Footing] = {}
    least: dict[int, tuple[float, tuple[int, int, int]]] = {}
    for bits, rocking, face in _sets(points, feet):
        if bits not in least or rocking < least[bits][0]:
            least[bits] = rocking, face
    sets = sorted((rocking, bits, face) for bits, (rocking, face) in least.items())
    for rocking, bits, face in sets:
        if rocking >= MOST and rocking > sets[0][0]:
            break
        if any(bits & more == bits != more and price <= rocking + _SAME for price, more, _ in sets):
            continue  # more points carry for no more
        near = _numbers(bits, len(points))
        polygon = hull(tuple([points[k] for k in near]), near)
        if polygon and polygon not in found:
            raised = min([points[k][2] for k in near]) < feet.ground - feet.tolerance
            found[polygon] = Footing(near, face, polygon, rocking, raised)
    return tuple(found.values())


def _sets(points: Sequence[Point], feet: Feet) -> Iterator[_Found]:
    """Yield the sets of points on and near each face of the lower hull of one sample."""
    radius = max(radius_of(points), THIN)
    charge, drops = ROCKING / radius, drops_of(points, feet, radius)
    planes: list[int] = []
    for (face, others), (area, upright, *heights) in zip(
        _faces(len(points)), _planes(points, feet), strict=True
    ):
        if area <= THIN**2 or min(heights, default=0.0) < -LEVEL:
            continue
        bits = _bits(face)
        if any(bits & plane == bits for plane in planes):
            continue  # the plane of another face: the same sets
        lean = leaning(math.acos(min(upright, 1.0)))
        price, height = max([drops[k] for k in face]), 0.0
        costs = [max(charge * h, drops[k]) for h, k in zip(heights, others, strict=True)]
        order = sorted(zip(costs, heights, others, strict=True))
        for place in range(len(order) + 1):
            if place:
                cost, h, k = order[place - 1]
                bits, price, height = bits | 1 << k, max(price, cost), max(height, h)
            if place == len(order) or order[place][0] - price >= _SAME:
                if height < LEVEL:
                    planes.append(bits)
                yield bits, charged(price) + lean, face


@lru_cache(maxsize=16)
def _faces(count: int) -> tuple[tuple[tuple[int, int, int], Cycle], ...]:
    """Return all triples of `count` points, each with the points that are not of it."""
    whole = range(count)
    return tuple((f, tuple(k for k in whole if k not in f)) for f in combinations(whole, 3))


def _plane(points: Sequence[Vec]) -> list[Scalar]:
    """Return what there is to know of the plane of the first three of some points.

    Twice the triangle's area (m2), the cosine of its inclination, and the height (m) of each
    further point above it, square to the plane.
    """
    a, *rest = points
    from_a: list[Vec] = [subtract(p, a) for p in rest]
    normal = cross(from_a[0], from_a[1])
    area = sqrt(dot(normal, normal))
    up = scale(normal, copysign(1.0, normal[2]) / (area + 1e-300))  # never divided by 0
    return [area, up[2], *(dot(p, up) for p in from_a[2:])]


@lru_cache(maxsize=16)
def _face_kernel(others: int) -> Kernel:
    """Return the kernel of `_plane` of three points and `others`; inputs: their coordinates."""

    def formula(*inputs: Scalar) -> list[Scalar]:
        return _plane([inputs[k : k + 3] for k in range(0, 9 + 3 * others, 3)])  # type: ignore[misc]

    return compile_kernel(formula, [f'x{k}' for k in range(9 + 3 * others)])


@lru_cache(maxsize=16)
def _planes_kernel(count: int) -> Kernel:
    """Return the kernel of `_plane` of all `_faces` of `count` points."""

    def formula(*inputs: Scalar) -> list[list[Scalar]]:
        points: Any = [inputs[k : k + 3] for k in range(0, 3 * count, 3)]
        return [_plane([points[k] for k in (*f, *others)]) for f, others in _faces(count)]

    return compile_kernel(formula, [f'x{k}' for k in range(3 * count)])


def _planes(points: Sequence[Point], feet: Feet) -> Sequence[Sequence[Any]]:
    """Return `_plane` of all `_faces`; compiled where the points will be others next time."""
    count = len(points)
    if feet.moves:
        return _planes_kernel(count).one(*chain.from_iterable(points))
    return [_plane([points[k] for k in (*f, *others)]) for f, others in _faces(count)]


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
    if feet.alone:
        heights = [height_over(points[k], feet, z, largest) for k, z in feet.others]
        low = np.flatnonzero(np.broadcast_to(reduce(np.minimum, heights), count) <= 0.0)
        if not len(low):
            return [(ALL, feet.alone[0])]
        if len(low) < count:
            high = np.delete(np.arange(count), low)
            some = _of_each(feet, pick(points, low), len(low))
            return [(high, feet.alone[0]), *((low[rows], footing) for rows, footing in some)]
    return _of_each(feet, points, count)


# Rows of which at least so many are like others are looked at once each.
_ALIKE = 0.1


def _of_each(feet: Feet, points: Sequence[Any], count: int) -> list[tuple[Rows, Footing]]:
    """Return the footings of all rows; those in which no point lies elsewhere are looked at once.

    Feet stand still most of the time while the arm moves.
    """
    moving = [x for x in chain.from_iterable(points) if isinstance(x, np.ndarray)]
    _, first, which = np.unique(moving[0], return_index=True, return_inverse=True)
    alike = len(first) <= (1.0 - _ALIKE) * count
    if not alike or not all(np.array_equal(x, x[first][which]) for x in moving[1:]):
        return _many(feet, points, count)
    found: list[tuple[Rows, Footing]] = []
    for rows, footing in _many(feet, pick(points, first), len(first)):
        if isinstance(rows, slice):
            found.append((ALL, replace(footing, rocking=pick(footing.rocking, which))))
            continue
        place = np.full(len(first), -1)
        place[rows] = np.arange(len(rows))
        at = place[which]
        some = np.flatnonzero(at >= 0)
        found.append((some, replace(footing, rocking=pick(footing.rocking, at[some]))))
    return found


def _many(feet: Feet, points: Sequence[Any], count: int) -> list[tuple[Rows, Footing]]:
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
    radius = np.maximum(radius_of(points), THIN)
    charge = np.broadcast_to(ROCKING / radius, count)
    drops = np.empty((len(points), count))
    for line, price in zip(drops, drops_of(points, feet, radius), strict=True):
        line[:] = price
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
    kept = np.ones(len(row), np.bool_)
    kept[1:] = (row[1:] != row[:-1]) | (bits[1:] != bits[:-1])
    row, bits, rocking, of = (column[kept] for column in (row, bits, rocking, of))
    kept = _undominated(row, bits, rocking, count)
    return row[kept], bits[kept], rocking[kept], of[kept]


def _undominated(
    row: NDArray[Any], bits: NDArray[Any], rocking: Floats, count: int
) -> NDArray[np.bool_]:
    """Return which sets are not part of a larger one of the same row that costs no more."""
    kept = np.ones(len(row), np.bool_)
    places = {code: at for code, at, _ in groups(bits)}
    for more, at in places.items():
        price = np.full(count, np.inf)
        price[row[at]] = rocking[at]
        for code, some in places.items():
            if code & more == code != more:
                kept[some] &= price[row[some]] > rocking[some] + _SAME
    return kept


def _near_face(
    points: Sequence[Any],
    of: tuple[tuple[int, int, int], Cycle],
    measures: tuple[Floats, Floats],
    count: int,
) -> list[tuple[NDArray[Any], NDArray[Any], Floats]]:
    """Return row, set of points and rocking of the sets near one triple, where it is a face."""
    face, others = of
    kernel = _face_kernel(len(others))
    area, upright, *heights = kernel.run(*(x for k in (*face, *others) for x in points[k]))
    lowest = reduce(np.minimum, heights, np.inf)
    rows = np.flatnonzero(np.broadcast_to((area > THIN**2) & (lowest >= -LEVEL), count))
    if not len(rows):
        return []
    charge, drops = measures[0][rows], measures[1].take(rows, axis=1)
    lean = leaning(np.arccos(np.minimum(pick(upright, rows), 1.0)))
    price = reduce(np.maximum, [drops[k] for k in face])
    table = np.empty((len(others), len(rows)))
    for line, height, k in zip(table, heights, others, strict=True):
        np.maximum(charge * pick(height, rows), drops[k], out=line)
    order = np.argsort(table, axis=0, kind='stable')
    table = np.take_along_axis(table, order, 0)
    bits, found = np.full(len(rows), _bits(face)), []
    numbers = np.array([1 << k for k in others], dtype=np.int64)
    for place in range(len(others) + 1):
        if place:
            bits = bits | numbers[order[place - 1]]
            price = np.maximum(price, table[place - 1])
        some: Rows = ALL
        if place < len(others):
            some = np.flatnonzero(table[place] - price >= _SAME)
        found.append((rows[some], bits[some], (charged(price) + lean)[some]))
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
