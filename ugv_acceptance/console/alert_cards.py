"""Alerts as cards: one a cause at its worst level, those that have ended apart.

A robot that tips to one side raises half a dozen alerts of one cause. They are one card, which a
person acknowledges as one; two sides, or two joints, are never one.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from ugv_acceptance.console.snapshot import AlertRow, Snapshot
from ugv_acceptance.evaluation.alerts.messages import level_words
from ugv_acceptance.evaluation.alerts.rules import urgency
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, LEVELS, WARN
from ugv_acceptance.evaluation.margin_words import degrees_words, share_words
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import SIDES

Plain = dict[str, Any]

# Kinds of causes of several codes, and their titles; a code that is not in CAUSES is its own cause.
TIPPING, TORQUE, POSITION, INPUT, IMU, PUBLISHERS = (
    'tipping', 'torque', 'position', 'input', 'imu', 'publishers'
)  # fmt: skip
TITLES = {
    TIPPING: 'TIPPING: {name}',
    TORQUE: '{name}: TORQUE',
    POSITION: '{name}: POSITION',
    INPUT: '{name}: MESSAGES',
    IMU: 'IMU',
    PUBLISHERS: '{name}: PUBLISHERS',
}
CAUSES = {
    'TIP_OVER': TIPPING,
    'TIP_AHEAD': TIPPING,
    'TIP_MOVING': TIPPING,
    'ACCELERATION': TIPPING,
    'TRACK_LIFT': TIPPING,
    'TORQUE_LIMIT': TORQUE,
    'TORQUE_AHEAD': TORQUE,
    'EFFORT_LIMIT': TORQUE,
    'MOTOR_WEAK': TORQUE,
    'ENCODER_FROZEN': POSITION,
    'POSITION_LEAP': POSITION,
    'INPUT_STALE': INPUT,
    'INPUT_SLOW': INPUT,
    'INPUT_INCOMPLETE': INPUT,
    'INPUT_INVALID': INPUT,
    'INPUT_MALFORMED': INPUT,
    'INPUT_QOS': INPUT,
    'MESSAGES_LOST': INPUT,
    'JOINTS_REPEATED': INPUT,
    'IMU_FRAME': IMU,
    'IMU_ORIENTATION': IMU,
    'IMU_GRAVITY': IMU,
    'IMU_INCONSISTENT': IMU,
    'IMU_NO_GRAVITY': IMU,
    'IMU_FROZEN': IMU,
    'IMU_CONTRADICTION': IMU,
    'IMU_RATES': IMU,
    'IMU_ROTATION': IMU,
    'IMU_MOUNTING': IMU,
    'IMU_MOUNTING_UNKNOWN': IMU,
    'IMU_UNIT': IMU,
    'IMU_TWO_SOURCES': IMU,
    'SECOND_PUBLISHER': PUBLISHERS,
    'FOREIGN_PUBLISHER': PUBLISHERS,
}
# The alert that foretells another.
_FORETOLD = {'TIP_OVER': 'TIP_AHEAD', 'TORQUE_LIMIT': 'TORQUE_AHEAD'}
# The commands a card may offer, in this order.
OFFERS = ('acknowledge', 'shelve', 'unshelve', 'reset')


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """The alerts of one cause that are active, or those that are over, the most urgent first."""

    kind: str
    subject: str
    rows: tuple[AlertRow, ...]

    @property
    def first(self) -> AlertRow:
        """The alert that stands for the others."""
        return self.rows[0]

    @property
    def active(self) -> bool:
        """Whether the cause is there now."""
        return self.first.end is None

    @property
    def called(self) -> AlertRow:
        """The alert that calls a person: the first that nobody has seen at the group's level.

        A lesser one behind an alert that was acknowledged calls nobody. The first if none calls.
        """
        worst = (row for row in self.rows if row.level == self.first.level)
        return next((row for row in worst if row.unseen), self.first)


def name_words(subject: str) -> str:
    """Return a joint, an input or a side as people read it: "joint states", "upper arm"."""
    return subject.removesuffix('_joint').replace('_', ' ')


def cause_of(row: AlertRow) -> tuple[str, str]:
    """Return the cause of an alert: its kind, and the side, joint or input it is about."""
    kind = CAUSES.get(row.code, row.code)
    if row.code == 'MARGIN_UNCERTAIN':
        kind = TIPPING if row.subject in SIDES else TORQUE
    return kind, row.subject


# Most frames have the alerts of the one before.
@lru_cache(maxsize=4)
def groups_of(rows: tuple[AlertRow, ...]) -> tuple[Group, ...]:
    """Return alerts by cause, active and over apart: active, severe, unseen and new first.

    What is over and asks nobody for anything is left out while its cause is there again.
    """
    found: dict[tuple[str, str, bool], list[AlertRow]] = {}
    for row in sorted(rows, key=_place):
        cause, active = cause_of(row), row.end is None
        if active or row.unseen or row.offers or (*cause, True) not in found:
            found.setdefault((*cause, active), []).append(row)
    return tuple(Group(kind, subject, tuple(mine)) for (kind, subject, _), mine in found.items())


def _place(row: AlertRow) -> tuple[object, ...]:
    """Return the sort key: a contradicted IMU comes before tip-over, and that before motors."""
    first = -urgency(row.code, row.level)
    return (row.end is not None, -row.level, first, not row.unseen, -row.start, row.key)


def title_of(group: Group) -> str:
    """Return what a card is about in a few capitals, the same while it is shown."""
    title = TITLES.get(group.kind, f'{group.kind.replace("_", " ")}: {{name}}')
    return title.format(name=name_words(group.subject).upper())


def card_of(group: Group, snapshot: Snapshot, settings: Settings, advice: str | None) -> Plain:
    """Return a group as a card of the frame; `advice` replaces that of the alert."""
    card = _lasting(group).copy()
    card['worst'] = worst_words(group.rows, snapshot, settings)
    card['age_s'] = round((snapshot.time - min(row.start for row in group.rows)) / 1e9, 1)
    if advice is not None:
        card['advice'] = advice
    return card


@lru_cache(maxsize=64)
def _lasting(group: Group) -> Plain:
    """Return what of a card does not change with time."""
    first, called = group.first, group.called
    return {
        'key': f'{group.kind}-{group.subject}{"" if group.active else "-over"}',
        'keys': [row.key for row in group.rows],
        'code': first.code,
        'subject': first.subject,
        'level': LEVELS[first.level],
        'word': level_words(first.level),
        'title': title_of(group),
        'text': first.text,
        'advice': first.advice,
        'state': called.state,
        'active': group.active,
        'unseen': called.unseen,
        'offers': offers_of(group.rows),
        'note': next((row.note for row in group.rows if row.note), ''),
        'parts': parts_of(group.rows),
    }


def offers_of(rows: Sequence[AlertRow]) -> list[str]:
    """Return the commands a card offers: what any of its alerts does, shelve only if all may be."""
    found = {offer for row in rows for offer in row.offers}
    if any(row.level != WARN for row in rows):
        found.discard('shelve')
    return [offer for offer in OFFERS if offer in found]


def parts_of(rows: Sequence[AlertRow]) -> list[str]:
    """Return the texts of a card's other alerts, without a caution under its own danger.

    What was foretold is no news once it has come.
    """
    first, *others = rows
    told, texts = {(first.code, first.subject)}, []
    come = {_FORETOLD.get(row.code) for row in rows if _reached(row)}
    for row in others:
        if row.code not in come and (row.code, row.subject) not in told:
            told.add((row.code, row.subject))
            texts.append(row.text)
    return texts


def _reached(row: AlertRow) -> bool:
    """Return whether an alert says that the edge, or a motor's limit, is not ahead but passed."""
    return row.level == ERROR and (row.code != 'TIP_OVER' or row.peak > 0.0)


def worst_words(rows: Sequence[AlertRow], snapshot: Snapshot, settings: Settings) -> str:
    """Return the worst value of a card's alerts beside its time: "35 deg past at 28.1 s"."""
    known = [row for row in rows if row.code in _SIZES and not math.isnan(row.peak)]
    if not known:
        return ''
    row = max(known, key=lambda row: row.peak)
    words = _SIZES[row.code](row, settings)
    return f'{words} {_when(row.worst, snapshot)}'.rstrip() if words else ''


def _tilt_words(row: AlertRow, _: Settings) -> str:
    words = degrees_words(-row.peak)
    return f'{words.removeprefix("-")} past' if row.peak > 0.0 else f'{words} left'


def _share_words(row: AlertRow, settings: Settings) -> str:
    names = settings.robot.joint_names
    if row.subject not in names:
        return ''
    share = row.peak / settings.limits.torque[names.index(row.subject)]
    return share_words(share) if share > 0.0 else ''


_SIZES = {'TIP_OVER': _tilt_words, 'TORQUE_LIMIT': _share_words}


def _when(at: int | None, snapshot: Snapshot) -> str:
    """Return when something was: the position in a recording, else how long ago."""
    if at is None:
        return ''
    ago = max(snapshot.time - at, 0) / 1e9
    if snapshot.source != 'live' and math.isfinite(snapshot.running):
        return f'at {snapshot.running - ago:.1f} s'
    return 'now' if ago < 1.0 else f'{ago:.0f} s ago'
