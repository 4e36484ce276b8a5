"""The input and output of a simulated run: commands at times, sensor noise, and the recording."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.roles import roles_of
from ugv_acceptance.simulation.shape import Block
from ugv_acceptance.type_aliases import Floats

NO_LOAD = Payload()
# Lean (rad) from which a robot is off its stance (2 deg), and from which it counts as tipped
# (15 deg), although its arm may then keep it from turning over.
LIFTED, TIPPED = 0.035, 0.262
# Noise of an effort as a share of the least limit of the robot's motors.
EFFORT_NOISE = 0.002


@dataclass(frozen=True, slots=True)
class Command:
    """A command given at `time` (s); a part that is None or not named stays as it was.

    `joints` pairs joint names with targets (rad, m), reached smoothly at a peak rate of `speed`
    (rad/s, m/s). `drive` is forward speed (m/s) and yaw rate (rad/s), reached at a peak of
    `drive_rate` (m/s2, rad/s2). `slope` is tilt and heading (rad) of the ground, reached at
    `slope_rate` (rad/s). `payload` is declared at `time` and in the gripper `payload_time` (s)
    later: until then the arm takes more and more of its weight, as off the ground; 0: all at once.
    """

    time: float
    joints: tuple[tuple[str, float], ...] = ()
    speed: float = 0.3
    drive: tuple[float, float] | None = None
    drive_rate: float = 1.0
    slope: tuple[float, float] | None = None
    slope_rate: float = 0.05
    payload: Payload | None = None
    payload_time: float = 0.0


@dataclass(frozen=True, slots=True)
class Noise:
    """Errors of the sensors: standard deviations of each sample, constant biases, resolutions.

    Units: rad, rad/s, N m (N where prismatic), m/s2. The orientation's error is a small rotation.
    Resolutions are powers of two, as those of converters.
    """

    position: float = 0.0002
    velocity: float = 0.002
    effort: float = 0.1
    orientation: float = 0.0005
    gyro: float = 0.002
    gyro_bias: float = 0.002
    acceleration: float = 0.03
    acceleration_bias: float = 0.02
    position_step: float = 2.0**-13
    velocity_step: float = 2.0**-10
    effort_step: float = 2.0**-6
    orientation_step: float = 2.0**-16
    gyro_step: float = 2.0**-12
    acceleration_step: float = 2.0**-9


def noise_of(robot: Robot) -> Noise:
    """Return the usual noise; efforts of a robot with weak motors are measured as much finer."""
    wheels = roles_of(robot).wheels
    limits = [robot.joint(name).effort for name in robot.joint_names if name not in wheels]
    usual = Noise()
    effort = EFFORT_NOISE * min(limits, default=math.inf)
    if effort >= usual.effort:
        return usual
    return replace(usual, effort=effort, effort_step=2.0 ** math.floor(math.log2(effort / 4.0)))


@dataclass(frozen=True, slots=True)
class Scenario:
    """A run of `duration` (s) from a start at rest; commands in the order of their times.

    `start` pairs joint names with positions (rad, m), others start at 0; `slope` is tilt and
    heading (rad) of the ground, on which `blocks` lie; a robot on them may lean by `lean` (rad)
    without tipping. Rates in Hz; the joints' divides the IMU's.
    """

    name: str
    duration: float
    start: tuple[tuple[str, float], ...] = ()
    slope: tuple[float, float] = (0.0, 0.0)
    payload: Payload = NO_LOAD
    commands: tuple[Command, ...] = ()
    joint_rate: float = 200.0
    imu_rate: float = 400.0
    noise: Noise = Noise()
    blocks: tuple[Block, ...] = ()
    lean: float = 0.0


@dataclass(frozen=True, slots=True)
class JointLog:
    """Joint states: `stamp` (n,) s, the others (n, j) in the order of `robot.joint_names`."""

    stamp: Floats
    position: Floats
    velocity: Floats
    effort: Floats


@dataclass(frozen=True, slots=True)
class ImuLog:
    """IMU (REP-145): `stamp` (n,) s, `orientation` (n, 4) x y z w, rad/s and m/s2 (n, 3)."""

    stamp: Floats
    orientation: Floats
    angular_velocity: Floats
    linear_acceleration: Floats


@dataclass(frozen=True, slots=True)
class Truth:
    """What really happened to the robot, at the joints' stamps; no sensor measures it.

    `lean` (n,) is the angle (rad) between the robot's z axis and the ground's normal at the start,
    less what its blocks explain; `saturated` (n, j) says which motors are at their limit;
    `position` (n, 3) is `base_link` in the ground's axes (m); `slope` (n,) the ground's tilt (rad);
    `load` (n,) the mass (kg) that the gripper bears.
    """

    stamp: Floats
    lean: Floats
    saturated: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
    position: Floats
    slope: Floats
    load: Floats

    @property
    def tipped_at(self) -> float:
        """Time (s) at which a robot that tipped left its stance; infinite if it did not tip."""
        over = self.lean > TIPPED
        if not over.any():
            return float('inf')
        before = np.flatnonzero(self.lean[: int(over.argmax())] < LIFTED)
        return float(self.stamp[before[-1]]) if before.size else 0.0


@dataclass(frozen=True, slots=True)
class Recording:
    """A simulated run: the readings of its joints and IMU, its payloads, and what really happened.

    `payload` lists the times (s) from which each payload was declared, the first at 0.
    """

    scenario: Scenario
    joints: JointLog
    imu: ImuLog
    payload: tuple[tuple[float, Payload], ...]
    truth: Truth
