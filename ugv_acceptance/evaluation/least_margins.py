"""Which margins are the least at one moment: the side it tips to first, the joint most used."""

import math
from collections.abc import Iterable
from typing import SupportsFloat

from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import SIDES

# What stands in place of the tilt left where nobody measures it.
TILT_NOT_CHECKED = 'tip-over not checked (no IMU: the base was declared level)'


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
    used = f'{joint} at {use:.0%} of its limit' if joint else ''
    return ', '.join(words for words in (tilt, used) if words)
