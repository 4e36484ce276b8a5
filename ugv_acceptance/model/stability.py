"""Tip-over margins of a robot that stands on its support polygon: one sample or many.

A stance is what joints and payload determine; gravity then gives the margins about its edges
(edges.py). All hold for any effective gravity (m/s2, `base_link`); with an accelerometer in place
of gravity it is minus the specific force.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ugv_acceptance.model.blocks import in_blocks
from ugv_acceptance.model.edges import SIDES, Edges, corners_of, edges_of, side_of
from ugv_acceptance.model.expressions import Number
from ugv_acceptance.model.mechanics import (
    Mechanics,
    Posture,
    Triple,
    mechanics_of,
    posture_of,
)
from ugv_acceptance.model.reactions import carry
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.row_selection import Rows, Values, groups, inner, pick
from ugv_acceptance.model.support import Support, support_of, supports_of
from ugv_acceptance.type_aliases import Floats

__all__ = ['SIDES', 'STATES', 'Margins', 'Stability', 'Stance']

# States of a stability sample; from NO_CONTACT on, there is no margin.
STANDING, RAISED, INVERTED, NO_CONTACT, DEGENERATE, FREE_FALL, UNKNOWN = range(7)
STATES = ('standing', 'raised', 'inverted', 'no_contact', 'degenerate', 'free_fall', 'unknown')
State = int | NDArray[np.int8]
# Below this effective gravity (m/s2) the robot hardly presses on the ground: margins are unknown.
WEIGHTLESS = 1.0
_NONE = (math.nan,) * len(SIDES)


@dataclass(frozen=True, slots=True)
class Stance:
    """How a posture stands at any attitude: support polygon, centre of gravity and mass.

    One sample, or samples that share a polygon and the sides of its edges. `sides` is the side of
    each edge, a number in SIDES; `terms` the coordinates (m, `base_link`) of the centre of gravity
    and of the polygon's corners that move; `mass` in kg. `edges` holds the compiled margins; None
    if there are none, and then `state` says why.
    """

    support: Support
    sides: tuple[int, ...]
    terms: tuple[Number, ...]
    mass: Number
    state: int
    edges: Edges | None


@dataclass(frozen=True, slots=True)
class Stability:
    """Tip-over margins to each of SIDES: positive is stable, infinite on a side without an edge.

    `angle` (rad) is the force-angle, `moment` (N m) holds the robot down, `energy` (J) would lift
    it over the edge; `zmp` (m) is how far inside the polygon the zero-moment point lies, along the
    tracks' plane, NaN for an inverted robot. All are NaN for states from NO_CONTACT on.
    """

    angle: tuple[Number, ...]
    moment: tuple[Number, ...]
    energy: tuple[Number, ...]
    zmp: Number
    state: State


# The stability of a robot whose attitude nobody measures.
NOT_KNOWN = Stability(_NONE, _NONE, _NONE, math.nan, UNKNOWN)


@dataclass(frozen=True, slots=True, eq=False)
class Margins:
    """Static torques and tip angles of samples: what every sample of a recording is judged by.

    `torque` (..., j) is static, N m (N if prismatic); `angle` (..., 4) in rad to each of SIDES and
    `state` (...) are those of Stability.
    """

    torque: Floats
    angle: Floats
    state: NDArray[np.int8]


def stance_of(mechanics: Mechanics, posture: Posture) -> Stance:
    """Return the stance of one sample (a posture of floats)."""
    contacts: Any = posture.contacts
    cog: Any = posture.cog
    support = support_of(mechanics.robot, contacts, cog)
    state = _standing(support)
    if state >= NO_CONTACT:
        return Stance(support, (), (), posture.mass, state, None)
    corners = corners_of(mechanics, support.polygon)
    terms: tuple[float, ...] = cog
    for k in corners.moving:
        terms += contacts[k]
    sides = corners.sides or tuple([side_of(x, y) for x, y in corners.outward.one(*terms)])
    edges = edges_of(mechanics, corners, sides)
    return Stance(support, sides, terms, posture.mass, state, edges)


def stances_of(mechanics: Mechanics, posture: Posture, count: int) -> list[tuple[Rows, Stance]]:
    """Return the distinct stances of `count` samples (a posture of arrays), each with its rows."""
    found = supports_of(mechanics.robot, posture.contacts, posture.cog, count)
    return [part for rows, support in found for part in _stances(mechanics, posture, rows, support)]


def _stances(
    mechanics: Mechanics, posture: Posture, rows: Rows, support: Support
) -> Iterator[tuple[Rows, Stance]]:
    """Yield the stances of rows that share a support polygon, one for each set of edge sides."""
    state = _standing(support)
    mass = pick(posture.mass, rows)
    if state >= NO_CONTACT:
        yield rows, Stance(support, (), (), mass, state, None)
        return
    corners = corners_of(mechanics, support.polygon)
    moving = (x for k in corners.moving for x in posture.contacts[k])
    terms = pick((*posture.cog, *moving), rows)
    sides = [side_of(x, y) for x, y in corners.outward.run(*terms)]
    base = len(SIDES)
    code = np.asarray(sum(side * base**k for k, side in enumerate(sides)), dtype=np.int64)
    for number, part, _ in groups(code.reshape(-1)):
        lie = tuple(number // base**k % base for k in range(len(sides)))
        edges = edges_of(mechanics, corners, lie)
        yield (
            inner(rows, part),
            Stance(support, lie, pick(terms, part), pick(mass, part), state, edges),
        )


def take_stance(stance: Stance, rows: Rows) -> Stance:
    """Return a stance of the given rows of a stance of arrays; rows may repeat."""
    terms, mass = pick((stance.terms, stance.mass), rows)
    return Stance(stance.support, stance.sides, terms, mass, stance.state, stance.edges)


def _standing(support: Support) -> int:
    if support.polygon:
        return RAISED if support.raised else STANDING
    if not support.known:
        return UNKNOWN
    return DEGENERATE if support.standing >= 3 else NO_CONTACT


def stability_of(stance: Stance, gravity: Triple) -> Stability:
    """Return all margins of a stance under the effective `gravity` (m/s2): floats or arrays."""
    state = _state(stance.state, gravity)
    if stance.edges is None or (isinstance(state, int) and state >= FREE_FALL):
        return Stability(_NONE, _NONE, _NONE, math.nan, state)
    run = stance.edges.margins.run
    angle, moment, energy, zmp = run(*stance.terms, stance.mass, *gravity)
    if isinstance(state, int):
        return Stability(angle, moment, energy, math.nan if state == INVERTED else zmp, state)
    zmp = np.where(state == INVERTED, math.nan, zmp)
    none = state >= FREE_FALL
    if none.any():
        angle, moment, energy = (_without(none, part) for part in (angle, moment, energy))
        zmp = np.where(none, math.nan, zmp)
    return Stability(angle, moment, energy, zmp, state)


def tip_angles_of(stance: Stance, gravity: Triple) -> tuple[tuple[Number, ...], State]:
    """Return tip angle (rad) to each of SIDES and state: the part of `stability_of` needed live."""
    state = _state(stance.state, gravity)
    if stance.edges is None or (isinstance(state, int) and state >= FREE_FALL):
        return _NONE, state
    angle = stance.edges.angles.run(*stance.terms, stance.mass, *gravity)
    if not isinstance(state, int) and (state >= FREE_FALL).any():
        angle = _without(state >= FREE_FALL, angle)
    return angle, state


def _without(none: NDArray[np.bool_], values: Sequence[Number]) -> tuple[Number, ...]:
    return tuple(np.where(none, math.nan, x) for x in values)


def _state(standing: int, gravity: Triple) -> State:
    gx, gy, gz = gravity
    square = gx * gx + gy * gy + gz * gz
    if isinstance(square, float):
        if standing == UNKNOWN or not square < math.inf:
            return UNKNOWN
        if square < WEIGHTLESS**2:
            return FREE_FALL
        return INVERTED if gz >= 0.0 and standing < NO_CONTACT else standing
    state = np.full(len(square), standing, dtype=np.int8)
    if standing == UNKNOWN:
        return state
    if standing < NO_CONTACT:
        state[np.greater_equal(gz, 0.0)] = INVERTED
    state[square < WEIGHTLESS**2] = FREE_FALL
    state[~(square < math.inf)] = UNKNOWN
    return state


def stability(
    robot: Robot,
    q: ArrayLike,
    gravity: ArrayLike,
    payload: Payload | None = None,
    workers: int = 1,
) -> Stability:
    """Return all tip-over margins for postures `q` (..., j) under gravity (..., 3).

    Each array has shape (...); a payload left out is the robot's own; `workers` is threads.
    """
    mechanics, load = mechanics_of(robot), payload or robot.payload
    n = len(robot.joint_names)

    def block(*columns: Values) -> Sequence[Floats]:
        posture = posture_of(mechanics, columns[:n], load.mass, load.cog)

        def values(stance: Stance, gravity: Triple) -> Sequence[Number | State]:
            found = stability_of(stance, gravity)
            return (*found.angle, *found.moment, *found.energy, found.zmp, found.state)

        return _table(mechanics, posture, columns[n:], values, 14)

    parts = tuple(np.moveaxis(in_blocks(block, 14, q, gravity, workers=workers), -1, 0))
    return Stability(parts[0:4], parts[4:8], parts[8:12], parts[12], parts[13].astype(np.int8))


def margins(
    robot: Robot,
    q: ArrayLike,
    gravity: ArrayLike,
    payload: Payload | None = None,
    workers: int = 1,
) -> Margins:
    """Return static torques and tip angles for postures `q` (..., j) under gravity (..., 3).

    Joints that carry the robot have the ground's reaction in theirs, evenly spread. A payload left
    out is the robot's own; `workers` is threads.
    """
    mechanics, load = mechanics_of(robot), payload or robot.payload
    n = len(robot.joint_names)

    def block(*columns: Values) -> Sequence[Number]:
        torque, *rest = mechanics.holding.run(*columns[:n], load.mass, *load.cog, *columns[n:])
        posture = Posture((), *rest)

        def values(stance: Stance, gravity: Triple) -> Sequence[Number | State]:
            angle, state = tip_angles_of(stance, gravity)
            return (*angle, state)

        held = np.array([np.broadcast_to(tau, columns[n].shape) for tau in torque])
        return [*held, *_table(mechanics, posture, columns[n:], values, 5, held)]

    found = in_blocks(block, n + 5, q, gravity, workers=workers)
    state = found[..., n + 4].astype(np.int8)
    return Margins(found[..., :n], found[..., n : n + 4], state)


def _table(
    mechanics: Mechanics,
    posture: Posture,
    gravity: tuple[Floats, ...],
    values: Callable[[Stance, Any], Sequence[Number | State]],
    width: int,
    held: Floats | None = None,
) -> list[Floats]:
    """Return `values(stance, gravity)` of every sample: `width` arrays of one number a sample.

    Adds the ground's reaction to the torques `held` (j, n) of hanging joints.
    """
    gx, *_ = gravity
    table = np.empty((width, len(gx)))
    for rows, stance in stances_of(mechanics, posture, len(gx)):
        down = pick(gravity, rows)
        if held is not None:
            carry(held, rows, posture, rows, mechanics, stance.support.polygon, down)
        found = values(stance, down)
        for k, value in enumerate(found):
            table[k, rows] = value
    return list(table)
