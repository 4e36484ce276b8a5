"""A criterion on a margin or another value, judged: worst value, violations, dwell, bound."""

from math import isfinite

from ugv_acceptance.evaluation.bounds import moment_json
from ugv_acceptance.evaluation.criteria import ANY, FAIL, IGNORED, INCONCLUSIVE, PASS, Criterion
from ugv_acceptance.evaluation.examination import ValueMeasure
from ugv_acceptance.evaluation.outcomes import Findings, Json, Outcome, alert_words, short_of_data
from ugv_acceptance.evaluation.signals import shown
from ugv_acceptance.evaluation.statements import demand_words, violation_words


def judge_value(criterion: Criterion, findings: Findings) -> Outcome:
    """Return what becomes of a criterion on a value."""
    measure = findings.examination.measures[criterion.name]
    assert isinstance(measure, ValueMeasure)  # noqa: S101 - by its demand
    measured = _measured(measure, findings)
    evidence = tuple(_related(measure, findings))
    short = short_of_data(measure.evaluated, criterion, findings)
    if not measure.samples:
        return Outcome(INCONCLUSIVE, f'{criterion.name}: no value was known', measured)
    if not _met(measure):
        if measure.demand.dwell is not None and short:
            return Outcome(INCONCLUSIVE, short, measured, evidence)
        return Outcome(
            FAIL, violation_words(measure, findings.settings, measured), measured, evidence
        )
    if short:
        return Outcome(INCONCLUSIVE, short, measured, evidence)
    if measure.demand.always and measured['inside_bound'] and _decides(criterion, findings):
        bound = measured['uncertainty']
        text = (
            f'{criterion.name}: met by {measured["distance"]:.3g} {measured["unit"]}, within the '
            f'uncertainty of {bound["bound"]:.3g} {measured["unit"]}'
        )
        return Outcome(INCONCLUSIVE, text.replace(' ,', ','), measured, evidence)
    return Outcome(PASS, demand_words(criterion, findings.settings), measured, evidence)


def _decides(criterion: Criterion, findings: Findings) -> bool:
    return findings.examination.criteria.uncertainty_of(criterion) != IGNORED


def _met(measure: ValueMeasure) -> bool:
    demand, violation = measure.demand, measure.violation
    if demand.dwell is not None:
        return _length(measure.kept.longest) >= demand.dwell
    if demand.always:
        worst = measure.worst[0].value
        return worst < demand.limit if demand.below else worst > demand.limit
    share = violation.total / measure.evaluated if measure.evaluated else 0.0
    spent = (
        (violation.total / 1e9, demand.time_in_violation),
        (_length(violation.longest), demand.longest_violation),
        (share, demand.share_in_violation),
    )
    return all(most is None or found <= most for found, most in spent)


def _length(span: tuple[int, int]) -> float:
    return (span[1] - span[0]) / 1e9


def _measured(measure: ValueMeasure, findings: Findings) -> Json:
    """Return a value's numbers in the unit people see."""
    demand, violation = measure.demand, measure.violation
    scale, unit = shown(demand.signal, demand.of, findings.settings)
    method = findings.examination.criteria.uncertainty_of(measure.criterion)
    worst = measure.worst[0] if measure.worst and isfinite(measure.worst[0].value) else None
    bound, first = findings.bounds.worst(measure, method), measure.first
    start, end = measure.span
    distance = demand.distance(worst.value) * scale if worst else None
    return {
        'signal': demand.signal,
        'of': demand.of,
        'unit': unit,
        'limit': demand.limit * scale,
        'must_be': 'below' if demand.below else 'above',
        'worst': worst.value * scale if worst else None,
        'worst_of': worst.subject if worst else None,
        'at_s': findings.seconds(worst.time) if worst else None,
        'distance': distance,
        'moment': moment_json(worst, findings.settings) if worst else None,
        'first_violation': moment_json(first, findings.settings) if first else None,
        'uncertainty': bound,
        'inside_bound': bool(bound and distance and distance > 0.0 >= bound['excess']),
        'evaluated_s': measure.evaluated / 1e9,
        'evaluated_share': measure.evaluated / (end - start) if end > start else 0.0,
        'time_in_violation_s': violation.total / 1e9,
        'share_in_violation': violation.total / measure.evaluated if measure.evaluated else 0.0,
        'violations': violation.count,
        'longest_violation_s': _length(violation.longest),
        'first_violations_s': [
            [findings.seconds(a), findings.seconds(b)] for a, b in violation.first
        ],
        'longest_kept_s': _length(measure.kept.longest) if demand.dwell is not None else None,
    }


_ALERT_OF = {
    'torque_utilisation': 'TORQUE_LIMIT',
    'torque': 'TORQUE_LIMIT',
    'torque_margin': 'TORQUE_LIMIT',
    'tip_angle': 'TIP_OVER',
    'speed': 'STATIC_MODEL',
}


def _related(measure: ValueMeasure, findings: Findings) -> list[str]:
    """Return the alerts about the same margin, in words with their times."""
    code, subject = _ALERT_OF.get(measure.demand.signal), measure.demand.of
    start, end = measure.span
    return [
        alert_words(a, findings)
        for a in findings.alerts
        if a.rule.code == code
        and subject in (a.rule.subject, ANY)
        and a.start <= end
        and (a.end is None or a.end >= start)
    ]
