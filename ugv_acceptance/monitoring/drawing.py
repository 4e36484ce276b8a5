"""Shapes of the robot for viewers: limbs, support polygon, centre of gravity, plumb line."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from ugv_acceptance.bag.encode_views import Colour, Shape
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.expressions import (
    add,
    cross,
    dot,
    rotate,
    scale,
    subtract,
)
from ugv_acceptance.model.kernels import Kernel, compile_kernel
from ugv_acceptance.model.mechanics import Mechanics, mechanics_of, posture_of
from ugv_acceptance.model.robot import Payload, Robot, Vector
from ugv_acceptance.model.solids import Place, Solid, moving_bodies, solids_of
from ugv_acceptance.model.stability import stances_of, standing
from ugv_acceptance.model.tree import (
    Tree,
    body_positions,
    drives_of,
    point_of,
    pose_of,
)
from ugv_acceptance.monitoring.footprint import seen_from

# Points of one body closer together than this (m) are drawn as one.
_SAME = 0.02
# A point further away than this (m) is not drawn.
_FAR = 1e3


@dataclass(frozen=True, slots=True)
class Limb:
    """A straight line to draw that moves with `joint`: from it to a next joint or end (m)."""

    joint: str
    start: Vector
    end: Vector


@dataclass(frozen=True, slots=True, eq=False)
class Figure:
    """The compiled drawing of a robot, made once: its limbs, and a box for its body (m).

    `joints` are the joints of the limbs. `ends(*q, *cog)` returns (start, end) of each limb, then
    rotation and origin of each of `bodies`, the moving bodies of the `solids`, and, if the robot
    can carry a payload, the payload's centre of gravity.
    """

    mechanics: Mechanics
    joints: tuple[str, ...]
    ends: Kernel
    box: tuple[Vector, Vector]
    solids: tuple[Solid, ...]
    bodies: tuple[int, ...]

    def shape_of(self, joint: str) -> bool:
        """Return whether what hangs on a joint has a solid of its own."""
        tree = self.mechanics.tree
        return any(tree.bodies[body].joint == joint for body in self.bodies)


@dataclass(frozen=True, slots=True)
class Skeleton:
    """The points of a robot in one posture, in `base_link` (m).

    `polygon` is the support polygon, counter-clockwise from above; empty if there is none. `body`
    are the lower and the upper corner of a box that stands for the body. `plumb` is where the line
    through the centre of gravity along gravity meets the plane of the polygon: the robot stands
    while it is inside. None if gravity or the polygon are not known. `places` are where each of the
    figure's `bodies` is.
    """

    limbs: tuple[Limb, ...]
    body: tuple[Vector, Vector]
    contacts: tuple[Vector, ...]
    polygon: tuple[Vector, ...]
    cog: Vector
    plumb: Vector | None
    load: Vector | None
    places: tuple[Place, ...] = ()


def figure_of(robot: Robot) -> Figure:
    """Compile the drawing of a robot; do it once."""
    mechanics = mechanics_of(robot)
    tree = mechanics.tree
    tips = _tips(robot, tree)
    drives, solids = drives_of(robot, tree), solids_of(robot)
    bodies = moving_bodies(solids)

    def formula(*inputs: Any) -> list[Any]:  # noqa: ANN401 - floats, or the kernel's symbols
        *q, x, y, z = inputs
        pose = pose_of(tree, body_positions(drives, q))
        found: list[Any] = [
            (pose.origin[body], add(pose.origin[body], rotate(pose.rotation[body], tip)))
            for body, tip in tips
        ]
        found += [(pose.rotation[body], pose.origin[body]) for body in bodies]
        if robot.payload_link is not None:
            found.append(point_of(tree, pose, robot.payload_link, (x, y, z))[1])
        return found

    kernel = compile_kernel(formula, [*robot.joint_names, 'x', 'y', 'z'])
    joints = tuple(robot.joint_names[drives[body - 1].joint] for body, _ in tips)
    return Figure(mechanics, joints, kernel, _box(robot, tree), solids, bodies)


def skeleton_of(
    figure: Figure, q: Sequence[float], gravity: Vector, payload: Payload
) -> Skeleton | None:
    """Return the points of a posture `q` (j,); None if a position is not known."""
    mechanics, robot = figure.mechanics, figure.mechanics.robot
    if len(q) != len(robot.joint_names) or not all(map(math.isfinite, q)):
        return None
    posture = posture_of(mechanics, tuple(q), payload.mass, payload.cog)
    contacts: Any = posture.contacts
    cog: Any = posture.cog
    footing = standing(stances_of(mechanics, posture), gravity).footing
    polygon = tuple(contacts[k] for k in footing.polygon) if footing else ()
    ends = figure.ends.one(*q, *payload.cog)
    limbs = tuple(Limb(joint, *found) for joint, found in zip(figure.joints, ends, strict=False))
    load = ends[-1] if robot.payload_link is not None and payload.mass > 0.0 else None
    plumb = plumb_of(cog, gravity, polygon)
    places = tuple(ends[len(limbs) : len(limbs) + len(figure.bodies)])
    return Skeleton(limbs, figure.box, tuple(contacts), polygon, cog, plumb, load, places)


def _tips(robot: Robot, tree: Tree) -> tuple[tuple[int, Vector], ...]:
    """Return (body, end in body axes) of every limb: to child joints, links and contacts."""
    found: list[tuple[int, Any]] = []
    for body in range(1, len(tree.bodies)):
        ends: list[Any] = [b.offset for b in tree.bodies if b.parent == body]
        ends += [at for owner, _, at in tree.frames.values() if owner == body]
        for contact in robot.contacts:
            owner, rotation, xyz = tree.frames[contact.link]
            if owner == body:
                ends.append(add(xyz, rotate(rotation, contact.position)))
        kept: list[Any] = []
        for end in ends:
            apart = all(math.dist(end, other) > _SAME for other in [(0.0, 0.0, 0.0), *kept])
            kept += [end] if apart else []
        found += [(body, end) for end in kept]
    return tuple(found)


def _box(robot: Robot, tree: Tree) -> tuple[Vector, Vector]:
    """Return a box around the base's contact points, up to the joints attached to the base."""
    roots = [b.offset for b in tree.bodies[1:] if b.parent == 0]
    points: list[Any] = [*roots]
    for contact in robot.contacts:
        owner, rotation, xyz = tree.frames[contact.link]
        if owner == 0:
            points.append(add(xyz, rotate(rotation, contact.position)))
    if not points:
        return (-0.1, -0.1, 0.0), (0.1, 0.1, 0.1)
    x, y, z = zip(*points, strict=True)
    low = min(robot.ground, *z) if len(z) > 1 else robot.ground
    return (min(x), min(y), low), (max(x), max(y), max(z))


def plumb_of(cog: Vector, gravity: Vector, polygon: Sequence[Vector]) -> Vector | None:
    """Return where the line through `cog` along gravity meets the polygon's plane, else None."""
    if len(polygon) < 3 or not all(map(math.isfinite, gravity)):
        return None
    a, b, c = polygon[:3]
    normal = cross(subtract(b, a), subtract(c, a))
    down: Any = dot(normal, gravity)
    # Gravity along the ground, or from below: the plumb line does not meet it.
    if not down < 0.0:
        return None
    way: Any = dot(normal, subtract(a, cog)) / down
    point = _numbers(add(cog, scale(gravity, way)))
    # With gravity almost along the ground the point would be too far away to draw.
    return point if max(map(abs, point)) < _FAR else None


def _numbers(v: Sequence[Any]) -> Vector:
    """Return a vector as floats; given floats, the model's formulas return floats."""
    x, y, z = v
    return float(x), float(y), float(z)


# Seconds between drawings; markers vanish after LIFETIME (s) when the monitor has died.
PERIOD, LIFETIME = 0.1, 0.5
NAMES = ('support', 'worst_edge', 'cog', 'plumb', 'limbs', 'words')
# Kinds as visualization_msgs/Marker numbers them.
LINE_STRIP, LINE_LIST, SPHERE_LIST, TEXT = 4, 5, 7, 9

GREEN, AMBER = (0.1, 0.6, 0.2, 1.0), (1.0, 0.75, 0.0, 1.0)
RED, BLUE = (0.8, 0.0, 0.1, 1.0), (0.0, 0.3, 0.8, 1.0)
# Outward direction in `base_link` of each of SIDES.
_OUTWARD = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))


def shapes_of(skeleton: Skeleton, margins: Margins, settings: Settings) -> tuple[Shape, ...]:
    """Return the shapes of one posture, one for each of NAMES, in the axes of `settings.frame`."""
    shapes = _in_root(skeleton, margins, settings)
    seen = seen_from(settings)
    if seen is None:
        return shapes
    return tuple(
        replace(shape, points=tuple(map(seen, shape.points)), position=seen(shape.position))
        for shape in shapes
    )


def _in_root(skeleton: Skeleton, margins: Margins, settings: Settings) -> tuple[Shape, ...]:
    """Return the shapes in the axes of the robot's root link."""
    angles = [float(a) for a in margins.angle]
    colour = _tip_colour(min(angles), settings)
    outline = (*skeleton.polygon, *skeleton.polygon[:1])
    under = () if skeleton.plumb is None else (skeleton.cog, skeleton.plumb)
    limbs = tuple(point for limb in skeleton.limbs for point in (limb.start, limb.end))
    uses = tuple(c for limb in skeleton.limbs for c in [_use(limb.joint, margins, settings)] * 2)
    x, y, z = skeleton.cog
    return (
        Shape('support', LINE_STRIP, BLUE, 0.01, outline),
        Shape('worst_edge', LINE_LIST, colour, 0.03, _edge_towards(skeleton.polygon, angles)),
        Shape('cog', SPHERE_LIST, colour, 0.06, (skeleton.cog,)),
        Shape('plumb', LINE_LIST, colour, 0.01, under),
        Shape('limbs', LINE_LIST, BLUE, 0.03, limbs, uses),
        Shape('words', TEXT, colour, 0.08, text=_words(min(angles)), position=(x, y, z + 0.3)),
    )


def _words(least: float) -> str:
    return f'{math.degrees(least):.1f} deg left' if math.isfinite(least) else 'no tilt margin'


def _edge_towards(polygon: Sequence[Vector], angles: Sequence[float]) -> tuple[Vector, ...]:
    """Return both ends of the edges that lie on the side with the least tilt left."""
    x, y = _OUTWARD[min(range(len(angles)), key=lambda k: angles[k])]
    points: list[Vector] = []
    for a, b in zip(polygon, [*polygon[1:], *polygon[:1]], strict=True):
        outward = (b[1] - a[1], a[0] - b[0])
        if outward[0] * x + outward[1] * y > 0.7 * math.hypot(*outward):
            points += [a, b]
    return tuple(points)


def _tip_colour(least: float, settings: Settings) -> Colour:
    limits = settings.limits
    # Written so that NaN (no margin) is red.
    if not least > limits.tip_error:
        return RED
    return AMBER if least <= limits.tip_warn else GREEN


def _use(joint: str, margins: Margins, settings: Settings) -> Colour:
    j, limits = settings.robot.joint_names.index(joint), settings.limits
    use = abs(margins.torque[j]) / limits.torque[j]
    if not use < limits.torque_error:
        return RED
    return AMBER if use >= limits.torque_warn else GREEN
