"""The clock that dates the receipt of messages: steady, unaffected when the time is set.

The steady clock is set by the wall clock once, at activation (and on reset). Neither setting the
wall clock later nor a `/clock` that freezes or runs at another speed makes an input stale. Header
stamps are compared with this clock, in simulation after a shift from the time of `/clock`.
"""

import time
from dataclasses import dataclass, field
from typing import Protocol

# Simulated time may drift this far (ns) from real time before the shift is renewed.
RESHIFT = 250_000_000
# Newest stamps of which is remembered what they were converted to.
REMEMBERED = 64


def _offset() -> int:
    return time.time_ns() - time.monotonic_ns()


class Clock(Protocol):
    """Dates the receipt of messages; of a recording, it stands at a log time."""

    def now(self) -> int:
        """Return the time of receipt (ns since the epoch) of the message in hand."""


@dataclass(slots=True)
class ReceiptClock:
    """A steady clock in ns since the epoch: `offset` (ns) is added to that of the machine."""

    offset: int = field(default_factory=_offset)

    def now(self) -> int:
        """Return the present time (ns since the epoch)."""
        return time.monotonic_ns() + self.offset


@dataclass(slots=True)
class StampShift:
    """Converts header stamps to receipt time by `shift` (ns), where they are `simulated`.

    The shift follows `/clock`; before its first message, it is such that the first header stamp
    equals the present. A stamp that comes again is converted as before: what stands still does so
    while `/clock` runs slowly, or not at all.
    """

    simulated: bool = False
    shift: int = 0
    shifted: bool = False
    _converted: dict[int, int] = field(default_factory=dict)

    def stamp(self, now: int, stamp: int) -> int:
        """Return a header stamp (ns) converted to the time of this clock."""
        if not self.simulated:
            return stamp
        if not self.shifted:
            self.shift, self.shifted = now - stamp, True
        converted = self._converted
        found = converted[stamp] = converted.pop(stamp, stamp + self.shift)
        if len(converted) > REMEMBERED:
            del converted[next(iter(converted))]
        return found

    def follow(self, now: int, simulated_now: int) -> None:
        """Renew the shift if `/clock` (`simulated_now`, ns; 0: none yet) has drifted from it."""
        shift = now - simulated_now
        if self.simulated and simulated_now and abs(shift - self.shift) > RESHIFT:
            self.shift, self.shifted = shift, True
