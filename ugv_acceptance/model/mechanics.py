"""One robot's compiled formulas: torque gradients, centre of gravity, contacts, joint forces.

Static torque is linear in gravity, so a posture keeps each joint's gravity torque gradient: a
sample that only brings a new attitude costs three products a joint.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

from ugv_acceptance import BadConfig
from ugv_acceptance.model.dynamics import Load, Motion, joint_forces, motion_of
from ugv_acceptance.model.expressions import Number, Scalar, Vec, dot, scale
from ugv_acceptance.model.kernels import Kernel, compile_kernel
from ugv_acceptance.model.robot import Contact, Robot
from ugv_acceptance.model.torque_gradients import (
    PointLoad,
    Step,
    carried_by,
    in_base,
    loads_on_joints,
    steps_of,
)
from ugv_acceptance.model.tree import (
    Drive,
    Pose,
    Tree,
    body_positions,
    drives_of,
    folded,
    in_body,
    point_of,
    pose_of,
    tree_of,
)

Triple = tuple[Number, Number, Number]


class Posture(NamedTuple):
    """All that joint positions and payload determine, before gravity is known.

    Each number is a float (one sample) or an array (many). `torque_gradients[j]` is the derivative
    of joint j's static torque by gravity (N m per m/s2; N per m/s2 if prismatic), `mass` (kg) and
    `cog` (m, `base_link`) are of the whole robot with its payload, `contacts` are the contact
    points (m, `base_link`). `loads[p]` is the torque gradient of one kg at a contact point on a
    joint that carries it (m; 1 if prismatic), for each of `Mechanics.carried`. `laws` is what
    springs put on each joint (N m; N); empty without any.
    """

    torque_gradients: tuple[Triple, ...]
    mass: Number
    cog: Triple
    contacts: tuple[Triple, ...]
    loads: tuple[Triple, ...] = ()
    laws: tuple[Number, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Mechanics:
    """The compiled kernels of one robot (compared by identity: hashing a robot takes long).

    `posture` takes joint positions, payload mass and centre of gravity (3), and returns the fields
    of Posture. `holding` takes gravity (3) as well and returns static torques in place of the
    torque gradients. `forces` takes positions, rates, accelerations, gravity (3), payload mass and
    centre of gravity (3), and returns the dynamic joint torques. `carried` pairs joints (numbers)
    with the contact points that hang on them.
    """

    robot: Robot
    tree: Tree
    carried: tuple[tuple[int, int], ...]
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
        _carried_contacts(robot, tree),
        compile_kernel(posture_formula(robot, tree), [*names, *load]),
        compile_kernel(_holding_formula(robot, tree), [*names, *load, *gravity]),
        compile_kernel(_force_formula(robot, tree), [*names * 3, *gravity, *load]),
    )


def with_contacts(mechanics: Mechanics, contacts: Sequence[Contact]) -> Mechanics:
    """Return the mechanics of the same robot with other contact points.

    Only what depends on these is compiled, which takes a part of the time of `mechanics_of`.
    """
    robot = replace(mechanics.robot, contacts=tuple(contacts))
    load = ['payload_mass', 'payload_x', 'payload_y', 'payload_z']
    formula = posture_formula(robot, mechanics.tree)
    kernel = compile_kernel(formula, [*robot.joint_names, *load])
    return replace(mechanics, robot=robot, posture=kernel)


def _carried_contacts(robot: Robot, tree: Tree) -> tuple[tuple[int, int], ...]:
    """Return (joint, contact) for every joint between the base and a contact point."""
    drives, found = drives_of(robot, tree), set[tuple[int, int]]()
    for number, contact in enumerate(robot.contacts):
        body = tree.frames[contact.link][0]
        while body:
            found.add((drives[body - 1].joint, number))
            body = tree.bodies[body].parent
    return tuple(sorted(found))


def _vectors(drives: Sequence[Drive], values: Sequence[Vec], joints: int) -> list[Vec]:
    """Return what joints carry, given the vectors of the bodies that they move."""
    x, y, z = (folded(drives, [v[k] for v in values], joints) for k in range(3))
    return list(zip(x, y, z, strict=True))


def posture_formula(robot: Robot, tree: Tree) -> Callable[..., tuple[Any, ...]]:
    """Return the formula of `Mechanics.posture`."""
    drives, n = drives_of(robot, tree), len(robot.joint_names)
    pairs = _carried_contacts(robot, tree)

    def formula(*inputs: Scalar) -> tuple[Any, ...]:
        q, (mass, *at) = inputs[:-4], inputs[-4:]
        steps = steps_of(tree, body_positions(drives, q))
        loads = []
        if robot.payload_link is not None:
            body, point = in_body(tree, robot.payload_link, (at[0], at[1], at[2]))
            loads = [PointLoad(body, mass, point)]
        carried = carried_by(tree, steps, loads)
        torque_gradients = tuple(_vectors(drives, carried.torque_gradients, n))
        cog = scale(carried.moment, 1.0 / carried.mass)
        feet = [in_body(tree, c.link, c.position) for c in robot.contacts]
        return (
            torque_gradients,
            carried.mass,
            cog,
            tuple(in_base(tree, steps, *foot) for foot in feet),
            _loads_of_contacts(tree, drives, steps, feet, pairs),
            laws_of(robot, q),
        )

    return formula


def _loads_of_contacts(
    tree: Tree,
    drives: Sequence[Drive],
    steps: Sequence[Step],
    feet: Sequence[tuple[int, Vec]],
    pairs: Sequence[tuple[int, int]],
) -> tuple[Vec, ...]:
    """Return Posture.loads."""
    felt = [loads_on_joints(tree, steps, *foot) for foot in feet]
    joints = 1 + max((j for j, _ in pairs), default=0)
    by_foot = [
        _vectors([drives[k - 1] for k in found], list(found.values()), joints) for found in felt
    ]
    return tuple(by_foot[foot][joint] for joint, foot in pairs)


def laws_of(robot: Robot, q: Sequence[Scalar]) -> tuple[Scalar, ...]:
    """Return what springs put on each joint at positions `q` (N m; N); () without any."""
    if not robot.laws:
        return ()
    found: list[Scalar] = [0.0] * len(robot.joint_names)
    for law in robot.laws:
        j = robot.joint_names.index(law.joint)
        found[j] = found[j] + (law.constant + (law.rest - q[j]) * law.stiffness)
    return tuple(found)


def _holding_formula(robot: Robot, tree: Tree) -> Callable[..., tuple[Any, ...]]:
    posture = posture_formula(robot, tree)

    def formula(*inputs: Scalar) -> tuple[Any, ...]:
        torque_gradients, *rest = posture(*inputs[:-3])
        gravity: Vec = (inputs[-3], inputs[-2], inputs[-1])
        held = [dot(gravity, torque_gradient) for torque_gradient in torque_gradients]
        laws = rest[-1] or (0.0,) * len(held)
        return tuple(tau - law for tau, law in zip(held, laws, strict=True)), *rest

    return formula


def payload_of(robot: Robot, tree: Tree, pose: Pose, mass: Scalar, cog: Vec) -> list[Load]:
    """Return the payload (kg, m in its link) as a load of the pose; [] where nothing carries it."""
    if robot.payload_link is None:
        return []
    body, point = point_of(tree, pose, robot.payload_link, cog)
    return [Load(body, mass, point)]


def moving_bodies(
    robot: Robot, tree: Tree, drives: Sequence[Drive], inputs: Sequence[Scalar]
) -> tuple[Pose, Motion, list[Load]]:
    """Return pose, motion and payload of the bodies for the inputs of `Mechanics.forces`."""
    n = len(robot.joint_names)
    q = body_positions(drives, inputs[:n])
    qd, qdd = ([inputs[part * n + d.joint] * d.multiplier for d in drives] for part in range(1, 3))
    gx, gy, gz, mass, x, y, z = inputs[3 * n :]
    pose = pose_of(tree, q)
    motion = motion_of(tree, pose, qd, qdd, (gx, gy, gz))
    return pose, motion, payload_of(robot, tree, pose, mass, (x, y, z))


def needed_torques(
    robot: Robot, drives: Sequence[Drive], forces: Sequence[Scalar], q: Sequence[Scalar]
) -> list[Scalar]:
    """Return what the joints have to give: the bodies' forces less the laws of springs and such."""
    n = len(robot.joint_names)
    laws = laws_of(robot, q) or (0.0,) * n
    return [force - law for force, law in zip(folded(drives, forces, n), laws, strict=True)]


def _force_formula(robot: Robot, tree: Tree) -> Callable[..., list[Scalar]]:
    drives, n = drives_of(robot, tree), len(robot.joint_names)

    def formula(*inputs: Scalar) -> list[Scalar]:
        pose, motion, loads = moving_bodies(robot, tree, drives, inputs)
        return needed_torques(robot, drives, joint_forces(tree, pose, motion, loads), inputs[:n])

    return formula


def posture_of(mechanics: Mechanics, q: Sequence[Number], mass: Number, cog: Triple) -> Posture:
    """Return the posture for joint positions `q` (j) and a payload, of floats or of arrays."""
    return Posture(*mechanics.posture.run(*q, mass, *cog))


def posture_at(
    mechanics: Mechanics, q: Sequence[float], mass: float, cog: tuple[float, float, float]
) -> Posture:
    """Return `posture_of` of numbers, without asking whether there are arrays among them."""
    return Posture(*mechanics.posture.one(*q, mass, *cog))


def posture_once(
    robot: Robot,
    q: Sequence[float],
    mass: float,
    cog: tuple[float, float, float],
    tree: Tree | None = None,
) -> Posture:
    """Return the posture of a robot that is used only once, such as one with a changed mass.

    Runs the same formula with floats, because compiling takes longer than one run. `tree` is that
    of the robot, where it is known: to look a robot up takes long.
    """
    formula = posture_formula(robot, tree or tree_of(robot))
    return Posture(*formula(*q, mass, *cog))
