"""Gravity torque gradients of the joints in a posture, and the robot's centre of gravity.

The torque that holds a joint is linear in gravity: torque = gradient . g. The gradient is the mass
moment S (kg m, sum of mass times position from the joint) of all that the joint carries, crossed
with its axis: -axis . (S x g) = (S x axis) . g. One walk from the tips to the base gives all
gradients and the centre of gravity, each in the axes of the body reached so far.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from ugv_acceptance.model.expressions import Mat, Scalar, Vec, add, cross, rotate, scale
from ugv_acceptance.model.robot import IDENTITY, ZERO
from ugv_acceptance.model.tree import Body, Tree, rotation_about


@dataclass(frozen=True, slots=True)
class PointLoad:
    """A point mass (kg) at `point` (m, body axes) carried by body number `body`."""

    body: int
    mass: Scalar
    point: Vec


@dataclass(frozen=True, slots=True)
class Step:
    """The transform from a body's frame to its parent's: p_parent = shift + turn p (m)."""

    turn: Mat
    shift: Vec


@dataclass(frozen=True, slots=True)
class Carried:
    """Torque gradient of each joint (kg m; kg if prismatic), total mass (kg) and its moment (kg m).

    In base axes; the moment is the sum of mass times position from the origin of `base_link`.
    """

    torque_gradients: list[Vec]
    mass: Scalar
    moment: Vec


def steps_of(tree: Tree, q: Sequence[Scalar]) -> list[Step]:
    """Return each body's transform to its parent at joint positions `q`; the base's is identity."""
    moving = zip(tree.bodies[1:], q, strict=True)
    return [Step(IDENTITY, ZERO), *(_step(body, x) for body, x in moving)]


def _step(body: Body, position: Scalar) -> Step:
    if body.prismatic:
        return Step(IDENTITY, add(body.offset, scale(body.axis, position)))
    return Step(rotation_about(body.axis, position), body.offset)


def in_base(tree: Tree, steps: Sequence[Step], body: int, point: Vec) -> Vec:
    """Transform a point (m) from a body's axes to `base_link`."""
    while body:
        point = add(steps[body].shift, rotate(steps[body].turn, point))
        body = tree.bodies[body].parent
    return point


def loads_on_joints(tree: Tree, steps: Sequence[Step], body: int, point: Vec) -> dict[int, Vec]:
    """Return the torque gradient (m; 1 if prismatic) of one kg at a point of a body, by body.

    `point` (m) is in the axes of body number `body`; the keys are the bodies on its way to the
    base, whose joints feel it; the gradients are in base axes.
    """
    found: dict[int, Vec] = {}
    while body:
        step, moving = steps[body], tree.bodies[body]
        arm = rotate(step.turn, point)
        found = {k: rotate(step.turn, gradient) for k, gradient in found.items()}
        found[body] = scale(moving.axis, -1.0) if moving.prismatic else cross(arm, moving.axis)
        point = add(step.shift, arm)
        body = moving.parent
    return found


def carried_by(tree: Tree, steps: Sequence[Step], loads: Sequence[PointLoad]) -> Carried:
    """Return torque gradients, total mass and its moment, with the point `loads` included."""
    masses: list[Scalar] = [body.mass for body in tree.bodies]
    moments: list[Vec] = [scale(body.cog, body.mass) for body in tree.bodies]
    for load in loads:
        masses[load.body] = masses[load.body] + load.mass
        moments[load.body] = add(moments[load.body], scale(load.point, load.mass))
    torque_gradients: list[Vec] = [ZERO] * len(tree.bodies)
    above: list[list[int]] = [[] for _ in tree.bodies]
    for k in range(len(tree.bodies) - 1, 0, -1):
        body, step = tree.bodies[k], steps[k]
        moment = rotate(step.turn, moments[k])
        for j in above[k]:
            torque_gradients[j] = rotate(step.turn, torque_gradients[j])
        torque_gradients[k] = (
            scale(body.axis, -masses[k]) if body.prismatic else cross(moment, body.axis)
        )
        above[body.parent] += [*above[k], k]
        moment = add(moment, scale(step.shift, masses[k]))
        masses[body.parent] = masses[body.parent] + masses[k]
        moments[body.parent] = add(moments[body.parent], moment)
    return Carried(torque_gradients[1:], masses[0], moments[0])
