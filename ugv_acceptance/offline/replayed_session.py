"""A monitoring session fed from an evaluated recording, so that the monitor's functions apply.

It provides what `verdict_of` and `alert_status` need of a running session, at a moment of the past.
"""

from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import repeat
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts.alarms import Change
from ugv_acceptance.evaluation.alerts.prediction_limits import SPACING as LOOK
from ugv_acceptance.evaluation.alerts.rules import RuleSet
from ugv_acceptance.evaluation.alerts.state_machine import OK, STALE, Alert
from ugv_acceptance.evaluation.alerts.tipping_watch import TippingWatch
from ugv_acceptance.evaluation.ground import KINDS
from ugv_acceptance.evaluation.inputs.timeouts import FOREVER
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import Stability
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.monitoring.trends import SPACING, Trends
from ugv_acceptance.offline.replayed_advice import Book, Measured, PastAdvisory
from ugv_acceptance.type_aliases import Floats

Mask = NDArray[np.bool_]


@dataclass(slots=True)
class PastClock:
    """A receipt clock that stands at the log time `at` (ns)."""

    at: int = 0

    def now(self) -> int:
        """Return the log time that the clock was set to."""
        return self.at


@dataclass(slots=True)
class ReplayedSession(Session):
    """A Session at a moment of a recording.

    `told` is the result's advice, by `moment_of` an alert; `book` has the advice of moments.
    """

    told: Mapping[tuple[int, str, str, int], str] = field(default_factory=dict)
    book: Book = field(default_factory=dict)

    def __post_init__(self) -> None:
        Session.__post_init__(self)
        of = self.evaluator, self.trends, self.on_problem
        self.advisory = PastAdvisory(*of, pool=self.pool, told=self.told, book=self.book)

    @property
    def active(self) -> list[Alert]:
        """Alerts that were active at that moment, the most severe first."""
        return sorted(self.alarm_tracker.open, key=lambda alert: -alert.rule.level)

    @property
    def level(self) -> int:
        """The most severe level at that moment."""
        known = self.evaluator.margins is not None and not self.evaluator.waits_for_trend
        return max([OK if known else STALE, *(a.rule.level for a in self.active)])

    def take(self, margins: Margins | None, payload: Payload, measured: Measured) -> None:
        """Take the margins of a message (None if unknown), its payload, rates and efforts."""
        self.evaluator.margins, self.evaluator.payload = margins, payload
        if isinstance(self.advisory, PastAdvisory):
            self.advisory.measured = measured
        if margins is not None:
            self.trends.see(margins)

    def raise_alert(self, alert: Alert) -> list[Change]:
        """Raise an alert and return the changes; to clear it later, set `end` on that object."""
        self.evaluator.watch.log.append(alert)
        return self.alarm_tracker.take()


class _Taken(NamedTuple):
    """A row that a session takes: when it was received and until when it holds (ns), and its rest.

    `ground` is a number in KINDS, None where it is flat all the time.
    """

    time: int
    until: int
    stamp: int
    margins: Margins | None
    load: Payload
    measured: Measured
    ground: int | None


@dataclass(slots=True)
class Replay:
    """Feeds a session with the rows of a recording's parts, up to one moment after another.

    It leaves out rows that change nothing the session keeps: at each moment told before the session
    is as if it had taken all rows. `payload_at` gives the payload at a time (ns), `stamp` is the
    header's stamp (ns) of the newest row.
    """

    session: ReplayedSession
    payload_at: Callable[[int], Payload]
    stamp: int = 0
    _settings: Settings = field(init=False)
    _trend: TippingWatch = field(init=False)
    _waiting: Iterator[_Taken] = field(init=False)
    _next: _Taken | None = None
    _until: int = 0

    def __post_init__(self) -> None:
        self._waiting = iter(())
        self._settings = self.session.settings
        self._trend = RuleSet(self._settings).trend

    def part(self, rows: MarginRows, moments: Sequence[int]) -> None:
        """Begin the next part, to be taken up to each of `moments` (ns) in turn and to its end."""
        self._take_until(FOREVER)
        telling = _least(rows, self.session) | _first_of_looks(rows, self._trend.due)
        telling[_spaced(rows, self.session.trends)] = True
        newest = np.searchsorted(rows.time, np.array(moments, np.int64), side='right') - 1
        telling[newest[newest >= 0]] = True
        telling[-1] = True
        kind = rows.ground.kind
        if len(kind):
            telling |= np.append(True, kind[1:] != kind[:-1])
        self._wait(rows, np.flatnonzero(telling))

    def _wait(self, rows: MarginRows, at: NDArray[np.intp]) -> None:
        """Keep some rows of a part, to be taken when their time has come."""
        self._waiting = _taken(rows, at, self.payload_at)
        self._next = next(self._waiting, None)

    def to(self, now: int) -> None:
        """Take all rows of this part until `now` (ns); without margins where they have ended."""
        self._take_until(now)
        if now > self._until:
            self.session.evaluator.margins = None

    def _take_until(self, now: int) -> None:
        while (row := self._next) is not None and row.time <= now:
            self._next = next(self._waiting, None)
            self._until, self.stamp = row.until, row.stamp
            self.session.take(row.margins, row.load, row.measured)
            if row.ground is not None:
                self._stand_on(row.ground, row.margins, row.load)

    def _stand_on(self, number: int, margins: Margins | None, load: Payload) -> None:
        """Let the session stand on a kind of ground (a number in KINDS), with the trend so far."""
        session, trend = self.session, self._trend
        if session.settings.ground.taken != KINDS[number]:
            ground = replace(self._settings.ground, kind=KINDS[number])
            settings = replace(self._settings, ground=ground)
            session.settings = session.evaluator.settings = settings
            trend.adopt(settings)
        if margins is not None and margins.time >= trend.due:
            trend.keep(margins.time, margins.angle, margins.q, margins.gravity, load)
            trend.judge()
        session.evaluator.watch.trend.level = trend.level
        session.evaluator.watch.trend.cautious = trend.cautious


def _least(rows: MarginRows, session: Session) -> Mask:
    """Return which rows have a margin smaller than all before."""
    before = [least for least, _ in (*session.trends.tilt, *session.trends.load)]
    left = np.array(session.settings.limits.torque) - np.abs(rows.torque)
    table = np.vstack((before, np.hstack((rows.angle, left))))
    lower = table[1:] < np.fmin.accumulate(table, axis=0)[:-1]
    return np.asarray(lower.any(axis=1) & rows.known)


def _spaced(rows: MarginRows, trends: Trends) -> list[int]:
    """Return the rows from which rates of change are taken: SPACING apart."""
    known = np.flatnonzero(rows.known)
    times, found = rows.time[known].tolist(), list[int]()
    due, k = trends.due, 0
    while (k := bisect_left(times, due, k)) < len(times):
        found.append(int(known[k]))
        due = times[k] + SPACING
    return found


def _first_of_looks(rows: MarginRows, due: int) -> Mask:
    """Return which rows are the first with margins of a look at the ground; the next is `due`."""
    first = np.zeros(len(rows.time), np.bool_)
    if len(rows.ground.kind):
        known = np.flatnonzero(rows.known)
        cell = rows.time[known] // LOOK
        first[known[np.diff(cell, prepend=due // LOOK - 1) > 0]] = True
    return first


def _taken(
    rows: MarginRows, at: NDArray[np.intp], payload_at: Callable[[int], Payload]
) -> Iterator[_Taken]:
    """Yield some rows of a part as a session takes them."""
    joints, j, i = rows.pairs.joints, rows.pairs.of_joints[at], rows.pairs.of_imu[at]
    alone = (rows.time, rows.until, rows.stamp, rows.known, rows.zmp, rows.state)
    felt = (joints.q[j], rows.pairs.imu.gravity[i], joints.qd[j], joints.effort[j])
    tables = (rows.torque[at], rows.angle[at], rows.moment[at], rows.energy[at])
    flat = not len(rows.ground.kind)
    grounds = repeat(None, len(at)) if flat else rows.ground.kind[at].tolist()
    numbers = zip(*(column[at].tolist() for column in alone), strict=True)
    inputs, outputs = (zip(*map(_rows, group), strict=True) for group in (felt, tables))
    heard = joints.time[j].tolist()
    for one, (q, gravity, *measured), found, when, ground in zip(
        numbers, inputs, outputs, heard, grounds, strict=True
    ):
        time, until, stamp, known, zmp, state = one
        torque, angle, moment, energy = found
        margins = None
        if known:
            stability = Stability(angle, moment, energy, zmp, state)
            margins = Margins(time, stamp, q, gravity, torque, angle, state, stability)
        rates, efforts = measured
        yield _Taken(time, until, stamp, margins, payload_at(when), (rates, efforts), ground)


def _rows(table: Floats) -> Iterator[tuple[float, ...]]:
    """Yield the rows of a table: all at once, they would keep the garbage collector busy."""
    columns = [column.tolist() for column in table.T]
    return zip(*columns, strict=True) if columns else repeat((), len(table))
