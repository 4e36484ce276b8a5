"""Safeguards: what no criteria may overlook. They hold in every run unless criteria waive them.

A criteria file can demand little; but a robot past its tipping point, a joint beyond its limit, and
stretches that nobody saw must not pass because nobody asked. Whoever means it writes
`waive: {name: reason}`, which then stands in the first line of the verdict.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ugv_acceptance.evaluation.alerts.messages import describe
from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.carrying import judged_by_effort
from ugv_acceptance.evaluation.criteria.criteria import (
    CAUTIOUS,
    FAIL,
    INCONCLUSIVE,
    LEAST_DURATION,
    LONGEST_UNSEEN,
    PASS,
    TREND,
    CriteriaSet,
    DataDemand,
    Value,
)
from ugv_acceptance.evaluation.criteria.statement import Objection, Statement
from ugv_acceptance.evaluation.margin_words import number_beside, share_words, tipping_words
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.type_aliases import Json

SAFEGUARDS = {
    'tipping': 'the robot is never past its tipping point, nor about to be at the end',
    'ground': 'on uneven ground and stairs tip-over is judged by a rule that the criteria accept',
    'torque_limit': 'no joint needs more torque than its limit, nor is about to at the end',
    'unseen_stretches': f'no stretch of over {LONGEST_UNSEEN:g} s is without margins',
    'recording': 'the recording is whole, all of its messages are there, and it lasts a second',
    'chassis_acceleration': 'no acceleration of the chassis tips the robot or lifts its tracks',
    'static_model': 'joints move slowly enough for margins that assume they rest',
    'measured_effort': 'no measured effort reaches the limit of its joint',
    'residual': 'measured efforts differ from the model by less than the margin left',
    'payload': 'the payload is known, and is the one that was declared',
    'ground_contact': 'the arm touches the ground only where it may',
    'joint_positions': 'the positions of the joints are those of the arm',
    'imu': 'the IMU can be believed',
    'robot_description': "the robot's own URDF, where it is told, is that of the configuration",
}
# Alerts that are objections by themselves: code -> safeguard and verdict.
ALERT_OBJECTIONS: dict[str, tuple[str, str]] = {
    'ENCODER_FROZEN': ('joint_positions', INCONCLUSIVE),
    'INPUT_SLOW': ('unseen_stretches', INCONCLUSIVE),
    'ARM_ON_GROUND': ('ground_contact', INCONCLUSIVE),
}
# A limit will be passed within a second: nobody saw whether it was, where these alerts are
# active at the end. Code -> safeguard.
_AHEAD = {'TIP_AHEAD': 'tipping', 'TORQUE_AHEAD': 'torque_limit'}
# What a criterion on values is about, and the safeguard that would say the same again.
_SAID_BY = {
    'tip_angle': 'tipping',
    'torque_utilisation': 'torque_limit',
    'torque': 'torque_limit',
    'torque_margin': 'torque_limit',
}
# Safeguards that need an IMU, and contact points.
_OF_TILT = ('tipping', 'ground', 'chassis_acceleration')
# Stretches named in the reason.
_MOST_NAMED = 3


@dataclass(frozen=True, slots=True)
class Safeguarded:
    """The outcome of all safeguards: objections in force, those waived with the reason."""

    objections: tuple[Objection, ...]
    waived: tuple[tuple[Objection, str], ...]


def safeguarded(
    criteria: CriteriaSet,
    settings: Settings,
    alerts: Sequence[Alert],
    data: Json,
    statements: Sequence[Statement],
    start: int,
) -> Safeguarded:
    """Return all objections to a run: from its margins, its alerts, and its examinations.

    `data` is the part of the result about margins, coverage and alerts; `start` (ns) of the run.
    """
    found = [
        *_from_margins(data),
        *_unseen(criteria, data),
        *_not_whole(criteria, data),
        *_from_alerts(alerts, settings, {key for x in statements for key in x.unfounded}, start),
        *(objection for statement in statements for objection in statement.objections),
    ]
    reasons = dict(criteria.waive)
    return Safeguarded(
        tuple(o for o in found if o.safeguard not in reasons),
        tuple((o, reasons[o.safeguard]) for o in found if o.safeguard in reasons),
    )


def _from_margins(data: Json) -> Iterator[Objection]:
    stability = data['stability']
    least = stability['min_angle_deg']
    if least is not None and least <= 0.0:
        reason = (
            f'{tipping_words(stability["edge"], math.radians(least))} '
            f'at {stability["time_of_min_s"]:.2f} s'
        )
        yield Objection('tipping', FAIL, reason)
    for name, joint in data['torque'].items():
        most, unit = joint['max_abs'], joint['unit']
        if name in judged_by_effort(data):  # by the safeguard measured_effort
            continue
        if most is not None and most >= joint['limit']:
            reason = (
                f'{name} {share_words(most / joint["limit"])} of its limit at '
                f'{joint["time_of_min_s"]:.2f} s: it needs '
                f'{number_beside(most, joint["limit"])} of {joint["limit"]:.1f} {unit}'
            )
            yield Objection('torque_limit', FAIL, reason)


def _unseen(criteria: CriteriaSet, data: Json) -> Iterator[Objection]:
    """Object to long stretches without margins, unless a criterion says how long they may be."""
    demands = [c.demand for c in criteria.criteria]
    if any(isinstance(d, DataDemand) and d.quantity == 'longest_unseen' for d in demands):
        return
    spans = data['coverage']['unseen_s']
    if not spans:
        return
    named = ', '.join(f'{a:.2f} to {b:.2f} s ({b - a:.2f} s)' for a, b in spans[:_MOST_NAMED])
    count = data['coverage']['unseen_stretches']
    more = f' and {count - _MOST_NAMED} more' if count > _MOST_NAMED else ''
    yield Objection('unseen_stretches', INCONCLUSIVE, f'no margins from {named}{more}')


def _not_whole(criteria: CriteriaSet, data: Json) -> Iterator[Objection]:
    """Object to a recording of which something is missing, unless a criterion says how much may.

    In the words of the criteria that hold without a file, which then say the same.
    """
    demanded = {c.demand.quantity for c in criteria.criteria if isinstance(c.demand, DataDemand)}
    bag, seconds = data['bag'], data['coverage']['duration_s']
    words = {
        'salvaged': bag['salvaged'] and salvaged_words(data),
        'lost_messages': bag['lost_messages'] and lost_words(data),
        'duration': seconds < LEAST_DURATION and f'the recording lasts {seconds:.3g} s',
    }
    for quantity, reason in words.items():
        if reason and quantity not in demanded:
            yield Objection('recording', INCONCLUSIVE, reason)


def salvaged_words(data: Json) -> str:
    """Return in words why a recording is not whole."""
    return f'the recording is not whole: {data["bag"]["salvaged"]}'


def lost_words(data: Json) -> str:
    """Return in words how many messages are missing."""
    lost = data['bag']['lost_messages']
    return f'{lost} messages are missing that metadata.yaml or the index of the file counts'


def _from_alerts(
    alerts: Sequence[Alert], settings: Settings, unfounded: set[tuple[str, str]], start: int
) -> Iterator[Objection]:
    seen = set(unfounded)
    for alert in alerts:
        if alert.rule.code in _AHEAD and alert.end is None:
            words = f'the recording ends too early: {describe(alert, settings, start)}'
            yield Objection(_AHEAD[alert.rule.code], INCONCLUSIVE, words)
        told = ALERT_OBJECTIONS.get(alert.rule.code)
        if told is None or (alert.rule.code, alert.rule.subject) in seen:
            continue
        seen.add((alert.rule.code, alert.rule.subject))
        yield Objection(*told, describe(alert, settings, start))


def reasons_of(found: Safeguarded, verdict: str, failed: Sequence[Value]) -> list[str]:
    """Return the reasons that objections of a verdict add to those of failed criteria on values."""
    said = {_SAID_BY.get(value.signal) for value in failed}
    return [o.reason for o in found.objections if o.verdict == verdict and o.safeguard not in said]


def safeguards_result(found: Safeguarded, criteria: CriteriaSet, settings: Settings) -> list[Json]:
    """Return the outcome of every safeguard for JSON: the worst of its objections."""
    judged = any(math.isfinite(limit) for limit in settings.limits.torque)
    checked = {'torque_limit': judged, 'imu': settings.hears_imu}
    checked |= dict.fromkeys(_OF_TILT, settings.judges_tilt)
    reasons = dict(criteria.waive)
    every = [*found.objections, *(objection for objection, _ in found.waived)]
    result: list[Json] = []
    for name, demand in SAFEGUARDS.items():
        of = [o for o in every if o.safeguard == name]
        words = [o.verdict for o in of]
        word = next((w for w in (FAIL, INCONCLUSIVE) if w in words), PASS)
        result.append(
            {
                'name': name,
                'demand': demand,
                'verdict': word,
                'reasons': [o.reason for o in of],
                'evidence': [line for o in of for line in o.evidence],
                'waived': reasons.get(name),
                'checked': checked.get(name, True),
            }
        )
    return result


def with_objection(result: Json, objection: Objection) -> Json:
    """Return the parts of a result that change by an objection found later: it replaces a verdict.

    Nothing changes but the evidence if the criteria waive it.
    """
    safeguards = [dict(one) for one in result['safeguards']]
    (of,) = (one for one in safeguards if one['name'] == objection.safeguard)
    of['verdict'], of['reasons'] = objection.verdict, [objection.reason, *of['reasons']]
    if of['waived'] is not None:
        return {'safeguards': safeguards}
    reasons = [objection.reason]
    if result['verdict'] == objection.verdict:
        reasons += result['reasons']
    return {'verdict': objection.verdict, 'reasons': reasons, 'safeguards': safeguards}


def waived_words(criteria: CriteriaSet) -> str:
    """Return which safeguards the criteria waive and why, as one sentence; '' if none.

    Also the rule that they accept where the ground is not flat.
    """
    waived = [f'{name} waived ({reason})' for name, reason in criteria.waive]
    if criteria.ground is not None:
        rule = {TREND: 'the trend', CAUTIOUS: 'the cautious margin'}[criteria.ground.rule]
        waived.append(f'{rule} accepted on ground that is not flat ({criteria.ground.reason})')
    return ', '.join(waived)
