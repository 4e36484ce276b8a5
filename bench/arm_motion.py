"""Compares the static margin of a moving joint with simulation, to find the speed that limits it.

The static margin of a motion is the least force-angle of the postures it passes; the truth is
whether the simulated robot, its joints held to the motion, leaves its stance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np

from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.stability import RAISED, stability
from ugv_acceptance.processes import Workers
from ugv_acceptance.simulation.engine import mujoco
from ugv_acceptance.simulation.oracle import TIPPED, attitude, turn
from ugv_acceptance.simulation.tip_cases import clear_of_ground
from ugv_acceptance.simulation.vehicle import (
    Build,
    Vehicle,
    gravity_on_slope,
    tune,
    vehicle_of,
)
from ugv_acceptance.type_aliases import Floats

BUILD = Build(friction=20.0, timestep=0.00125, contact_time=0.0026, impratio=100.0)
# Natural frequency (rad/s) of the servos: they hold the joints to the motion; stiffer ones hop.
STIFF = 60.0
# Time (s) to come to rest before, and to watch after a motion.
SETTLE, WATCH = 0.6, 1.0
# Dampers (N s/m, N m s/rad) while it comes to rest.
DAMPER = 60.0
# Postures of a motion whose static margin is looked at; time steps between two looks.
PATH, STRIDE = 61, 2
# Intervals of the static margin (rad) to which random motions are spread evenly.
MARGINS = tuple(float(x) for x in np.radians([-6, -3, -1, 0, 1, 3, 6, 10, 15, 20]))


@dataclass(frozen=True, slots=True)
class ArmMotion:
    """A joint moved by `change` (rad) from posture `q` on a slope: tilt and heading (rad)."""

    q: tuple[float, ...]
    joint: str
    change: float
    payload: Payload
    slope: tuple[float, float]


def path_of(robot: Robot, motion: ArmMotion) -> Floats:
    """Return the postures (n, j) that a motion passes, both ends in."""
    path = np.tile(motion.q, (PATH, 1))
    path[:, robot.joint_names.index(motion.joint)] += np.linspace(0.0, motion.change, PATH)
    return path


def static_margin(robot: Robot, motion: ArmMotion) -> float:
    """Return the least force-angle (rad) on the way; NaN where flippers raise the robot.

    Raised, it pitches, so that the slope alone does not tell gravity in `base_link`.
    """
    gravity = gravity_on_slope(robot.gravity, *motion.slope)
    found = stability(robot, path_of(robot, motion), gravity, motion.payload)
    if (np.asarray(found.state) >= RAISED).any():
        return float('nan')
    return float(np.min(np.array(found.angle, dtype=np.float64)))


def tips(robot: Robot, motion: ArmMotion, speed: float, ramp: float) -> bool:
    """Return whether the robot leaves its stance while a joint moves at `speed` (rad/s).

    It comes to speed and stops smoothly within `ramp` (s) each.
    """
    joints = tuple(replace(joint, effort=float('inf')) for joint in robot.joints)
    vehicle = vehicle_of(replace(robot, joints=joints, payload=motion.payload), BUILD)
    tune(vehicle, STIFF)
    data = _at_rest(vehicle, motion)
    rest, start = attitude(vehicle, data), data.time
    model, motor = vehicle.model, vehicle.motor[robot.joint_names.index(motion.joint)]
    begin = motion.q[robot.joint_names.index(motion.joint)]
    length = abs(motion.change) / speed
    while (time := data.time - start) < length + ramp + WATCH:
        way, rate = _ramp(time, ramp) - _ramp(time - length, ramp)
        target = way + rate * 2.0 / STIFF
        data.ctrl[motor] = begin + np.copysign(speed, motion.change) * target
        mujoco.mj_step(model, data, nstep=STRIDE)
        if turn(attitude(vehicle, data), rest) > TIPPED:
            return True
    return False


def _at_rest(vehicle: Vehicle, motion: ArmMotion) -> mujoco.MjData:
    model, data = vehicle.model, mujoco.MjData(vehicle.model)
    model.opt.gravity[:] = gravity_on_slope(vehicle.robot.gravity, *motion.slope)
    data.qpos[vehicle.position] = data.ctrl[vehicle.motor] = motion.q
    steps = round(SETTLE / model.opt.timestep)
    model.dof_damping[:6] = DAMPER
    mujoco.mj_step(model, data, nstep=steps)
    model.dof_damping[:6] = 0.0
    mujoco.mj_step(model, data, nstep=steps)
    return data


def _ramp(time: float, ramp: float) -> Floats:
    """Return distance (s) and rate of a smooth start to unit speed within `ramp` (s)."""
    if time > ramp:
        return np.array([time - ramp / 2.0, 1.0])
    phase = np.pi * max(time, 0.0) / ramp
    way = (phase - np.sin(phase)) * ramp / (2.0 * np.pi)
    return np.array([way, (1.0 - np.cos(phase)) / 2.0])


def random_motions(
    robot: Robot,
    joints: Sequence[str],
    count: int,
    seed: int,
    margins: Sequence[float] = MARGINS,
) -> list[ArmMotion]:
    """Return random motions of `joints` that start stable and stay clear of the ground.

    As many have their static margin in each interval of `margins` (rad, rising): by chance, most
    motions would be far from tipping.
    """
    rng = np.random.default_rng(seed)
    vehicle = vehicle_of(robot, Build(base='fixed', motors=False))
    bins = len(margins) - 1
    full = [count * (k + 1) // bins - count * k // bins for k in range(bins)]
    found: list[ArmMotion] = []
    while any(full):
        motion = _random_motion(robot, rng, joints)
        margin = static_margin(robot, motion)
        bin_ = int(np.searchsorted(margins, margin)) - 1
        if not 0 <= bin_ < bins or not full[bin_]:
            continue
        path = path_of(robot, motion)[::10]
        begins = static_margin(robot, replace(motion, change=0.0))
        if begins > TIPPED and all(clear_of_ground(vehicle, q) for q in path):
            found.append(motion)
            full[bin_] -= 1
    return found


def _random_motion(robot: Robot, rng: np.random.Generator, joints: Sequence[str]) -> ArmMotion:
    """Return a motion by 30 to 150 deg with up to 5 kg on a slope of up to 30 deg."""
    known = [robot.joint(name) for name in robot.joint_names]
    q = rng.uniform([max(j.lower, -np.pi) for j in known], [min(j.upper, np.pi) for j in known])
    load, tilt = rng.uniform(0.0, [5.0, np.radians(30.0)])
    change = rng.uniform(np.radians(30.0), np.radians(150.0)) * rng.choice([-1.0, 1.0])
    return ArmMotion(
        tuple(q.tolist()),
        joints[int(rng.integers(len(joints)))],
        float(change),
        Payload(float(load), robot.payload.cog),
        (float(tilt), float(rng.uniform(-np.pi, np.pi))),
    )


def tips_all(
    robot: Robot, motions: Sequence[ArmMotion], speed: float, ramp: float, workers: int = 2
) -> list[bool]:
    """Return `tips` of each motion, computed by `workers` processes."""
    n = len(motions)
    with Workers(workers, mp_context=get_context('spawn')) as pool:
        return list(pool.map(tips, [robot] * n, motions, [speed] * n, [ramp] * n, chunksize=8))
