"""Decides whether a posture tips: MuJoCo, a slowly tilting plane, all joints rigid.

The plane tilts by turning gravity; friction is so high that nothing slides. The robot has tipped
when it has turned by TIPPED against the plane on which it had come to rest.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ugv_acceptance.model.robot import IDENTITY, Payload, Robot
from ugv_acceptance.simulation.engine import mujoco
from ugv_acceptance.simulation.vehicle import Build, Vehicle, gravity_on_slope, vehicle_of
from ugv_acceptance.type_aliases import Floats

# Turn (rad) against the plane that counts as tipping; the slack of the contacts is far below.
TIPPED = np.radians(2.0)
# Turn (rad) beyond which nothing catches the robot any more.
OVER = np.radians(30.0)
# Rates (rad/s) at which the plane tilts, each to find the tilt closer, and how far (rad) before the
# result of the last the next one starts. On a slow plane tipping is noticed at nearly its tilt.
RATES = (np.radians(12.0), np.radians(2.0), np.radians(0.2), np.radians(0.05))
BACK = (np.radians(7.0), np.radians(2.0), np.radians(0.5))
# Tilt (rad) at which a search ends.
LAST = float(np.radians(75.0))
# Time (s) to come to rest on dampers (N s/m, N m s/rad), and then without them.
CALM, SETTLE, DAMPER = 1.0, 1.5, 60.0
# Time steps between two settings of gravity.
STRIDE = 8
BUILD = Build(motors=False, friction=20.0, timestep=0.00125, contact_time=0.0026, impratio=100.0)


@dataclass(frozen=True, slots=True)
class Truth:
    """The simulated robot's behaviour on the tilting plane: when it tipped, and how far.

    `tilt` (rad) at which it tipped: 0 where it does not stand on the level as expected, infinite
    where it stood to the last. `over`: it then turned over, nothing caught it.
    """

    tilt: float
    over: bool


def rigid(robot: Robot, q: ArrayLike, payload: Payload) -> Robot:
    """Return `robot` with all joints held at `q` (j,) and carrying `payload`."""
    posture = zip(robot.joint_names, np.asarray(q, dtype=float).tolist(), strict=True)
    held = (*robot.held, *posture)
    return replace(robot, joint_names=(), held=held, payload=payload)


def tip_truth(
    robot: Robot,
    q: ArrayLike,
    payload: Payload,
    heading: float,
    rest: ArrayLike = IDENTITY,
    last: float = LAST,
) -> Truth:
    """Tilt the plane down towards `heading` (rad) until the robot tips, up to `last` (rad).

    `rest` (3, 3) is the attitude in which it is put on the level plane and should stay.
    """
    vehicle = vehicle_of(rigid(robot, q, payload), BUILD)
    data = settled(vehicle, np.asarray(rest, dtype=float))
    away = turn(attitude(vehicle, data), np.asarray(rest, dtype=float))
    if away > TIPPED:
        return Truth(0.0, over=away > OVER)
    found = _tilt(vehicle, data, heading, (0.0, last, RATES[0]))
    for rate, back in zip(RATES[1:], BACK, strict=True):
        if not np.isfinite(found.tilt):
            break
        window = (max(found.tilt - back, 0.0), last, rate)
        found = _tilt(vehicle, data, heading, window)
    return found


def _tilt(
    vehicle: Vehicle, start: mujoco.MjData, heading: float, window: tuple[float, float, float]
) -> Truth:
    """Tilt from one angle to another (rad) at a rate (rad/s); `start` is at rest on the level."""
    first, last, rate = window
    model = vehicle.model
    data, rest = mujoco.MjData(model), attitude(vehicle, start)
    mujoco.mj_copyData(data, model, start)
    model.opt.gravity[:] = gravity_on_slope(vehicle.robot.gravity, first, heading)
    _calm(model, data)
    for tilt in np.arange(first, last, rate * STRIDE * model.opt.timestep):
        model.opt.gravity[:] = gravity_on_slope(vehicle.robot.gravity, tilt, heading)
        mujoco.mj_step(model, data, nstep=STRIDE)
        if turn(attitude(vehicle, data), rest) > TIPPED:
            return Truth(float(tilt), over=_falls_over(vehicle, data, rest))
    return Truth(np.inf, over=False)


def _falls_over(vehicle: Vehicle, data: mujoco.MjData, rest: Floats) -> bool:
    """Return whether a robot that has begun to tip turns over, with the plane held still."""
    for _ in range(round(SETTLE / (STRIDE * vehicle.model.opt.timestep))):
        mujoco.mj_step(vehicle.model, data, nstep=STRIDE)
        if turn(attitude(vehicle, data), rest) > OVER:
            return True
    return False


def turn(a: Floats, b: Floats) -> float:
    """Return the angle (rad) between two attitudes (3, 3), yaw ignored."""
    return float(np.arccos(np.clip(a[2] @ b[2], -1.0, 1.0)))


def settled(vehicle: Vehicle, rest: Floats, q: ArrayLike = 0.0) -> mujoco.MjData:
    """Return the simulated state after the robot settled on the level, put in attitude `rest`.

    `q` (j,) are the positions of joints that can move; nothing holds them but their damping.
    """
    model = vehicle.model
    data = mujoco.MjData(model)
    model.opt.gravity[:] = gravity_on_slope(vehicle.robot.gravity, 0.0, 0.0)
    mujoco.mju_mat2Quat(data.qpos[3:7], rest.reshape(9))
    data.qpos[vehicle.position] = q
    mujoco.mj_forward(model, data)
    spheres = [g for g in range(model.ngeom) if model.geom(g).name.startswith('contact:')]
    data.qpos[2] -= data.geom_xpos[spheres, 2].min() - model.geom_size[spheres[0], 0]
    _calm(model, data)
    mujoco.mj_step(model, data, nstep=round(SETTLE / model.opt.timestep))
    return data


def _calm(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Let the robot come to rest on dampers, so that it does not bounce."""
    model.dof_damping[:6] = DAMPER
    mujoco.mj_step(model, data, nstep=round(CALM / model.opt.timestep))
    model.dof_damping[:6] = 0.0


def attitude(vehicle: Vehicle, data: mujoco.MjData) -> Floats:
    """Return the rotation matrix (3, 3) of `base_link` against the plane."""
    matrix: Floats = data.xmat[vehicle.root].reshape(3, 3).copy()
    return matrix
