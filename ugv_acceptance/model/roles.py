"""The roles of a robot's joints, found in its tree: arm, turret, flippers, wheels and legs.

No joint's name is looked at. The zero posture is that of the URDF, held joints where they are held.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ugv_acceptance.model.robot import Contact, Joint, Robot, Vector
from ugv_acceptance.model.tree import Tree, tree_of
from ugv_acceptance.type_aliases import Floats

# Cosine of the angle to the vertical up to which an axis lies across gravity (45 deg, so that an
# arm on a sloping deck counts), and from which it is upright (25 deg).
ACROSS, UPRIGHT = math.cos(math.radians(45.0)), math.cos(math.radians(25.0))
# A wheel's centre of gravity lies this close to its axle: share of its radius, or m.
BALANCED, BALANCED_M = 0.05, 0.005
# A contact point of a wheel is within this of straight below its axle (rad), and along the axle not
# further from the joint than this (wheel radii): joints often sit at the inner face of a tyre.
BELOW, ALONG = math.radians(10.0), 2.5
# An axis of the arm carries this share of what the most loaded one carries, or it is of the wrist.
MAIN = 0.2
# An arm whose payload link is not told has so many joints at least: a camera's head has two.
ARM = 3
WHEELED, TRACKED, LEGGED, ARM_ALONE, NONE = 'wheeled', 'tracked', 'legged', 'arm', 'none'


@dataclass(frozen=True, slots=True)
class Wheel:
    """A wheel: its joint, the link that carries it, and where it is in `base_link`.

    `axle` is the joint's origin (m), `axis` a unit vector; `contacts` are the points of the robot
    straight below the axle and `radius` (m) is their distance from it; none: 0.
    """

    joint: str
    carrier: str
    axle: Vector
    axis: Vector
    contacts: tuple[Contact, ...] = ()
    radius: float = 0.0


@dataclass(frozen=True, slots=True)
class Roles:
    """What the joints of a robot are for; every tuple is in the order from the base outwards.

    `kind` is wheeled, tracked (stands on points of its body), legged, arm (stands on nothing) or
    none. `arm` are the measured joints from the base to the payload link, `axes` those of them that
    lift: across gravity in the zero posture and with a large part of the torque. `turret` turns the
    arm about the vertical before the first axis. `flippers` are measured joints that move contact
    points and are neither wheels nor legs, nor carry wheels as a suspension or a steering does.
    `wheels`, measured or held, turn without end and are balanced. `legs` are the measured joints of
    chains of two or more to a contact point.
    """

    kind: str
    arm: tuple[str, ...] = ()
    axes: tuple[str, ...] = ()
    turret: str | None = None
    flippers: tuple[str, ...] = ()
    wheels: tuple[str, ...] = ()
    legs: tuple[str, ...] = ()


@lru_cache(maxsize=64)
def roles_of(robot: Robot) -> Roles:
    """Return the roles of the joints of `robot`."""
    wheels = wheels_of(robot)
    arm = _arm(robot, {wheel.joint for wheel in wheels})
    axes = _axes(robot, arm)
    before = arm[: arm.index(axes[0])] if axes else ()
    turret = next((n for n in before if _upright(robot, robot.joint(n))), None)
    legs, flippers = _feet(robot, wheels, arm)
    return Roles(
        _kind(robot, wheels, arm, legs),
        arm,
        axes,
        turret,
        flippers,
        tuple(wheel.joint for wheel in wheels),
        legs,
    )


@lru_cache(maxsize=64)
def wheels_of(robot: Robot) -> tuple[Wheel, ...]:
    """Return the wheels of `robot`, each with the contact points it stands on."""
    arm = _chain(robot, robot.payload_link)
    found = [w for j in robot.joints if j.name not in arm if (w := _wheel(robot, j)) is not None]
    below: dict[str, list[Contact]] = {wheel.joint: [] for wheel in found}
    for contact in robot.contacts:
        near = [(away, wheel.joint) for wheel in found if (away := _along(robot, wheel, contact))]
        if near:
            below[min(near)[1]].append(contact)
    wheels = []
    for wheel in found:
        feet = tuple(below[wheel.joint])
        radii = [_away(robot, wheel, contact)[1] for contact in feet]
        wheels.append(replace(wheel, contacts=feet, radius=max(radii, default=0.0)))
    return tuple(w for w in wheels if _balanced(robot, w))


def chain_to(robot: Robot, link: str) -> tuple[str, ...]:
    """Return all joints from the root to `link`, fixed ones too, base first."""
    above = {joint.child: joint for joint in robot.joints}
    names = []
    while link in above:
        names.append(above[link].name)
        link = above[link].parent
    return tuple(reversed(names))


def place_of(robot: Robot, link: str, point: Vector) -> Floats:
    """Return where a point (m, in the axes of `link`) is in the zero posture (3,), `base_link`."""
    _, rotation, origin = _still(robot).frames[link]
    place: Floats = np.array(rotation) @ np.array(point) + np.array(origin)
    return place


@lru_cache(maxsize=64)
def _still(robot: Robot) -> Tree:
    """Return the tree with every joint still: one body, in which each link has its frame."""
    return tree_of(replace(robot, joint_names=(), mimics=(), laws=()))


def direction_of(robot: Robot, joint: Joint) -> Vector:
    """Return the axis of a joint in the zero posture, a unit vector in `base_link`."""
    x, y, z = (np.array(_still(robot).frames[joint.child][1]) @ np.array(joint.axis)).tolist()
    return x, y, z


def _upright(robot: Robot, joint: Joint) -> bool:
    return not joint.slides and abs(direction_of(robot, joint)[2]) > UPRIGHT


def _across(robot: Robot, joint: Joint) -> bool:
    return not joint.slides and abs(direction_of(robot, joint)[2]) < ACROSS


def _chain(robot: Robot, link: str | None) -> tuple[str, ...]:
    return () if link is None else chain_to(robot, link)


def _carried(robot: Robot, joint: Joint) -> tuple[str, ...]:
    """Return the links that hang on a joint."""
    links = [joint.child]
    for link in links:
        links += [j.child for j in robot.joints if j.parent == link]
    return tuple(links)


def _wheel(robot: Robot, joint: Joint) -> Wheel | None:
    """Return the wheel that a joint turns; None if it has ends, is upright or carries joints."""
    endless = joint.kind == 'continuous' or (joint.kind == 'revolute' and joint.lower == -math.inf)
    if not endless or not _across(robot, joint):
        return None
    links = _carried(robot, joint)
    if any(j.parent in links and j.kind != 'fixed' for j in robot.joints):
        return None
    x, y, z = place_of(robot, joint.child, (0.0, 0.0, 0.0)).tolist()
    return Wheel(joint.name, joint.parent, (x, y, z), direction_of(robot, joint))


def _away(robot: Robot, wheel: Wheel, contact: Contact) -> tuple[float, float, float]:
    """Return how far (m) a contact is along the axle, across it, and below it of the latter."""
    away = place_of(robot, contact.link, contact.position) - np.array(wheel.axle)
    along = float(away @ np.array(wheel.axis))
    across = away - along * np.array(wheel.axis)
    return abs(along), float(np.linalg.norm(across)), -float(across[2])


def _along(robot: Robot, wheel: Wheel, contact: Contact) -> float | None:
    """Return how far (m, above 0) along the axle a contact straight below it is; else None."""
    along, radius, below = _away(robot, wheel, contact)
    # The axle may be cambered: what is below it is then not below by all of the radius.
    upright = math.sqrt(1.0 - wheel.axis[2] ** 2)
    under = below > 0.0 and below >= math.cos(BELOW) * radius * upright
    return along + 1e-9 if under and along <= ALONG * radius else None


def _balanced(robot: Robot, wheel: Wheel) -> bool:
    joint = robot.joint(wheel.joint)
    parts = [robot.link(name) for name in _carried(robot, joint)]
    mass = math.fsum(part.mass for part in parts)
    if mass == 0.0:
        return True
    moment = sum(part.mass * place_of(robot, part.name, part.cog) for part in parts)
    away = np.array(moment) / mass - np.array(wheel.axle)
    off = float(np.linalg.norm(np.cross(away, np.array(wheel.axis))))
    return off <= max(BALANCED * wheel.radius, BALANCED_M)


def _arm(robot: Robot, wheels: set[str]) -> tuple[str, ...]:
    """Return the measured joints to the payload link, or of the longest chain if none is told."""
    if robot.payload_link is not None:
        chain = chain_to(robot, robot.payload_link)
        return tuple(n for n in chain if n in robot.joint_names)
    feet = {name for c in robot.contacts for name in chain_to(robot, c.link)} | wheels
    parents = {joint.parent for joint in robot.joints}
    longest: tuple[str, ...] = ()
    for link in robot.links:
        names = () if link.name in parents else chain_to(robot, link.name)
        turning = tuple(n for n in names if n in robot.joint_names and n not in feet)
        if len(turning) > len(longest):
            longest = turning
    return longest if len(longest) >= ARM and _axes(robot, longest) else ()


def _axes(robot: Robot, arm: Sequence[str]) -> tuple[str, ...]:
    """Return the joints of the arm that lift, without those of the wrist."""
    load = {n: _moment(robot, j) for n in arm if _across(robot, j := robot.joint(n))}
    most = max(load.values(), default=0.0)
    return tuple(n for n, moment in load.items() if moment > 0.0 and moment >= MAIN * most)


def _moment(robot: Robot, joint: Joint) -> float:
    """Return the moment (kg m) about a joint if all it carries lay to one side of its axis."""
    at, axis = place_of(robot, joint.child, (0.0, 0.0, 0.0)), np.array(direction_of(robot, joint))
    links = _carried(robot, joint)
    parts = [(link.mass, link.name, link.cog) for link in robot.links if link.name in links]
    if robot.payload_link in links:
        parts.append((robot.payload.mass, robot.payload_link, robot.payload.cog))
    away = (np.cross(place_of(robot, name, cog) - at, axis) for _, name, cog in parts)
    return math.fsum(m * float(np.linalg.norm(a)) for (m, _, _), a in zip(parts, away, strict=True))


def _feet(
    robot: Robot, wheels: Sequence[Wheel], arm: Sequence[str]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the joints of the legs and the flippers."""
    rolling = {w.joint for w in wheels}
    carrying = rolling | {n for w in wheels for n in chain_to(robot, w.carrier)}
    legs: dict[str, None] = {}
    flippers: dict[str, None] = {}
    for contact in robot.contacts:
        chain = [n for n in chain_to(robot, contact.link) if n in _moving(robot)]
        chain = [n for n in chain if n not in carrying and n not in arm]
        kind = legs if len(chain) > 1 else flippers
        kind.update(dict.fromkeys(n for n in chain if n in robot.joint_names))
    return tuple(legs), tuple(n for n in flippers if n not in legs)


def _moving(robot: Robot) -> Iterator[str]:
    yield from robot.joint_names
    yield from (mimic.joint for mimic in robot.mimics)


def _kind(robot: Robot, wheels: Sequence[Wheel], arm: Sequence[str], legs: Sequence[str]) -> str:
    if not robot.contacts:
        return ARM_ALONE if arm else NONE
    if any(wheel.contacts for wheel in wheels):
        return WHEELED
    still = any(not {*chain_to(robot, c.link)} & {*_moving(robot)} for c in robot.contacts)
    return LEGGED if legs and not still else TRACKED
