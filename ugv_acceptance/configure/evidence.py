"""What a recording or a running robot tells beside its URDF, as plain values."""

from dataclasses import dataclass
from pathlib import PurePath

from ugv_acceptance.model.robot import Matrix, Vector

# Where it was seen, if not in a recording.
LIVE = 'live'


@dataclass(frozen=True, slots=True)
class SeenTopic:
    """A topic with its type, number of messages, rate (Hz) and the frames its messages name."""

    name: str
    type: str
    count: int
    rate: float
    frames: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SeenJoint:
    """A joint as messages name it: its position at rest (rad, m) and the range it went through.

    `effort` is whether its messages carry an effort.
    """

    topic_name: str
    at_rest: float
    lowest: float
    highest: float
    effort: bool


@dataclass(frozen=True, slots=True)
class SeenImu:
    """An IMU at rest: mean specific force (m/s2) and orientation in sensor axes; None: not told.

    `orientation` turns sensor axes into the world's, as in the message.
    """

    topic: str
    frame: str
    specific_force: Vector | None
    orientation: Matrix | None


@dataclass(frozen=True, slots=True)
class StaticTransform:
    """A transform of /tf_static: where `child` is in `parent` (m, rotation of its axes)."""

    parent: str
    child: str
    xyz: Vector
    rotation: Matrix


@dataclass(frozen=True, slots=True)
class Evidence:
    """What was seen of a robot: `where` is the recording's path, or 'live'.

    `urdf` is the text of /robot_description. `joints` are those of the topic `joint_states`, which
    fits the URDF best; `rivals` are the topics that fit as well. `imus` are all IMUs, one a topic
    and frame.
    """

    where: str
    topics: tuple[SeenTopic, ...] = ()
    urdf: bytes | None = None
    transforms: tuple[StaticTransform, ...] = ()
    joint_states: str | None = None
    joints: tuple[SeenJoint, ...] = ()
    imus: tuple[SeenImu, ...] = ()
    doubts: tuple[str, ...] = ()
    rivals: tuple[str, ...] = ()

    @property
    def place(self) -> str:
        """Where it was seen, in short: the recording's name, or the running robot."""
        return 'the running robot' if self.where == LIVE else PurePath(self.where).name
