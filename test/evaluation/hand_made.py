"""Margin rows written by hand: two joints, one row a message, numbers that say where they stood."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.imu import ImuRows
from ugv_acceptance.evaluation.joints import JointRows
from ugv_acceptance.evaluation.rows import MarginRows, Pairs


def made(
    time: Sequence[int] | NDArray[np.int64],
    *,
    until: Sequence[int] | None = None,
    known: Sequence[bool] | None = None,
    state: Sequence[int] | None = None,
    **columns: Any,
) -> MarginRows:
    """Return rows at times (ns); `columns` name the other tables (n, k) of rows and messages.

    What is not given is 0 (torque, q, moment, energy, zmp), 1 (angle), unknown (qd, effort), level.
    Messages of the joints stand in turned order, so that a row's number is no message's.
    """
    at, n = np.array(time, np.int64), len(time)

    def table(name: str, width: int, usual: float) -> NDArray[np.float64]:
        given = columns.pop(name, None)
        whole = np.full((n, width), usual) if given is None else np.array(given, np.float64)
        return whole.reshape(n, width)

    q, qd, effort = table('q', 2, 0.0), table('qd', 2, np.nan), table('effort', 2, np.nan)
    gravity = columns.pop('gravity', [(0.0, 0.0, -9.81)] * n)
    order, no = np.arange(n, dtype=np.intp), np.zeros(n, np.bool_)
    pairs = Pairs(
        JointRows(at[::-1], at[::-1], q[::-1], qd[::-1], effort[::-1], at[::-1], no),
        ImuRows(at, at, np.array(gravity, np.float64).reshape(n, 3), no),
        order[::-1],
        order,
    )
    found = MarginRows(
        time=at,
        stamp=at,
        until=np.array([*at[1:], *at[-1:]] if until is None else until, np.int64),
        known=np.array([True] * n if known is None else known, np.bool_),
        torque=table('torque', 2, 0.0),
        angle=table('angle', 4, 1.0),
        state=np.array([0] * n if state is None else state, np.int8),
        moment=table('moment', 4, 0.0),
        energy=table('energy', 4, 0.0),
        zmp=table('zmp', 1, 0.0)[:, 0],
        pairs=pairs,
    )
    assert not columns, f'no such columns: {list(columns)}'
    return found
