"""Margin rows written by hand, two joints, one row a message; and what criteria find in them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts.state_machine import WARN, Alert, Rule
from ugv_acceptance.evaluation.criteria.criteria import CriteriaSet, Criterion, Demand, Window
from ugv_acceptance.evaluation.criteria.findings import Findings
from ugv_acceptance.evaluation.criteria.measurement import CriteriaMeasurement
from ugv_acceptance.evaluation.criteria.uncertainty import Bounds
from ugv_acceptance.evaluation.inputs.imu import ImuRows
from ugv_acceptance.evaluation.inputs.joint_rows import JointRows
from ugv_acceptance.evaluation.margin_table import MarginRows, Pairs
from ugv_acceptance.evaluation.settings import Settings


def made(
    time: Sequence[int] | NDArray[np.int64],
    *,
    until: Sequence[int] | None = None,
    known: Sequence[bool] | None = None,
    state: Sequence[int] | None = None,
    **columns: Any,
) -> MarginRows:
    """Return rows at times (ns); `columns` name the other tables (n, k) of rows and messages.

    What is not given is 0 (torque, q, moment, energy, zmp), 1 (angle, clearance), unknown (qd,
    effort), level.
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
        ImuRows(at, at, np.array(gravity, np.float64).reshape(n, 3), no, ~no),
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
        clearance=table('clearance', 1, 1.0)[:, 0],
        touches=np.array(columns.pop('touches', [False] * n), np.bool_),
    )
    assert not columns, f'no such columns: {list(columns)}'
    return found


S = 1_000_000_000
# Start (ns) of the recordings that `findings` evaluates.
BEGIN = 100 * S


def findings(
    settings: Settings,
    demand: Demand,
    parts: Sequence[MarginRows] = (),
    *,
    end: float = 10.0,
    window: Window | None = None,
    alerts: Sequence[Alert] = (),
    coverage: float = 0.95,
    **other: Any,
) -> tuple[Criterion, Findings]:
    """Return a criterion, and what a recording of `end` seconds from BEGIN on tells of it.

    `other` are `method` and `sources` of bounds, and `data`.
    """
    criterion = Criterion('it', demand, window=window)
    criteria = CriteriaSet(
        'set', 1, (criterion,), '', 'a.yaml', coverage, other.get('method', 'rss')
    )
    finish = BEGIN + round(end * S)
    measurement = CriteriaMeasurement(criteria, settings, BEGIN, finish)
    for part in parts:
        measurement.add(part)
    measurement.finish(finish)
    bounds = Bounds(settings, tuple(other.get('sources', ())))
    return criterion, Findings(measurement, alerts, other.get('data', {}), bounds)


def seconds(*times: float) -> list[int]:
    """Return times (s) after BEGIN in ns."""
    return [BEGIN + round(t * S) for t in times]


def alert(
    code: str, subject: str, start: float, end: float | None, level: int = WARN, peak: float = 1.0
) -> Alert:
    """Return an alert from `start` to `end` (s after BEGIN; None: still active)."""
    rule = Rule(code, subject, level, 0.5, 0.5, 0, 0)
    (at,), ends = seconds(start), None if end is None else seconds(end)[0]
    return Alert(rule, at, peak, ends)
