"""Wheels of a URDF: what a joint turns without end, is round about its axis and lies across it.

A wheel stands on two points straight under its axle, across its tread. They are on the link that
carries the wheel: on the wheel itself they would go round.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ugv_acceptance.config.wheels import BALANCED
from ugv_acceptance.configure.carrying import Part, stem_of
from ugv_acceptance.configure.collision import Solid
from ugv_acceptance.configure.draft import ASK, CERTAIN, CHECK
from ugv_acceptance.configure.posture import Posture
from ugv_acceptance.model.robot import Joint
from ugv_acceptance.type_aliases import Floats

# An axis lies across gravity up to this component along it; a cylinder about it within 3 deg; the
# supports of a round mesh in all directions are within this share of the largest.
ACROSS, ALONG, ROUND = 0.5, math.cos(math.radians(3.0)), 0.92
# A corner of a mesh so near (share of the radius, m) to the largest radius is of the tread; a
# second cylinder is if its radius is so near (m).
TREAD, TREAD_M, SAME_RADIUS = 0.02, 0.002, 0.001
# Rollers of a wheel have their axes within its radius.
ROLLERS = 1.05
# A joint that turns so far (rad) turns without end: some wheels are written with limits.
MANY_TURNS = 100.0


@dataclass(frozen=True, eq=False)
class Wheel:
    """A wheel: its axle's origin (3,), m, and axis (3,) in root axes, radius (m), tread's ends (m).

    `radius` 0: nothing tells it. `guess`: it is told by the inertia alone.
    """

    joint: Joint
    centre: Floats
    axis: Floats
    radius: float
    ends: tuple[float, ...]
    source: str
    grade: str
    guess: bool = False

    @property
    def part(self) -> Part:
        """It as what the robot stands on."""
        link = self.joint.child
        on = f'wheel {link}'
        return Part(on, self.joint.parent, stem_of(link), self.grade, self.source, self.points)

    def points(self, up: Floats) -> Floats:
        """Return the points (n, 3), m, straight under the axle at the ends of the tread."""
        across = up - float(up @ self.axis) * self.axis
        down = -self.radius / float(np.linalg.norm(across)) * across
        return self.centre + np.outer(np.array(self.ends), self.axis) + down

    def overlaps(self, other: 'Wheel', slack: float) -> bool:
        """Return whether two wheels are in one place by more than `slack` (m)."""
        way = other.centre - self.centre
        along = float(way @ self.axis)
        turned = math.copysign(1.0, float(self.axis @ other.axis))
        own, others = self.ends, [along + turned * end for end in other.ends]
        beside = max(min(own), min(others)) > min(max(own), max(others)) - slack
        away = float(np.linalg.norm(_across(way, self.axis)))
        return not beside and away < self.radius + other.radius - slack


def wheels_of(posture: Posture) -> tuple[Wheel, ...]:
    """Return the wheels, the outermost where one carries others, as its rollers."""
    return tuple(_below(posture, posture.root))


def endless(joint: Joint) -> bool:
    """Return whether a joint turns without end."""
    return joint.kind == 'continuous' or (
        joint.kind == 'revolute' and joint.upper - joint.lower > MANY_TURNS
    )


def _below(posture: Posture, link: str) -> Iterator[Wheel]:
    waiting = [link]
    for name in waiting:
        for joint in posture.below.get(name, ()):
            wheel = _wheel(posture, joint)
            if wheel is not None:
                yield wheel
            else:
                waiting.append(joint.child)


def _wheel(posture: Posture, joint: Joint) -> Wheel | None:
    axis = posture.axis(joint)
    if not endless(joint) or abs(axis[2]) > ACROSS:
        return None
    links, centre = posture.rigid(joint.child), posture.frames[joint.child][1]
    solids = [solid for solid in posture.solids if solid.link in links]
    unread = [one for one in posture.unread if one.link in links]
    if not solids:
        return _guessed(posture, joint, links) if unread else None
    found = [(radius_about(s, centre, axis), _tread(s, centre, axis), s) for s in solids]
    radius, tread, solid = max(found, key=lambda one: one[0])
    if tread is None or not _only_rollers(posture, joint, radius):
        return None
    ends = [s for r, spans, _ in found if spans and r >= radius - SAME_RADIUS for s in spans]
    span = tuple(dict.fromkeys((min(ends), max(ends))))
    source = f'under the axle of {joint.child}: {solid.words}'
    grade = CERTAIN
    if solid.kind == 'mesh':
        source += f', radius {1e3 * radius:.4g} mm, tread {1e3 * (span[-1] - span[0]):.4g} mm wide'
    if solid.kind == 'sphere':
        source, grade = f'{source}; a sphere has no width: one point, in its middle', CHECK
    if solid.drawn:
        source, grade = f'{source}, as it is drawn: it has no collision geometry', CHECK
    if unread:
        source, grade = f'{source}; its {unread[0].what} is not read: {unread[0].why}', CHECK
    return Wheel(joint, centre, axis, radius, span, source, grade)


def radius_about(solid: Solid, centre: Floats, axis: Floats) -> float:
    """Return the radius (m) of a solid about an axis through `centre`."""
    if len(solid.points):
        return float(np.linalg.norm(_across(solid.points - centre, axis), axis=1).max())
    off = float(np.linalg.norm(_across(solid.centre - centre, axis)))
    if solid.kind == 'sphere':
        return off + float(solid.size[0])
    along = abs(float(axis @ solid.turn[:, 2]))
    lean = 0.0 if along > ALONG else math.sqrt(1.0 - along * along)
    return off + math.hypot(solid.size[0], solid.size[2] * lean)


def _across(vectors: Floats, axis: Floats) -> Floats:
    across: Floats = vectors - np.multiply.outer(vectors @ axis, axis)
    return across


def _tread(solid: Solid, centre: Floats, axis: Floats) -> tuple[float, ...] | None:
    """Return the ends of the tread (m along the axis from `centre`) of a round solid, else None."""
    middle = float((solid.centre - centre) @ axis)
    off = float(np.linalg.norm(_across(solid.centre - centre, axis)))
    if solid.kind == 'sphere':
        return (middle,) if off <= BALANCED * solid.size[0] else None
    if solid.kind == 'cylinder':
        if off > BALANCED * solid.size[0] or abs(float(axis @ solid.turn[:, 2])) < ALONG:
            return None
        half = float(solid.size[2])
        return (middle - half, middle + half)
    if solid.kind == 'mesh':
        return _mesh_tread(solid.points - centre, axis)
    return None


def _mesh_tread(points: Floats, axis: Floats) -> tuple[float, ...] | None:
    across = _across(points, axis)
    radii = np.linalg.norm(across, axis=1)
    radius = float(radii.max())
    one = across[int(np.argmax(radii))] / max(radius, 1e-12)
    angles = np.arange(24) * np.pi / 12.0
    ways = np.outer(np.cos(angles), one) + np.outer(np.sin(angles), np.cross(axis, one))
    if radius <= 0.0 or (across @ ways.T).max(axis=0).min() < ROUND * radius:
        return None
    along = points[radii >= radius - max(TREAD_M, TREAD * radius)] @ axis
    return (float(along.min()), float(along.max()))


def _only_rollers(posture: Posture, joint: Joint, radius: float) -> bool:
    """Return whether all that moves on a wheel lies within its radius."""
    centre, axis = posture.frames[joint.child][1], posture.axis(joint)
    for inner in posture.inner(joint.child):
        away = _across(posture.frames[inner.child][1] - centre, axis)
        if not endless(inner) or float(np.linalg.norm(away)) > ROLLERS * radius:
            return False
    return True


def _guessed(posture: Posture, joint: Joint, links: Sequence[str]) -> Wheel | None:
    """Return a wheel whose geometry is not read, by its inertia; None where it cannot be one."""
    if posture.inner(joint.child):
        return None
    link = next(link for link in posture.urdf.links if link.name == joint.child)
    axis, centre = posture.axis(joint), posture.frames[joint.child][1]
    own = np.array(joint.axis)
    # The largest moment of a disc is about its axle; some URDFs write it about another axis.
    largest = float(np.linalg.eigvalsh(np.array(link.inertia)).max())
    radius = math.sqrt(2.0 * largest / link.mass) if link.mass > 0.0 and largest > 0.0 else 0.0
    off = float(np.linalg.norm(_across(np.array(link.cog), own)))
    if off > max(BALANCED * radius, 0.001):
        return None
    middle = float(np.array(link.cog) @ own)
    what = next(one for one in posture.unread if one.link in links)
    source = f'{what.what} of {joint.child} is not read: {what.why}'
    if radius:
        source = f'radius {1e3 * radius:.4g} mm from its inertia, taken as a uniform disc; {source}'
    return Wheel(joint, centre, axis, radius, (middle,), source, ASK, guess=True)
