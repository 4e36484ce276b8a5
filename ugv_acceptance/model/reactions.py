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
from numpy.typing import NDArray

from ugv_acceptance.model.expressions import Number, Scalar
from ugv_acceptance.model.hull import drawn_in
from ugv_acceptance.model.kernels import Kernel, compile_kernel
from ugv_acceptance.model.mechanics import Mechanics, Posture, Triple
from ugv_acceptance.model.row_selection import ALL, Rows, inner, pick
from ugv_acceptance.model.statics import torque_of
from ugv_acceptance.type_aliases import Floats

# Tries to find which points push at all by themselves; what is left is searched step by step.
_TRIES = 6
# Three points whose triangle is thinner than this share of its size do not settle their loads.
_THIN = 1e-10
# How far (share) balance may be missed where shares are searched, and steps a point at most.
_SOFT, _STEPS = 1e-11, 6
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
    shares = _even_shares(len(points), flat)
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


@lru_cache(maxsize=16)
def _shares_kernel(count: int) -> Kernel:
    """Return the kernel of the least-norm shares of the points that push, not asking for a sign.

    Inputs: x and y of each point as `_seen`, then 1 for each point that pushes, 0 for the others.
    A share is an affine function of the place (the points that push settle it); that of a point
    that does not push says whether it would have to pull: then leaving it out was right.
    """

    def formula(*inputs: Scalar) -> list[Scalar]:
        places = [(inputs[2 * k], inputs[2 * k + 1]) for k in range(count)]
        s = inputs[2 * count :]
        n = _total(s)
        x, y = (_total([p[a] * w for p, w in zip(places, s, strict=True)]) for a in range(2))
        xx, xy, yy = (
            _total([p[a] * p[b] * w for p, w in zip(places, s, strict=True)])
            for a, b in ((0, 0), (0, 1), (1, 1))
        )
        one, along, across = xx * yy - xy * xy, xy * y - x * yy, x * xy - xx * y
        scale = 1.0 / (n * one + x * along + y * across)
        return [(one + along * px + across * py) * scale for px, py in places]

    names = [f'x{k}' for k in range(2 * count)] + [f's{k}' for k in range(count)]
    return compile_kernel(formula, names)


def _total(values: Sequence[Scalar]) -> Scalar:
    found: Scalar = 0.0
    for value in values:
        found = found + value
    return found


@np.errstate(divide='ignore', invalid='ignore', over='ignore')
def _even_shares(count: int, flat: tuple[Number, ...]) -> Sequence[Number]:
    """Return the share (of 1) that each of `count` points carries, evenly spread."""
    if not any(isinstance(x, np.ndarray) for x in flat):
        floats: Any = flat
        return _shares_once(count, floats)
    rows = np.broadcast_shapes(*(np.shape(x) for x in flat))
    found, settled = _settled_shares(count, flat, rows)
    settled &= _balanced(found, flat)
    left = np.flatnonzero(~settled)
    some = np.array([np.broadcast_to(x, rows)[left] for x in flat])
    known = np.isfinite(some).all(axis=0)
    left, some = left[known], some[:, known]
    if left.size:
        for column, share in zip(found, _searched_shares(some[::2].T, some[1::2].T).T, strict=True):
            column[left] = share
    return found


def _settled_shares(
    count: int, flat: tuple[Number, ...], shape: tuple[int, ...]
) -> tuple[list[Floats], NDArray[np.bool_]]:
    """Return the shares after _TRIES at most, and of which samples the points that push settled.

    Samples that settled are not tried again: the same points would give the same shares.
    """
    found, settled = np.empty((count, *shape)), np.zeros(shape, np.bool_)
    run, some, pushing = _shares_kernel(count).run, flat, (1.0,) * count
    left: Rows = ALL
    for _ in range(_TRIES):
        shares = run(*some, *pushing)
        after = tuple([(share > 0.0) * 1.0 for share in shares])
        for line, push, share in zip(found, after, shares, strict=True):
            line[left] = push * share
        done = _all(np.equal(a, b) for a, b in zip(after, pushing, strict=True))
        settled[left] = done
        if done.all():
            break
        again = np.flatnonzero(~np.broadcast_to(done, shape))
        left = inner(left, again)
        some, pushing = pick(some, again), pick(after, again)
        shape = again.shape
    return list(found), settled


def _balanced(shares: Sequence[Any], flat: Sequence[Any]) -> Any:  # noqa: ANN401 - both
    """Return whether shares carry the plumb point: two points settle nothing, but by rounding."""
    x, y = (sum(s * p for s, p in zip(shares, flat[a::2], strict=True)) for a in range(2))
    size = sum(abs(p) for p in flat)
    return (abs(x) + abs(y) <= 1e-9 * size) & (abs(sum(shares) - 1.0) <= 1e-9)


def _all(conditions: Any) -> NDArray[np.bool_]:  # noqa: ANN401 - booleans or arrays of them
    found = np.bool_(1)
    for condition in conditions:
        found = found & condition
    return np.asarray(found)


def _shares_once(count: int, flat: tuple[float, ...]) -> Sequence[float]:
    """Return `_even_shares` of one sample."""
    pushing, run = (1.0,) * count, _shares_kernel(count).one
    for _ in range(_TRIES):
        shares = run(*flat, *pushing)
        after = tuple([1.0 if share > 0.0 else 0.0 for share in shares])
        if after == pushing:
            found = [a * s for a, s in zip(after, shares, strict=True)]
            if _balanced(found, flat):
                return found
            break
        pushing = after
    x, y = np.array(flat[::2]), np.array(flat[1::2])
    searched: list[float] = _searched_shares(x[None], y[None])[0].tolist()
    return searched


def _searched_shares(x: Floats, y: Floats) -> Floats:
    """Return the even shares (m, n) of points at x, y (m, n) as `_seen`, for any plumb point.

    Follows them while the plumb point moves from the points' middle, where all carry the same, to
    its place: on the way one point after the other stops pushing (or pushes again), and in between
    the shares change evenly. A plumb point outside counts as where that way leaves the points.
    """
    middle = np.stack((x.mean(axis=1), y.mean(axis=1)))
    x, y = x - middle[0][:, None], y - middle[1][:, None]
    size = np.sqrt((x * x + y * y).sum(axis=1))
    size = np.where(size > 0.0, size, 1.0)
    x, y, way = x / size[:, None], y / size[:, None], -middle / size
    border = np.stack(drawn_in(list(zip(x.T, y.T, strict=True)), tuple(way)))
    way = np.where(np.hypot(*border) < np.hypot(*way), border, way)
    rows, count = np.arange(len(x)), x.shape[1]
    pushing = np.ones(x.shape, np.bool_)
    shares, at = np.full(x.shape, 1.0 / count), np.zeros(len(x))
    going, last = np.ones(len(x), np.bool_), np.full(len(x), -1)
    for _ in range(_STEPS * count):
        start, slope = _lines(x, y, way, pushing)
        with np.errstate(divide='ignore', invalid='ignore'):
            turn = np.where(pushing == (slope < 0.0), -start / slope, np.inf)
        turn = np.where((turn >= at[:, None] - _SOFT) & (slope != 0.0), turn, np.inf)
        turn[rows, last] = np.where(last >= 0, np.inf, turn[rows, last])
        first = turn.argmin(axis=1)
        then = np.minimum(turn[rows, first], 1.0)
        now = np.where(pushing, np.maximum(start + slope * then[:, None], 0.0), 0.0)
        shares = np.where(going[:, None], now, shares)
        at, last = np.where(going, then, at), np.where(going, first, last)
        going &= then < 1.0
        if not going.any():
            break
        pushing[rows[going], first[going]] ^= True
    found: Floats = shares / shares.sum(axis=1, keepdims=True)
    return found


def _lines(x: Floats, y: Floats, way: Floats, pushing: NDArray[np.bool_]) -> tuple[Floats, Floats]:
    """Return the shares (m, n) as start + slope * part of the way, given which points push.

    As in `_shares_kernel`, but balance is as soft as _SOFT, so that two points settle theirs too.
    """
    s = pushing * 1.0
    n, sx, sy = s.sum(axis=1) + _SOFT, (s * x).sum(axis=1), (s * y).sum(axis=1)
    xx, xy, yy = ((s * a * b).sum(axis=1) for a, b in ((x, x), (x, y), (y, y)))
    xx, yy = xx + _SOFT, yy + _SOFT
    c00, c01, c02 = xx * yy - xy * xy, xy * sy - sx * yy, sx * xy - xx * sy
    c11, c12, c22 = n * yy - sy * sy, sx * sy - n * xy, n * xx - sx * sx
    scale = 1.0 / (n * c00 + sx * c01 + sy * c02)[:, None]
    one, along, across = (a * way[0] + b * way[1] for a, b in ((c01, c02), (c11, c12), (c12, c22)))
    start = (c00[:, None] + c01[:, None] * x + c02[:, None] * y) * scale
    slope = (one[:, None] + along[:, None] * x + across[:, None] * y) * scale
    return start, slope


def _ends(
    mechanics: Mechanics, posture: Posture, points: tuple[int, ...], gravity: Triple
) -> Callable[[int], tuple[Floats, Floats]]:
    """Return a function of a joint: the most and the least torque the loads may take off it.

    Loads that balance are a mixture of such on three points, and torque is linear in them.
    """
    flat = _seen(posture, points, gravity)
    shares = _even_shares(len(points), flat)
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
            good = _all(load >= _NONE for load in loads) & (abs(area) > _THIN * size)
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
