"""Small robots and what they send, for tests of what is derived from messages."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from made.run import EPOCH, NS, Imu, Joints, Message, write
from scipy.spatial.transform import Rotation

from ugv_acceptance.bag.description import TYPE as STRING
from ugv_acceptance.bag.encode import string_message
from ugv_acceptance.bag.transforms import TYPE as TF
from ugv_acceptance.bag.transforms import transforms_cdr

G = 9.81
Told = tuple[str, str, Sequence[float], Sequence[float]]


def urdf_of(
    *joints: str,
    mounting: tuple[float, float, float] = (0.0, 0.0, 0.0),
    imu: str = 'imu_link',
    parent: str = 'base_link',
) -> str:
    """Return a URDF: `joints` made by `joint`, and an IMU's link, turned by rpy in degrees."""
    rpy = ' '.join(str(math.radians(angle)) for angle in mounting)
    sensor = f"""
  <link name="{imu}"/>
  <joint name="imu_joint" type="fixed">
    <parent link="{parent}"/><child link="{imu}"/><origin xyz="0.1 0 0.2" rpy="{rpy}"/>
  </joint>"""
    return f"""<robot name="made">
  <link name="base_link">
    <inertial><mass value="10"/>
      <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>{''.join(joints)}{sensor if imu else ''}
</robot>"""


def joint(
    name: str,
    kind: str = 'revolute',
    effort: float | None = 20.0,
    span: tuple[float, float] = (-3.0, 3.0),
    cog: float = 0.3,
    parent: str = 'base_link',
    more: str = '',
) -> str:
    """Return the XML of a joint about y and its link, whose centre of gravity is `cog` (m) off."""
    limit = '' if effort is None else f' effort="{effort}"'
    return f"""
  <link name="{name}_link">
    <inertial><origin xyz="{cog} 0 0"/><mass value="1"/>
      <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="{name}" type="{kind}">
    <parent link="{parent}"/><child link="{name}_link"/><axis xyz="0 1 0"/>
    <limit lower="{span[0]}" upper="{span[1]}" velocity="1"{limit}/>{more}
  </joint>"""


@dataclass(frozen=True, slots=True)
class Sent:
    """What a robot sends for `seconds`: joints by name and position, and an IMU."""

    joints: dict[str, float]
    seconds: float = 4.0
    hz: int = 20

    @property
    def time(self) -> 'np.ndarray[tuple[int], np.dtype[np.int64]]':
        """Log times and stamps (n,) in ns."""
        return EPOCH + np.arange(int(self.seconds * self.hz)) * (NS // self.hz)

    def states(self, topic: str = '/joint_states', *, effort: bool = True) -> Joints:
        """Return the joint states of a robot that stands still."""
        time, position = self.time, np.tile(list(self.joints.values()), (self.count, 1))
        felt = np.ones_like(position) if effort else None
        return Joints(tuple(self.joints), time, time, position, None, felt, topic)

    @property
    def count(self) -> int:
        """The number of messages."""
        return len(self.time)

    def imu(
        self,
        sensor: Rotation = Rotation.identity(),  # noqa: B008 (a constant)
        lean: float = 0.0,
        frame: str = 'imu_link',
        topic: str = '/imu/data',
    ) -> Imu:
        """Return an IMU at rest whose axes are turned into the robot's by `sensor`.

        The robot leans by `lean` (rad) about x.
        """
        to_world = Rotation.from_euler('x', lean) * sensor
        up = to_world.inv().apply((0.0, 0.0, G))
        still = np.zeros((self.count, 3))
        turned = np.tile(to_world.as_quat(), (self.count, 1))
        force = np.tile(up, (self.count, 1))
        return Imu(self.time, self.time, turned, still, force, frame, topic=topic)


def mounted(roll: float, pitch: float, yaw: float) -> Rotation:
    """Return how an IMU is turned by rpy in degrees, as in a URDF."""
    return Rotation.from_euler('xyz', [roll, pitch, yaw], degrees=True)


def description(text: str, topic: str = '/robot_description', log: int = EPOCH) -> Message:
    """Return the message of a URDF."""
    return Message(log, topic, STRING, string_message(text))


def static(transforms: Sequence[Told], log: int = EPOCH, topic: str = '/tf_static') -> Message:
    """Return the message of fixed frames."""
    return Message(log, topic, TF, transforms_cdr(transforms))


def recorded(path: Path, *parts: Joints | Imu | Message) -> Path:
    """Write a recording of these messages, in order of their log times; return its path."""
    messages: list[Message] = []
    for part in parts:
        messages += [part] if isinstance(part, Message) else part.messages()
    ordered = sorted(messages, key=lambda message: message.log)
    return write(path, ordered)


def later(part: Imu, seconds: float) -> Imu:
    """Return the same messages that much later."""
    moved = part.log + round(seconds * NS)
    return replace(part, log=moved, stamp=moved)
