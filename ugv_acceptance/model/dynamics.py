"""Joint forces and torques by the recursive Newton-Euler algorithm (Luh, Walker, Paul 1980).

All vectors in base axes. Used for the dynamic torques; static ones come from torque_gradients.py.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from ugv_acceptance.model.expressions import (
    Mat,
    Scalar,
    Vec,
    add,
    cross,
    dot,
    rotate,
    scale,
    subtract,
    transpose,
)
from ugv_acceptance.model.robot import NO_INERTIA, ZERO
from ugv_acceptance.model.tree import Pose, Tree


@dataclass(frozen=True, slots=True)
class Load:
    """A point mass (kg) at `point` (m, `base_link`) carried by body number `body`."""

    body: int
    mass: Scalar
    point: Vec


@dataclass(frozen=True, slots=True)
class Motion:
    """Motion of every body: angular velocity and acceleration, linear acceleration of its origin.

    rad/s, rad/s2, m/s2, in base axes; index 0 is the base.
    """

    omega: list[Vec]
    alpha: list[Vec]
    acceleration: list[Vec]


def motion_of(
    tree: Tree, pose: Pose, qd: Sequence[Scalar], qdd: Sequence[Scalar], gravity: Vec
) -> Motion:
    """Return the motion of every body for joint rates `qd` and accelerations `qdd`.

    Gravity (m/s2, base axes) enters as an upward acceleration of the base.
    """
    motion = Motion([ZERO], [ZERO], [scale(gravity, -1.0)])
    for k, body in enumerate(tree.bodies[1:], start=1):
        omega, alpha = motion.omega[body.parent], motion.alpha[body.parent]
        axis, rate, jerk = pose.axis[k], qd[k - 1], qdd[k - 1]
        arm = subtract(pose.origin[k], pose.origin[body.parent])
        acceleration = add(motion.acceleration[body.parent], _carried(omega, alpha, arm))
        spin = scale(axis, rate)
        if body.prismatic:
            coriolis = scale(cross(omega, spin), 2.0)
            acceleration = add(acceleration, add(coriolis, scale(axis, jerk)))
        else:
            alpha = add(alpha, add(scale(axis, jerk), cross(omega, spin)))
            omega = add(omega, spin)
        motion.omega.append(omega)
        motion.alpha.append(alpha)
        motion.acceleration.append(acceleration)
    return motion


def _carried(omega: Vec, alpha: Vec, arm: Vec) -> Vec:
    """Return a point's acceleration relative to its body's origin: alpha x r + omega x (omega x r).

    `arm` is r, from the origin to the point (m).
    """
    return add(cross(alpha, arm), cross(omega, cross(omega, arm)))


def joint_forces(tree: Tree, pose: Pose, motion: Motion, loads: Sequence[Load]) -> list[Scalar]:
    """Return the torque (N m; N if prismatic) every joint must exert to cause the motion."""
    return forces_and_support(tree, pose, motion, loads)[0]


def forces_and_support(
    tree: Tree, pose: Pose, motion: Motion, loads: Sequence[Load]
) -> tuple[list[Scalar], Vec, Vec]:
    """Return `joint_forces`, and what holds the base still meanwhile.

    That is the force (N) of the ground on the robot, and its moment (N m) about the base's origin.
    """
    forces: list[Vec] = []
    moments: list[Vec] = []
    for k, body in enumerate(tree.bodies):
        arm = rotate(pose.rotation[k], body.cog)
        force, moment = _inertial(body.mass, arm, motion, k)
        if body.inertia != NO_INERTIA:
            moment = add(moment, _gyroscopic(body.inertia, pose.rotation[k], motion, k))
        for load in loads:
            if load.body == k:
                more = _inertial(load.mass, subtract(load.point, pose.origin[k]), motion, k)
                force, moment = add(force, more[0]), add(moment, more[1])
        forces.append(force)
        moments.append(moment)
    return _gather(tree, pose, forces, moments), forces[0], moments[0]


def _inertial(mass: Scalar, arm: Vec, motion: Motion, k: int) -> tuple[Vec, Vec]:
    """Return the force that accelerates a point mass at `arm` on body k, and its moment.

    `arm` (m) is from body k's origin, about which the moment (N m) is taken.
    """
    carried = _carried(motion.omega[k], motion.alpha[k], arm)
    force = scale(add(motion.acceleration[k], carried), mass)
    return force, cross(arm, force)


def _gyroscopic(inertia: Mat, rotation: Mat, motion: Motion, k: int) -> Vec:
    """Return Euler's moment I alpha + omega x I omega, in base axes."""
    back = transpose(rotation)
    omega, alpha = rotate(back, motion.omega[k]), rotate(back, motion.alpha[k])
    turned = add(rotate(inertia, alpha), cross(omega, rotate(inertia, omega)))
    return rotate(rotation, turned)


def _gather(tree: Tree, pose: Pose, forces: list[Vec], moments: list[Vec]) -> list[Scalar]:
    """Sum forces and moments from the tips to the base; return them along the joint axes."""
    torques: list[Scalar] = []
    for k in range(len(tree.bodies) - 1, 0, -1):
        body = tree.bodies[k]
        torques.append(dot(pose.axis[k], forces[k] if body.prismatic else moments[k]))
        arm = subtract(pose.origin[k], pose.origin[body.parent])
        forces[body.parent] = add(forces[body.parent], forces[k])
        turned = add(moments[k], cross(arm, forces[k]))
        moments[body.parent] = add(moments[body.parent], turned)
    return torques[::-1]
