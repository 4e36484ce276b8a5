"""Cheap checks of how a configuration says that its robot stands.

Each finding says what was expected and what came. They are run whenever a configuration is loaded,
so they ask only what holds in the posture in which all joints are at zero, or in a given one.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ugv_acceptance.config.contact_check import kneeling
from ugv_acceptance.config.wheels import askew
from ugv_acceptance.model.hull import hull, pairs
from ugv_acceptance.model.resting import Face, lowest_of, resting_face
from ugv_acceptance.model.robot import Contact, Robot, Shape, Vector
from ugv_acceptance.model.tree import (
    Pose,
    Tree,
    body_positions,
    drives_of,
    plain,
    point_of,
    pose_of,
    tree_of,
)

FAILS, DOUBT = 'fails', 'doubt'
# The plane of the carrying points is level within this (rad); points this near (m) it carry.
TILT, NEAR = math.radians(0.2), 0.003
# The centre of gravity is near an edge within this share of half the polygon's width, or this (m).
SHARE, EDGE = 0.1, 0.02
# A contact under a wheel is this near (m, share of its radius) to its lowest point; beyond the
# sides of its tread by as much (m) it is of something else.
UNDER, UNDER_SHARE, BESIDE = 0.005, 0.05, 0.02
# A cylinder is about its axle within 5 deg; postures tried; half the travel (m) of a slide.
ABOUT, POSTURES, HALF_SLIDE = math.cos(math.radians(5.0)), 64, 0.5
Point = Vector


@dataclass(frozen=True, slots=True)
class SetupDoubt:
    """A finding: `field` of the configuration, `words` of one sentence, `severity`.

    FAILS: so the robot cannot stand, or nothing tells how. DOUBT: it may be so.
    """

    field: tuple[str, ...]
    words: str
    severity: str


def setup_doubts(
    robot: Robot,
    shapes: Sequence[Shape] = (),
    given: Sequence[Contact] | None = None,
    posture: Mapping[str, float] | None = None,
    known: Sequence[str] = (),
) -> tuple[SetupDoubt, ...]:
    """Return what is doubtful of how a robot stands.

    `shapes` is the URDF's collision geometry, `given` the contact points as the file gives them,
    before those on wheels were fixed below their axles. `posture` (rad, m) is one in which the
    robot stands; without it joints are at 0, and contacts that joints move are not judged. `known`
    names what the file declares as assumed: contacts.tilt is a tilt that is real.
    """
    found = list(_on_wheels(robot, given or ()))
    if not robot.contacts:
        return (*found, SetupDoubt(('contacts',), _FEW.format('none'), FAILS))
    tree = tree_of(robot)
    at = posture or {}
    q = [at.get(name, 0.0) for name in robot.joint_names]
    pose = pose_of(tree, body_positions(drives_of(robot, tree), q))
    points = [plain(point_of(tree, pose, c.link, c.position)[1]) for c in robot.contacts]
    found += _under_wheels(robot, tree, pose, shapes, points)
    found += _at_knees(robot, shapes)
    moves = [k for k, c in enumerate(robot.contacts) if tree.frames[c.link][0]]
    polygon = hull(tuple(points), tuple(range(len(points))))
    if not polygon:
        got = f'{len(points)} in one line' if len(points) > 2 else f'{len(points)}'
        return (*found, SetupDoubt(('contacts',), _FEW.format(got), FAILS))
    cog = _cog(tree, pose)
    face = resting_face(lowest_of(points), cog)
    carrying = [k for k, p in enumerate(points) if face and face.height(p) <= NEAR]
    if posture is None and (any(k in moves for k in carrying) or (face is None and moves)):
        return tuple(found)
    if face is not None and not any(k in moves for k in carrying):
        found += _tilt(robot, face, 'contacts.tilt' in known)
    near = carrying if face else list(range(len(points)))
    found += _balance(
        robot, tree, [points[k] for k in near], cog, given_posture=posture is not None
    )
    return tuple(found)


_FEW = 'expected at least three points that carry, not in one line, got {}: no tip-over margin'


def _on_wheels(robot: Robot, given: Sequence[Contact]) -> list[SetupDoubt]:
    """Return the contact points that are not straight below the axle of the wheel they are on."""
    return [
        SetupDoubt(
            ('contacts', contact.name, 'position'),
            f'expected a point straight below the axle of {contact.link}, got one that is '
            f'{math.degrees(off):.1f} deg off',
            DOUBT,
        )
        for contact, off in askew(replace(robot, contacts=tuple(given)))
    ]


def _at_knees(robot: Robot, shapes: Sequence[Shape]) -> list[SetupDoubt]:
    """Return the contact points that are at the knees of legs, not at their ends."""
    return [
        SetupDoubt(
            ('contacts', one.contact.name, 'position'),
            f'expected the end of a leg, got a point {1e3 * one.near:.0f} mm from the joint that '
            f'moves {one.contact.link}: {one.end}, further out, reaches {1e3 * one.reach:.0f} mm; '
            'does the robot kneel?',
            DOUBT,
        )
        for one in kneeling(robot, shapes)
    ]


def _tilt(robot: Robot, face: Face, known: bool) -> list[SetupDoubt]:  # noqa: FBT001 - one caller
    if face.tilt <= TILT or known:
        return []
    words = (
        f'expected the points that carry in a plane level with {robot.root}, got one '
        f'{math.degrees(face.tilt):.2f} deg off; if that is so, say why with contacts.tilt '
        'under assumed'
    )
    return [SetupDoubt(('contacts',), words, FAILS)]


def _cog(tree: Tree, pose: Pose) -> Any:  # noqa: ANN401 - three floats, or arrays of one a posture
    """Return the centre of gravity (m) without a payload, in `base_link`."""
    mass = sum(body.mass for body in tree.bodies)
    total: list[Any] = [0.0, 0.0, 0.0]
    for body, turn, origin in zip(tree.bodies, pose.rotation, pose.origin, strict=True):
        for k in range(3):
            row: Any = turn[k]
            at = origin[k] + sum(row[i] * body.cog[i] for i in range(3))
            total[k] = total[k] + body.mass * at
    return [x / mass for x in total]


def _balance(
    robot: Robot,
    tree: Tree,
    points: Sequence[Point],
    cog: Any,  # noqa: ANN401 - see _cog
    *,
    given_posture: bool,
) -> list[SetupDoubt]:
    """Return whether the centre of gravity is near or beyond an edge of the support polygon."""
    lines, half = _lines(points)
    near = min(EDGE, SHARE * half)
    inside = -float(max(_beyond(lines, cog)))
    if inside >= near:
        return []
    where = 'in the given posture' if given_posture else 'with all joints at 0'
    of = 'inside' if inside >= 0.0 else 'outside'
    words = (
        f'expected the centre of gravity at least {1e3 * near:.0f} mm inside of the points that '
        f'carry, got it {1e3 * abs(inside):.0f} mm {of} {where} and without a payload'
    )
    if given_posture or not robot.joint_names:
        return [SetupDoubt(('contacts',), words, FAILS if inside < 0.0 else DOUBT)]
    best = -float(np.min(np.max(_beyond(lines, _swayed(robot, tree)), axis=0)))
    if best < near:
        return [SetupDoubt(('contacts',), f'{words}, and in no other posture', FAILS)]
    return [SetupDoubt(('contacts',), f'{words}; other postures are inside', DOUBT)]


def _swayed(robot: Robot, tree: Tree) -> Any:  # noqa: ANN401 - see _cog
    """Return the centres of gravity (m) of random postures within the joints' travel."""
    random = np.random.default_rng(0)
    travels = [robot.joint(name).travel(HALF_SLIDE) for name in robot.joint_names]
    q: list[Any] = [random.uniform(*travel, POSTURES) for travel in travels]
    return _cog(tree, pose_of(tree, body_positions(drives_of(robot, tree), q)))


def _lines(points: Sequence[Point]) -> tuple[list[tuple[float, float, float]], float]:
    """Return the outward edges (x, y of the unit normal, offset in m), and half the width (m)."""
    cycle = hull(tuple(points), tuple(range(len(points))))
    lines, widths = [], []
    for i, j in pairs(cycle):
        x, y = points[j][0] - points[i][0], points[j][1] - points[i][1]
        length = math.hypot(x, y)
        nx, ny = y / length, -x / length
        offset = nx * points[i][0] + ny * points[i][1]
        lines.append((nx, ny, offset))
        widths.append(offset - min(nx * p[0] + ny * p[1] for p in points))
    return lines, min(widths, default=0.0) / 2.0


def _beyond(lines: Sequence[tuple[float, float, float]], cog: Any) -> Any:  # noqa: ANN401 - see _cog
    """Return how far (m) beyond each edge a centre of gravity is; negative inside."""
    return [nx * cog[0] + ny * cog[1] - offset for nx, ny, offset in lines] or [math.inf]


def _under_wheels(
    robot: Robot, tree: Tree, pose: Pose, shapes: Sequence[Shape], points: Sequence[Point]
) -> list[SetupDoubt]:
    """Return the contact points under a wheel that are not at its lowest point.

    Wheels are what joints turn without end about the axis of a cylinder that lies on its side.
    """
    above = {joint.child: joint for joint in robot.joints if joint.kind == 'continuous'}
    found = []
    for shape in _tyres(shapes):
        if shape.link not in above or shape.size is None:
            continue
        body, (x, y, z) = point_of(tree, pose, shape.link, shape.xyz)
        centre = np.array([x, y, z], dtype=np.float64)
        turn = np.array(pose.rotation[body], dtype=np.float64)
        turn = turn @ np.array(tree.frames[shape.link][1])
        axle = turn @ np.array(above[shape.link].axis)
        along = abs(float(axle @ turn @ np.array(shape.rotation)[:, 2]))
        off_axle = np.linalg.norm(np.cross(turn @ np.array(shape.xyz), axle))
        if along < ABOUT or abs(axle[2]) > 0.5 or off_axle > UNDER_SHARE * shape.size[0]:
            continue
        for contact, point in zip(robot.contacts, points, strict=True):
            off = _off_lowest(np.array(point) - centre, axle, shape.size)
            if off is not None and contact.link != shape.link:
                words = f'expected the lowest point of {shape.link}, below its axle, got one {off}'
                found.append(SetupDoubt(('contacts', contact.name, 'position'), words, DOUBT))
    return found


def _tyres(shapes: Sequence[Shape]) -> list[Shape]:
    """Return the largest cylinder of each link: others are rims and hubs."""
    found: dict[str, tuple[float, Shape]] = {}
    for shape in shapes:
        if shape.kind == 'cylinder' and shape.size is not None:
            radius = shape.size[0]
            if radius > found.get(shape.link, (0.0, shape))[0]:
                found[shape.link] = radius, shape
    return [shape for _, shape in found.values()]


def _off_lowest(arm: Any, axle: Any, size: Vector) -> str | None:  # noqa: ANN401 - arrays (3,)
    """Return how a point in the footprint of a wheel misses its lowest point; None if it does not.

    `arm` (3,), m, is from the wheel's middle.
    """
    radius, aside = size[0], float(arm @ axle)
    ahead = float(np.linalg.norm((arm - aside * axle)[:2]))
    slack = max(UNDER, UNDER_SHARE * radius)
    beyond, high = abs(aside) - size[2], float(arm[2]) + radius
    in_line = ahead <= slack and abs(high) <= slack
    # A wheel that is said to be wider than it is would tip without a warning.
    if in_line and slack < beyond <= radius:
        return f'{1e3 * beyond:.0f} mm beyond its side'
    if in_line or beyond > BESIDE or ahead > radius:
        return None
    side = 'above' if high > -5e-4 else 'below'
    return f'{1e3 * ahead:.0f} mm off along the ground and {1e3 * abs(high):.0f} mm {side} it'
