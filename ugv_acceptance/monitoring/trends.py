"""The smallest margins since the start, and the time until a shrinking margin is used up.

Every sample costs a few comparisons; rates are computed only when asked for.
"""

import math
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from operator import gt, lt, mul

from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import SIDES

# Rates come from samples of this spacing over this span (ns); at least this many are needed.
SPACING, SPAN, LEAST = 50_000_000, 1_000_000_000, 8
# Slowest rates that count as shrinking (rad/s; share of the limit per second), and the longest time
# left that is reported (s).
TILT_RATE, LOAD_RATE, SOON = math.radians(1.0), 0.03, 5.0


@dataclass(frozen=True, slots=True)
class NearMiss:
    """The smallest margin of a kind since the start: time (ns), side or joint, and amount.

    `left` is in rad of tilt, or N m (N) of torque.
    """

    time: int
    subject: str
    left: float


@dataclass(frozen=True, slots=True)
class Ahead:
    """A shrinking margin: its `rate` (rad/s; N m/s or N/s), and `seconds` until it is used up."""

    subject: str
    rate: float
    seconds: float


def end_words(subject: str, seconds: str, *, tips: bool) -> str:
    """Return what happens when a margin of a side (`tips`) or a joint is used up, and when."""
    what = f'tips {subject.upper()}' if tips else f'{subject} at its limit'
    return f'{what} in {seconds} s'


@dataclass(slots=True)
class Trends:
    """Follows the margins of a running robot: their minima and their rates of change.

    `tilt` and `load` hold (smallest margin, its time in ns) of each of SIDES and of each joint;
    from `due` (ns) on the next sample is kept for rates.
    """

    settings: Settings
    tilt: list[tuple[float, int]] = field(init=False)
    load: list[tuple[float, int]] = field(init=False)
    _recent: deque[Margins] = field(default_factory=lambda: deque(maxlen=SPAN // SPACING + 1))
    due: int = 0
    # The least tilts and the largest torques so far, under the limits of these settings.
    _least: list[float] = field(init=False)
    _most: list[float] = field(default_factory=list)
    _of: Settings | None = None
    # What was asked for last: at which time, by which newest margins and settings; the answer.
    _asked: tuple[int, Margins | None, Settings | None] = (0, None, None)
    _ahead: tuple[Ahead, ...] = ()

    def __post_init__(self) -> None:
        self.tilt = [(math.inf, 0)] * len(SIDES)
        self._least = [math.inf] * len(SIDES)
        self.load = [(math.inf, 0)] * len(self.settings.robot.joint_names)

    def see(self, margins: Margins) -> None:
        """Take the margins of one message."""
        if any(map(lt, margins.angle, self._least)):
            for k, angle in enumerate(margins.angle):
                if angle < self.tilt[k][0]:
                    self.tilt[k] = (float(angle), margins.time)
            self._least = [left for left, _ in self.tilt]
        if self.settings is not self._of or any(map(gt, map(abs, margins.torque), self._most)):
            self._see_loads(margins)
        if margins.time >= self.due:
            self.due = margins.time + SPACING
            self._recent.append(margins)

    def _see_loads(self, margins: Margins) -> None:
        """Take torques of which one is the largest yet, or the limits are new."""
        limits = self.settings.limits.torque
        for j, (tau, limit) in enumerate(zip(margins.torque, limits, strict=True)):
            left = limit - abs(tau)
            if left < self.load[j][0]:
                self.load[j] = (left, margins.time)
        before = self._most if self.settings is self._of else [-math.inf] * len(limits)
        self._most = [
            most if tau != tau else max(most, abs(tau))  # noqa: PLR0124 - NaN
            for most, tau in zip(before, margins.torque, strict=True)
        ]
        self._of = self.settings

    def recent(self, now: int) -> list[Margins]:
        """Return margins of the last second before `now` (ns), 50 ms or more apart."""
        return [m for m in self._recent if m.time > now - SPAN]

    def near_misses(self) -> tuple[NearMiss, ...]:
        """Return the smallest tilt left and the smallest torque margin (by share of its limit)."""
        names, limits = self.settings.robot.joint_names, self.settings.limits.torque
        tilts = [(left, at, side) for (left, at), side in zip(self.tilt, SIDES, strict=True)]
        shares = [
            (left / limit, at, name, left)
            for (left, at), name, limit in zip(self.load, names, limits, strict=True)
            if math.isfinite(left)
        ]
        found = []
        if math.isfinite(min(tilts)[0]):
            left, at, side = min(tilts)
            found.append(NearMiss(at, side, left))
        if shares:
            _, at, name, left = min(shares)
            found.append(NearMiss(at, name, left))
        return tuple(found)

    def ahead(self, now: int) -> tuple[Ahead, ...]:
        """Return the margins used up within SOON at their present rates, the soonest first.

        Empty if there are too few samples in the last second before `now` (ns).
        """
        asked = now, self._recent[-1] if self._recent else None, self.settings
        if self._asked != asked:
            self._asked, self._ahead = asked, self._ahead_at(now)
        return self._ahead

    def _ahead_at(self, now: int) -> tuple[Ahead, ...]:
        recent = self.recent(now)
        if len(recent) < LEAST:
            return ()
        time = [(m.time - now) / 1e9 for m in recent]
        tilt = zip(*(m.angle for m in recent), strict=True)
        torque = zip(*(m.torque for m in recent), strict=True)
        return ahead_of(self.settings, time, tilt, torque)


def ahead_of(
    settings: Settings,
    time: Sequence[float],
    tilt: Iterable[Sequence[float]],
    torque: Iterable[Sequence[float]],
) -> tuple[Ahead, ...]:
    """Return the margins used up within SOON at their rates over n samples, the soonest first.

    `time` (n,) is in s, now being 0; `tilt` (4, n) in rad, `torque` (j, n) in N m or N.
    """
    limits, middle = settings.limits.torque, sum(time) / len(time)
    away = [t - middle for t in time]
    spread = sum(map(mul, away, away))
    loads = [[limit - abs(tau) for tau in taus] for limit, taus in zip(limits, torque, strict=True)]
    slowest = (*[TILT_RATE] * len(SIDES), *[LOAD_RATE * limit for limit in limits])
    names = (*SIDES, *settings.robot.joint_names)
    found = []
    for name, values, least in zip(names, (*tilt, *loads), slowest, strict=True):
        # The slope of the line fitted to them; NaN where one is not finite.
        rate = sum(map(mul, away, values)) / spread
        if -rate >= least:
            value = sum(values) / len(time) - rate * middle
            found.append(Ahead(name, rate, 0.0 if value <= 0.0 else value / -rate))
    return tuple(sorted((a for a in found if a.seconds <= SOON), key=lambda a: a.seconds))
