"""What a motion of the joints asks of motors and ground, on a base that stands still.

Links that speed up push back on the base. To the ground it makes no difference whether a robot
moves so or stands still, under another gravity and with its centre of gravity elsewhere: under the
*effective gravity*, the force per kg that it presses down with, and with its centre of gravity
moved, level with the base, to where that force has the same moment. So every margin of a robot at
rest holds for one whose arm moves. What turns it about the base's upright axis is left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from ugv_acceptance.model.dynamics import forces_and_support
from ugv_acceptance.model.expressions import Number, Scalar, Vec, cross, scale, subtract
from ugv_acceptance.model.kernels import Kernel, compile_kernel
from ugv_acceptance.model.mechanics import (
    Mechanics,
    Posture,
    Triple,
    moving_bodies,
    needed_torques,
    posture_formula,
)
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.tree import drives_of


@dataclass(frozen=True, slots=True)
class Moving:
    """A robot whose joints move: floats, or arrays of samples.

    `torque` (j) is what the motors must exert (N m; N), joints that carry the robot as if their
    contact points hung in the air. `gravity` (m/s2, base axes) is effective, and `posture` has the
    centre of gravity moved as said above; it has no torque gradients.
    """

    torque: tuple[Number, ...]
    gravity: Triple
    posture: Posture


def moving(
    mechanics: Mechanics,
    motion: tuple[Sequence[Number], Sequence[Number], Sequence[Number]],
    gravity: Triple,
    payload: Payload,
) -> Moving:
    """Return what a motion asks for: positions, rates and accelerations (j) of all joints.

    rad, rad/s, rad/s2 (m, m/s, m/s2 if prismatic), `gravity` m/s2 in base axes.
    """
    inputs = [*motion[0], *motion[1], *motion[2], *gravity, payload.mass, *payload.cog]
    torque, down, *rest = moving_kernel(mechanics).run(*inputs)
    return Moving(torque, down, Posture((), *rest))


@lru_cache(maxsize=16)
def moving_kernel(mechanics: Mechanics) -> Kernel:
    """Return the kernel of `moving`.

    It takes the inputs of `Mechanics.forces` and returns torques, effective gravity, mass, centre
    of gravity as moved, contact points and the loads of Posture.
    """
    robot, tree = mechanics.robot, mechanics.tree
    drives, n = drives_of(robot, tree), len(robot.joint_names)
    posture = posture_formula(robot, tree)

    def formula(*inputs: Scalar) -> tuple[Any, ...]:
        pose, motion, loads = moving_bodies(robot, tree, drives, inputs)
        forces, held, moment = forces_and_support(tree, pose, motion, loads)
        torque = needed_torques(robot, drives, forces, inputs[:n])
        _, whole, cog, contacts, felt, _ = posture(*inputs[:n], *inputs[3 * n + 3 :])
        down: Vec = scale(held, -1.0 / whole)
        # Of what the ground holds, the part that turns about the centre of gravity.
        turn = subtract(moment, cross(cog, held))
        moved = (cog[0] - turn[1] / held[2], cog[1] + turn[0] / held[2], cog[2])
        return torque, down, whole, moved, contacts, felt

    names = [*robot.joint_names * 3, *(f'g{k}' for k in range(3)), *(f'p{k}' for k in range(4))]
    return compile_kernel(formula, names)
