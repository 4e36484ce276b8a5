"""The monotonic clock that dates the receipt of messages; setting the time moves it not.

The steady clock is set by the wall clock once, at activation (and on reset). A wall clock that is
set later, a `/clock` that freezes or runs at another speed: none of them ages an input. Header
stamps are compared with this clock, in simulation after a shift into the time of `/clock`.
"""

import time
from dataclasses import dataclass, field

# Simulated time may run away from real time this far (ns) before stamps are shifted anew.
RESHIFT = 250_000_000


def _offset() -> int:
    return time.time_ns() - time.monotonic_ns()


@dataclass(slots=True)
class ReceiptClock:
    """Nanoseconds since the epoch by the steady clock; `shift` (ns) turns stamps into this time.

    With `simulated` the shift follows `/clock`; until that came, the first stamp is taken for now.
    """

    simulated: bool = False
    offset: int = field(default_factory=_offset)
    shift: int = 0
    shifted: bool = False

    def now(self) -> int:
        """Return the time of receipt of what is in hand now (ns)."""
        return time.monotonic_ns() + self.offset

    def stamp(self, now: int, stamp: int) -> int:
        """Return a header stamp (ns) in receipt time."""
        if self.simulated and not self.shifted:
            self.shift, self.shifted = now - stamp, True
        return stamp + self.shift

    def follow(self, now: int, simulated_now: int) -> None:
        """Compare with `/clock` (ns, 0: none yet)."""
        shift = now - simulated_now
        if self.simulated and simulated_now and abs(shift - self.shift) > RESHIFT:
            self.shift, self.shifted = shift, True
