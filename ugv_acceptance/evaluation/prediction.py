"""How long it is to a limit at an even rate."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def time_to(limit: ArrayLike, now: ArrayLike, then: ArrayLike, seconds: float) -> Floats:
    """Return after how long (s) a value that is `now` and `then`, `seconds` later, reaches `limit`.

    The value is taken to rise evenly; 0 where it is there already, infinite where it does not rise,
    NaN where it is not known.
    """
    bound, start, end = (np.asarray(x, dtype=np.float64) for x in (limit, now, then))
    with np.errstate(divide='ignore', invalid='ignore', over='ignore'):
        left = (bound - start) * seconds / (end - start)
    left = np.where(start >= bound, 0.0, np.where(end <= start, np.inf, left))
    result: Floats = np.where(np.isnan(start) | np.isnan(end) | np.isnan(bound), np.nan, left)
    return result
