"""Runs a function over large arrays in blocks that fit the processor cache."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import ArrayLike

from ugv_acceptance.model.expressions import Number
from ugv_acceptance.type_aliases import Floats

# Samples per block: more would not fit the cache, fewer would cost more Python calls.
BLOCK = 65536


def in_blocks(
    function: Callable[..., Sequence[Number]],
    width: int,
    *arrays: ArrayLike,
    workers: int = 1,
) -> Floats:
    """Return the `width` outputs of `function` for every sample of `arrays`, shape (..., width).

    The arrays' leading axes broadcast together; their last axes become the arguments, so that
    arrays of shape (..., 2) and (..., 3) call function(a0, a1, b0, b1, b2) with (n,) columns.
    NumPy releases the interpreter inside each operation, so `workers` threads use as many cores.
    """
    parts = [np.asarray(a, dtype=np.float64) for a in arrays]
    shape = np.broadcast_shapes(*(a.shape[:-1] for a in parts))
    columns = [
        np.broadcast_to(a[..., k], shape).reshape(-1) for a in parts for k in range(a.shape[-1])
    ]
    count = int(np.prod(shape, dtype=np.int64))
    out = np.empty((width, count))

    def run(start: int) -> None:
        rows = slice(start, start + BLOCK)
        for line, value in zip(out, function(*(c[rows] for c in columns)), strict=True):
            line[rows] = value

    starts = range(0, count, BLOCK)
    if workers > 1 and len(starts) > 1:
        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(run, starts))
    else:
        for start in starts:
            run(start)
    return np.moveaxis(out.reshape(width, *shape), 0, -1)
