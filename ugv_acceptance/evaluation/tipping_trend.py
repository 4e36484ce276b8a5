"""Whether a robot has begun to tip, by how its margin falls: the rule for ground that is not flat.

Where nobody knows what touches, the margin in degrees is only an upper bound, but a robot that
begins to turn over an edge shows it in every margin. Pure: margins and times in, levels out; the
numbers are those of docs/uneven_ground.md, found by bench/bench_uneven.py.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.type_aliases import Floats, Times


@dataclass(frozen=True, slots=True)
class TrendRule:
    """Thresholds, in rad, rad/s and s.

    A margin is looked at `ahead` (s) from now at its slope over the last looks. WARN: it falls at
    `rate` or faster and will be below `warn`, or the cautious margin is below `cautious` now.
    ERROR: it falls at `fast` or faster and will be below `error`.
    """

    ahead: float = 1.0
    rate: float = math.radians(10.0)
    warn: float = math.radians(15.0)
    cautious: float = math.radians(5.0)
    fast: float = math.radians(10.0)
    error: float = 0.0


TREND = TrendRule()
# Looks, 50 ms apart, that one value needs; a slope over a longer time (s) is not known.
LOOKS, LONGEST = 6, 0.5
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


def trend_of(time: Times, angle: Floats, cautious: Floats, rule: TrendRule = TREND) -> Trend:
    """Return the trend at looks at `time` (n,) in ns, each from the LOOKS up to it.

    `angle` (n, 4) rad are the margins on flat ground, `cautious` (n, 4) those of shortened tracks,
    to each of SIDES: infinite without an edge, NaN where not known. Of a look without a slope only
    a cautious margin that is too small is told.
    """
    slope = _slopes(time, angle)
    then = angle + np.minimum(slope, 0.0) * rule.ahead
    falls = (slope <= -rule.rate) & (then < rule.warn)
    tips = (slope <= -rule.fast) & (then < rule.error)
    narrow = cautious < rule.cautious
    known = np.all(np.isfinite(slope) & ~np.isnan(cautious), axis=1, keepdims=True)
    calm = np.where(known[:, 0], OK, NOT_KNOWN)
    warned = np.where((falls | narrow).any(axis=1), WARN, calm)
    level = np.where(np.any(tips, axis=1), ERROR, warned)
    worst = np.where(known, then, cautious)
    side = np.where(np.isnan(worst), np.inf, worst).argmin(axis=1)
    at = np.arange(len(time)), side
    left = np.full(len(time), np.inf)
    of_side: Floats = slope[at]
    left[np.isnan(of_side)] = np.nan
    shrinks = np.flatnonzero(of_side < 0.0)
    left[shrinks] = np.maximum(angle[at][shrinks], 0.0) / -of_side[shrinks]
    return Trend(level.astype(np.int8), side.astype(np.int8), of_side, left)


def _slopes(time: Times, angle: Floats) -> Floats:
    """Return the slopes (n, 4) rad/s; NaN not known, 0 to a side that has no edge."""
    back = LOOKS - 1
    slope = np.full(angle.shape, np.nan)
    if len(time) > back:
        seconds = (time[back:] - time[:-back]) * 1e-9
        now, before = angle[back:], angle[:-back]
        edge = np.isfinite(now) & np.isfinite(before)
        way = np.subtract(now, before, where=edge, out=np.zeros_like(now))
        way[np.isnan(now) | np.isnan(before)] = np.nan
        way[~((seconds > 0.0) & (seconds <= LONGEST))] = np.nan
        slope[back:] = way / np.where(seconds > 0.0, seconds, 1.0)[:, None]
    return slope
