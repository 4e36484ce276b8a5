"""Whether a robot has begun to tip, by how its margin falls: the rule for ground that is not flat.

Where nobody knows what touches, the margin in degrees is only an upper bound, but a robot that
begins to turn over an edge shows it in every margin. Pure: margins and times in, levels out.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.type_aliases import Floats, Times


@dataclass(frozen=True, slots=True)
class TrendRule:
    """Thresholds: slope over so long (s), least rate (rad/s) that counts, time left (s)."""

    over: float = 0.5
    rate: float = 0.0873
    warn: float = 1.0
    error: float = 0.5


TREND = TrendRule()
# Looks that one value needs, 50 ms apart.
LOOKS = 11
# A slope over more than this many times the rule's time is not known.
LONGEST = 1.5
NOT_KNOWN, OK, WARN, ERROR = -1, 0, 1, 2


@dataclass(frozen=True, slots=True)
class Trend:
    """The trend at looks (n,): `level` OK, WARN, ERROR or NOT_KNOWN, `side` a number in SIDES.

    `slope` (rad/s) is that of the margin to this side, negative while it shrinks, `left` (s) the
    time until it is used up: infinite if it does not shrink, NaN if not known.
    """

    level: NDArray[np.int8]
    side: NDArray[np.int8]
    slope: Floats
    left: Floats


def trend_of(
    time: Times,
    angle: Floats,
    cautious: Floats,  # noqa: ARG001 - the rule needs the first only
    rule: TrendRule = TREND,
) -> Trend:
    """Return the trend at looks at `time` (n,) in ns, each from the looks up to it.

    `angle` (n, 4) rad are the margins on flat ground, `cautious` (n, 4) those of shortened tracks,
    to each of SIDES: infinite without an edge, NaN where not known.
    """
    n, back = len(time), LOOKS - 1
    slope, left = np.full((n, 4), np.nan), np.full((n, 4), np.nan)
    if n > back:
        seconds = (time[back:] - time[:-back])[:, None] / 1e9
        with np.errstate(invalid='ignore', divide='ignore'):
            fell = np.where(np.isinf(angle[back:]), 0.0, angle[back:] - angle[:-back]) / seconds
            fell = np.where(seconds <= LONGEST * rule.over, fell, np.nan)
            slope[back:] = fell
            shrinks = fell <= -rule.rate
            left[back:] = np.where(shrinks, np.maximum(angle[back:], 0.0) / -fell, np.inf)
            left[back:][np.isnan(fell)] = np.nan
    known = np.isfinite(slope).all(axis=1)
    side = np.where(np.isnan(left), np.inf, left).argmin(axis=1).astype(np.int8)
    at = np.arange(n), side
    soon = np.where(left[at] <= rule.error, ERROR, np.where(left[at] <= rule.warn, WARN, OK))
    level = np.where(known, soon, NOT_KNOWN).astype(np.int8)
    return Trend(level, side, slope[at], left[at])
