"""What the monitor says: verdict and diagnostics as plain values, ready to be published."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

from ugv_acceptance.evaluation.alarms import Alarm, Change, State, key_of
from ugv_acceptance.evaluation.alerts import LEVELS, OK, STALE, WARN, Alert
from ugv_acceptance.evaluation.live import Margins
from ugv_acceptance.evaluation.permitted import UNSAFE, relaxed, relaxed_words
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import NO_CONTACT, SIDES, STATES
from ugv_acceptance.nodes.faults import suspect_of
from ugv_acceptance.nodes.session import Session


@dataclass(frozen=True, slots=True)
class Status:
    """One line of a diagnosis: `level` as in DiagnosticStatus, what is the case, and numbers."""

    level: int
    name: str
    message: str
    values: dict[str, object] = field(default_factory=dict)


def worst_joint(margins: Margins, settings: Settings) -> tuple[str, float]:
    """Return the joint that uses most of its limit, and its share; '' where none has a limit."""
    joints = zip(settings.robot.joint_names, margins.torque, settings.limits.torque, strict=True)
    uses = [(name, abs(tau) / limit) for name, tau, limit in joints if math.isfinite(limit)]
    return max(uses, key=lambda use: use[1], default=('', 0.0))


def least_tilt(margins: Margins) -> tuple[str, float]:
    """Return the side to which least tilt is left, and how much (rad); NaN where none is known."""
    angles = map(float, margins.stability.angle)
    known = [(s, a) for s, a in zip(SIDES, angles, strict=True) if not math.isnan(a)]
    return min(known, key=lambda side: side[1], default=('', math.nan))


def what_is_left(margins: Margins, settings: Settings) -> str:
    """Return the margins in a few words."""
    side, angle = least_tilt(margins)
    joint, use = worst_joint(margins, settings)
    tilt = f'{math.degrees(angle):.1f} deg of tilt left ({side})' if side else 'no tilt margin'
    return f'{tilt}, {joint} at {use:.0%} of its limit' if joint else tilt


def verdict_of(session: Session) -> Status:
    """Return the one line an operator reads: the most severe cause, what is left, what to do."""
    follower, now = session.follower, session.clock.now()
    margins, active = session.evaluator.margins, session.active
    session.counsel.renew(now, active)
    left = what_is_left(margins, session.settings) if margins else 'margins not known'
    unseen = sum(alarm.state.unseen for alarm in follower.alarms.table.values())
    values: dict[str, object] = {
        'left': left,
        'alerts_active': len(active),
        'alerts_unacknowledged': unseen,
        **_limits(session),
    }
    known = session.counsel.values(now)
    left = '; '.join([left, *session.counsel.hints(now)])
    if active:
        return _worst(session, active, left, values | known)
    if margins is None:
        text = 'waiting for joint_states and imu: no margins yet'
        return Status(STALE, '', text, values | known)
    if follower.waiting:
        return _over(session, follower.waiting[-1], left, values | known)
    return Status(OK, '', f'all margins kept: {left}', values | known)


def _worst(
    session: Session, active: Sequence[Alert], left: str, values: dict[str, object]
) -> Status:
    """Return the verdict while alerts are active: the most severe one speaks."""
    follower, counsel = session.follower, session.counsel
    first = max(active, key=lambda a: (*_severity(a), not follower.acknowledged(a)))
    words = relaxed_words(session.settings)
    if words and first.rule.code != 'LIMITS_RELAXED':  # else it says so itself
        left = f'{left}; {words}'
    more = f' (and {len(active) - 1} more)' if len(active) > 1 else ''
    do = counsel.do(first)
    text = f'{session.faults.sentence(_now(first, session), session.settings)}{more}; {left}; {do}'
    own = {
        **_named(first),
        'do': do,
        'acknowledged': all(map(follower.acknowledged, active)),
    }
    return Status(session.level, '', text, own | values)


def _limits(session: Session) -> dict[str, object]:
    """Return by what limits is judged, and which of them are wider than permitted, and why."""
    values: dict[str, object] = {'limits_hash': session.limits_hash}
    found = relaxed(session.settings)
    if found:
        names = ', '.join(breach.name for breach in found)
        values |= {'limits_relaxed': names, UNSAFE: session.settings.unsafe}
    return values


def _now(alert: Alert, session: Session) -> Alert:
    """Return an alert with the margin of now in place of its worst."""
    code, subject = alert.rule.code, alert.rule.subject
    margins, names = session.evaluator.margins, session.settings.robot.joint_names
    peak = math.nan
    if margins is not None and code == 'TORQUE_LIMIT' and subject in names:
        peak = abs(margins.torque[names.index(subject)])
    elif margins is not None and code == 'TIP_OVER' and subject in SIDES:
        peak = -float(margins.stability.angle[SIDES.index(subject)])
    return alert if math.isnan(peak) else replace(alert, peak=peak)


def _over(session: Session, alarm: Alarm, left: str, values: dict[str, object]) -> Status:
    """Return the verdict while a failure that is over waits to be acknowledged or reset."""
    latched = alarm.state is State.LATCHED
    text = (
        f'over now, {"latched until reset" if latched else "not acknowledged"}: '
        f'{session.faults.sentence(alarm.alert, session.settings)}; {left}'
    )
    own = {**_named(alarm.alert), 'do': 'reset' if latched else 'acknowledge'}
    return Status(max(session.level, WARN), '', text, own | values)


def _named(alert: Alert) -> dict[str, object]:
    rule = alert.rule
    return {'code': rule.code, 'subject': rule.subject, 'class': suspect_of(rule.code)}


def _severity(alert: Alert) -> tuple[int, bool]:
    """At the same level a robot that tips over comes before a motor that gives way."""
    return alert.rule.level, alert.rule.code in {'TIP_OVER', 'NO_SUPPORT'}


def alert_status(change: Change, session: Session) -> Status:
    """Return a change of an alert, ready to be published."""
    alert, rule = change.alert, change.alert.rule
    shelved = session.follower.alarms.shelved(key_of(rule))
    values: dict[str, object] = {
        'state': change.how,
        'code': rule.code,
        'subject': rule.subject,
        'level': LEVELS[rule.level],
        'start_ns': alert.start,
        'end_ns': '' if alert.end is None else alert.end,
        'peak': float(alert.peak),
        'do': session.counsel.do(alert),
        'class': suspect_of(rule.code),
        'alarm': change.state.value,
        'offers': ','.join(_offers(change, shelved=shelved)),
        'shelved': shelved,
        'time_ns': change.time,
        'who': change.who,
        'note': change.note,
        'limits_hash': session.limits_hash,
    }
    level = OK if change.how in {'cleared', 'reset'} else rule.level
    sentence = session.faults.sentence(alert, session.settings)
    return Status(level, f'{rule.code} {rule.subject}', f'{change.how}: {sentence}', values)


def _offers(change: Change, *, shelved: bool) -> Iterator[str]:
    """Yield what an operator may do about an alert now."""
    if change.state.unseen:
        yield 'acknowledge'
    if change.state.active and change.alert.rule.level == WARN:
        yield 'unshelve' if shelved else 'shelve'
    if change.state is State.LATCHED:
        yield 'reset'


def margin_statuses(
    settings: Settings, margins: Margins | None, active: Sequence[Alert]
) -> Iterator[Status]:
    """Yield the state of every judged joint and of the tip-over margins."""
    for j, name in enumerate(settings.robot.joint_names):
        limit = settings.limits.torque[j]
        if math.isfinite(limit):
            torque = margins.torque[j] if margins else math.nan
            level = _level(active, 'TORQUE_LIMIT', name, margins)
            use = abs(torque) / limit
            text = f'{use:.0%} of its limit' if margins else 'not known'
            numbers: dict[str, object] = {
                'torque': torque,
                'limit': limit,
                'margin': limit - abs(torque),
                'utilisation': use,
            }
            yield Status(level, f'Torque {name}', text, numbers)
    yield _tip_status(margins, active)


def _tip_status(margins: Margins | None, active: Sequence[Alert]) -> Status:
    level = max(_level(active, code, None, margins) for code in ('TIP_OVER', 'NO_SUPPORT'))
    if margins is None:
        return Status(level, 'Tip-over', 'not known')
    stability = margins.stability
    state = STATES[int(stability.state)]
    values: dict[str, object] = {'state': state}
    for side, angle, moment in zip(SIDES, stability.angle, stability.moment, strict=True):
        values[f'{side}_deg'] = math.degrees(angle)
        values[f'{side}_moment_nm'] = float(moment)
    if stability.state >= NO_CONTACT:
        return Status(level, 'Tip-over', f'no margin: {state}', values)
    side, angle = least_tilt(margins)
    values['edge'] = side
    return Status(level, 'Tip-over', f'{math.degrees(angle):.1f} deg of tilt left ({side})', values)


def _level(active: Sequence[Alert], code: str, subject: str | None, margins: Margins | None) -> int:
    levels = [
        alert.rule.level
        for alert in active
        if alert.rule.code == code and subject in (None, alert.rule.subject)
    ]
    return max([*levels, OK if margins else STALE])
