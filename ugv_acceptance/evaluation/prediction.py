"""How far it is to a limit: the time at an even rate, the slope until tracks slide."""

from collections.abc import Sequence

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


def slide_left(gravity: Sequence[ArrayLike], friction: float) -> Floats:
    """Return the slope (...) in rad that is left until the tracks slide; infinite where unknown.

    `gravity` is x, y, z (...) in `base_link`, of a robot on its tracks; `friction` that of the
    tracks, infinite: not known.
    """
    x, y, z = (np.asarray(axis, dtype=np.float64) for axis in gravity)
    slope = np.arctan2(np.hypot(x, y), -z)
    left: Floats = np.full(slope.shape, np.inf)
    return left if friction == np.inf else np.arctan(friction) - slope


def slides_first(gravity: Sequence[ArrayLike], least: ArrayLike, friction: float) -> Floats:
    """Return minus the slope (...) left where the tracks slide before the robot tips, else -inf.

    `least` (...) is the smallest tilt left (rad).
    """
    left = slide_left(gravity, friction)
    worse: Floats = np.where(left < np.asarray(least), -left, -np.inf)
    return worse
