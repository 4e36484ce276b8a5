"""Compares the contact points of a configuration with the URDF's collision geometry.

A robot that is said to stand wider than it is built would tip without a warning. Boxes, cylinders
and spheres are compared by their extent along the axes; meshes are not read.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ugv_acceptance.model.feet import ROCKING, feet_of, radius_of
from ugv_acceptance.model.mechanics import mechanics_of
from ugv_acceptance.model.robot import Contact, Robot, Shape
from ugv_acceptance.model.support import footings_of
from ugv_acceptance.model.tree import (
    Pose,
    Tree,
    body_positions,
    drives_of,
    in_body,
    pose_of,
    tree_of,
)
from ugv_acceptance.type_aliases import Floats

# How far (m) a contact point may lie outside: tracks and tyres are often drawn without treads.
SLACK = 0.05
# How far (m) a mesh reaches from its link's origin at most, in diagonals of all other geometry.
AS_LARGE = 0.75
# A point of a leg this near its joint, as a share of how far its geometry reaches, is of the knee;
# geometry that reaches less than so much (m) further tells nothing.
KNEE, FURTHER = 0.5, 0.05
# Unevenness (m) of the tracks from which it is told.
FLAT = 1e-4
# Lowest and highest corner (3,) of an extent along the axes, m.
Box = tuple[Floats, Floats]


@dataclass(frozen=True, slots=True)
class Compared:
    """Contacts outside of all geometry, with how far (m); and the contacts that no shape tells."""

    outside: tuple[tuple[Contact, float], ...]
    unknown: tuple[Contact, ...]


@dataclass(frozen=True, slots=True)
class Uneven:
    """Contacts of the base near the ground that are not in one plane.

    One is `off` (m) the plane of three others; `rocking` (rad) is taken until all of them carry.
    """

    names: tuple[str, ...]
    off: float
    rocking: float


@dataclass(frozen=True, slots=True)
class Kneeling:
    """A contact `near` (m) the joint that moves it; `end` is the link that reaches furthest."""

    contact: Contact
    near: float
    end: str
    reach: float


def kneeling(robot: Robot, shapes: Sequence[Shape]) -> tuple[Kneeling, ...]:
    """Return the contacts at the knees of legs: what moves with them, or on them, reaches further.

    Whoever stands on them lies or kneels in the posture from which they were taken. Geometry counts
    by its middle, meshes do not; nor does what joints turn without end, as wheels on a leg do.
    """
    tree = tree_of(robot)
    own, ends = _reaches(tree, shapes), _reaches(tree, shapes)
    endless = {joint.name for joint in robot.joints if joint.kind == 'continuous'}
    for k in range(len(tree.bodies) - 1, 0, -1):
        body = tree.bodies[k]
        if body.joint not in endless and k in ends and body.parent:
            far, end = ends[k]
            more = float(np.linalg.norm(np.array(body.offset))) + far
            ends[body.parent] = max(ends.get(body.parent, (0.0, '')), (more, end))
    found = []
    for contact in robot.contacts:
        body_of, point = in_body(tree, contact.link, contact.position)
        near = float(np.linalg.norm(np.array(point, dtype=np.float64)))
        reach, end = ends.get(body_of, (0.0, ''))
        goes_on = (reach, end) != own.get(body_of, (0.0, ''))
        if body_of and near + FURTHER < reach and (goes_on or near < KNEE * reach):
            found.append(Kneeling(contact, near, end, reach))
    return tuple(found)


def _reaches(tree: Tree, shapes: Sequence[Shape]) -> dict[int, tuple[float, str]]:
    """Return how far (m) from its joint the geometry of each body reaches, and on which link."""
    found: dict[int, tuple[float, str]] = {}
    for shape in shapes:
        body, middle = in_body(tree, shape.link, shape.xyz)
        if shape.size is not None:
            far = float(np.linalg.norm(np.array(middle, dtype=np.float64)))
            found[body] = max(found.get(body, (0.0, '')), (far, shape.link))
    return found


def uneven_tracks(robot: Robot) -> Uneven | None:
    """Return the contacts of the base if they are uneven by more than FLAT, else None."""
    tree = tree_of(robot)
    placed = [in_body(tree, contact.link, contact.position) for contact in robot.contacts]
    on_base = [
        contact for contact, (body, _) in zip(robot.contacts, placed, strict=True) if not body
    ]
    alone = replace(robot, contacts=tuple(on_base))
    feet = feet_of(mechanics_of(alone))
    if len(feet.tracks) < 4:
        return None
    tracks = tuple(on_base[k] for k in feet.tracks)
    alone = replace(robot, contacts=tracks)
    points: list[Any] = [in_body(tree, contact.link, contact.position)[1] for contact in tracks]
    all_of_them = [
        f for f in footings_of(mechanics_of(alone), points) if len(f.points) == len(tracks)
    ]
    if not all_of_them:
        return None
    rocking: Any = all_of_them[0].rocking
    off = rocking / ROCKING * radius_of(points)
    return Uneven(tuple(c.name for c in tracks), off, rocking) if off > FLAT else None


def compared(robot: Robot, shapes: Sequence[Shape]) -> Compared:
    """Compare each contact point with the collision geometry of the body that it is part of."""
    tree = tree_of(robot)
    zero = body_positions(drives_of(robot, tree), [0.0] * len(robot.joint_names))
    pose = pose_of(tree, zero)
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
