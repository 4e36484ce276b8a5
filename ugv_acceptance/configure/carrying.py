"""What may carry a robot, and the contact points that are made of what does."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ugv_acceptance.configure.collision import Solid
from ugv_acceptance.configure.draft import (
    ASK,
    CERTAIN,
    CHECK,
    Contacts,
    Derived,
    DerivedContact,
)
from ugv_acceptance.configure.posture import Posture
from ugv_acceptance.model.hull import hull
from ugv_acceptance.model.resting import Face, lowest_of, resting_face
from ugv_acceptance.model.robot import Contact, Vector
from ugv_acceptance.type_aliases import Floats

UP: Floats = np.array([0.0, 0.0, 1.0])
# A geometry that reaches less (m) is a marker, no part.
MARKER = 0.002
# So near (m) the plane a part of the body carries.
NEAR = 0.003
# Names of corners by front and left.
_CORNERS = {
    (True, True): 'front_left',
    (True, False): 'front_right',
    (False, True): 'rear_left',
    (False, False): 'rear_right',
}


@dataclass(frozen=True, eq=False)
class Part:
    """What the robot may stand on: `points` gives its contact points (n, 3), m, for an up (3,).

    `link` is the link that the points belong to, `on` what carries there, for people, `stem` what
    the points are named after.
    """

    on: str
    link: str
    stem: str
    grade: str
    source: str
    points: Callable[[Floats], Floats]

    def lowest(self, up: Floats) -> Floats:
        """Return the lowest of its contact points (3,), m, along an upward unit vector (3,)."""
        points = self.points(up)
        found: Floats = points[int(np.argmin(points @ up))]
        return found

    def height(self, up: Floats) -> float:
        """Return the height (m) of its lowest point along an upward unit vector (3,)."""
        return float(self.lowest(up) @ up)


def stem_of(link: str) -> str:
    """Return what a link's contact points are named after."""
    return link.removesuffix('_link') or link


def caster_of(solid: Solid) -> Part:
    """Return a small thing fixed to the body as what carries: its lowest points, or the middle."""
    on, source, grade = f'caster {solid.link}', f'lowest of {solid.link}: {solid.words}', CERTAIN
    if solid.drawn:
        source, grade = f'{source}, as it is drawn: it has no collision geometry', CHECK

    patch = solid.patch(UP, NEAR)
    if solid.kind == 'sphere' or len(patch) <= 2:
        stem = stem_of(solid.link)
        return Part(on, solid.link, stem, grade, source, lambda up: solid.patch(up, NEAR))
    # Of an edge or a face the middle: what is drawn as a box is a ball or a wheel somewhere in it.
    middle: Floats = patch.mean(axis=0)[None]
    source = f'{source}, the middle of its underside'
    return Part(on, solid.link, stem_of(solid.link), CHECK, source, lambda _: middle)


def names_of(stem: str, points: Sequence[Floats]) -> list[str]:
    """Return the names of a wheel's points: outer and inner, or left and right in the middle."""
    if len(points) != 2:
        return corner_names(points, stem)
    a, b = (float(p[1]) for p in points)
    if a * b < 0.0:
        return [f'{stem}_{"left" if y > 0.0 else "right"}' for y in (a, b)]
    if abs(abs(a) - abs(b)) < 1e-6:
        return [f'{stem}_1', f'{stem}_2']
    return [f'{stem}_{"outer" if abs(y) == max(abs(a), abs(b)) else "inner"}' for y in (a, b)]


@dataclass
class Notes:
    """What is to be said of contact points that are being derived: questions and remarks.

    `swivels` is by how much (m) joints without end move points at most.
    """

    questions: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    swivels: dict[str, float] = field(default_factory=dict)


def mm(length: float) -> str:
    """Return a length (m) in mm, for people."""
    return f'{1e3 * length:.1f} mm'


def listed(names: Sequence[str]) -> str:
    """Return names as a list for people: the first six of many."""
    some = list(dict.fromkeys(names))
    return ', '.join(some[:6]) + (f' and {len(some) - 6} more' if len(some) > 6 else '')


def face_of(parts: Sequence[Part], at: Floats, up: Floats = UP) -> Face | None:
    """Return the face of what may carry below a place, the centre of gravity; None if none is.

    A wheel carries below its axle only, seen along `up`: it would roll from under any other point.
    """
    points = [_vector(point) for part in parts for point in part.points(up)]
    return resting_face(lowest_of(points), at.tolist()) if points else None


def face_of_solids(solids: Sequence[Solid], at: Floats) -> Face | None:
    """Return the face of geometry below a place, the centre of gravity; None if there is none."""

    def lowest(up: Vector) -> Vector:
        direction = np.array(up)
        return _vector(
            min((s.lowest(direction) for s in solids), key=lambda p: float(p @ direction))
        )

    return resting_face(lowest, at.tolist()) if solids else None


def outline(points: Sequence[Floats]) -> tuple[int, ...]:
    """Return the convex outline of points (m) as seen from above, by number; () if it is thin."""
    return hull(tuple(_vector(p) for p in points), tuple(range(len(points))))


def outside(points: Sequence[Floats], at: Floats) -> float:
    """Return how far (m) a place is outside of the outline of points; negative inside."""
    cycle = outline(points)
    furthest = -math.inf
    for a, b in zip(cycle, (*cycle[1:], *cycle[:1]), strict=True):
        way = points[b] - points[a]
        square = np.array([way[1], -way[0]]) / float(np.hypot(way[0], way[1]))
        furthest = max(furthest, float(square @ (at - points[a])[:2]))
    return furthest


def corner_names(points: Sequence[Floats], stem: str) -> list[str]:
    """Return names for corners: by front and left where that tells four apart, else numbered."""
    middle = np.mean(points, axis=0)
    names = [_CORNERS[bool(p[0] > middle[0]), bool(p[1] > middle[1])] for p in points]
    if len(points) == 4 and len(set(names)) == 4:
        return names
    return [f'{stem}_{k + 1}' for k in range(len(points))] if len(points) > 1 else [stem]


def contacts_of(
    posture: Posture, found: Sequence[DerivedContact], face: Face | None, notes: Notes
) -> Contacts:
    """Return the contact points with the ground under them, and what was said of them."""
    points, taken = [], set[str]()
    for one in found:
        name, k = one.contact.name, 2
        while name in taken:
            name, k = f'{one.contact.name}_{k}', k + 1
        taken.add(name)
        contact = Contact(name, one.contact.link, one.contact.position)
        points.append(DerivedContact(contact, one.grade, one.source, one.on))
    if posture.mass == 0.0:
        notes.remarks.append('the URDF gives no masses: the middle of its geometry is taken as '
                             'the centre of gravity')  # fmt: skip
        points = [_doubted(one) for one in points]
    return Contacts(
        tuple(points),
        _ground(posture, points),
        0.0 if face is None else face.tilt,
        0.0 if face is None else face.heading,
        ' '.join(notes.questions),
        tuple(notes.remarks),
        tuple(notes.swivels.items()),
    )


def _doubted(one: DerivedContact) -> DerivedContact:
    grade = CHECK if one.grade == CERTAIN else one.grade
    return DerivedContact(one.contact, grade, one.source, one.on)


def _ground(posture: Posture, points: Sequence[DerivedContact]) -> Derived[float]:
    if not points:
        return Derived(None, ASK, 'no contact point is known')
    heights = []
    for one in points:
        rotation, origin = posture.frames[one.contact.link]
        heights.append(float((origin + rotation @ np.array(one.contact.position))[2]))
    grades = {one.grade for one in points}
    grade = next(grade for grade in (ASK, CHECK, CERTAIN) if grade in grades)
    return Derived(round(min(heights), 6) + 0.0, grade, 'the lowest contact point')


def _vector(point: Floats) -> Vector:
    x, y, z = point.tolist()
    return x, y, z
