"""The list of alerts a console shows: those the monitor published, and those it sees itself.

A console that starts late has missed earlier messages: `also` adds the alerts that its own
evaluation finds active.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from ugv_acceptance import BadSample
from ugv_acceptance.console.snapshot import AlertRow
from ugv_acceptance.evaluation.alerts.alarms import State
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, LEVELS, Alert

_STATES = {state.value: state for state in State}
# Times (ns) have 64 bits; what is larger is none.
MOST = 2**63


@dataclass(slots=True)
class AlertBook:
    """The newest row of each published alert, by code, subject and level."""

    rows: dict[str, AlertRow] = field(default_factory=dict)

    def take(self, values: Mapping[str, str], message: str) -> None:
        """Take a change as published on `~/alerts`, with the alarm's state and allowed commands."""
        how = values.get('state', '')
        code, subject = values.get('code', ''), values.get('subject', '')
        level = LEVELS.index(values['level']) if values.get('level') in LEVELS else ERROR
        key = f'{code}-{subject}-{LEVELS[level]}'
        state = _STATES.get(values.get('alarm', ''), State.ACTIVE_UNACKNOWLEDGED)
        if state is State.NORMAL:
            self.rows.pop(key, None)
            return
        before = self.rows.get(key)
        said = ': '.join(x for x in (values.get('who', ''), values.get('note', '')) if x)
        kept = before.note if before and how != 'raised' else ''
        shelved = how == 'shelved'
        self.rows[key] = AlertRow(
            key,
            code,
            subject,
            level,
            state.value + (', shelved' if shelved else ''),
            values.get('happened') or message.removeprefix(f'{how}: '),
            values.get('do', ''),
            _whole(values.get('start_ns')) or 0,
            None if state.active else _whole(values.get('end_ns')) or 0,
            state.unseen and not shelved,
            tuple(x for x in values.get('offers', '').split(',') if x),
            said or kept,
            _whole(values.get('worst_ns')),
            _number(values.get('peak')),
        )

    def row(self, key: object) -> AlertRow:
        """Return the row with a key sent by a client. Raises BadSample where there is none."""
        row = self.rows.get(str(key))
        if row is None:
            raise BadSample(f'key: expected that of an alert that is listed, got {key!r:.80}')
        return row

    def clear(self) -> None:
        """Remove all rows, for a monitor that has none or was started anew."""
        self.rows.clear()

    def also(self, active: Iterable[AlertRow]) -> tuple[AlertRow, ...]:
        """Return all rows, and those of `active` that are not in the list as active."""
        told = {key for key, row in self.rows.items() if row.end is None}
        return (*self.rows.values(), *(row for row in active if row.key not in told))


def row_of(alert: Alert, text: str, advice: str) -> AlertRow:
    """Return the row of an active alert that only the console itself has found."""
    rule = alert.rule
    return AlertRow(
        f'{rule.code}-{rule.subject}-{LEVELS[rule.level]}',
        rule.code,
        rule.subject,
        rule.level,
        'active, seen by this console only',
        text,
        advice,
        alert.start,
        worst=alert.worst_at,
        peak=float(alert.peak),
    )


def _number(text: str | None) -> float:
    """Return a number; NaN for any other text."""
    try:
        return float(text or '')
    except ValueError:
        return math.nan


def _whole(text: str | None) -> int | None:
    """Return a whole number of 64 bits; None for any other text."""
    try:
        value = int(text or '')
    except ValueError:
        return None
    return value if abs(value) < MOST else None
