"""Static and dynamic joint torques, their margins, and payload capacity: arrays in and out.

Joint order is `robot.joint_names`; gravity is the vector (m/s2) in `base_link`, (0, 0, -g) on level
ground; with an accelerometer in place of gravity it is minus the specific force. A payload left out
is the robot's own `payload`.
"""

import numpy as np
from numpy.typing import ArrayLike

from ugv_acceptance.model.blocks import in_blocks
from ugv_acceptance.model.expressions import Number
from ugv_acceptance.model.mechanics import Posture, mechanics_of, posture_of
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.type_aliases import Floats


def torque_of(posture: Posture, gravity: tuple[Number, Number, Number]) -> tuple[Number, ...]:
    """Return what each motor holds at rest under `gravity` (m/s2): N m; N where prismatic.

    That is its weight less what its spring carries. Of a joint between base and ground it is the
    torque with its feet in the air; reactions.py adds what the ground does.
    """
    gx, gy, gz = gravity
    held = tuple([x * gx + y * gy + z * gz for x, y, z in posture.torque_gradients])
    if posture.laws:
        return tuple([tau - law for tau, law in zip(held, posture.laws, strict=True)])
    return held


def static_torque(
    robot: Robot,
    q: ArrayLike,
    gravity: ArrayLike,
    payload: Payload | None = None,
    workers: int = 1,
) -> Floats:
    """Return the torque that holds posture `q` (..., j) at rest under `gravity` (..., 3).

    Shape (..., j), N m (N if prismatic): the paper's equations (1) and (2) for any tree.
    """
    mechanics, load = mechanics_of(robot), payload or robot.payload
    n = len(robot.joint_names)

    def torques(*columns: Number) -> tuple[Number, ...]:
        posture = posture_of(mechanics, columns[:n], load.mass, load.cog)
        return torque_of(posture, columns[n:])  # type: ignore[arg-type]  # three columns

    return in_blocks(torques, n, q, gravity, workers=workers)


def inverse_dynamics(
    robot: Robot,
    q: ArrayLike,
    qd: ArrayLike,
    qdd: ArrayLike,
    gravity: ArrayLike,
    payload: Payload | None = None,
    workers: int = 1,
) -> Floats:
    """Return the torque (..., j) that moves the joints with rates `qd` and accelerations `qdd`.

    N m (N if prismatic). Rigid bodies on a base at rest, payload as a point mass; rad, rad/s,
    rad/s2 (m, m/s, m/s2 if prismatic). With qd = qdd = 0 it is `static_torque`.
    """
    mechanics, load = mechanics_of(robot), payload or robot.payload

    def torques(*columns: Number) -> tuple[Number, ...]:
        return mechanics.forces.run(*columns, load.mass, *load.cog)

    return in_blocks(torques, len(robot.joint_names), q, qd, qdd, gravity, workers=workers)


def centre_of_gravity(robot: Robot, q: ArrayLike, payload: Payload | None = None) -> Floats:
    """Return the robot's centre of gravity (m, `base_link`) for `q` (..., j), shape (..., 3)."""
    mechanics, load = mechanics_of(robot), payload or robot.payload

    def centres(*columns: Number) -> tuple[Number, ...]:
        return posture_of(mechanics, columns, load.mass, load.cog).cog

    return in_blocks(centres, 3, q)


def torque_margin(torque: ArrayLike, limit: ArrayLike) -> Floats:
    """Return limit - |torque| (..., j): the torque (N m) left to each joint, negative past it."""
    margin: Floats = np.asarray(limit, dtype=np.float64) - np.abs(torque)
    return margin


def utilisation(torque: ArrayLike, limit: ArrayLike) -> Floats:
    """Return |torque| / limit (..., j): 1 is saturation; 0 where a limit is infinite."""
    return np.abs(np.asarray(torque, dtype=np.float64)) / np.asarray(limit, dtype=np.float64)


# A lever arm shorter than this (m) is rounding, as of an arm turned upright: it counts as none.
LEAST_LEVER = 1e-9


def payload_capacity(
    robot: Robot, q: ArrayLike, gravity: ArrayLike, limit: ArrayLike, workers: int = 1
) -> Floats:
    """Return the largest payload mass (kg), shape (...), with every |torque| within `limit` (j,).

    Exact: torque is linear in the payload's mass. The payload's centre of gravity is that of
    `robot.payload`. Minus infinity where a joint saturates without any payload, so that none is
    allowed; infinite where the payload loads no joint with a limit; NaN where q or gravity is.
    """
    limit = np.asarray(limit, dtype=np.float64)
    cog = robot.payload.cog
    empty = static_torque(robot, q, gravity, Payload(0.0, cog), workers)
    slope = static_torque(robot, q, gravity, Payload(1.0, cog), workers) - empty
    with np.errstate(divide='ignore', invalid='ignore'):
        # The torque reaches +limit or -limit, whichever lies in the direction the payload pulls.
        mass = (limit - np.sign(slope) * empty) / np.abs(slope)
    size = np.linalg.norm(np.asarray(gravity, dtype=np.float64), axis=-1)[..., np.newaxis]
    mass = np.where(np.abs(slope) <= LEAST_LEVER * size, np.inf, mass)
    least: Floats = np.where(np.abs(empty) > limit, -np.inf, mass).min(axis=-1, initial=np.inf)
    return least


def gripper_point(robot: Robot, q: ArrayLike) -> Floats:
    """Return the position of the payload's centre of gravity (m, `base_link`), shape (..., 3)."""
    cog = robot.payload.cog
    whole = sum(body.mass for body in mechanics_of(robot).tree.bodies)
    # The robot with a load as heavy as itself: its centre of gravity lies half way to the load.
    with_load = centre_of_gravity(robot, q, Payload(whole, cog))
    point: Floats = 2.0 * with_load - centre_of_gravity(robot, q, Payload(0.0, cog))
    return point
