"""Tests fast which cells of a grid lie between bounds, if a cell depends on i + j only.

On a grid of equal steps cos(a_i + b_j) has only n + m - 1 values. They are ranked once; each row's
two bounds become ranks too, so that a cell costs one 16-bit subtraction and one comparison. Ranks
keep the order of floats, so the result is the same as comparing the floats.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ugv_acceptance.type_aliases import Floats

Mask = NDArray[np.bool_]

# Rows per block: its 16-bit temporary (a quarter of a megabyte) stays in the cache.
_ROWS = 64


def window_between(table: Floats, lower: Floats, upper: Floats, workers: int = 1) -> Mask:
    """Return whether lower[i] <= table[i + j] <= upper[i], shape (n, m).

    `lower` and `upper` are (n,), `table` is (n + m - 1,).
    """
    n = len(lower)
    m = len(table) - n + 1
    kind = np.uint16 if len(table) < 2**16 else np.uint32
    order = np.sort(table)
    ranks = sliding_window_view(np.searchsorted(order, table).astype(kind), m)
    first = np.searchsorted(order, lower, 'left')
    # Unsigned: a rank below the first wraps round to a large number.
    width = np.maximum(np.searchsorted(order, upper, 'right') - first, 0).astype(kind)[:, None]
    start = first.astype(kind)[:, None]
    out = np.empty((n, m), dtype=np.bool_)

    def run(rows: range) -> None:
        rank = np.empty((_ROWS, m), dtype=kind)
        for k in rows:
            part = slice(k, min(k + _ROWS, n))
            above = rank[: part.stop - k]
            np.subtract(ranks[part], start[part], out=above)
            np.less(above, width[part], out=out[part])

    share = -(-n // (workers * _ROWS)) * _ROWS
    parts = [range(k, min(k + share, n), _ROWS) for k in range(0, n, share)]
    if len(parts) > 1:
        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(run, parts))
    else:
        run(parts[0])
    return out
