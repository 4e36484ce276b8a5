"""Margins a little ahead: where joints and base will be if they keep their present rates.

Not part of the alert rules: docs/plan_and_run.md says what it gains and what false alerts it costs.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.stability import Margins, margins

Floats = NDArray[np.float64]


def gravity_ahead(gravity: ArrayLike, omega: ArrayLike, seconds: float) -> Floats:
    """Return gravity (..., 3) in `base_link` after turning at `omega` (..., 3) rad/s for `seconds`.

    Exact for a constant rate: gravity turns the other way about the same axis.
    """
    g, w = np.asarray(gravity, dtype=np.float64), np.asarray(omega, dtype=np.float64)
    rate = np.linalg.norm(w, axis=-1, keepdims=True)
    axis = np.divide(w, rate, out=np.zeros_like(w), where=rate > 0.0)
    angle = -rate * seconds
    along = (axis * g).sum(axis=-1, keepdims=True) * axis
    turned: Floats = along + (g - along) * np.cos(angle) + np.cross(axis, g) * np.sin(angle)
    return turned


def margins_ahead(
    robot: Robot,
    q: ArrayLike,
    qd: ArrayLike,
    gravity: ArrayLike,
    omega: ArrayLike,
    seconds: float,
    payload: Payload | None = None,
) -> Margins:
    """Return the static margins in `seconds` if all rates stay: joints (..., j), base (..., 3).

    rad, rad/s, m/s2; a joint without a rate (NaN) is taken to stand still.
    """
    position, rate = np.asarray(q, dtype=np.float64), np.asarray(qd, dtype=np.float64)
    there = position + np.nan_to_num(rate) * seconds
    return margins(robot, there, gravity_ahead(gravity, omega, seconds), payload)


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


def time_to_tip(now: ArrayLike, then: ArrayLike, limit: float, seconds: float) -> Floats:
    """Return the least time (...) in s until a tilt left (..., 4) in rad is down to `limit`."""
    least: Floats = time_to(-limit, -np.asarray(now), -np.asarray(then), seconds).min(axis=-1)
    return least


def time_to_saturation(
    now: ArrayLike, then: ArrayLike, limits: ArrayLike, seconds: float
) -> Floats:
    """Return the time (..., j) in s until a static torque's size is at its limit (j,)."""
    return time_to(limits, np.abs(np.asarray(now)), np.abs(np.asarray(then)), seconds)


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
