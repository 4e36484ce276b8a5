"""Tip-over margins of a robot that stands on its contact points: one sample or many.

A stance is one way to stand that joints and payload allow, on one of the footings of support.py.
Gravity then gives the margins about its edges (edges.py), and decides which stance it is: the one
whose least margin is largest. All hold for any effective gravity (m/s2, `base_link`); with an
accelerometer in place of gravity it is minus the specific force.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce
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
from ugv_acceptance.model.support import ALL, MOST, Footing, footings_of, many_footings
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
    """One way to stand in a posture, at any attitude: footing, centre of gravity and mass.

    One sample, or samples that share a footing's polygon and the sides of its edges. `sides` is the
    side of each edge, a number in SIDES; `terms` the coordinates (m, `base_link`) of the centre of
    gravity and of the polygon's corners that move; `mass` in kg. `footing` and `edges`, the
    compiled margins, are None if it cannot stand, and then `state` says why.
    """

    footing: Footing | None
    sides: tuple[int, ...]
    terms: tuple[Number, ...]
    mass: Number
    state: int
    edges: Edges | None

    @property
    def points(self) -> tuple[int, ...]:
        """Numbers of the contacts that carry: none without a footing."""
        return self.footing.points if self.footing else ()

    @property
    def ground_face(self) -> tuple[int, int, int] | None:
        """Numbers of three contacts in whose plane the ground is; None: the tracks' plane."""
        return self.footing.face if self.footing and self.footing.raised else None

    @property
    def rocking(self) -> Number:
        """Rocking of its footing (rad): 0 without one."""
        return self.footing.rocking if self.footing else 0.0


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


def stances_of(mechanics: Mechanics, posture: Posture) -> tuple[Stance, ...]:
    """Return the ways to stand in one posture (of floats), the least rocking first; at least one.

    One without edges if it cannot stand at all.
    """
    contacts: Any = posture.contacts
    cog: Any = posture.cog
    if not math.isfinite(sum(map(sum, contacts), sum(cog))):
        return (Stance(None, (), (), posture.mass, UNKNOWN, None),)
    footings = footings_of(mechanics, contacts)
    if not footings:
        return (Stance(None, (), (), posture.mass, _nowhere(contacts), None),)
    return tuple([_stance(mechanics, posture, footing) for footing in footings])


def _stance(mechanics: Mechanics, posture: Posture, footing: Footing) -> Stance:
    corners = corners_of(mechanics, footing.polygon)
    terms: Any = posture.cog
    for k in corners.moving:
        terms += posture.contacts[k]
    sides = corners.sides or tuple([side_of(x, y) for x, y in corners.outward.one(*terms)])
    edges = edges_of(mechanics, corners, sides, rocks=footing.rocking != 0.0)
    return Stance(footing, sides, terms, posture.mass, _state_on(footing), edges)


def _nowhere(contacts: Sequence[Any]) -> int:
    return DEGENERATE if len(contacts) >= 3 else NO_CONTACT


def _state_on(footing: Footing) -> int:
    return RAISED if footing.raised else STANDING


def standing(stances: Sequence[Stance], gravity: Triple) -> Stance:
    """Return in which of the stances of one posture it stands under `gravity` (three floats)."""
    best = stances[0]
    if len(stances) == 1:
        return best
    least = -math.inf
    for stance in stances:
        rocking: Any = stance.rocking
        if MOST - rocking <= least:
            break
        found = min(_angles(stance, gravity))
        if found > least:
            best, least = stance, found
    return best


def _angles(stance: Stance, gravity: Triple) -> tuple[Any, ...]:
    """Return the tip angle (rad) to each of SIDES of a stance with edges."""
    edges: Any = stance.edges
    rocking = (stance.rocking,) if edges.rocks else ()
    found: tuple[Any, ...] = edges.angles.run(*stance.terms, stance.mass, *gravity, *rocking)
    return found


def many_stances(mechanics: Mechanics, posture: Posture, count: int) -> list[tuple[Rows, Stance]]:
    """Return the stances of `count` samples (a posture of arrays), each with its rows.

    The least rocking first. A row has several where points are near a face, and at least one.
    """
    contacts, cog = posture.contacts, posture.cog
    finite = np.broadcast_to(np.isfinite(sum(map(sum, contacts), sum(cog))), count)
    rows: Rows = ALL
    found: list[tuple[Rows, Stance]] = []
    if not finite.all():
        lost, rows = np.flatnonzero(~finite), np.flatnonzero(finite)
        stance = Stance(None, (), (), pick(posture.mass, lost), UNKNOWN, None)
        found = [(lost, stance)]
        count = len(rows)
    if not count:
        return found
    feet = many_footings(mechanics, pick(contacts, rows), count)
    stands = np.zeros(count, np.bool_)
    for some, footing in feet:
        stands[some] = True
        of = inner(rows, some)
        for part, stance in _sided(mechanics, posture, of, footing):
            found.append((inner(of, part), stance))
    if not stands.all():
        of = inner(rows, ALL if not stands.any() else np.flatnonzero(~stands))
        state = _nowhere(contacts)
        found.append((of, Stance(None, (), (), pick(posture.mass, of), state, None)))
    return found


def _sided(
    mechanics: Mechanics, posture: Posture, rows: Rows, footing: Footing
) -> Iterator[tuple[Rows, Stance]]:
    """Yield the stances of rows that share a footing, one for each set of edge sides."""
    mass = pick(posture.mass, rows)
    corners = corners_of(mechanics, footing.polygon)
    moving = (x for k in corners.moving for x in posture.contacts[k])
    terms = pick((*posture.cog, *moving), rows)
    sides = [side_of(x, y) for x, y in corners.outward.run(*terms)]
    base = len(SIDES)
    code = np.asarray(sum(side * base**k for k, side in enumerate(sides)), dtype=np.int64)
    rocks = isinstance(footing.rocking, np.ndarray) or footing.rocking != 0.0
    for number, part, _ in groups(code.reshape(-1)):
        lie = tuple(number // base**k % base for k in range(len(sides)))
        edges = edges_of(mechanics, corners, lie, rocks=rocks)
        some = replace(footing, rocking=pick(footing.rocking, part))
        at, weight = pick((terms, mass), part)
        yield part, Stance(some, lie, at, weight, _state_on(footing), edges)


def take_stance(stance: Stance, rows: Rows) -> Stance:
    """Return a stance of the given rows of a stance of arrays; rows may repeat."""
    if isinstance(rows, slice):
        return stance
    terms, mass, rocking = pick((stance.terms, stance.mass, stance.rocking), rows)
    footing = stance.footing and replace(stance.footing, rocking=rocking)
    return replace(stance, footing=footing, terms=terms, mass=mass)


def many_standing(
    stances: Sequence[tuple[Rows, Stance]], count: int, j: NDArray[np.intp], gravity: Triple
) -> Iterator[tuple[Rows, Stance]]:
    """Yield in which stance each of m samples stands under `gravity` (three arrays (m,)).

    `stances` are those of `count` postures (see `many_stances`), `j` (m,) is each sample's posture.
    Every sample is in one of the yielded rows.
    """
    if len(stances) == 1 and stances[0][0] is ALL:
        yield ALL, take_stance(stances[0][1], j)
        return
    ways, only = np.zeros(count, np.intp), np.full(count, -1)
    for number, (rows, _) in reversed(list(enumerate(stances))):
        ways[rows] += 1
        only[rows] = number
    choice, place = only[j], np.empty(count, np.intp)
    several = np.flatnonzero((ways > 1)[j])
    least = np.full(len(several), -np.inf)
    for number, (rows, stance) in enumerate(stances if len(several) else ()):
        at = _places(place, rows)[j[several]]
        some = np.flatnonzero(at >= 0)
        if not len(some):
            continue
        taken = take_stance(stance, at[some])
        angles = _angles(taken, pick(gravity, several[some]))
        found = np.broadcast_to(reduce(np.minimum, angles), len(some))
        better = found > least[some]
        least[some[better]], choice[several[some[better]]] = found[better], number
    for number, (rows, stance) in enumerate(stances):
        mine = np.flatnonzero(choice == number)
        if len(mine):
            yield mine, take_stance(stance, _places(place, rows)[j[mine]])


def _places(place: NDArray[np.intp], rows: Rows) -> NDArray[np.intp]:
    """Set at which place each number stands among `rows` in `place`, -1 for others; return it."""
    place.fill(-1)
    place[rows] = np.arange(len(place))[: len(place[rows])]
    return place


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
    angle = _angles(stance, gravity)
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
