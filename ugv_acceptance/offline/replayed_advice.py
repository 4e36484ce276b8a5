"""Advice for the moments of a recording, searched for many moments together.

The search of one moment takes as long as that of fifty, so that the moments of a part are searched
before its verdicts are made.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ugv_acceptance.evaluation.advice.search import COMPUTED, Advice, advise, advise_each
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR
from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.effort.understanding import understand
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.monitoring.advisory import Advisory
from ugv_acceptance.type_aliases import Times

# Rates and efforts of the joints, NaN where not reported.
Measured = tuple[tuple[float, ...], tuple[float, ...]]
Book = dict[int, tuple[Advice, ...]]


def moment_of(alert: Alert) -> tuple[int, str, str, int]:
    """Return the key of an alert in a run: start (ns), code, subject and level."""
    return alert.start, alert.rule.code, alert.rule.subject, alert.rule.level


@dataclass(slots=True)
class AdviceBook:
    """Searches the advice of the moments of one part after another; `found` has it by time (ns).

    `payload_at` gives the payload at a time (ns), `alerts` are those of the run.
    """

    settings: Settings
    payload_at: Callable[[int], Payload]
    alerts: Iterable[Alert]
    found: Book = field(default_factory=dict)
    _starts: Times = field(init=False)
    _ends: Times = field(init=False)

    def __post_init__(self) -> None:
        mine = [alert for alert in self.alerts if alert.rule.code in COMPUTED]
        self._starts = np.sort(np.array([a.start for a in mine], np.int64))
        self._ends = np.sort(np.array([a.end for a in mine if a.end is not None], np.int64))

    def look_up(self, rows: MarginRows, times: Sequence[int]) -> None:
        """Search for the `times` (ns) of a part at which an alert needs advice; forget others."""
        at = np.array(times, np.int64)
        begun = np.searchsorted(self._starts, at, side='right')
        at = at[begun > np.searchsorted(self._ends, at)]
        row = np.searchsorted(rows.time, at, side='right') - 1
        wanted = (row >= 0) & rows.known[row] & (at <= rows.until[row])
        heard = rows.pairs.joints.time[rows.pairs.of_joints[row]]
        alike: dict[Payload, list[int]] = {}
        for k in np.flatnonzero(wanted).tolist():
            alike.setdefault(self.payload_at(int(heard[k])), []).append(k)
        self.found.clear()
        for payload, some in alike.items():
            q = rows.pairs.joints.q[rows.pairs.of_joints[row[some]]]
            gravity = rows.pairs.imu.gravity[rows.pairs.of_imu[row[some]]]
            told = advise_each(self.settings, q, gravity, payload, [None] * len(some))
            self.found.update(zip(at[some].tolist(), told, strict=True))


@dataclass(slots=True)
class PastAdvisory(Advisory):
    """Advice for a recording, computed at once and not in a thread.

    `told` is the advice of the result, by `moment_of` an alert; `book` has advice by time (ns), and
    what is missing in it is searched. `measured` are the newest rates and efforts.
    """

    told: Mapping[tuple[int, str, str, int], str] = field(default_factory=dict)
    book: Book = field(default_factory=dict)
    measured: Measured = ((), ())

    def renew(self, now: int, active: list[Alert]) -> None:
        """Look up advice if an active alert needs it."""
        margins, evaluator = self.evaluator.margins, self.evaluator
        self.advice = ()
        if margins is not None and any(alert.rule.code in COMPUTED for alert in active):
            if now not in self.book:
                case = evaluator.settings, margins.q, margins.gravity, evaluator.payload
                self.book[now] = advise(*case)
            self.advice = self.book[now]

    def feel(self) -> None:
        """Remember the efforts at rest and judge them now and then; to be called once a second."""
        margins = self.evaluator.margins
        if margins is None:
            return
        q, gravity, torque = margins.q, margins.gravity, margins.torque
        if self.rests.see(margins.time, q, *self.measured, gravity, torque):
            self.felt(understand(self.evaluator.settings, (), self.rests.rests()))

    def do(self, alert: Alert) -> str:
        """Return the advice for an alert now, else that of the moment when it was raised."""
        rule = alert.rule
        if self.tipped:
            return STAND_CLEAR
        if rule.code in COMPUTED and self.advice and self.advice[0].margin == rule.subject:
            return self.advice[0].sentence
        return self.told[moment_of(alert)]
