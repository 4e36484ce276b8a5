"""Which share of a load each of several points carries in the even spread.

Points have x and y from the plumb point. The even spread is the one of all balanced spreads, none
pulling, that is least as a sum of squares. Which points push at all is tried a few times, and
searched step by step where that does not settle.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.model.expressions import Number, Scalar
from ugv_acceptance.model.hull import drawn_in
from ugv_acceptance.model.kernels import Kernel, compile_kernel
from ugv_acceptance.model.row_selection import ALL, Rows, inner, pick
from ugv_acceptance.type_aliases import Floats

# Tries to find which points push at all by themselves; what is left is searched step by step.
_TRIES = 6
# How far (share) balance may be missed where shares are searched, and steps a point at most.
_SOFT, _STEPS = 1e-11, 6


@lru_cache(maxsize=16)
def _shares_kernel(count: int) -> Kernel:
    """Return the kernel of the least-norm shares of the points that push, not asking for a sign.

    Inputs: x and y of each point, then 1 for each point that pushes, 0 for the others.
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
def even_shares(count: int, flat: tuple[Number, ...]) -> Sequence[Number]:
    """Return the share (of 1) that each of `count` points carries, evenly spread.

    `flat` is x and y of each point from the plumb point, in any unit: numbers or arrays (n,).
    """
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
        done = every(np.equal(a, b) for a, b in zip(after, pushing, strict=True))
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


def every(conditions: Any) -> NDArray[np.bool_]:  # noqa: ANN401 - booleans or arrays of them
    """Return where all conditions hold."""
    found = np.bool_(1)
    for condition in conditions:
        found = found & condition
    return np.asarray(found)


def _shares_once(count: int, flat: tuple[float, ...]) -> Sequence[float]:
    """Return `even_shares` of one sample."""
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
    """Return the even shares (m, n) of points at x, y (m, n), for any plumb point.

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
