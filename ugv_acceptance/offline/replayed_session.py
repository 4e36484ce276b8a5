"""A monitoring session replayed from a recording's judgement, for the monitor's own words.

It holds what `verdict_of` and `alert_status` ask a running session for, at a moment of the past.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from ugv_acceptance.evaluation.advice.search import COMPUTED, advise
from ugv_acceptance.evaluation.alerts.alarms import Change
from ugv_acceptance.evaluation.alerts.state_machine import OK, STALE, Alert
from ugv_acceptance.evaluation.effort.plateaus import payload_estimate
from ugv_acceptance.evaluation.live import Margins
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.monitoring.advisory import Advisory
from ugv_acceptance.monitoring.receipt_clock import ReceiptClock
from ugv_acceptance.monitoring.session import Session

# Rates and efforts of the joints, NaN where not reported.
Measured = tuple[tuple[float, ...], tuple[float, ...]]


@dataclass(slots=True)
class PastClock(ReceiptClock):
    """A clock that stands at a log time (ns)."""

    at: int = 0

    def now(self) -> int:
        """Return the time it was set to."""
        return self.at


@dataclass(slots=True)
class PastAdvisory(Advisory):
    """Advice worked out at once. `told` is that of an alert's moment; `measured` the newest."""

    told: Mapping[tuple[int, str, str, int], str] = field(default_factory=dict)
    measured: Measured = ((), ())

    def renew(self, now: int, active: list[Alert]) -> None:  # noqa: ARG002 - as its base
        """Work the advice out where it is asked for."""
        margins, evaluator = self.evaluator.margins, self.evaluator
        self.advice = ()
        if margins is not None and any(alert.rule.code in COMPUTED for alert in active):
            case = evaluator.settings, margins.q, margins.gravity, evaluator.payload
            self.advice = advise(*case)

    def feel(self) -> None:
        """Look at the efforts; to be called once a second."""
        margins, evaluator = self.evaluator.margins, self.evaluator
        found = None
        if margins is not None:
            known = evaluator.settings, margins.q, *self.measured, margins.gravity
            found = payload_estimate(*known, evaluator.payload)
        self.felt(found)

    def do(self, alert: Alert) -> str:
        """Return what to do now; else what was to be done when the alert was raised."""
        rule = alert.rule
        if rule.code in COMPUTED and self.advice and self.advice[0].margin == rule.subject:
            return self.advice[0].sentence
        return self.told[moment_of(alert)]


def moment_of(alert: Alert) -> tuple[int, str, str, int]:
    """Return what tells the alerts of a run apart."""
    return alert.start, alert.rule.code, alert.rule.subject, alert.rule.level


@dataclass(slots=True)
class ReplayedSession(Session):
    """The session; `told` is what to do about each alert, by `moment_of`."""

    told: Mapping[tuple[int, str, str, int], str] = field(default_factory=dict)
    past: PastClock = field(default_factory=PastClock)

    def __post_init__(self) -> None:
        self.clock = self.past
        Session.__post_init__(self)
        self.advisory = PastAdvisory(self.evaluator, self.trends, self.on_problem, told=self.told)

    @property
    def active(self) -> list[Alert]:
        """The alerts that were active then, the most severe first."""
        return sorted(self.alarm_tracker.open, key=lambda alert: -alert.rule.level)

    @property
    def level(self) -> int:
        """The most severe level then."""
        return max([OK if self.evaluator.margins else STALE, *(a.rule.level for a in self.active)])

    def take(self, margins: Margins | None, payload: Payload, measured: Measured) -> None:
        """Take the margins of a message, None: they were not known."""
        self.evaluator.margins, self.evaluator.payload = margins, payload
        if isinstance(self.advisory, PastAdvisory):
            self.advisory.measured = measured
        if margins is not None:
            self.trends.see(margins)

    def raise_alert(self, alert: Alert) -> list[Change]:
        """Raise an alert, which is closed with `end` set on the same object."""
        self.evaluator.watch.log.append(alert)
        return self.alarm_tracker.take()
