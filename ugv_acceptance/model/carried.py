"""What a sensor on a moving link (a turret, an arm) tells of the base: a formula compiled once."""

import math
from functools import lru_cache

from ugv_acceptance.model.expressions import (
    Mat,
    Scalar,
    Vec,
    add,
    cos,
    cross,
    matmul,
    rotate,
    scale,
    sin,
    subtract,
)
from ugv_acceptance.model.kernels import Kernel, compile_kernel
from ugv_acceptance.model.robot import Matrix, Robot, Vector
from ugv_acceptance.model.tree import Tree, body_positions, drives_of, plain, pose_of, tree_of

# A rotation as a quaternion: x, y, z, w.
Quaternion = tuple[Scalar, Scalar, Scalar, Scalar]


def carriers(robot: Robot, link: str) -> tuple[int, ...]:
    """Return which of `robot.joint_names` (numbers) move a link; () on the base."""
    tree = tree_of(robot)
    drives = drives_of(robot, tree)
    return tuple(dict.fromkeys(drives[body - 1].joint for body in _path(tree, link)))


@lru_cache(maxsize=8)
def carried_kernel(robot: Robot, link: str, mounting: Matrix, position: Vector) -> Kernel:
    """Return the kernel that turns what a sensor on `link` measures into what the base's would.

    `mounting` turns sensor axes into the link's, `position` is the sensor in it (m). It takes
    joint positions (j) and rates (j), then a quaternion x y z w from sensor axes to the world's,
    rate (rad/s) and specific force (m/s2) in sensor axes. It returns the same three for a sensor
    at the base's origin with the base's axes, and the base's z in sensor axes. Left out: angular
    accelerations, and what the joints' own motion adds to the force.
    """
    tree = tree_of(robot)
    drives, n = drives_of(robot, tree), len(robot.joint_names)
    body, rotation, at = tree.frames[link]
    fixed = _plain(matmul(rotation, mounting))
    place = plain(add(at, rotate(rotation, position)))
    path = _path(tree, link)

    def formula(*inputs: Scalar) -> list[tuple[Scalar, ...]]:
        q, rates, sensed = inputs[:n], inputs[n : 2 * n], inputs[2 * n :]
        x, y, z, w, *vectors = sensed
        omega, force = (vectors[0], vectors[1], vectors[2]), (vectors[3], vectors[4], vectors[5])
        angles = body_positions(drives, q)
        pose = pose_of(tree, angles)
        turn = matmul(pose.rotation[body], fixed)
        turned: Quaternion = (0.0, 0.0, 0.0, 1.0)
        spin = rotate(turn, omega)
        for k in path:
            if tree.bodies[k].prismatic:
                continue
            turned = product(turned, _about(tree.bodies[k].axis, angles[k - 1]))
            drive = drives[k - 1]
            spin = subtract(spin, scale(pose.axis[k], rates[drive.joint] * drive.multiplier))
        a, b, c, d = product(turned, quaternion_of(fixed))
        arm = add(pose.origin[body], rotate(pose.rotation[body], place))
        felt = subtract(rotate(turn, force), cross(spin, cross(spin, arm)))
        return [product((x, y, z, w), (-a, -b, -c, d)), spin, felt, turn[2]]

    names = [f'{what}{j}' for what in ('q', 'v') for j in range(n)]
    return compile_kernel(formula, [*names, *'xyzw', *(f'{v}{k}' for v in 'wa' for k in range(3))])


def product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Return the quaternion of the rotation `q` followed by `p`."""
    a, b, c, d = p
    x, y, z, w = q
    return (
        d * x + a * w + b * z - c * y,
        d * y - a * z + b * w + c * x,
        d * z + a * y - b * x + c * w,
        d * w - a * x - b * y - c * z,
    )


def quaternion_of(m: Matrix) -> tuple[float, float, float, float]:
    """Return a rotation matrix as a unit quaternion x, y, z, w (w is never negative)."""
    (a, b, c), (d, e, f), (g, h, i) = m
    squares = (1 + a - e - i, 1 - a + e - i, 1 - a - e + i, 1 + a + e + i)
    largest = max(range(4), key=squares.__getitem__)
    rows = (
        (squares[0], b + d, c + g, h - f),
        (b + d, squares[1], f + h, c - g),
        (c + g, f + h, squares[2], d - b),
        (h - f, c - g, d - b, squares[3]),
    )
    found = rows[largest]
    size = math.copysign(math.sqrt(math.fsum(v * v for v in found)), found[3] or 1.0)
    x, y, z, w = (v / size for v in found)
    return x, y, z, w


def _path(tree: Tree, link: str) -> list[int]:
    """Return the moving bodies from the base to a link, the nearest to the base first."""
    body, path = tree.frames[link][0], []
    while body:
        path.append(body)
        body = tree.bodies[body].parent
    return path[::-1]


def _about(axis: Vec, angle: Scalar) -> Quaternion:
    x, y, z = scale(axis, sin(angle * 0.5))
    return x, y, z, cos(angle * 0.5)


def _plain(m: Mat) -> Matrix:
    a, b, c = (plain(row) for row in m)
    return a, b, c
