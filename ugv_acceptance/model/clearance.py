"""How high the arm is above the ground on which the robot stands.

The arm is what hangs on moving joints and carries no contact point. Its collision geometry (boxes,
cylinders, spheres) is taken exactly; a link without any, or with a mesh, by its joints and the load
point. The ground is the plane of the contact points that carry the robot.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ugv_acceptance.model.expressions import (
    Scalar,
    Vec,
    copysign,
    cross,
    dot,
    matmul,
    minimum,
    rotate,
    scale,
    sqrt,
    subtract,
    transpose,
)
from ugv_acceptance.model.kernels import Kernel, compile_kernel
from ugv_acceptance.model.mechanics import Mechanics, Triple
from ugv_acceptance.model.robot import IDENTITY, Matrix, Robot, Shape, Vector
from ugv_acceptance.model.row_selection import ALL, Rows, Values
from ugv_acceptance.model.tree import (
    Pose,
    Tree,
    body_positions,
    drives_of,
    in_body,
    point_of,
    pose_of,
    tree_of,
)
from ugv_acceptance.type_aliases import Floats

# Three contact numbers whose plane is the ground; None: the tracks' ground plane.
Face = tuple[int, int, int] | None
# Encoder zeros are set to about a degree (rad), contact points and lengths to some millimetres (m):
# so far from the ground the arm may touch it all the same.
ZERO_ERROR, LENGTH_ERROR = math.radians(1.0), 0.005
# Clearance (m) that is kept wherever the arm is sent: hand and load have a size.
CLEARANCE = 0.06
# Postures tried, and half the travel (m) of a slide without limits.
POSTURES, HALF_SLIDE = 64, 0.5
# Contact points a robot needs to stand on the ground: with fewer nobody knows where it is.
STANDS = 3
# A part is of an arm if its height changes by more than MOVES (m) and it comes higher than LIFTED.
MOVES, LIFTED = 1e-6, 0.05
# The name of the part that is the point of the load; normals of level ground and of another.
LOAD, LEVEL, SLOPING = 'load', (0.0, 0.0, 1.0), (0.36, 0.48, 0.8)


@dataclass(frozen=True, slots=True)
class _Part:
    """A shape of the arm in the axes of its body; `size` (m) is 0 for a point."""

    name: str
    body: int
    kind: str
    centre: Vector
    rotation: Matrix
    size: Vector


@dataclass(frozen=True, slots=True, eq=False)
class _Ground:
    """The compiled clearance above one ground plane: the least, and that of each part."""

    least: Kernel
    each: Callable[..., tuple[Scalar, ...]]


@dataclass(frozen=True, slots=True)
class Nearness:
    """How far each joint moves the arm at most (m per rad; m per m), and when it touches (m).

    Below a clearance of `touches` the arm may stand on the ground, from `clear` on it does not.
    """

    levers: tuple[float, ...]
    touches: float
    clear: float


def arm_links(robot: Robot) -> tuple[str, ...]:
    """Return the links of the arm: on moving joints, none of which moves a contact point."""
    tree = tree_of(robot)
    carrying = {0}
    for contact in robot.contacts:
        body = tree.frames[contact.link][0]
        while body not in carrying:
            carrying.add(body)
            body = tree.bodies[body].parent
    return tuple(name for name, (body, _, _) in tree.frames.items() if body not in carrying)


def unread_links(mechanics: Mechanics) -> tuple[str, ...]:
    """Return the links of the arm with a collision geometry that is not read, such as a mesh."""
    moving = {part.name for part in _parts(mechanics)}
    found = (s.link for s in mechanics.robot.shapes if s.size is None and s.link in moving)
    return tuple(dict.fromkeys(found))


def is_fixed(mechanics: Mechanics, face: Face) -> bool:
    """Return whether no joint moves the ground plane of this face in `base_link`."""
    robot, frames = mechanics.robot, mechanics.tree.frames
    return face is None or all(frames[robot.contacts[k].link][0] == 0 for k in face)


def clearance(mechanics: Mechanics, face: Face, q: Sequence[Values], load: Triple) -> Values:
    """Return how high the arm's lowest point is above the ground (m), negative below; inf: no arm.

    `q` (j,) rad or m and `load`, the centre of gravity of the payload in the axes of its link (m),
    are floats or arrays.
    """
    ground = _ground_of(mechanics, face)
    return math.inf if ground is None else ground.least.run(*q, *load)[0]


def clearance_at(
    mechanics: Mechanics, face: Face, q: Sequence[Values], load: Triple, rows: Rows
) -> Values:
    """Return `clearance` of some rows of columns, as an array."""
    height = clearance(mechanics, face, q, load)
    return np.broadcast_to(height, len(q[0]) if q else 1)[rows if q else ALL]


def lowest_part(mechanics: Mechanics, face: Face, q: Sequence[float], load: Triple) -> str:
    """Return the name of the link that is nearest to the ground, or load; '' without an arm."""
    ground = _ground_of(mechanics, face)
    if ground is None:
        return ''
    heights = [float(x) for x in ground.each(*map(float, (*q, *load)))]  # type: ignore[arg-type]
    return _parts(mechanics)[int(np.argmin(heights))].name


@lru_cache(maxsize=16)
def nearness_of(mechanics: Mechanics, load: Triple | None = None) -> Nearness:
    """Return what bounds the clearance of a robot with its load at `load` (m); None: its own."""
    robot, tree = mechanics.robot, mechanics.tree
    far, held = [0.0] * len(tree.bodies), [False] * len(tree.bodies)
    for part in _parts(mechanics):
        centre = math.hypot(*part.centre)
        if part.name == LOAD and load is not None:
            centre = math.hypot(*in_body(tree, str(robot.payload_link), load)[1])  # type: ignore[arg-type]
        far[part.body] = max(far[part.body], centre + math.hypot(*part.size))
        held[part.body] = True
    levers, drives = [0.0] * len(robot.joint_names), drives_of(robot, tree)
    for k in range(len(tree.bodies) - 1, 0, -1):
        if not held[k]:
            continue
        body, joint = tree.bodies[k], robot.joint(tree.bodies[k].joint)
        drive = drives[k - 1]
        levers[drive.joint] += abs(drive.multiplier) * (1.0 if body.prismatic else far[k])
        slide = max(map(abs, (joint.lower, joint.upper))) if body.prismatic else 0.0
        far[body.parent] = max(far[body.parent], math.hypot(*body.offset) + slide + far[k])
        held[body.parent] = True
    known = [x for x in levers if math.isfinite(x)]
    touches = max(LENGTH_ERROR, ZERO_ERROR * max(known, default=0.0))
    return Nearness(tuple(levers), touches, 1.5 * touches)


@lru_cache(maxsize=16)
def _parts(mechanics: Mechanics) -> tuple[_Part, ...]:
    """Return the parts of the arm that can be lifted off the ground.

    What cannot, in any of many postures, is a wheel or a skirt, which has no contact point of its
    own because it stands on the ground; what always is in one place is part of the body.
    """
    robot, tree = mechanics.robot, mechanics.tree
    found = tuple(_all_parts(robot, tree))
    if not found or len(robot.contacts) < STANDS:
        return ()
    random = np.random.default_rng(0)
    travels = [robot.joint(name).travel(HALF_SLIDE) for name in robot.joint_names]
    q: list[Any] = [random.uniform(*travel, POSTURES) for travel in travels]
    pose = pose_of(tree, body_positions(drives_of(robot, tree), q))
    level, sloping = (
        np.array([np.broadcast_to(_array(h), POSTURES) for h in heights])
        for heights in (_heights(found, pose, n, robot.ground) for n in (LEVEL, SLOPING))
    )
    moves = (np.ptp(level, axis=1) > MOVES) | (np.ptp(sloping, axis=1) > MOVES)
    keep = moves & (level.max(axis=1) > LIFTED)
    return tuple(part for part, kept in zip(found, keep.tolist(), strict=True) if kept)


def _array(height: Values) -> Floats:
    return np.asarray(height, dtype=np.float64)


def _all_parts(robot: Robot, tree: Tree) -> Iterator[_Part]:
    arm = set(arm_links(robot))
    shapes = [s for s in robot.shapes if s.link in arm and s.size is not None]
    for shape in shapes:
        yield _of_shape(tree, shape)
    bare = arm - {shape.link for shape in shapes}
    for link in sorted(bare):
        yield _point(tree, link, link, (0.0, 0.0, 0.0))
    for joint in robot.joints:
        if joint.parent in bare and joint.child not in bare:
            yield _point(tree, joint.parent, joint.parent, joint.xyz)
    if robot.payload_link in arm:
        yield _point(tree, LOAD, str(robot.payload_link), robot.payload.cog)


def _point(tree: Tree, name: str, link: str, xyz: Vector) -> _Part:
    body, at = in_body(tree, link, xyz)
    return _Part(name, body, 'sphere', _plain(at), IDENTITY, (0.0, 0.0, 0.0))


def _of_shape(tree: Tree, shape: Shape) -> _Part:
    body, at = in_body(tree, shape.link, shape.xyz)
    turned = matmul(tree.frames[shape.link][1], shape.rotation)
    x, y, z = (_plain(row) for row in turned)
    size = (0.0, 0.0, 0.0) if shape.size is None else shape.size
    return _Part(shape.link, body, shape.kind, _plain(at), (x, y, z), size)


def _plain(v: Vec) -> Vector:
    """Return a vector of numbers, rounded so that right angles make short formulas."""
    x, y, z = (round(float(c), 12) for c in v)  # type: ignore[arg-type]  # numbers in and out
    return (x, y, z)


def _heights(
    parts: Sequence[_Part], pose: Pose, normal: Vec, offset: Scalar, load: Vec | None = None
) -> list[Scalar]:
    """Return each part's least height (m) above the plane of points p with normal . p = offset.

    `load` is the load's point in its body's axes, in place of the robot's own.
    """
    local: dict[int, tuple[Vec, Scalar]] = {}
    for k in {part.body for part in parts}:
        turned = rotate(transpose(pose.rotation[k]), normal)
        local[k] = turned, dot(normal, pose.origin[k]) - offset
    found = []
    for part in parts:
        down, origin = local[part.body]
        centre: Vec = part.centre
        if part.name == LOAD and load is not None:
            centre = load
        found.append(origin + dot(down, centre) - _reach(part, down))
    return found


def _reach(part: _Part, down: Vec) -> Scalar:
    """Return how far (m) a part reaches from its centre along a unit vector: its support."""
    if part.kind == 'sphere':
        return part.size[0]
    x, y, z = (dot(axis, down) for axis in transpose(part.rotation))
    if part.kind == 'cylinder':
        return _size(z) * part.size[2] + sqrt(x * x + y * y) * part.size[0]
    return _size(x) * part.size[0] + _size(y) * part.size[1] + _size(z) * part.size[2]


def _size(x: Scalar) -> Scalar:
    return copysign(x, 1.0)


@lru_cache(maxsize=64)
def _ground_of(mechanics: Mechanics, face: Face) -> _Ground | None:
    """Return the compiled clearance above the plane of a face; None if there is no arm."""
    robot, tree, parts = mechanics.robot, mechanics.tree, _parts(mechanics)
    if not parts:
        return None
    drives = drives_of(robot, tree)

    def each(*inputs: Scalar) -> tuple[Scalar, ...]:
        q, load = inputs[:-3], (inputs[-3], inputs[-2], inputs[-1])
        pose = pose_of(tree, body_positions(drives, q))
        hangs = None
        if robot.payload_link is not None:
            hangs = in_body(tree, robot.payload_link, load)[1]
        return tuple(_heights(parts, pose, *_plane(robot, tree, pose, face), hangs))

    def least(*inputs: Scalar) -> tuple[Scalar]:
        lowest, *others = each(*inputs)
        for height in others:
            lowest = minimum(lowest, height)
        return (lowest,)

    inputs = [*robot.joint_names, 'load_x', 'load_y', 'load_z']
    return _Ground(compile_kernel(least, inputs), each)


def _plane(robot: Robot, tree: Tree, pose: Pose, face: Face) -> tuple[Vec, Scalar]:
    """Return upward unit normal and offset (m) of the plane through a face's contact points."""
    if face is None:
        return LEVEL, robot.ground
    contacts = [robot.contacts[k] for k in face]
    a, b, c = (point_of(tree, pose, x.link, x.position)[1] for x in contacts)
    across = cross(subtract(b, a), subtract(c, a))
    size = sqrt(dot(across, across))
    if isinstance(size, float) and not size > 0.0:
        return LEVEL, robot.ground
    normal = scale(across, copysign(1.0, across[2]) / size)
    return normal, dot(normal, a)
