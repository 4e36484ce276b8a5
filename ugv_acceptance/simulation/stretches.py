"""Simulates a scenario in consecutive parts, so that a run can be of any length."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ugv_acceptance import AcceptanceError, BadConfig
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.simulation.engine import mujoco
from ugv_acceptance.simulation.scenario import ImuLog, JointLog, Noise, Recording, Scenario, Truth
from ugv_acceptance.simulation.simulation import BUILD, Simulation
from ugv_acceptance.simulation.vehicle import Build
from ugv_acceptance.type_aliases import Floats

# Share of a motor's limit from which it counts as saturated.
_ALL = 1.0 - 1e-9
# Warnings after which MuJoCo has reset itself to its first state.
_UNSTABLE = tuple(
    int(kind)
    for kind in (
        mujoco.mjtWarning.mjWARN_BADQPOS,
        mujoco.mjtWarning.mjWARN_BADQVEL,
        mujoco.mjtWarning.mjWARN_BADQACC,
    )
)


@dataclass(slots=True)
class Rows:
    """Samples collected during one part, each led by its time (s), made arrays at its end.

    A joint sample goes on with position, rate, effort; one of the IMU with orientation, rate,
    specific force; one of the base with position, z axis, the ground's tilt and the load.
    """

    joints: list[tuple[float, Floats, Floats, Floats]] = field(default_factory=list)
    imu: list[tuple[float, Floats, Floats, Floats]] = field(default_factory=list)
    base: list[tuple[Floats, Floats, float, float]] = field(default_factory=list)


def stretches(
    robot: Robot, scenario: Scenario, seed: int, length: float, build: Build = BUILD
) -> Iterator[Recording]:
    """Yield the run of `scenario` in parts of `length` (s); the same seed gives the same bits.

    Payloads are those from the part's start on; stamps count from the run's start. Raises BadConfig
    where the scenario and the robot do not fit, AcceptanceError where the simulation becomes
    unstable.
    """
    stride = stride_of(scenario, build)
    built = replace(build, blocks=scenario.blocks)
    simulation = Simulation(robot, scenario.start, scenario.slope, scenario.payload, built)
    sensors = Sensors(scenario.noise, np.random.default_rng(seed))
    waiting = sorted(scenario.commands, key=lambda c: c.time)
    loads: list[tuple[float, Payload]] = [(0.0, scenario.payload)]
    limit = np.array([robot.joint(name).effort for name in robot.joint_names])
    upright = simulation.base()[1]
    rows, tick = Rows(), 1.0 / scenario.imu_rate
    last, block = round(scenario.duration * scenario.imu_rate), length * scenario.imu_rate
    for count in range(last + 1):
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
            rows.base.append((*simulation.base(), simulation.slope()[0], simulation.load))
        if count == last or len(rows.imu) >= block:
            _check_stable(scenario, simulation)
            yield _recording(scenario, sensors, rows, loads, (limit, upright))
            rows, loads = Rows(), [(now + tick, loads[-1][1])]


def _check_stable(scenario: Scenario, simulation: Simulation) -> None:
    """Raise AcceptanceError where MuJoCo became unstable and reset itself: the rest is invalid."""
    if any(simulation.data.warning[kind].number for kind in _UNSTABLE):
        raise AcceptanceError(
            f'{scenario.name}: the simulation became unstable before {simulation.time:.1f} s'
        )


def _recording(
    scenario: Scenario,
    sensors: 'Sensors',
    rows: Rows,
    loads: list[tuple[float, Payload]],
    known: tuple[Floats, Floats],
) -> Recording:
    limit, upright = known
    joints = sensors.joints(rows)
    imu = sensors.imu(rows)
    position, up, slope, load = (np.array(c) for c in zip(*rows.base, strict=True))
    effort = np.array([row[3] for row in rows.joints])
    lean = np.maximum(np.arccos(np.clip(up @ upright, -1.0, 1.0)) - scenario.lean, 0.0)
    truth = Truth(joints.stamp, lean, np.abs(effort) >= limit * _ALL, position, slope, load)
    return Recording(scenario, joints, imu, tuple(loads), truth)


def stride_of(scenario: Scenario, build: Build) -> int:
    """Return the number of IMU samples per joint sample. Raises BadConfig if it is not whole."""
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


@dataclass(slots=True)
class Sensors:
    """The sensors of one run: biases are drawn once, noise for every sample."""

    noise: Noise
    rng: np.random.Generator
    _bias: tuple[Floats, Floats] | None = None

    def joints(self, rows: Rows) -> JointLog:
        """Return the joint states as encoders and drives measure them."""
        stamp, position, velocity, effort = (np.array(c) for c in zip(*rows.joints, strict=True))
        noise = self.noise
        return JointLog(
            stamp,
            self._read(position, noise.position, noise.position_step),
            self._read(velocity, noise.velocity, noise.velocity_step),
            self._read(effort, noise.effort, noise.effort_step),
        )

    def imu(self, rows: Rows) -> ImuLog:
        """Return the IMU's measurements."""
        stamp, orientation, rate, force = (np.array(c) for c in zip(*rows.imu, strict=True))
        noise = self.noise
        if self._bias is None:
            gyro = noise.gyro_bias * self.rng.standard_normal(3)
            self._bias = gyro, noise.acceleration_bias * self.rng.standard_normal(3)
        return ImuLog(
            stamp,
            self._turned(orientation),
            self._read(rate + self._bias[0], noise.gyro, noise.gyro_step),
            self._read(force + self._bias[1], noise.acceleration, noise.acceleration_step),
        )

    def _read(self, value: Floats, deviation: float, step: float) -> Floats:
        """Return values with noise of a standard deviation, rounded to the resolution `step`."""
        noisy = value + deviation * self.rng.standard_normal(value.shape)
        result: Floats = np.round(noisy / step) * step + 0.0  # no -0.0
        return result

    def _turned(self, orientation: Floats) -> Floats:
        """Return quaternions (n, 4) x y z w turned by small random angles, unit length to 1e-4."""
        half = self.noise.orientation / 2.0 * self.rng.standard_normal((len(orientation), 3))
        vector, w = orientation[:, :3], orientation[:, 3:]
        turned = np.hstack(
            [
                vector + w * half + np.cross(vector, half),
                w - np.sum(vector * half, axis=1, keepdims=True),
            ]
        )
        turned /= np.linalg.norm(turned, axis=1, keepdims=True)
        step = self.noise.orientation_step
        result: Floats = np.round(turned / step) * step
        return result


def run(robot: Robot, scenario: Scenario, seed: int, build: Build = BUILD) -> Recording:
    """Simulate `scenario` in one part; the same seed gives the same bits.

    Raises as `stretches` does.
    """
    (recording,) = stretches(robot, scenario, seed, math.inf, build)
    return recording
