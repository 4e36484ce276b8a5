"""Torques of joints between the base and the ground: gravity less what the ground pushes back.

At rest on contact points each pushes back against gravity, so a point that carries w kg of the
robot loads the joints above it like a point mass of -w kg. Balance of forces and moments gives the
loads only of three points. Of more, two things are known: the *even spread*, the loads that are
least as a sum of squares, none pulling; and the *interval*, the torques of all loads that balance,
whose ends lie at three points around the plumb point each. Friction between the points, which can
brace them against each other, comes on top.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from typing import Any

import numpy as np

from ugv_acceptance.model.expressions import Number, Scalar
from ugv_acceptance.model.kernels import Kernel, compile_kernel
from ugv_acceptance.model.load_shares import even_shares, every
from ugv_acceptance.model.mechanics import Mechanics, Posture, Triple
from ugv_acceptance.model.row_selection import Rows, pick
from ugv_acceptance.model.statics import torque_of
from ugv_acceptance.type_aliases import Floats

# Three points whose triangle is thinner than this share of its size do not settle their loads.
_THIN = 1e-10
# A load counts as none pulling from here on (share of the robot's weight): rounding.
_NONE = -1e-9


@dataclass(frozen=True, slots=True)
class Reactions:
    """Torques (j,) of a robot at rest on given points (N m; N where prismatic), floats or arrays.

    `hanging` with all points in the air, `even` with the even spread of loads, `least` and `most`
    the ends of the interval; all are the same for joints that are not `carrying` (their numbers).
    """

    carrying: tuple[int, ...]
    hanging: tuple[Number, ...]
    even: tuple[Number, ...]
    least: tuple[Number, ...]
    most: tuple[Number, ...]


@lru_cache(maxsize=256)
def carrying_joints(mechanics: Mechanics, points: tuple[int, ...]) -> tuple[int, ...]:
    """Return the numbers of the joints that carry one of these contact points."""
    return tuple(sorted({joint for joint, point in mechanics.carried if point in points}))


@lru_cache(maxsize=256)
def _felt(mechanics: Mechanics, points: tuple[int, ...]) -> tuple[tuple[int, int, int], ...]:
    """Return (joint, place in `points`, place in Posture.loads) of each load a joint feels."""
    return tuple(
        (joint, points.index(point), k)
        for k, (joint, point) in enumerate(mechanics.carried)
        if point in points
    )


def standing_torque(
    mechanics: Mechanics,
    posture: Posture,
    points: tuple[int, ...],
    gravity: Triple,
    hanging: tuple[Number, ...],
) -> tuple[Number, ...]:
    """Return `hanging` (j,) with the ground's reaction at contact numbers `points`, spread evenly.

    N m (N); floats, or arrays of samples that stand on the same points. `hanging` itself if no
    joint carries any of them, which costs one look into a table. A robot past its tipping point
    stands on the edge that it tips over; where gravity does not press on the points (upside down),
    nothing is added.
    """
    felt = _felt(mechanics, points)
    if not felt:
        return hanging
    pressed = gravity[2] < 0.0
    if pressed is False:
        return hanging
    found = list(hanging)
    with np.errstate(over='ignore', invalid='ignore'):
        loads = _loads(posture, points, gravity)
        for joint, place, k in felt:
            found[joint] = found[joint] - loads[place] * _along(posture.loads[k], gravity)
    if isinstance(pressed, bool):
        return tuple(found)
    if pressed.all():
        return tuple(found)
    known = zip(found, hanging, strict=True)
    return tuple([new if new is old else np.where(pressed, new, old) for new, old in known])


def reactions_of(
    mechanics: Mechanics, posture: Posture, points: tuple[int, ...], gravity: Triple
) -> Reactions:
    """Return all that is known of the torques of a robot that stands on these contact numbers.

    Arguments as of `standing_torque`.
    """
    hanging = torque_of(posture, gravity)
    even = standing_torque(mechanics, posture, points, gravity, hanging)
    joints = carrying_joints(mechanics, points) if even is not hanging else ()
    least, most = list(even), list(even)
    if joints:
        ends = _ends(mechanics, posture, points, gravity)
        pressed = np.asarray(gravity[2]) < 0.0
        for joint in joints:
            low, high = (np.where(pressed, hanging[joint] - x, even[joint]) for x in ends(joint))
            # Rounding may not put the even spread outside.
            least[joint] = _plain(np.fmin(low, even[joint]))
            most[joint] = _plain(np.fmax(high, even[joint]))
    return Reactions(joints, hanging, even, tuple(least), tuple(most))


def loads_of(posture: Posture, points: tuple[int, ...], gravity: Triple) -> tuple[Number, ...]:
    """Return how many kg of the robot each of the contact numbers `points` carries, evenly spread.

    Floats, or arrays of samples.
    """
    return tuple(_loads(posture, points, gravity))


def _plain(value: Floats) -> Number:
    return value if value.ndim else float(value)


def _along(gradient: Triple, gravity: Triple) -> Number:
    (x, y, z), (gx, gy, gz) = gradient, gravity
    return x * gx + y * gy + z * gz


def _loads(posture: Posture, points: tuple[int, ...], gravity: Triple) -> list[Number]:
    flat = _seen(posture, points, gravity)
    shares = even_shares(len(points), flat)
    return [share * posture.mass for share in shares]


def _seen(posture: Posture, points: tuple[int, ...], gravity: Triple) -> tuple[Number, ...]:
    """Return x and y of each point as seen along gravity, from the plumb point (in m, times g).

    Any two directions across gravity do; these need no division.
    """
    contacts = [x for k in points for x in posture.contacts[k]]
    return _seen_kernel(len(points)).run(*contacts, *posture.cog, *gravity)


@lru_cache(maxsize=16)
def _seen_kernel(count: int) -> Kernel:
    """Return the kernel of `_seen`; inputs: so many points, centre of gravity, gravity."""

    def formula(*inputs: Scalar) -> list[Scalar]:
        *flat, cx, cy, cz, gx, gy, gz = inputs
        found = []
        for k in range(count):
            x, y, z = flat[3 * k : 3 * k + 3]
            height = z - cz
            found += [(x - cx) * gz - height * gx, (y - cy) * gz - height * gy]
        return found

    names = [f'{axis}{k}' for k in range(count + 2) for axis in 'xyz']
    return compile_kernel(formula, names)


def _ends(
    mechanics: Mechanics, posture: Posture, points: tuple[int, ...], gravity: Triple
) -> Callable[[int], tuple[Floats, Floats]]:
    """Return a function of a joint: the most and the least torque the loads may take off it.

    Loads that balance are a mixture of such on three points, and torque is linear in them.
    """
    flat = _seen(posture, points, gravity)
    shares = even_shares(len(points), flat)
    # Past its tipping point the robot stands on an edge: what is balanced there.
    place = [sum(s * p for s, p in zip(shares, flat[a::2], strict=True)) for a in range(2)]
    at = [(np.asarray(x - place[0]), np.asarray(y - place[1])) for x, y in _pairs(flat)]
    weights = []
    for three in combinations(range(len(points)), 3):
        (ax, ay), (bx, by), (cx, cy) = (at[k] for k in three)
        parts = (bx * cy - cx * by, cx * ay - ax * cy, ax * by - bx * ay)
        area = parts[0] + parts[1] + parts[2]
        size = _squares(bx - ax, by - ay) + _squares(cx - ax, cy - ay)
        with np.errstate(divide='ignore', invalid='ignore'):
            loads = [part / area for part in parts]
            good = every(load >= _NONE for load in loads) & (abs(area) > _THIN * size)
        weights.append((three, loads, good))
    felt: dict[int, dict[int, Number]] = {}
    for joint, point, k in _felt(mechanics, points):
        felt.setdefault(joint, {})[point] = _along(posture.loads[k], gravity) * posture.mass

    def ends(joint: int) -> tuple[Floats, Floats]:
        of = felt[joint]
        most: Any = -np.inf
        least: Any = np.inf
        for three, loads, good in weights:
            taken = sum(x * of.get(k, 0.0) for k, x in zip(three, loads, strict=True))
            most = np.fmax(most, np.where(good, taken, -np.inf))
            least = np.fmin(least, np.where(good, taken, np.inf))
        return np.asarray(most), np.asarray(least)

    return ends


def _pairs(flat: Sequence[Number]) -> Sequence[tuple[Number, Number]]:
    return list(zip(flat[::2], flat[1::2], strict=True))


def _squares(x: Floats, y: Floats) -> Floats:
    return x * x + y * y


def carry(
    table: Floats,
    place: Rows,
    posture: Posture,
    rows: Rows,
    mechanics: Mechanics,
    points: tuple[int, ...],
    gravity: Triple,
) -> set[int]:
    """Add the ground's reaction to hanging torques, as `standing_torque`; return who carries.

    `table[j, place]` are the torques (N m; N) of m samples that stand on the same `points`, under
    `gravity` (arrays (m,)); `rows` are their rows of the posture.
    """
    joints = carrying_joints(mechanics, points)
    if not joints:
        return set()
    fields = (posture.mass, posture.cog, posture.contacts, posture.loads)
    one = Posture((), *pick(fields, rows))
    count = len(mechanics.robot.joint_names)
    hanging = tuple([table[j, place] if j in joints else math.nan for j in range(count)])
    standing = standing_torque(mechanics, one, points, gravity, hanging)
    for joint in joints:
        table[joint, place] = standing[joint]
    return set(joints)
