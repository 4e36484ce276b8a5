"""Run a scenario to its end as fast as it goes and return what its topics would have said."""

from dataclasses import dataclass, field

import numpy as np

from ugv_acceptance import BadConfig
from ugv_acceptance.model.blocks import Floats
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.simulation.scenario import ImuLog, JointLog, Noise, Recording, Scenario, Truth
from ugv_acceptance.simulation.simulation import BUILD, Simulation
from ugv_acceptance.simulation.vehicle import Build


@dataclass(slots=True)
class _Rows:
    """Samples as they come; arrays when the run is over."""

    joints: list[tuple[float, Floats, Floats, Floats]] = field(default_factory=list)
    imu: list[tuple[float, Floats, Floats, Floats]] = field(default_factory=list)
    base: list[tuple[Floats, Floats, float]] = field(default_factory=list)


def run(robot: Robot, scenario: Scenario, seed: int, build: Build = BUILD) -> Recording:
    """Simulate `scenario`; the same seed gives the same bits.

    Raises BadConfig where the scenario and the robot do not fit.
    """
    stride = _stride(scenario, build)
    simulation = Simulation(robot, scenario.start, scenario.slope, scenario.payload, build)
    waiting = sorted(scenario.commands, key=lambda c: c.time)
    loads: list[tuple[float, Payload]] = [(0.0, scenario.payload)]
    rows = _Rows()
    tick = 1.0 / scenario.imu_rate
    for count in range(round(scenario.duration * scenario.imu_rate) + 1):
        if count:
            simulation.advance(tick)
        now = count * tick
        while waiting and waiting[0].time <= now + tick / 2:
            command = waiting.pop(0)
            simulation.apply(command)
            if command.payload is not None:
                loads.append((now, command.payload))
        rows.imu.append((now, *simulation.imu()))
        if count % stride == 0:
            rows.joints.append((now, *simulation.joints()))
            rows.base.append((*simulation.base(), simulation.slope()[0]))
    noise, rng = scenario.noise, np.random.default_rng(seed)
    return Recording(
        scenario,
        _joint_log(rows, noise, rng),
        _imu_log(rows, noise, rng),
        tuple(loads),
        _truth(rows, simulation),
    )


def _stride(scenario: Scenario, build: Build) -> int:
    """Return how many IMU samples come for one of the joints. Raises BadConfig if none fits."""
    steps = 1.0 / (scenario.imu_rate * build.timestep)
    if abs(steps - round(steps)) > 1e-9 or round(steps) < 1:
        raise BadConfig(
            f'{scenario.name}: expected an IMU period that is a multiple of the time step '
            f'{build.timestep} s, got {scenario.imu_rate} Hz'
        )
    stride = scenario.imu_rate / scenario.joint_rate
    if abs(stride - round(stride)) > 1e-9 or round(stride) < 1:
        raise BadConfig(
            f'{scenario.name}: expected a joint rate that divides the IMU rate '
            f'{scenario.imu_rate} Hz, got {scenario.joint_rate} Hz'
        )
    return round(stride)


def _joint_log(rows: _Rows, noise: Noise, rng: np.random.Generator) -> JointLog:
    stamp, position, velocity, effort = (np.array(c) for c in zip(*rows.joints, strict=True))
    return JointLog(
        stamp,
        _read(position, noise.position, noise.position_step, rng),
        _read(velocity, noise.velocity, noise.velocity_step, rng),
        _read(effort, noise.effort, noise.effort_step, rng),
    )


def _imu_log(rows: _Rows, noise: Noise, rng: np.random.Generator) -> ImuLog:
    stamp, orientation, rate, force = (np.array(c) for c in zip(*rows.imu, strict=True))
    rate = rate + noise.gyro_bias * rng.standard_normal(3)
    force = force + noise.acceleration_bias * rng.standard_normal(3)
    return ImuLog(
        stamp,
        _turned(orientation, noise, rng),
        _read(rate, noise.gyro, noise.gyro_step, rng),
        _read(force, noise.acceleration, noise.acceleration_step, rng),
    )


def _read(value: Floats, deviation: float, step: float, rng: np.random.Generator) -> Floats:
    """Return what a converter of resolution `step` makes of a noisy value."""
    noisy = value + deviation * rng.standard_normal(value.shape)
    result: Floats = np.round(noisy / step) * step + 0.0  # no -0.0
    return result


def _turned(orientation: Floats, noise: Noise, rng: np.random.Generator) -> Floats:
    """Return quaternions (n, 4) x y z w turned by small random angles, of unit length to 1e-4."""
    half = noise.orientation / 2.0 * rng.standard_normal((len(orientation), 3))
    vector, w = orientation[:, :3], orientation[:, 3:]
    turned = np.hstack(
        [
            vector + w * half + np.cross(vector, half),
            w - np.sum(vector * half, axis=1, keepdims=True),
        ]
    )
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    result: Floats = np.round(turned / noise.orientation_step) * noise.orientation_step
    return result


def _truth(rows: _Rows, simulation: Simulation) -> Truth:
    position, up, slope = (np.array(c) for c in zip(*rows.base, strict=True))
    vehicle = simulation.vehicle
    limit = np.array([vehicle.robot.joint(name).effort for name in vehicle.robot.joint_names])
    effort = np.array([row[3] for row in rows.joints])
    lean = np.arccos(np.clip(up @ up[0], -1.0, 1.0))
    stamp = np.array([row[0] for row in rows.joints])
    return Truth(stamp, lean, np.abs(effort) >= limit * (1 - 1e-9), position, slope)
