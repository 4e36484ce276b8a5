"""How many alerts an operator got, by the measures of EEMUA 191: average, peak and floods."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

# The window (ns) in which alerts are counted.
WINDOW = 600 * 1_000_000_000
# One in ten minutes is manageable; a flood begins above ten and ends below five in ten minutes.
MANAGEABLE, FLOOD_BEGINS, FLOOD_ENDS = 1.0, 10, 5


@dataclass(frozen=True, slots=True)
class AlarmRates:
    """Alerts raised in a run: all, a ten-minute average, the most in any ten minutes.

    A run shorter than ten minutes counts as ten. `floods` are (begin, end) in ns.
    """

    raised: int
    average: float
    peak: int
    floods: tuple[tuple[int, int], ...]

    @property
    def manageable(self) -> bool:
        """Whether an operator can deal with it: at most one in ten minutes and no flood."""
        return self.average <= MANAGEABLE and not self.floods


def alarm_rates(starts: Sequence[int], start: int, duration: int) -> AlarmRates:
    """Return the rates of alerts raised at `starts` (ns, any order) in a run (ns)."""
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
