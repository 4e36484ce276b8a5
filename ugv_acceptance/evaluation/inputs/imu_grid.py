"""IMU messages on a grid of 0.1 s: running integrals on which checks in motion are judged.

A sample counts for the local mean of the intervals: messages that arrive in bursts then weigh as
much as those that arrive evenly. Any mean over a window is the difference of two rows of the grid.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from operator import add, sub

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.inputs.imu_cell import (
    A2,
    FORCE_JUMPS,
    GOOD,
    KNOWN,
    LARGEST,
    OK,
    ORIENTED,
    OWN,
    PAIRS,
    SHOCK,
    SHOCKED,
    SHOCKS,
    SUMS,
    TAU,
    TURN,
    TURN_JUMPS,
    UNTURNED,
    W2,
    WIDTH,
    WORLD,
    A,
    Q,
    W,
    grown,
    grown_once,
    in_the_world,
    jump_columns,
    jumps,
)
from ugv_acceptance.type_aliases import Floats, Times

# Step of the grid (ns), and rows from one judgement (hop) to the next.
GRID = 100_000_000
HOP = 10
# A longer interval (ns) between messages starts the grid anew.
LONGEST = 600_000_000
# Rows kept at least: the longest window, 10 s, and one more hop.
KEPT = 120
# Rows over which rotations are compared (0.5 s).
SPAN = 5
# Columns of a row after the sums: sums of products of rotations, of the gyro with itself, of the
# orientation with itself, of both, and the number; then orientation and time (s) of the row.
GYRO_2, OWN_2, BOTH, COMPARED, PRODUCTS, QUATERNION, TIME = (
    26,
    27,
    28,
    29,
    slice(26, 30),
    slice(30, 34),
    34,
)

Row = Sequence[float]
# What a cell adds where the kernel says nothing of it.
NOTHING = (0.0,) * (SUMS - OWN.stop)


@dataclass(slots=True)
class ImuGrid:
    """The last `rows` of the grid with the columns above: lists of numbers live, else an array.

    `first` is the number of the first of them, counted from the grid's start; `g` is gravity
    (m/s2).
    """

    g: float
    first: int = 0
    rows: list[Row] | Floats = field(default_factory=lambda: list[Row](([0.0] * 33 + [1.0, 0.0],)))
    _edges: list[tuple[int, int]] = field(default_factory=lambda: [(0, 0)] * 3)

    @property
    def row(self) -> int:
        """The number of the newest row."""
        return self.first + len(self.rows) - 1

    def over(self, end: int, rows: int) -> list[float]:
        """Return the sums over the window of so many rows that ends at the row number `end`.

        Its length (s) stands in the column TIME.
        """
        if isinstance(self.rows, np.ndarray):
            at = end - self.first
            found: list[float] = (self.rows[at] - self.rows[at - rows]).tolist()
            return found
        return list(map(sub, self.line(end), self.line(end - rows)))

    def windows(self, ends: Sequence[int], rows: int) -> list[list[float]]:
        """Return `over` of many windows of so many rows."""
        if isinstance(self.rows, np.ndarray):
            at = np.asarray(ends, np.intp) - self.first
            found: list[list[float]] = (self.rows[at] - self.rows[at - rows]).tolist()
            return found
        return [self.over(end, rows) for end in ends]

    def line(self, row: int) -> Row:
        """Return the row of that number."""
        found = self.rows[row - self.first]
        return found.tolist() if isinstance(found, np.ndarray) else found

    def table(self, end: int, rows: int) -> Floats:
        """Return the last so many rows before the row number `end`, and that one (rows + 1, n)."""
        at = end - self.first
        return np.array(self.rows[at - rows : at + 1])

    def trim(self) -> None:
        """Forget the rows that no window needs."""
        extra = len(self.rows) - KEPT
        if extra > KEPT:
            self.rows = self.rows[extra:]
            self.first += extra

    def close(self, x: Row, after: Row) -> None:
        """Take the samples of one cell, flat (n * WIDTH), and the one that begins the next."""
        n = len(x) // WIDTH
        weight = self._weight(int(after[TAU]), n)
        good = sum(x[GOOD::WIDTH])
        known = n == good == sum(x[OK::WIDTH]) and after[OK]
        before, end = (x[Q], after[Q]) if known else (UNTURNED, UNTURNED)
        sums = [sum(x[k::WIDTH]) for k in (7, 8, 9, A2, 4, 5, 6, W2)]
        out = grown_once(weight, (good or 1.0, *sums), before, end)
        out += NOTHING
        if good:
            out[ORIENTED], out[KNOWN] = out[0], 1.0
        if not known:
            _forget(out)
        if not good:
            out[0] = out[8] = 0.0
        limit = (self.g + SHOCK) ** 2
        if known and max(x[A2::WIDTH]) > limit:
            hard = [x[k : k + WIDTH] for k in range(0, len(x), WIDTH) if x[k + A2] > limit]
            force = [weight * sum(row[k] for row in hard) for k in (7, 8, 9)]
            out[SHOCKS], out[SHOCKED] = in_the_world(force, before, end), weight * len(hard)
        for k in range(0, min(n - 1, 2) * WIDTH, WIDTH):
            force_jumps, turn_jumps = jumps(x[k : k + 10], x[k + WIDTH : k + WIDTH + 10])
            out[PAIRS] += 1.0
            out[FORCE_JUMPS] += force_jumps
            out[TURN_JUMPS] += turn_jumps
        if isinstance(self.rows, np.ndarray):
            self.rows = list(self.rows.tolist())
        rows = self.rows
        _append(rows, list(map(add, rows[-1], out)), int(after[TAU]) // GRID - self.row, after)

    def _weight(self, tau: int, n: int) -> float:
        """Return the seconds for which a sample of a new cell stands: the mean of three cells."""
        time, number = self._edges[0]
        end = tau, self._edges[2][1] + n
        self._edges = [*self._edges[1:], end]
        return (end[0] - time) * 1e-9 / (end[1] - number)

    def extend(self, x: Floats) -> None:
        """Take samples (WIDTH, n) from that of the last row on; the last of them begins a row."""
        tau = x[TAU].astype(np.int64)
        at = tau // GRID
        ends = np.flatnonzero(at[1:] != at[:-1]) + 1
        edges = np.concatenate(([0], ends))
        added = _added(x, edges, self._weights(tau, ends), self.g)
        old = np.array(self.rows[-KEPT:])
        added[0] += old[-1, :SUMS]
        new = np.empty((len(ends), TIME + 1))
        np.add.accumulate(added, axis=0, out=new[:, :SUMS])
        new[:, QUATERNION], new[:, TIME] = x[Q, ends].T, tau[ends] * 1e-9
        steps = np.diff(at[edges])
        if len(new) != steps.sum():
            new = np.repeat(new, steps, axis=0)
        rows = np.concatenate((old, new))
        _compare(rows, len(old))
        self.first = self.row + len(new) + 1 - len(rows)
        self.rows = rows

    def _weights(self, tau: Times, ends: NDArray[np.intp]) -> Floats:
        old = np.array(self._edges).T
        time = np.concatenate((old[0], tau[ends]))
        number = np.concatenate((old[1], ends + old[1, 2]))
        self._edges = list(zip(time[-3:].tolist(), number[-3:].tolist(), strict=True))
        weights: Floats = (time[3:] - time[:-3]) * 1e-9 / (number[3:] - number[:-3])
        return weights


def _append(rows: list[Row], sums: list[float], count: int, after: Row) -> None:
    """Append so many rows with these sums; `after` is the sample that begins the last of them."""
    tail = (*after[Q], after[TAU] * 1e-9)
    for _ in range(count):
        products = rows[-1][PRODUCTS]
        if len(rows) >= SPAN and sums[KNOWN] - rows[-SPAN][KNOWN] == SPAN:
            x, y, z = map(sub, sums[TURN], rows[-SPAN][TURN])
            a, b, c = map(sub, sums[OWN], rows[-SPAN][OWN])
            found = x * x + y * y + z * z, a * a + b * b + c * c, x * a + y * b + z * c, 1.0
            products = list(map(add, products, found))
        rows.append((*sums, *products, *tail))


def _compare(rows: Floats, old: int) -> None:
    """Set the sums of products in the rows from number `old` on: the counterpart of `_append`."""
    start = max(old, SPAN)
    rows[old:start, PRODUCTS] = rows[old - 1, PRODUCTS]
    if start >= len(rows):
        return
    d = rows[start:] - rows[start - SPAN : len(rows) - SPAN]
    known = d[:, KNOWN] == SPAN
    turn, own = d[:, TURN], d[:, OWN]
    products = np.empty((len(d) + 1, 4))
    products[0] = rows[start - 1, PRODUCTS]
    pairs = (turn, turn), (own, own), (turn, own)
    for k, (one, other) in enumerate(pairs):
        products[1:, k] = np.einsum('ij,ij->i', one, other) * known
    products[1:, 3] = known
    rows[start:, PRODUCTS] = np.add.accumulate(products, axis=0)[1:]


def _forget(out: list[float]) -> None:
    """Set to 0 what needs an orientation."""
    out[WORLD] = out[OWN] = (0.0, 0.0, 0.0)
    out[ORIENTED] = out[KNOWN] = 0.0


def _added(x: Floats, edges: NDArray[np.intp], weight: Floats, g: float) -> Floats:
    """Return what each cell adds to the sums (m, SUMS): the counterpart of `ImuGrid.close`."""
    starts, ends = edges[:-1], edges[1:]
    cells = x[:, : edges[-1]]
    count = ends - starts
    *rate, ax, ay, az, told, w2, a2, good = np.add.reduceat(cells[W.start : TAU], starts, axis=1)
    known = (good == count) & (told == count) & (x[OK, ends] != 0.0)
    none = np.array(UNTURNED)[:, None]
    before, after = (list(np.where(known, x[Q, at], none)) for at in (starts, ends))
    out = np.zeros((len(starts), SUMS))
    sums = (np.maximum(good, 1.0), ax, ay, az, a2, *rate, w2)
    columns = grown(weight, sums, before, after)
    for k, column in enumerate(columns):
        out[:, k] = column
    out[:, ORIENTED], out[:, KNOWN] = out[:, 0], 1.0
    empty = good == 0.0
    out[empty, 0] = out[empty, 8] = 0.0
    for part in (WORLD, OWN, ORIENTED, KNOWN):
        out[~known, part] = 0.0
    shock = cells[A2] > (g + SHOCK) ** 2
    if shock.any():
        force = np.add.reduceat(cells[A] * shock, starts, axis=1) * weight
        turned = np.stack(in_the_world(list(force), before, after), axis=1)
        out[:, SHOCKS] = np.where(known[:, None], turned, 0.0)
        out[:, SHOCKED] = np.add.reduceat(shock, starts, dtype=np.float64) * weight * known
    for k in range(2):
        some = np.flatnonzero(count > k + 1)
        pair = jump_columns(x[:OK, starts[some] + k], x[:OK, starts[some] + k + 1])
        out[some, PAIRS] += 1.0
        out[some, FORCE_JUMPS] += pair[0]
        out[some, TURN_JUMPS] += pair[1]
    return out


def samples(q: Floats, w: Floats, a: Floats, told: NDArray[np.bool_]) -> Floats:
    """Return samples (WIDTH, n) of orientation (4, n), rate, acceleration (3, n) and OK (n,).

    What cannot be summed is 0, and not GOOD. The time is left for the caller.
    """
    table = np.empty((WIDTH, len(told)))
    table[Q], table[W], table[A], table[OK] = q, w, a, told
    table[W2], table[A2] = (np.einsum('ji,ji->i', v, v) for v in (w, a))
    good = (table[W2] < LARGEST) & (table[A2] < LARGEST)
    table[GOOD] = good
    if not good.all():
        for part in (W, A, W2, A2):
            table[part, ~good] = 0.0
    return table
