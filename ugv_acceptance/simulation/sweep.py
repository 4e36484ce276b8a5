"""Sweeps a joint at constant speed, as the paper's ADAMS model did.

On a fixed base the motion is prescribed and the forces follow from it exactly (inverse dynamics).
On the free base the whole vehicle stands on wheels and yields; stiff servos hold the motion.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.simulation.engine import mujoco
from ugv_acceptance.simulation.vehicle import (
    Build,
    Vehicle,
    drive,
    gravity_on_slope,
    tune,
    vehicle_of,
)
from ugv_acceptance.type_aliases import Floats

FIXED = Build(base='fixed', motors=False)
FREE = Build(wheels=True, timestep=0.0005, contact_time=0.005)
# Natural frequency (rad/s) of the servos that hold the free vehicle's joints to the motion.
STIFF = 500.0
# Time (s) for the free vehicle to come to rest, and then for the joint to come to speed.
SETTLE, LEAD = 1.0, 0.5


@dataclass(frozen=True, slots=True)
class Sweep:
    """Motion and forces of all joints during a sweep; joints in the order of `robot.joint_names`.

    Axes are those of `base_link`: x forward, y left, z up. `position`, `rate` and `acceleration`
    (n, j) of each joint: rad, rad/s, rad/s2. `force` (N) and `torque` (N m), both (n, j, 3), are
    what the parent link exerts on the child at the joint; `effort` (n, j) is the torque's part
    about the joint's axis (the force's along it where prismatic): what the motor gives. `lean` (n,)
    is the angle (rad) of the base's z axis to the ground's normal.
    """

    position: Floats
    rate: Floats
    acceleration: Floats
    force: Floats
    torque: Floats
    effort: Floats
    lean: Floats


def sweep(  # noqa: PLR0913 (what the paper varies)
    robot: Robot,
    start: ArrayLike,
    joint: str,
    speed: float,
    *,
    turn: float = 2.0 * np.pi,
    samples: int = 201,
    payload: Payload | None = None,
    slope: tuple[float, float] = (0.0, 0.0),
    free: bool = False,
) -> Sweep:
    """Turn one joint from posture `start` (j,) by `turn` (rad) at constant `speed` (rad/s).

    `slope` is tilt and heading (rad) of the ground. The samples are evenly spaced, both ends in.
    """
    loaded = replace(robot, payload=robot.payload if payload is None else payload)
    first = np.asarray(start, dtype=np.float64)
    along = np.zeros(len(robot.joint_names))
    along[robot.joint_names.index(joint)] = np.copysign(1.0, turn)
    vehicle = _strong(loaded) if free else vehicle_of(loaded, FIXED)
    vehicle.model.opt.gravity[:] = gravity_on_slope(robot.gravity, *slope)
    times = np.linspace(0.0, abs(turn) / speed, samples)
    follow = _follow if free else _prescribe
    return follow(vehicle, first, along * speed, times)


def _prescribe(vehicle: Vehicle, start: Floats, rate: Floats, times: Floats) -> Sweep:
    model, data = vehicle.model, mujoco.MjData(vehicle.model)
    rows = []
    for time in times:
        data.qpos[vehicle.position] = start + rate * time
        data.qvel[vehicle.rate] = rate
        data.qacc[:] = 0.0
        mujoco.mj_inverse(model, data)
        rows.append(_sample(vehicle, data))
    return _sweep(rows)


def _follow(vehicle: Vehicle, start: Floats, rate: Floats, times: Floats) -> Sweep:
    model, data = vehicle.model, mujoco.MjData(vehicle.model)
    step = model.opt.timestep
    data.qpos[vehicle.position] = data.ctrl[vehicle.motor] = start - rate * LEAD / 2.0
    drive(vehicle, data.ctrl, 0.0, 0.0)
    mujoco.mj_step(model, data, nstep=round(SETTLE / step))
    rows, count = [], -round(LEAD / step)
    for time in times:
        while count < round(time / step):
            data.ctrl[vehicle.motor] = start + rate * _target(count * step)
            drive(vehicle, data.ctrl, 0.0, 0.0)
            mujoco.mj_step(model, data)
            count += 1
        data.ctrl[vehicle.motor] = start + rate * _target(count * step)
        drive(vehicle, data.ctrl, 0.0, 0.0)
        mujoco.mj_forward(model, data)
        rows.append(_sample(vehicle, data))
    return _sweep(rows)


def _target(time: float) -> float:
    """Return the servos' target (s) for unit speed from time 0 on, with a smooth run-up before.

    It runs ahead of the motion to make up for the lag that the servos' damping would cause.
    """
    phase = np.pi * min(time + LEAD, LEAD) / LEAD
    way = (phase - np.sin(phase)) * LEAD / (2.0 * np.pi) - LEAD / 2.0 + max(time, 0.0)
    return float(way + (1.0 - np.cos(phase)) / STIFF)


def _strong(robot: Robot) -> Vehicle:
    """Return the vehicle on wheels, its servos so stiff that the joints follow exactly."""
    joints = tuple(replace(joint, effort=float('inf')) for joint in robot.joints)
    vehicle = vehicle_of(replace(robot, joints=joints), FREE)
    tune(vehicle, STIFF)
    return vehicle


def _sample(vehicle: Vehicle, data: mujoco.MjData) -> tuple[Floats, ...]:
    """Return one sample's fields in the order of Sweep."""
    robot, base = vehicle.robot, data.xmat[vehicle.root].reshape(3, 3)
    forces, torques, efforts = [], [], []
    for name in robot.joint_names:
        joint = robot.joint(name)
        turn = base.T @ data.site(f'joint:{name}').xmat.reshape(3, 3)
        force, torque = (data.sensor(f'{kind}:{name}').data for kind in ('force', 'torque'))
        efforts.append((force if joint.slides else torque) @ np.array(joint.axis))
        forces.append(turn @ force)
        torques.append(turn @ torque)
    return (
        data.qpos[vehicle.position],
        data.qvel[vehicle.rate],
        data.qacc[vehicle.rate],
        np.array(forces),
        np.array(torques),
        np.array(efforts),
        np.arccos(np.clip(base[2, 2], -1.0, 1.0)),
    )


def _sweep(rows: list[tuple[Floats, ...]]) -> Sweep:
    return Sweep(*(np.array(column) for column in zip(*rows, strict=True)))
