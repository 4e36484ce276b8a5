"""The moving bodies of a robot as a kinematic tree, and their poses.

Links joined by fixed or held joints are lumped into one body. Every body's axes are parallel to
`base_link` when all joints are at zero, so no constant rotation between joints is needed.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from ugv_acceptance import BadConfig
from ugv_acceptance.model.expressions import (
    Mat,
    Scalar,
    Vec,
    add,
    cos,
    matmul,
    rotate,
    scale,
    sin,
    subtract,
    transpose,
)
from ugv_acceptance.model.robot import IDENTITY, NO_INERTIA, ZERO, Joint, Matrix, Robot, Vector


@dataclass(frozen=True, slots=True)
class Body:
    """All links that move rigidly with one joint; vectors in base axes at the zero posture.

    `offset` (m) is from the parent body's origin to this one's (on the joint axis), `cog` from
    this origin; `inertia` (kg m2) is about the centre of gravity.
    """

    joint: str
    parent: int
    prismatic: bool
    axis: Vector
    offset: Vector
    mass: float
    cog: Vector
    inertia: Matrix


@dataclass(frozen=True, slots=True)
class Tree:
    """The kinematic tree: bodies, parents first; body 0 is the base, its own parent.

    `frames` gives for each link its body's number, and the link's rotation and origin (m) in it.
    """

    bodies: tuple[Body, ...]
    frames: dict[str, tuple[int, Matrix, Vector]]


@dataclass(frozen=True, slots=True)
class Drive:
    """What moves a body: its position is multiplier * position of joint number `joint` + offset.

    The number is an index into `robot.joint_names`; rad, or m if the body slides.
    """

    joint: int
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class Pose:
    """Rotation, origin (m) and joint axis of every body, in `base_link`."""

    rotation: list[Mat]
    origin: list[Vec]
    axis: list[Vec]


@dataclass(frozen=True, slots=True)
class _Frame:
    """Where a link is: its body, and its axes and origin in the body's zero-posture axes."""

    body: int
    rotation: Matrix
    xyz: Vector


def rotation_about(axis: Vec, angle: Scalar) -> Mat:
    """Return the rotation matrix about a unit axis by an angle (rad): Rodrigues' formula."""
    x, y, z = axis
    s, c = sin(angle), cos(angle)
    v = 1.0 - c
    return (
        (x * x + (1.0 - x * x) * c, x * y * v - z * s, x * z * v + y * s),
        (y * x * v + z * s, y * y + (1.0 - y * y) * c, y * z * v - x * s),
        (z * x * v - y * s, z * y * v + x * s, z * z + (1.0 - z * z) * c),
    )


@lru_cache(maxsize=256)  # a run's uncertainty asks for a hundred robots, each off by a little
def tree_of(robot: Robot) -> Tree:
    """Return the kinematic tree of `robot`; BadConfig if its joints do not form a tree."""
    frames, moving = _place_links(robot)
    members: list[list[tuple[float, Vector, Matrix]]] = [[] for _ in moving]
    for link in robot.links:
        frame = frames[link.name]
        cog = plain(add(frame.xyz, rotate(frame.rotation, link.cog)))
        inertia = matmul(matmul(frame.rotation, link.inertia), transpose(frame.rotation))
        members[frame.body].append((link.mass, cog, _plain_matrix(inertia)))
    bodies = []
    for k, (joint, parent) in enumerate(moving):
        at = plain(add(parent.xyz, rotate(parent.rotation, joint.xyz)))
        axis = plain(rotate(frames[joint.child].rotation, joint.axis))
        bodies.append(Body(joint.name, parent.body, joint.slides, axis, at, *_lump(members[k])))
    return Tree(tuple(bodies), {n: (f.body, f.rotation, f.xyz) for n, f in frames.items()})


def drives_of(robot: Robot, tree: Tree) -> tuple[Drive, ...]:
    """Return what moves each moving body: its own joint, or that which its joint mimics."""
    number = {name: k for k, name in enumerate(robot.joint_names)}
    found = {name: Drive(k) for name, k in number.items()}
    found |= {
        m.joint: Drive(number[m.follows], m.multiplier, m.offset)
        for m in robot.mimics
        if m.joint not in number
    }
    return tuple(found[body.joint] for body in tree.bodies[1:])


def body_positions(drives: Sequence[Drive], q: Sequence[Scalar]) -> list[Scalar]:
    """Return the position of every moving body for those of the joints, `q` (j) in rad or m."""
    return [q[d.joint] * d.multiplier + d.offset for d in drives]


def folded(drives: Sequence[Drive], values: Sequence[Scalar], joints: int) -> list[Scalar]:
    """Return what `joints` joints carry, given what each body does, each by its multiplier.

    By the principle of virtual work: a body that turns twice as far loads its joint twice as much.
    """
    found: list[Scalar] = [0.0] * joints
    for drive, value in zip(drives, values, strict=True):
        found[drive.joint] = found[drive.joint] + value * drive.multiplier
    return found


def _place_links(robot: Robot) -> tuple[dict[str, _Frame], list[tuple[Joint, _Frame]]]:
    """Return each link's frame, and the moving joints with their parents' frames, parents first.

    Entry 0 of the joints is a dummy for the base, so that the list has one entry a body.
    """
    children: dict[str, list[Joint]] = {}
    for joint in robot.joints:
        children.setdefault(joint.parent, []).append(joint)
    frames = {robot.root: _Frame(0, IDENTITY, ZERO)}
    moving = [(Joint('', 'fixed', '', robot.root), frames[robot.root])]
    held, moved = dict(robot.held), {*robot.joint_names, *(m.joint for m in robot.mimics)}
    waiting = list(children.get(robot.root, ()))
    while waiting:
        joint = waiting.pop(0)
        if joint.child in frames:
            raise BadConfig(f'joint {joint.name}: link {joint.child} has a parent already')
        at = None if joint.name in moved else held.get(joint.name, 0.0)
        frames[joint.child] = _child_frame(joint, frames, moving, at)
        waiting += children.get(joint.child, ())
    lost = [link.name for link in robot.links if link.name not in frames]
    if lost:
        raise BadConfig(f'links {", ".join(lost)} do not hang on root link {robot.root}')
    return frames, moving


def _child_frame(
    joint: Joint,
    frames: dict[str, _Frame],
    moving: list[tuple[Joint, _Frame]],
    held: float | None,
) -> _Frame:
    """Return the frame of a joint's child, held at a position (rad, m) or moving (None)."""
    parent = frames[joint.parent]
    turned = _plain_matrix(matmul(parent.rotation, joint.rotation))
    if held is None:
        number = len(moving)
        moving.append((joint, parent))
        return _Frame(number, turned, ZERO)
    at = plain(add(parent.xyz, rotate(parent.rotation, joint.xyz)))
    if joint.slides:
        at = plain(add(at, scale(rotate(turned, joint.axis), held)))
    elif joint.kind != 'fixed':
        turned = _plain_matrix(matmul(turned, rotation_about(joint.axis, held)))
    return _Frame(parent.body, turned, at)


def plain(v: Sequence[Scalar]) -> Vector:
    """Return a vector whose coordinates are numbers, as one of floats."""
    x, y, z = (float(c) for c in v)  # type: ignore[arg-type]  # numbers in, numbers out
    return (x, y, z)


def _plain_matrix(m: Sequence[Vec]) -> Matrix:
    a, b, c = (plain(row) for row in m)
    return (a, b, c)


def _lump(parts: list[tuple[float, Vector, Matrix]]) -> tuple[float, Vector, Matrix]:
    """Return mass, centre of gravity and inertia about it of rigidly joined parts (Steiner)."""
    mass = math.fsum(m for m, _, _ in parts)
    if mass == 0.0:
        return 0.0, ZERO, NO_INERTIA
    cog = plain([math.fsum(m * c[k] for m, c, _ in parts) / mass for k in range(3)])
    placed = [(m, plain(subtract(c, cog)), own) for m, c, own in parts]

    def entry(i: int, j: int) -> float:
        return math.fsum(
            own[i][j] + m * (IDENTITY[i][j] * math.fsum(x * x for x in d) - d[i] * d[j])
            for m, d, own in placed
        )

    inertia = [plain([entry(i, j) for j in range(3)]) for i in range(3)]
    return mass, cog, _plain_matrix(inertia)


def pose_of(tree: Tree, q: Sequence[Scalar]) -> Pose:
    """Return the pose of every body for joint positions `q` (one a moving body, rad or m)."""
    pose = Pose([IDENTITY], [ZERO], [ZERO])
    for body, position in zip(tree.bodies[1:], q, strict=True):
        turn = pose.rotation[body.parent]
        axis = rotate(turn, body.axis)
        origin = add(pose.origin[body.parent], rotate(turn, body.offset))
        if body.prismatic:
            origin = add(origin, scale(axis, position))
        else:
            turn = matmul(turn, rotation_about(body.axis, position))
        pose.rotation.append(turn)
        pose.origin.append(origin)
        pose.axis.append(axis)
    return pose


def in_body(tree: Tree, link: str, point: Vec) -> tuple[int, Vec]:
    """Return the body that carries `point` (m, link axes) and the point in the body's axes."""
    body, rotation, xyz = tree.frames[link]
    return body, add(xyz, rotate(rotation, point))


def point_of(tree: Tree, pose: Pose, link: str, point: Vec) -> tuple[int, Vec]:
    """Return the body that carries `point` (m, link axes) and the point in `base_link`."""
    body, local = in_body(tree, link, point)
    return body, add(pose.origin[body], rotate(pose.rotation[body], local))
