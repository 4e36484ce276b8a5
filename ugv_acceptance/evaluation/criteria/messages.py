"""The sentences of criteria: what each demands, how it was violated, why margins are missing."""

import math
from collections.abc import Sequence
from typing import Any

from ugv_acceptance.evaluation.alerts.messages import describe, level_words
from ugv_acceptance.evaluation.alerts.rules import FAILURES
from ugv_acceptance.evaluation.alerts.state_machine import LEVELS, Alert
from ugv_acceptance.evaluation.criteria.criteria import (
    ANY,
    AlertDemand,
    Criterion,
    DataDemand,
    MapDemand,
    Value,
)
from ugv_acceptance.evaluation.criteria.measurement import ValueMeasure
from ugv_acceptance.evaluation.criteria.quantities import DATA, SIGNALS, shown
from ugv_acceptance.evaluation.margin_words import (
    number_beside,
    percent_words,
    tipping_words,
    value_beside,
)
from ugv_acceptance.evaluation.settings import Settings


def demand_words(criterion: Criterion, settings: Settings) -> str:
    """Return in words what a criterion demands, with its time window."""
    demand = criterion.demand
    if isinstance(demand, Value):
        text = _value_words(demand, settings)
    elif isinstance(demand, AlertDemand):
        text = _alert_words(demand)
    elif isinstance(demand, DataDemand):
        text = _data_words(demand)
    else:
        text = _map_words(demand)
    if criterion.window is not None:
        text += f', from {criterion.window[0]:g} to {criterion.window[1]:g} s'
    return text


def _value_words(demand: Value, settings: Settings) -> str:
    side = 'below' if demand.below else 'above'
    of = '' if demand.of in (ANY, 'robot') else f' of {demand.of}'
    text = f'{SIGNALS[demand.signal].words}{of} {side} {number(demand.limit, demand, settings)}'
    if demand.dwell is not None:
        return f'{text} for {demand.dwell:g} s without a break'
    allowed = []
    if demand.time_in_violation is not None:
        allowed.append(f'{demand.time_in_violation:g} s in total')
    if demand.longest_violation is not None:
        allowed.append(f'{demand.longest_violation:g} s at a time')
    if demand.share_in_violation is not None:
        allowed.append(f'{percent_words(demand.share_in_violation)} of the time')
    return (
        f'{text} except for at most {" and ".join(allowed)}' if allowed else f'{text} at all times'
    )


def number(value: float, demand: Value, settings: Settings) -> str:
    """Return a signal's value (SI) as text with the unit for people."""
    if demand.signal == 'torque_utilisation':
        return percent_words(value)
    scale, unit = shown(demand.signal, demand.of, settings)
    return f'{value * scale:.3g} {unit}'.strip()


def _alert_words(demand: AlertDemand) -> str:
    level = level_words(demand.level) if demand.level else None
    what = ' '.join(x for x in (level, demand.code) if x) or 'any'
    of = f' of {demand.of}' if demand.of else ''
    count = 'at least one' if demand.raised else 'no'
    return f'{count} {what} alert{of}'.replace(' any', '', 1)


def _data_words(demand: DataDemand) -> str:
    quantity = DATA[demand.quantity]
    bounds = [
        f'{word} {percent_words(bound)}' if quantity.share else f'{word} {bound:g}'
        for word, bound in (('at least', demand.least), ('at most', demand.most))
        if math.isfinite(bound)
    ]
    of = f' of {demand.of}' if demand.of else ''
    return f'{quantity.words}{of}: {" and ".join(bounds)} {quantity.unit}'.strip()


def _map_words(demand: MapDemand) -> str:
    least, joints = percent_words(demand.least), ' and '.join(demand.joints)
    return f'at least {least} of the map of {joints} visited'


def violation_words(measure: ValueMeasure, settings: Settings, measured: dict[str, Any]) -> str:
    """Return the sentence that says how a value violated its demand: worst value, time, limit."""
    demand, worst = measure.demand, measure.worst[0]
    if demand.dwell is not None:
        kept = measured['longest_kept_s']
        needed = _value_words(demand, settings)
        return f'{measure.criterion.name}: held for {kept:.2f} s; required: {needed}'
    must = f'must stay {measured["must_be"]} {number(demand.limit, demand, settings)}'
    spent = f'{measured["time_in_violation_s"]:.2f} s in violation'
    at = f'at {measured["at_s"]:.2f} s'
    finite = math.isfinite(worst.value)
    if finite and demand.signal == 'torque_utilisation':
        limit = settings.limits.torque[settings.robot.joint_names.index(worst.subject)]
        _, unit = shown('torque', worst.subject, settings)
        share = number_beside(100.0 * worst.value, 100.0 * demand.limit, 0)
        need = number_beside(worst.value * limit, limit)
        return (
            f'{worst.subject} {share} % of its limit {at}: it needs {need} of {limit:.1f} {unit}; '
            f'{must} ({spent})'
        )
    if finite and demand.signal == 'tip_angle':
        return f'{tipping_words(worst.subject, worst.value)} {at}; {must} ({spent})'
    subject = '' if worst.subject == 'robot' else f' of {worst.subject}'
    words, (scale, unit) = SIGNALS[demand.signal].words, shown(demand.signal, demand.of, settings)
    value = f'{value_beside(worst.value * scale, demand.limit * scale)} {unit}'
    return f'{words}{subject} was {value if finite else "infinite"} {at}; {must} ({spent})'


# Why a criterion on a value is not judged where there is none.
NO_VALUE = 'no value could be computed'


def no_value_once(reasons: Sequence[str]) -> list[str]:
    """Return reasons in which criteria without any value share one sentence, at its first place."""
    end = f': {NO_VALUE}'
    without = [reason.removesuffix(end) for reason in reasons if reason.endswith(end)]
    if len(without) < 2:
        return list(reasons)
    shared = f'{NO_VALUE} for {", ".join(without)}'
    return list(dict.fromkeys(shared if reason.endswith(end) else reason for reason in reasons))


def missing_reasons(alerts: Sequence[Alert], settings: Settings) -> list[str]:
    """Return why margins were missing: one sentence for each kind of input fault."""
    kinds = {(a.rule.code, a.rule.subject): a for a in alerts if a.rule.code not in FAILURES}
    return [describe(a, settings) for a in kinds.values() if LEVELS[a.rule.level] != 'WARN']
