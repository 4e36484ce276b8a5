"""Margin rows made by hand, of a robot of two joints."""

from collections.abc import Sequence

import numpy as np

from ugv_acceptance.evaluation.inputs.imu import ImuRows
from ugv_acceptance.evaluation.inputs.joints import JointRows
from ugv_acceptance.evaluation.margin_table import MarginRows, Pairs

S = 1_000_000_000


def rows(
    time: Sequence[float],
    torque: Sequence[float | tuple[float, float]] = (),
    q: Sequence[tuple[float, float]] = (),
    until: Sequence[float] = (),
    known: Sequence[bool] = (),
    gravity: Sequence[tuple[float, float, float]] = (),
) -> MarginRows:
    """Return rows at times (s); torque is of the first joint, or of both.

    The message of the joints comes half a second before the row; messages stand in turned order,
    so that the number of a row is not that of its message. Gravity, if not told, counts the rows
    down.
    """
    n = len(time)
    at = (np.array(time) * S).astype(np.int64)
    ends = (np.array(until or [*time[1:], time[-1] + 1.0] if n else []) * S).astype(np.int64)
    both = [t if isinstance(t, tuple) else (t, 0.0) for t in torque or [0.0] * n]
    position = np.array(q or [(0.0, 0.0)] * n, np.float64).reshape(n, 2)[::-1]
    down = gravity or [(0.0, 0.0, -1.0 - k) for k in range(n)]
    nan, no, order = np.full((n, 2), np.nan), np.zeros(n, np.bool_), np.arange(n, dtype=np.intp)
    pairs = Pairs(
        JointRows((at - S // 2)[::-1], at, position, nan, nan, at, no),
        ImuRows(at, at, np.array(down).reshape(n, 3), no, ~no),
        order[::-1],
        order,
    )
    empty = np.empty((n, 0))
    return MarginRows(
        at, at, ends, np.array(known or [True] * n, np.bool_),
        np.array(both, np.float64).reshape(n, 2), np.ones((n, 4)), np.zeros(n, np.int8),
        empty, empty, np.empty(0), pairs,
    )  # fmt: skip
