"""What a verdict takes for granted: the ground, the load, and the demands of the criteria."""

import math
from collections.abc import Iterator, Sequence

from ugv_acceptance.evaluation.criteria.criteria import (
    ANY,
    LONGEST_UNSEEN,
    CriteriaSet,
    Criterion,
    Value,
)
from ugv_acceptance.evaluation.criteria.measurement import CriteriaMeasurement
from ugv_acceptance.evaluation.criteria.not_judged import left_open, not_judged
from ugv_acceptance.evaluation.criteria.statement import NotChecked, Statement
from ugv_acceptance.evaluation.criteria.uncertainty import Source
from ugv_acceptance.evaluation.ground import FLAT
from ugv_acceptance.evaluation.margin_words import percent_words
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload

FirstPayload = tuple[int, Payload] | None
# A tip angle (rad) at or below which a demand allows a robot that has tipped over.
TIPPED = 0.0


def assumptions(
    settings: Settings,
    sources: Sequence[Source],
    measurement: CriteriaMeasurement,
    first_payload: FirstPayload,
) -> Statement:
    """Return what a verdict by these criteria takes for granted, as things that were not checked.

    `first_payload` is the first payload that was declared, and when (ns).
    """
    found = [
        *_ground(settings),
        *(NotChecked('contact points', words) for words in settings.moved_contacts),
        *_load(settings, first_payload),
        *not_judged(settings),
        *_demands(measurement),
    ]
    if not sources:
        why = 'the configuration states no uncertainty (+/-) of its numbers'
        found.append(NotChecked('margins without a bound', why))
    open_ = left_open(settings)
    return Statement(objections=open_.objections, not_checked=(*open_.not_checked, *found))


def _ground(settings: Settings) -> Iterator[NotChecked]:
    """Yield what is assumed of the ground where it is taken as flat."""
    ground = settings.ground
    if ground.rough and FLAT not in [window.kind for window in ground.windows]:
        return
    asked = '' if ground.kind else 'nobody entered its kind: '
    why = f'{asked}it is taken as flat, firm, and reaching under every contact point'
    yield NotChecked('ground', f'{why} at other times' if ground.ever_rough else why)


def _load(settings: Settings, first: FirstPayload) -> Iterator[NotChecked]:
    if first is None and not settings.payload_known:
        mass = settings.robot.payload.mass
        yield NotChecked('load', f'none was told during the run; {mass:g} kg is taken for it')


def unknown_load(
    settings: Settings, first: FirstPayload, measurement: CriteriaMeasurement
) -> tuple[int, int] | None:
    """Return the short span (ns) before a payload was first told, in which the load is not known.

    None if it was known, or if the span is so long that both loads have to be judged.
    """
    if first is None or settings.payload_known or first[1] == settings.robot.payload:
        return None
    start, told = measurement.start, first[0]
    return (start, told) if told - start <= LONGEST_UNSEEN * 1e9 else None


def _demands(measurement: CriteriaMeasurement) -> Iterator[NotChecked]:
    """Yield what a file of criteria demands in words only: criteria that cannot fail."""
    criteria, settings = measurement.criteria, measurement.settings
    if criteria.path is None:
        return
    length = (measurement.end - measurement.start) / 1e9
    for criterion in criteria.criteria:
        why = _vacuous(criterion, criteria, length)
        if why:
            yield NotChecked(f'criterion {criterion.name}', why)
    values = [c.demand for c in criteria.criteria if isinstance(c.demand, Value)]
    sides = {v.of for v in values if v.signal == 'tip_angle'}
    if not sides and settings.judges_tilt:
        yield NotChecked('tilt left', 'no criterion demands any')
    elif ANY not in sides and len(sides) < 4:
        yield NotChecked('tilt left', f'criteria demand them only to the {_of(sides)}')
    of_torque = [v for v in values if v.signal.startswith('torque')]
    if settings.hears_joints and not of_torque:
        yield NotChecked('margin of torques', 'no criterion demands any')


def _of(names: set[str]) -> str:
    return ' and '.join(sorted(names))


def _vacuous(criterion: Criterion, criteria: CriteriaSet, length: float) -> str:
    """Return why a criterion cannot fail in a recording of this length (s); '' if it can."""
    demand, window = criterion.demand, criterion.window
    if window is not None and window[0] >= length:
        return f'its window begins at {window[0]:g} s, after the end of the recording'
    if window is not None and not criteria.coverage:
        return 'with coverage 0 it passes where nothing was seen'
    return _permissive(demand, length) if isinstance(demand, Value) else ''


def _permissive(demand: Value, length: float) -> str:
    """Return what a demand on a value permits that no robot should do; '' if nothing."""
    allowances = (demand.time_in_violation, demand.longest_violation)
    if demand.share_in_violation == 1.0 or any(x is not None and x >= length for x in allowances):
        return 'it cannot fail: it may be violated all the time'
    if demand.signal == 'tip_angle' and not demand.below and demand.limit <= TIPPED:
        return f'it allows {-math.degrees(demand.limit):g} deg past tipping'
    if demand.signal == 'torque_utilisation' and demand.below and demand.limit > 1.0:
        return f'it allows {percent_words(demand.limit)} of the torque limit'
    return ''
