"""A frozen IMU: values that kept changing and then stay bit-identical, whatever its stamps do."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts.state_machine import Signal
from ugv_acceptance.evaluation.inputs.imu_cell import Q
from ugv_acceptance.type_aliases import Floats, Times

# Values that stay identical for so long (ns) and so many messages are frozen.
LASTS, MESSAGES = 1_000_000_000, 20
# Provided that there were so many different ones in the time (ns) before.
DIFFERENT, BEFORE = 10, 1_000_000_000
# Changes that are remembered.
REMEMBERED = 64

# A change: when it came (ns), and orientation, rate and acceleration from then on.
Change = tuple[int, Sequence[float], Sequence[float], Sequence[float]]


@dataclass(slots=True)
class FrozenCheck:
    """Feeds the signal IMU_FROZEN; `changes` are the newest changes of the values.

    `count` is the number of messages since the last change, `varied` that of all changes, `last`
    orientation, rate and acceleration of the last message.
    """

    signal: Signal
    changes: deque[Change] = field(default_factory=lambda: deque(maxlen=REMEMBERED))
    count: int = 0
    varied: int = 0
    _frozen: bool = False
    last: tuple[Any, ...] = (None, None, None)

    def step(self, now: int, q: Sequence[float], w: Sequence[float], a: Sequence[float]) -> None:
        """Take a message's orientation, rate and acceleration at `now` (ns)."""
        old_q, old_w, old_a = self.last
        if a != old_a or w != old_w or (q != old_q and not _same(q, old_q)):
            self.change(now, q, w, a)
        elif not self._frozen:
            self.count += 1
            if self.count >= MESSAGES and now - self.changes[-1][0] >= LASTS and self._lively():
                self._frozen = True
                self.signal.step(now, 1.0)

    def change(self, now: int, q: Sequence[float], w: Sequence[float], a: Sequence[float]) -> None:
        """Take a message whose values differ from those before."""
        self.last = q, w, a
        self.count = 1
        self.varied += 1
        self.changes.append((now, q, w, a))
        if self._frozen:
            self._thaw(now)

    def _thaw(self, now: int) -> None:
        self._frozen = False
        self.signal.step(now, 0.0)

    def columns(self, time: Times, x: Floats) -> None:
        """Take messages in order: `x` (10, n) is orientation, rate and acceleration."""
        places = np.flatnonzero(self._changed(x))
        self.varied += len(places)
        ends = np.append(places, len(time))
        if self.changes:
            if not self._frozen:
                self._still(time, 0, int(ends[0]), self.changes[-1][0])
            if self._frozen and len(places):
                self._thaw(int(time[places[0]]))
        lasting = np.flatnonzero(time[ends[1:] - 1] - time[places] >= LASTS).tolist()
        taken = 0
        for k in lasting:
            self._remember(time, x, places[taken : k + 1])
            taken, self.count = k + 1, 0
            self._still(time, int(places[k]), int(ends[k + 1]), int(time[places[k]]))
            if self._frozen and k + 1 < len(places):
                self._thaw(int(time[places[k + 1]]))
        self._remember(time, x, places[taken:])
        self.count = len(time) - int(places[-1]) if len(places) else self.count

    def _still(self, time: Times, first: int, end: int, since: int) -> None:
        """Take that the messages from `first` to before `end` have the values of `since` (ns)."""
        confirmed = max(
            int(np.searchsorted(time, since + LASTS)), first + MESSAGES - 1 - self.count
        )
        self.count += end - first
        if confirmed < end and self._lively():
            self._frozen = True
            self.signal.step(int(time[max(confirmed, first)]), 1.0)

    def _remember(self, time: Times, x: Floats, places: NDArray[np.intp]) -> None:
        """Take the changes of the values at `places`."""
        newest = places[-REMEMBERED:]
        for now, row in zip(time[newest].tolist(), x[:, newest].T.tolist(), strict=True):
            self.last = tuple(row[:4]), tuple(row[4:7]), tuple(row[7:])
            self.changes.append((now, *self.last))

    def _changed(self, x: Floats) -> NDArray[np.bool_]:
        """Return which messages (n,) differ from the one before; a rate of NaN always does.

        Columns that are left once all messages differ are not looked at.
        """
        old_q, old_w, old_a = self.last
        before = (*old_q, *old_w, *old_a) if old_q is not None else (np.nan,) * len(x)
        changed = np.zeros(x.shape[1], np.bool_)
        changed[0] = old_q is None
        for k, (line, old) in enumerate(zip(x, before, strict=True)):
            shifted = np.concatenate(([old], line[:-1]))
            differs = line != shifted
            if k < Q.stop and np.isnan(line).any():
                differs &= ~(np.isnan(line) & np.isnan(shifted))
            changed |= differs
            if changed.all():
                break
        return changed

    def _lively(self) -> bool:
        since = self.changes[-1][0] - BEFORE
        recent = {values[1:] for values in self.changes if values[0] >= since}
        return len(recent) >= DIFFERENT


def _same(q: Sequence[float], old: Sequence[float] | None) -> bool:
    """Return whether two orientations are the same where a NaN equals a NaN."""
    if old is None:
        return False
    return all(a == b or (a != a and b != b) for a, b in zip(q, old, strict=True))  # noqa: PLR0124
