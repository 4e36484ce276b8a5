"""One robot's compiled formulas: torque gradients, centre of gravity, contacts, joint forces.

Static torque is linear in gravity, so a posture keeps each joint's gravity torque gradient: a
sample that only brings a new attitude costs three products a joint.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from ugv_acceptance import BadConfig
from ugv_acceptance.model.dynamics import Load, joint_forces, motion_of
from ugv_acceptance.model.expressions import Number, Scalar, Vec, dot, scale
from ugv_acceptance.model.kernels import Kernel, compile_kernel
from ugv_acceptance.model.robot import Contact, Robot
from ugv_acceptance.model.torque_gradients import PointLoad, carried_by, in_base, steps_of
from ugv_acceptance.model.tree import Pose, Tree, in_body, point_of, pose_of, tree_of

Triple = tuple[Number, Number, Number]


@dataclass(frozen=True, slots=True)
class Posture:
    """All that joint positions and payload determine, before gravity is known.

    Each number is a float (one sample) or an array (many). `torque_gradients[j]` is the derivative
    of joint j's static torque by gravity (N m per m/s2; N per m/s2 if prismatic), `mass` (kg) and
    `cog` (m, `base_link`) are of the whole robot with its payload, `contacts` are the contact
    points (m, `base_link`).
    """

    torque_gradients: tuple[Triple, ...]
    mass: Number
    cog: Triple
    contacts: tuple[Triple, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Mechanics:
    """The compiled kernels of one robot (compared by identity: hashing a robot takes long).

    `posture` takes joint positions, payload mass and centre of gravity (3), and returns the fields
    of Posture. `holding` takes gravity (3) as well and returns static torques in place of the
    torque gradients. `forces` takes positions, rates, accelerations, gravity (3), payload mass and
    centre of gravity (3), and returns the dynamic joint torques.
    """

    robot: Robot
    tree: Tree
    posture: Kernel
    holding: Kernel
    forces: Kernel


@lru_cache(maxsize=16)
def mechanics_of(robot: Robot) -> Mechanics:
    """Return the compiled mechanics of `robot`, cached.

    Raises BadConfig if its joints are not a tree or none of its links has a mass.
    """
    tree = tree_of(robot)
    if not sum(body.mass for body in tree.bodies) > 0.0:
        raise BadConfig(f'robot {robot.name}: expected a link with a mass above 0 kg, found none')
    names = robot.joint_names
    load = ['payload_mass', 'payload_x', 'payload_y', 'payload_z']
    gravity = ['gravity_x', 'gravity_y', 'gravity_z']
    return Mechanics(
        robot,
        tree,
        compile_kernel(_posture_formula(robot, tree), [*names, *load]),
        compile_kernel(_holding_formula(robot, tree), [*names, *load, *gravity]),
        compile_kernel(_force_formula(robot, tree), [*names * 3, *gravity, *load]),
    )


def with_contacts(mechanics: Mechanics, contacts: Sequence[Contact]) -> Mechanics:
    """Return the mechanics of the same robot with other contact points.

    Only what depends on these is compiled, which takes a part of the time of `mechanics_of`.
    """
    robot = replace(mechanics.robot, contacts=tuple(contacts))
    load = ['payload_mass', 'payload_x', 'payload_y', 'payload_z']
    formula = _posture_formula(robot, mechanics.tree)
    kernel = compile_kernel(formula, [*robot.joint_names, *load])
    return replace(mechanics, robot=robot, posture=kernel)


def _to_tree(robot: Robot, tree: Tree) -> list[int]:
    """Return, for each moving body, the index of its joint in `robot.joint_names`."""
    return [robot.joint_names.index(body.joint) for body in tree.bodies[1:]]


def _posture_formula(robot: Robot, tree: Tree) -> Callable[..., tuple[Any, ...]]:
    order = _to_tree(robot, tree)

    def formula(*inputs: Scalar) -> tuple[Any, ...]:
        q, (mass, *at) = inputs[:-4], inputs[-4:]
        steps = steps_of(tree, [q[k] for k in order])
        loads = []
        if robot.payload_link is not None:
            body, point = in_body(tree, robot.payload_link, (at[0], at[1], at[2]))
            loads = [PointLoad(body, mass, point)]
        carried = carried_by(tree, steps, loads)
        torque_gradients = tuple(
            carried.torque_gradients[order.index(j)] for j in range(len(order))
        )
        cog = scale(carried.moment, 1.0 / carried.mass)
        feet = [in_body(tree, c.link, c.position) for c in robot.contacts]
        return (
            torque_gradients,
            carried.mass,
            cog,
            tuple(in_base(tree, steps, *foot) for foot in feet),
        )

    return formula


def _holding_formula(robot: Robot, tree: Tree) -> Callable[..., tuple[Any, ...]]:
    posture = _posture_formula(robot, tree)

    def formula(*inputs: Scalar) -> tuple[Any, ...]:
        torque_gradients, *rest = posture(*inputs[:-3])
        gravity: Vec = (inputs[-3], inputs[-2], inputs[-1])
        return tuple(dot(gravity, torque_gradient) for torque_gradient in torque_gradients), *rest

    return formula


def _loads(robot: Robot, tree: Tree, pose: Pose, mass: Scalar, cog: Vec) -> list[Load]:
    if robot.payload_link is None:
        return []
    body, point = point_of(tree, pose, robot.payload_link, cog)
    return [Load(body, mass, point)]


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
    """Return the posture for joint positions `q` (j) and a payload, of floats or of arrays."""
    return Posture(*mechanics.posture.run(*q, mass, *cog))


def posture_once(
    robot: Robot, q: Sequence[float], mass: float, cog: tuple[float, float, float]
) -> Posture:
    """Return the posture of a robot that is used only once, such as one with a changed mass.

    Runs the same formula with floats, because compiling takes longer than one run.
    """
    formula = _posture_formula(robot, tree_of(robot))
    return Posture(*formula(*q, mass, *cog))
