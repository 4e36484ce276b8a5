"""A driver that sends one joint state again and again: its positions are not measured anew.

A message whose header stamp and positions all equal those of the message before it, of the same
names, is no new message. That lasts a moment where a driver is slower than its publisher; longer,
nobody knows where the joints are. A stamp of 0 is no stamp, and a stamp of whole seconds may stand
still for a second. Joints at rest have running stamps: their messages are new.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ugv_acceptance.type_aliases import Floats, Times

# Time (ns) for which a message may be repeated, and how much longer if its stamp is a whole second.
ALLOWED, WHOLE = 500_000_000, 1_000_000_000
NEVER = -1


@dataclass(slots=True)
class Repeats:
    """The newest message of one list of names, and since when (ns) it is repeated.

    `seconds` is how long, 0 while that is no longer than a driver may.
    """

    stamp: int = 0
    since: int = NEVER
    position: tuple[float, ...] = ()
    seconds: float = 0.0

    def step(self, now: int, stamp: int, position: Sequence[float]) -> float:
        """Take a message; return for how many seconds it is repeated, 0 if that is allowed."""
        if stamp == self.stamp and stamp and self.position == position:
            held = now - self.since
            self.seconds = held / 1e9 if held > _allowed(stamp) else 0.0
        else:
            self.stamp, self.since, self.position = stamp, now, tuple(position)
            self.seconds = 0.0
        return self.seconds

    def columns(self, time: Times, stamp: Times, position: Floats) -> Floats:
        """Take many messages (n,) with positions (n, k): what `step` returns for each."""
        n = len(time)
        same = np.zeros(n, np.bool_)
        same[1:] = stamp[1:] == stamp[:-1]
        same[0] = stamp[0] == self.stamp
        same &= stamp != 0
        if same.any():
            alike = np.zeros(n, np.bool_)
            alike[1:] = (position[1:] == position[:-1]).all(axis=1)
            alike[0] = self.position == tuple(position[0].tolist())
            same &= alike
        since = time
        found = np.zeros(n)
        if same.any():
            newest = np.maximum.accumulate(np.where(same, -1, np.arange(n)))
            since = np.where(newest >= 0, time[newest], self.since)
            held = time - since
            late = held > ALLOWED + np.where(stamp % WHOLE == 0, WHOLE, 0)
            found = np.where(same & late, held / 1e9, 0.0)
        self.stamp, self.since = int(stamp[-1]), int(since[-1])
        self.position, self.seconds = tuple(position[-1].tolist()), float(found[-1])
        return found


def _allowed(stamp: int) -> int:
    return ALLOWED + WHOLE if stamp % WHOLE == 0 else ALLOWED
