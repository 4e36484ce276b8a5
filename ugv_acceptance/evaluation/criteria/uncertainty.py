"""Uncertainty of worst margins, from the stated +/- of the numbers they are computed from.

First order: each number is changed by its +/- to both sides while the support polygon stays the
same, but not its rocking; half the difference of the margins is that number's effect. Effects are
combined as a root sum of squares (independent numbers) or as a sum (worst case).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ugv_acceptance.evaluation.criteria.criteria import IGNORED, RSS, WORST_CASE, Value
from ugv_acceptance.evaluation.criteria.measurement import CriteriaMeasurement, Moment, ValueMeasure
from ugv_acceptance.evaluation.criteria.quantities import shown
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.edges import corners_of, edges_of
from ugv_acceptance.model.mechanics import Posture, mechanics_of, posture_at, posture_once
from ugv_acceptance.model.reactions import standing_torque
from ugv_acceptance.model.robot import Contact, Joint, Link, Payload, Robot, Vector
from ugv_acceptance.model.stability import SIDES, stances_of, standing, tip_angles_of
from ugv_acceptance.model.statics import torque_of
from ugv_acceptance.model.support import footings_of
from ugv_acceptance.model.tree import Tree
from ugv_acceptance.type_aliases import Floats

Gravity = tuple[float, float, float]
# Subjects of a source besides links and joints: all contact points, the payload, the IMU.
CONTACTS, PAYLOAD, IMU = 'contacts', 'payload', 'imu'
# Heights of contacts are those of each alone: together they lower the robot and rock nothing.
HEIGHT = 2
# Kinds of numbers that change which points carry: to both sides they may lower a margin.
FOOTING = frozenset({'place', 'offset'})


@dataclass(frozen=True, slots=True)
class Source:
    """A source of uncertainty: +/- `value` (SI) on the number `what` of `subject`.

    `name` is its name in the configuration. `what` is mass, cog, place (of a joint or contacts),
    offset, limit, roll or pitch (of the IMU); `axis` is 0, 1 or 2 if it is a vector. `only` is the
    contact it is about; '': all together.
    """

    name: str
    subject: str
    what: str
    value: float
    axis: int = 0
    only: str = ''


@dataclass(frozen=True, slots=True)
class Effects:
    """The effect of each of s sources on the margins of one row.

    `torque` (s, j) N m (N), `angle` (s, 4) rad to SIDES (NaN on a side without an edge), `position`
    (s, j) rad or m, `tilt` (s,) rad, `limit` (s, j) N m (N).
    """

    sources: tuple[Source, ...]
    torque: Floats
    angle: Floats
    position: Floats
    limit: Floats
    tilt: Floats


@dataclass(frozen=True, slots=True)
class _Point:
    """The numbers from which a row's margins are computed: robot, posture, gravity, payload.

    `tree` is that of the robot; None where its bodies are not those that it has.
    """

    robot: Robot
    q: tuple[float, ...]
    gravity: Gravity
    payload: Payload
    tree: Tree | None = None


def effects_of(
    settings: Settings,
    sources: Sequence[Source],
    q: tuple[float, ...],
    gravity: Gravity,
    payload: Payload,
) -> Effects:
    """Return the effect of each source on the margins of one row: `q` (j), `gravity` (3) m/s2."""
    robot = settings.robot
    point = _Point(robot, q, gravity, payload, mechanics_of(robot).tree)
    margins = _margins_near(point)
    nominal = margins(point)
    n, count = len(q), len(sources)
    table = np.zeros((count, n + len(SIDES)))
    position, limit, tilt = np.zeros((count, n)), np.zeros((count, n)), np.zeros(count)
    for k, source in enumerate(sources):
        if source.what == 'limit':
            limit[k, robot.joint_names.index(source.subject)] = source.value
            continue
        some = [_effect(margins, point, nominal, one) for one in _alone(point, source)]
        table[k] = some[0] if len(some) == 1 else combined(np.array(some), RSS)
        if source.what == 'offset':
            position[k, robot.joint_names.index(source.subject)] = source.value
        tilt[k] = source.value if source.subject == IMU else 0.0
    return Effects(tuple(sources), table[:, :n], table[:, n:], position, limit, tilt)


def _alone(point: _Point, source: Source) -> list[Source]:
    """Return what varies on its own: each contact's height, else the source itself."""
    if source.subject != CONTACTS or source.axis != HEIGHT:
        return [source]
    return [replace(source, only=contact.name) for contact in point.robot.contacts]


def _effect(
    margins: Callable[[_Point], Floats], point: _Point, nominal: Floats, source: Source
) -> Floats:
    """Return half the difference that +/- of a source makes, or the fall where both lower it.

    `nominal` are the margins at the point.
    """
    high, low = (margins(_moved(point, source, s * source.value)) for s in (1.0, -1.0))
    with np.errstate(invalid='ignore'):
        half = 0.5 * (high - low)
        if source.what not in FOOTING:
            return half
        both = np.minimum(nominal - high, nominal - low) > 0.0
        found: Floats = np.where(both, nominal - np.minimum(high, low), half)
    return found


def torque_effects(
    robot: Robot, sources: Sequence[Source], q: Floats, gravity: Floats, payload: Payload
) -> Floats:
    """Return the effect (s, P, j) of each source on the static torques in P postures (P, j).

    `gravity` (P, 3) m/s2; N m (N). Sources of limits and contacts have none.
    """
    columns: Any = tuple(gravity.T)
    point: Any = _Point(robot, tuple(q.T), columns, payload, mechanics_of(robot).tree)
    nominal = _torques(point, len(q))
    found = np.zeros((len(sources), *nominal.shape))
    for k, source in enumerate(sources):
        if source.what != 'limit' and source.subject != CONTACTS:
            found[k] = _torques(_moved(point, source, source.value), len(q)) - nominal
    return found


def _torques(point: _Point, count: int) -> Floats:
    columns = torque_of(_posture(point), point.gravity)
    table = [np.broadcast_to(column, count) for column in columns]
    return np.array(table, dtype=np.float64).reshape(len(columns), count).T


def combined(effects: Floats, method: str) -> Floats:
    """Return the combined bound (...) of effects (s, ...): root sum of squares, or sum."""
    size = np.abs(effects)
    bound: Floats = size.sum(axis=0) if method == WORST_CASE else np.sqrt((size**2).sum(axis=0))
    return bound


def _margins_near(point: _Point) -> Callable[[_Point], Floats]:
    """Return a function of torques and tip angles (j + 4,) near a point, on its footing."""
    mechanics = mechanics_of(point.robot)
    nominal: Any = _posture(point)
    stance = standing(stances_of(mechanics, nominal), point.gravity)
    footing = stance.footing
    none = [math.nan] * len(SIDES)
    if footing is None:
        return lambda at: np.array([*torque_of(_posture(at), at.gravity), *none], np.float64)
    # The compiled margins have the base's corners as constants; these here are free to move.
    corners = corners_of(mechanics, footing.polygon, free=True)
    edges = edges_of(mechanics, corners, stance.sides, rocks=True)

    def margins(at: _Point) -> Floats:
        posture: Any = nominal
        if at.robot is not point.robot:
            posture = _posture(at)
        elif at.q is not point.q or at.payload is not point.payload:
            posture = posture_at(mechanics, at.q, at.payload.mass, at.payload.cog)
        hanging = torque_of(posture, at.gravity)
        torque = standing_torque(mechanics, posture, footing.points, at.gravity, hanging)
        terms = [*posture.cog, *(x for k in footing.polygon for x in posture.contacts[k])]
        near = footings_of(mechanics, posture.contacts, moved=True)
        rocking = [f.rocking for f in near if f.polygon == footing.polygon] or [footing.rocking]
        moved = stance._replace(
            footing=replace(footing, rocking=rocking[0]),
            terms=tuple(map(float, terms)),
            mass=posture.mass,
            edges=edges,
        )
        angle, _ = tip_angles_of(moved, at.gravity)
        return np.array([*torque, *angle], dtype=np.float64)

    return margins


def _posture(point: _Point) -> Posture:
    load = point.payload
    return posture_once(point.robot, point.q, load.mass, load.cog, point.tree)


def _moved(point: _Point, source: Source, by: float) -> _Point:
    if source.subject == IMU:
        return replace(point, gravity=_turned(point.gravity, source.what, by))
    if source.subject == PAYLOAD:
        return replace(point, payload=_other_payload(point.payload, source, by))
    if source.what == 'offset':
        j = point.robot.joint_names.index(source.subject)
        q = (*point.q[:j], point.q[j] + by, *point.q[j + 1 :])
        return replace(point, q=q)
    other = _other_robot(point.robot, source, by)
    return replace(point, robot=other, tree=point.tree if source.subject == CONTACTS else None)


def _other_payload(payload: Payload, source: Source, by: float) -> Payload:
    if source.what == 'mass':
        return replace(payload, mass=payload.mass + by)
    return replace(payload, cog=_added(payload.cog, source.axis, by))


def _other_robot(robot: Robot, source: Source, by: float) -> Robot:
    if source.subject == CONTACTS:
        contacts = [_contact(c, source, by) for c in robot.contacts]
        return replace(robot, contacts=tuple(contacts))
    if source.what == 'place':
        moved = [_joint(j, source, by) for j in robot.joints]
        return replace(robot, joints=tuple(moved))
    return replace(robot, links=tuple([_link(x, source, by) for x in robot.links]))


def _link(link: Link, source: Source, by: float) -> Link:
    if link.name != source.subject:
        return link
    if source.what == 'mass':
        return replace(link, mass=link.mass + by)
    return replace(link, cog=_added(link.cog, source.axis, by))


def _joint(joint: Joint, source: Source, by: float) -> Joint:
    if joint.name != source.subject:
        return joint
    return replace(joint, xyz=_added(joint.xyz, source.axis, by))


def _contact(contact: Contact, source: Source, by: float) -> Contact:
    if source.only not in {'', contact.name}:
        return contact
    return replace(contact, position=_added(contact.position, source.axis, by))


def _added(v: Vector, axis: int, by: float) -> Vector:
    parts = [x + (by if k == axis else 0.0) for k, x in enumerate(v)]
    return (parts[0], parts[1], parts[2])


def _turned(g: Gravity, what: str, by: float) -> Gravity:
    """Return gravity as measured by an IMU whose mounting is off by a roll or pitch angle (rad)."""
    x, y, z = g
    s, c = math.sin(by), math.cos(by)
    if what == 'roll':
        return (x, c * y - s * z, s * y + c * z)
    return (c * x + s * z, y, -s * x + c * z)


# Number of sources named with a bound.
NAMED = 5


@dataclass(slots=True)
class Bounds:
    """Computes bounds of margins at given moments; the effects at one moment are computed once."""

    settings: Settings
    sources: tuple[Source, ...]
    _known: dict[tuple[Any, ...], Effects] = field(default_factory=dict)

    def worst(self, measure: ValueMeasure, method: str) -> dict[str, Any] | None:
        """Return the bound for JSON at the moment with the least `excess`; None if not known.

        `excess` is the distance to the limit less the bound, in the unit people see.
        """
        demand = measure.demand
        ones = [self._one(demand, moment, method) for moment in measure.worst]
        found = [one for one in ones if one is not None]
        return min(found, key=lambda one: float(one['excess'])) if found else None

    def _one(self, demand: Value, moment: Moment, method: str) -> dict[str, Any] | None:
        effects = self.of(demand.signal, moment)
        if effects is None or not (np.isfinite(effects).all() and np.isfinite(moment.value)):
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
        """Return the effects (s,) of the sources on a signal at a moment; None if not known."""
        if not self.sources or signal not in _OF:
            return None
        key = (moment.q, moment.gravity, moment.payload)
        if key not in self._known:
            self._known[key] = effects_of(self.settings, self.sources, *key)
        return _OF[signal](self._known[key], moment, self.settings)

    def largest(self, effects: Floats, scale: float) -> list[dict[str, Any]]:
        """Return the NAMED sources with the largest effects, for JSON."""
        order = np.argsort(-np.abs(effects), kind='stable')[:NAMED]
        return [
            {'name': self.sources[k].name, 'effect': float(effects[k]) * scale}
            for k in order.tolist()
            if effects[k] != 0.0
        ]


def _joint_index(moment: Moment, settings: Settings) -> int:
    return settings.robot.joint_names.index(moment.subject)


def _margin(effects: Effects, moment: Moment, settings: Settings) -> Floats:
    j = _joint_index(moment, settings)
    found: Floats = effects.torque[:, j] + effects.limit[:, j]
    return found


def _utilisation(effects: Effects, moment: Moment, settings: Settings) -> Floats:
    j = _joint_index(moment, settings)
    found: Floats = effects.torque[:, j] + moment.value * effects.limit[:, j]
    return found / settings.limits.torque[j]


def _position(effects: Effects, moment: Moment, settings: Settings) -> Floats:
    column: Floats = effects.position[:, _joint_index(moment, settings)]
    return column


def _torque(effects: Effects, moment: Moment, settings: Settings) -> Floats:
    column: Floats = effects.torque[:, _joint_index(moment, settings)]
    return column


def _angle(effects: Effects, moment: Moment, _: Settings) -> Floats:
    column: Floats = effects.angle[:, SIDES.index(moment.subject)]
    return column


def _tilt(effects: Effects, _: Moment, __: Settings) -> Floats:
    return effects.tilt


# A source affects either the torque or the limit, never both, so signs do not matter.
_OF: dict[str, Callable[[Effects, Moment, Settings], Floats]] = {
    'torque': _torque,
    'torque_margin': _margin,
    'torque_utilisation': _utilisation,
    'position': _position,
    'tip_angle': _angle,
    'tilt': _tilt,
}


def margin_bounds(result: dict[str, Any], limits: CriteriaMeasurement, bounds: Bounds) -> None:
    """Add the bound at the worst moment to each joint's and to the tip-over margin of `result`."""
    result['stability']['uncertainty'] = None  # there is no demand on it without an IMU
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
    """Return the bound of a utilisation converted to torque by the limit `by` (N m; N)."""
    return {
        **bound,
        'bound': bound['bound'] * by,
        'excess': bound['excess'] * by,
        'unit': unit,
        'largest': [{**one, 'effect': one['effect'] * by} for one in bound['largest']],
    }
