"""Compares the contact points of a configuration with the URDF's collision geometry.

A robot that is said to stand wider than it is built would tip without a warning. Boxes, cylinders
and spheres are compared by their extent along the axes; meshes are not read.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ugv_acceptance.model.robot import Contact, Robot, Shape
from ugv_acceptance.model.tree import Pose, Tree, in_body, pose_of, tree_of
from ugv_acceptance.type_aliases import Floats

# How far (m) a contact point may lie outside: tracks and tyres are often drawn without treads.
SLACK = 0.05
# How far (m) a mesh reaches from its link's origin at most, in diagonals of all other geometry.
AS_LARGE = 0.75
# Lowest and highest corner (3,) of an extent along the axes, m.
Box = tuple[Floats, Floats]


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
        known, perhaps = _boxes(tree, pose, shapes, body, float(at[2]))
        if known and _off(at, known, axes) <= SLACK:
            continue
        if perhaps is None or (off := _off(at, known + perhaps, axes)) <= SLACK:
            unknown.append(contact)
        else:
            outside.append((contact, off))
    return Compared(tuple(outside), tuple(unknown))


def _off(point: Floats, boxes: Sequence[Box], axes: slice) -> float:
    """Return how far (m) a point lies outside the extent of all boxes together, along some axes."""
    low, high = _together(boxes)
    away = np.maximum(np.maximum(low - point, point - high), 0.0)
    return float(np.linalg.norm(away[axes]))


def _together(boxes: Sequence[Box]) -> Box:
    low = np.min([low for low, _ in boxes], axis=0)
    high = np.max([high for _, high in boxes], axis=0)
    return low, high


def _boxes(
    tree: Tree, pose: Pose, shapes: Sequence[Shape], body: int, height: float
) -> tuple[list[Box], list[Box] | None]:
    """Return the extents to compare a contact of `body` with: those known, and those of meshes.

    They are its body's own, in its axes; for the base also what reaches down to the contact's
    `height` (m), such as a wheel that turns on a joint of its own. A mesh is taken as at most
    about as large as the rest of a robot whose wheels or tracks are known; None where they are not.
    """
    placed = list(_placed(tree, pose, shapes, body))
    found = [
        (centre - half, centre + half)
        for place, centre, half in placed
        if half is not None and (place == body or centre[2] - half[2] <= height + SLACK)
    ]
    meshes = [
        centre
        for place, centre, half in placed
        if half is None and (place == body or tree.bodies[place].parent == 0)
    ]
    stands = body == 0 and any(low[2] <= height + SLACK for low, _ in found)
    if not found or (meshes and not stands):
        return found, None
    low, high = _together(found)
    reach = AS_LARGE * np.linalg.norm(high - low)
    return found, [(centre - reach, centre + reach) for centre in meshes]


def _placed(
    tree: Tree, pose: Pose, shapes: Sequence[Shape], body: int
) -> Iterator[tuple[int, Floats, Floats | None]]:
    """Yield body, centre and half extent of each shape in the axes of `body` (for the base: all).

    The half extent (m) is None for a shape that is not read.
    """
    for shape in shapes:
        place, turn, xyz = tree.frames[shape.link]
        if body not in (0, place):
            continue
        rotation, origin = np.array(turn), np.array(xyz)
        if body == 0:
            outer = np.array(pose.rotation[place], dtype=np.float64)
            origin = np.array(pose.origin[place], dtype=np.float64) + outer @ origin
            rotation = outer @ rotation
        centre = origin + rotation @ np.array(shape.xyz)
        half = None if shape.size is None else _half(shape, rotation @ np.array(shape.rotation))
        yield place, centre, half


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
