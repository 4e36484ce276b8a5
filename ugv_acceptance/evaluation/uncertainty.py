"""The bound on a margin that follows from the stated +/- of the numbers it is computed from.

First order: every number is moved by its +/- to both sides while the posture, the payload and the
support polygon stay what they are; half the difference is that number's effect. Effects are
combined as a root sum of squares (independent numbers) or as a sum (worst case).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.criteria import WORST_CASE
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.mechanics import Posture, mechanics_of, posture_once
from ugv_acceptance.model.robot import Contact, Joint, Link, Payload, Robot, Vector
from ugv_acceptance.model.stability import SIDES, stance_of, tip_angles_of
from ugv_acceptance.model.statics import torque_of

Floats = NDArray[np.float64]
Gravity = tuple[float, float, float]
# Contacts that are all moved, the payload in force, and the IMU: subjects beside links and joints.
CONTACTS, PAYLOAD, IMU = 'contacts', 'payload', 'imu'


@dataclass(frozen=True, slots=True)
class Source:
    """One uncertain number: +/- `value` (SI) of `what` of `subject`, `name` as in the file.

    `what` is mass, cog, place (of a joint or contacts), offset, limit, roll or pitch (of the IMU);
    `axis` 0, 1, 2 where it is a vector.
    """

    name: str
    subject: str
    what: str
    value: float
    axis: int = 0


@dataclass(frozen=True, slots=True)
class Effects:
    """What every source does to one row: `torque` (s, j) N m (N), `angle` (s, 4) rad to SIDES.

    `position` (s, j) rad or m, `tilt` (s,) rad, `limit` (s, j) N m (N). NaN angle: no edge there.
    """

    sources: tuple[Source, ...]
    torque: Floats
    angle: Floats
    position: Floats
    limit: Floats
    tilt: Floats


@dataclass(frozen=True, slots=True)
class _Point:
    """What a row's margins are computed from."""

    robot: Robot
    q: tuple[float, ...]
    gravity: Gravity
    payload: Payload


def effects_of(
    settings: Settings,
    sources: Sequence[Source],
    q: tuple[float, ...],
    gravity: Gravity,
    payload: Payload,
) -> Effects:
    """Return the effect of each source on the margins of one row."""
    robot = settings.robot
    point = _Point(robot, q, gravity, payload)
    margins = _margins_near(point)
    n, count = len(q), len(sources)
    table = np.zeros((count, n + len(SIDES)))
    position, limit, tilt = np.zeros((count, n)), np.zeros((count, n)), np.zeros(count)
    for k, source in enumerate(sources):
        if source.what == 'limit':
            limit[k, robot.joint_names.index(source.subject)] = source.value
            continue
        high, low = (_moved(point, source, sign * source.value) for sign in (1.0, -1.0))
        with np.errstate(invalid='ignore'):
            table[k] = 0.5 * (margins(high) - margins(low))
        position[k] = 0.5 * (np.array(high.q) - np.array(low.q))
        tilt[k] = source.value if source.subject == IMU else 0.0
    return Effects(tuple(sources), table[:, :n], table[:, n:], position, limit, tilt)


def combined(effects: Floats, method: str) -> Floats:
    """Return the bound (...) of effects (s, ...): their root sum of squares or their sum."""
    size = np.abs(effects)
    bound: Floats = size.sum(axis=0) if method == WORST_CASE else np.sqrt((size**2).sum(axis=0))
    return bound


def _margins_near(point: _Point) -> Callable[[_Point], Floats]:
    """Return torques and tip angles (j + 4,) of points near this one, on its support polygon."""
    mechanics = mechanics_of(point.robot)
    nominal: Any = _posture(point)
    stance = stance_of(mechanics, nominal)
    contacts, frames = point.robot.contacts, mechanics.tree.frames
    polygon = stance.support.polygon if stance.edges else ()
    moving = [k for k in polygon if frames[contacts[k].link][0] != 0]
    on_base = next((k for k in polygon if k not in moving), None)

    def margins(at: _Point) -> Floats:
        posture: Any = _posture(at)
        torque = torque_of(posture, at.gravity)
        if stance.edges is None:
            return np.array([*torque, *(math.nan for _ in SIDES)])
        # The kernel holds the base's corners fixed: what moves them moves all else the other way.
        shift = np.zeros(3)
        if on_base is not None:
            shift = np.array(posture.contacts[on_base]) - np.array(nominal.contacts[on_base])
        points = [posture.cog, *(posture.contacts[k] for k in moving)]
        terms = tuple(float(x) for p in points for x in np.array(p) - shift)
        near = replace(stance, terms=terms, mass=posture.mass)
        angle, _ = tip_angles_of(near, at.gravity)
        return np.array([*torque, *angle], dtype=np.float64)

    return margins


def _posture(point: _Point) -> Posture:
    return posture_once(point.robot, point.q, point.payload.mass, point.payload.cog)


def _moved(point: _Point, source: Source, by: float) -> _Point:
    if source.subject == IMU:
        return replace(point, gravity=_turned(point.gravity, source.what, by))
    if source.subject == PAYLOAD:
        return replace(point, payload=_other_payload(point.payload, source, by))
    if source.what == 'offset':
        j = point.robot.joint_names.index(source.subject)
        q = (*point.q[:j], point.q[j] + by, *point.q[j + 1 :])
        return replace(point, q=q)
    return replace(point, robot=_other_robot(point.robot, source, by))


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
    return replace(contact, position=_added(contact.position, source.axis, by))


def _added(v: Vector, axis: int, by: float) -> Vector:
    parts = [x + (by if k == axis else 0.0) for k, x in enumerate(v)]
    return (parts[0], parts[1], parts[2])


def _turned(g: Gravity, what: str, by: float) -> Gravity:
    """Return gravity as an IMU that is off by a roll or pitch angle (rad) shows it."""
    x, y, z = g
    s, c = math.sin(by), math.cos(by)
    if what == 'roll':
        return (x, c * y - s * z, s * y + c * z)
    return (c * x + s * z, y, -s * x + c * z)
