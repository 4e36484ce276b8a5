"""From measures to verdicts: each criterion PASS, FAIL or INCONCLUSIVE, with its evidence.

A violation is a FAIL however little was evaluated; a PASS needs the data, and a margin beyond the
bound of its uncertainty.
"""

from collections.abc import Callable, Sequence
from math import isfinite

from ugv_acceptance.evaluation.alerts import LEVELS, Alert
from ugv_acceptance.evaluation.criteria import (
    FAIL,
    INCONCLUSIVE,
    PASS,
    AlertDemand,
    Criterion,
    DataDemand,
    MapDemand,
    Value,
)
from ugv_acceptance.evaluation.data_quality import measured_of, unit_of
from ugv_acceptance.evaluation.examination import KnownTime, MapMeasure
from ugv_acceptance.evaluation.outcomes import Findings, Json, Outcome, alert_words, short_of_data
from ugv_acceptance.evaluation.permitted import relaxed_words
from ugv_acceptance.evaluation.statements import demand_words, missing_reasons
from ugv_acceptance.evaluation.value_outcome import judge_value


def judge_criteria(findings: Findings) -> Json:
    """Return verdict, reasons and every criterion's outcome, ready for JSON."""
    criteria = findings.examination.criteria
    outcomes = [(c, _outcome(c, findings)) for c in criteria.criteria]
    word, reasons = _overall([outcome for _, outcome in outcomes], findings)
    return {
        'verdict': word,
        'reasons': reasons,
        'criteria': {
            'name': criteria.name,
            'version': criteria.version,
            'path': criteria.path,
            'sha256': criteria.sha256,
            'uncertainty': criteria.uncertainty,
            'coverage': criteria.coverage,
            'results': [_json(c, outcome, findings) for c, outcome in outcomes],
        },
    }


def _overall(outcomes: Sequence[Outcome], findings: Findings) -> tuple[str, list[str]]:
    for word in (FAIL, INCONCLUSIVE):
        reasons = list(dict.fromkeys(o.reason for o in outcomes if o.verdict == word))
        if reasons and word == INCONCLUSIVE:
            reasons += missing_reasons(findings.alerts, findings.settings)
        if reasons:
            return word, reasons
    share = findings.data['coverage']['fraction']
    text = 'all margins kept' if findings.examination.criteria.path is None else 'all criteria met'
    wider = relaxed_words(findings.settings)
    return PASS, [f'{text}, {share:.1%} of the recording evaluated', *([wider] if wider else [])]


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
    demand, measure = criterion.demand, findings.examination.measures[criterion.name]
    assert isinstance(demand, AlertDemand)  # noqa: S101 - by its kind
    assert isinstance(measure, KnownTime)  # noqa: S101 - the same
    start, end = measure.span
    matching = [a for a in findings.alerts if _matches(a, demand)]
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
            f'{criterion.name}: {demand_words(criterion, findings.settings)}, but it did not come'
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
            f'only {data["coverage"]["fraction"]:.1%} of the recording could be evaluated '
            f'({demand.least:.0%} needed)'
        )
    if demand.quantity == 'salvaged':
        return f'the recording breaks off: {data["bag"]["salvaged"]}'
    if demand.quantity == 'lost_messages':
        return f'{data["bag"]["lost_messages"]} messages that metadata.yaml tells of are missing'
    unit = unit_of(demand.quantity)
    texts = {k: 'unknown' if x is None else f'{x:.4g} {unit}'.strip() for k, x in unmet.items()}
    numbers = ', '.join(f'{k} {text}'.removeprefix('run ') for k, text in texts.items())
    return f'{criterion.name}: {numbers}; {demand_words(criterion, findings.settings)}'


def _judge_map(criterion: Criterion, findings: Findings) -> Outcome:
    demand, measure = criterion.demand, findings.examination.measures[criterion.name]
    assert isinstance(demand, MapDemand)  # noqa: S101 - by its kind
    assert isinstance(measure, MapMeasure)  # noqa: S101 - the same
    cells, visited = measure.visited.size, int(measure.visited.sum())
    measured: Json = {'cells': cells, 'visited': visited, 'share': visited / cells}
    if visited / cells >= demand.least:
        return Outcome(PASS, demand_words(criterion, findings.settings), measured)
    text = (
        f'{criterion.name}: the run visited {visited} of {cells} cells ({visited / cells:.1%}); '
        f'{demand.least:.0%} needed'
    )
    return Outcome(INCONCLUSIVE, text, measured)


KINDS = {Value: 'value', AlertDemand: 'alert', DataDemand: 'data', MapDemand: 'map'}
JUDGES: dict[type, Callable[[Criterion, Findings], Outcome]] = {
    Value: judge_value,
    AlertDemand: _judge_alert,
    DataDemand: _judge_data,
    MapDemand: _judge_map,
}
