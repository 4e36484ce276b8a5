"""Which alerts were raised or cleared since the last look, at the cost of two comparisons."""

from dataclasses import dataclass, field

from ugv_acceptance.evaluation.alerts import ERROR, Alert
from ugv_acceptance.evaluation.watch import FAILURES

# Cleared alerts that are kept.
KEPT = 1000


@dataclass(slots=True)
class Follower:
    """Reads a log that grows at its end and whose alerts are closed in place; keeps it short.

    `open` are the alerts seen and not closed yet. `latched` are failures of the robot that were
    cleared before anybody acknowledged them.
    """

    log: list[Alert]
    open: list[Alert] = field(default_factory=list)
    latched: list[Alert] = field(default_factory=list)
    _seen: int = 0
    _acknowledged: set[int] = field(default_factory=set)

    def changed(self) -> bool:
        """Return whether any alert was raised or cleared since `take`."""
        if len(self.log) != self._seen:
            return True
        return any(alert.end is not None for alert in self.open)

    def take(self) -> list[tuple[Alert, str]]:
        """Return what changed: alerts with raised or cleared, in that order for each."""
        fresh = self.log[self._seen :]
        found = [(alert, 'raised') for alert in fresh]
        for alert in [*self.open, *fresh]:
            if alert.end is None:
                continue
            found.append((alert, 'cleared'))
            failure = alert.rule.code in FAILURES and alert.rule.level == ERROR
            if failure and id(alert) not in self._acknowledged:
                self.latched.append(alert)
        self.open = [alert for alert in [*self.open, *fresh] if alert.end is None]
        self._acknowledged &= {id(alert) for alert in self.open}
        del self.latched[:-KEPT]
        self._prune()
        return found

    def acknowledge(self) -> list[Alert]:
        """Take all that is active or latched as seen by a person; return it."""
        fresh = [alert for alert in self.open if id(alert) not in self._acknowledged]
        seen = [*self.latched, *fresh]
        self._acknowledged |= {id(alert) for alert in fresh}
        self.latched.clear()
        return seen

    def acknowledged(self, alert: Alert) -> bool:
        """Return whether an active alert was acknowledged."""
        return id(alert) in self._acknowledged

    def _prune(self) -> None:
        if len(self.log) > 2 * KEPT:
            self.log[:-KEPT] = [alert for alert in self.log[:-KEPT] if alert.end is None]
        self._seen = len(self.log)
