"""Watches for a robot that begins to tip on ground that is not flat: TIP_TREND.

One sample each 50 ms (a *look*, as in prediction.py) is kept with its cautious margin; the rule is
tipping_trend.py. Live looks wait until time passes (`judge`); recorded ones come as columns.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts.prediction_limits import MOST, SPACING
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, WARN, Signal, feed
from ugv_acceptance.evaluation.ground import FLAT, KINDS
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.margin_words import rate_words
from ugv_acceptance.evaluation.rough_ground import cautious_angles, cautious_mechanics
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.evaluation.tipping_trend import LOOKS, NOT_KNOWN, OK, TREND, Trend, trend_of
from ugv_acceptance.model.edges import SIDES
from ugv_acceptance.model.mechanics import Mechanics
from ugv_acceptance.model.robot import Payload, Vector
from ugv_acceptance.type_aliases import Floats, Times

Mask = NDArray[np.bool_]
# A value of a signal is minus the time left (s), at least this; less where nothing is wrong.
LEAST_VALUE = -1e6
NOTHING = (math.nan,) * (2 * len(SIDES))


@dataclass(slots=True)
class TippingWatch:
    """The signals of TIP_TREND (WARN, ERROR), and the looks they are judged by.

    `level` is that of the newest look: OK, WARN, ERROR or NOT_KNOWN of tipping_trend.py, `cautious`
    its least cautious margin (rad, NaN: not known); both mean nothing on flat ground. `counted` are
    the looks for which a trend could be known, and those of them for which it was; `due` is
    when the next look is to be taken (ns).
    """

    settings: Settings
    signals: tuple[Signal, Signal]
    level: int = NOT_KNOWN
    cautious: float = math.nan
    counted: tuple[int, int] = (0, 0)
    due: int = 0
    _waiting: deque[tuple[int, tuple[float, ...]]] = field(
        default_factory=lambda: deque(maxlen=MOST)
    )
    _time: Times = field(default_factory=lambda: np.empty(0, np.int64))
    _short: Mechanics | None = None
    _looks: Floats = field(default_factory=lambda: np.empty((0, len(NOTHING))))

    def keep(
        self, now: int, angle: Sequence[Any], q: Sequence[float], gravity: Vector, load: Payload
    ) -> None:
        """Keep a live look at `now` (ns) for the next `judge`: margins (rad), posture, payload.

        On flat ground nothing is kept but that a look was not one of rough ground.
        """
        self.due = now - now % SPACING + SPACING
        if self.settings.ground.rough:
            if self._short is None:
                self._short = cautious_mechanics(self.settings.robot, self.settings.ground.pitch)
            cautious = cautious_angles(self._short, q, gravity, load)
            self.cautious = min(cautious)
            self._waiting.append((now, (*map(float, angle), *cautious)))
        elif len(self._time) or self._waiting:
            self._waiting.append((now, NOTHING))

    def judge(self) -> None:
        """Judge the live looks kept since the last call."""
        if not self._waiting:
            return
        time, looks = zip(*self._waiting, strict=True)
        self._waiting.clear()
        self._judge(np.array(time, np.int64), np.array(looks, np.float64))

    def adopt(self, settings: Settings) -> None:
        """Take other settings from now on; on another kind of ground the trend is not known yet."""
        if settings.ground != self.settings.ground:
            self.level, self.cautious = NOT_KNOWN, math.nan
        if settings.ground.pitch != self.settings.ground.pitch:
            self._short = None
        self.settings = settings

    def rows(self, rows: MarginRows) -> None:
        """Judge the next part of a recording."""
        if not len(rows.ground.kind):
            return
        at = np.flatnonzero(rows.known)
        cell = rows.time[at] // SPACING
        at = at[np.diff(cell, prepend=self.due // SPACING - 1) > 0]
        if not len(at):
            return
        time = rows.time[at]
        self.due = int(time[-1] - time[-1] % SPACING + SPACING)
        looks = np.hstack((rows.angle[at], rows.ground.cautious[at]))
        looks[rows.ground.kind[at] == KINDS.index(FLAT)] = np.nan
        self._judge(time, looks)

    def _judge(self, time: Times, looks: Floats) -> None:
        """Feed the signals with new looks (n, 8): margins and cautious margins, NaN where flat."""
        old, sides = len(self._time), len(SIDES)
        time, looks = np.concatenate((self._time, time)), np.concatenate((self._looks, looks))
        found = trend_of(time, looks[:, :sides], looks[:, sides:])
        left = np.where(np.isnan(found.left), 0.0, found.left)
        for signal, level in zip(self.signals, (WARN, ERROR), strict=True):
            bad = found.level >= level
            values = np.where(bad, np.maximum(-left, LEAST_VALUE), -np.inf)
            feed(signal, time[old:], values[old:], lambda row: trend_words(found, row + old))
        rough = np.isfinite(looks).any(axis=1)
        self._count(np.asarray(rough), np.isfinite(found.slope), old)
        self.level = int(found.level[-1])
        self._time, self._looks = time[1 - LOOKS :], looks[1 - LOOKS :]
        if np.isnan(self._looks).all():
            self._time, self._looks = self._time[:0], self._looks[:0]

    def _count(self, rough: Mask, known: Mask, old: int) -> None:
        """Count the looks from the `old`th on; where ground begins a trend cannot be known yet."""
        at = np.arange(len(rough))
        flat = np.maximum.accumulate(np.where(rough, -1, at))
        due = rough & (known | (at - flat >= LOOKS))
        found = [int(where[old:].sum()) for where in (due, due & known)]
        self.counted = self.counted[0] + found[0], self.counted[1] + found[1]


def trend_words(trend: Trend, row: int) -> str:
    """Return how fast a margin shrinks at a look, and how long it lasts; else that it is small."""
    side, slope, left = SIDES[trend.side[row]], trend.slope[row], trend.left[row]
    if not (slope <= -TREND.rate and math.isfinite(left)):
        words = 'little is left to tipping, taken cautiously (as if half a step were missing)'
        return f'{words}: {side.upper()}'
    rate = rate_words(float(-slope), 'rad/s')
    words = f'the robot begins to tip: {side.upper()}, by {rate}'
    return f'{words}, {left:.1f} s until nothing is left'


__all__ = ['NOT_KNOWN', 'OK', 'TippingWatch', 'trend_words']
