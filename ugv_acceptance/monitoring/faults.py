"""Faults that only a live node can see: foreign publishers, QoS mismatch, undecodable messages.

They are alerts like those of the evaluation and are written to the same log.
"""

from dataclasses import dataclass, field

from ugv_acceptance.evaluation.alerts.messages import ALERTS, LIVE, describe
from ugv_acceptance.evaluation.alerts.state_machine import Alert, Rule, Signal
from ugv_acceptance.evaluation.settings import Settings

# Time (ns) a fault must be gone before its alert is cleared.
OFF_DELAY = 2_000_000_000


@dataclass(slots=True)
class Faults:
    """The alerts of faults, one signal for each code and subject; `log` is the evaluation's."""

    log: list[Alert]
    _signals: dict[tuple[str, str], Signal] = field(default_factory=dict)
    _details: dict[tuple[str, str], str] = field(default_factory=dict)

    def set(self, now: int, code: str, subject: str, count: float, detail: str = '') -> None:
        """Report that a fault is present at `now` (ns); `count` is its size, such as messages."""
        key = (code, subject)
        self._details[key] = detail
        if key not in self._signals:
            rule = Rule(code, subject, LIVE[code], 0.5, 0.5, 0, OFF_DELAY)
            self._signals[key] = Signal(rule, self.log)
        self._signals[key].step(now, count)

    def clear(self, now: int, code: str, subject: str) -> None:
        """Report that a fault is absent at `now` (ns)."""
        signal = self._signals.get((code, subject))
        if signal is not None:
            signal.step(now, 0.0)

    def advance(self, now: int) -> None:
        """Let time pass to `now` (ns): clear alerts whose fault has been gone long enough."""
        for signal in self._signals.values():
            signal.advance(now)

    @property
    def active(self) -> list[Alert]:
        """Alerts of faults that are active now."""
        return [s.alert for s in self._signals.values() if s.alert is not None]

    def sentence(self, alert: Alert, settings: Settings) -> str:
        """Return the sentence of any alert, of the evaluation or of these faults."""
        rule = alert.rule
        if rule.code not in LIVE:
            return describe(alert, settings)
        detail = self._details.get((rule.code, rule.subject), '')
        text = ALERTS[rule.code].happened
        return text.format(subject=rule.subject, peak=alert.peak, detail=detail)
