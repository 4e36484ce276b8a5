"""Remembers where a running robot rested, one sample a second, so that its efforts can be judged.

The counterpart for recordings is rests.py: both end in `understand`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ugv_acceptance.evaluation.effort.rests import (
    LEVEL_SHARE,
    MOST_SHARE,
    REST,
    Rests,
    is_near,
    reaches,
)
from ugv_acceptance.evaluation.effort.understanding import Understanding
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.type_aliases import Floats

# So many rests are remembered. Samples of one rest before its efforts are judged, and again: after
# AGAIN, twice, four times as many ..., as the means of a longer rest change less and less.
KEPT, FIRST, AGAIN = 40, 3, 10
# A static torque that changes by this share of the largest in one posture is another load declared.
DECLARED = 0.03
# Share of the largest effort of all joints by which noise may change the effort of any.
NOISE_SHARE = 0.05
# A load that differs by less than this (kg) counts as the declared one.
DIFFERS = 0.5


@dataclass(frozen=True, slots=True)
class PayloadEstimate:
    """The payload `mass` (kg) that explains the measured efforts, and the declared one."""

    mass: float
    declared: float

    @property
    def differs(self) -> bool:
        """Whether the estimate differs from the declared payload by at least DIFFERS."""
        return abs(self.mass - self.declared) >= DIFFERS

    @property
    def sentence(self) -> str:
        """The sentence for the operator."""
        return (
            f'measured efforts suggest a payload of {max(self.mass, 0.0):.1f} kg, '
            f'but {self.declared:.1f} kg is declared'
        )


@dataclass(slots=True)
class _Rest:
    """A rest so far: means of its `count` samples, from `start` to `end` (ns)."""

    start: int
    end: int
    count: int
    effort: Floats
    torque: Floats
    q: Floats
    gravity: Floats

    def take(self, now: int, sample: 'tuple[Floats, Floats, Floats, Floats]') -> None:
        """Add a sample: effort, torque, q, gravity."""
        self.end, self.count = now, self.count + 1
        means = self.effort, self.torque, self.q, self.gravity
        for mean, new in zip(means, sample, strict=True):
            mean[:] = mean + (new - mean) / self.count


@dataclass(slots=True)
class LiveRests:
    """The rests of a running robot, the newest last; `current` is None while it moves."""

    settings: Settings
    current: _Rest | None = None
    _rests: list[_Rest] = field(default_factory=list)

    def see(
        self,
        now: int,
        q: Sequence[float],
        rates: Sequence[float],
        effort: Sequence[float],
        gravity: Sequence[float],
        torque: Sequence[float],
    ) -> bool:
        """Take a sample at `now` (ns), one a second; return whether to judge the efforts again.

        rad, rad/s, N m (N), m/s2; `torque` is static, with the declared load.
        """
        on_the_ground = any(map(math.isnan, torque))
        if on_the_ground or any(abs(rate) > REST for rate in rates):
            self.current = None
            return False
        sample = tuple(np.array(x, np.float64) for x in (effort, torque, q, gravity))
        e, t, p, g = sample
        rest = self.current
        if rest is None or not self._goes_on(rest, (e, t, p, g)):
            rest = self.current = _Rest(now, now, 1, e, t, p, g)
            self._rests = [*self._rests[1 - KEPT :], rest]
        else:
            rest.take(now, (e, t, p, g))
        tens, odd = divmod(rest.count, AGAIN)
        return rest.count == FIRST or (not odd and not tens & (tens - 1))

    def _goes_on(self, rest: _Rest, sample: tuple[Floats, Floats, Floats, Floats]) -> bool:
        effort, torque, q, gravity = sample
        if not is_near(rest.q, q, rest.gravity, gravity, reaches(self.settings)):
            return False
        told = [np.nan_to_num(one.effort) for one in self._rests]
        most = np.abs(np.array(told)).max(axis=0, initial=0.0)
        allowed = np.maximum(MOST_SHARE * most, LEVEL_SHARE * np.abs(np.nan_to_num(rest.effort)))
        # Where a joint is hardly loaded its effort is noise, as large as on the others.
        allowed = np.maximum(allowed, NOISE_SHARE * most.max(initial=0.0))
        if (np.isfinite(effort) != np.isfinite(rest.effort)).any():
            return False
        if (np.abs(np.nan_to_num(effort - rest.effort)) > np.maximum(allowed, 1e-9)).any():
            return False
        other = np.abs(torque - rest.torque) > DECLARED * np.abs(rest.torque).max(initial=0.0)
        return not other.any()

    def rests(self) -> Rests:
        """Return what is remembered."""
        found = self._rests
        return Rests(
            np.array([r.start for r in found], np.int64),
            np.array([r.end for r in found], np.int64),
            *(np.array([getattr(r, part) for r in found]) for part in _PARTS),
        )

    def judged_by(self, found: Understanding) -> bool:
        """Return whether the rest that lasts now is one of those judged."""
        return self.current is not None and self.current.start in found.rests.start

    def estimate(self, found: Understanding) -> PayloadEstimate | None:
        """Return the load of the rest that lasts now; None: nothing is known of it."""
        if self.current is None:
            return None
        (now,) = np.nonzero(found.rests.start == self.current.start)
        loads = [x for x in found.loads for k in now if x.first <= k <= x.last]
        if not loads:
            return None
        load = loads[-1]
        mass = load.mass if load.differs else load.declared
        return PayloadEstimate(mass, load.declared)


_PARTS = ('effort', 'torque', 'q', 'gravity')
