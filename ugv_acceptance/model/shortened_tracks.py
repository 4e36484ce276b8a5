"""A robot whose tracks are shortened at each end: what may carry it on stairs or uneven ground.

On an edge or a step the part of a track beyond it hangs in the air. Where the edges lie nobody
knows; that they are no further apart than a pitch means that at most half of it is missing at
each end, on the average.
"""

import math
from dataclasses import replace
from functools import lru_cache

from ugv_acceptance.model.expressions import Vec, add, rotate, subtract, transpose
from ugv_acceptance.model.robot import Contact, Robot, Vector
from ugv_acceptance.model.tree import Tree, in_body, plain, tree_of

# What is left of a track that is shorter than the cut (m to each side of its middle).
STUMP = 0.001
# A joint that turns a flipper lies across the robot: the share of its axis along y.
ACROSS = 0.9


@lru_cache(maxsize=16)
def shortened(robot: Robot, cut: float) -> Robot:
    """Return the robot with `cut` (m) taken from each end of its tracks and flippers.

    Contacts of the base move along x towards their middle, those of a link that turns on the base
    about an axis across it (a flipper) towards that axis; others, such as feet of legs, stay. Some
    of a track or flipper always stays.
    """
    tree = tree_of(robot)
    placed = [in_body(tree, contact.link, contact.position) for contact in robot.contacts]
    at = [(body, plain(point)) for body, point in placed]
    of_base = [point[0] for body, point in at if body == 0]
    middle = (min(of_base) + max(of_base)) / 2.0 if of_base else 0.0
    moved = []
    for contact, (body, point) in zip(robot.contacts, at, strict=True):
        target = point
        if body == 0:
            target = (middle + _less(point[0] - middle, cut), point[1], point[2])
        elif tree.bodies[body].parent == 0 and _across(tree, body):
            target = _drawn_in(tree.bodies[body].axis, point, cut)
        moved.append(_moved(tree, contact, subtract(target, point)))
    return replace(robot, contacts=tuple(moved))


def has_tracks(robot: Robot) -> bool:
    """Return whether contact points are fixed to the base, as the ends of tracks are."""
    tree = tree_of(robot)
    return any(tree.frames[contact.link][0] == 0 for contact in robot.contacts)


def _less(distance: float, cut: float) -> float:
    return math.copysign(max(abs(distance) - cut, min(STUMP, abs(distance))), distance)


def _across(tree: Tree, body: int) -> bool:
    return not tree.bodies[body].prismatic and abs(tree.bodies[body].axis[1]) > ACROSS


def _drawn_in(axis: Vector, point: Vector, cut: float) -> Vector:
    """Return a point moved by `cut` (m) towards the axis through the origin."""
    along = sum(a * p for a, p in zip(axis, point, strict=True))
    x, y, z = (p - along * a for a, p in zip(axis, point, strict=True))
    length = math.hypot(x, y, z)
    share = _less(length, cut) / length if length else 1.0
    return (along * axis[0] + share * x, along * axis[1] + share * y, along * axis[2] + share * z)


def _moved(tree: Tree, contact: Contact, by: Vec) -> Contact:
    """Return a contact moved `by` so much (m, axes of its body)."""
    turn = tree.frames[contact.link][1]
    shift = rotate(transpose(turn), by)
    return replace(contact, position=plain(add(contact.position, shift)))
