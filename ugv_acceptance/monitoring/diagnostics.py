"""The monitor's verdict, alert messages and diagnostics as plain values, ready to be published."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from ugv_acceptance import __version__
from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.alerts.alarms import Alarm, Change, State, key_of
from ugv_acceptance.evaluation.alerts.messages import suspect_of
from ugv_acceptance.evaluation.alerts.rules import urgency
from ugv_acceptance.evaluation.alerts.state_machine import LEVELS, OK, STALE, WARN, Alert
from ugv_acceptance.evaluation.criteria.not_judged import kept_words, unknown_words
from ugv_acceptance.evaluation.inputs.joint_names import names_words
from ugv_acceptance.evaluation.inputs.joint_words import held_words
from ugv_acceptance.evaluation.least_margins import least_tilt, tilt_not_checked, with_most_used
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.margin_words import share_words
from ugv_acceptance.evaluation.permitted_limits import UNSAFE, relaxed_words
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.model.stability import NO_CONTACT, SIDES, STATES
from ugv_acceptance.monitoring.ground_words import ground_values, tilt_words
from ugv_acceptance.monitoring.input_status import InputSources, input_status
from ugv_acceptance.monitoring.message_order import in_order
from ugv_acceptance.monitoring.ok_word import REACHED, danger_is_reached
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.monitoring.status import Status as Status  # noqa: PLC0414 - others take it from here

# What stands in place of torques while the arm touches the ground with permission.
TORQUE_NOT_JUDGED = 'torque not judged: the hand may touch the ground'


def verdict_of(session: Session) -> Status:
    """Return the verdict line for the operator: most severe cause, what to do, what is left."""
    alarm_tracker, now = session.alarm_tracker, session.clock.now()
    margins, active = session.evaluator.margins, session.active
    session.advisory.renew(now, active)
    left = _left(margins, session) if margins else 'margins not known'
    unseen = sum(alarm.state.unseen for alarm in alarm_tracker.alarms.table.values())
    values: dict[str, object] = {
        'left': left,
        'alerts_active': len(active),
        'alerts_unacknowledged': unseen,
        **_limits(session),
        **ground_values(session.evaluator),
    }
    known = session.advisory.values(now)
    left = '; '.join([left, *session.advisory.hints(now), *_untold(session)])
    if active:
        return _worst(session, active, left, values | known)
    if margins is None:
        waited = ' and '.join(name for name in session.counts if name != 'payload')
        text = f'waiting for {waited}: no margins yet'
        return Status(STALE, '', text, values | known)
    if session.evaluator.waits_for_trend:
        ground = session.settings.ground.taken
        text = f'{ground}: whether the robot begins to tip is not known yet; {left}'
        return Status(STALE, '', text, values | known)
    if alarm_tracker.waiting:
        return _over(session, alarm_tracker.waiting[-1], left, values | known)
    if session.settings.unknown:
        text = '; '.join(words for words in (unknown_words(session.settings), left) if words)
        return Status(STALE, '', text, values | known)
    kept = kept_words(session.settings, rough=session.settings.ground.rough)
    words = REACHED if danger_is_reached(session) else kept
    return Status(OK, '', f'{words}: {left}', values | known)


def _left(margins: Margins, session: Session) -> str:
    settings = session.settings
    if any(map(math.isnan, margins.torque)):
        tilt = tilt_words(margins, session.evaluator) or 'no tilt margin'
        return (
            f'{tilt if settings.judges_tilt else tilt_not_checked(settings)}, {TORQUE_NOT_JUDGED}'
        )
    if not settings.judges_tilt:
        return with_most_used('', margins.torque, settings)
    return with_most_used(tilt_words(margins, session.evaluator), margins.torque, settings)


def _worst(
    session: Session, active: Sequence[Alert], left: str, values: dict[str, object]
) -> Status:
    """Return the verdict while alerts are active: that of the most severe one."""
    alarm_tracker, advisory = session.alarm_tracker, session.advisory
    first = max(active, key=lambda a: (*_severity(a), not alarm_tracker.acknowledged(a)))
    words = relaxed_words(session.settings) if session.relaxed else ''
    if words and first.rule.code != 'LIMITS_RELAXED':  # else it says so itself
        left = f'{left}; {words}'
    more = f' (and {len(active) - 1} more)' if len(active) > 1 else ''
    do = advisory.do(first)
    sentence = session.faults.sentence(_now(first, session), session.settings)
    text = in_order(sentence, do, *_more(left, sentence), more=more)
    own = {
        **_named(first),
        'do': do,
        'acknowledged': all(map(alarm_tracker.acknowledged, active)),
    }
    return Status(session.level, '', text, own | values)


def _more(left: str, sentence: str) -> list[str]:
    """Return what is left without what the sentence of the alert begins with."""
    first, _, others = left.partition(', ')
    words = others if sentence.startswith(f'{first};') else left
    return [words] if words else []


def _limits(session: Session) -> dict[str, object]:
    """Return the hash of the limits in force, what is wider than permitted, and if the hand may."""
    values: dict[str, object] = {'limits_hash': session.limits_hash}
    if session.relaxed:
        names = ', '.join(breach.name for breach in session.relaxed)
        values |= {'limits_relaxed': names, UNSAFE: session.settings.unsafe}
    if session.settings.hand_may_touch:
        values['hand_may_touch'] = True
    if session.evaluator.joints.never_told:
        values['untold_joints'] = held_words(session.settings, session.evaluator.joints.never_told)
    return values


def _untold(session: Session) -> Iterator[str]:
    """Yield which joints are taken as held because no message told them, if any are."""
    if session.evaluator.joints.never_told:
        yield f'never told, taken as held: {names_words(session.evaluator.joints.never_told)}'


def _now(alert: Alert, session: Session) -> Alert:
    """Return an alert with its present value instead of its worst."""
    code, subject = alert.rule.code, alert.rule.subject
    margins, names = session.evaluator.margins, session.settings.robot.joint_names
    peak = math.nan
    if margins is not None and code == 'TORQUE_LIMIT' and subject in names:
        peak = abs(margins.torque[names.index(subject)])
    elif margins is not None and code == 'TIP_OVER' and subject in SIDES:
        peak = -float(margins.angle[SIDES.index(subject)])
    return alert if math.isnan(peak) else replace(alert, peak=peak)


def _over(session: Session, alarm: Alarm, left: str, values: dict[str, object]) -> Status:
    """Return the verdict while a failure that is over must still be acknowledged or reset."""
    latched = alarm.state is State.LATCHED
    text = (
        f'over now, {"latched until reset" if latched else "not acknowledged"}: '
        f'{session.faults.sentence(alarm.alert, session.settings)}; {left}'
    )
    own = {**_named(alarm.alert), 'do': 'reset' if latched else 'acknowledge'}
    return Status(max(session.level, WARN), '', text, own | values)


def _named(alert: Alert) -> dict[str, object]:
    rule = alert.rule
    return {
        'code': rule.code,
        'subject': rule.subject,
        'class': suspect_of(rule.code),
        'peak': float(alert.peak),
        'worst_ns': _worst_ns(alert),
    }


def _worst_ns(alert: Alert) -> int | str:
    """Return when the worst value of an alert came (ns); '' where nobody knows."""
    return '' if alert.worst_at is None else alert.worst_at


def _severity(alert: Alert) -> tuple[int, int]:
    """Return the sort key of an alert: its level, and its urgency at that level."""
    return alert.rule.level, urgency(alert.rule.code, alert.rule.level)


def alert_status(change: Change, session: Session) -> Status:
    """Return a change of an alarm as a status, ready to be published."""
    alert, rule = change.alert, change.alert.rule
    sentence, do = session.faults.sentence(alert, session.settings), session.advisory.do(alert)
    shelved = session.alarm_tracker.alarms.shelved(key_of(rule))
    values: dict[str, object] = {
        'state': change.how,
        'code': rule.code,
        'subject': rule.subject,
        'level': LEVELS[rule.level],
        'start_ns': alert.start,
        'end_ns': '' if alert.end is None else alert.end,
        'peak': float(alert.peak),
        'worst_ns': _worst_ns(alert),
        'happened': sentence,
        'do': do,
        'class': suspect_of(rule.code),
        'alarm': change.state.value,
        'offers': ','.join(_offers(change, shelved=shelved)),
        'shelved': shelved,
        'time_ns': change.time,
        'who': change.who,
        'from': change.sender,
        'note': change.note,
        'limits_hash': session.limits_hash,
    }
    level = OK if change.how in {'cleared', 'reset'} else rule.level
    wanted = do if change.state.active else ''
    text = in_order(sentence, wanted, before=f'{change.how}: ')
    return Status(level, f'{rule.code} {rule.subject}', text, values)


def _offers(change: Change, *, shelved: bool) -> Iterator[str]:
    """Yield the commands an operator may give for an alarm now: acknowledge, shelve, reset, ..."""
    if change.state.unseen:
        yield 'acknowledge'
    if change.state.active and change.alert.rule.level == WARN:
        yield 'unshelve' if shelved else 'shelve'
    if change.state is State.LATCHED:
        yield 'reset'


def margin_statuses(
    evaluator: LiveEvaluator, active: Sequence[Alert], moving: Sequence[float] | None = None
) -> Iterator[Status]:
    """Yield a status for every judged joint, and one for the tip-over margins.

    `moving` is the tilt left (rad) to each of SIDES with the energy of the turn the robot is in.
    """
    settings, margins = evaluator.settings, evaluator.margins
    for j, name in enumerate(settings.robot.joint_names):
        limit = settings.limits.torque[j]
        if math.isfinite(limit):
            torque = margins.torque[j] if margins else math.nan
            level = _level(active, 'TORQUE_LIMIT', name, margins)
            use = abs(torque) / limit
            text = f'{share_words(use)} of its limit' if margins else 'not known'
            text = TORQUE_NOT_JUDGED if margins and math.isnan(use) else text
            numbers: dict[str, object] = {
                'torque': torque,
                'limit': limit,
                'margin': limit - abs(torque),
                'utilisation': use,
            }
            yield Status(level, f'Torque {name}', text, numbers)
    if settings.judges_tilt:
        yield _tip_status(evaluator, active, moving)
    else:
        yield Status(STALE, 'Tip-over', tilt_not_checked(settings))


def _tip_status(
    evaluator: LiveEvaluator, active: Sequence[Alert], moving: Sequence[float] | None
) -> Status:
    codes = ('TIP_OVER', 'TIP_TREND', 'NO_SUPPORT', 'TIP_MOVING', 'ACCELERATION', 'TRACK_LIFT')
    margins = evaluator.margins
    level = max(_level(active, code, None, margins) for code in codes)
    if margins is None:
        return Status(level, 'Tip-over', 'not known', ground_values(evaluator))
    level = max(level, STALE if evaluator.waits_for_trend else OK)
    stability = margins.stability
    state = STATES[int(stability.state)]
    values: dict[str, object] = {'state': state, **ground_values(evaluator)}
    for side, angle, moment in zip(SIDES, stability.angle, stability.moment, strict=True):
        values[f'{side}_deg'] = math.degrees(angle)
        values[f'{side}_moment_nm'] = float(moment)
    if stability.state >= NO_CONTACT:
        return Status(level, 'Tip-over', f'no margin: {state}', values)
    values['edge'], _ = least_tilt(stability.angle)
    if moving is not None:
        values['moving_deg'] = math.degrees(min(moving))
    return Status(level, 'Tip-over', tilt_words(margins, evaluator), values)


def _level(active: Sequence[Alert], code: str, subject: str | None, margins: Margins | None) -> int:
    levels = [
        alert.rule.level
        for alert in active
        if alert.rule.code == code and subject in (None, alert.rule.subject)
    ]
    return max([*levels, OK if margins else STALE])


def _doubted(status: Status) -> Status:
    """Return the status of a margin that rests on a joint which is taken as held."""
    return replace(
        status, level=max(status.level, STALE), message=f'in doubt, see Monitor: {status.message}'
    )


def unavailable(problem: str) -> Status:
    """Return the verdict (STALE) of a monitor that is not active, with the `problem` if any."""
    do = problem or 'configure and activate it'
    return Status(STALE, '', f'the monitor is not active: {do}', {'do': do})


def diagnostics_of(
    verdict: Status,
    config: Config | None,
    session: Session | None,
    inputs: InputSources | None,
    transport: Mapping[str, object] = MappingProxyType({}),
) -> list[Status]:
    """Return all statuses for /diagnostics; the first is the monitor itself.

    `transport` are values that say how messages reach it.
    """
    statuses = [_monitor(verdict, config, session, transport)]
    if session is not None:
        active = session.active
        moving = session.evaluator.moving
        found = margin_statuses(session.evaluator, active, moving)
        statuses += map(_doubted, found) if session.evaluator.joints.doubted else found
        worst_first = sorted(active, key=_severity, reverse=True)
        statuses += [input_status(name, session, inputs, worst_first) for name in session.counts]
    return statuses


def _monitor(
    verdict: Status,
    config: Config | None,
    session: Session | None,
    transport: Mapping[str, object],
) -> Status:
    values: dict[str, object] = {'version': __version__, **transport}
    if config is not None:
        values |= {
            'robot': config.name,
            'config': config.path,
            'sha256': config.sha256,
            'urdf_sha256': config.urdf_sha256,
            'description': config.description,
            'warnings': len(config.warnings),
            'operators': ', '.join(config.operators or ['anybody']),
        }
    if session is not None:
        values |= {
            'evaluated': session.evaluator.evaluated,
            'use_sim_time': session.stamps.simulated,
        }
    return Status(verdict.level, 'Monitor', verdict.message, {**values, **verdict.values})
