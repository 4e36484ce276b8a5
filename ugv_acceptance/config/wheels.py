"""Contact points on wheels: a wheel turns without end, the point it stands on stays below it."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ugv_acceptance import BadConfig
from ugv_acceptance.config.document import Path
from ugv_acceptance.model.robot import Contact, Robot
from ugv_acceptance.model.tree import (
    Pose,
    Tree,
    body_positions,
    drives_of,
    point_of,
    pose_of,
    tree_of,
)
from ugv_acceptance.type_aliases import Floats

# A wheel's centre of gravity lies this close to its axle (share of its radius); that of a flipper
# does not. A point below the axle is at most this far from straight below it (rad).
BALANCED, BELOW = 0.05, math.radians(10.0)
# A point so far (rad) from straight below an axle is told; a joint whose axis is so upright (its
# component along gravity) turns a caster or a turret, no wheel.
ASKEW, UPRIGHT = math.radians(1.0), 0.7
Refuse = Callable[[Path, str], BadConfig]


@dataclass(frozen=True, slots=True)
class Stands:
    """The contact points with which a robot stands, and what was said of those on wheels."""

    contacts: tuple[Contact, ...]
    moved: tuple[str, ...]


def on_axles(robot: Robot, refuse: Refuse) -> Stands:
    """Return the contact points of `robot` with those on wheels fixed below their axles.

    Wheels that are held count too: no message tells their angle, but they turn all the same.
    Raises `refuse` of a point elsewhere on a wheel: it would go round with it.
    """
    endless = {joint.name for joint in robot.joints if joint.kind == 'continuous'}
    if not endless:
        return Stands(robot.contacts, ())
    turning = _turning(robot, endless)
    tree, pose = _posed(turning, robot)
    contacts, moved = [], []
    for contact in robot.contacts:
        found = _fixed(turning, tree, pose, contact, endless, refuse)
        if found is not contact:
            moved.append(
                f'{contact.name} is taken as the lowest point of the wheel {contact.link}, fixed '
                f'to {found.link}: the wheel turns without end'
            )
        contacts.append(found)
    return Stands(tuple(contacts), tuple(moved))


def askew(robot: Robot) -> tuple[tuple[Contact, float], ...]:
    """Return the contact points on wheels that are not straight below their axles, and by what.

    By an angle (rad) about the axle, above ASKEW; `robot` has its contacts as its file gives them.
    """
    endless = {joint.name for joint in robot.joints if joint.kind == 'continuous'}
    if not endless:
        return ()
    tree, pose = _posed(_turning(robot, endless), robot)
    found = []
    for contact in robot.contacts:
        on = _on_wheel(tree, pose, contact, endless)
        if on is not None:
            _, arm, radius = on
            off = math.acos(max(-1.0, min(1.0, -float(arm[2]) / radius)))
            if off > ASKEW:
                found.append((contact, off))
    return tuple(found)


def _turning(robot: Robot, endless: set[str]) -> Robot:
    """Return `robot`, bare of contacts, with its held wheels moving: each is a body of its own."""
    moving = {*robot.joint_names, *(mimic.joint for mimic in robot.mimics)}
    held = tuple(sorted(endless - moving))
    rest = tuple((name, at) for name, at in robot.held if name not in held)
    names = (*robot.joint_names, *held)
    return replace(robot, joint_names=names, held=rest, contacts=(), shapes=())


def _posed(turning: Robot, robot: Robot) -> tuple[Tree, Pose]:
    """Return the tree of a robot with turning wheels, in the zero posture of `robot`."""
    tree, held = tree_of(turning), dict(robot.held)
    at = [held.get(name, 0.0) for name in turning.joint_names]
    return tree, pose_of(tree, body_positions(drives_of(turning, tree), at))


def _fixed(
    robot: Robot, tree: Tree, pose: Pose, contact: Contact, endless: set[str], refuse: Refuse
) -> Contact:
    """Return a contact point on the link that carries the wheel it is on; else the point itself."""
    on = _on_wheel(tree, pose, contact, endless)
    if on is None:
        return contact
    at, arm, radius = on
    name = tree.bodies[tree.frames[contact.link][0]].joint
    if -arm[2] < math.cos(BELOW) * radius:
        raise refuse(
            ('contacts', contact.name, 'position'),
            f'expected a point straight below the axle of {contact.link}, a wheel that {name} '
            'turns without end, or one on the link that carries the wheel; got one that would go '
            'round',
        )
    parent = robot.joint(name).parent
    owner, rotation, _ = tree.frames[parent]
    turn = np.array(pose.rotation[owner], dtype=np.float64) @ np.array(rotation)
    origin = np.array(point_of(tree, pose, parent, (0.0, 0.0, 0.0))[1], dtype=np.float64)
    x, y, z = (turn.T @ (at - origin)).tolist()
    return replace(contact, link=parent, position=(x, y, z))


def _on_wheel(
    tree: Tree, pose: Pose, contact: Contact, endless: set[str]
) -> tuple[Floats, Floats, float] | None:
    """Return a contact's place (3,), its arm from the axle (3,) and their distance; m.

    None for a point that is on no wheel.
    """
    body, point = point_of(tree, pose, contact.link, contact.position)
    at, axis = np.array(point, dtype=np.float64), np.array(pose.axis[body], dtype=np.float64)
    if tree.bodies[body].joint not in endless or abs(axis[2]) > UPRIGHT:
        return None
    arm = _across(at - np.array(pose.origin[body], dtype=np.float64), axis)
    radius = float(np.linalg.norm(arm))
    return (at, arm, radius) if _is_wheel(tree, body, radius) else None


def _across(arm: Floats, axis: object) -> Floats:
    along = np.array(axis, dtype=np.float64)
    across: Floats = arm - along * float(arm @ along)
    return across


def _is_wheel(tree: Tree, body: int, radius: float) -> bool:
    """Return whether a body with a contact at this distance (m) from its axle is a wheel."""
    of = tree.bodies[body]
    carries = any(other.parent == body for other in tree.bodies[1:])
    off = float(np.linalg.norm(_across(np.array(of.cog), of.axis)))
    return radius > 0.0 and of.mass > 0.0 and not carries and off <= BALANCED * radius
