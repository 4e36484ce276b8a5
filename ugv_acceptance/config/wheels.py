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
Refuse = Callable[[Path, str], BadConfig]


@dataclass(frozen=True, slots=True)
class Stands:
    """The contact points with which a robot stands, and what was said of those on wheels."""

    contacts: tuple[Contact, ...]
    moved: tuple[str, ...]


def on_axles(robot: Robot, refuse: Refuse) -> Stands:
    """Return the contact points of `robot` with those on measured wheels fixed below their axles.

    Raises `refuse` of a point elsewhere on a wheel: it would go round with it.
    """
    endless = {j.name for j in robot.joints if j.kind == 'continuous' and j.name in _moving(robot)}
    if not endless:
        return Stands(robot.contacts, ())
    tree = tree_of(robot)
    drives = drives_of(robot, tree)
    pose = pose_of(tree, body_positions(drives, [0.0] * len(robot.joint_names)))
    contacts, moved = [], []
    for contact in robot.contacts:
        found = _fixed(robot, tree, pose, contact, endless, refuse)
        if found is not contact:
            moved.append(
                f'{contact.name} is taken as the lowest point of the wheel {contact.link}, fixed '
                f'to {found.link}: the wheel turns without end'
            )
        contacts.append(found)
    return Stands(tuple(contacts), tuple(moved))


def _moving(robot: Robot) -> set[str]:
    return {*robot.joint_names, *(mimic.joint for mimic in robot.mimics)}


def _fixed(
    robot: Robot, tree: Tree, pose: Pose, contact: Contact, endless: set[str], refuse: Refuse
) -> Contact:
    """Return a contact point on the link that carries the wheel it is on; else the point itself."""
    body, point = point_of(tree, pose, contact.link, contact.position)
    at = np.array(point, dtype=np.float64)
    name = tree.bodies[body].joint
    if name not in endless:
        return contact
    arm = _across(at - np.array(pose.origin[body], dtype=np.float64), pose.axis[body])
    radius = float(np.linalg.norm(arm))
    if not _is_wheel(tree, body, radius):
        return contact
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
