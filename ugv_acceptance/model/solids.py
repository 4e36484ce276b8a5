"""The bodies of a robot as solids to draw: points whose convex hull, seen from any side, is theirs.

Boxes, cylinders and spheres of the URDF; a mesh is not read. What has no geometry is drawn by its
joints and contact points.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from ugv_acceptance.model.expressions import add, rotate
from ugv_acceptance.model.robot import IDENTITY, ZERO, Matrix, Robot, Shape, Vector
from ugv_acceptance.model.tree import (
    Tree,
    body_positions,
    drives_of,
    in_body,
    plain,
    pose_of,
    tree_of,
)

# Points of the rim of a cylinder.
_RIM = 16
# A shape of which no side is longer than this (m) is a mark.
_LEAST = 0.01
_TURN = 2.0 * math.pi / _RIM

Place = tuple[Matrix, Vector]


@dataclass(frozen=True, slots=True)
class Solid:
    """One shape in the axes of its body (m): the hull of `points`, each with a `radius` (m) around.

    `body` is a number in the tree. A sphere is one point with a radius, all else has none.
    """

    link: str
    body: int
    points: tuple[Vector, ...]
    radius: float = 0.0


def solids_of(robot: Robot) -> tuple[Solid, ...]:
    """Return the solids of all links whose geometry was read, those of the base first."""
    tree = tree_of(robot)
    shapes = [s for s in (*robot.drawn, *robot.shapes) if s.size is not None]
    found = [_solid(tree, s) for s in shapes if s.link in tree.frames and _seen(s)]
    return tuple(sorted(found, key=lambda solid: solid.body))


def _seen(shape: Shape) -> bool:
    return shape.size is not None and max(shape.size) > _LEAST / 2.0


def _solid(tree: Tree, shape: Shape) -> Solid:
    points = [add(shape.xyz, rotate(shape.rotation, p)) for p in _points(shape)]
    placed = [in_body(tree, shape.link, p) for p in points]
    radius = shape.size[0] if shape.kind == 'sphere' and shape.size else 0.0
    return Solid(shape.link, placed[0][0], tuple(plain(p) for _, p in placed), radius)


def _points(shape: Shape) -> Iterator[Vector]:
    """Yield points in the shape's own axes (m)."""
    x, y, z = shape.size or ZERO
    if shape.kind == 'sphere':
        yield ZERO
    elif shape.kind == 'box':
        yield from ((a, b, c) for a in (-x, x) for b in (-y, y) for c in (-z, z))
    else:
        for k in range(_RIM):
            a, b = x * math.cos(k * _TURN), y * math.sin(k * _TURN)
            yield from ((a, b, -z), (a, b, z))


def moving_bodies(solids: Iterable[Solid]) -> tuple[int, ...]:
    """Return the bodies of solids that move, in order; body 0, the base, does not."""
    return tuple(sorted({solid.body for solid in solids if solid.body}))


def places_of(robot: Robot, q: Sequence[float]) -> tuple[Place, ...]:
    """Return rotation and origin (m, `base_link`) of every body for positions `q` (j,)."""
    tree = tree_of(robot)
    pose: Any = pose_of(tree, body_positions(drives_of(robot, tree), q))
    return ((IDENTITY, ZERO), *zip(pose.rotation[1:], pose.origin[1:], strict=True))


def placed(solid: Solid, place: Place) -> list[Vector]:
    """Return the points (m, `base_link`) of a solid whose body is at a place."""
    rotation, origin = place
    return [plain(add(origin, rotate(rotation, point))) for point in solid.points]
