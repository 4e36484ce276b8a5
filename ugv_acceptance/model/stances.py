"""The ways to stand that joint positions and payload allow: one sample or many.

A stance is one of them, on one of the footings of support.py. Gravity decides which it is: the one
whose least tip angle (edges.py) is largest.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache, reduce
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.model.edges import SIDES, Edges, corners_of, edges_of, side_of
from ugv_acceptance.model.expressions import Number
from ugv_acceptance.model.feet import feet_of
from ugv_acceptance.model.mechanics import Mechanics, Posture, Triple
from ugv_acceptance.model.row_selection import Rows, groups, inner, pick
from ugv_acceptance.model.support import ALL, MOST, Footing, footings_of, many_footings

# States of a stability sample; from NO_CONTACT on, there is no margin.
STANDING, RAISED, INVERTED, NO_CONTACT, DEGENERATE, FREE_FALL, UNKNOWN = range(7)


class Stance(NamedTuple):
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
    if footings is feet_of(mechanics).alone:
        footing, sides, _, _, state, edges = _on_tracks(mechanics)
        return (Stance(footing, sides, posture.cog, posture.mass, state, edges),)
    return tuple([_stance(mechanics, posture, footing) for footing in footings])


@lru_cache(maxsize=64)
def _on_tracks(mechanics: Mechanics) -> Stance:
    """Return how a robot stands whose level tracks alone carry it; but for what moves."""
    (footing,) = feet_of(mechanics).alone
    corners = corners_of(mechanics, footing.polygon)
    assert corners.sides is not None  # noqa: S101 - for the type checker: tracks do not move
    edges = edges_of(mechanics, corners, corners.sides)
    return Stance(footing, corners.sides, (), math.nan, _state_on(footing), edges)


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
        found = min(angles_on(stance, gravity))
        if found > least:
            best, least = stance, found
    return best


def angles_on(stance: Stance, gravity: Triple) -> tuple[Any, ...]:
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
    return stance._replace(footing=footing, terms=terms, mass=mass)


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
        angles = angles_on(taken, pick(gravity, several[some]))
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
