"""How near a robot in motion is to tipping over each edge: turning energy, effective gravity.

A robot that turns about an edge is a pendulum upside down, of natural frequency wn:
wn^2 = M g r / I_edge. Turning at w towards the edge, it goes on by its own energy to where
cos(margin) = cos(angle) + w^2 / (2 wn^2), past the edge if the right side is above 1. What the
accelerometer feels, moved to the edge, shows before any turn whether the ground still holds the
robot down on the other side. The formulas are compiled for each polygon, as those of edges.py.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from ugv_acceptance.model.attitude import moved_specific_force
from ugv_acceptance.model.edges import Corners, corner_points, least_by_side, lever_of
from ugv_acceptance.model.expressions import (
    Scalar,
    Vec,
    add,
    atan2,
    copysign,
    dot,
    matmul,
    minimum,
    rotate,
    scale,
    sin,
    sqrt,
    subtract,
    transpose,
)
from ugv_acceptance.model.hull import pairs
from ugv_acceptance.model.kernels import Kernel, compile_kernel
from ugv_acceptance.model.mechanics import Mechanics
from ugv_acceptance.model.robot import NO_INERTIA, Vector
from ugv_acceptance.model.tree import Pose, body_positions, drives_of, point_of, pose_of

# A part of the robot: mass (kg), centre of gravity (m, `base_link`), its inertia (six numbers).
_Part = tuple[Scalar, Vec, tuple[Scalar, ...]]
# Where xx, yy, zz, xy, xz, yz stand in a matrix.
_ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


@lru_cache(maxsize=16)
def inertia_of(mechanics: Mechanics) -> Kernel:
    """Return the kernel of the robot's inertia about its centre of gravity, in base axes.

    It takes the inputs of `mechanics.posture` (joint positions, payload mass and centre of gravity)
    and returns xx, yy, zz, xy, xz, yz in kg m2: the links' own inertias, the payload as a point.
    """
    robot, tree = mechanics.robot, mechanics.tree
    drives = drives_of(robot, tree)

    def formula(*inputs: Scalar) -> list[Scalar]:
        q, mass, at = inputs[:-4], inputs[-4], (inputs[-3], inputs[-2], inputs[-1])
        pose = pose_of(tree, body_positions(drives, q))
        parts = [_part(mechanics, pose, k) for k in range(len(tree.bodies))]
        if robot.payload_link is not None:
            _, point = point_of(tree, pose, robot.payload_link, at)
            parts.append((mass, point, (0.0,) * len(_ENTRIES)))
        return _together([part for part in parts if part[0] != 0.0])

    names = [*robot.joint_names, 'payload_mass', 'payload_x', 'payload_y', 'payload_z']
    return compile_kernel(formula, names)


def _part(mechanics: Mechanics, pose: Pose, k: int) -> _Part:
    body = mechanics.tree.bodies[k]
    turn = pose.rotation[k]
    at = add(pose.origin[k], rotate(turn, body.cog))
    if body.inertia == NO_INERTIA:
        return body.mass, at, (0.0,) * len(_ENTRIES)
    own = matmul(matmul(turn, body.inertia), transpose(turn))
    return body.mass, at, tuple(own[i][j] for i, j in _ENTRIES)


def _together(parts: Sequence[_Part]) -> list[Scalar]:
    """Return the inertia of all parts about their common centre of gravity (Steiner)."""
    total: Scalar = sum((mass for mass, _, _ in parts), 0.0)
    moment: Vec = (0.0, 0.0, 0.0)
    for mass, at, _ in parts:
        moment = add(moment, scale(at, mass))
    cog = scale(moment, 1.0 / total)
    away = [(mass, subtract(at, cog), own) for mass, at, own in parts]

    def entry(n: int, i: int, j: int) -> Scalar:
        found: Scalar = 0.0
        for mass, d, own in away:
            square = dot(d, d) - d[i] * d[i] if i == j else -(d[i] * d[j])
            found = found + own[n] + mass * square
        return found

    return [entry(n, i, j) for n, (i, j) in enumerate(_ENTRIES)]


@lru_cache(maxsize=256)
def tipping_of(
    mechanics: Mechanics, corners: Corners, sides: tuple[int, ...], imu: Vector, *, rocks: bool
) -> Kernel:
    """Return the kernel of a moving robot's margins about the edges of a polygon.

    The edges lie on `sides`. It takes the terms of a stance (see Corners), mass (kg), inertia (6,
    see `inertia_of`), then gravity, specific force (m/s2), rate (rad/s) and angular acceleration
    (rad/s2), three numbers each in base axes; the force is what an accelerometer at `imu` (m,
    `base_link`) feels. Where the footing `rocks` its rocking (rad) comes last. It returns four
    numbers each, one to each of SIDES:

    * the margin left with the energy of the turn towards the edge (rad; negative: it will tip),
    * the margin under effective gravity, felt at the edge (rad; negative: the other side lifts),
    * minus the rate towards the edge (rad/s),
    * the square of the natural frequency of tipping (1/s2).

    The least of the edges on a side; infinite on a side without an edge.
    """

    def formula(*inputs: Scalar) -> list[Any]:
        inputs, rocking = (inputs[:-1], inputs[-1]) if rocks else (inputs, 0.0)
        *terms, mass = inputs[:-18]
        vectors = [(inputs[k], inputs[k + 1], inputs[k + 2]) for k in range(-12, 0, 3)]
        points = corner_points(mechanics, corners.polygon, corners.moving, terms)
        cog: Vec = (terms[0], terms[1], terms[2])
        spread = [x / mass for x in inputs[-18:-12]]
        edges = [
            _tipping(lever_of(points[i], points[j], cog), cog, spread, vectors, (imu, rocking))
            for i, j in pairs(corners.polygon)
        ]
        return [least_by_side(sides, [edge[k] for edge in edges]) for k in range(4)]

    terms = 3 + 3 * len(corners.moving)
    return compile_kernel(formula, [f'x{k}' for k in range(terms + 1 + 6 + 12 + rocks)])


def _tipping(
    lever: tuple[Vec, Vec, Vec],
    cog: Vec,
    spread: Sequence[Scalar],
    felt: Sequence[Vec],
    sensor: tuple[Vec, Scalar],
) -> list[Scalar]:
    """Return the four numbers of `tipping_of` for one edge.

    `spread` is the inertia by kg (m2), `felt` gravity, specific force, rate, angular acceleration,
    `sensor` the place of the IMU and the footing's rocking.
    """
    (gravity, force, omega, alpha), (imu, rocking) = felt, sensor
    along, square, side = lever
    reach = dot(square, square)
    held, pressed = -dot(gravity, side), dot(gravity, square)
    angle = atan2(held, pressed) - rocking
    # Only gravity square to the edge pulls about it; times r as `pressed` is.
    pull = sqrt(held * held + pressed * pressed)
    xx, yy, zz, xy, xz, yz = spread
    turned: Vec = rotate(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)), along)
    frequency = pull / (reach + dot(along, turned))
    rate = dot(omega, along)
    towards = -minimum(-rate, 0.0)
    half = sin(0.5 * angle)
    left = copysign(half * half, angle) - towards * towards / (4.0 * frequency)
    # sin^2(margin / 2), of either sign; beyond half a turn there is no margin to tell.
    size = minimum(copysign(1.0, left) * left, 1.0)
    margin = copysign(2.0 * atan2(sqrt(size), sqrt(1.0 - size)), left)
    at_edge = moved_specific_force(force, omega, alpha, subtract(add(cog, square), imu))
    effective = atan2(dot(at_edge, side), -dot(at_edge, square)) - rocking
    return [margin, effective, -rate, frequency]
