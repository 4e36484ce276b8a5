"""The topics of a robot's messages: names, types, quality of service and frames."""

from dataclasses import dataclass

from ugv_acceptance.config.build import Build
from ugv_acceptance.config.schema import QosSection, TopicSection

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
    length of the queue. `frame_id` is the frame its messages should name; None: any.
    """

    name: str
    type: str
    reliability: str
    durability: str
    depth: int
    frame_id: str | None


@dataclass(frozen=True, slots=True)
class Topics:
    """The topics of all inputs of an evaluation."""

    joint_states: Topic
    imu: Topic
    payload: Topic

    @property
    def names(self) -> tuple[str, str, str]:
        """The names of the topics of joint states, IMU and payload."""
        return self.joint_states.name, self.imu.name, self.payload.name


def topics_from(build: Build) -> Topics:
    """Return the topics; BadConfig if two share a name or a type is not the supported one."""
    given = build.file.topics
    sections = {'joint_states': given.joint_states, 'imu': given.imu, 'payload': given.payload}
    names = [section.name for section in sections.values()]
    for key, section in sections.items():
        if names.count(section.name) > 1:
            raise build.refuse(
                ('topics', key, 'name'),
                f'expected a topic of its own, got {section.name}, which another input has too',
            )
    return Topics(**{key: _topic(build, key, section) for key, section in sections.items()})


def _topic(build: Build, key: str, section: TopicSection) -> Topic:
    kind = section.type or TYPES[key]
    if kind != TYPES[key]:
        raise build.refuse(('topics', key, 'type'), f'expected {TYPES[key]}, got {kind}')
    qos = section.qos or _QOS[key]
    return Topic(section.name, kind, qos.reliability, qos.durability, qos.depth, section.frame_id)
