"""Contact points of a robot without wheels: tracks and skids of its body, feet, or nothing."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ugv_acceptance.configure.carrying import (
    MARKER,
    NEAR,
    Notes,
    contacts_of,
    corner_names,
    face_of_solids,
    listed,
    mm,
    outline,
    outside,
    stem_of,
)
from ugv_acceptance.configure.collision import Solid
from ugv_acceptance.configure.draft import ASK, CERTAIN, CHECK, Contacts, DerivedContact
from ugv_acceptance.configure.flippers import say_flippers
from ugv_acceptance.configure.posture import Posture
from ugv_acceptance.configure.rolling import endless
from ugv_acceptance.model.resting import Face
from ugv_acceptance.model.robot import Contact
from ugv_acceptance.type_aliases import Floats

# So near (m) the plane a foot carries, as its joints yield; and a foot of the same build in the air
# is still one.
NEAR_FOOT, LIFTED = 0.010, 0.15
# Parts of one leg carry within this (m) of its lowest; an underside has so many corners at most.
SAME, MOST = 0.001, 8
# A tilt (rad) of the feet's plane that is asked about, as it follows the joints.
LEANS = math.radians(5.0)
# A base whose foot is less than this share of the robot's reach carries an arm alone.
FOOT = 0.3


def stands_on_geometry(posture: Posture, notes: Notes) -> Contacts:
    """Return the contact points of a robot that stands on no wheels."""
    solids = [solid for solid in posture.solids if solid.reach > MARKER]
    base = set(posture.rigid(posture.root))
    if _is_arm(posture, solids, base):
        notes.questions.append(
            f'No wheels, feet or tracks were found under {posture.root}, only an arm: '
            'what is it mounted on?'
        )
        return contacts_of(posture, (), None, notes)
    face, tracks = face_of_solids(solids, posture.cog), _tracks(solids, base)
    if tracks is not None and len(_touching(posture, solids, base, face)) < 2:
        _ask_unread(posture, base, notes)
        _say_of_arm(posture, solids, base, tracks[0], notes)
        return _on_body(posture, tracks[1], tracks[0], notes)
    if face is None:
        if solids:
            notes.questions.append(
                'The centre of gravity is not above any geometry that was read: '
                'what does the robot stand on?'
            )
        _ask_unread(posture, set(posture.frames) if not solids else base, notes)
        return contacts_of(posture, (), None, notes)
    up = np.array(face.normal)
    above = {id(s): face.height(s.lowest(up).tolist()) for s in solids}
    of_base = [s for s in solids if s.link in base and above[id(s)] <= NEAR]
    of_limbs = [s for s in solids if s.link not in base and above[id(s)] <= NEAR_FOOT]
    if not of_limbs:
        _ask_unread(posture, base, notes)
        return _on_body(posture, of_base, face, notes)
    if of_base:
        notes.questions.append(
            f'In this posture {listed([s.link for s in of_base])} of the body touches the ground '
            f'beside {listed([s.link for s in of_limbs])}: which of them carry? Give the posture '
            'in which the robot stands.'
        )
    return _on_feet(posture, solids, above, face, notes)


def _tracks(solids: Sequence[Solid], base: set[str]) -> tuple[Face, list[Solid]] | None:
    """Return what of the body lies apart on both sides and carries it without its arm, if so."""
    own = [solid for solid in solids if solid.link in base]
    if not own:
        return None
    face = face_of_solids(own, _centre(own))
    if face is None:
        return None
    up = np.array(face.normal)
    near = [solid for solid in own if face.height(solid.lowest(up).tolist()) <= NEAR]
    return (face, near) if _sides(near) else None


def _centre(solids: Sequence[Solid]) -> Floats:
    """Return the middle (3,), m, of the extent of geometry along the axes."""
    ends = [[s.lowest(sign * axis) for s in solids] for axis in np.eye(3) for sign in (1.0, -1.0)]
    points = np.concatenate(ends)
    middle: Floats = (points.min(axis=0) + points.max(axis=0)) / 2.0
    return middle


def _touching(
    posture: Posture, solids: Sequence[Solid], base: set[str], face: Face | None
) -> set[str]:
    """Return the joints at the body of the limbs that touch the plane of a face."""
    if face is None:
        return set()
    up, found = np.array(face.normal), set()
    for solid in solids:
        if solid.link not in base and face.height(solid.lowest(up).tolist()) <= NEAR_FOOT:
            found.add(posture.chain(solid.link)[0].name)
    return found


def _say_of_arm(
    posture: Posture, solids: Sequence[Solid], base: set[str], face: Face, notes: Notes
) -> None:
    """Ask about what reaches below the plane of the tracks; say if the arm would tip the robot."""
    up = np.array(face.normal)
    for solid in solids:
        low = face.height(solid.lowest(up).tolist())
        if solid.link not in base and low < -NEAR:
            notes.questions.append(
                f'In this posture {solid.link} is {mm(-low)} below the ground on which the tracks '
                'stand: does the robot stand on it, or is the posture another?'
            )
    corners = [p for s in solids if s.link in base for p in s.patch(up, NEAR)]
    corners = [p for p in corners if face.height(p.tolist()) <= NEAR]
    off = outside(corners, posture.cog)
    if off > 0.0:
        notes.remarks.append(
            f'in this posture the centre of gravity is {mm(off)} outside of what the tracks carry'
        )


def _is_arm(posture: Posture, solids: Sequence[Solid], base: set[str]) -> bool:
    """Return whether this is an arm: most of it moves, in one chain, and its foot is small."""
    chains = [posture.chain(link) for link in posture.frames]
    longest = max(chains, key=len)
    if len(longest) < 3 or any(chain and chain[0] is not longest[0] for chain in chains):
        return False
    still = sum(link.mass for link in posture.urdf.links if link.name in base)
    own = [solid for solid in solids if solid.link in base]
    if not own or posture.root in ('world', 'map'):
        return not own or still <= posture.mass / 2.0
    foot = float(np.ptp([s.middle for s in own], axis=0)[:2].max() / 2.0)
    foot += max(s.reach for s in own)
    reach = sum(float(np.linalg.norm(joint.xyz)) for joint in longest[1:])
    return still < posture.mass / 2.0 and foot < FOOT * reach


def _ask_unread(posture: Posture, links: set[str], notes: Notes) -> None:
    """Ask for geometry of these links that was not read: it may be what carries."""
    known = {solid.link for solid in posture.solids}
    missing = [u for u in posture.unread if not u.drawn or u.link not in known]
    asked = [u for u in missing if u.link in links]
    if not missing and not posture.solids:
        notes.questions.append('The URDF has no geometry: what does the robot stand on?')
    if asked:
        notes.questions.append(
            f'Geometry of {listed([u.link for u in asked])} was not read '
            f'({asked[0].what}: {asked[0].why}): does the robot stand on it?'
        )


def _on_body(posture: Posture, solids: Sequence[Solid], face: Face, notes: Notes) -> Contacts:
    """Return the corners of what the body stands on: ends of tracks, skids, its underside."""
    up = np.array(face.normal)
    owners: list[Solid] = []
    points: list[Floats] = []
    for solid in solids:
        for point in solid.patch(up, NEAR):
            if face.height(point.tolist()) <= NEAR:
                owners.append(solid)
                points.append(point)
    cycle = fewer(points, outline(points))
    sides = _sides(solids)
    what, grade = ('track', CHECK) if sides else ('body', ASK)
    if not sides:
        notes.questions.append(
            f'No wheels, feet or tracks were found; the lowest is the underside of '
            f'{listed([s.link for s in solids])}: does the robot stand on its corners?'
        )
    if face.tilt > TILT:
        notes.questions.append(tilt_question(face, posture.root))
    corners = [points[k] for k in cycle]
    names = corner_names(corners, stem_of(owners[0].link))
    found = []
    for name, k in zip(names, cycle, strict=True):
        solid = owners[k]
        drawn = ', as it is drawn: it has no collision geometry' if solid.drawn else ''
        source = f'lowest of {solid.link}: {solid.words}{drawn}'
        contact = Contact(name, solid.link, posture.in_link(solid.link, points[k]))
        found.append(DerivedContact(contact, grade, source, f'{what} {solid.link}'))
    say_flippers(posture, face, notes)
    return contacts_of(posture, found, face, notes)


def _sides(solids: Sequence[Solid]) -> bool:
    """Return whether geometry lies apart on both sides of its middle, as tracks do."""
    middle = float(_centre(solids)[1])
    extents = [_extent(solid) for solid in solids]
    return (
        any(low > middle for low, _ in extents)
        and any(high < middle for _, high in extents)
        and all(low > middle or high < middle for low, high in extents)
    )


def _extent(solid: Solid) -> tuple[float, float]:
    """Return the least and largest y (m) of a solid."""
    side = np.array([0.0, 1.0, 0.0])
    return float(solid.lowest(side)[1]), float(solid.lowest(-side)[1])


def fewer(points: Sequence[Floats], cycle: Sequence[int], most: int = MOST) -> list[int]:
    """Return at most `most` corners of an outline, those that matter most: it only shrinks."""
    left = list(cycle)
    while len(left) > most:
        areas = [
            abs(_area(points[left[k - 1]], points[left[k]], points[left[(k + 1) % len(left)]]))
            for k in range(len(left))
        ]
        left.pop(areas.index(min(areas)))
    return left


def _area(a: Floats, b: Floats, c: Floats) -> float:
    u, v = b - a, c - a
    return float(u[0] * v[1] - u[1] * v[0])


def _on_feet(
    posture: Posture,
    solids: Sequence[Solid],
    above: dict[int, float],
    face: Face,
    notes: Notes,
) -> Contacts:
    """Return the lowest points of the legs that stand, and of legs of the same build in the air."""
    up, limbs = np.array(face.normal), _limbs(posture, solids)
    soles: list[tuple[Solid, float]] = []
    for own in limbs.values():
        low = min(above[id(s)] for s in own)
        soles += [(s, above[id(s)]) for s in own if low <= LIFTED and above[id(s)] <= low + SAME]
    standing = [solid for solid, high in soles if high <= NEAR_FOOT]
    builds = {_build(posture, solid) for solid in standing}
    found = []
    for solid, high in soles:
        if high <= NEAR_FOOT or _build(posture, solid) in builds:
            found += _sole(posture, solid, high, up)
    if _ask_of_legs(posture, standing, face, notes):
        found = [replace(one, grade=CHECK) for one in found]
    unread = [u for u in posture.unread if not u.drawn]
    if unread:
        notes.remarks.append(
            f'geometry of {listed([u.link for u in unread])} was not read '
            f'({unread[0].what}: {unread[0].why}); the feet carry without it'
        )
    return contacts_of(posture, found, face, notes)


def _limbs(posture: Posture, solids: Sequence[Solid]) -> dict[str, list[Solid]]:
    """Return the geometry of each limb, by the joint at the body that moves it."""
    limbs: dict[str, list[Solid]] = {}
    for solid in solids:
        chain = posture.chain(solid.link)
        if chain:
            limbs.setdefault(chain[0].name, []).append(solid)
    return limbs


def _build(posture: Posture, solid: Solid) -> tuple[object, ...]:
    kinds = tuple(joint.kind for joint in posture.chain(solid.link))
    return (solid.kind, tuple(np.round(solid.size, 4).tolist()), kinds)


def _sole(posture: Posture, solid: Solid, high: float, up: Floats) -> list[DerivedContact]:
    """Return the contact points of a foot: its lowest, or the corners of a flat sole."""
    patch = list(solid.patch(up, SAME))
    cycle = fewer(patch, outline(patch), 4) if len(patch) > 2 else list(range(len(patch)))
    points = [patch[k] for k in cycle] or [solid.lowest(up)]
    source, grade = f'lowest of {solid.link}: {solid.words}', CERTAIN
    if solid.drawn:
        source, grade = f'{source}, as it is drawn: it has no collision geometry', CHECK
    if high > SAME:
        source, grade = f'{source}, {mm(high)} above the plane of the others here', CHECK
    return [
        DerivedContact(
            Contact(name, solid.link, posture.in_link(solid.link, point)),
            grade,
            source,
            f'foot {solid.link}',
        )
        for name, point in zip(corner_names(points, stem_of(solid.link)), points, strict=True)
    ]


def _ask_of_legs(posture: Posture, standing: Sequence[Solid], face: Face, notes: Notes) -> bool:
    """Ask what is doubtful of legs; return whether anything is."""
    before = len(notes.questions)
    joints = {joint.name: joint for s in standing for joint in posture.chain(s.link)}
    if not any(posture.positions.get(name, 0.0) for name in joints):
        wrong = [j.name for j in joints.values() if not j.lower <= 0.0 <= j.upper]
        beyond = f', which is outside of the limits of {listed(wrong)}' if wrong else ''
        notes.questions.append(
            f'The legs were taken as they are with every joint at 0{beyond}: is that how the robot '
            'stands? A recording of it standing tells its posture.'
        )
    spinning = [j.name for j in joints.values() if endless(j)]
    if spinning:
        notes.questions.append(
            f'{listed(spinning)} turns without end what touches the ground, which is not round '
            'about it: does the robot stand on that?'
        )
    if len({posture.chain(s.link)[0].name for s in standing}) < 2:
        notes.questions.append(
            f'Only {listed([s.link for s in standing])} touches the ground: '
            'does the robot stand on that alone?'
        )
    if face.tilt > LEANS:
        notes.questions.append(tilt_question(face, posture.root))
    return len(notes.questions) > before


# A tilt (rad) of the plane of wheels and tracks that is asked about.
TILT = math.radians(0.2)
_WAYS = ('front', 'front left', 'left', 'rear left', 'rear', 'rear right', 'right', 'front right')


def tilt_question(face: Face, root: str) -> str:
    """Return the question whether a plane of contact points that is tilted is real."""
    way = _WAYS[round(face.heading / (math.pi / 4.0)) % 8]
    return (
        f'The plane of these points is {math.degrees(face.tilt):.2f} deg off the xy-plane of '
        f'{root}, lower at the {way}: is this tilt real?'
    )
