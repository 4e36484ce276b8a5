"""Margins of a running robot that are kept by less than they are known: their uncertainty.

The bound costs some milliseconds, so it is computed by `pool` while messages go on, twice a second
at most, and only anew when posture, attitude or load have changed.
"""

import math
from collections.abc import Iterator
from concurrent.futures import Executor, Future
from dataclasses import dataclass, field

from ugv_acceptance.evaluation.criteria.criteria import RSS
from ugv_acceptance.evaluation.criteria.uncertainty import (
    Effects,
    Source,
    combined,
    effects_of,
)
from ugv_acceptance.evaluation.margin_words import degrees_words, excess_words, tipping_words
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.monitoring.background import Snapshot, one_thread, snapshot_of
from ugv_acceptance.type_aliases import Floats

CODE = 'MARGIN_UNCERTAIN'
# Time (ns) between looks, and the looks in a row that find the same before it is told.
EVERY, LOOKS = 500_000_000, 2
# Factor by which a margin must exceed its bound before it counts as certain again.
CERTAIN = 1.25
# How far joints (rad, m) and gravity (m/s2) may move until the bound is computed again.
MOVED, TURNED = 0.02, 0.2


@dataclass(frozen=True, slots=True)
class Doubt:
    """A margin that is OK by less than its uncertainty: joint or side, and a sentence."""

    subject: str
    sentence: str


@dataclass(slots=True)
class Certainty:
    """Compares margins with the bounds that follow from the `sources` of uncertainty.

    `due` (ns) is when the next look is to be taken: soon while bounds are being computed. Margins
    of which no bound is known yet are not in doubt, as those of a robot that just appeared.
    """

    settings: Settings
    sources: tuple[Source, ...]
    pool: Executor = field(default_factory=one_thread)
    due: int = 0
    told: dict[str, Doubt] = field(default_factory=dict)
    _seen: dict[str, int] = field(default_factory=dict)
    _at: Snapshot | None = None
    _asked: 'Future[Effects] | None' = None
    _bounds: tuple[Floats, Floats] | None = None

    @property
    def known(self) -> bool:
        """Whether a bound has been computed yet, or none is needed."""
        return self._bounds is not None or not self.sources

    def look(self, now: int, margins: Margins | None, payload: Payload) -> None:
        """Judge the margins at `now` (ns), None if unknown; `told` are then those in doubt.

        Raises what computing the bounds raised.
        """
        self.due = now + EVERY
        if margins is None or not self.sources:
            self.told, self._seen = {}, {}
            return
        if not self._computed(margins, payload):
            self.due = now
            return
        seen, told = {}, {}
        for subject, left, bound, sentence in self._margins(margins):
            factor = CERTAIN if subject in self.told else 1.0
            if not 0.0 < left < bound * factor:
                continue
            seen[subject] = self._seen.get(subject, 0) + 1
            if seen[subject] >= LOOKS:
                told[subject] = Doubt(subject, sentence)
        self.told, self._seen = told, seen

    def _margins(self, margins: Margins) -> Iterator[tuple[str, float, float, str]]:
        """Yield every judged margin: subject, what is left to its limit, its bound, a sentence."""
        limits, robot = self.settings.limits, self.settings.robot
        if self._bounds is None:
            return
        torque, angle = self._bounds
        rows = zip(robot.joint_names, limits.torque, margins.torque, torque.tolist(), strict=True)
        for name, limit, tau, bound in rows:
            if math.isfinite(limit):
                unit = robot.joint(name).units.effort
                left = limits.torque_error * limit - abs(tau)
                words = f'{name} has {left:.1f} {unit} left to its limit'
                yield name, left, bound, f'{words}, known to +/- {bound:.1f} {unit}'
        for side, tilt, bound in zip(SIDES, margins.angle, angle.tolist(), strict=True):
            left = float(tilt) - limits.tip_error
            if math.isfinite(left):
                least = degrees_words(limits.tip_error)
                words = f'{tipping_words(side, float(tilt))} (DANGER from {least} on)'
                yield side, left, bound, f'{words}, known to +/- {excess_words(bound)}'

    def _computed(self, margins: Margins, payload: Payload) -> bool:
        """Return whether the bounds of torques (j,) and angles (4,) are there for these margins.

        If not, they are being computed: again where the robot has moved since the last time.
        """
        at = self._at
        if self._asked is None:
            now = snapshot_of(self.settings, margins, payload)
            if at is not None and at.holds(now, MOVED, TURNED):
                return True
            at = self._at = now
            case = at.settings, self.sources, at.q, at.gravity, at.payload
            self._asked = self.pool.submit(effects_of, *case)
        if not self._asked.done():
            return False
        asked, self._asked, self._at = self._asked, None, None
        found = asked.result()
        self._at = at
        torque = found.torque + self.settings.limits.torque_error * found.limit
        self._bounds = combined(torque, RSS), combined(found.angle, RSS)
        return True
