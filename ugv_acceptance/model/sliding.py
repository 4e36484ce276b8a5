"""How much steeper the ground may get until the tracks slide, and whether they do so first."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ugv_acceptance.type_aliases import Floats


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
