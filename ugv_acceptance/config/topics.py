"""The topics of a robot's messages: names, types, quality of service and frames."""

from dataclasses import dataclass

from ugv_acceptance.config.build import Build
from ugv_acceptance.config.schema import IMU_DATA, JOINT_STATES, File, QosSection, TopicSection
from ugv_acceptance.evaluation.settings import Settings

TYPES = {
    'joint_states': 'sensor_msgs/msg/JointState',
    'imu': 'sensor_msgs/msg/Imu',
    'payload': 'geometry_msgs/msg/InertiaStamped',
}
_QOS = {
    'joint_states': QosSection(),
    'imu': QosSection(),
    'payload': QosSection(reliability='reliable', depth=10),
}


@dataclass(frozen=True, slots=True)
class Topic:
    """The topic of one input, with its type and quality of service (QoS).

    `reliability` is best_effort or reliable, `durability` volatile or transient_local, `depth` the
    length of the queue. `frame_id` is the frame its messages should name; None: any. An input that
    is not `used` is not listened to: the configuration says that the robot has none, or needs none.
    """

    name: str
    type: str
    reliability: str
    durability: str
    depth: int
    frame_id: str | None
    used: bool = True


@dataclass(frozen=True, slots=True)
class Topics:
    """The topics of all inputs of an evaluation, and that on which the robot tells its URDF."""

    joint_states: Topic
    imu: Topic
    payload: Topic
    robot_description: str = 'robot_description'

    @property
    def names(self) -> tuple[str | None, str | None, str]:
        """The names of the topics of joint states, IMU and payload; None: it is not used."""
        joints, imu = (t.name if t.used else None for t in (self.joint_states, self.imu))
        return joints, imu, self.payload.name

    @property
    def used(self) -> dict[str, Topic]:
        """The topics to listen to, by the name of their input."""
        every = {'joint_states': self.joint_states, 'imu': self.imu, 'payload': self.payload}
        return {name: topic for name, topic in every.items() if topic.used}


def topics_named(file: File) -> Topics:
    """Return the topics that a file names, without its URDF: an input is used unless it is null."""
    given = file.topics
    sections = {'joint_states': given.joint_states, 'imu': given.imu, 'payload': given.payload}
    instead = {'joint_states': JOINT_STATES, 'imu': IMU_DATA}
    found = {
        key: _given(key, section or instead[key], used=section is not None)
        for key, section in sections.items()
    }
    return Topics(**found, robot_description=given.robot_description.name)


def topics_from(build: Build, settings: Settings) -> Topics:
    """Return the topics; BadConfig if two share a name or a type is not the supported one."""
    given = build.file.topics
    sections = {
        'joint_states': given.joint_states or JOINT_STATES,
        'imu': given.imu or IMU_DATA,
        'payload': given.payload,
    }
    used = {'joint_states': settings.hears_joints, 'imu': settings.hears_imu, 'payload': True}
    described = given.robot_description.name
    names = [*(section.name for section in sections.values()), described]
    for key, section in sections.items():
        if names.count(section.name) > 1:
            raise build.refuse(
                ('topics', key, 'name'),
                f'expected a topic of its own, got {section.name}, which another input has too',
            )
    found = {k: _topic(build, k, s, used=used[k]) for k, s in sections.items()}
    return Topics(**found, robot_description=described)


def _topic(build: Build, key: str, section: TopicSection, *, used: bool) -> Topic:
    kind = section.type or TYPES[key]
    if kind != TYPES[key]:
        raise build.refuse(('topics', key, 'type'), f'expected {TYPES[key]}, got {kind}')
    return _given(key, section, used=used)


def _given(key: str, section: TopicSection, *, used: bool) -> Topic:
    qos, frame = section.qos or _QOS[key], section.frame_id
    return Topic(section.name, TYPES[key], qos.reliability, qos.durability, qos.depth, frame, used)
