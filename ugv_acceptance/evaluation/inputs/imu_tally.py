"""Counts of what the checks of an IMU judged in a recording, and the worst they saw."""

import math
from dataclasses import dataclass, field

from ugv_acceptance.evaluation.inputs.imu_gravity import WINDOWS, GravityFound
from ugv_acceptance.evaluation.inputs.imu_rates import RatesFound


@dataclass(slots=True)
class GravityTally:
    """Windows of one length that were judged, those that were wrong, and the worst of all.

    `worst` (m/s2) is the horizontal acceleration that came nearest to its `limit`, or passed it.
    """

    judged: int = 0
    wrong: int = 0
    worst: float = 0.0
    limit: float = float('inf')

    def add(self, found: GravityFound) -> None:
        """Take a window."""
        self.judged += 1
        self.wrong += found.angle > 0.0
        if found.across / found.limit > self.worst / self.limit:
            self.worst, self.limit = found.across, found.limit


@dataclass(slots=True)
class Tally:
    """What was judged: `gravity` by the rows of a window; windows of rates, unit and two sources.

    `turned` windows had a rotation, `verified` ones rates that agree, `cosine` is their worst.
    """

    gravity: dict[int, GravityTally] = field(
        default_factory=lambda: {rows: GravityTally() for rows in WINDOWS}
    )
    windows: int = 0
    turned: int = 0
    verified: int = 0
    wrong: int = 0
    cosine: float = float('nan')
    units: int = 0
    sources: int = 0

    def rates(self, found: RatesFound) -> None:
        """Take a window of rates."""
        self.windows += 1
        self.turned += found.excited
        self.verified += found.gyro == 0.0
        self.wrong += found.gyro > 0.0 or found.orientation > 0.0
        if not found.cosine >= self.cosine:
            self.cosine = found.cosine if found.excited else self.cosine

    def others(self, unit: float, source: float) -> None:
        """Take windows of the unit and of two sources; NaN is not judged."""
        self.units += not math.isnan(unit)
        self.sources += not math.isnan(source)
