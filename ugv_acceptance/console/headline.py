"""The headline of page, terminal and lines: what is wrong, where to, how much, and what to do.

One thing at a time: the most urgent cause decides. Where nothing is known the first word is STOP;
what was known last comes next, and what an integrator needs comes last. A robot that has tipped is
told to be left alone, and no margin gives advice then.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ugv_acceptance.console.alert_cards import TIPPING, Group, groups_of, name_words
from ugv_acceptance.console.headline_words import blinds, for_integrator, order_of, what_of
from ugv_acceptance.console.snapshot import Snapshot
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR as TIPPED_ADVICE
from ugv_acceptance.evaluation.advice.tipped import TIPPED, has_tipped
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, OK, STALE
from ugv_acceptance.evaluation.criteria.not_judged import kept_words, unknown_words
from ugv_acceptance.evaluation.ground import CARRIED
from ugv_acceptance.evaluation.least_margins import least_tilt, most_used, tilt_not_checked
from ugv_acceptance.evaluation.margin_words import degrees_words, share_words, tipping_words
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import STATES

# What is said where nothing is known, or the configuration leaves something open.
UNKNOWN = 'margins are not known'
UNTOLD = 'the monitor has not told this console why'
DO_NOT = 'do not move on these numbers'
COMPLETE, ANSWER = 'COMPLETE THE CONFIGURATION', 'then start the monitor again'
# What is said of a robot that has tipped.
TIPPED_WHAT = 'IT HAS TIPPED'
STAND_CLEAR, TIPPED_DETAIL = order_of(TIPPED_ADVICE)
LOOK = 'by its numbers it has tipped {side}: look at it before anyone comes near'
STANDS = 'by its numbers it stands again: once somebody has looked, reset the alert'
# To whom a cause that no operator can mend goes.
TELL = 'TELL THE INTEGRATOR'


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
    is shown may be taken for the present. `doubted`: the IMU contradicts itself or gravity.
    `fallen` is the side it has tipped to (None: it has not).
    """

    level: int
    open: bool
    dead: bool
    doubted: bool
    fallen: str | None
    groups: tuple[Group, ...]


def view_of(snapshot: Snapshot, settings: Settings) -> View:
    """Return what of a snapshot is to be shown."""
    groups = groups_of(snapshot.alerts)
    active = [group.first for group in groups if group.active]
    level = snapshot.level if snapshot.known else max(snapshot.level, STALE)
    lost = any(row.level == STALE for row in active)
    unanswered = bool(settings.unknown) and snapshot.known and level != ERROR and not lost
    dead = level == STALE and not unanswered
    if unanswered:
        level = STALE
    elif not dead and snapshot.known and has_tipped(snapshot.angle):
        # The alert comes a moment later.
        level = max(level, ERROR)
    doubted = any(row.level == ERROR and row.code.startswith('IMU_') for row in active)
    return View(level, unanswered, dead, doubted, fallen_to(snapshot), groups)


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
    # A tip-over drawn from an IMU that is contradicted may be none.
    if view.fallen is not None and (view.dead or not view.doubted):
        return _fallen(active, snapshot, settings, view)
    if view.dead:
        return _no_data(active, snapshot, settings)
    if active:
        return _alert(active, snapshot, settings, view)
    if view.level != OK:
        return _waiting(snapshot, settings, view)
    return _kept(snapshot, settings)


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
    told = not snapshot.problem and any(blinds(group.first) for group in active)
    notes, cause = (_last_words(snapshot, settings),), _why(active, snapshot)
    return Headline('NO DATA', '', 'STOP', DO_NOT, cause, notes, len(active) - told)


def _why(active: Sequence[Group], snapshot: Snapshot) -> str:
    """Return why there are no data, for the integrator: what is silent, and what to check.

    No alert that was raised by margins says why there are none.
    """
    blind = [group.first for group in active if blinds(group.first)]
    if snapshot.problem or not blind:
        return snapshot.problem or UNKNOWN
    return ': '.join(words for words in (blind[0].text, blind[0].advice) if words)


def _alert(active: Sequence[Group], snapshot: Snapshot, settings: Settings, view: View) -> Headline:
    row = active[0].first
    what, number = what_of(row, snapshot, settings)
    action, detail = order_of(row.advice)
    notes = _notes(snapshot, settings)
    if for_integrator(row):
        action, detail = ('STOP', DO_NOT) if row.level >= ERROR else (TELL, row.advice)
        if row.level >= ERROR:
            told = f'for the integrator: {row.advice}' if row.advice else ''
            notes = tuple(note for note in ('the margins are not to be trusted', told) if note)
    if view.fallen is not None:
        action, detail = STAND_CLEAR, LOOK.format(side=view.fallen.upper())
    if view.open:
        notes = (*notes, unknown_words(settings))
    return Headline(what, number, action, detail, row.text, notes, len(active) - 1)


def _waiting(snapshot: Snapshot, settings: Settings, view: View) -> Headline:
    """Return the headline where nothing is wrong now, but a person has to act before it is OK."""
    notes = _notes(snapshot, settings)
    if view.open:
        words = unknown_words(settings)
        return Headline('NOT ALL IS CHECKED', '', COMPLETE, ANSWER, words, notes)
    if not view.groups:
        return Headline('NOT ALL IS WELL', cause=UNTOLD, notes=notes)
    row = view.groups[0].first
    cause = f'{row.state}: {row.text}'
    if 'reset' in row.offers:
        detail = 'when the robot stands well again'
        return Headline('OVER, NOT RESET', '', 'RESET IT', detail, cause, notes)
    return Headline('OVER, NOT ACKNOWLEDGED', '', 'ACKNOWLEDGE IT', '', cause, notes)


def _kept(snapshot: Snapshot, settings: Settings) -> Headline:
    """Return the headline where nothing is wrong: what is kept, and the least tilt left."""
    side, angle = least_tilt(snapshot.angle)
    kept = kept_words(settings, rough=snapshot.rough)
    share = most_used(snapshot.torque, settings)[1] if snapshot.torque else math.nan
    number, cause = degrees_words(angle) if side else share_words(share), ''
    number = '' if number == '-' else number
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
    joint, share = most_used(torque, settings) if torque else ('', math.nan)
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
