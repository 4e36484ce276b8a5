"""How much steeper the ground may get until the tracks slide, and if that is before tipping."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ugv_acceptance.type_aliases import Floats


def slide_left(gravity: Sequence[ArrayLike], friction: float) -> Floats:
    """Return how much slope (rad), shape (...), is left until the tracks slide: atan(mu) - slope.

    `gravity` is x, y, z (...) in `base_link`, of a robot on its tracks. `friction` is mu of the
    tracks; infinite means not known, and then so is the result.
    """
    x, y, z = (np.asarray(axis, dtype=np.float64) for axis in gravity)
    slope = np.arctan2(np.hypot(x, y), -z)
    left: Floats = np.full(slope.shape, np.inf)
    return left if friction == np.inf else np.arctan(friction) - slope


def slides_first(gravity: Sequence[ArrayLike], least: ArrayLike, friction: float) -> Floats:
    """Return by how much the robot slides before it would tip, as the value of an alert rule.

    Shape (...): minus the slope (rad) left until the tracks slide where that is less than `least`
    (...), the smallest tilt left (rad); else -inf. So it grows as sliding comes nearer.
    """
    left = slide_left(gravity, friction)
    worse: Floats = np.where(left < np.asarray(least), -left, -np.inf)
    return worse
