"""The keys of a robot's YAML file, their units, defaults and ranges, as pydantic models.

Values are converted to SI and radians. Defaults not given here are those of evaluation/settings.py.
"""

import math
import re
from difflib import get_close_matches
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from ugv_acceptance.config.units import Given, Measure, parse, shown, split_key
from ugv_acceptance.evaluation.ground import PITCH
from ugv_acceptance.evaluation.permitted_limits import checked_reason
from ugv_acceptance.evaluation.settings import Delays, ImuInput, Limits
from ugv_acceptance.model.robot import Robot

# What a file says of a value that nobody knows: what hangs on it is not checked, nothing passes.
UNKNOWN = 'unknown'
# A node's full name, or one in the monitor's namespace.
NODE = r'/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*'
_IMU = ImuInput()
_LIMITS = Limits(())
_DELAYS = Delays()
_ROBOT = Robot('', (), (), ())


def _number(*kinds: str) -> BeforeValidator:
    return BeforeValidator(lambda value: parse(value, kinds).value)


def _given(*kinds: str) -> BeforeValidator:
    return BeforeValidator(lambda value: None if value is None else parse(value, kinds))


def _vector(kind: str) -> BeforeValidator:
    def three(value: object) -> tuple[float, ...]:
        unit = value.unit if isinstance(value, Measure) else None
        items = value.value if isinstance(value, Measure) else value
        if not isinstance(items, list | tuple) or len(items) != 3:
            raise ValueError(f'expected a list of three numbers, got {shown(items)}')
        return tuple(parse(Measure(x, unit) if unit else x, (kind,)).value for x in items)

    return BeforeValidator(three)


def _is_unknown(value: object) -> bool:
    """Return whether a value, with or without a unit in its key, is the word `unknown`."""
    return (value.value if isinstance(value, Measure) else value) == UNKNOWN


def _limit(value: object) -> Given | None:
    """Return a limit, None for null, and one of the kind UNKNOWN for that word."""
    if value is None or _is_unknown(value):
        return None if value is None else Given(math.nan, UNKNOWN)
    return parse(value, ('torque', 'force'))


def _points(value: object) -> object:
    """Return contact points by name, None for the word `unknown`."""
    if _is_unknown(value):
        return None
    if not isinstance(value, dict):
        raise ValueError(  # noqa: TRY004 - pydantic reports ValueError only
            f'expected points by name, or unknown, got {shown(value)}'
        )
    return value


def _sign(value: object) -> float:
    if isinstance(value, bool) or value not in (1, -1):
        raise ValueError(f'expected 1 or -1, got {shown(value)}')
    return float(value)


def _pose_name(name: str) -> str:
    """Refuse what --posture could not tell from joint=value,joint=value."""
    if not re.fullmatch('[A-Za-z][A-Za-z0-9_-]*', name):
        text = 'expected a name of letters, digits, - and _, such as STOW'
        raise ValueError(f'{text}, got {shown(name)}')
    return name


def _operators(names: object) -> object:
    """Refuse what are not names of nodes; an empty list, which could mean nobody or anybody."""
    if not isinstance(names, list) or not names:
        raise ValueError(
            'expected the nodes that may command, such as [acceptance_console, acceptance_tell]; '
            f'left out, anybody may; got {shown(names)}'
        )
    for name in names:
        if not isinstance(name, str) or not re.fullmatch(NODE, name):
            text = 'expected the name of a node, such as /acceptance_tell'
            raise ValueError(f'{text}, got {shown(name)}')
    return tuple(names)


def _pose(joints: object) -> object:
    if not isinstance(joints, dict):
        raise ValueError(  # noqa: TRY004 - pydantic reports ValueError only
            f'expected joints with positions, such as lift_joint_deg: 30, got {shown(joints)}'
        )
    return joints


Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Number = Annotated[float, _number()]
Angle = Annotated[float, _number('angle')]
Time = Annotated[NotNegative, _number('time')]
Mass = Annotated[NotNegative, _number('mass')]
Position = Annotated[tuple[float, float, float], _vector('length')]
Angles = Annotated[tuple[float, float, float], _vector('angle')]
Sign = Annotated[float, BeforeValidator(_sign)]
# Quantities of a joint: build.py checks the unit, since only the URDF says if it is prismatic.
Place = Annotated[Given, _given('angle', 'length')]
Effort = Annotated[Given | None, BeforeValidator(_limit)]
Rate = Annotated[Given | None, _given('angular rate', 'rate')]
Name = Annotated[str, Field(min_length=1, strict=True)]
TopicName = Annotated[
    str, Field(pattern=r'^[/~]?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*$')
]
PoseName = Annotated[str, AfterValidator(_pose_name)]
PoseSection = Annotated[dict[Name, object], BeforeValidator(_pose)]
Reason = Annotated[str, Field(strict=True), AfterValidator(checked_reason)]
Operators = Annotated[tuple[str, ...], BeforeValidator(_operators)]


class Section(BaseModel):
    """Base of all sections of the file: refuses unknown keys; a key may end in its value's unit."""

    model_config = ConfigDict(extra='forbid', frozen=True)

    @model_validator(mode='before')
    @classmethod
    def _read_units(cls, data: object) -> object:
        """Turn `offset_deg: 30` into offset = Measure(30, 'deg')."""
        if data is None:
            return {}
        if not isinstance(data, dict):
            raise ValueError(  # noqa: TRY004 - pydantic reports ValueError only
                f'expected keys with values, got {shown(data)}'
            )
        found: dict[str, object] = {}
        for key, value in data.items():
            name, written = cls._field(key, value)
            if name in found:
                raise _key_error(key, f'given twice, as {name} with different units')
            found[name] = written
        return found

    @classmethod
    def _field(cls, key: object, value: object) -> tuple[str, object]:
        if not isinstance(key, str):
            raise _key_error(
                key, 'expected a text as key (YAML reads on, off, yes, no as booleans)'
            )
        stem, unit = split_key(key)
        if key in cls.model_fields:
            return key, value
        if unit is None or stem not in cls.model_fields:
            raise _key_error(key, f'unknown key{cls._suggestion(key)}')
        return stem, value if value is None else Measure(value, unit)

    @classmethod
    def _suggestion(cls, key: str) -> str:
        near = get_close_matches(split_key(key)[0], cls.model_fields, 1, 0.5)
        known = ', '.join(cls.model_fields)
        return f'; did you mean {near[0]}?' if near else f'; known are {known}'


def _key_error(key: object, text: str) -> PydanticCustomError:
    return PydanticCustomError('key', '{text}', {'text': text, 'key': str(key)})


class QosSection(Section):
    """Quality of service (QoS) of a topic's subscription."""

    reliability: Literal['best_effort', 'reliable'] = 'best_effort'
    durability: Literal['volatile', 'transient_local'] = 'volatile'
    depth: Annotated[int, Field(ge=1, le=100000, strict=True)] = 100


class TopicSection(Section):
    """A topic's name, type, QoS and frame; defaults for missing keys are in topics.py."""

    name: TopicName
    type: str | None = None
    qos: QosSection | None = None
    frame_id: str | None = None


class DescriptionSection(Section):
    """The name of the topic on which the robot tells its URDF."""

    name: TopicName = 'robot_description'


JOINT_STATES, IMU_DATA = TopicSection(name='joint_states'), TopicSection(name='imu/data')


class TopicsSection(Section):
    """The topics of the inputs: joint states, IMU, payload; null: the robot has no such input.

    And the topic on which the robot tells its URDF.
    """

    joint_states: TopicSection | None = JOINT_STATES
    imu: TopicSection | None = IMU_DATA
    payload: TopicSection = TopicSection(name='payload')
    robot_description: DescriptionSection = DescriptionSection()


class LawSection(Section):
    """What a spring or a constant torque puts on a joint beside its motor, along its axis."""

    constant: Annotated[Given, _given('torque', 'force')] = Given(0.0)
    spring: Annotated[Given, _given('stiffness', 'linear stiffness')] = Given(0.0)
    rest: Place = Given(0.0)


class JointSection(Section):
    """How one joint is found in messages, its limits, and what holds it beside a motor."""

    topic_name: Name | None = None
    sign: Sign = 1.0
    offset: Place = Given(0.0)
    effort_sign: Sign = 1.0
    effort_scale: Annotated[Positive, _number()] = 1.0
    limit: Effort = None
    static_speed: Rate = None
    passive: Annotated[bool, Field(strict=True)] = False
    law: LawSection | None = None


class LinkSection(Section):
    """Mass (kg) and centre of gravity (m, link axes) of a link, instead of the URDF's."""

    mass: Mass | None = None
    cog: Position | None = None


class ImuSection(Section):
    """Mounting, position and use of the IMU, as in evaluation.settings.ImuInput.

    `mounting` is what stands in place of numbers: found by the frame of its messages, or unknown.
    """

    mounting: Literal['auto', 'unknown'] | None = None
    mounting_rpy: Angles = (0.0, 0.0, 0.0)
    link: Name | None = None
    position: Position = _IMU.position
    attitude: Literal['auto', 'orientation', 'accelerometer', 'level'] = 'auto'
    specific_force: Annotated[bool, Field(strict=True)] = _IMU.specific_force
    low_pass: Time = _IMU.low_pass
    rest_acceleration: Annotated[Positive, _number('acceleration')] = _IMU.rest_acceleration
    rest_rate: Annotated[Positive, _number('angular rate')] = _IMU.rest_rate
    agreement: Annotated[Positive, _number('angle')] = _IMU.agreement
    agreement_delay: Time = _IMU.agreement_delay
    noise_free: Annotated[bool, Field(strict=True)] = _IMU.noise_free


class ContactSection(Section):
    """A contact point with which the robot can stand on the ground (m, link axes)."""

    link: Name
    position: Position


class GroundSection(Section):
    """Height of the tracks' ground plane in base_link, tolerance of contact with it, its kind.

    `kind` and `pitch` as in evaluation.ground.Ground; without a kind the ground is taken as flat.
    """

    height: Annotated[float, _number('length')] = _ROBOT.ground
    tolerance: Annotated[Positive, _number('length')] = _ROBOT.contact_tolerance
    kind: Literal['flat', 'uneven', 'stairs'] | None = None
    pitch: Annotated[Positive, _number('length')] = PITCH


class PayloadSection(Section):
    """The payload carried until a message on the payload topic declares another.

    `known`: it is carried from the start, so that nothing is open before the first message.
    """

    link: Name
    mass: Mass = 0.0
    cog: Position = (0.0, 0.0, 0.0)
    known: Annotated[bool, Field(strict=True)] = False


class LimitsSection(Section):
    """The limits that turn margins into levels, as in evaluation.settings.Limits."""

    torque_warn: Annotated[Positive, _number()] = _LIMITS.torque_warn
    torque_error: Annotated[Positive, _number()] = _LIMITS.torque_error
    torque_deadband: Annotated[NotNegative, _number('torque', 'force')] = _LIMITS.torque_deadband
    tip_warn: Angle = _LIMITS.tip_warn
    tip_error: Angle = _LIMITS.tip_error
    tip_deadband: Annotated[NotNegative, _number('angle')] = _LIMITS.tip_deadband
    friction: Annotated[Positive, _number()] | None = None


class DelaysSection(Section):
    """Delays of alerts and timeouts of inputs, as in evaluation.settings.Delays."""

    tip_on: Time = _DELAYS.tip_on
    torque_on: Time = _DELAYS.torque_on
    fault_on: Time = _DELAYS.fault_on
    off: Time = _DELAYS.off
    tip_off: Time = _DELAYS.tip_off
    stale_after: Time = _DELAYS.stale_after
    stale_periods: Annotated[float, Field(ge=1), _number()] = _DELAYS.stale_periods
    tick: Annotated[Positive, _number('time')] = _DELAYS.tick


class RobotSection(Section):
    """Name and serial number of the robot, and how its frames are named for viewers."""

    name: Name
    serial: Annotated[str, Field(strict=True)] | None = None
    base_frame: Name | None = None
    frame_prefix: Annotated[str, Field(strict=True)] = ''


class File(Section):
    """The keys of a robot's YAML file."""

    robot: RobotSection
    urdf: Name | None = None
    topics: TopicsSection = TopicsSection()
    joints: dict[str, JointSection] | None = None
    held: dict[str, Place] = {}
    links: dict[str, LinkSection] = {}
    # Joint, with the unit or without -> position: read by poses.py, which knows the joints.
    poses: dict[PoseName, PoseSection] = {}
    imu: ImuSection = ImuSection()
    contacts: Annotated[dict[str, ContactSection] | None, BeforeValidator(_points)] = {}
    ground: GroundSection = GroundSection()
    payload: PayloadSection | None = None
    limits: LimitsSection = LimitsSection()
    delays: DelaysSection = DelaysSection()
    unsafe_limits: Reason | None = None
    operators: Operators | None = None
    gravity: Annotated[Positive, _number('acceleration')] = _ROBOT.gravity
    uncertainty: dict[str, Annotated[NotNegative, _number()]] = {}
    assumed: dict[str, Reason] | None = None
