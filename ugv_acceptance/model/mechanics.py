"""One robot's formulas, compiled: posture (what depends on joints and payload) and joint forces.

Static torque is linear in gravity, so a posture holds each joint's three levers: the recursion run
under unit gravity along x, y and z. A sample that only brings a new attitude costs three products
a joint.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.model.dynamics import Load, joint_forces, motion_of
from ugv_acceptance.model.expressions import (
    Kernel,
    Number,
    Scalar,
    Vec,
    add,
    compile_kernel,
    rotate,
    scale,
)
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.tree import Pose, Tree, point_of, pose_of, tree_of

Triple = tuple[Number, Number, Number]

_AXES: tuple[Vec, Vec, Vec] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

@dataclass(frozen=True, slots=True)
class Posture:
    """What a posture and its payload determine; each number is a float or an array of samples.

    `levers[j]` is d torque / d gravity of joint j (N m per m/s2; N per m/s2 where prismatic),
    `mass` kg, `cog` the centre of gravity of the whole robot (m, `base_link`), `contacts` the
    contact points (m, `base_link`).
    """

    levers: tuple[Triple, ...]
    mass: Number
    cog: Triple
    contacts: tuple[Triple, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Mechanics:
    """The compiled kernels of one robot (compared by identity: hashing a robot takes long).

    Inputs of `posture`: joint positions, payload mass, payload centre of gravity (3).
    Inputs of `forces`: positions, rates, accelerations, gravity (3), payload mass and centre (3).
    """

    robot: Robot
    tree: Tree
    posture: Kernel
    forces: Kernel


@lru_cache(maxsize=16)
def mechanics_of(robot: Robot) -> Mechanics:
    """Return the compiled mechanics of `robot`. Raises BadConfig where it is not a tree."""
    tree = tree_of(robot)
    n = len(robot.joint_names)
    load = ['payload_mass', 'payload_x', 'payload_y', 'payload_z']
    posture = compile_kernel(_posture_formula(robot, tree), [*robot.joint_names, *load])
    gravity = ['gravity_x', 'gravity_y', 'gravity_z']
    forces = compile_kernel(_force_formula(robot, tree), ['q'] * 3 * n + gravity + load)
    return Mechanics(robot, tree, posture, forces)


def _to_tree(robot: Robot, tree: Tree) -> list[int]:
    """Return, for each moving body, the index of its joint in `robot.joint_names`."""
    return [robot.joint_names.index(body.joint) for body in tree.bodies[1:]]


def _loads(robot: Robot, tree: Tree, pose: Pose, mass: Scalar, cog: Vec) -> list[Load]:
    if robot.payload_link is None:
        return []
    body, point = point_of(tree, pose, robot.payload_link, cog)
    return [Load(body, mass, point)]


def _posture_formula(robot: Robot, tree: Tree) -> Callable[..., list[Scalar]]:
    order = _to_tree(robot, tree)

    def formula(*inputs: Scalar) -> list[Scalar]:
        q, (mass, x, y, z) = inputs[:-4], inputs[-4:]
        pose = pose_of(tree, [q[k] for k in order])
        loads = _loads(robot, tree, pose, mass, (x, y, z))
        rest = [0.0] * len(order)
        columns = [
            joint_forces(tree, pose, motion_of(tree, pose, rest, rest, axis), loads)
            for axis in _AXES
        ]
        levers = [columns[k][order.index(j)] for j in range(len(order)) for k in range(3)]
        points = [point_of(tree, pose, c.link, c.position)[1] for c in robot.contacts]
        return [*levers, *_mass_and_cog(tree, pose, loads), *(x for p in points for x in p)]

    return formula


def _mass_and_cog(tree: Tree, pose: Pose, loads: Sequence[Load]) -> list[Scalar]:
    """Return total mass and the centre of gravity's three coordinates."""
    mass: Scalar = 0.0
    moment: Vec = (0.0, 0.0, 0.0)
    for k, body in enumerate(tree.bodies):
        centre = add(pose.origin[k], rotate(pose.rotation[k], body.cog))
        mass, moment = mass + body.mass, add(moment, scale(centre, body.mass))
    for load in loads:
        mass, moment = mass + load.mass, add(moment, scale(load.point, load.mass))
    return [mass, *scale(moment, 1.0 / mass)]


def _force_formula(robot: Robot, tree: Tree) -> Callable[..., list[Scalar]]:
    order = _to_tree(robot, tree)
    n = len(order)

    def formula(*inputs: Scalar) -> list[Scalar]:
        q, qd, qdd = ([inputs[part * n + k] for k in order] for part in range(3))
        gx, gy, gz, mass, x, y, z = inputs[3 * n :]
        pose = pose_of(tree, q)
        loads = _loads(robot, tree, pose, mass, (x, y, z))
        motion = motion_of(tree, pose, qd, qdd, (gx, gy, gz))
        forces = joint_forces(tree, pose, motion, loads)
        return [forces[order.index(j)] for j in range(n)]

    return formula


def posture_of(mechanics: Mechanics, q: Sequence[Number], mass: Number, cog: Triple) -> Posture:
    """Return the posture for joint positions `q` and a payload: floats in, floats out."""
    live = isinstance(mass, float) and all(isinstance(x, float) for x in q)
    kernel = mechanics.posture.one if live else mechanics.posture.many
    out = kernel(*q, mass, *cog)
    n = 3 * len(mechanics.robot.joint_names)
    levers: tuple[Any, ...] = tuple(out[k : k + 3] for k in range(0, n, 3))
    contacts: tuple[Any, ...] = tuple(out[k : k + 3] for k in range(n + 4, len(out), 3))
    return Posture(levers, out[n], (out[n + 1], out[n + 2], out[n + 3]), contacts)


def take(posture: Posture, rows: slice | NDArray[np.intp]) -> Posture:
    """Return the rows of a posture of arrays; what is the same for all samples stays a float."""

    def pick(x: Number) -> Number:
        return x if isinstance(x, float) else x[rows]

    def pick_all(triples: tuple[Triple, ...]) -> tuple[Triple, ...]:
        return tuple((pick(x), pick(y), pick(z)) for x, y, z in triples)

    (cog,) = pick_all((posture.cog,))
    return Posture(pick_all(posture.levers), pick(posture.mass), cog, pick_all(posture.contacts))
