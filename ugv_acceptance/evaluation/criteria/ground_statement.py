"""What ground that is not flat means for a verdict: tip-over is shown only by an accepted rule.

Margins in degrees hold on flat ground. On uneven ground and stairs they are an upper bound, so
meeting a limit shows nothing; criteria may accept the trend or the cautious margin, with a reason.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts.messages import describe
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, Alert
from ugv_acceptance.evaluation.alerts.tipping_watch import TippingWatch
from ugv_acceptance.evaluation.criteria.criteria import (
    CAUTIOUS,
    FAIL,
    INCONCLUSIVE,
    TREND,
    CriteriaSet,
)
from ugv_acceptance.evaluation.criteria.statement import NotChecked, Objection, Statement
from ugv_acceptance.evaluation.ground import CARRIED, FLAT, KINDS
from ugv_acceptance.evaluation.holding_back import doubtful_spans, drawn_in_doubt
from ugv_acceptance.evaluation.least_margins import LeastTilt
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.margin_words import (
    degrees_words,
    percent_words,
    share_words,
    tipping_words,
)
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.shortened_tracks import has_tracks
from ugv_acceptance.model.stability import RAISED
from ugv_acceptance.type_aliases import Json, Times

SAFEGUARD = 'ground'
Numbers = NDArray[np.int8]


@dataclass(slots=True)
class GroundExamination:
    """Looks at the ground a run was made on: an examination of statement.py.

    `watch` is that of the evaluation, `log` its alerts so far. Seconds with margins are counted by
    kind of ground, and where points below the tracks carry the robot on flat ground.
    """

    settings: Settings
    criteria: CriteriaSet
    watch: TippingWatch
    log: Sequence[Alert]
    _held: Times = field(default_factory=lambda: np.zeros(len(KINDS), np.int64))
    _raised: int = 0
    _not_cautious: int = 0
    _bound: LeastTilt = field(default_factory=LeastTilt)
    _cautious: LeastTilt = field(default_factory=LeastTilt)
    _last: tuple[int, int, int, bool, bool] | None = None

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording."""
        if not len(rows.time):
            return
        self._settle(int(rows.time[0]))
        known, rough = rows.known, len(rows.ground.kind) > 0
        kind = rows.ground.kind if rough else np.zeros(len(known), np.int8)
        raised = (rows.state == RAISED) & (kind == KINDS.index(FLAT))
        blank = np.zeros(len(known), np.bool_)
        if rough:
            blank = (kind != KINDS.index(FLAT)) & np.isnan(rows.ground.cautious).any(axis=1)
            some = known & (kind != KINDS.index(FLAT))
            self._bound.take(rows.time[some], rows.angle[some])
            self._cautious.take(rows.time[some], rows.ground.cautious[some])
        held = np.where(known, rows.until - rows.time, 0)
        held[-1] = 0
        by_kind = [int(held[kind == k].sum()) for k in range(len(KINDS))]
        self._held += by_kind
        self._raised += int(held[raised].sum())
        self._not_cautious += int(held[blank].sum())
        if known[-1]:
            end = int(rows.time[-1]), int(rows.until[-1])
            self._last = *end, int(kind[-1]), bool(raised[-1]), bool(blank[-1])

    def _settle(self, now: int) -> None:
        """Count the last row, now that the next message or the end (`now`, ns) is known."""
        if self._last is not None:
            time, until, kind, raised, blank = self._last
            held = max(min(until, now) - time, 0)
            self._held[kind] += held
            self._raised += held if raised else 0
            self._not_cautious += held if blank else 0
        self._last = None

    @property
    def _rough(self) -> float:
        """Seconds with margins on ground that is not flat; 0 where tip-over is not judged."""
        return float(self._held[1:].sum()) / 1e9 if self.settings.judges_tilt else 0.0

    def statement(self, start: int, end: int) -> Statement:
        """Return what was found in the recording from `start` to `end` (ns)."""
        self._settle(end)
        ground, accept = self.settings.ground, self.criteria.ground
        objections = tuple(self._objections(start)) if self._rough else ()
        looks, judged = self.watch.counted
        result: Json = {
            'kind': ground.kind,
            'windows': [
                {'kind': w.kind, 'start_s': w.start, 'end_s': w.end} for w in ground.windows
            ],
            'pitch_m': ground.pitch,
            'seconds': dict(zip(KINDS, (self._held / 1e9).tolist(), strict=True)),
            'raised_on_flat_s': self._raised / 1e9,
            'upper_bound': self._bound.json(start),
            'cautious': self._cautious.json(start),
            'trend_known_share': judged / looks if looks else None,
            'accepted': accept and {'rule': accept.rule, 'reason': accept.reason},
            'objections': [o.reason for o in objections],
        }
        return Statement({SAFEGUARD: result}, objections, tuple(self._not_checked()))

    def _kinds(self) -> str:
        found = [kind for kind, held in zip(KINDS[1:], self._held[1:], strict=True) if held]
        return ' and '.join(found)

    def _not_checked(self) -> Iterator[NotChecked]:
        if self._rough:
            why = (
                f'taken as {self._kinds()}: which part of a track touches is not known, so margins '
                'in degrees are an upper bound'
            )
            yield NotChecked('ground', why, self._rough)
        if self._raised and has_tracks(self.settings.robot):
            yield NotChecked('ground under the flippers', CARRIED, self._raised / 1e9)

    def _objections(self, start: int) -> Iterator[Objection]:
        accept = self.criteria.ground
        told = [
            f'at {(a.start - start) / 1e9:.2f} s: {self._words(a, start)}' for a in self._tipping()
        ]
        if accept is None:
            reason = (
                f'the ground was taken as {self._kinds()} for {self._rough:.1f} s: margins in '
                'degrees are an upper bound there and show no safe distance from tipping over; '
                'criteria can accept the trend or the cautious margin (ground: accept)'
            )
            yield Objection(SAFEGUARD, INCONCLUSIVE, reason, tuple(told))
            return
        for text in told[:1]:
            yield Objection(SAFEGUARD, FAIL if accept.rule == TREND else INCONCLUSIVE, text)
        yield from self._trend() if accept.rule == TREND else self._cautiously(start)

    def _words(self, alert: Alert, start: int) -> str:
        return describe(alert, self.settings, start)

    def _tipping(self) -> Iterator[Alert]:
        """Yield the alerts of a robot that begins to tip which rest on margins to be believed."""
        doubtful = list(doubtful_spans(self.log))
        for alert in self.log:
            of = alert.rule.code == 'TIP_TREND' and alert.rule.level == ERROR
            if of and not drawn_in_doubt(alert, doubtful):
                yield alert

    def _trend(self) -> Iterator[Objection]:
        looks, judged = self.watch.counted
        needed = self.criteria.coverage
        if judged < needed * looks or not looks:
            share = judged / looks if looks else 0.0
            reason = (
                f'on {self._kinds()} the trend of the tilt left is known for '
                f'{share_words(share, 1)} of the time only ({percent_words(needed)} needed)'
            )
            yield Objection(SAFEGUARD, INCONCLUSIVE, reason)

    def _cautiously(self, start: int) -> Iterator[Objection]:
        least, limit = self._cautious, self.settings.limits.tip_error
        if self._not_cautious:
            seconds = self._not_cautious / 1e9
            reason = f'on {self._kinds()} the cautious margin is not known for {seconds:.1f} s'
            yield Objection(SAFEGUARD, INCONCLUSIVE, reason)
        if least.value <= limit:
            reason = (
                f'at {(least.time - start) / 1e9:.2f} s, taken cautiously for {self._kinds()}, '
                f'{tipping_words(least.side, least.value)}; must stay above {degrees_words(limit)}'
            )
            yield Objection(SAFEGUARD, INCONCLUSIVE, reason)


__all__ = ['CAUTIOUS', 'SAFEGUARD', 'GroundExamination']
