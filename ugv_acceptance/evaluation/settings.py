"""Settings of an evaluation: joints in messages, IMU, limits, delays of alerts.

Joint order is `robot.joint_names`. SI and radians; times in seconds. `config` makes these from a
YAML file and validates them; they are not validated again here.
"""

from dataclasses import dataclass

from ugv_acceptance.evaluation.ground import NOT_ENTERED, Ground
from ugv_acceptance.evaluation.inputs.frames import Transform
from ugv_acceptance.model.robot import IDENTITY, ZERO, Matrix, Robot, Vector

# The attitude of an IMU that is not there: the base was declared to stand level.
LEVEL = 'level'
# Keys in `Settings.unknown`; that of a joint's limit is joints.NAME.limit.
CONTACTS, PAYLOAD_LINK = 'contacts', 'payload.link'
# Where the mounting of an IMU comes from: a number in the configuration, the frame its messages
# name, or nobody knows it.
GIVEN, AUTO, UNKNOWN = 'given', 'auto', 'unknown'
# The times in which the hand may touch the ground, if it always may.
ALWAYS = ((0.0, float('inf')),)


@dataclass(frozen=True, slots=True)
class JointInput:
    """How one joint is found in JointState messages: q = sign * position + offset.

    tau = effort_sign * effort_scale * effort (N m; N where prismatic).
    """

    topic_name: str
    sign: float = 1.0
    offset: float = 0.0
    effort_sign: float = 1.0
    effort_scale: float = 1.0


@dataclass(frozen=True, slots=True)
class ImuInput:
    """How the IMU is mounted on the robot, and how its messages are used.

    `mounting` rotates sensor axes into those of `link`, `position` is the sensor in it (m); '' is
    the root link. If a joint moves that link, the base's attitude follows from its position.
    `placed` is GIVEN; AUTO: by the frame of its messages, the robot's links and `transforms` (those
    of /tf_static); or UNKNOWN: no attitude is known.
    `attitude` is auto (orientation if it can be trusted, else accelerometer), orientation or
    accelerometer. With `specific_force` the accelerometer replaces gravity in every margin.
    `low_pass` (s) is the filter's time constant; `rest_acceleration` (m/s2) and `rest_rate` (rad/s)
    define rest; `agreement` (rad) is how far orientation and accelerometer may differ at rest, for
    at most `agreement_delay` (s). `frame` is the frame its messages must name; '': not checked.
    With `attitude` LEVEL there is no IMU: somebody declared that the base stands level, so torques
    are known and tip-over is not. `noise_free`: its numbers have no noise (a simulator), so that
    equal ones in a row are no fault.
    """

    mounting: Matrix = IDENTITY
    position: Vector = ZERO
    attitude: str = 'auto'
    specific_force: bool = False
    low_pass: float = 0.2
    rest_acceleration: float = 0.5
    rest_rate: float = 0.1
    agreement: float = 0.0872664625997165
    agreement_delay: float = 1.0
    frame: str = ''
    noise_free: bool = False
    placed: str = GIVEN
    link: str = ''
    transforms: tuple[Transform, ...] = ()


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits that turn margins into levels: WARN from `*_warn`, ERROR from `*_error` on.

    `torque` is the limit of each joint (N m or N; infinite: not judged); `torque_warn` and
    `torque_error` are utilisations |tau| / limit. Tip angles are the tilt left (rad). Deadbands are
    in N m (N) and rad. `speed` is the joint rate (rad/s or m/s) up to which the static model is
    valid; infinite: not judged. `friction` is that of the tracks on the ground; infinite: not
    known. `rated` are the joints' limits as configured, beyond which `torque` is relaxed (empty:
    not known).
    """

    torque: tuple[float, ...]
    torque_warn: float = 0.8
    torque_error: float = 1.0
    torque_deadband: float = 2.0
    tip_warn: float = 0.17453292519943295
    tip_error: float = 0.08726646259971647
    tip_deadband: float = 0.017453292519943295
    speed: tuple[float, ...] = ()
    friction: float = float('inf')
    rated: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Delays:
    """Seconds a level must last before an alert is raised (on) and must be gone to clear it (off).

    A tilt is noisy and swings, so tip-over has an `off` of its own (bench/bench_chatter.py says how
    long it must be). An input is stale when `stale_periods` of its own periods (at most 2 s), but
    at least `stale_after`, have passed without a message; silence is judged every `tick`.
    """

    tip_on: float = 0.1
    torque_on: float = 0.1
    fault_on: float = 0.0
    off: float = 1.0
    tip_off: float = 5.0
    stale_after: float = 0.1
    stale_periods: float = 3.0
    tick: float = 0.05


@dataclass(frozen=True, slots=True)
class Untold:
    """A joint that margins may do without: `position` (rad, m) is taken while no message tells it.

    `harmless`: wherever it is, no margin changes by more than is said in config/untold.py; else
    margins are shown, but are in doubt.
    """

    position: float
    harmless: bool


@dataclass(frozen=True, slots=True)
class Settings:
    """Everything an evaluation needs besides the messages; `joints` follows `robot.joint_names`.

    `unsafe` is the reason for limits beyond the ranges of permitted_limits.py; '' if none is. With
    `payload_known` the robot's payload is that carried until another is declared; without it, it is
    only assumed. `ground` is what the ground is taken for. `passive` are joints that only a spring
    or a stop holds: their limits are infinite. `moved_contacts` says of contact points that the
    file puts on a wheel what they are taken for. `hand_may_touch` are the times (from, to in s
    since the start) in which the arm may touch the ground, to pick something up: torques are not
    known while it does. `untold` says for each joint what is taken if no message ever tells it
    (None: margins are not known then; empty: so it is for all). `unknown` are keys of values that
    the configuration does not know (contacts, payload.link, joints.NAME.limit): what hangs on them
    is not checked, nothing passes.
    """

    robot: Robot
    joints: tuple[JointInput, ...]
    imu: ImuInput
    limits: Limits
    delays: Delays = Delays()
    unsafe: str = ''
    payload_known: bool = False
    ground: Ground = NOT_ENTERED
    passive: tuple[str, ...] = ()
    moved_contacts: tuple[str, ...] = ()
    hand_may_touch: tuple[tuple[float, float], ...] = ()
    untold: tuple[Untold | None, ...] = ()
    unknown: tuple[str, ...] = ()
    base_frame: str = ''
    frame_prefix: str = ''

    @property
    def frame(self) -> str:
        """The frame in which shapes are sent to viewers."""
        return self.frame_prefix + (self.base_frame or self.robot.root)

    @property
    def hears_joints(self) -> bool:
        """Whether margins need joint states: not of a robot without measured joints."""
        return bool(self.joints)

    @property
    def hears_imu(self) -> bool:
        """Whether margins need an IMU: not where the base was declared level."""
        return self.imu.attitude != LEVEL

    @property
    def judges_tilt(self) -> bool:
        """Whether tip-over is judged: with an IMU, where it is known on what the robot stands."""
        return self.hears_imu and CONTACTS not in self.unknown
