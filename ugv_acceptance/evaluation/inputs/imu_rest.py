"""When a disagreement at rest is believed: it lasts, and driving does not explain it.

A gyro at rest does not mean a robot at rest: one that speeds up straight ahead does not turn. What
it could gain of speed is limited, so a disagreement counts once the acceleration that would explain
it has come to more than that.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from ugv_acceptance.evaluation.alerts.state_machine import WARN, Signal
from ugv_acceptance.evaluation.inputs.imu_gravity import SPEED
from ugv_acceptance.type_aliases import Floats, Times

# An interval (ns) between messages counts for at most so much: what lies between is not known.
LONGEST_INTERVAL = 200_000_000


@dataclass(slots=True)
class Lasting:
    """A value that is believed once it was at its limit or beyond without a break.

    For `delay` (ns), and until the push that would explain it (m/s2) came to `speed` (m/s). `since`
    (ns) is when it began, None while it is below its limit or unknown.
    """

    speed: float = SPEED
    since: int | None = None
    _gained: float = 0.0
    _last: int = 0

    def step(self, now: int, value: float, push: float, limit: float, delay: int) -> float:
        """Take a value at `now` (ns); return it if it may be believed, else NaN."""
        if not value >= limit:
            self.since = None
            return value
        if self.since is None:
            self.since, self._gained = now, 0.0
        else:
            self._gained += push * min(now - self._last, LONGEST_INTERVAL) * 1e-9
        self._last = now
        lasts = now - self.since >= delay and self._gained >= self.speed
        return value if lasts else float('nan')

    def columns(
        self, time: Times, value: Floats, push: Floats, limit: float, delay: int
    ) -> tuple[Floats, Times]:
        """Take many values (n,); return them as `step` does, and since when each lasts (ns)."""
        bad = value >= limit
        since = np.zeros(len(time), np.int64)
        if not bad.any():
            self.since = None
            return value, since
        carried = self.since is not None
        before = np.concatenate(([carried], bad[:-1]))
        begins = np.where(bad & ~before, np.arange(len(time)), -1)
        begin = np.maximum.accumulate(begins)
        since = np.where(begin >= 0, time[np.maximum(begin, 0)], self.since or 0)
        step = np.minimum(
            np.diff(time, prepend=self._last if carried else time[0]), LONGEST_INTERVAL
        )
        gained = np.cumsum(np.where(bad & before, push * step * 1e-9, 0.0))
        start = np.where(begin >= 0, gained[np.maximum(begin, 0)], -self._gained)
        gained = gained - start
        lasts = (time - since >= delay) & (gained >= self.speed)
        if bad[-1]:
            self.since, self._gained, self._last = int(since[-1]), float(gained[-1]), int(time[-1])
        else:
            self.since = None
        return np.where(bad & ~lasts, np.nan, value), since


@dataclass(slots=True)
class RestChecks:
    """Feeds the signals of the checks at rest: `strange`, acceleration that is not g; `apart`.

    `pending` says whether one of the two is at its limit or beyond.
    """

    strange: Signal
    apart: Signal
    g: float
    pending: bool = False
    _strange: Lasting = field(default_factory=lambda: Lasting(0.0))
    _apart: Lasting = field(default_factory=Lasting)

    def step(self, now: int, strange: float, apart: float, delay: int) -> tuple[float, float]:
        """Take values at `now` (ns) that must last for `delay` (ns); return those to be believed.

        `strange` is a share of g, `apart` in rad; NaN where the robot is not at rest.
        """
        push = self.g * math.sin(min(apart, math.pi / 2.0)) if apart > 0.0 else 0.0
        found = (
            self._strange.step(now, strange, 0.0, self.strange.on, delay),
            self._apart.step(now, apart, push, self.apart.on, delay),
        )
        for signal, value, lasting in zip(
            (self.strange, self.apart), found, (self._strange, self._apart), strict=True
        ):
            _reach(signal, value, now, lasting.since or now)
        self.pending = self._strange.since is not None or self._apart.since is not None
        return found

    def columns(self, time: Times, strange: Floats, apart: Floats, delay: int) -> None:
        """Take many values (n,), and feed the signals with those to be believed."""
        explained = apart
        if (apart >= self.apart.on).any():
            explained = self.g * np.sin(np.minimum(apart, math.pi / 2.0))
        for signal, lasting, values, push in (
            (self.strange, self._strange, strange, np.zeros(len(time))),
            (self.apart, self._apart, apart, explained),
        ):
            found, since = lasting.columns(time, values, push, signal.on, delay)
            if signal.quiet and not (found >= signal.on).any():
                continue
            for now, value, begin in zip(*(v.tolist() for v in (time, found, since)), strict=True):
                _reach(signal, value, now, begin)
                signal.step(now, value)
            signal.advance(int(time[-1]))
        self.pending = self._strange.since is not None or self._apart.since is not None


def _reach(signal: Signal, value: float, now: int, since: int) -> None:
    """Let an alert that a value raises reach back to when the value began to last (ns)."""
    if value >= signal.on and signal.alert is None and signal.rule.level > WARN:
        signal.judge_by(replace(signal.rule, reach=now - since))
