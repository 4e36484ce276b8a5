"""Tip-over margins about each edge of a support polygon: force-angle, moment, energy, ZMP.

Force-angle after Papadopoulos and Rey (2000): with gravity alone the angle is the tilt that is left
about the edge. Energy margin after Messuri and Klein (1985), for a robot that rotates about the
edge's line. Each is that of a robot turned towards the edge by the rocking of its footing
(support.py). The formulas are compiled for each polygon; edges between two points of the base are
constants of the compiled code.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial, reduce
from typing import Any

import numpy as np

from ugv_acceptance.model.expressions import (
    Scalar,
    Vec,
    atan2,
    copysign,
    cos,
    cross,
    dot,
    minimum,
    scale,
    sin,
    sqrt,
    subtract,
)
from ugv_acceptance.model.hull import Cycle, pairs
from ugv_acceptance.model.kernels import Kernel, compile_kernel
from ugv_acceptance.model.mechanics import Mechanics
from ugv_acceptance.model.robot import ZERO
from ugv_acceptance.model.row_selection import Values
from ugv_acceptance.model.tree import in_body

# Sides of the robot: an edge belongs to the side its outward normal points towards most.
SIDES = ('front', 'left', 'rear', 'right')
_NO_EDGE = float('inf')


@dataclass(frozen=True, slots=True, eq=False)
class Corners:
    """A support polygon of one robot, and which of its corners move with a joint.

    `moving` are the corners on links other than the base. `sides` (numbers in SIDES) are the sides
    of the edges if no corner moves, else None. The *terms* of a stance are the coordinates of the
    centre of gravity (3) and of each moving corner (3): m, `base_link`. `outward` takes the terms
    and returns each edge's outward normal (x, y; not of unit length).
    """

    polygon: Cycle
    moving: tuple[int, ...]
    sides: tuple[int, ...] | None
    outward: Kernel


@dataclass(frozen=True, eq=False)
class Edges:
    """Compiled tip-over margins of one polygon, given on which side of the robot each edge lies.

    Both kernels take the terms of a stance (see Corners), then mass (kg) and gravity (3), and where
    the footing `rocks` its rocking (rad).
    `angles` returns the tip angle (rad) to each of SIDES; `margins` returns these angles, then the
    moments (N m), the energies (J), and the ZMP distance (m). Infinite on a side without an edge.
    `of_margins` compiles `margins`.
    """

    angles: Kernel
    rocks: bool
    of_margins: Callable[[], Kernel]

    @cached_property
    def margins(self) -> Kernel:
        """All margins, compiled when first asked for: most messages need only the angles."""
        return self.of_margins()


@lru_cache(maxsize=256)
def corners_of(mechanics: Mechanics, polygon: Cycle, *, free: bool = False) -> Corners:
    """Return the Corners of a polygon: which of them move, and the outward normals of its edges.

    With `free` all of them do, for a robot whose contact points are not just where they should be.
    """
    contacts, frames = mechanics.robot.contacts, mechanics.tree.frames
    moving = tuple(k for k in polygon if free or frames[contacts[k].link][0] != 0)

    def formula(*terms: Scalar) -> list[Any]:
        points = corner_points(mechanics, polygon, moving, terms)
        edges = [subtract(points[j], points[i]) for i, j in pairs(polygon)]
        return [(along[1], -along[0]) for along in edges]

    names = [f'x{k}' for k in range(3 + 3 * len(moving))]
    outward = compile_kernel(formula, names)
    sides = None if moving else tuple(side_of(x, y) for x, y in outward.one(*ZERO))
    return Corners(polygon, moving, sides, outward)


@lru_cache(maxsize=256)
def edges_of(
    mechanics: Mechanics, corners: Corners, sides: tuple[int, ...], *, rocks: bool = False
) -> Edges:
    """Return the compiled margins of a polygon whose edges lie on `sides` (numbers in SIDES)."""

    def table(inputs: Sequence[Scalar]) -> tuple[list[list[Scalar]], Scalar]:
        rocking = inputs[-1] if rocks else 0.0
        *terms, mass, gx, gy, gz = inputs[:-1] if rocks else inputs
        points = corner_points(mechanics, corners.polygon, corners.moving, terms)
        cog: Vec = (terms[0], terms[1], terms[2])
        edges = [
            _edge_margins(lever_of(points[i], points[j], cog), (gx, gy, gz), rocking)
            for i, j in pairs(corners.polygon)
        ]
        return edges, mass

    def angles(*inputs: Scalar) -> tuple[Scalar, ...]:
        edges, _ = table(inputs)
        return least_by_side(sides, [edge[0] for edge in edges])

    def margins(*inputs: Scalar) -> tuple[Any, ...]:
        edges, mass = table(inputs)
        angle, moment, energy, zmp = ([edge[k] for edge in edges] for k in range(4))
        held = [least_by_side(sides, [x * mass for x in of]) for of in (moment, energy)]
        return least_by_side(sides, angle), *held, reduce(minimum, zmp)

    names = [f'x{k}' for k in range(3 + 3 * len(corners.moving) + 4 + rocks)]
    return Edges(compile_kernel(angles, names), rocks, partial(compile_kernel, margins, names))


def least_by_side(sides: Sequence[int], values: Sequence[Scalar]) -> tuple[Scalar, ...]:
    """Return the least value of the edges on each of SIDES; infinite on a side without an edge."""
    on = [[v for s, v in zip(sides, values, strict=True) if s == k] for k in range(len(SIDES))]
    return tuple(reduce(minimum, some) if some else _NO_EDGE for some in on)


def corner_points(
    mechanics: Mechanics, polygon: Cycle, moving: Sequence[int], terms: Sequence[Scalar]
) -> dict[int, Vec]:
    """Return the corners' positions (m, `base_link`) by contact number; constant on the base."""
    points = {}
    for k in polygon:
        contact = mechanics.robot.contacts[k]
        points[k] = in_body(mechanics.tree, contact.link, contact.position)[1]
    for place, k in enumerate(moving, start=1):
        points[k] = (terms[3 * place], terms[3 * place + 1], terms[3 * place + 2])
    return points


def lever_of(start: Vec, end: Vec, cog: Vec) -> tuple[Vec, Vec, Vec]:
    """Return an edge's direction, the vector from the centre of gravity to its nearest point, ...

    ... and one of the same length (m) square to both, upwards and inwards. The robot tips over the
    edge by turning about its direction, right-handed.
    """
    edge = subtract(end, start)
    along = scale(edge, 1.0 / sqrt(dot(edge, edge)))
    to_start = subtract(start, cog)
    square = subtract(to_start, scale(along, dot(to_start, along)))
    return along, square, cross(to_start, along)


def _edge_margins(lever: tuple[Vec, Vec, Vec], gravity: Vec, rocking: Scalar) -> list[Scalar]:
    """Return angle (rad), moment (N m/kg), energy (J/kg) and ZMP distance (m) of one edge."""
    along, square, side = lever
    along_l, along_b = dot(gravity, square), dot(gravity, side)
    angle = atan2(-along_b, along_l) - rocking
    size = sqrt(along_l * along_l + along_b * along_b)
    if rocking != 0.0:
        s, c, held = sin(rocking), cos(rocking), along_b
        along_l, along_b = c * along_l - s * along_b, c * along_b + s * along_l
        along_b = -minimum(-along_b, -held)  # no more than without: upside down it turns past pi
    rise = size - along_l
    flat = 1.0 / sqrt(along[0] * along[0] + along[1] * along[1])
    inward: Vec = (-along[1] * flat, along[0] * flat, 0.0)
    inward_l, inward_b = dot(inward, square), dot(inward, side)
    slope = along_l * inward_l + along_b * inward_b
    zmp = inward_b * slope / (along_l * inward_b - along_b * inward_l) - inward_l
    return [angle, -along_b, copysign(rise, -along_b), zmp]


def side_of(x: Values, y: Values) -> Values:
    """Return the number in SIDES of the side a normal (x, y) points towards: floats or arrays."""
    if isinstance(x, float) and isinstance(y, float):
        if abs(x) >= abs(y):
            return int(1.0 - math.copysign(1.0, x))
        return int(2.0 - math.copysign(1.0, y))
    side = np.where(np.abs(x) >= np.abs(y), 1.0 - np.copysign(1.0, x), 2.0 - np.copysign(1.0, y))
    return side.astype(np.int64)
