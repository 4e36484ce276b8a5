"""When an input is stale, judged by the time of receipt, and when its header stamps are wrong."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.settings import Delays
from ugv_acceptance.type_aliases import Times

# Number of messages from which a period is learnt; until then silence is limited by STARTUP (ns).
WINDOW = 32
STARTUP = 500_000_000
# Silence (s) after which any input is stale, whatever its period: an operator must know by then.
LONGEST_SILENCE = 2.0
# Time (ns) by which two clocks may differ, or a stamp may jump, before it is worth a warning.
CLOCK_SLACK = 1_000_000_000
# The time (ns) of an input that is not needed: it is never stale.
FOREVER = 1 << 61
# Time (ns) for which messages may repeat the same stamp.
STANDSTILL = 500_000_000


@dataclass(slots=True)
class InputTimeout:
    """Learns an input's period (median of each WINDOW intervals) and how long it may be silent.

    `started` is when listening began (ns), `last` when the newest message was received (None: none
    yet), `stamp` its header stamp, `moved` when that stamp last changed, `limit` the silence (ns)
    after which the input is stale.
    """

    delays: Delays
    started: int | None = None
    last: int | None = None
    stamp: int = 0
    moved: int = 0
    limit: int = STARTUP
    period: float = float('nan')
    _intervals: list[int] = field(default_factory=list)

    @property
    def deadline(self) -> int | None:
        """Time (ns) from which the input is stale without a message; None before listening."""
        since = self.started if self.last is None else self.last
        return None if since is None else since + self.limit

    def clock(self, now: int, stamp: int) -> float:
        """Return 1 if a header stamp is far from the receipt time, jumped or stands still, else 0.

        Call it before `message`.
        """
        wrong = abs(now - stamp) > CLOCK_SLACK
        if self.last is not None:
            wrong = wrong or abs((stamp - self.stamp) - (now - self.last)) > CLOCK_SLACK
        if self.last is None or stamp != self.stamp:
            self.stamp, self.moved = stamp, now
        return 1.0 if wrong or now - self.moved > STANDSTILL else 0.0

    def clocks(self, times: Times, stamps: Times) -> NDArray[np.float64]:
        """Return `clock` of many messages (n,); call it before `messages`."""
        if not len(times):
            return np.zeros(0)
        ahead = times - stamps
        wrong = np.abs(ahead) > CLOCK_SLACK
        wrong[1:] |= np.abs(ahead[1:] - ahead[:-1]) > CLOCK_SLACK
        if self.last is not None:
            wrong[0] |= abs(int(ahead[0]) - (self.last - self.stamp)) > CLOCK_SLACK
        new = np.append(self.last is None or stamps[0] != self.stamp, stamps[1:] != stamps[:-1])
        if not new.all():
            moved = np.maximum.accumulate(np.where(new, times, self.moved))
            wrong |= times - moved > STANDSTILL
            self.moved = int(moved[-1])
        else:
            self.moved = int(times[-1])
        self.stamp = int(stamps[-1])
        return np.where(wrong, 1.0, 0.0)

    def judge_by(self, delays: Delays) -> None:
        """Use other delays from now on; a period already learnt gets its new limit at once."""
        self.delays = delays
        if not math.isnan(self.period):
            self.limit = self._silence(self.period)

    def message(self, now: int) -> None:
        """Take the receipt time (ns) of a message."""
        if self.last is not None:
            self._intervals.append(now - self.last)
            if len(self._intervals) == WINDOW:
                self._learn()
        self.last = now

    def messages(self, times: Times) -> tuple[Times, Times]:
        """Take many receipt times (n,); return the limit (ns) in force before and after each."""
        fresh = self.last is None
        steps = np.diff(times, prepend=times[0] if self.last is None else self.last)
        known = np.array(self._intervals, dtype=np.int64)
        intervals = np.concatenate((known, steps[1:] if fresh else steps))
        blocks = intervals[: len(intervals) // WINDOW * WINDOW].reshape(-1, WINDOW)
        middle = np.sort(blocks, axis=1)[:, WINDOW // 2 - 1 : WINDOW // 2 + 1].sum(axis=1) / 2
        learnt = np.concatenate(([self.limit], self._silences(middle)))
        ends = np.arange(len(times)) + len(known) + (0 if fresh else 1)
        limits = learnt[ends // WINDOW]
        before = np.concatenate(([self.limit], limits[:-1]))
        if len(middle):
            self.period, self.limit = float(middle[-1]), int(learnt[-1])
        self._intervals = intervals[len(blocks) * WINDOW :].tolist()
        self.last = int(times[-1])
        return before, limits

    def _learn(self) -> None:
        ordered = sorted(self._intervals)
        self.period = (ordered[WINDOW // 2 - 1] + ordered[WINDOW // 2]) / 2
        self.limit = self._silence(self.period)
        self._intervals.clear()

    def _silences(self, periods: NDArray[np.float64]) -> Times:
        own = np.minimum(periods * self.delays.stale_periods, LONGEST_SILENCE * 1e9)
        return np.maximum(own, self.delays.stale_after * 1e9).astype(np.int64)

    def _silence(self, period: float) -> int:
        own = min(period * self.delays.stale_periods, LONGEST_SILENCE * 1e9)
        return int(max(own, self.delays.stale_after * 1e9))
