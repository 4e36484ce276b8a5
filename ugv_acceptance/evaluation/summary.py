"""Summary of a recording: worst margins, time in violation, coverage, alerts and their rate."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts.messages import advice, describe
from ugv_acceptance.evaluation.alerts.state_machine import LEVELS, Alert
from ugv_acceptance.evaluation.criteria.criteria import LONGEST_UNSEEN
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.evaluation.spans import UnseenStretches
from ugv_acceptance.model.stability import SIDES, STATES

# The window (ns) in which alerts are counted.
WINDOW = 600 * 1_000_000_000
# One in ten minutes is manageable; a flood begins above ten and ends below five in ten minutes.
MANAGEABLE, FLOOD_BEGINS, FLOOD_ENDS = 1.0, 10, 5


@dataclass(frozen=True, slots=True)
class AlarmRates:
    """Alerts raised in a run: their number, ten-minute average, and most in any ten minutes.

    After ISA-18.2 and EEMUA 191. A run shorter than ten minutes counts as ten. `floods` are
    (begin, end) in ns.
    """

    raised: int
    average: float
    peak: int
    floods: tuple[tuple[int, int], ...]

    @property
    def manageable(self) -> bool:
        """Whether an operator can handle the rate: at most one in ten minutes and no flood."""
        return self.average <= MANAGEABLE and not self.floods


def alarm_rates(starts: Sequence[int], start: int, duration: int) -> AlarmRates:
    """Return the rates of alerts raised at `starts` in a run from `start` of `duration`, all ns."""
    # Each alert enters the window when it is raised and leaves it a window later, leaving first.
    steps = sorted([*((t + WINDOW, -1) for t in starts), *((t, 1) for t in starts)])
    inside, peak, begin, end = 0, 0, None, start + duration
    floods: list[tuple[int, int]] = []
    for time, step in steps:
        inside += step
        peak = max(peak, inside)
        if begin is None and inside > FLOOD_BEGINS:
            begin = time
        elif begin is not None and inside < FLOOD_ENDS:
            floods.append((begin, min(time, end)))
            begin = None
    average = len(starts) * WINDOW / max(duration, WINDOW)
    return AlarmRates(len(starts), average, peak, tuple(floods))


def rates_result(starts: Sequence[int], start: int, duration: int) -> dict[str, Any]:
    """Return the rates for JSON; times in seconds since `start`."""
    rates = alarm_rates(starts, start, duration)
    return {
        'raised': rates.raised,
        'per_10_min': rates.average,
        'peak_in_10_min': rates.peak,
        'floods_s': [[(a - start) / 1e9, (b - start) / 1e9] for a, b in rates.floods],
        'manageable': rates.manageable,
    }


@dataclass(frozen=True, slots=True)
class AlertRecord:
    """An alert of a run for users: level WARN, ERROR or STALE; times in s since the run began.

    `end_s` is None if it was active to the end. `peak` is the worst value in the unit of the alert
    (degrees, N m, ...), None if it has none, and `worst_s` when that came. `message` says what
    happened, `advice` what to do.
    """

    code: str
    subject: str
    level: str
    start_s: float
    end_s: float | None
    peak: float | None
    worst_s: float | None
    message: str
    advice: str


@dataclass(slots=True)
class Extreme:
    """The largest value seen, and when (ns)."""

    value: float = -np.inf
    time: int = 0

    def see(self, values: NDArray[np.float64], times: NDArray[np.int64]) -> None:
        """Take many values (n,), NaN if unknown, with their times (n,) in ns."""
        if (values > self.value).any():
            k = int(np.nanargmax(values))
            self.value, self.time = float(values[k]), int(times[k])


@dataclass(slots=True)
class Summary:
    """Sums up the margins of a recording part by part; times and sums of time in ns.

    `load` holds the largest |torque| of each joint (N m; N), `tip` the largest of minus the tilt
    left (rad) to each of SIDES, `*_violation` the time beyond the ERROR limit, `states` the number
    of messages in each stability state, `unseen` the stretches without margins since `start`.
    `lowest` is the largest of minus the arm's clearance (m).
    """

    settings: Settings
    start: int = 0
    evaluated: int = 0
    messages: int = 0
    load: list[Extreme] = field(init=False)
    load_violation: list[int] = field(init=False)
    tip: list[Extreme] = field(init=False)
    tip_violation: int = 0
    states: dict[str, int] = field(default_factory=dict)
    unseen: UnseenStretches = field(init=False)
    lowest: Extreme = field(default_factory=Extreme)
    _open: tuple[int, int, list[bool], bool] | None = None

    def __post_init__(self) -> None:
        n = len(self.settings.robot.joint_names)
        self.load, self.load_violation = [Extreme() for _ in range(n)], [0] * n
        self.tip = [Extreme() for _ in SIDES]
        self.unseen = UnseenStretches(self.start, round(LONGEST_UNSEEN * 1e9))

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording."""
        if not len(rows.time):
            return
        self._close(int(rows.time[0]))
        self.unseen.add(rows)
        known = rows.known
        limits = self.settings.limits
        load = np.abs(rows.torque.T)
        over = load >= limits.torque_error * np.array(limits.torque)[:, None]
        tipping = np.asarray((rows.angle <= limits.tip_error).any(axis=1))
        held = np.where(known, rows.until - rows.time, 0)
        held[-1] = 0
        self.messages += len(known)
        self.evaluated += int(held.sum())
        self.tip_violation += int((held * tipping).sum())
        for j, extreme in enumerate(self.load):
            extreme.see(load[j], rows.time)
            if over[j].any():
                self.load_violation[j] += int((held * over[j]).sum())
        for side, extreme in enumerate(self.tip):
            extreme.see(-rows.angle[:, side], rows.time)
        if len(rows.clearance):
            self.lowest.see(-rows.clearance, rows.time)
        counts = np.bincount(rows.state[known], minlength=len(STATES))
        for name, count in zip(STATES, counts.tolist(), strict=True):
            if count:
                self.states[name] = self.states.get(name, 0) + count
        if known[-1]:
            last = int(rows.time[-1]), int(rows.until[-1])
            self._open = (*last, over[:, -1].tolist(), bool(tipping[-1]))

    def finish(self, now: int) -> None:
        """Finish at the end of the recording, `now` (ns)."""
        self._close(now)
        self.unseen.finish(now)

    def _close(self, now: int) -> None:
        """Count the last row's time, now that the next message or the end (`now`, ns) is known."""
        if self._open is None:
            return
        time, until, over, tipping = self._open
        held = max(0, min(now, until) - time)
        self.evaluated += held
        self.tip_violation += held if tipping else 0
        self.load_violation = [
            total + (held if bad else 0)
            for total, bad in zip(self.load_violation, over, strict=True)
        ]
        self._open = None


def result_of(
    summary: Summary,
    alerts: Sequence[Alert],
    start: int,
    duration: int,
    told: Mapping[int, str] | None = None,
) -> dict[str, Any]:
    """Return the part of a result that follows from margins and alerts, ready for JSON.

    `told` is the computed advice by an alert's `id`; other alerts get the general advice.
    """
    settings = summary.settings
    seconds = duration / 1e9
    return {
        'coverage': {
            'evaluated_s': summary.evaluated / 1e9,
            'duration_s': seconds,
            'fraction': summary.evaluated / duration if duration > 0 else 0.0,
            'messages_judged': summary.messages,
            **_unseen_result(summary, start),
        },
        'torque': {
            name: _torque_result(summary, j, start)
            for j, name in enumerate(settings.robot.joint_names)
            if np.isfinite(settings.limits.torque[j])
        },
        'stability': _stability_result(summary, start),
        'clearance': _clearance_result(summary, start),
        'alerts': [
            alert_result(alert, settings, start, (told or {}).get(id(alert)))
            for alert in ordered(alerts)
        ],
        'alarm_rates': rates_result([alert.start for alert in alerts], start, duration),
    }


def _unseen_result(summary: Summary, start: int) -> dict[str, Any]:
    spans = summary.unseen.spans
    return {
        'longest_unseen_s': summary.unseen.longest / 1e9,
        'unseen_stretches': spans.count,
        'unseen_total_s': spans.total / 1e9,
        'unseen_s': [[(a - start) / 1e9, (b - start) / 1e9] for a, b in spans.first],
    }


def ordered(alerts: Sequence[Alert]) -> list[Alert]:
    """Return alerts sorted by start, code, subject and level, so that their order is unique."""
    return sorted(alerts, key=lambda a: (a.start, a.rule.code, a.rule.subject, a.rule.level))


def alert_result(
    alert: Alert, settings: Settings, start: int, told: str | None = None
) -> dict[str, Any]:
    """Return one alert for JSON; times in seconds since `start` (ns); `told` is computed advice."""
    rule = alert.rule
    return {
        'code': rule.code,
        'subject': rule.subject,
        'level': LEVELS[rule.level],
        'start_s': (alert.start - start) / 1e9,
        'end_s': None if alert.end is None else (alert.end - start) / 1e9,
        'peak': _peak(alert),
        'worst_s': _worst_s(alert, start),
        'message': describe(alert, settings, start),
        'advice': told or advice(rule.code, settings.robot),
        'advice_computed': told is not None,
    }


def alert_record(
    alert: Alert, settings: Settings, start: int, told: str | None = None
) -> AlertRecord:
    """Return one alert as a record; arguments as for `alert_result`."""
    values = alert_result(alert, settings, start, told)
    return AlertRecord(**{f.name: values[f.name] for f in fields(AlertRecord)})


def _peak(alert: Alert) -> float | None:
    if alert.rule.code == 'TIP_OVER':
        return float(np.degrees(-alert.peak))
    if alert.rule.code == 'ARM_ON_GROUND':
        return -float(alert.peak)
    return float(alert.peak) if np.isfinite(alert.peak) else None


def _worst_s(alert: Alert, start: int) -> float | None:
    """Return when the worst value came, in s since `start` (ns); None without value or time."""
    if alert.worst_at is None or _peak(alert) is None:
        return None
    return (alert.worst_at - start) / 1e9


def _torque_result(summary: Summary, j: int, start: int) -> dict[str, Any]:
    name = summary.settings.robot.joint_names[j]
    worst, limit = summary.load[j], summary.settings.limits.torque[j]
    seen = np.isfinite(worst.value)
    return {
        'limit': limit,
        'unit': summary.settings.robot.joint(name).units.effort,
        'max_abs': worst.value if seen else None,
        'min_margin': limit - worst.value if seen else None,
        'time_of_min_s': (worst.time - start) / 1e9 if seen else None,
        'time_in_violation_s': summary.load_violation[j] / 1e9,
    }


def _stability_result(summary: Summary, start: int) -> dict[str, Any]:
    edges = {
        side: {
            'min_angle_deg': float(np.degrees(-worst.value)),
            'time_of_min_s': (worst.time - start) / 1e9,
        }
        for side, worst in zip(SIDES, summary.tip, strict=True)
        if np.isfinite(worst.value)
    }
    edge = min(edges, key=lambda side: edges[side]['min_angle_deg'], default=None)
    return {
        'min_angle_deg': edges[edge]['min_angle_deg'] if edge else None,
        'edge': edge,
        'time_of_min_s': edges[edge]['time_of_min_s'] if edge else None,
        'time_in_violation_s': summary.tip_violation / 1e9,
        'edges': edges,
        'states': summary.states,
    }


def _clearance_result(summary: Summary, start: int) -> dict[str, Any]:
    lowest = summary.lowest
    seen = bool(np.isfinite(lowest.value))
    return {
        'min_m': -lowest.value if seen else None,
        'time_of_min_s': (lowest.time - start) / 1e9 if seen else None,
        'may_touch_s': [
            [a, b if np.isfinite(b) else None] for a, b in summary.settings.hand_may_touch
        ],
    }
