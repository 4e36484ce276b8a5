"""Alarm management (ISA-18.2, IEC 62682): acknowledged, shelved, latched.

An alert is active or over; an alarm also remembers whether somebody acknowledged it. Without a
clock: every event comes with its time (ns), every method returns the changes it caused.
"""

from dataclasses import dataclass, field
from enum import Enum

from ugv_acceptance import AcceptanceError
from ugv_acceptance.evaluation.alerts.messages import level_words
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, WARN, Alert, Rule

# Codes of alarms that stay, over and acknowledged, until a person resets them: the robot may lie on
# its side.
LATCHING = frozenset({'TIP_OVER', 'NO_SUPPORT'})
# Longest shelving (ns).
LONGEST_SHELVING = 600 * 1_000_000_000

# Code, subject and level of a rule: one alarm.
Key = tuple[str, str, int]


class State(Enum):
    """State of an alarm; the value is the text people see."""

    NORMAL = 'normal'
    ACTIVE_UNACKNOWLEDGED = 'active, not acknowledged'
    ACTIVE_ACKNOWLEDGED = 'active, acknowledged'
    RETURNED_UNACKNOWLEDGED = 'over, not acknowledged'
    LATCHED = 'over, latched until reset'

    @property
    def active(self) -> bool:
        """Whether the limit is passed now."""
        return self in {State.ACTIVE_UNACKNOWLEDGED, State.ACTIVE_ACKNOWLEDGED}

    @property
    def unseen(self) -> bool:
        """Whether nobody has acknowledged it."""
        return self in {State.ACTIVE_UNACKNOWLEDGED, State.RETURNED_UNACKNOWLEDGED}


# (state, event) -> state; a pair that is not here changes nothing. _AFTERWARDS is the state of an
# alarm that is over and acknowledged: LATCHED for one that latches, else NORMAL (`next_state`).
_AFTERWARDS = State.LATCHED
TRANSITIONS: dict[tuple[State, str], State] = {
    (State.NORMAL, 'raised'): State.ACTIVE_UNACKNOWLEDGED,
    (State.LATCHED, 'raised'): State.ACTIVE_UNACKNOWLEDGED,
    (State.RETURNED_UNACKNOWLEDGED, 'raised'): State.ACTIVE_UNACKNOWLEDGED,
    (State.ACTIVE_UNACKNOWLEDGED, 'cleared'): State.RETURNED_UNACKNOWLEDGED,
    (State.ACTIVE_ACKNOWLEDGED, 'cleared'): _AFTERWARDS,
    (State.ACTIVE_UNACKNOWLEDGED, 'acknowledged'): State.ACTIVE_ACKNOWLEDGED,
    (State.RETURNED_UNACKNOWLEDGED, 'acknowledged'): _AFTERWARDS,
    (State.LATCHED, 'reset'): State.NORMAL,
}


def next_state(state: State, event: str, *, latches: bool) -> State:
    """Return the state after an event: raised, cleared, acknowledged or reset."""
    found = TRANSITIONS.get((state, event), state)
    return State.NORMAL if found is State.LATCHED and not latches else found


@dataclass(frozen=True, slots=True)
class Change:
    """A change of an alarm: what happened at `time` (ns), and the state that followed.

    `how` is raised, cleared, acknowledged, reset, shelved or unshelved; `who` is the person who did
    it, as the command claims, `note` what that person wrote, `sender` the node that sent the
    command, or several of which it was one.
    """

    time: int
    alert: Alert
    how: str
    state: State
    who: str = ''
    note: str = ''
    sender: str = ''


@dataclass(slots=True)
class Alarm:
    """One alarm: its newest `alert`, its state, who acknowledged it, until when it is shelved."""

    alert: Alert
    state: State = State.NORMAL
    acknowledged: Change | None = None
    shelved_until: int | None = None

    @property
    def rule(self) -> Rule:
        """The rule of the newest alert."""
        return self.alert.rule


def key_of(rule: Rule) -> Key:
    """Return the key of a rule's alarm: code, subject and level."""
    return rule.code, rule.subject, rule.level


def latches(rule: Rule) -> bool:
    """Return whether an alarm of this rule latches: stays until a person resets it."""
    return rule.code in LATCHING and rule.level == ERROR


@dataclass(slots=True)
class Alarms:
    """The table of all alarms that are not NORMAL or that are shelved, and the events on them."""

    table: dict[Key, Alarm] = field(default_factory=dict)

    def raised(self, now: int, alert: Alert) -> list[Change]:
        """Take an alert that was raised; even an acknowledged alarm then needs acknowledging."""
        alarm = self.table.setdefault(key_of(alert.rule), Alarm(alert))
        alarm.alert, alarm.acknowledged = alert, None
        alarm.state = State.ACTIVE_UNACKNOWLEDGED
        return [Change(now, alert, 'raised', alarm.state)]

    def cleared(self, now: int, alert: Alert) -> list[Change]:
        """Take an alert that is over; nothing changes if a newer alert has replaced it."""
        alarm = self.table.get(key_of(alert.rule))
        if alarm is None or alarm.alert is not alert:
            return []
        return self._event(now, alarm, 'cleared')

    def acknowledge(
        self, now: int, who: str, note: str = '', key: Key | None = None
    ) -> list[Change]:
        """Acknowledge one alarm (None: all) in the name of `who`; an active alarm stays active."""
        chosen = [a for k, a in self.table.items() if key in {None, k} and a.state.unseen]
        changes = []
        for alarm in chosen:
            found = self._event(now, alarm, 'acknowledged', who, note)
            alarm.acknowledged = found[0]
            changes += found
        return changes

    def reset(self, now: int, who: str, note: str = '', key: Key | None = None) -> list[Change]:
        """Reset one alarm (None: all) if it is latched; alarms in other states stay as they are."""
        latched = {k: a for k, a in self.table.items() if a.state is State.LATCHED}
        chosen = [a for k, a in latched.items() if key in {None, k}]
        return [c for alarm in chosen for c in self._event(now, alarm, 'reset', who, note)]

    def shelve(self, now: int, key: Key, length: int, who: str, note: str = '') -> list[Change]:
        """Shelve a warning for `length` (ns): it is still judged, but the operator is not called.

        Raises AcceptanceError if there is no such alarm, it is critical, or the time too long.
        """
        alarm = self.table.get(key)
        if alarm is None:
            raise AcceptanceError(f'shelve: expected a known alarm, got {key[0]!r} of {key[1]!r}')
        if key[2] != WARN:
            level = level_words(key[2])
            raise AcceptanceError(f'shelve: {key[0]} is {level}; only CAUTION can be shelved')
        if not 0 < length <= LONGEST_SHELVING:
            longest = LONGEST_SHELVING // 1_000_000_000
            raise AcceptanceError(
                f'shelve: expected above 0 and at most {longest} s, got {length / 1e9:g} s'
            )
        alarm.shelved_until = now + length
        return [Change(now, alarm.alert, 'shelved', alarm.state, who, note)]

    def unshelve(self, now: int, key: Key, who: str = '') -> list[Change]:
        """End the shelving of an alarm; nothing changes if it is not shelved."""
        alarm = self.table.get(key)
        if alarm is None or alarm.shelved_until is None:
            return []
        alarm.shelved_until = None
        change = Change(now, alarm.alert, 'unshelved', alarm.state, who)
        self._forget(key, alarm)
        return [change]

    def advance(self, now: int) -> list[Change]:
        """Let time pass to `now` (ns): end shelvings that have run out, dated to when they did."""
        over = [(a.shelved_until, k) for k, a in self.table.items() if a.shelved_until is not None]
        return [c for at, key in sorted(over) if at <= now for c in self.unshelve(at, key)]

    def shelved(self, key: Key) -> bool:
        """Return whether an alarm is shelved."""
        alarm = self.table.get(key)
        return alarm is not None and alarm.shelved_until is not None

    def state(self, key: Key) -> State:
        """Return the state of an alarm; NORMAL if it is not in the table."""
        alarm = self.table.get(key)
        return State.NORMAL if alarm is None else alarm.state

    def _event(
        self, now: int, alarm: Alarm, how: str, who: str = '', note: str = ''
    ) -> list[Change]:
        before = alarm.state
        alarm.state = next_state(before, how, latches=latches(alarm.rule))
        if alarm.state is before:
            return []
        self._forget(key_of(alarm.rule), alarm)
        return [Change(now, alarm.alert, how, alarm.state, who, note)]

    def _forget(self, key: Key, alarm: Alarm) -> None:
        if alarm.state is State.NORMAL and alarm.shelved_until is None:
            del self.table[key]
