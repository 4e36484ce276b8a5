"""The rules of prediction.py for one look at a time, in plain numbers: what a running robot needs.

prediction.py judges the looks of a recording by the same rules in arrays; a property test holds
that both give the same values.
"""

import math
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

from ugv_acceptance.evaluation.alerts.prediction_limits import (
    CHANGED,
    EVEN,
    GROWN,
    HIGH,
    JUMP,
    KEPT,
    LAG,
    LEAPT,
    LOAD_RATE,
    LONGEST,
    LOW,
    NOISE,
    OVER,
    SPACING,
    STUCK,
    TILT_RATE,
)

Row = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Look:
    """A sample at `time` (ns): `angle` (4,) rad; `torque`, `effort` and `q` of each joint (j,)."""

    time: int
    angle: Row
    torque: Row
    effort: Row
    q: Row


class Values(NamedTuple):
    """The values of the rules at one look, in order of SIDES (`tip`) or of the joints (others)."""

    tip: Sequence[float]
    torque: Sequence[float]
    effort: Sequence[float]
    weak: Sequence[float]
    frozen: Sequence[float]


@dataclass(slots=True)
class _Standstill:
    """For how many looks a position is the same; effort less torque, and effort, since then."""

    looks: float = math.nan
    torque_open: float = math.nan
    effort: float = math.nan

    def step(self, tau: float, effort: float, *, moved: bool) -> float:
        """Return how much effort (N m; N) changed that torque does not explain; 0 in the first."""
        if moved:
            self.looks, self.torque_open, self.effort = 0.0, effort - tau, effort
        else:
            self.looks += 1.0
        if not self.looks >= STUCK:
            return 0.0
        return _less(abs(effort - tau - self.torque_open), abs(effort - self.effort))


@dataclass(slots=True)
class LivePrediction:
    """The newest looks of a running robot, of `joints` joints."""

    joints: int
    _past: deque[Look] = field(default_factory=lambda: deque(maxlen=KEPT))
    _still: list[tuple[_Standstill, _Standstill]] = field(init=False)

    def __post_init__(self) -> None:
        self._still = [(_Standstill(), _Standstill()) for _ in range(self.joints)]

    def step(self, look: Look, limit: Sequence[float]) -> Values:
        """Take a look; return what the rules say of it. `limit` (j,) are torque limits (N m; N)."""
        self._past.append(look)
        left = [
            [a - abs(t) for a, t in zip(limit, one.torque, strict=True)] for one in self._last()
        ]
        torque = self._ahead(left, [LOAD_RATE * most for most in limit])
        weak, frozen = list(self._weak(limit)), list(self._frozen(limit))
        for j, tau in enumerate(look.torque):
            if tau != tau:  # the ground may carry the arm  # noqa: PLR0124 - NaN
                torque[j] = weak[j] = frozen[j] = -math.inf
        return Values(
            self._ahead([one.angle for one in self._last()], [TILT_RATE] * len(look.angle)),
            torque,
            [
                abs(effort) if most < math.inf else 0.0
                for effort, most in zip(look.effort, limit, strict=True)
            ],
            weak,
            frozen,
        )

    def _last(self) -> list[Look]:
        """Return the looks over which a rate is taken, the newest last."""
        return list(self._past)[-OVER - 1 :]

    def _ahead(self, left: Sequence[Sequence[float]], slowest: Sequence[float]) -> list[float]:
        """Return minus the time (s) until each margin `left` is used up; NaN without a rate."""
        looks = self._last()
        span = looks[-1].time - looks[0].time
        if len(looks) <= OVER or span > LONGEST:
            return [math.nan] * len(slowest)
        found = []
        for k, least in enumerate(slowest):
            now = left[-1][k]
            rate = (now - left[0][k]) / span * 1e9
            if now != now:  # noqa: PLR0124 - NaN
                found.append(math.nan)
            elif now <= 0.0:
                found.append(-0.0)
            elif rate <= -least and _steady([-row[k] for row in left]):
                passed = (-now - rate) + now
                found.append(-(now / passed) if passed > 0.0 else -math.inf)
            else:
                found.append(-math.inf)
        return found

    def _weak(self, limit: Sequence[float]) -> Iterator[float]:
        """Yield 1 where effort is constant below its limit while torque grows, else 0."""
        past = self._past
        soon = len(past) == KEPT and past[-1].time - past[0].time <= 2 * KEPT * SPACING
        stands = soon and not any(angle < 0.0 for look in past for angle in look.angle)
        for j, most in enumerate(limit):
            grown = stands and abs(past[-1].torque[j]) - abs(past[0].torque[j]) >= GROWN * most
            yield 1.0 if grown and self._even(j, most) else 0.0

    def _even(self, j: int, most: float) -> bool:
        """Return whether a joint's effort is constant, and its torque grew step by step."""
        efforts = [look.effort[j] for look in self._past]
        if any(map(math.isnan, efforts)):
            return False
        even = max(efforts) + max([-effort for effort in efforts]) <= EVEN * most
        share = abs(efforts[-1]) / most
        return even and LOW <= share <= HIGH and _steady([abs(x.torque[j]) for x in self._past])

    def _frozen(self, limit: Sequence[float]) -> Iterator[float]:
        """Yield how much effort changed (shares of its limit) while each position did not."""
        look, count = self._past[-1], len(self._past)
        before = self._past[-2].q if count > 1 else ()
        long_before = self._past[max(-LAG - 1, -count)].q if count > 1 else ()
        for j, (q, tau, effort) in enumerate(zip(look.q, look.torque, look.effort, strict=True)):
            exact, noisy = self._still[j]
            same = exact.step(tau, effort, moved=not before or q != before[j])
            away = not long_before or not abs(q - long_before[j]) <= NOISE
            near = noisy.step(tau, effort, moved=away) * (CHANGED / LEAPT)
            yield _more(same, near) / limit[j]


def _steady(values: Sequence[float]) -> bool:
    """Return whether values rose, but not mostly in a single step; False where one is not known."""
    steps = [b - a for a, b in pairwise(values)]
    most = JUMP * (values[-1] - values[0])
    return all(step <= most for step in steps)


def _less(a: float, b: float) -> float:
    """Return the less of two numbers; NaN if one is NaN."""
    return a if a != a or a <= b else b  # noqa: PLR0124 - NaN


def _more(a: float, b: float) -> float:
    """Return the larger of two numbers; NaN if one is NaN."""
    return a if a != a or a >= b else b  # noqa: PLR0124 - NaN
