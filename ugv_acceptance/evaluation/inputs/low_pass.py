"""Low-pass filter of the accelerometer, message by message and for whole columns."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ugv_acceptance.model.robot import Vector
from ugv_acceptance.type_aliases import Floats, Times

NOWHERE: Vector = (math.nan, math.nan, math.nan)
# After a longer gap between stamps (s) the filter starts anew.
LONGEST_STEP = 1.0
# Larger than any acceleration (m/s2) or rate (rad/s) of a vehicle: the number is something else.
BELIEVABLE = 1e3


@dataclass(slots=True)
class LowPass:
    """A first-order low-pass filter with a time `constant` (s); `smooth` is its last output."""

    constant: float
    smooth: Vector = NOWHERE
    stamp: int = 0

    def step(self, stamp: int, acceleration: Sequence[float]) -> Vector:
        """Take an acceleration (m/s2) and its stamp (ns); return it filtered, NaN if unknown."""
        ax, ay, az = acceleration
        if not ax * ax + ay * ay + az * az <= BELIEVABLE * BELIEVABLE:
            ax = ay = az = math.nan
        step = (stamp - self.stamp) * 1e-9
        self.stamp = stamp
        sx, sy, sz = self.smooth
        if 0.0 < step <= LONGEST_STEP and sx == sx:  # noqa: PLR0124 - not NaN
            keep = math.exp(-step / self.constant)
            ax, ay, az = ax + keep * (sx - ax), ay + keep * (sy - ay), az + keep * (sz - az)
        self.smooth = (ax, ay, az)
        return self.smooth

    def columns(self, stamp: Times, x: Floats) -> Floats:
        """Filter accelerations (3, n) with stamps (n,): the recursion of `step` in closed form.

        A few time constants at a time, so that the products of the decay factors neither overflow
        nor underflow.
        """
        step = np.diff(stamp, prepend=self.stamp) * 1e-9
        self.stamp = int(stamp[-1])
        finite = x[0] * x[0] + x[1] * x[1] + x[2] * x[2] <= BELIEVABLE * BELIEVABLE
        if not finite.all():
            x = np.where(finite, x, np.nan)
        carried = (step > 0.0) & (step <= LONGEST_STEP) & np.concatenate(([True], finite[:-1]))
        decay = carried * step / self.constant
        elapsed = np.cumsum(decay)
        starts = ~carried
        starts[1:] |= np.diff(np.floor(elapsed / 8.0)) > 0
        starts[0] = True
        edges = np.append(np.flatnonzero(starts), len(stamp))
        y = np.empty_like(x)
        last = np.array(self.smooth)
        for first, end in pairwise(edges.tolist()):
            part, w = x[:, first:end], y[:, first:end]
            # The output's lag behind the input decays, and grows by each change of the input.
            fresh = not carried[first] or not np.isfinite(last).all()
            since = elapsed[first] if fresh else elapsed[first] - decay[first]
            keep = np.exp(since - elapsed[first:end])
            w[:, 0] = 0.0 if fresh else last - part[:, 0]
            np.subtract(part[:, :-1], part[:, 1:], out=w[:, 1:])
            w[:, 1:] /= keep[:-1]
            np.cumsum(w, axis=1, out=w)
            w *= keep
            w += part
            last = y[:, end - 1]
        self.smooth = (float(last[0]), float(last[1]), float(last[2]))
        return y
