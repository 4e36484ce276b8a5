"""Judges each criterion, and the run by its worst outcome: PASS, FAIL or INCONCLUSIVE.

A violation is a FAIL however little was evaluated; a PASS needs enough data, and a margin larger
than the bound of its uncertainty.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from math import isfinite

from ugv_acceptance.evaluation.alerts.state_machine import LEVELS, Alert
from ugv_acceptance.evaluation.carrying import judged_by_effort
from ugv_acceptance.evaluation.criteria.criteria import (
    ANY,
    FAIL,
    IGNORED,
    INCONCLUSIVE,
    PASS,
    AlertDemand,
    Criterion,
    DataDemand,
    MapDemand,
    Value,
)
from ugv_acceptance.evaluation.criteria.findings import (
    Findings,
    Outcome,
    alert_words,
    short_of_data,
)
from ugv_acceptance.evaluation.criteria.measurement import (
    KnownTime,
    MapMeasure,
    ValueMeasure,
    moment_json,
)
from ugv_acceptance.evaluation.criteria.messages import (
    NO_VALUE,
    demand_words,
    missing_reasons,
    no_value_once,
    violation_words,
)
from ugv_acceptance.evaluation.criteria.not_judged import kept_words
from ugv_acceptance.evaluation.criteria.quantities import OF_TIPPING, measured_of, shown, unit_of
from ugv_acceptance.evaluation.criteria.safeguards import (
    Safeguarded,
    lost_words,
    reasons_of,
    safeguarded,
    safeguards_result,
    salvaged_words,
    waived_words,
)
from ugv_acceptance.evaluation.criteria.statement import NotChecked
from ugv_acceptance.evaluation.margin_words import percent_words, share_words
from ugv_acceptance.evaluation.permitted_limits import relaxed_words
from ugv_acceptance.type_aliases import Json


def judge_value(criterion: Criterion, findings: Findings) -> Outcome:
    """Return the outcome of a criterion on a value."""
    measure = findings.measurement.measures[criterion.name]
    assert isinstance(measure, ValueMeasure)  # noqa: S101 - by its demand
    measured = _measured(measure, findings)
    evidence = tuple(_related(measure, findings))
    short = short_of_data(measure.evaluated + measure.excused, criterion, findings)
    if not measure.samples:
        return Outcome(INCONCLUSIVE, f'{criterion.name}: {NO_VALUE}', measured)
    if not _met(measure):
        return _violated(measure, findings, short, Outcome(FAIL, '', measured, evidence))
    short = short or _only_a_bound(measure, findings)
    if short:
        return Outcome(INCONCLUSIVE, short, measured, evidence)
    if measure.demand.always and measured['inside_bound'] and _decides(criterion, findings):
        bound = measured['uncertainty']
        text = (
            f'{criterion.name}: met by {measured["distance"]:.3g} {measured["unit"]}, less '
            f'than its uncertainty of {bound["bound"]:.3g} {measured["unit"]}'
        )
        return Outcome(INCONCLUSIVE, text.replace(' ,', ',').strip(), measured, evidence)
    return Outcome(PASS, demand_words(criterion, findings.settings), measured, evidence)


def _only_a_bound(measure: ValueMeasure, findings: Findings) -> str | None:
    """Return why a tip-over margin that was kept shows nothing; None if it does.

    On ground that is not flat it is an upper bound, unless the criteria accept a rule for that.
    """
    demand, criteria = measure.demand, findings.measurement.criteria
    ground, span = findings.settings.ground, [findings.seconds(t) for t in measure.span]
    if demand.below or demand.signal not in OF_TIPPING or criteria.ground is not None:
        return None
    if not ground.rough_within(*span):
        return None
    said = findings.data.get('ground', {}).get('objections', ())
    return said[0] if said else f'{measure.criterion.name}: the ground was not flat'


def _violated(
    measure: ValueMeasure, findings: Findings, short: str | None, found: Outcome
) -> Outcome:
    """Return the outcome `found`, with its reason, of a value that was beyond its limit."""
    if measure.demand.dwell is not None and short:
        return replace(found, verdict=INCONCLUSIVE, reason=short)
    words = violation_words(measure, findings.settings, found.measured)
    if not _by_effort(measure, findings):
        return replace(found, reason=words)
    if measure.demand.of == ANY or short:
        reason = short or f'{words}; {ONE_BY_ONE}'
        return replace(found, verdict=INCONCLUSIVE, reason=reason)
    return replace(found, verdict=PASS, reason=f'{measure.criterion.name}: {BY_EFFORT}')


# Why a joint that carries the robot passes although the even spread is beyond its limit.
BY_EFFORT = 'it carries the robot, so its measured torque is judged, not the evenly spread weight'
ONE_BY_ONE = (
    'but it carries the robot and has a measured torque: demand this of each joint by itself'
)


def _by_effort(measure: ValueMeasure, findings: Findings) -> bool:
    """Return whether all joints in violation carry the robot and have a measured torque."""
    of_torque = _ALERT_OF.get(measure.demand.signal) == 'TORQUE_LIMIT'
    return (
        of_torque
        and bool(measure.violators)
        and measure.violators <= judged_by_effort(findings.data)
    )


def _decides(criterion: Criterion, findings: Findings) -> bool:
    return findings.measurement.criteria.uncertainty_of(criterion) != IGNORED


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
    """Return a value criterion's measurement for JSON, in the unit people see."""
    demand, violation = measure.demand, measure.violation
    scale, unit = shown(demand.signal, demand.of, findings.settings)
    method = findings.measurement.criteria.uncertainty_of(measure.criterion)
    worst = measure.worst[0] if measure.worst else None
    # JSON has no infinite number.
    finite = worst if worst and isfinite(worst.value) else None
    bound, first = findings.bounds.worst(measure, method), measure.first
    start, end = measure.span
    distance = demand.distance(finite.value) * scale if finite else None
    return {
        'signal': demand.signal,
        'of': demand.of,
        'unit': unit,
        'limit': demand.limit * scale,
        'must_be': 'below' if demand.below else 'above',
        'worst': finite.value * scale if finite else None,
        'worst_of': worst.subject if worst else None,
        'at_s': findings.seconds(worst.time) if worst else None,
        'distance': distance,
        'moment': moment_json(finite, findings.settings) if finite else None,
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
    """Return the alerts about the same margin as sentences: the evidence for the outcome."""
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


def judge_criteria(findings: Findings) -> Json:
    """Return the verdict of the run, its reasons and every criterion's outcome, for JSON."""
    criteria = findings.measurement.criteria
    outcomes = [(c, _outcome(c, findings)) for c in criteria.criteria]
    held = safeguarded(
        criteria,
        findings.settings,
        findings.alerts,
        findings.data,
        findings.statements,
        findings.measurement.start,
    )
    word, reasons = _overall(outcomes, held, findings)
    waived = waived_words(criteria)
    return {
        'verdict': word,
        'reasons': [*([waived] if waived else []), *reasons],
        'criteria': {
            'name': criteria.name,
            'version': criteria.version,
            'path': criteria.path,
            'sha256': criteria.sha256,
            'uncertainty': criteria.uncertainty,
            'coverage': criteria.coverage,
            'results': [_json(c, outcome, findings) for c, outcome in outcomes],
        },
        'safeguards': safeguards_result(held, criteria, findings.settings),
        'not_checked': [not_checked_json(one) for one in _not_checked(findings)],
    }


def _overall(
    outcomes: Sequence[tuple[Criterion, Outcome]], held: Safeguarded, findings: Findings
) -> tuple[str, list[str]]:
    for word in (FAIL, INCONCLUSIVE):
        of = [(c.demand, o.reason) for c, o in outcomes if o.verdict == word]
        values = [demand for demand, _ in of if isinstance(demand, Value)]
        reasons = [*no_value_once([reason for _, reason in of]), *reasons_of(held, word, values)]
        if reasons and word == INCONCLUSIVE:
            # First what is wrong, then what could not be judged for it.
            causes = missing_reasons(findings.alerts, findings.settings)
            stated = [o.reason for s in findings.statements for o in s.objections]
            reasons = [*(r for r in stated if r in reasons), *causes, *reasons]
        if reasons:
            return word, list(dict.fromkeys(reasons))
    share = findings.data['coverage']['fraction']
    text = 'all criteria met'
    if findings.measurement.criteria.path is None:
        text = kept_words(findings.settings)
    wider = relaxed_words(findings.settings)
    return PASS, [
        f'{text}, {share_words(share, 1)} of the recording evaluated',
        *([wider] if wider else []),
    ]


def _not_checked(findings: Findings) -> Iterable[NotChecked]:
    for statement in findings.statements:
        yield from statement.not_checked


def not_checked_json(one: NotChecked) -> Json:
    """Return what was not checked, and why, for JSON."""
    return {'what': one.what, 'why': one.why, 'seconds': one.seconds}


def _json(criterion: Criterion, outcome: Outcome, findings: Findings) -> Json:
    return {
        'name': criterion.name,
        'requirement': criterion.requirement,
        'reference': criterion.reference,
        'kind': KINDS[type(criterion.demand)],
        'window_s': None if criterion.window is None else list(criterion.window),
        'demand': demand_words(criterion, findings.settings),
        'verdict': outcome.verdict,
        'reason': outcome.reason,
        'measured': outcome.measured,
        'evidence': list(outcome.evidence),
    }


def _outcome(criterion: Criterion, findings: Findings) -> Outcome:
    judge = JUDGES[type(criterion.demand)]
    return judge(criterion, findings)


def _judge_alert(criterion: Criterion, findings: Findings) -> Outcome:
    demand, measure = criterion.demand, findings.measurement.measures[criterion.name]
    assert isinstance(demand, AlertDemand)  # noqa: S101 - by its kind
    assert isinstance(measure, KnownTime)  # noqa: S101 - the same
    start, end = measure.span
    matching = [a for a in findings.alerts if _matches(a, demand) and not findings.in_doubt(a)]
    if demand.raised:
        found = [a for a in matching if start <= a.start <= end]
    else:
        found = [a for a in matching if a.start <= end and (a.end is None or a.end > start)]
    evidence = tuple(alert_words(a, findings) for a in found)
    measured: Json = {'alerts': len(found), 'evaluated_s': measure.evaluated / 1e9}
    short = short_of_data(measure.evaluated, criterion, findings)
    if found and not demand.raised:
        return Outcome(FAIL, f'{criterion.name}: {evidence[0]}', measured, evidence)
    if found:
        return Outcome(PASS, evidence[0], measured, evidence)
    if short:
        return Outcome(INCONCLUSIVE, short, measured)
    if demand.raised:
        text = (
            f'{criterion.name}: no such alert was raised; required: '
            f'{demand_words(criterion, findings.settings)}'
        )
        return Outcome(FAIL, text, measured)
    return Outcome(PASS, demand_words(criterion, findings.settings), measured)


def _matches(alert: Alert, demand: AlertDemand) -> bool:
    rule = alert.rule
    asked = (
        (demand.code, rule.code),
        (demand.of, rule.subject),
        (demand.level, LEVELS[rule.level]),
    )
    return all(wanted in (None, found) for wanted, found in asked)


def _judge_data(criterion: Criterion, findings: Findings) -> Outcome:
    demand = criterion.demand
    assert isinstance(demand, DataDemand)  # noqa: S101 - by its demand
    found = measured_of(demand.quantity, demand.of, findings.data)
    measured: Json = {
        'quantity': demand.quantity,
        'unit': unit_of(demand.quantity),
        'least': demand.least if isfinite(demand.least) else None,
        'most': demand.most if isfinite(demand.most) else None,
        'values': found,
    }
    unmet = {k: x for k, x in found.items() if x is None or not demand.least <= x <= demand.most}
    if not unmet:
        return Outcome(PASS, demand_words(criterion, findings.settings), measured)
    text = _unmet_words(criterion, demand, unmet, findings)
    return Outcome(FAIL if demand.fails else INCONCLUSIVE, text, measured)


def _unmet_words(
    criterion: Criterion, demand: DataDemand, unmet: dict[str, float | None], findings: Findings
) -> str:
    data = findings.data
    if demand.quantity == 'coverage':
        return (
            f'only {share_words(data["coverage"]["fraction"], 1)} of the recording could be '
            f'evaluated ({percent_words(demand.least)} needed)'
        )
    if demand.quantity == 'salvaged':
        return salvaged_words(data)
    if demand.quantity == 'lost_messages':
        return lost_words(data)
    unit = unit_of(demand.quantity)
    texts = {k: 'unknown' if x is None else f'{x:.4g} {unit}'.strip() for k, x in unmet.items()}
    numbers = ', '.join(f'{k} {text}'.removeprefix('run ') for k, text in texts.items())
    return f'{criterion.name}: {numbers}; {demand_words(criterion, findings.settings)}'


def _judge_map(criterion: Criterion, findings: Findings) -> Outcome:
    demand, measure = criterion.demand, findings.measurement.measures[criterion.name]
    assert isinstance(demand, MapDemand)  # noqa: S101 - by its kind
    assert isinstance(measure, MapMeasure)  # noqa: S101 - the same
    cells, visited = measure.visited.size, int(measure.visited.sum())
    measured: Json = {'cells': cells, 'visited': visited, 'share': visited / cells}
    if visited / cells >= demand.least:
        return Outcome(PASS, demand_words(criterion, findings.settings), measured)
    text = (
        f'{criterion.name}: the run visited {visited} of {cells} cells '
        f'({share_words(visited / cells, 1)}); {percent_words(demand.least)} needed'
    )
    return Outcome(INCONCLUSIVE, text, measured)


KINDS = {Value: 'value', AlertDemand: 'alert', DataDemand: 'data', MapDemand: 'map'}
JUDGES: dict[type, Callable[[Criterion, Findings], Outcome]] = {
    Value: judge_value,
    AlertDemand: _judge_alert,
    DataDemand: _judge_data,
    MapDemand: _judge_map,
}
