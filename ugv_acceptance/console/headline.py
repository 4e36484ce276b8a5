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
from ugv_acceptance.console.snapshot import AlertRow, Snapshot
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
IN_DOUBT = 'what is known now is in doubt'
DOUBTFUL = 'the margins are not to be trusted'
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
    `notes` are lines of less weight, first the margins that are not said above; `more` the number
    of further active causes. `margins` are the least tilt left and the joint most used, ''
    where nothing is known or the robot has tipped.
    """

    what: str
    number: str = ''
    action: str = ''
    detail: str = ''
    cause: str = ''
    notes: tuple[str, ...] = ()
    more: int = 0
    margins: str = ''

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
            'margins': self.margins,
        }


@dataclass(frozen=True, slots=True)
class Margins:
    """The least `tilt` left in words, to which `side`; the `joint` most used, and its share."""

    tilt: str
    side: str
    joint: str
    share: float

    @property
    def used(self) -> str:
        """The joint most used in words; '' if none has a limit."""
        return f'{name_words(self.joint)} {share_words(self.share)}' if self.joint else ''

    @property
    def words(self) -> str:
        """Both margins in a few words: "6 deg to tipping: RIGHT, shoulder 43 %"."""
        used = self.used
        return f'{self.tilt}, {used}' if used else self.tilt

    def beside(self, told: str) -> tuple[str, ...]:
        """Return the margins in words, without that of a side or a joint that was `told`."""
        if not told or told not in {self.side, self.joint}:
            return (self.words,)
        rest = self.tilt if told == self.joint else self.used
        return (rest,) if rest else ()


@dataclass(frozen=True, slots=True)
class View:
    """What is decided on a snapshot before anything is worded.

    `level` is the one shown. `open`: only what the configuration leaves unknown keeps it from OK.
    `dead`: nothing that is shown may be taken for the present. `doubted`: the IMU contradicts
    itself or gravity. `fallen` is the side it has tipped to (None: it has not). `groups` are the
    alerts by cause, and `active` those of them that are there now, each most urgent first; `least`
    is the side of the least tilt left, and how much (rad), as of `least_tilt`.
    """

    snapshot: Snapshot
    settings: Settings
    level: int
    open: bool
    dead: bool
    doubted: bool
    fallen: str | None
    groups: tuple[Group, ...]
    active: tuple[Group, ...]
    least: tuple[str, float]


def view_of(snapshot: Snapshot, settings: Settings) -> View:
    """Return what of a snapshot is to be shown.

    The level is the monitor's verdict, but never better than a danger that is active, or than the
    numbers of a robot that has tipped: their alerts come a moment before the verdict, or after.
    Where tilt is judged and none is known, as in free fall, nothing is OK.
    """
    groups = groups_of(snapshot.alerts)
    active = tuple(group for group in groups if group.active)
    worst = max([group.first.level for group in active], default=OK)
    # Nobody measures how a robot without an IMU leans.
    judged = snapshot.known and settings.judges_tilt
    tipped = judged and has_tipped(snapshot.angle)
    level = max(snapshot.level, ERROR if tipped else OK, worst if worst >= ERROR else OK)
    least = least_tilt(snapshot.angle) if settings.judges_tilt else ('', math.nan)
    untold = level == OK and judged and not least[0]
    level = level if snapshot.known and not untold else STALE
    asked = bool(settings.unknown) and snapshot.known and ERROR not in {level, worst}
    unanswered = asked and worst != STALE
    dead = level == STALE and not unanswered
    doubted = any(_contradicts(group.first) for group in active)
    return View(
        snapshot,
        settings,
        STALE if unanswered else level,
        unanswered,
        dead,
        doubted,
        least[0] if tipped else _fell_to(snapshot),
        groups,
        active,
        least,
    )


def _contradicts(row: AlertRow) -> bool:
    return row.level == ERROR and row.code.startswith('IMU_')


def _fell_to(snapshot: Snapshot) -> str | None:
    """Return the side to which a robot has tipped before; None if it has not.

    It is said while the alert of it waits for a person, and while there are no numbers and the last
    said so.
    """
    for row in snapshot.alerts:
        if row.code == 'TIP_OVER' and row.level == ERROR and row.peak >= TIPPED:
            return row.subject
    last = snapshot.last
    if not snapshot.known and last is not None and has_tipped(last.angle):
        return least_tilt(last.angle)[0]
    return None


def headline_of(view: View) -> Headline:
    """Return the headline of what is to be shown."""
    # A tip-over drawn from an IMU that is contradicted may be none.
    if view.fallen is not None and (view.dead or not view.doubted):
        return _fallen(view, view.fallen)
    if view.dead:
        return _no_data(view)
    margins = _margins(view)
    if view.active:
        return _alert(view, margins)
    if view.level != OK:
        return _waiting(view, margins)
    return _kept(view, margins)


def _fallen(view: View, side: str) -> Headline:
    notes: tuple[str, ...] = ()
    if view.dead:
        notes = (_last_words(view),)
    elif not has_tipped(view.snapshot.angle):
        notes = (STANDS,)
    what = f'{TIPPED_WHAT} {side.upper()}'.rstrip()
    cause = _why(view) if view.dead else ''
    others = [group for group in view.active if group.kind != TIPPING]
    return Headline(what, '', STAND_CLEAR, TIPPED_DETAIL, cause, notes, len(others))


def _no_data(view: View) -> Headline:
    active = view.active
    told = not view.snapshot.problem and any(blinds(group.first) for group in active)
    notes, cause = (_last_words(view),), _why(view)
    return Headline('NO DATA', '', 'STOP', DO_NOT, cause, notes, len(active) - told)


def _why(view: View) -> str:
    """Return why there are no data, for the integrator: what is silent, and what to check.

    No alert that was raised by margins says why there are none.
    """
    problem, blind = view.snapshot.problem, [g.first for g in view.active if blinds(g.first)]
    if problem or not blind:
        return problem or UNKNOWN
    return ': '.join(words for words in (blind[0].text, blind[0].advice) if words)


def _alert(view: View, margins: Margins) -> Headline:
    row, snapshot = view.active[0].first, view.snapshot
    what, number = what_of(row, snapshot, view.settings)
    action, detail = order_of(row.advice)
    notes = (*margins.beside(row.subject if number else ''), *snapshot.hints)
    if for_integrator(row) and row.level < ERROR:
        action, detail = TELL, row.advice
    elif for_integrator(row):
        action, detail = 'STOP', DO_NOT
        notes = (DOUBTFUL, f'for the integrator: {row.advice}')
    if view.fallen is not None:
        action, detail = STAND_CLEAR, LOOK.format(side=view.fallen.upper())
    if view.open:
        notes = (*notes, unknown_words(view.settings))
    more = len(view.active) - 1
    return Headline(what, number, action, detail, row.text, notes, more, margins.words)


def _waiting(view: View, margins: Margins) -> Headline:
    """Return the headline where nothing is wrong now, but a person has to act before it is OK."""
    what, action, detail, cause = 'NOT ALL IS WELL', '', '', UNTOLD
    if view.open:
        what, action, detail = 'NOT ALL IS CHECKED', COMPLETE, ANSWER
        cause = unknown_words(view.settings)
    elif view.groups:
        row = view.groups[0].first
        what, action, cause = 'OVER, NOT ACKNOWLEDGED', 'ACKNOWLEDGE IT', f'{row.state}: {row.text}'
        if 'reset' in row.offers:
            what, action, detail = 'OVER, NOT RESET', 'RESET IT', 'when the robot stands well again'
    notes = (margins.words, *view.snapshot.hints)
    return Headline(what, '', action, detail, cause, notes, margins=margins.words)


def _kept(view: View, margins: Margins) -> Headline:
    """Return the headline where nothing is wrong: what is kept, and the least margin."""
    snapshot, settings, (side, angle) = view.snapshot, view.settings, view.least
    kept = kept_words(settings, rough=snapshot.rough)
    words = degrees_words(angle) if side else share_words(margins.share)
    number = '' if words == '-' else words
    what, _, rest = kept.upper().partition(', ')
    cause = kept if rest else ''
    if snapshot.rough and settings.judges_tilt:
        what, number, cause = 'NOT BEGUN TO TIP', number and f'<= {number}', kept
    notes = (margins.words, *snapshot.hints)
    return Headline(what, number, cause=cause, notes=notes, margins=margins.words)


def _margins(view: View) -> Margins:
    snapshot, settings, (side, angle) = view.snapshot, view.settings, view.least
    careful = snapshot.rough or snapshot.carried
    if side:
        tilt = _bound_words(side, angle, snapshot.cautious, rough=snapshot.rough)
        tilt += f' ({CARRIED})' * (snapshot.carried and not snapshot.rough)
    elif not settings.judges_tilt:
        tilt = tilt_not_checked(settings)
    else:
        tilt = f'no tilt margin ({STATES[snapshot.state].replace("_", " ")})'
    # What is no plain number is said in full, also where its number stands above.
    return Margins(tilt, '' if careful else side, *_most(snapshot.torque, settings))


def _bound_words(side: str, angle: float, cautious: float = math.nan, *, rough: bool) -> str:
    """Return the tilt left, where the ground is not flat as the upper bound that it is."""
    words = tipping_words(side, angle)
    if not rough:
        return words
    careful = '' if math.isnan(cautious) else f', {degrees_words(cautious)} taken cautiously'
    return f'at most {words} (upper bound{careful})'


def _most(torque: Sequence[float], settings: Settings) -> tuple[str, float]:
    return most_used(torque, settings) if torque else ('', math.nan)


def _last_words(view: View) -> str:
    """Return what was known last, and how long ago."""
    snapshot, last = view.snapshot, view.snapshot.last
    if last is None:
        return IN_DOUBT if snapshot.known else 'nothing was known before'
    side, angle = least_tilt(last.angle)
    tilt = _bound_words(side, angle, rough=last.rough) if side else 'no tilt margin'
    ago = max(snapshot.time - last.time, 0) / 1e9
    words = Margins(tilt, side, *_most(last.torque, view.settings)).words
    return f'last known {ago:.1f} s ago: {words}'
