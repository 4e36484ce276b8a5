"""The state machine of an alert: limit, deadband, on-delay and off-delay.

The machine has no clock. What falls due between two samples is dated to the moment it fell due, so
the same data give the same alerts whether they come one at a time or as runs of a recording.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

OK, WARN, ERROR, STALE = range(4)
LEVELS = ('OK', 'WARN', 'ERROR', 'STALE')


@dataclass(frozen=True, slots=True)
class Rule:
    """When a value is bad: from `value >= on` until `value < off` (a deadband), each held a while.

    The alert is raised when the value has been bad for `on_delay` and cleared when it has been good
    for `off_delay` (ns). A NaN value changes nothing. `source` names the values' rows: pair, joints
    or imu.
    """

    code: str
    subject: str
    level: int
    on: float
    off: float
    on_delay: int
    off_delay: int
    source: str = 'pair'


@dataclass(slots=True)
class Alert:
    """An alert that was raised: times in ns; `peak` is the worst value; `end` None while active."""

    rule: Rule
    start: int
    peak: float
    end: int | None = None


@dataclass(slots=True)
class Signal:
    """The state of one rule. `log` receives alerts as they are raised; they are closed in place.

    `raw` is the value's side of the deadband, `alert` the active alert, `due` the time at which the
    state changes unless the value does first. While `quiet`, only a value of `on` or more matters.
    """

    rule: Rule
    log: list[Alert]
    raw: bool = False
    alert: Alert | None = None
    due: int | None = None
    peak: float = field(default=-np.inf)
    quiet: bool = True
    on: float = field(init=False)

    def __post_init__(self) -> None:
        self.on = self.rule.on

    def judge_by(self, rule: Rule) -> None:
        """Take another rule from now on; an alert that is active keeps its own."""
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
                self._rise(value)
            self.advance(now)

    def set(self, now: int, peak: float) -> None:
        """Say that the value is bad at `now`, and how bad it becomes before it is good again."""
        if not self.raw:
            self.advance(now)
            self.raw = True
            if self.alert is None:
                self.due = now + self.rule.on_delay
                self.peak = peak
            else:
                self.due = None
        if peak > self.peak:
            self._rise(peak)
        self.advance(now)

    def clear(self, now: int) -> None:
        """Say that the value is good at `now`."""
        if self.raw:
            self.advance(now)
            self.raw = False
            self.due = None if self.alert is None else now + self.rule.off_delay
        self.advance(now)

    def advance(self, now: int) -> None:
        """Let time pass up to `now`: raise or clear what fell due."""
        if self.due is not None and self.due <= now:
            if self.raw:
                self.alert = Alert(self.rule, self.due, self.peak)
                self.log.append(self.alert)
            elif self.alert is not None:
                self.alert.end = self.due
                self.alert = None
            self.due = None
        self.quiet = not self.raw and self.alert is None and self.due is None

    def _rise(self, peak: float) -> None:
        self.peak = peak
        if self.alert is not None:
            self.alert.peak = peak


def runs(rule: Rule, values: NDArray[Any], *, raw: bool) -> Iterator[tuple[int, int, bool]]:
    """Yield (first row, row after the last, bad) for every run of `values` on one side.

    `raw` is the side before the first row; rows inside the deadband, and NaN, prolong a run.
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


def feed(signal: Signal, times: NDArray[np.int64], values: NDArray[Any]) -> None:
    """Give a signal many samples (numbers, or whether it is bad): the alerts of `step` for each."""
    if not len(values):
        return
    if signal.quiet and not (values >= signal.on).any():
        return
    for first, last, bad in runs(signal.rule, values, raw=signal.raw):
        if bad:
            signal.set(int(times[first]), float(np.fmax.reduce(values[first:last])))
        else:
            signal.clear(int(times[first]))
    signal.advance(int(times[-1]))
