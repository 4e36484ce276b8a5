"""The contact points of a URDF: on what it stands, each with its source and how sure it is.

The links are placed in a posture; below the centre of gravity lies one face of all that may carry,
and what is within millimetres of its plane carries. Wheels and casters are taken before the body.
Nothing doubtful is passed on in silence: it becomes a question.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.configure.carrying import (
    MARKER,
    NEAR,
    UP,
    Notes,
    Part,
    caster_of,
    contacts_of,
    corner_names,
    face_of,
    face_of_solids,
    listed,
    mm,
    names_of,
    outline,
    outside,
    stem_of,
)
from ugv_acceptance.configure.collision import Meshes, Solid, geometry_of
from ugv_acceptance.configure.draft import ASK, CERTAIN, CHECK, Contacts, DerivedContact
from ugv_acceptance.configure.posture import Posture, posture_of
from ugv_acceptance.configure.rolling import Wheel, endless, wheels_of
from ugv_acceptance.configure.standing import (
    TILT,
    fewer,
    stands_on_geometry,
    tilt_question,
)
from ugv_acceptance.model.resting import Face
from ugv_acceptance.model.robot import Contact
from ugv_acceptance.type_aliases import Floats

# A wheel so far (m) above the lowest is none that the robot stands on; one so far above the plane
# of the others is still one.
HIGH, SPRUNG = 0.1, 0.02
# From here (m) that is asked about; so much (m) two wheels may overlap.
UNEVEN, OVERLAP = 0.0055, 0.005
# How far (m) the body may reach below the wheels' plane, as collision geometry is rough, and below
# a robot's lowest wheels before these carry nothing.
ROUGH, BELOW = 0.010, 0.030
# A caster reaches at most this share of the distance between wheels, and is this close (m) to the
# height of their lowest points.
SMALL, CASTER = 0.3, 0.015
# Beyond this tilt (rad) a wheel's lowest point is no longer straight below its axle as drawn.
LEANING = math.radians(2.0)
# Two wheels carry alone, as two drums do, if the centre of gravity is so far (m) inside.
SLIVER = 0.01


def derive_contacts(urdf: Urdf, posture: Mapping[str, float], meshes: Meshes) -> Contacts:
    """Return on what a robot stands in a posture (rad, m; joints not named are at 0).

    `meshes` finds the file of a mesh by its name in the URDF, or returns None. No file and no
    robot is an error: what cannot be told is a question.
    """
    at = posture_of(urdf, posture, geometry_of(urdf, meshes))
    notes = Notes()
    wheels = _standing(at, notes)
    if not wheels:
        return stands_on_geometry(at, notes)
    return _Rolling(at, wheels, notes).contacts()


def _standing(posture: Posture, notes: Notes) -> list[Wheel]:
    """Return the wheels near the ground; those higher, and below all of which the body is, not."""
    wheels = [wheel for wheel in wheels_of(posture) if wheel.radius]
    unsized = [wheel for wheel in wheels_of(posture) if not wheel.radius]
    if unsized:
        notes.questions.append(
            f'The radius of {listed([w.joint.child for w in unsized])} is not known '
            f'({unsized[0].source}): where does it touch the ground?'
        )
    if not wheels:
        return []
    low = min(wheel.part.height(UP) for wheel in wheels)
    kept = [wheel for wheel in wheels if wheel.part.height(UP) <= low + HIGH]
    on_wheels = {link for wheel in wheels for link in _carried(posture, wheel)}
    body = [s for s in posture.solids if s.link not in on_wheels and s.reach > MARKER]
    bottom = min((float(s.lowest(UP) @ UP) for s in body), default=math.inf)
    if bottom > low - BELOW or face_of([w.part for w in kept], posture.cog) is not None:
        return kept
    names = listed([wheel.joint.child for wheel in wheels])
    said = f'{names} is {mm(low - bottom)} above the lowest geometry of the rest'
    base = posture.rigid(posture.root)
    if any(wheel.joint.parent in base for wheel in wheels):
        notes.questions.append(f'{said}: is it a wheel on which the robot stands?')
    else:
        notes.remarks.append(f'{said}: it is taken as no wheel on which the robot stands')
    return []


def _carried(posture: Posture, wheel: Wheel) -> set[str]:
    """Return the links that turn with a wheel, its rollers among them."""
    links = [wheel.joint.child]
    for name in links:
        links += [joint.child for joint in posture.below.get(name, ())]
    return set(links)


class _Rolling:
    """A robot on wheels and casters: what carries is found, and all that is doubtful is said."""

    def __init__(self, posture: Posture, wheels: Sequence[Wheel], notes: Notes) -> None:
        self._posture, self._wheels, self._notes = posture, wheels, notes
        self._at = posture.cog
        self._turning = {link for wheel in wheels for link in _carried(posture, wheel)}
        self._base = set(posture.rigid(posture.root))
        self._casters = self._find_casters()
        used = {id(solid) for solid, _ in self._casters}
        self._rest = [
            s
            for s in posture.solids
            if s.link not in self._turning and id(s) not in used and s.reach > MARKER
        ]

    def contacts(self) -> Contacts:
        """Return the contact points, with questions where something is doubtful."""
        parts = [wheel.part for wheel in self._wheels]
        casters = [part for _, part in self._casters]
        face, up = self._faced(parts, casters, UP), UP
        self._ask_of_wheels()
        if face is not None and face.tilt > LEANING:
            up = np.array(face.normal)
            face = self._faced(parts, casters, up)
        if face is None:
            return self._unsupported([*parts, *casters])
        if self._faced(parts, casters, up, of_all=True) is None:
            off = outside([p for part in (*parts, *casters) for p in part.points(up)], self._at)
            self._notes.remarks.append(
                f'in this posture the arm has the centre of gravity {mm(off)} outside of the wheels'
            )
        found = []
        for part in parts:
            found += self._taken(part, face, up, SPRUNG)
        for part in casters:
            found += self._taken(part, face, up, NEAR)
        if face.tilt > TILT:
            self._notes.questions.append(tilt_question(face, self._posture.root))
            found = [_at_least_check(one) for one in found]
        self._say_of_the_rest(face)
        return contacts_of(self._posture, found, face, self._notes)

    def _faced(
        self, wheels: Sequence[Part], casters: Sequence[Part], up: Floats, *, of_all: bool = False
    ) -> Face | None:
        """Return the face of wheels, else of wheels and casters; `of_all`: below all of the robot.

        Else where an arm has the centre of gravity beyond them, the face below the rest.
        """
        places = [self._at] if of_all else [self._at, self._posture.body_cog()]
        groups = [(part, at) for at in places for part in (wheels, [*wheels, *casters])]
        faces = (self._face(parts, at, up) for parts, at in groups)
        return next((face for face in faces if face is not None), None)

    def _face(self, parts: Sequence[Part], at: Floats, up: Floats) -> Face | None:
        """Return the face that parts carry on; two wheels that are not parallel carry on none."""
        if len(parts) < 3:
            points = [point for part in parts for point in part.points(up)]
            if not outline(points) or outside(points, at) > -SLIVER:
                return None
        return face_of(parts, at, up)

    def _find_casters(self) -> list[tuple[Solid, Part]]:
        """Return small things fixed to the body as low as the wheels, with what carries there."""
        centres = [wheel.centre for wheel in self._wheels]
        span = max(float(np.linalg.norm(a - b)) for a in centres for b in centres)
        span = span or 4.0 * self._wheels[0].radius
        low = min(wheel.part.height(UP) for wheel in self._wheels)
        of_base = [s for s in self._posture.solids if s.link in self._base]
        large = {s.link for s in of_base if s.reach > SMALL * span}
        return [
            (solid, caster_of(solid))
            for solid in of_base
            if MARKER < solid.reach <= SMALL * span
            and (solid.kind in ('sphere', 'cylinder') or solid.link not in large)
            and float(solid.lowest(UP) @ UP) <= low + CASTER
        ]

    def _taken(self, part: Part, face: Face, up: Floats, slack: float) -> list[DerivedContact]:
        """Return the contact points of what is within `slack` (m) of the plane."""
        points = list(part.points(up))
        height = min(face.height(p.tolist()) for p in points)
        rolls = slack == SPRUNG
        if height > (UNEVEN if rolls else slack):
            said = f'{part.on} is {mm(height)} above the plane of the others'
            if rolls:
                self._notes.questions.append(f'{said}: does it touch the ground?')
            else:
                self._notes.remarks.append(f'{said}: it was not taken')
        if height > slack:
            return []
        source, grade = part.source, part.grade
        if abs(height) > 1e-4:
            source = f'{source}; {mm(height)} above the plane of the others'
            grade = CHECK if grade == CERTAIN else grade
        return [
            DerivedContact(
                Contact(name, part.link, self._posture.in_link(part.link, point)),
                grade,
                source,
                part.on,
            )
            for name, point in zip(names_of(part.stem, points), points, strict=True)
        ]

    def _unsupported(self, parts: Sequence[Part]) -> Contacts:
        """Return the points of wheels that cannot carry alone, and ask what carries with them.

        What of the body would touch as the robot falls onto it is the best guess.
        """
        notes, posture = self._notes, self._posture
        points = [point for part in parts for point in part.points(UP)]
        names = listed([part.on.split(' ', 1)[1] for part in parts])
        found: list[DerivedContact] = []
        plane = Face((_triple(points[0]),) * 3, (0.0, 0.0, 1.0))
        for part in parts:
            found += self._taken(part, plane, UP, math.inf)
        if len(parts) > 2 and outline(points):
            off = mm(outside(points, posture.cog))
            notes.questions.append(
                f'The centre of gravity is {off} outside of what {names} carry: '
                'what else touches the ground, or which mass is wrong?'
            )
            return contacts_of(posture, found, None, notes)
        guess, words = self._third()
        unread = [u for u in posture.unread if u.link not in self._turning and not u.drawn]
        if unread:
            words += (
                f' Geometry of {listed([u.link for u in unread])} was not read '
                f'({unread[0].what}: {unread[0].why}), casters may be part of it.'
            )
        notes.questions.append(
            f'Only {names} were found to carry, which cannot hold the robot alone: where else does '
            f'it touch the ground?{words}'
        )
        return contacts_of(posture, [*found, *guess], None, notes)

    def _third(self) -> tuple[list[DerivedContact], str]:
        """Return where the body would touch beside the wheels, as a guess, and say so."""
        posture = self._posture
        everything = [*self._rest, *(s for s in posture.solids if s.link in self._turning)]
        face = face_of_solids(everything, posture.cog)
        if face is None:
            return [], ''
        up = np.array(face.normal)
        found = []
        for solid in self._rest:
            patch = [p for p in solid.patch(up, NEAR) if face.height(p.tolist()) <= NEAR]
            if not patch:
                continue
            corners = [patch[k] for k in fewer(patch, outline(patch), 4)] or patch[:2]
            for name, p in zip(corner_names(corners, stem_of(solid.link)), corners, strict=True):
                contact = Contact(name, solid.link, posture.in_link(solid.link, p))
                source = f'guess: {solid.words} of {solid.link} is the next that would touch'
                found.append(DerivedContact(contact, ASK, source, f'body {solid.link}'))
        if not found:
            return [], ''
        on = listed([one.contact.link for one in found])
        deg = math.degrees(face.tilt)
        return found, f' As read, it would lean by {deg:.1f} deg until {on} touches.'

    def _ask_of_wheels(self) -> None:
        """Ask what is doubtful of the wheels themselves."""
        notes = self._notes
        guessed = [wheel for wheel in self._wheels if wheel.guess]
        if guessed:
            radii = dict.fromkeys(mm(wheel.radius) for wheel in guessed)
            notes.questions.append(
                f'The geometry of {listed([w.joint.child for w in guessed])} was not read '
                f'({guessed[0].source.split("; ")[-1]}); taken as uniform discs, their inertia '
                f'gives a radius of {", ".join(radii)}: is it that?'
            )
        for wheel in self._wheels:
            self._say_of_carrier(wheel)
        self._ask_of_unround()
        for a, b in combinations(self._wheels, 2):
            if a.overlaps(b, OVERLAP):
                notes.questions.append(
                    f'{a.joint.child} (radius {mm(a.radius)}) and {b.joint.child} (radius '
                    f'{mm(b.radius)}) overlap: which number is wrong?'
                )
                break

    def _say_of_carrier(self, wheel: Wheel) -> None:
        """Say what moves the link that carries a wheel: its contact point goes with it."""
        notes, posture, name = self._notes, self._posture, wheel.joint.child
        bends = []
        for joint in posture.chain(wheel.joint.parent):
            upright = abs(posture.axis(joint)[2]) > 0.5
            if joint.slides or (upright and not endless(joint)):
                continue
            if upright:
                away = (wheel.centre - posture.frames[joint.child][1])[:2]
                far = 2.0 * float(np.hypot(*away))
                notes.swivels[joint.name] = max(far, notes.swivels.get(joint.name, 0.0))
                notes.remarks.append(
                    f'{name} swivels: its point moves by up to {mm(far)} as {joint.name} turns'
                )
            elif endless(joint):
                notes.questions.append(
                    f'{name} is carried by {joint.child}, which {joint.name} turns without end: '
                    'where does that touch the ground?'
                )
            else:
                bends.append(joint.name)
        if len(bends) > 1 and not any(posture.positions.get(one, 0.0) for one in bends):
            notes.questions.append(
                f'{name} hangs on a leg that was taken with {listed(bends)} at 0: is that how the '
                'robot stands? A recording of it standing tells its posture.'
            )
        elif bends:
            notes.remarks.append(
                f'{name} hangs on {wheel.joint.parent}, which {listed(bends)} turns: its point is '
                'below the axle in this posture'
            )

    def _ask_of_unround(self) -> None:
        """Ask about what turns without end as low as the wheels, but is not round."""
        posture, known = self._posture, {wheel.joint.name for wheel in self._wheels}
        high = max(float(wheel.centre[2]) + wheel.radius for wheel in self._wheels)
        for joint in posture.urdf.joints:
            across = joint.kind != 'fixed' and abs(posture.axis(joint)[2]) < 0.5
            low = posture.frames[joint.child][1][2] <= high
            if not (across and low and endless(joint)) or joint.name in known:
                continue
            if joint.child in self._turning or posture.inner(joint.child):
                continue
            self._notes.questions.append(
                f'{joint.child} turns without end as low as the wheels, but its geometry is not '
                f'round about {joint.name}: is it a wheel, and where does it touch the ground?'
            )

    def _say_of_the_rest(self, face: Face) -> None:
        """Say what lies below the plane or on it and was not taken, and what was not read."""
        notes, posture, up = self._notes, self._posture, np.array(face.normal)
        for solid in self._rest:
            height = face.height(solid.lowest(up).tolist())
            if height > NEAR:
                continue
            what = f'{solid.words} of {solid.link}'
            if height < -ROUGH:
                notes.questions.append(
                    f'The {what} is {mm(-height)} below the ground on which the wheels stand: '
                    'does the robot stand on it, or is the posture another?'
                )
            else:
                where = f'{mm(-height)} below' if height < 0.0 else f'{mm(height)} above'
                notes.remarks.append(
                    f'the {what} is {where} the ground on which the wheels stand: wheels carry, '
                    'so it was not taken'
                )
        unread = [u for u in posture.unread if u.link not in self._turning and not u.drawn]
        if unread:
            notes.remarks.append(
                f'geometry of {listed([u.link for u in unread])} was not read '
                f'({unread[0].what}: {unread[0].why}); wheels carry without it'
            )


def _at_least_check(one: DerivedContact) -> DerivedContact:
    return replace(one, grade=CHECK) if one.grade == CERTAIN else one


def _triple(point: Floats) -> tuple[float, float, float]:
    x, y, z = point.tolist()
    return x, y, z
