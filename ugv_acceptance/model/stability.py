"""Tip-over margins about the edges of the support polygon: force-angle, energy, moment and ZMP.

Force-angle after Papadopoulos and Rey (2000): with gravity alone the angle is the tilt that is left
about the edge. Energy margin after Messuri and Klein (1985), for a robot that rotates about the
edge's line. All hold for any effective gravity (m/s2, `base_link`): minus the specific force where
the accelerometer takes gravity's place.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ugv_acceptance.model.blocks import Floats, in_blocks
from ugv_acceptance.model.expressions import (
    Kernel,
    Number,
    Scalar,
    Vec,
    add,
    atan2,
    compile_kernel,
    copysign,
    cross,
    dot,
    rotate,
    scale,
    sqrt,
    subtract,
)
from ugv_acceptance.model.mechanics import (
    Mechanics,
    Posture,
    Triple,
    mechanics_of,
    posture_of,
    take,
)
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.support import Cycle, Rows, Support, pairs, support_of, supports_of

# Sides of the robot, by the direction in which an edge's outward normal points most.
SIDES = ('front', 'left', 'rear', 'right')

# States of a stability sample; from NO_CONTACT on, there is no margin.
STANDING, RAISED, INVERTED, NO_CONTACT, DEGENERATE, FREE_FALL = range(6)
STATES = ('standing', 'raised', 'inverted', 'no_contact', 'degenerate', 'free_fall')
_NO_EDGE = math.inf
# Below this effective gravity (m/s2) nothing presses the robot on the ground: nothing can be said.
WEIGHTLESS = 1.0


@dataclass(frozen=True, slots=True)
class Stance:
    """How a posture stands, whatever the attitude: samples that share one support polygon.

    `terms` are eight numbers a tip edge (m): `l` from the centre of gravity square to the edge,
    `b = l x a` for the unit vector `a` along the edge, and the components of the ground plane's
    inward direction on both. `sides` is the side of each edge, a number in SIDES; `mass` in kg.
    """

    support: Support
    sides: tuple[int | NDArray[np.int8], ...]
    terms: tuple[Number, ...]
    mass: Number
    state: int


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


def _edge_terms(start: Vec, end: Vec, cog: Vec) -> list[Scalar]:
    """Return the terms of an edge, then the two components of its outward normal."""
    edge = subtract(end, start)
    along = scale(edge, 1.0 / sqrt(dot(edge, edge)))
    to_start = subtract(start, cog)
    square = subtract(to_start, scale(along, dot(to_start, along)))
    side = cross(square, along)
    flat = 1.0 / sqrt(along[0] * along[0] + along[1] * along[1])
    inward: Vec = (-along[1] * flat, along[0] * flat, 0.0)
    return [*square, *side, dot(inward, square), dot(inward, side), along[1], -along[0]]


def _edge_margins(terms: Sequence[Scalar], gravity: Vec) -> list[Scalar]:
    """Return angle (rad), moment (N m a kg), energy (J a kg) and ZMP distance (m) of one edge."""
    along_l = dot(gravity, (terms[0], terms[1], terms[2]))
    along_b = dot(gravity, (terms[3], terms[4], terms[5]))
    inward_l, inward_b = terms[6], terms[7]
    rise = sqrt(along_l * along_l + along_b * along_b) - along_l
    slope = along_l * inward_l + along_b * inward_b
    zmp = inward_b * slope / (along_l * inward_b - along_b * inward_l) - inward_l
    return [atan2(-along_b, along_l), -along_b, copysign(rise, -along_b), zmp]


@lru_cache(maxsize=256)
def _terms_kernel(mechanics: Mechanics, polygon: Cycle) -> Kernel:
    """Return the terms of all edges of a polygon from the contacts' and the cog's coordinates."""
    contacts = mechanics.robot.contacts
    frames = mechanics.tree.frames
    n = 3 * len(contacts)

    def formula(*inputs: Scalar) -> list[Scalar]:
        points: list[Vec] = []
        for k, contact in enumerate(contacts):
            body, rotation, xyz = frames[contact.link]
            fixed = add(xyz, rotate(rotation, contact.position))
            moving = (inputs[3 * k], inputs[3 * k + 1], inputs[3 * k + 2])
            points.append(fixed if body == 0 else moving)
        cog = (inputs[n], inputs[n + 1], inputs[n + 2])
        edges = [_edge_terms(points[i], points[j], cog) for i, j in pairs(polygon)]
        return [*(x for e in edges for x in e[:8]), *(x for e in edges for x in e[8:])]

    return compile_kernel(formula, [f'x{k}' for k in range(n + 3)])


@lru_cache(maxsize=64)
def _margins_kernel(edges: int) -> Kernel:
    """Return the margins of that many edges: all angles, all moments, all energies, all ZMPs."""

    def formula(*inputs: Scalar) -> list[Scalar]:
        gravity: Vec = (inputs[-3], inputs[-2], inputs[-1])
        table = [_edge_margins(inputs[8 * k : 8 * k + 8], gravity) for k in range(edges)]
        return [row[kind] for kind in range(4) for row in table]

    return compile_kernel(formula, [f'x{k}' for k in range(8 * edges + 3)])


def stance_of(mechanics: Mechanics, posture: Posture) -> Stance:
    """Return the stance of one sample (a posture of floats)."""
    points: Any = posture.contacts
    support = support_of(mechanics.robot, points, posture.cog)  # type: ignore[arg-type]  # floats
    return _stance(mechanics, posture, support, live=True)


def stances_of(mechanics: Mechanics, posture: Posture, count: int) -> list[tuple[Rows, Stance]]:
    """Return the stances of `count` samples (a posture of arrays), each with its rows."""
    found = supports_of(mechanics.robot, posture.contacts, posture.cog, count)
    return [
        (rows, _stance(mechanics, take(posture, rows), support, live=False))
        for rows, support in found
    ]


def _stance(mechanics: Mechanics, posture: Posture, support: Support, *, live: bool) -> Stance:
    n = len(support.polygon)
    if n == 0:
        state = DEGENERATE if support.standing >= 3 else NO_CONTACT
        return Stance(support, (), (), posture.mass, state)
    kernel = _terms_kernel(mechanics, support.polygon)
    terms = (kernel.one if live else kernel.many)(
        *(x for point in posture.contacts for x in point), *posture.cog
    )
    sides = tuple(_side(*terms[k : k + 2]) for k in range(8 * n, 10 * n, 2))
    state = RAISED if support.raised else STANDING
    return Stance(support, sides, terms[: 8 * n], posture.mass, state)


def _side(nx: Number, ny: Number) -> int | NDArray[np.int8]:
    """Return the number in SIDES towards which the outward normal points most."""
    if isinstance(nx, float) and isinstance(ny, float):
        if abs(nx) >= abs(ny):
            return 0 if nx > 0 else 2
        return 1 if ny > 0 else 3
    lengthwise = np.abs(nx) >= np.abs(ny)
    side = np.where(lengthwise, np.where(nx > 0, 0, 2), np.where(ny > 0, 1, 3)).astype(np.int8)
    return int(side[0]) if side.size and (side == side[0]).all() else side


def stability_of(stance: Stance, gravity: Triple) -> Stability:
    """Return the margins of a stance under the effective `gravity` (m/s2): floats or arrays."""
    n = len(stance.sides)
    state = _state(stance.state, gravity)
    if n == 0:
        none = (math.nan,) * len(SIDES)
        return Stability(none, none, none, math.nan, state)
    kernel = _margins_kernel(n)
    live = isinstance(gravity[0], float) and isinstance(stance.mass, float)
    live = live and all(isinstance(x, float) for x in stance.terms)
    values = (kernel.one if live else kernel.many)(*stance.terms, *gravity)
    smaller = min if live else _smaller
    angle = _by_side(stance.sides, values[:n], smaller)
    moment = _by_side(stance.sides, values[n : 2 * n], smaller)
    energy = _by_side(stance.sides, values[2 * n : 3 * n], smaller)
    mass = stance.mass
    return Stability(
        _known(angle, state),
        _known([x * mass for x in moment], state),
        _known([x * mass for x in energy], state),
        _known([reduce(smaller, values[3 * n :])], state)[0],
        state,
    )


def _smaller(a: Number, b: Number) -> Number:
    least: Number = np.minimum(a, b)
    return least


def _by_side(
    sides: tuple[int | NDArray[np.int8], ...],
    values: Sequence[Number],
    smaller: Callable[[Number, Number], Number],
) -> list[Number]:
    """Return the smallest value of the edges on each side; infinite where there is none."""
    least: list[Number] = [_NO_EDGE] * len(SIDES)
    for side, value in zip(sides, values, strict=True):
        if isinstance(side, int):
            least[side] = value if least[side] is _NO_EDGE else smaller(least[side], value)
        else:
            for k in range(len(SIDES)):
                least[k] = smaller(least[k], np.where(side == k, value, np.inf))
    return least


def _state(standing: int, gravity: Triple) -> int | NDArray[np.int8]:
    gx, gy, gz = gravity
    weight = gx * gx + gy * gy + gz * gz
    if isinstance(weight, float):
        if weight < WEIGHTLESS**2:
            return FREE_FALL
        return INVERTED if gz >= 0 and standing < INVERTED else standing
    state = np.full(len(weight), standing, dtype=np.int8)
    if standing < INVERTED:
        state[np.asarray(gz) >= 0] = INVERTED
    state[weight < WEIGHTLESS**2] = FREE_FALL
    return state


def _known(values: Sequence[Number], state: int | NDArray[np.int8]) -> tuple[Number, ...]:
    """Return NaN in place of margins of samples whose state has none."""
    if isinstance(state, int):
        return tuple(values) if state < NO_CONTACT else (math.nan,) * len(values)
    none = state >= NO_CONTACT
    return tuple(np.where(none, np.nan, x) for x in values) if none.any() else tuple(values)


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

    def margins(*columns: Any) -> Sequence[Floats]:
        posture = posture_of(mechanics, columns[:n], load.mass, load.cog)
        table = np.empty((14, len(columns[0])))
        for rows, stance in stances_of(mechanics, posture, len(columns[0])):
            found = stability_of(stance, tuple(g[rows] for g in columns[n:]))
            values = (*found.angle, *found.moment, *found.energy, found.zmp, found.state)
            for line, value in zip(table, values, strict=True):
                line[rows] = value
        return list(table)

    parts = tuple(np.moveaxis(in_blocks(margins, 14, q, gravity, workers=workers), -1, 0))
    return Stability(parts[0:4], parts[4:8], parts[8:12], parts[12], parts[13].astype(np.int8))
