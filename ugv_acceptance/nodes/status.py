"""What the monitor says: verdict and diagnostics as plain values, ready to be published."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from ugv_acceptance.evaluation.alerts import LEVELS, OK, STALE, WARN, Alert
from ugv_acceptance.evaluation.live import Margins
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import NO_CONTACT, SIDES, STATES
from ugv_acceptance.nodes.faults import Faults, what_to_do
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
    faults, follower, settings = session.faults, session.follower, session.settings
    margins, active = session.evaluator.margins, session.active
    left = what_is_left(margins, settings) if margins else 'margins not known'
    values: dict[str, object] = {'left': left, 'alerts_active': len(active)}
    if active:
        first = max(active, key=lambda a: (*_severity(a), not follower.acknowledged(a)))
        more = f' (and {len(active) - 1} more)' if len(active) > 1 else ''
        text = f'{faults.sentence(first, settings)}{more}; {left}; {what_to_do(first.rule.code)}'
        values |= {
            'code': first.rule.code,
            'subject': first.rule.subject,
            'do': what_to_do(first.rule.code),
            'acknowledged': all(map(follower.acknowledged, active)),
        }
        return Status(session.level, '', text, values)
    if margins is None:
        return Status(STALE, '', 'waiting for joint_states and imu: no margins yet', values)
    if follower.latched:
        last = follower.latched[-1]
        text = f'over now, not acknowledged: {faults.sentence(last, settings)}; {left}'
        values |= {'code': last.rule.code, 'subject': last.rule.subject, 'do': 'acknowledge'}
        return Status(max(session.level, WARN), '', text, values)
    return Status(OK, '', f'all margins kept: {left}', values)


def _severity(alert: Alert) -> tuple[int, bool]:
    """At the same level a robot that tips over comes before a motor that gives way."""
    return alert.rule.level, alert.rule.code in {'TIP_OVER', 'NO_SUPPORT'}


def alert_status(alert: Alert, state: str, settings: Settings, faults: Faults) -> Status:
    """Return a change of an alert: `state` is raised, cleared, acknowledged or reset."""
    rule = alert.rule
    values: dict[str, object] = {
        'state': state,
        'code': rule.code,
        'subject': rule.subject,
        'level': LEVELS[rule.level],
        'start_ns': alert.start,
        'end_ns': '' if alert.end is None else alert.end,
        'peak': float(alert.peak),
        'do': what_to_do(rule.code),
    }
    level = OK if state in {'cleared', 'reset'} else rule.level
    sentence = faults.sentence(alert, settings)
    return Status(level, f'{rule.code} {rule.subject}', f'{state}: {sentence}', values)


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
