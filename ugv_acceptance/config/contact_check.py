"""Compares the contact points of a configuration with the URDF's collision geometry.

A robot that is said to stand wider than it is built would tip without a warning. Boxes, cylinders
and spheres are compared by their extent along the axes; meshes are not read.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ugv_acceptance.model.robot import Contact, Matrix, Robot, Vector
from ugv_acceptance.model.tree import Pose, Tree, in_body, pose_of, tree_of
from ugv_acceptance.type_aliases import Floats

# How far (m) a contact point may lie outside: tracks and tyres are often drawn without treads.
SLACK = 0.05


@dataclass(frozen=True, slots=True)
class Shape:
    """One collision geometry of a link: `size` is its half extent (m) along its own axes.

    `kind` is box, cylinder, sphere, or that of a geometry that is not read (`size` None).
    """

    link: str
    kind: str
    xyz: Vector
    rotation: Matrix
    size: Vector | None


@dataclass(frozen=True, slots=True)
class Compared:
    """Contacts outside of all geometry, with how far (m); and the contacts that no shape tells."""

    outside: tuple[tuple[Contact, float], ...]
    unknown: tuple[Contact, ...]


def compared(robot: Robot, shapes: Sequence[Shape]) -> Compared:
    """Compare each contact point with the collision geometry of the body that it is part of."""
    tree = tree_of(robot)
    pose = pose_of(tree, [0.0] * (len(tree.bodies) - 1))
    outside, unknown = [], []
    for contact in robot.contacts:
        body, point = in_body(tree, contact.link, contact.position)
        axes = slice(2) if body == 0 else slice(3)
        at = np.array(point, dtype=np.float64)
        boxes, unread = _boxes(tree, pose, shapes, body, float(at[2]))
        off = _off(at[axes], [(low[axes], high[axes]) for low, high in boxes])
        if off <= SLACK:
            continue
        if unread or not boxes:
            unknown.append(contact)
        else:
            outside.append((contact, off))
    return Compared(tuple(outside), tuple(unknown))


def _off(point: Floats, boxes: Sequence[tuple[Floats, Floats]]) -> float:
    """Return how far (m) a point lies outside the extent of all boxes together."""
    if not boxes:
        return float('inf')
    low = np.min([low for low, _ in boxes], axis=0)
    high = np.max([high for _, high in boxes], axis=0)
    away = np.maximum(np.maximum(low - point, point - high), 0.0)
    return float(np.linalg.norm(away))


def _boxes(
    tree: Tree, pose: Pose, shapes: Sequence[Shape], body: int, height: float
) -> tuple[list[tuple[Floats, Floats]], bool]:
    """Return the extents to compare a contact of `body` with, and whether some cannot be read.

    They are its body's own, in its axes; for the base also what reaches down to the contact's
    `height` (m), such as a wheel that turns on a joint of its own.
    """
    found, unread = [], False
    for place, low, high in _placed(tree, pose, shapes, body):
        own = place == body
        if low is None or high is None:
            unread = unread or own or (body == 0 and tree.bodies[place].parent == 0)
        elif own or (body == 0 and low[2] <= height + SLACK):
            found.append((low, high))
    return found, unread


def _placed(
    tree: Tree, pose: Pose, shapes: Sequence[Shape], body: int
) -> Iterator[tuple[int, Floats | None, Floats | None]]:
    """Yield the body of each shape, and the shape's extent in the axes of `body` (or of the base)."""
    for shape in shapes:
        place, turn, xyz = tree.frames[shape.link]
        if body not in (0, place):
            continue
        rotation, origin = np.array(turn), np.array(xyz)
        if body == 0:
            outer = np.array(pose.rotation[place], dtype=np.float64)
            origin = np.array(pose.origin[place], dtype=np.float64) + outer @ origin
            rotation = outer @ rotation
        if shape.size is None:
            yield place, None, None
            continue
        centre = origin + rotation @ np.array(shape.xyz)
        half = _half(shape, rotation @ np.array(shape.rotation))
        yield place, centre - half, centre + half


def _half(shape: Shape, rotation: Floats) -> Floats:
    """Return the half extent (m) of a turned shape along the outer axes."""
    size = np.array(shape.size)
    if shape.kind == 'sphere':
        return size
    if shape.kind == 'cylinder':
        along = np.abs(rotation[:, 2])
        half: Floats = along * size[2] + size[0] * np.sqrt(np.maximum(1.0 - along**2, 0.0))
        return half
    turned: Floats = np.abs(rotation) @ size
    return turned
