"""Which margins are the least at one moment: the side it tips to first, the joint most used."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import SupportsFloat

import numpy as np

from ugv_acceptance.evaluation.margin_words import share_words
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.type_aliases import Floats, Json, Times

# What stands in place of the tilt left where nobody measures it, or where the robot's feet are not
# known.
_LEVEL = 'tip-over not checked (no IMU: the base was declared level)'
_NO_FEET = 'tip-over not checked (the configuration says contacts: unknown)'


def tilt_not_checked(settings: Settings) -> str:
    """Return why no tilt is judged, for settings whose `judges_tilt` is false."""
    return _NO_FEET if settings.hears_imu else _LEVEL


@dataclass(slots=True)
class LeastTilt:
    """The least of a margin (rad): to which side and when (ns); infinite if none was known."""

    value: float = math.inf
    side: str = ''
    time: int = 0

    def take(self, time: Times, margin: Floats) -> None:
        """Take margins (n, 4) at `time` (n,); NaN: not known."""
        known = np.where(np.isnan(margin), np.inf, margin)
        if known.size and known.min() < self.value:
            k, side = divmod(int(known.argmin()), len(SIDES))
            self.value, self.side, self.time = float(known[k, side]), SIDES[side], int(time[k])

    def json(self, start: int) -> Json | None:
        """Return it for a result whose recording began at `start` (ns); None if none was known."""
        if self.value == math.inf:
            return None
        seconds = (self.time - start) / 1e9
        return {'deg': math.degrees(self.value), 'side': self.side, 'time_s': seconds}


def least_tilt(angles: Iterable[SupportsFloat]) -> tuple[str, float]:
    """Return the side to which least tilt is left, and how much (rad); ('', NaN): none is known.

    `angles` (rad) are those of SIDES: infinite where no edge lies, NaN where nothing is known.
    """
    tilts = zip(SIDES, map(float, angles), strict=True)
    known = [(side, angle) for side, angle in tilts if math.isfinite(angle)]
    return min(known, key=lambda tilt: tilt[1], default=('', math.nan))


def most_used(torque: Iterable[SupportsFloat], settings: Settings) -> tuple[str, float]:
    """Return the joint that uses most of its limit, and its share; ('', NaN): none has a limit.

    `torque` (N m; N) is that of each joint; one that is not known does not count.
    """
    of = map(float, torque)
    joints = zip(settings.robot.joint_names, of, settings.limits.torque, strict=True)
    uses = [
        (name, abs(tau) / limit)
        for name, tau, limit in joints
        if math.isfinite(limit) and math.isfinite(tau)
    ]
    return max(uses, key=lambda use: use[1], default=('', math.nan))


def with_most_used(tilt: str, torque: Iterable[SupportsFloat], settings: Settings) -> str:
    """Return words on the tilt left, and behind them the joint that uses most of its limit."""
    joint, use = most_used(torque, settings)
    used = f'{joint} {share_words(use)} of its limit' if joint else ''
    return ', '.join(words for words in (tilt, used) if words)
