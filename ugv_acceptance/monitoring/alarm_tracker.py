"""Follows the log of alerts and turns it into alarms and their changes."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from ugv_acceptance.evaluation.alerts.alarms import Alarm, Alarms, Change, State, key_of
from ugv_acceptance.evaluation.alerts.rules import FAILURES
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, Alert

# Number of cleared alerts that are kept.
KEPT = 1000


@dataclass(frozen=True, slots=True)
class Event:
    """An alert that `begins`, or ends, at `time` (ns)."""

    time: int
    begins: bool
    alert: Alert


def events_of(raised: Iterable[Alert], known: Iterable[Alert]) -> list[Event]:
    """Return the beginnings of `raised` and the ends of all `known` that are over, by time.

    Of the same moment an end comes before a beginning, but no alert's end before its own.
    """
    events = [Event(alert.start, begins=True, alert=alert) for alert in raised]
    events += [
        Event(alert.end, begins=False, alert=alert) for alert in known if alert.end is not None
    ]
    return sorted(events, key=_place)


def _place(event: Event) -> tuple[int, int]:
    if event.begins:
        return event.time, 1
    return event.time, 0 if event.time > event.alert.start else 2


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
        # Every message asks: a generator would cost more than the loop.
        for alert in self.open:  # noqa: SIM110
            if alert.end is not None:
                return True
        return False

    def take(self) -> list[Change]:
        """Return the alarm changes since the last call, in order of time."""
        fresh = self.log[self._seen :]
        found: list[Change] = []
        for event in events_of(fresh, [*self.open, *fresh]):
            take = self.alarms.raised if event.begins else self.alarms.cleared
            found += take(event.time, event.alert)
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
