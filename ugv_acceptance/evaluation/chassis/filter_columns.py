"""filters.py for columns. Filters run only where the chassis may be anything but calm.

What a filter gives is a mean of what it was given in the last second: where nothing of that was
large, neither is its output. That is asked of groups of rows, and only the rest is filtered.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.chassis.filters import (
    BLOCK,
    LONGEST_STEP,
    PUSH,
    RATE,
    SHOCK,
    STAMP_STEP,
    Block,
    Blocks,
)
from ugv_acceptance.evaluation.inputs.low_pass import BELIEVABLE
from ugv_acceptance.model.robot import IDENTITY, Matrix
from ugv_acceptance.type_aliases import Floats, Times

Mask = NDArray[np.bool_]

# Time (ns) after which a filter has forgotten what it was given: 40 time constants.
MEMORY = 1_200_000_000
# Rows of a group, and of a piece of a recursion.
GROUP, PIECE = 32, 12


@dataclass(frozen=True, slots=True)
class RawRows:
    """IMU messages in base axes as rows of columns, led by the `lead` newest of those before.

    `x` (8, n): push (m/s2), x and y of gravity (m/s2), rate (rad/s). `step` (n,) ns since the
    message before, `elapsed` (n,) ns since the filters began, `fresh` (n,) where they did; `total`
    (n,) ns is a time that only rises. `true`, `fast` (n,) are those of Blocks.
    """

    lead: int
    x: Floats
    step: Times
    elapsed: Times
    fresh: Mask
    total: Times
    true: Mask
    fast: Mask

    def newest(self, since: int) -> 'RawRows':
        """Return the rows of the last `since` (ns), as a lead of the next."""
        k = int(np.searchsorted(self.total, self.total[-1] - since)) if len(self.total) else 0
        return RawRows(
            len(self.total) - k,
            self.x[:, k:].copy(),
            self.step[k:].copy(),
            self.elapsed[k:].copy(),
            self.fresh[k:].copy(),
            self.total[k:].copy(),
            self.true[k:].copy(),
            self.fast[k:].copy(),
        )


_NO_TIMES, _NO_MASK = np.zeros(0, np.int64), np.zeros(0, np.bool_)
_NO_ROWS = RawRows(
    0, np.zeros((8, 0)), _NO_TIMES, _NO_TIMES, _NO_MASK, _NO_TIMES, _NO_MASK, _NO_MASK
)


@dataclass(slots=True)
class RawColumns:
    """Turns IMU messages into raw rows, batch by batch."""

    mounting: Matrix
    blocks: Blocks = field(default_factory=Blocks)
    before: RawRows = _NO_ROWS
    _sums: Block = (0.0, 0.0, 0.0, 0)
    _block: int = 0
    _running: bool = False
    _elapsed: int = 0
    _stamp: int = 0
    _time: int = 0

    def take(self, time: Times, stamp: Times, vectors: Floats, gravity: Floats) -> RawRows:
        """Take messages: `vectors` (6, n) rate and force in sensor axes, `gravity` (3, n)."""
        stepped, received = np.diff(stamp, prepend=self._stamp), np.diff(time, prepend=self._time)
        step = np.where((stepped > 0) & (stepped <= STAMP_STEP), stepped, received)
        size = _squares(vectors[3:])
        good = _squares(vectors[:3]) + size + np.abs(gravity[0]) <= BELIEVABLE * BELIEVABLE
        fresh = ~(good & np.concatenate(([self._running], good[:-1])))
        fresh |= (step <= 0) | (step > LONGEST_STEP)
        step[fresh] = 0
        x = np.empty((8, self.before.lead + len(step)))
        self._fill(x[:, self.before.lead :], vectors, gravity, size)
        if not good.all():
            x[:, self.before.lead :][:, ~good] = 0.0
        elapsed = np.cumsum(step)
        if fresh.any():
            began = np.maximum.accumulate(np.where(fresh, np.arange(len(step)), -1))
            elapsed -= np.where(began < 0, -self._elapsed, elapsed[began])
        else:
            elapsed += self._elapsed
        true, fast = self._tell(x[:3, self.before.lead :], elapsed, fresh, good)
        self._running, self._elapsed = bool(good[-1]), int(elapsed[-1])
        self._stamp, self._time = int(stamp[-1]), int(time[-1])
        rows = self._led(x, step, elapsed, fresh, true, fast)
        self.before = rows.newest(MEMORY)
        return rows

    def _fill(self, x: Floats, vectors: Floats, gravity: Floats, size: Floats) -> None:
        """Fill in push, gravity and rate; `size` (n,) is the square of the force."""
        force = vectors[3:]
        if (size > SHOCK * SHOCK).any():
            force = np.where(size > SHOCK * SHOCK, force * (SHOCK / np.sqrt(size)), force)
        if self.mounting is IDENTITY:
            np.add(force, gravity, out=x[:3])
            x[5:] = vectors[:3]
        else:
            np.add(np.array(self.mounting) @ force, gravity, out=x[:3])
            x[5:] = np.array(self.mounting) @ vectors[:3]
        x[3:5] = gravity[:2]

    def _led(
        self, x: Floats, step: Times, elapsed: Times, fresh: Mask, true: Mask, fast: Mask
    ) -> RawRows:
        old = self.before
        start = int(old.total[-1]) if len(old.total) else 0
        x[:, : old.lead] = old.x
        # A new beginning counts as a second: nothing of before may be within MEMORY.
        total = start + np.cumsum(np.where(fresh, 2 * MEMORY, step))
        one = np.concatenate
        return RawRows(
            old.lead,
            x,
            one((old.step, step)),
            one((old.elapsed, elapsed)),
            one((old.fresh, fresh)),
            one((old.total, total)),
            one((old.true, true)),
            one((old.fast, fast)),
        )

    def _tell(self, push: Floats, elapsed: Times, fresh: Mask, good: Mask) -> tuple[Mask, Mask]:
        """Return `true` and `fast` of Blocks at each row."""
        number = elapsed // BLOCK
        first = np.flatnonzero(fresh | (number != np.concatenate(([self._block], number[:-1]))))
        goes_on = not len(first) or first[0] > 0  # with the block before
        starts = np.concatenate(([0], first)) if goes_on else first
        sums = np.add.reduceat(push, starts, axis=1).T.tolist()
        counts = np.diff(starts, append=len(elapsed)).tolist()
        true, fast = np.zeros(len(starts), np.bool_), np.zeros(len(starts), np.bool_)
        usable, begins = good[starts].tolist(), fresh[starts].tolist()
        for k, ((x, y, z), count) in enumerate(zip(sums, counts, strict=True)):
            if begins[k]:
                self.blocks.forget()
                self._sums = (x, y, z, count) if usable[k] else (0.0, 0.0, 0.0, 0)
            elif k or not goes_on:
                self.blocks.add(self._sums)
                self._sums = x, y, z, count
            else:
                sx, sy, sz, before = self._sums
                self._sums = sx + x, sy + y, sz + z, before + count
            true[k], fast[k] = self.blocks.true, self.blocks.fast
        self._block = int(number[-1])
        return np.repeat(true, counts), np.repeat(fast, counts)


@dataclass(frozen=True, slots=True)
class Bound:
    """How large the filters' output can be in each group of rows: as ChassisFilter.step returns."""

    flat: Floats
    up: Floats
    off: Floats


def _squares(v: Floats) -> Floats:
    """Return the square of the length of vectors (3, n)."""
    x, y, z = v
    square: Floats = x * x
    square += y * y
    square += z * z
    return square


def bounds(rows: RawRows, reach: float) -> Bound:
    """Return the bound of each group of GROUP rows, from the raw values of the last second."""
    x, n = rows.x, rows.x.shape[1]
    starts = np.arange(0, n, GROUP)
    push = np.maximum.reduceat(_squares(x[:3]), starts)
    high, low = (
        np.maximum.reduceat(x[5:], starts, axis=1),
        np.minimum.reduceat(x[5:], starts, axis=1),
    )
    since = np.searchsorted(rows.total, rows.total[starts] - MEMORY) // GROUP
    back = int((np.arange(len(starts)) - since).max()) if len(starts) else 0
    push, high, low = (_of_last(v, back) for v in (push, high, -low))
    low = -low
    most = np.maximum(high * high, low * low)
    flat, up = most[0] + most[1], most[2]
    alpha = (high - low).sum(axis=0) / PUSH
    return Bound(flat, up, np.sqrt(push) + reach * (alpha + flat + up))


def _of_last(values: Floats, back: int) -> Floats:
    """Return the largest of the last `back` + 1 values along the last axis."""
    most = values.copy()
    for k in range(1, back + 1):
        np.maximum(most[..., k:], values[..., :-k], out=most[..., k:])
    return most


def stretches(rows: RawRows, wanted: Mask) -> Iterator[tuple[int, int, int]]:
    """Yield stretches that hold all `wanted` rows: first to filter, first and end to use."""
    some = np.flatnonzero(wanted)
    if not len(some):
        return
    warm = np.searchsorted(rows.total, rows.total[some] - MEMORY)
    apart = np.flatnonzero(warm[1:] > some[:-1]) + 1
    for part in np.split(np.arange(len(some)), apart):
        yield int(warm[part[0]]), int(some[part[0]]), int(some[part[-1]]) + 1


def filtered(rows: RawRows, first: int, end: int) -> Floats:
    """Return push filtered twice, rate, that filtered again (3 each), level (2): (11, end - first).

    The filters begin in row `first`.
    """
    part = slice(first, end)
    step = rows.step[part] * 1e-9
    keep = np.empty((2, len(step)))
    keep[0], keep[1] = np.exp(step / -PUSH), np.exp(step / -RATE)
    keep[:, rows.fresh[part]] = 0.0
    keep[:, 0] = 0.0
    x = in_pieces(rows.x[:, part], 0.0)
    f, r = Keep.of(keep[0]), Keep.of(keep[1])
    once = f.run(x[:, :5], np.zeros(5))
    rate = r.run(x[:, 5:], np.zeros(3))
    twice = f.run(np.concatenate((once[:, :3], rate), axis=1), np.zeros(6))
    found = (twice[:, :3], rate, twice[:, 3:], once[:, 3:])
    return in_rows(np.concatenate(found, axis=1), len(step))


def recursion(keep: Floats, x: Floats, before: Floats) -> Floats:
    """Return y[k] = x[k] + keep[k] (y[k - 1] - x[k]) along the last axis, shape (r, n).

    `keep` (n,), `x` (r, n), `before` (r,) is y[-1].
    """
    return in_rows(Keep.of(keep).run(in_pieces(x, 0.0), before), len(keep))


def in_pieces(x: Floats, pad: float) -> Floats:
    """Return `x` (r, n) cut into pieces of PIECE rows that run side by side: (PIECE, r, pieces)."""
    rows, n = x.shape
    count = -(-n // PIECE)
    padded = np.full((rows, count, PIECE), pad)
    padded.reshape(rows, -1)[:, :n] = x
    return padded.transpose(2, 0, 1).copy()


def in_rows(y: Floats, n: int) -> Floats:
    """Return the first `n` rows of pieces in their order: the inverse of `in_pieces`, (r, n)."""
    found: Floats = y.transpose(1, 2, 0).reshape(y.shape[1], -1)[:, :n]
    return found


@dataclass(frozen=True, slots=True)
class Keep:
    """What a filter keeps of its last output at each row, in pieces: (PIECE, 1, pieces).

    `product` is that since the beginning of the piece.
    """

    share: Floats
    product: Floats

    @classmethod
    def of(cls, keep: Floats) -> 'Keep':
        """Return it for shares (n,)."""
        share = in_pieces(keep[None], 1.0)
        return cls(share, np.multiply.accumulate(share, axis=0))

    def run(self, x: Floats, before: Floats) -> Floats:
        """Return the filter's output for `x` (PIECE, r, pieces); `before` (r,) is that before."""
        return self.add(x * (1.0 - self.share), before)

    def add(self, y: Floats, before: Floats) -> Floats:
        """Turn what each row adds into the output, in place, and return it.

        What a piece carries on into the next comes after; it is a recursion over the pieces.
        """
        for k in range(1, PIECE):
            y[k] += self.share[k] * y[k - 1]
        carried = before[:, None]
        if y.shape[2] > 1:
            inner = Keep.of(self.product[-1, 0, :-1])
            ends = inner.add(in_pieces(y[-1, :, :-1], 0.0), before)
            carried = np.concatenate((carried, in_rows(ends, y.shape[2] - 1)), axis=1)
        y += self.product * carried
        return y
