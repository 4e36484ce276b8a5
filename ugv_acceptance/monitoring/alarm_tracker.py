"""Follows the log of alerts and turns it into alarms and their changes."""

from dataclasses import dataclass, field

from ugv_acceptance.evaluation.alerts.alarms import Alarm, Alarms, Change, State, key_of
from ugv_acceptance.evaluation.alerts.rules import FAILURES
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, Alert

# Number of cleared alerts that are kept.
KEPT = 1000


@dataclass(slots=True)
class AlarmTracker:
    """Reads the log of alerts, which grows at its end and whose alerts get their end in place.

    `open` are the alerts that are still active, `alarms` their alarms with acknowledgements. Old
    cleared alerts are removed from the log.
    """

    log: list[Alert]
    open: list[Alert] = field(default_factory=list)
    alarms: Alarms = field(default_factory=Alarms)
    _seen: int = 0

    def changed(self) -> bool:
        """Return whether any alert was raised or cleared since `take`."""
        if len(self.log) != self._seen:
            return True
        return any(alert.end is not None for alert in self.open)

    def take(self) -> list[Change]:
        """Return the alarm changes since the last call, in order of time."""
        fresh = self.log[self._seen :]
        # At equal times ends come before beginnings, except the end of an alert just begun.
        events = [(alert.start, 1, alert) for alert in fresh]
        events += [
            (alert.end, 0 if alert.end > alert.start else 2, alert)
            for alert in [*self.open, *fresh]
            if alert.end is not None
        ]
        found: list[Change] = []
        for now, which, alert in sorted(events, key=lambda event: event[:2]):
            take = self.alarms.raised if which == 1 else self.alarms.cleared
            found += take(now, alert)
        self.open = [alert for alert in [*self.open, *fresh] if alert.end is None]
        self._prune()
        return found

    def acknowledged(self, alert: Alert) -> bool:
        """Return whether an active alert was acknowledged."""
        return self.alarms.state(key_of(alert.rule)) is State.ACTIVE_ACKNOWLEDGED

    @property
    def waiting(self) -> list[Alarm]:
        """Failures of the robot that are over but not acknowledged or reset, the newest last."""
        found = [a for a in self.alarms.table.values() if _is_failure(a) and not a.state.active]
        over = [a for a in found if a.state is not State.NORMAL]
        return sorted(over, key=lambda alarm: alarm.alert.start)

    def _prune(self) -> None:
        if len(self.log) > 2 * KEPT:
            self.log[:-KEPT] = [alert for alert in self.log[:-KEPT] if alert.end is None]
        self._seen = len(self.log)


def _is_failure(alarm: Alarm) -> bool:
    return alarm.rule.code in FAILURES and alarm.rule.level == ERROR
