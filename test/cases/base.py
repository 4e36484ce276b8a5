"""A PackBot that rests for ten seconds: what every case changes in one thing."""

import math
from dataclasses import dataclass, replace

import numpy as np
from made.run import EPOCH, NS, Imu, Joints, Message, Part, messages_of
from made.truth import Load, torques
from scipy.spatial.transform import Rotation

from ugv_acceptance.config import load
from ugv_acceptance.type_aliases import Floats

NAMES = ('turret_joint', 'shoulder_joint', 'elbow_joint', 'flipper_joint')
FOLDED = (0.1, math.radians(64.0), math.radians(86.0), math.pi)
# The load of the configuration (kg), which these recordings do not tell.
CARRIED = Load(4.0)
SECONDS, JOINTS_HZ, IMU_HZ = 10, 50, 100
# The robot stands turned by so much (rad: roll, pitch, yaw).
STANDS = (0.013, -0.021, 0.4)
G = 9.81


@dataclass(frozen=True, slots=True)
class Base:
    """The messages of the joints and of the IMU; a case replaces one of them or adds others."""

    joints: Joints
    imu: Imu
    more: tuple[Part, ...] = ()

    def messages(self) -> list[Message]:
        """Return all messages in the order of their log times."""
        return messages_of([self.joints, self.imu, *self.more])


def base(pose: tuple[float, ...] = FOLDED, imu_hz: int = IMU_HZ, hz: int = JOINTS_HZ) -> Base:
    """Return the recording that nothing is wrong with: exact numbers, effort = static torque."""
    time = EPOCH + np.arange(SECONDS * hz) * (NS // hz)
    felt = EPOCH + np.arange(SECONDS * imu_hz) * (NS // imu_hz)
    roll, pitch, yaw = STANDS
    position = np.tile(np.array(pose), (len(time), 1))
    return Base(
        Joints(NAMES, time, time, position, position * 0.0, static(position)),
        Imu(
            felt,
            felt,
            np.tile(turn(roll, pitch, yaw), (len(felt), 1)),
            np.zeros((len(felt), 3)),
            np.tile(upright(roll, pitch), (len(felt), 1)),
            covariances=(0.01, 0.0, 0.0),
        ),
    )


def static(position: Floats) -> Floats:
    """Return the static torques (n, 4) of the PackBot with its load as it stands."""
    roll, pitch, _ = STANDS
    return torques(load().settings.robot, position, upright(roll, pitch) / G, CARRIED)


def turn(roll: float, pitch: float = 0.0, yaw: float = 0.0) -> Floats:
    """Return the quaternion x, y, z, w of a base turned so (rad)."""
    return Rotation.from_euler('ZYX', [yaw, pitch, roll]).as_quat()


def upright(roll: float, pitch: float = 0.0) -> Floats:
    """Return the specific force (3,) at rest of a base turned so (rad)."""
    return Rotation.from_euler('ZYX', [0.0, pitch, roll]).inv().apply((0.0, 0.0, G))


def moving(joint: int, degps: float, start: float | None = None) -> Base:
    """Return the base with one joint that turns all the time; its effort follows."""
    made = base()
    position = made.joints.position.copy()
    begins = position[0, joint] if start is None else start
    seconds = (made.joints.log - EPOCH) / NS
    position[:, joint] = begins + math.radians(degps) * seconds
    velocity = np.zeros_like(position)
    velocity[:, joint] = math.radians(degps)
    told = replace(made.joints, position=position, velocity=velocity, effort=static(position))
    return replace(made, joints=told)


def shaken(gyro: float, force: float, seed: int, lean: float = 0.0) -> Imu:
    """Return an IMU on a shaking base that says it is level, while it leans by `lean` (rad)."""
    still, rng = base().imu, np.random.default_rng(seed)
    count = len(still.log)
    return replace(
        still,
        orientation=np.tile(turn(0.0, 0.0, math.radians(1.5)), (count, 1)),
        rate=gyro * rng.normal(size=(count, 3)),
        force=upright(lean) + force * rng.normal(size=(count, 3)),
    )
