"""The headline of page, terminal and lines: what is wrong, where to, how much, and what to do.

One thing at a time: the most urgent cause decides. Where nothing is known the first word is STOP;
what was known last comes next, and what an integrator needs comes last. A robot that has tipped is
told to be left alone, and no margin gives advice then.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ugv_acceptance.console.alert_cards import TIPPING, Group, groups_of, name_words
from ugv_acceptance.console.snapshot import AlertRow, Snapshot
from ugv_acceptance.evaluation.advice.tipped import TIPPED, has_tipped
from ugv_acceptance.evaluation.alerts.rules import urgency
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, OK, STALE
from ugv_acceptance.evaluation.criteria.not_judged import kept_words, unknown_words
from ugv_acceptance.evaluation.ground import CARRIED
from ugv_acceptance.evaluation.least_margins import least_tilt, most_used, tilt_not_checked
from ugv_acceptance.evaluation.margin_words import degrees_words, share_words, tipping_words
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import SIDES, STATES

# What is said where nothing is known, or the configuration leaves something open.
UNKNOWN = 'margins are not known'
DO_NOT = 'do not move on these numbers'
COMPLETE, ANSWER = 'COMPLETE THE CONFIGURATION', 'then start the monitor again'
# What is said of a robot that has tipped.
TIPPED_WHAT, STAND_CLEAR = 'IT HAS TIPPED', 'STAND CLEAR'
TIPPED_DETAIL = 'do not move the arm; switch it off before anyone comes near'
STANDS = 'by its numbers it stands again: once somebody has looked, reset the alert'
# To whom a cause that no operator can mend goes.
TELL = 'TELL THE INTEGRATOR'

# What an alert is called in the headline, where its side, joint or input stands as {name}.
WHATS = {
    'TIP_TREND': 'BEGINS TO TIP',
    'ACCELERATION': 'TOO HARD: LIFTS {name}',
    'TRACK_LIFT': 'TOO HARD: LIFTED {name}',
    'NO_SUPPORT': 'IT DOES NOT STAND',
    'ARM_ON_GROUND': 'ARM ON THE GROUND',
    'STATIC_MODEL': '{name} TOO FAST',
    'SLIDE': 'CLOSE TO SLIDING',
    'TORQUE_AHEAD': '{name} SOON AT ITS LIMIT',
    'EFFORT_LIMIT': '{name}: MOTOR NEAR ITS LIMIT',
    'MOTOR_WEAK': '{name}: MOTOR WEAK',
    'ENCODER_FROZEN': '{name}: POSITION STUCK',
    'POSITION_LEAP': '{name}: POSITION JUMPS',
    'INPUT_STALE': '{name}: NO MESSAGE',
    'INPUT_SLOW': '{name}: SLOW',
    'INPUT_INCOMPLETE': '{name}: INCOMPLETE',
    'INPUT_INVALID': '{name}: NOT USABLE',
    'INPUT_MALFORMED': '{name}: NOT READABLE',
    'INPUT_QOS': '{name}: NOT RECEIVED',
    'MESSAGES_LOST': '{name}: MESSAGES LOST',
    'JOINTS_REPEATED': '{name}: OLD POSITIONS',
    'CLOCK': '{name}: CLOCK OFF',
    'NO_CLOCK': 'NO CLOCK',
    'IMU_ORIENTATION': 'IMU: ORIENTATION WRONG',
    'IMU_RATES': 'IMU: RATES WRONG',
    'IMU_NO_GRAVITY': 'IMU: TILT NOT KNOWN',
    'IMU_MOUNTING_UNKNOWN': 'IMU: MOUNTING NOT KNOWN',
    'PAYLOAD_INVALID': 'LOAD NOT USABLE',
    'PAYLOAD_DIFFERS': 'OTHER LOAD THAN DECLARED',
    'LIMITS_RELAXED': 'LIMIT RELAXED: {name}',
    'SECOND_PUBLISHER': '{name}: TWO PUBLISHERS',
    'FOREIGN_PUBLISHER': '{name}: FOREIGN PUBLISHER',
    'CONFIG_DIFFERS': 'NOT THE CONFIGURED ROBOT',
    'EFFORT_SIGN': '{name}: SIGN OF EFFORT',
    'MARGIN_UNCERTAIN': '{name}: TOO CLOSE TO TELL',
    'MONITOR_FAULT': 'FAULT OF THE MONITOR',
}
# Any other alert about the IMU.
_IMU_WHAT = 'IMU NOT TO BE TRUSTED'
# Alerts that no operator can mend: STOP where they are dangers, else the integrator is told.
FOR_INTEGRATOR = frozenset({
    'ENCODER_FROZEN', 'POSITION_LEAP', 'INPUT_STALE', 'INPUT_SLOW', 'INPUT_INCOMPLETE',
    'INPUT_INVALID', 'INPUT_MALFORMED', 'INPUT_QOS', 'MESSAGES_LOST', 'JOINTS_REPEATED', 'CLOCK',
    'NO_CLOCK', 'SECOND_PUBLISHER', 'FOREIGN_PUBLISHER', 'CONFIG_DIFFERS', 'EFFORT_SIGN',
    'MONITOR_FAULT',
})  # fmt: skip
# Advice that a model worked out: "lower the elbow by 16 deg: ...", "swing it by 5 deg back: ...".
_AMOUNT = re.compile(r'(?P<do>[^:;,]*?) (?P<by>by [\d.]+ \w+)(?P<way>[^:;,]*)(?P<rest>.*)')
_CLAUSE = re.compile(r'(?P<do>[^:;,]*)(?:[:;,] ?(?P<rest>.*))?')


@dataclass(frozen=True, slots=True)
class Headline:
    """What the header shows: `what` is wrong and its `number`, the `action` and its `detail`.

    `what` and `action` are short and in capitals. `cause` says in one sentence where it comes from;
    `notes` are lines of less weight, the margins first; `more` the number of further active causes.
    """

    what: str
    number: str = ''
    action: str = ''
    detail: str = ''
    cause: str = ''
    notes: tuple[str, ...] = ()
    more: int = 0

    def plain(self) -> dict[str, Any]:
        """Return it as a part of the frame."""
        return {
            'what': self.what,
            'number': self.number,
            'action': self.action,
            'detail': self.detail,
            'cause': self.cause,
            'notes': list(self.notes),
            'more': self.more,
        }


@dataclass(frozen=True, slots=True)
class View:
    """What is decided before anything is worded: the level shown, and what stands behind it.

    `open`: only what the configuration leaves unknown keeps the level from OK. `dead`: nothing that
    is shown may be taken for the present. `fallen` is the side it has tipped to (None: it has not).
    """

    level: int
    open: bool
    dead: bool
    fallen: str | None
    groups: tuple[Group, ...]


def view_of(snapshot: Snapshot, settings: Settings) -> View:
    """Return what of a snapshot is to be shown."""
    level = snapshot.level if snapshot.known else max(snapshot.level, STALE)
    unanswered = bool(settings.unknown) and snapshot.known and level != ERROR
    dead = level == STALE and not unanswered
    level = STALE if unanswered else level
    if not dead and snapshot.known and has_tipped(snapshot.angle):
        # The alert comes a moment later.
        level = level if unanswered else max(level, ERROR)
    return View(level, unanswered, dead, fallen_to(snapshot), groups_of(snapshot.alerts))


def fallen_to(snapshot: Snapshot) -> str | None:
    """Return the side to which the robot has tipped; None if it has not.

    It is said while the numbers say so, while the alert of it waits for a person, and while there
    are no numbers and the last said so.
    """
    if snapshot.known and has_tipped(snapshot.angle):
        return least_tilt(snapshot.angle)[0]
    for row in snapshot.alerts:
        if row.code == 'TIP_OVER' and row.level == ERROR and row.peak >= TIPPED:
            return row.subject
    last = snapshot.last
    if not snapshot.known and last is not None and has_tipped(last.angle):
        return least_tilt(last.angle)[0]
    return None


def headline_of(snapshot: Snapshot, settings: Settings, view: View | None = None) -> Headline:
    """Return the headline of a snapshot."""
    view = view or view_of(snapshot, settings)
    active = [group for group in view.groups if group.active]
    contradicted = bool(active) and _contradicts(active[0].first)
    if view.fallen is not None and (view.dead or not contradicted):
        return _fallen(active, snapshot, settings, view)
    if view.dead:
        return _no_data(active, snapshot, settings)
    if active:
        return _alert(active, snapshot, settings, view)
    if view.level != OK:
        return _waiting(snapshot, settings, view)
    return _kept(snapshot, settings)


def _contradicts(row: AlertRow) -> bool:
    return row.level == ERROR and urgency(row.code, row.level) > 1


def _fallen(
    active: Sequence[Group], snapshot: Snapshot, settings: Settings, view: View
) -> Headline:
    others = [group for group in active if group.kind != TIPPING]
    notes, cause, detail = (), '', TIPPED_DETAIL
    if view.dead:
        notes, cause = (_last_words(snapshot, settings),), _why(active, snapshot)
    elif not has_tipped(snapshot.angle):
        notes = (STANDS,)
    what = f'{TIPPED_WHAT} {(view.fallen or "").upper()}'.rstrip()
    return Headline(what, '', STAND_CLEAR, detail, cause, notes, len(others))


def _no_data(active: Sequence[Group], snapshot: Snapshot, settings: Settings) -> Headline:
    told = not snapshot.problem and any(_blinds(group.first) for group in active)
    notes, cause = (_last_words(snapshot, settings),), _why(active, snapshot)
    return Headline('NO DATA', '', 'STOP', DO_NOT, cause, notes, len(active) - told)


def _why(active: Sequence[Group], snapshot: Snapshot) -> str:
    """Return why there are no data, for the integrator: what is silent, and what to check.

    No alert that was raised by margins says why there are none.
    """
    blind = [group.first for group in active if _blinds(group.first)]
    if snapshot.problem or not blind:
        return snapshot.problem or UNKNOWN
    return ': '.join(words for words in (blind[0].text, blind[0].advice) if words)


def _blinds(row: AlertRow) -> bool:
    """Return whether an alert is about what margins are computed from."""
    code = row.code
    return code in FOR_INTEGRATOR or code.startswith('IMU_') or code == 'PAYLOAD_INVALID'


def _alert(active: Sequence[Group], snapshot: Snapshot, settings: Settings, view: View) -> Headline:
    row = active[0].first
    what, number = what_of(row, snapshot, settings)
    action, detail = order_of(row.advice)
    notes = _notes(snapshot, settings)
    if _blinds(row) and row.code != 'PAYLOAD_INVALID':
        action, detail = ('STOP', DO_NOT) if row.level >= ERROR else (TELL, row.advice)
        if row.level >= ERROR:
            told = f'for the integrator: {row.advice}' if row.advice else ''
            notes = tuple(note for note in ('the margins are not to be trusted', told) if note)
    if view.fallen is not None:
        detail = f'stand clear: by its numbers it has tipped {view.fallen.upper()}'
    if view.open:
        notes = (*notes, unknown_words(settings))
    return Headline(what, number, action, detail, row.text, notes, len(active) - 1)


def what_of(row: AlertRow, snapshot: Snapshot, settings: Settings) -> tuple[str, str]:
    """Return what an active alert is about, in capitals, and its number now ('': it has none)."""
    if row.code in ('TIP_OVER', 'TIP_AHEAD', 'TIP_MOVING', 'TIP_TREND'):
        return _tipping(row, snapshot)
    name = name_words(row.subject).upper()
    if row.code in ('TORQUE_LIMIT', 'TORQUE_AHEAD') or (
        row.code == 'MARGIN_UNCERTAIN' and row.subject not in SIDES
    ):
        share = _share(row.subject, snapshot, settings)
        if row.code == 'TORQUE_LIMIT':
            return f'{name} {"AT" if share >= 1.0 else "NEAR"} ITS LIMIT', _known(
                share_words(share)
            )
        return WHATS[row.code].format(name=name), _known(share_words(share))
    if row.code == 'MARGIN_UNCERTAIN':
        return f'TO TIPPING: {name}', _known(degrees_words(_angle(row.subject, snapshot)))
    default = _IMU_WHAT if row.code.startswith('IMU_') else row.code.replace('_', ' ')
    return WHATS.get(row.code, default).format(name=name), ''


def _tipping(row: AlertRow, snapshot: Snapshot) -> tuple[str, str]:
    """Return that a robot comes near to tipping or tips, to which side, and the tilt left now."""
    side = row.subject
    if side not in SIDES:
        # An alert about the robot names the side in its text.
        side = next((s for s in SIDES if s in row.text), least_tilt(snapshot.angle)[0])
    angle = _angle(side, snapshot)
    bound = '<= ' * (snapshot.rough and math.isfinite(angle))
    number = bound + _known(degrees_words(angle))
    moving = row.code == 'TIP_MOVING' and row.level == ERROR
    if row.code == 'TIP_TREND':
        return f'{WHATS[row.code]} {side.upper()}'.rstrip(), number
    past = angle <= 0.0 or moving
    return f'TIPPING {side.upper()}' if past else f'TO TIPPING: {side.upper()}', number


def _angle(side: str, snapshot: Snapshot) -> float:
    return float(snapshot.angle[SIDES.index(side)]) if side in SIDES else math.nan


def _share(joint: str, snapshot: Snapshot, settings: Settings) -> float:
    names = settings.robot.joint_names
    if joint not in names or not snapshot.torque:
        return math.nan
    at = names.index(joint)
    return abs(snapshot.torque[at]) / settings.limits.torque[at]


def _known(words: str) -> str:
    return '' if words == '-' else words


def order_of(advice: str) -> tuple[str, str]:
    """Return what to do in a few capitals, and the rest of the sentence in small letters.

    "lower the elbow by 16 deg: 11 deg further from tipping" is LOWER THE ELBOW; by 16 deg: 11 ...
    """
    found = _AMOUNT.fullmatch(advice)
    if found:
        return (found['do'] + found['way']).upper(), found['by'] + found['rest']
    clause = _CLAUSE.fullmatch(advice)
    if clause is None:
        return advice.upper(), ''
    return clause['do'].strip().upper(), clause['rest'] or ''


def _waiting(snapshot: Snapshot, settings: Settings, view: View) -> Headline:
    """Return the headline where nothing is wrong now, but a person has to act before it is OK."""
    notes = _notes(snapshot, settings)
    if view.open:
        words = unknown_words(settings)
        return Headline('NOT ALL IS CHECKED', '', COMPLETE, ANSWER, words, notes)
    if not view.groups:
        return Headline('NOT ALL IS WELL', notes=notes)
    row = view.groups[0].first
    latched = 'reset' in row.offers
    what = 'OVER, NOT RESET' if latched else 'OVER, NOT ACKNOWLEDGED'
    action = 'RESET IT' if latched else 'ACKNOWLEDGE IT'
    cause = f'{row.state}: {row.text}'
    return Headline(what, '', action, 'when the robot stands well again', cause, notes)


def _kept(snapshot: Snapshot, settings: Settings) -> Headline:
    """Return the headline where nothing is wrong: what is kept, and the least tilt left."""
    side, angle = least_tilt(snapshot.angle)
    kept = kept_words(settings, rough=snapshot.rough)
    number, cause = degrees_words(angle) if side else '', ''
    what, _, rest = kept.upper().partition(', ')
    if snapshot.rough and settings.judges_tilt:
        what, cause, number = 'NOT BEGUN TO TIP', kept, f'<= {number}' if number else ''
    elif rest:
        cause = kept
    return Headline(what, number, '', '', cause, _notes(snapshot, settings))


def _notes(snapshot: Snapshot, settings: Settings) -> tuple[str, ...]:
    return (margins_words(snapshot, settings), *snapshot.hints)


def margins_words(snapshot: Snapshot, settings: Settings) -> str:
    """Return the smallest margins in a few words: "6 deg to tipping: RIGHT, shoulder 43 %"."""
    side, angle = least_tilt(snapshot.angle)
    if side:
        tilt = _bound_words(side, angle, snapshot.cautious, rough=snapshot.rough)
        tilt += f' ({CARRIED})' * (snapshot.carried and not snapshot.rough)
    elif not settings.judges_tilt:
        tilt = tilt_not_checked(settings)
    else:
        tilt = f'no tilt margin ({STATES[snapshot.state].replace("_", " ")})'
    return _with_joint(tilt, snapshot.torque, settings)


def _bound_words(side: str, angle: float, cautious: float = math.nan, *, rough: bool) -> str:
    """Return the tilt left, where the ground is not flat as the upper bound that it is."""
    words = tipping_words(side, angle)
    if not rough:
        return words
    careful = '' if math.isnan(cautious) else f', {degrees_words(cautious)} taken cautiously'
    return f'at most {words} (upper bound{careful})'


def _with_joint(tilt: str, torque: Sequence[float], settings: Settings) -> str:
    joint, share = most_used(torque, settings)
    return f'{tilt}, {name_words(joint)} {share_words(share)}' if joint else tilt


def _last_words(snapshot: Snapshot, settings: Settings) -> str:
    """Return what was known last, and how long ago."""
    last = snapshot.last
    if last is None and snapshot.known:
        return 'what is known now is in doubt'
    if last is None:
        return 'nothing was known before'
    side, angle = least_tilt(last.angle)
    tilt = _bound_words(side, angle, rough=last.rough) if side else 'no tilt margin'
    ago = max(snapshot.time - last.time, 0) / 1e9
    return f'last known {ago:.1f} s ago: {_with_joint(tilt, last.torque, settings)}'
