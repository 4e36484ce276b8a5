"""The monitor's alerts as a console hears them: changes in, what is active or unseen out.

Who joins late misses what was said before: `also` adds what a console itself sees to be active.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from ugv_acceptance.console.snapshot import AlertRow
from ugv_acceptance.evaluation.alarms import State
from ugv_acceptance.evaluation.alerts import ERROR, LEVELS
from ugv_acceptance.evaluation.watch import FAILURES


@dataclass(slots=True)
class AlertBook:
    """The newest row of each alert, by code, subject and level."""

    rows: dict[str, AlertRow] = field(default_factory=dict)

    def take(self, values: Mapping[str, str], message: str) -> None:
        """Take a change as published on `~/alerts`: `state` raised, cleared, acknowledged or reset.

        Where the monitor says more, it is shown: `alarm` is the state in its own words, `offers`
        (by commas) what may be done about this alert, `note` what a person said.
        """
        how, code, subject = (
            values.get('state', ''),
            values.get('code', ''),
            values.get('subject', ''),
        )
        level = LEVELS.index(values['level']) if values.get('level') in LEVELS else ERROR
        key = f'{code}-{subject}-{LEVELS[level]}'
        text = message.removeprefix(f'{how}: ')
        before = self.rows.get(key)
        row = AlertRow(
            key,
            code,
            subject,
            level,
            values.get('alarm', ''),
            text,
            values.get('do', ''),
            _whole(values.get('start_ns')) or 0,
            _whole(values.get('end_ns')),
            before is None or before.unseen,
            tuple(x for x in values.get('offers', '').split(',') if x),
            values.get('note', before.note if before else ''),
        )
        if how == 'raised':
            row = replace(row, unseen=True, end=None)
        elif how == 'acknowledged':
            row = replace(row, unseen=False)
        if self._gone(how, row):
            self.rows.pop(key, None)
        else:
            self.rows[key] = row if row.state else replace(row, state=_state(row))

    def _gone(self, how: str, row: AlertRow) -> bool:
        if row.state:
            return row.state == State.NORMAL.value
        latches = row.code in FAILURES and row.level == ERROR
        over = row.end is not None
        return how == 'reset' or (over and not (row.unseen and latches))

    def clear(self) -> None:
        """Forget all: the monitor has none, or started anew."""
        self.rows.clear()

    def annotate(self, note: str) -> None:
        """Put a person's note to all that is not acknowledged yet."""
        for key, row in self.rows.items():
            if row.unseen and note:
                self.rows[key] = replace(row, note=note)

    def also(self, active: Iterable[AlertRow]) -> tuple[AlertRow, ...]:
        """Return all rows, with those of `active` that the book does not have as active."""
        told = {key for key, row in self.rows.items() if row.end is None}
        return (*self.rows.values(), *(row for row in active if row.key not in told))


def _state(row: AlertRow) -> str:
    if row.end is not None:
        return State.RETURNED_UNACKNOWLEDGED.value
    seen = State.ACTIVE_ACKNOWLEDGED if not row.unseen else State.ACTIVE_UNACKNOWLEDGED
    return seen.value


def _whole(text: str | None) -> int | None:
    return int(text) if text and text.lstrip('-').isdigit() else None
