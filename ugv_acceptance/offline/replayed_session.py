"""A monitoring session fed from an evaluated recording, so that the monitor's functions apply.

It provides what `verdict_of` and `alert_status` need of a running session, at a moment of the past.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from ugv_acceptance.evaluation.advice.search import COMPUTED, advise
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR
from ugv_acceptance.evaluation.alerts.alarms import Change
from ugv_acceptance.evaluation.alerts.state_machine import OK, STALE, Alert
from ugv_acceptance.evaluation.effort.understanding import understand
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.monitoring.advisory import Advisory
from ugv_acceptance.monitoring.session import Session

# Rates and efforts of the joints, NaN where not reported.
Measured = tuple[tuple[float, ...], tuple[float, ...]]


@dataclass(slots=True)
class PastClock:
    """A receipt clock that stands at the log time `at` (ns)."""

    at: int = 0

    def now(self) -> int:
        """Return the log time that the clock was set to."""
        return self.at


@dataclass(slots=True)
class PastAdvisory(Advisory):
    """Advice for a recording, computed at once and not in a thread.

    `told` is the advice of the result, by `moment_of` an alert; `measured` are the newest rates and
    efforts.
    """

    told: Mapping[tuple[int, str, str, int], str] = field(default_factory=dict)
    measured: Measured = ((), ())

    def renew(self, now: int, active: list[Alert]) -> None:  # noqa: ARG002 - as its base
        """Compute advice if an active alert needs it."""
        margins, evaluator = self.evaluator.margins, self.evaluator
        self.advice = ()
        if margins is not None and any(alert.rule.code in COMPUTED for alert in active):
            case = evaluator.settings, margins.q, margins.gravity, evaluator.payload
            self.advice = advise(*case)

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


def moment_of(alert: Alert) -> tuple[int, str, str, int]:
    """Return the key of an alert in a run: start (ns), code, subject and level."""
    return alert.start, alert.rule.code, alert.rule.subject, alert.rule.level


@dataclass(slots=True)
class ReplayedSession(Session):
    """A Session at a moment of a recording; `told` is the result's advice, by `moment_of`."""

    told: Mapping[tuple[int, str, str, int], str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        Session.__post_init__(self)
        self.advisory = PastAdvisory(
            self.evaluator, self.trends, self.on_problem, pool=self.pool, told=self.told
        )

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
