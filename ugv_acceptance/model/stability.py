"""Tip-over margins of a robot that stands on its contact points: one sample or many.

The stance (stances.py) that gravity decides on has the margins about its edges (edges.py). All hold
for any effective gravity (m/s2, `base_link`); with an accelerometer in place of gravity it is minus
the specific force.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ugv_acceptance.model.blocks import in_blocks
from ugv_acceptance.model.edges import SIDES
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
from ugv_acceptance.model.row_selection import Values, pick
from ugv_acceptance.model.stances import (
    DEGENERATE,
    FREE_FALL,
    INVERTED,
    NO_CONTACT,
    RAISED,
    STANDING,
    UNKNOWN,
    Stance,
    angles_on,
    many_stances,
    many_standing,
    stances_of,
    standing,
    take_stance,
)
from ugv_acceptance.type_aliases import Floats

__all__ = [
    'DEGENERATE',
    'FREE_FALL',
    'INVERTED',
    'NO_CONTACT',
    'RAISED',
    'SIDES',
    'STANDING',
    'STATES',
    'UNKNOWN',
    'Margins',
    'Stability',
    'Stance',
    'many_stances',
    'many_standing',
    'stances_of',
    'standing',
    'take_stance',
]

STATES = ('standing', 'raised', 'inverted', 'no_contact', 'degenerate', 'free_fall', 'unknown')
State = int | NDArray[np.int8]
# Below this effective gravity (m/s2) the robot hardly presses on the ground: margins are unknown.
WEIGHTLESS = 1.0
_NONE = (math.nan,) * len(SIDES)


class Stability(NamedTuple):
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


def stability_of(stance: Stance, gravity: Triple) -> Stability:
    """Return all margins of a stance under the effective `gravity` (m/s2): floats or arrays."""
    state = _state(stance.state, gravity)
    if stance.edges is None or (isinstance(state, int) and state >= FREE_FALL):
        return Stability(_NONE, _NONE, _NONE, math.nan, state)
    rocking = (stance.rocking,) if stance.edges.rocks else ()
    run = stance.edges.margins.run
    angle, moment, energy, zmp = run(*stance.terms, stance.mass, *gravity, *rocking)
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
    angle = angles_on(stance, gravity)
    if not isinstance(state, int) and (state >= FREE_FALL).any():
        angle = _without(state >= FREE_FALL, angle)
    return angle, state


def tip_angles_at(stance: Stance, gravity: tuple[float, float, float]) -> tuple[Any, int]:
    """Return `tip_angles_of` of numbers, without asking whether there are arrays among them."""
    state: Any = _state(stance.state, gravity)
    edges: Any = stance.edges
    if edges is None or state >= FREE_FALL:
        return _NONE, state
    rocking = (stance.rocking,) if edges.rocks else ()
    return edges.angles.one(*stance.terms, stance.mass, *gravity, *rocking), state


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
    gravity: Any,  # noqa: ANN401 - three arrays
    values: Callable[[Stance, Any], Sequence[Number | State]],
    width: int,
    held: Floats | None = None,
) -> list[Floats]:
    """Return `values(stance, gravity)` of every sample: `width` arrays of one number a sample.

    Adds the ground's reaction to the torques `held` (j, n) of hanging joints.
    """
    gx, *_ = gravity
    table, count = np.empty((width, len(gx))), len(gx)
    stances = many_stances(mechanics, posture, count)
    for rows, stance in many_standing(stances, count, np.arange(count), gravity):
        down = pick(gravity, rows)
        if held is not None:
            carry(held, rows, posture, rows, mechanics, stance.points, down)
        found = values(stance, down)
        for k, value in enumerate(found):
            table[k, rows] = value
    return list(table)
