"""What chassis acceleration means for a verdict: objections, the worst, what was not checked."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.chassis.filters import TRUE
from ugv_acceptance.evaluation.chassis.motion import LIFT
from ugv_acceptance.evaluation.criteria.criteria import FAIL, INCONCLUSIVE
from ugv_acceptance.evaluation.criteria.statement import NotChecked, Objection, Statement
from ugv_acceptance.evaluation.least_margins import LeastTilt
from ugv_acceptance.evaluation.margin_table import ChassisRows, MarginRows
from ugv_acceptance.model.edges import SIDES
from ugv_acceptance.type_aliases import Floats, Json, Times

SAFEGUARD = 'chassis_acceleration'
# Events further apart than this (ns) are told as two.
APART = 1_000_000_000
# Fewer seconds without a check are not worth a line: the filters need some at the start.
FEW_SECONDS = 1.0
# A joint that moved by more than this (rad, m) is an arm that swung.
MOVED = 0.02


@dataclass(slots=True)
class _Event:
    """One kind of event: how many, and the first: time (ns) and side."""

    count: int = 0
    first: tuple[int, str] = (0, '')
    newest: int = 0

    def take(self, time: Times, where: NDArray[np.bool_]) -> None:
        """Take rows at `time` (m,) and to which sides it happens (m, 4)."""
        for k in np.flatnonzero(where.any(axis=1)).tolist():
            now = int(time[k])
            if not self.count:
                self.first = now, SIDES[int(where[k].argmax())]
            self.count += not self.count or now - self.newest > APART
            self.newest = now


@dataclass(slots=True)
class ChassisExamination:
    """Looks at what the chassis felt in a run: an examination of criteria/statement.py."""

    _moving: LeastTilt = field(default_factory=LeastTilt)
    _effective: LeastTilt = field(default_factory=LeastTilt)
    _tips: _Event = field(default_factory=_Event)
    _lifts: _Event = field(default_factory=_Event)
    _denied: _Event = field(default_factory=_Event)
    _seconds: Floats = field(default_factory=lambda: np.zeros(5))
    _low: Floats | None = None
    _high: Floats | None = None

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part; what was found in rows without margins is left out."""
        found, q = rows.chassis, rows.pairs.joints.q
        if len(q):
            low, high = np.fmin.reduce(q, axis=0), np.fmax.reduce(q, axis=0)
            self._low = low if self._low is None else np.fmin(low, self._low)
            self._high = high if self._high is None else np.fmax(high, self._high)
        seconds = _seconds_of(found)
        self._seconds += seconds
        alive = rows.known[found.rows]
        if not alive.any():
            return
        time = rows.time[found.rows][alive]
        moving, effective = found.moving[alive], found.effective[alive]
        self._moving.take(time, moving)
        self._effective.take(time, effective)
        self._tips.take(time, moving <= 0.0)
        self._lifts.take(time, found.lifted[alive])
        self._denied.take(time, found.denied[alive])

    def statement(self, start: int, end: int) -> Statement:
        """Return what was found in the recording from `start` to `end` (ns)."""
        del end
        known, judged, believed, *_ = self._seconds.tolist()
        result: Json = {
            'judged_s': judged,
            'judged_share': judged / known if known else 0.0,
            'accelerometer_share': believed / judged if judged else 0.0,
            'least_moving': self._moving.json(start),
            'least_effective': self._effective.json(start),
            'tips': self._tips.count,
            'lifts': self._lifts.count,
            'contradictions': self._denied.count,
        }
        return Statement(
            {SAFEGUARD: result}, tuple(self._objections(start)), tuple(self._not_checked())
        )

    def _objections(self, start: int) -> Iterator[Objection]:
        lifted = (
            'an end of the tracks lifted: pushed to the {side}, the robot turned there by over '
            f'{math.degrees(LIFT):g} degree'
        )
        denied = (
            'past tipping to the {side} by one sensor of the IMU, but not by the others: gyro, '
            'accelerometer and orientation contradict each other'
        )
        told = (
            (self._tips, FAIL, 'the robot turned so fast to the {side} that it tips over'),
            (self._lifts, INCONCLUSIVE, lifted),
            (self._denied, INCONCLUSIVE, denied),
        )
        for event, verdict, words in told:
            if event.count:
                time, side = event.first
                more = f' (and {event.count - 1} more)' if event.count > 1 else ''
                reason = f'at {(time - start) / 1e9:.2f} s {words.format(side=side)}{more}'
                yield Objection(SAFEGUARD, verdict, reason)

    def _not_checked(self) -> Iterator[NotChecked]:
        _, judged, believed, no_gyro, slow = self._seconds.tolist()
        what = 'chassis acceleration'
        if no_gyro > FEW_SECONDS:
            yield NotChecked(what, 'the IMU measures no rate, or only zeros', no_gyro)
        if slow > FEW_SECONDS:
            yield NotChecked(what, 'the IMU sends fewer than 50 messages a second', slow)
        if judged - believed > FEW_SECONDS:
            why = (
                f'the mean acceleration of 2 s is over {TRUE:g} m/s2 off gravity: only the gyro '
                'is used'
            )
            yield NotChecked('braking and turning', why, judged - believed)
        if self._low is not None and self._high is not None:
            travel = self._high - self._low
            if (travel[np.isfinite(travel)] > MOVED).any():
                why = 'the IMU on the chassis does not feel the inertia of the arm'
                yield NotChecked('arm swings', why)


def _seconds_of(found: ChassisRows) -> Floats:
    return np.array(
        [found.known_s, found.judged_s, found.believed_s, found.no_gyro_s, found.slow_s]
    )
