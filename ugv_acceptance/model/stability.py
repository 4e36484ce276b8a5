"""Tip-over margins about the edges of the support polygon: force-angle, energy, moment and ZMP.

Force-angle after Papadopoulos and Rey (2000): with gravity alone the angle is the tilt that is left
about the edge. Energy margin after Messuri and Klein (1985), for a robot that rotates about the
edge's line. All hold for any effective gravity (m/s2, `base_link`): minus the specific force where
the accelerometer takes gravity's place.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ugv_acceptance.model.blocks import in_blocks
from ugv_acceptance.model.expressions import (
    Kernel,
    Number,
    Scalar,
    Vec,
    atan2,
    compile_kernel,
    copysign,
    cross,
    dot,
    scale,
    sqrt,
    subtract,
)
from ugv_acceptance.model.mechanics import Posture, Triple, mechanics_of, posture_of
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.support import Support, support_of

# Sides of the robot, by the direction in which an edge's outward normal points most.
SIDES = ('front', 'left', 'rear', 'right')

# States of a stability sample; from NO_CONTACT on, there is no margin.
STANDING, RAISED, INVERTED, NO_CONTACT, DEGENERATE, FREE_FALL = range(6)
STATES = ('standing', 'raised', 'inverted', 'no_contact', 'degenerate', 'free_fall')
# Below this effective gravity (m/s2) nothing presses the robot on the ground: nothing can be said.
WEIGHTLESS = 1.0


@dataclass(frozen=True, slots=True)
class TipEdge:
    """One edge of a stance: its side (a number in SIDES), the samples that have it, and its terms.

    Terms (m): `l` from the centre of gravity square to the edge, `b = l x a` for the unit vector
    `a` along the edge, and the components of the inward direction in the ground plane on both.
    """

    side: int | NDArray[np.int8]
    where: NDArray[np.bool_] | None
    terms: tuple[Number, ...]


@dataclass(frozen=True, slots=True)
class Stance:
    """How a posture stands: its tip edges, mass (kg) and state, whatever the attitude."""

    edges: tuple[TipEdge, ...]
    mass: Number
    state: int | NDArray[np.int8]


@dataclass(frozen=True, slots=True)
class Stability:
    """Margins to each of SIDES: positive is stable, infinite where no edge lies on that side.

    `angle` (rad) is the force-angle, `moment` (N m) holds the robot down, `energy` (J) lifts it over
    the edge; `zmp` (m) is the distance of the zero-moment point inside the polygon, along the
    tracks' plane. All are NaN where `state` says that there is no margin.
    """

    angle: tuple[Number, ...]
    moment: tuple[Number, ...]
    energy: tuple[Number, ...]
    zmp: Number
    state: int | NDArray[np.int8]


def _edge_terms(*inputs: Scalar) -> list[Scalar]:
    """Terms of a TipEdge from its start, its end and the centre of gravity; last, its normal."""
    start, end, cog = inputs[0:3], inputs[3:6], inputs[6:9]
    edge = subtract(_vec(end), _vec(start))
    along = scale(edge, 1.0 / sqrt(dot(edge, edge)))
    to_start = subtract(_vec(start), _vec(cog))
    square = subtract(to_start, scale(along, dot(to_start, along)))
    side = cross(square, along)
    flat = 1.0 / sqrt(along[0] * along[0] + along[1] * along[1])
    inward: Vec = (-along[1] * flat, along[0] * flat, 0.0)
    return [*square, *side, dot(inward, square), dot(inward, side), along[1], -along[0]]


def _vec(parts: tuple[Scalar, ...]) -> Vec:
    return (parts[0], parts[1], parts[2])


def _edge_margins(*inputs: Scalar) -> list[Scalar]:
    """Angle (rad), moment (N m a kg), energy (J a kg) and ZMP distance (m) of one edge."""
    square, side, gravity = _vec(inputs[0:3]), _vec(inputs[3:6]), _vec(inputs[8:11])
    inward_l, inward_b = inputs[6:8]
    along_l, along_b = dot(gravity, square), dot(gravity, side)
    rise = sqrt(along_l * along_l + along_b * along_b) - along_l
    slope = along_l * inward_l + along_b * inward_b
    zmp = inward_b * slope / (along_l * inward_b - along_b * inward_l) - inward_l
    return [atan2(-along_b, along_l), -along_b, copysign(rise, -along_b), zmp]


@lru_cache(maxsize=1)
def _kernels() -> tuple[Kernel, Kernel]:
    terms = compile_kernel(_edge_terms, [f'point{k}' for k in range(9)])
    margins = compile_kernel(_edge_margins, [f'term{k}' for k in range(11)])
    return terms, margins


def stance_of(robot: Robot, posture: Posture) -> Stance:
    """Return the stance of a posture: of one sample (floats) or of arrays of samples."""
    support = support_of(robot, posture)
    edges = tuple(
        _tip_edge(posture.contacts[e.start], posture.contacts[e.end], posture.cog, e.where)
        for e in support.edges
    )
    return Stance(edges, posture.mass, _standing_state(support))


def _tip_edge(
    start: Triple, end: Triple, cog: Triple, where: NDArray[np.bool_] | None
) -> TipEdge:
    numbers = (*start, *end, *cog)
    kernel = _kernels()[0]
    live = all(isinstance(x, float) for x in numbers)
    *terms, nx, ny = kernel.one(*numbers) if live else kernel.many(*numbers)
    return TipEdge(_side(nx, ny), where, tuple(terms))


def _side(nx: Number, ny: Number) -> int | NDArray[np.int8]:
    """Return the number in SIDES towards which the outward normal points most."""
    if isinstance(nx, float) and isinstance(ny, float):
        if abs(nx) >= abs(ny):
            return 0 if nx > 0 else 2
        return 1 if ny > 0 else 3
    lengthwise = np.abs(nx) >= np.abs(ny)
    side = np.where(lengthwise, np.where(nx > 0, 0, 2), np.where(ny > 0, 1, 3)).astype(np.int8)
    return int(side[0]) if side.size and (side == side[0]).all() else side


def _standing_state(support: Support) -> int | NDArray[np.int8]:
    if isinstance(support.corners, int):
        if support.corners:
            return RAISED if support.raised else STANDING
        return DEGENERATE if support.standing >= 3 else NO_CONTACT
    empty = np.where(support.standing >= 3, DEGENERATE, NO_CONTACT)
    on = np.where(support.raised, RAISED, STANDING)
    return np.where(support.corners > 0, on, empty).astype(np.int8)


def stability_of(stance: Stance, gravity: Triple) -> Stability:
    """Return the margins of a stance under the effective `gravity` (m/s2)."""
    kernel = _kernels()[1]
    numbers = (*gravity, *(t for edge in stance.edges for t in edge.terms))
    margins = kernel.one if all(isinstance(x, float) for x in numbers) else kernel.many
    tables: list[list[Number]] = [[math.inf] * len(SIDES) for _ in range(3)]
    zmp: Number = math.inf
    for edge in stance.edges:
        *values, distance = margins(*edge.terms, *gravity)
        zmp = _least(zmp, distance, edge.where)
        for side in range(len(SIDES)) if isinstance(edge.side, np.ndarray) else (edge.side,):
            where = edge.where if isinstance(edge.side, int) else _both(edge, side)
            for table, value in zip(tables, values, strict=True):
                table[side] = _least(table[side], value, where)
    state = _state(stance.state, gravity)
    angle, moment, energy = (tuple(_known(x, state) for x in table) for table in tables)
    return Stability(
        angle,
        tuple(x * stance.mass for x in moment),
        tuple(x * stance.mass for x in energy),
        _known(zmp, state),
        state,
    )


def _both(edge: TipEdge, side: int) -> NDArray[np.bool_]:
    on: NDArray[np.bool_] = edge.side == side
    return on if edge.where is None else on & edge.where


def _least(least: Number, value: Number, where: NDArray[np.bool_] | None) -> Number:
    """Return the smaller of both where the edge exists."""
    if isinstance(least, float) and isinstance(value, float):
        return min(least, value)
    smaller: Number = np.minimum(least, value if where is None else np.where(where, value, np.inf))
    return smaller


def _state(standing: int | NDArray[np.int8], gravity: Triple) -> int | NDArray[np.int8]:
    gx, gy, gz = gravity
    weight = gx * gx + gy * gy + gz * gz
    if isinstance(weight, float) and isinstance(standing, int):
        if weight < WEIGHTLESS**2:
            return FREE_FALL
        return INVERTED if gz >= 0 and standing < INVERTED else standing
    inverted = np.where((np.asarray(gz) >= 0) & (np.asarray(standing) < INVERTED), INVERTED, standing)
    return np.where(weight < WEIGHTLESS**2, FREE_FALL, inverted).astype(np.int8)


def _known(value: Number, state: int | NDArray[np.int8]) -> Number:
    """Return NaN in place of the margin of a sample whose state has none."""
    if isinstance(state, int) and isinstance(value, float):
        return math.nan if state >= NO_CONTACT else value
    return np.where(np.asarray(state) >= NO_CONTACT, np.nan, value)


def stability(
    robot: Robot,
    q: ArrayLike,
    gravity: ArrayLike,
    payload: Payload | None = None,
    workers: int = 1,
) -> Stability:
    """Return the margins for postures `q` (..., j) under gravity (..., 3), each of shape (...)."""
    mechanics, load = mechanics_of(robot), payload or robot.payload
    n = len(robot.joint_names)

    def margins(*columns: Number) -> tuple[Number, ...]:
        posture = posture_of(mechanics, columns[:n], load.mass, load.cog)
        found = stability_of(stance_of(robot, posture), columns[n:])  # type: ignore[arg-type]  # three
        return (*found.angle, *found.moment, *found.energy, found.zmp, found.state)  # type: ignore[arg-type]  # a small integer

    table = np.moveaxis(in_blocks(margins, 14, q, gravity, workers=workers), -1, 0)
    parts = tuple(table)
    return Stability(parts[0:4], parts[4:8], parts[8:12], parts[12], parts[13].astype(np.int8))
