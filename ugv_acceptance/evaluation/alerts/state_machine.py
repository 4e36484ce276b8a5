"""The state machine of an alert: limit, deadband, on-delay and off-delay.

The machine has no clock. An alert that becomes due between two samples is dated to the time it was
due, so the same data give the same alerts whether they come one at a time or in columns.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

OK, WARN, ERROR, STALE = range(4)
# Values in one cell of a grid are one: what is computed one by one and in columns differs in the
# last bits, and the first of equal values is when the worst came. A cell is this wide for small
# values, and this share of large ones; the shift keeps its borders away from round numbers.
_CELL, _SHIFT = 1e-9, 0.37
LEVELS = ('OK', 'WARN', 'ERROR', 'STALE')


@dataclass(frozen=True, slots=True)
class Rule:
    """The rule of an alert: limits with a deadband, and delays.

    A value is bad from `value >= on` until `value < off`. The alert is raised when it has been bad
    for `on_delay` and cleared when it has been good for `off_delay` (ns). NaN changes nothing.
    `source` says to which messages the values belong: pair, joints or imu. An alert makes the
    margins of the `reach` (ns) before its start doubtful as well: so long it took to confirm it.
    """

    code: str
    subject: str
    level: int
    on: float
    off: float
    on_delay: int
    off_delay: int
    source: str = 'pair'
    reach: int = 0


@dataclass(slots=True)
class Alert:
    """An alert that was raised: times in ns; `peak` is the worst value; `end` None while active.

    `detail` says in words what the numbers do not: which value came, and which was expected.
    `worst_at` is when `peak` came, which may be in the on-delay before `start`; None: not known.
    """

    rule: Rule
    start: int
    peak: float
    end: int | None = None
    detail: str = ''
    worst_at: int | None = None


@dataclass(slots=True)
class Signal:
    """The state machine of one rule; `log` receives its alerts, whose `end` is set later in place.

    `raw` says whether the value is bad (before delays), `alert` is the active alert, `due` (ns) is
    when the state changes unless the value does first. `peak` is the worst value since it was good,
    `peak_at` (ns) when one in its cell came first. While `quiet`, only a value of `on` or
    more can change anything, so callers may skip smaller ones. `detail` is what an alert raised
    next says in words: set it before a value that is bad while `raw` is not.
    """

    rule: Rule
    log: list[Alert]
    raw: bool = False
    alert: Alert | None = None
    due: int | None = None
    peak: float = field(default=-np.inf)
    peak_at: int | None = None
    quiet: bool = True
    detail: str = ''
    on: float = field(init=False)
    _cell_dated: float = field(default=-np.inf)

    def __post_init__(self) -> None:
        self.on = self.rule.on

    def judge_by(self, rule: Rule) -> None:
        """Replace the rule from now on; an active alert keeps the one it was raised by."""
        self.rule, self.on = rule, rule.on

    def step(self, now: int, value: float) -> None:
        """Take a value at time `now` (ns)."""
        if value >= self.on:
            # Bad as before and no worse: nothing can change.
            if not self.raw or self.due is not None or value > self.peak:
                self.set(now, value)
        elif self.quiet:
            return
        elif value < self.rule.off:
            self.clear(now)
        else:
            if self.raw and value > self.peak:
                self._rise(value, now)
            self.advance(now)

    def set(self, now: int, peak: float, at: int | None = None) -> None:
        """Take that the value is bad from `now` (ns) on; `peak` is its worst until it is good.

        `at` is when the worst comes first (ns; None: now).
        """
        at = now if at is None else at
        if not self.raw:
            self.advance(now)
            self.raw = True
            if self.alert is None:
                self.due = now + self.rule.on_delay
                self.peak, self.peak_at, self._cell_dated = peak, at, _cell(peak)
            else:
                self.due = None
        if peak > self.peak:
            self._rise(peak, at)
        self.advance(now)

    def clear(self, now: int) -> None:
        """Take that the value is good from `now` (ns) on."""
        if self.raw:
            self.advance(now)
            self.raw = False
            self.due = None if self.alert is None else now + self.rule.off_delay
        self.advance(now)

    def advance(self, now: int) -> None:
        """Let time pass up to `now` (ns): raise or clear the alert if that has become due."""
        if self.due is not None and self.due <= now:
            if self.raw:
                told = self.detail, self.peak_at
                self.alert = Alert(self.rule, self.due, self.peak, None, *told)
                self.log.append(self.alert)
            elif self.alert is not None:
                self.alert.end = self.due
                self.alert = None
            self.due = None
        self.quiet = not self.raw and self.alert is None and self.due is None

    def _rise(self, peak: float, at: int) -> None:
        self.peak = peak
        if (cell := _cell(peak)) > self._cell_dated:
            self.peak_at, self._cell_dated = at, cell
        if self.alert is not None:
            self.alert.peak, self.alert.worst_at = peak, self.peak_at


def runs(rule: Rule, values: NDArray[Any], *, raw: bool) -> Iterator[tuple[int, int, bool]]:
    """Yield (first row, row after the last, bad) for every run of rows that are bad or good.

    `raw` is the state before the first row; rows inside the deadband, and NaN, extend a run.
    """
    bad = values >= rule.on
    decided = np.flatnonzero(bad | (values < rule.off))
    side = bad[decided]
    changes = np.flatnonzero(np.diff(side, prepend=raw))
    starts = [0, *decided[changes].tolist()]
    sides = [raw, *side[changes].tolist()]
    for k, first in enumerate(starts):
        last = starts[k + 1] if k + 1 < len(starts) else len(values)
        if last > first:
            yield first, last, bool(sides[k])


def feed(
    signal: Signal,
    times: NDArray[np.int64],
    values: NDArray[Any],
    detail: Callable[[int], str] | None = None,
) -> None:
    """Give a signal many samples (n,) at `times` (n,) in ns: the same alerts as `step` for each.

    `values` are numbers, or booleans: whether the value is bad. `detail` returns the words for the
    row at which the value became bad.
    """
    if not len(values):
        return
    if signal.quiet and not (values >= signal.on).any():
        return
    for first, last, bad in runs(signal.rule, values, raw=signal.raw):
        if bad:
            if detail is not None and not signal.raw:
                signal.detail = detail(first)
            signal.set(int(times[first]), *_worst(times[first:last], values[first:last]))
        else:
            signal.clear(int(times[first]))
    signal.advance(int(times[-1]))


def _worst(times: NDArray[np.int64], values: NDArray[Any]) -> tuple[float, int]:
    """Return the largest value (NaN: all are) and when one in its cell came first (ns)."""
    worst = float(np.fmax.reduce(values))
    near = worst - 2.0 * _CELL * (1.0 + abs(worst)) if math.isfinite(worst) else worst
    cell = _cell(worst)
    rows = np.flatnonzero(values >= near).tolist()
    return worst, int(times[next((k for k in rows if _cell(float(values[k])) == cell), 0)])


def _cell(value: float) -> float:
    """Return the number of the grid's cell that a value is in; infinities and NaN are their own."""
    return math.floor(math.asinh(value) / _CELL + _SHIFT) if math.isfinite(value) else value
