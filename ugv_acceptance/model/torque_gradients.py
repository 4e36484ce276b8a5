"""Gravity torque gradients of the joints in a posture, and the robot's centre of gravity.

The torque that holds a joint is linear in gravity: torque = gradient . g. The gradient is the mass
moment S (kg m, sum of mass times position from the joint) of all that the joint carries, crossed
with its axis: -axis . (S x g) = (S x axis) . g. One walk from the tips to the base gives all
moments, each in the axes of the body reached so far, and the centre of gravity. A gradient is then
rotated into base axes in a few steps, however far that is: so the work grows with the number of
joints, not with its square.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

from ugv_acceptance.model.expressions import Mat, Scalar, Vec, add, cross, matmul, rotate, scale
from ugv_acceptance.model.robot import IDENTITY, ZERO
from ugv_acceptance.model.tree import Tree, rotation_about

# Rotations from a body to the base that are carried out one by one.
_FEW = 2


@dataclass(frozen=True, slots=True)
class PointLoad:
    """A point mass (kg) at `point` (m, body axes) carried by body number `body`."""

    body: int
    mass: Scalar
    point: Vec


@dataclass(frozen=True, slots=True)
class Step:
    """The transform from a body's frame to its parent's: p_parent = shift + turn p (m).

    `way` are the rotations, one after the other, from the parent's axes to those of the base.
    """

    turn: Mat
    shift: Vec
    way: tuple[Mat, ...] = ()

    def in_base_axes(self, vector: Vec) -> Vec:
        """Rotate a vector from the parent's axes to those of the base."""
        for turn in self.way:
            vector = rotate(turn, vector)
        return vector


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
    steps = [Step(IDENTITY, ZERO)]
    for body, position in zip(tree.bodies[1:], q, strict=True):
        way = _way(steps[body.parent]) if body.parent else ()
        if body.prismatic:
            shift = add(body.offset, scale(body.axis, position))
            steps.append(Step(IDENTITY, shift, way))
        else:
            steps.append(Step(rotation_about(body.axis, position), body.offset, way))
    return steps


def _way(parent: Step) -> tuple[Mat, ...]:
    """Return the rotations to the base for a child of a moving body: a long way as one product.

    Of a short arm a few rotations of the few vectors are fewer operations than the product.
    """
    way = (parent.turn, *parent.way)
    return way if len(way) <= _FEW else (reduce(matmul, reversed(way)),)


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
        gradient = scale(moving.axis, -1.0) if moving.prismatic else cross(arm, moving.axis)
        found[body] = step.in_base_axes(gradient)
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
    for k in range(len(tree.bodies) - 1, 0, -1):
        body, step = tree.bodies[k], steps[k]
        moment = rotate(step.turn, moments[k])
        gradient = scale(body.axis, -masses[k]) if body.prismatic else cross(moment, body.axis)
        torque_gradients[k] = step.in_base_axes(gradient)
        moment = add(moment, scale(step.shift, masses[k]))
        masses[body.parent] = masses[body.parent] + masses[k]
        moments[body.parent] = add(moments[body.parent], moment)
    return Carried(torque_gradients[1:], masses[0], moments[0])
