"""Compiles torques and tipping moments as a function of the uncertain numbers of a risk study.

The same formulas as for every other margin, compiled with a symbol for each uncertain number and
constants for the rest, so that what does not vary costs nothing.
"""

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from ugv_acceptance import BadConfig
from ugv_acceptance.model.dynamics import Load, joint_forces, motion_of
from ugv_acceptance.model.expressions import (
    Scalar,
    Vec,
    add,
    cos,
    cross,
    dot,
    matmul,
    rotate,
    scale,
    sin,
    sqrt,
    subtract,
    transpose,
)
from ugv_acceptance.model.kernels import Kernel, compile_kernel
from ugv_acceptance.model.mechanics import laws_of, mechanics_of
from ugv_acceptance.model.robot import NO_INERTIA, Link, Robot
from ugv_acceptance.model.support import flat_polygon, pairs
from ugv_acceptance.model.tree import (
    Pose,
    Tree,
    body_positions,
    drives_of,
    folded,
    point_of,
    pose_of,
    tree_of,
)

AXES = ('x', 'y', 'z')


@dataclass(frozen=True, slots=True, eq=False)
class RiskKernel:
    """A compiled formula whose inputs are the uncertain numbers `names`, in their order.

    Outputs: the torque of each joint judged; then, if the support polygon cannot change
    (`edges` > 0), the moment (N m) that holds the robot down about each edge, else the mass, the
    centre of gravity (3), gravity (3) and the contacts (3 each).
    """

    names: tuple[str, ...]
    kernel: Kernel
    edges: int


def known_names(robot: Robot) -> tuple[str, ...]:
    """Return the names of all numbers of a robot that may be uncertain.

    `slope` (rad) and `heading` (rad, of the uphill direction in `base_link`); JOINT.position,
    .rate, .x, .y, .z (where the joint sits in its parent) and .limit; LINK.mass and its centre of
    gravity .x, .y, .z; payload.mass, .x, .y, .z.
    """
    joints = [f'{j}.{part}' for j in robot.joint_names for part in ('position', 'rate', *AXES)]
    limits = [f'{j}.limit' for j in robot.joint_names]
    bodies = ['payload', *(link.name for link in robot.links)]
    masses = [f'{b}.{part}' for b in bodies for part in ('mass', *AXES)]
    return ('slope', 'heading', *joints, *limits, *masses)


@lru_cache(maxsize=16)
def risk_kernel(
    robot: Robot, names: tuple[str, ...], fixed: tuple[float, ...], judged: tuple[str, ...]
) -> RiskKernel:
    """Return the kernel in which `names` vary; the joints' nominal positions are `fixed` (j,).

    Torques are those of the joints `judged`. Raises BadConfig for a name the robot does not have.
    """
    unknown = [name for name in names if name not in known_names(robot)]
    if unknown:
        joint = robot.joint_names[0] if robot.joint_names else 'JOINT'
        raise BadConfig(
            f'{unknown[0]}: expected slope, heading, payload.mass, a joint ({joint}'
            f'.position, .rate, .limit, .x) or a link ({robot.links[0].name}.mass, .x)'
        )
    tree = _without(robot, names)
    edges = 0

    def formula(*inputs: Scalar) -> list[Scalar]:
        nonlocal edges
        values = dict(zip(names, inputs, strict=True))
        torques, stand = _outputs(robot, tree, fixed, values, judged)
        moments = _fixed_edges(robot, stand)
        edges = len(moments)
        rest = moments or [
            stand.mass,
            *stand.cog,
            *stand.gravity,
            *(x for p in stand.contacts for x in p),
        ]
        return [*torques, *rest]

    kernel = compile_kernel(formula, list(names))
    return RiskKernel(names, kernel, edges)


@dataclass(frozen=True, slots=True)
class _Stand:
    """The numbers that decide whether the robot tips: kg, m, m/s2, in `base_link`."""

    mass: Scalar
    cog: Vec
    gravity: Vec
    contacts: list[Vec]


def _fixed_edges(robot: Robot, stand: _Stand) -> list[Scalar]:
    """Return the moment (N m) about each tip edge; an empty list if the polygon can change."""
    if not stand.contacts or not all(isinstance(x, float) for p in stand.contacts for x in p):
        return []
    return [
        moment_about(
            stand.contacts[i], stand.contacts[j], stand.cog, scale(stand.gravity, stand.mass)
        )
        for i, j in pairs(flat_polygon(mechanics_of(robot), stand.contacts))  # type: ignore[arg-type]  # floats
    ]


def moment_about(start: Vec, end: Vec, cog: Vec, weight: Vec) -> Scalar:
    """Return the moment (N m) about an edge (m) of a weight (N) at `cog`: positive holds down."""
    edge = subtract(end, start)
    along = scale(edge, 1.0 / sqrt(dot(edge, edge)))
    return dot(cross(weight, subtract(cog, start)), along)


def _outputs(
    robot: Robot,
    tree: Tree,
    fixed: Sequence[float],
    values: Mapping[str, Scalar],
    judged: Sequence[str],
) -> tuple[list[Scalar], _Stand]:
    tree = _moved(tree, values)
    names, drives = robot.joint_names, drives_of(robot, tree)
    q = [values.get(f'{name}.position', float(fixed[k])) for k, name in enumerate(names)]
    own = [values.get(f'{name}.rate', 0.0) for name in names]
    rates = [own[d.joint] * d.multiplier for d in drives]
    pose = pose_of(tree, body_positions(drives, q))
    gravity = _gravity(robot.gravity, values)
    loads = _loads(robot, tree, pose, values)
    motion = motion_of(tree, pose, rates, [0.0] * len(rates), gravity)
    forces = folded(drives, joint_forces(tree, pose, motion, loads), len(names))
    laws = laws_of(robot, q) or (0.0,) * len(names)
    torques = [forces[k] - laws[k] for k in (names.index(name) for name in judged)]
    contacts = [point_of(tree, pose, c.link, c.position)[1] for c in robot.contacts]
    mass, x, y, z = _weight(tree, pose, loads)
    return torques, _Stand(mass, (x, y, z), gravity, contacts)


def _gravity(size: float, values: Mapping[str, Scalar]) -> Vec:
    """Return gravity (m/s2, `base_link`) on a slope; heading is the uphill side, 0 the front."""
    slope, heading = values.get('slope', 0.0), values.get('heading', 0.0)
    return scale((sin(slope) * cos(heading), sin(slope) * sin(heading), cos(slope)), -size)


def _moved(tree: Tree, values: Mapping[str, Scalar]) -> Tree:
    """Return the tree with uncertain joint positions in the parent link replaced by `values`."""
    bodies = list(tree.bodies)
    for k, body in enumerate(bodies):
        offset: Any = tuple(
            values.get(f'{body.joint}.{axis}', at)
            for axis, at in zip(AXES, body.offset, strict=True)
        )
        bodies[k] = replace(body, offset=offset)
    return Tree(tuple(bodies), tree.frames)


def _point(values: Mapping[str, Scalar], name: str, nominal: Vec) -> Vec:
    x, y, z = (values.get(f'{name}.{a}', c) for a, c in zip(AXES, nominal, strict=True))
    return (x, y, z)


def _loads(robot: Robot, tree: Tree, pose: Pose, values: Mapping[str, Scalar]) -> list[Load]:
    """Return the payload and each uncertain link as point masses."""
    loads: list[Load] = []
    if robot.payload_link is not None:
        cog = _point(values, 'payload', robot.payload.cog)
        body, point = point_of(tree, pose, robot.payload_link, cog)
        loads.append(Load(body, values.get('payload.mass', robot.payload.mass), point))
    for link in robot.links:
        if _varies(link, values):
            cog = _point(values, link.name, link.cog)
            body, point = point_of(tree, pose, link.name, cog)
            loads.append(Load(body, values.get(f'{link.name}.mass', link.mass), point))
    return loads


def _varies(link: Link, names: Container[str]) -> bool:
    return any(f'{link.name}.{part}' in names for part in ('mass', *AXES))


def _without(robot: Robot, names: Container[str]) -> Tree:
    """Return the tree without the masses of uncertain links; `_loads` adds them as point masses."""
    links = tuple(replace(k, mass=0.0) if _varies(k, names) else k for k in robot.links)
    tree = tree_of(replace(robot, links=links))
    bodies = list(tree.bodies)
    for link in links:
        k, turned, _ = tree.frames[link.name]
        if bodies[k].mass == 0.0 and link.inertia != NO_INERTIA:  # lumping nothing lost it
            inertia = matmul(matmul(turned, link.inertia), transpose(turned))
            both: Any = tuple(add(a, b) for a, b in zip(bodies[k].inertia, inertia, strict=True))
            bodies[k] = replace(bodies[k], inertia=both)
    return Tree(tuple(bodies), tree.frames)


def _weight(tree: Tree, pose: Pose, loads: Sequence[Load]) -> list[Scalar]:
    """Return the whole robot's mass (kg) and the coordinates of its centre of gravity (m)."""
    mass: Scalar = 0.0
    moment: Vec = (0.0, 0.0, 0.0)
    for k, body in enumerate(tree.bodies):
        centre = add(pose.origin[k], rotate(pose.rotation[k], body.cog))
        mass, moment = mass + body.mass, add(moment, scale(centre, body.mass))
    for load in loads:
        mass, moment = mass + load.mass, add(moment, scale(load.point, load.mass))
    return [mass, *scale(moment, 1.0 / mass)]
