"""The uncertainty of the values that decide: from which numbers it comes, how much is left."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.criteria import IGNORED, RSS, Value
from ugv_acceptance.evaluation.examination import Examination, Moment, ValueMeasure
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.evaluation.signals import shown
from ugv_acceptance.evaluation.uncertainty import Effects, Source, combined, effects_of
from ugv_acceptance.model.stability import SIDES

Floats = NDArray[np.float64]

# Sources named beside a bound.
NAMED = 5


@dataclass(slots=True)
class Bounds:
    """Bounds of moments; the effects of the sources on one moment are computed once."""

    settings: Settings
    sources: tuple[Source, ...]
    _known: dict[tuple[Any, ...], Effects] = field(default_factory=dict)

    def worst(self, measure: ValueMeasure, method: str) -> dict[str, Any] | None:
        """Return the bound at the moment that has least left beyond it; None: no bound is known.

        `excess` is what is left to the limit less the bound; unit as people see it.
        """
        demand = measure.demand
        ones = [self._one(demand, moment, method) for moment in measure.worst]
        found = [one for one in ones if one is not None]
        return min(found, key=lambda one: float(one['excess'])) if found else None

    def _one(self, demand: Value, moment: Moment, method: str) -> dict[str, Any] | None:
        effects = self.of(demand.signal, moment)
        if effects is None or not np.isfinite(effects).all():
            return None
        used = RSS if method == IGNORED else method
        scale, unit = shown(demand.signal, moment.subject, self.settings)
        bound = float(combined(effects, used)) * scale
        return {
            'bound': bound,
            'unit': unit,
            'method': used,
            'excess': demand.distance(moment.value) * scale - bound,
            'largest': self.largest(effects, scale),
        }

    def of(self, signal: str, moment: Moment) -> Floats | None:
        """Return the effects (s,) of the sources on a signal at a moment; None: not known."""
        if not self.sources or signal not in _OF:
            return None
        key = (moment.q, moment.gravity, moment.payload)
        if key not in self._known:
            self._known[key] = effects_of(self.settings, self.sources, *key)
        return _OF[signal](self._known[key], moment, self.settings)

    def largest(self, effects: Floats, scale: float) -> list[dict[str, Any]]:
        """Return the sources that count most, with what each does."""
        order = np.argsort(-np.abs(effects), kind='stable')[:NAMED]
        return [
            {'name': self.sources[k].name, 'effect': float(effects[k]) * scale}
            for k in order.tolist()
            if effects[k] != 0.0
        ]


def _joint(moment: Moment, settings: Settings) -> int:
    return settings.robot.joint_names.index(moment.subject)


def _margin(effects: Effects, moment: Moment, settings: Settings) -> Floats:
    j = _joint(moment, settings)
    found: Floats = effects.torque[:, j] + effects.limit[:, j]
    return found


def _utilisation(effects: Effects, moment: Moment, settings: Settings) -> Floats:
    j = _joint(moment, settings)
    found: Floats = effects.torque[:, j] + moment.value * effects.limit[:, j]
    return found / settings.limits.torque[j]


def _position(effects: Effects, moment: Moment, settings: Settings) -> Floats:
    column: Floats = effects.position[:, _joint(moment, settings)]
    return column


def _torque(effects: Effects, moment: Moment, settings: Settings) -> Floats:
    column: Floats = effects.torque[:, _joint(moment, settings)]
    return column


def _angle(effects: Effects, moment: Moment, _: Settings) -> Floats:
    column: Floats = effects.angle[:, SIDES.index(moment.subject)]
    return column


def _tilt(effects: Effects, _: Moment, __: Settings) -> Floats:
    return effects.tilt


# Sources are distinct, so a source of torque never is one of the limit: signs do not matter.
_OF: dict[str, Callable[[Effects, Moment, Settings], Floats]] = {
    'torque': _torque,
    'torque_margin': _margin,
    'torque_utilisation': _utilisation,
    'position': _position,
    'tip_angle': _angle,
    'tilt': _tilt,
}


def moment_json(moment: Moment, settings: Settings) -> dict[str, Any]:
    """Return posture, attitude and payload of a moment for JSON; degrees, metres, kg."""
    gx, gy, gz = moment.gravity
    joints = {}
    for name, q in zip(settings.robot.joint_names, moment.q, strict=True):
        scale, unit = shown('position', name, settings)
        joints[name] = {'position': q * scale, 'unit': unit}
    return {
        'joints': joints,
        'roll_deg': math.degrees(math.atan2(-gy, -gz)),
        'pitch_deg': math.degrees(math.atan2(gx, math.hypot(gy, gz))),
        'payload_kg': moment.payload.mass,
    }


def margin_bounds(result: dict[str, Any], limits: Examination, bounds: Bounds) -> None:
    """Add to every joint's and to the tip-over margin of a result the bound at its worst moment."""
    for measure in limits.measures.values():
        if not isinstance(measure, ValueMeasure):
            continue
        bound = bounds.worst(measure, RSS)
        if measure.demand.signal == 'tip_angle':
            result['stability']['uncertainty'] = bound
        else:
            joint = result['torque'][measure.demand.of]
            joint['uncertainty'] = bound and _scaled(bound, joint['limit'], joint['unit'])


def _scaled(bound: dict[str, Any], by: float, unit: str) -> dict[str, Any]:
    """Return the bound of a utilisation as one of a torque."""
    return {
        **bound,
        'bound': bound['bound'] * by,
        'excess': bound['excess'] * by,
        'unit': unit,
        'largest': [{**one, 'effect': one['effect'] * by} for one in bound['largest']],
    }
