"""The sentences of alerts for people: what happened, what to do, and which part to suspect."""

import math
from enum import Enum

from ugv_acceptance.evaluation.alerts.state_machine import WARN, Alert
from ugv_acceptance.evaluation.permitted_limits import relaxed
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import TURNING


class FailureSource(Enum):
    """A leaf of the taxonomy of failures (Carlson and Murphy); the value is the text people see."""

    EFFECTOR = 'effector'
    SENSOR = 'sensor'
    CONTROL_SYSTEM = 'control system'
    POWER = 'power'
    COMMUNICATIONS = 'communications'
    DESIGN = 'design'
    INTERACTION = 'interaction'

    @property
    def physical(self) -> bool:
        """Whether a part of the robot failed; else a human did."""
        return self not in HUMAN

    @property
    def path(self) -> str:
        """The path from the root of the taxonomy, such as "physical / effector"."""
        return f'{"physical" if self.physical else "human"} / {self.value}'


HUMAN = frozenset({FailureSource.DESIGN, FailureSource.INTERACTION})

# Alert code -> where to look first. An alert shows an effect, so this is a suspicion, no verdict: a
# robot that tips was most often driven there, a silent input is most often a communication fault.
FIRST_SUSPECT = {
    'TORQUE_LIMIT': FailureSource.EFFECTOR,
    'TIP_OVER': FailureSource.INTERACTION,
    'NO_SUPPORT': FailureSource.INTERACTION,
    'STATIC_MODEL': FailureSource.INTERACTION,
    'SLIDE': FailureSource.INTERACTION,
    'TIP_AHEAD': FailureSource.INTERACTION,
    'TORQUE_AHEAD': FailureSource.INTERACTION,
    'EFFORT_LIMIT': FailureSource.EFFECTOR,
    'MOTOR_WEAK': FailureSource.EFFECTOR,
    'ENCODER_FROZEN': FailureSource.SENSOR,
    'INPUT_STALE': FailureSource.COMMUNICATIONS,
    'INPUT_INCOMPLETE': FailureSource.SENSOR,
    'INPUT_INVALID': FailureSource.SENSOR,
    'CLOCK': FailureSource.CONTROL_SYSTEM,
    'POSITION_LEAP': FailureSource.SENSOR,
    'IMU_FRAME': FailureSource.DESIGN,
    'IMU_ORIENTATION': FailureSource.SENSOR,
    'IMU_GRAVITY': FailureSource.SENSOR,
    'IMU_INCONSISTENT': FailureSource.SENSOR,
    'PAYLOAD_INVALID': FailureSource.INTERACTION,
    'LIMITS_RELAXED': FailureSource.INTERACTION,
}


# Code -> (what happened, what to do). {subject} is a joint, input or robot, {peak} the worst value.
WORDS = {
    'TORQUE_LIMIT': (
        '{subject} needs {peak:.1f} {unit}; its limit is {limit:.1f} {unit}',
        'bring the load closer to the joint, or set it down',
    ),
    'TIP_OVER': (
        '{tilt} to the {subject}; {kind} {limit:.1f} degrees of tilt left',
        'lower the arm, bring it over the tracks, face the slope; if it stands well, check the IMU',
    ),
    'NO_SUPPORT': (
        'the contact points give no support polygon, or nothing presses on the ground',
        'stop; check that the robot stands on its tracks',
    ),
    'STATIC_MODEL': (
        '{subject} moves at {peak:.2f} {rate}; the static model holds to {limit:.2f} {rate}',
        'move the joint more slowly',
    ),
    'SLIDE': (
        'the tracks slide before it tips: {slope:.1f} degrees of slope left',
        'stop; go back to where the slope is less, straight up or down it',
    ),
    'TIP_AHEAD': (
        'tips to the {subject} within {seconds:.1f} s if it goes on like this',
        'stop the motion that brings it there',
    ),
    'TORQUE_AHEAD': (
        '{subject} is at its limit within {seconds:.1f} s if it goes on like this',
        'stop the motion that brings it there',
    ),
    'EFFORT_LIMIT': (
        'the motor of {subject} gives {peak:.1f} {unit}; its limit is {torque:.1f} {unit}',
        'move the joint more slowly, bring the load closer, or set it down',
    ),
    'MOTOR_WEAK': (
        'the motor of {subject} gives no more, below its limit, while its posture needs more',
        'set the load down; check the supply and the motor, or the limit in the configuration',
    ),
    'ENCODER_FROZEN': (
        '{subject} does not move at all while its effort changes',
        'check its encoder; else something blocks the joint or pulls at it',
    ),
    'INPUT_STALE': (
        'no message from {subject}',
        'check that its driver runs, its topic name and its quality of service',
    ),
    'INPUT_INCOMPLETE': (
        'at least one joint of the robot is missing from {subject}, or is not refreshed',
        'check the joint names in the configuration against the topic',
    ),
    'INPUT_INVALID': (
        '{subject} holds numbers that cannot be used',
        'check for not-a-number, degrees for radians, raw counts, a quaternion that is no rotation',
    ),
    'CLOCK': (
        'header stamps of {subject} are over a second from the time of receipt, jump or stand',
        'check the clocks and use_sim_time',
    ),
    'POSITION_LEAP': (
        'the position of {subject} changes by {peak:.1f} {rate}, ten times faster than it can move',
        'check its unit (rad, not degrees), its name, and that nobody else publishes it',
    ),
    'IMU_FRAME': (
        'messages of {subject} come from another frame than the configuration names',
        'see that this is the IMU whose mounting is given; else mend topics.imu.frame_id',
    ),
    'IMU_ORIENTATION': (
        'the orientation of {subject} is no rotation, or level while its acceleration is not',
        'mend its driver; if it has no orientation, it should say so (covariance -1, REP-145)',
    ),
    'IMU_GRAVITY': (
        'at rest the acceleration differs from gravity by {peak:.0%}',
        'check its unit (m/s2, not g) and that gravity is not removed from it',
    ),
    'IMU_INCONSISTENT': (
        'orientation and acceleration of the IMU disagree by {degrees:.1f} degrees at rest',
        'check the IMU: its orientation may be a default, or its axes exchanged',
    ),
    'PAYLOAD_INVALID': (
        'a declared payload cannot be used',
        'give a mass in kg that is not negative, in the frame of the payload link',
    ),
    'LIMITS_RELAXED': (
        '{relaxed}',
        'keep people away; set it back into its range as soon as the reason is gone',
    ),
}


def describe(alert: Alert, settings: Settings) -> str:
    """Return one sentence that says what happened in an alert."""
    rule = alert.rule
    peak, limit = alert.peak, rule.on
    robot = settings.robot
    known = rule.subject in robot.joint_names
    units = robot.joint(rule.subject).units if known else TURNING
    if rule.code == 'TORQUE_LIMIT':
        limit = _torque(rule.subject, settings)
    if rule.code == 'TIP_OVER':
        peak, limit = math.degrees(-peak), math.degrees(-rule.on)
    return WORDS[rule.code][0].format(
        subject=rule.subject,
        peak=peak,
        limit=limit,
        unit=units.effort,
        rate=units.rate,
        tilt=tilt_left(peak),
        degrees=math.degrees(alert.peak),
        slope=max(math.degrees(-alert.peak), 0.0),
        seconds=-rule.on,
        torque=_torque(rule.subject, settings),
        kind='warning limit' if rule.level == WARN else 'limit',
        relaxed=_relaxed(rule.subject, settings) if rule.code == 'LIMITS_RELAXED' else '',
    )


def _relaxed(name: str, settings: Settings) -> str:
    """Return how far the limit of this name is relaxed now, and the reason given for it."""
    found = next((b for b in relaxed(settings) if b.name == name), None)
    if found is None:
        return f'{name} was wider than permitted'
    return f'{found.words}; reason: {settings.unsafe}'


def _torque(subject: str, settings: Settings) -> float:
    """Return the limit (N m; N) of a joint; infinite for a subject that is not a joint."""
    names = settings.robot.joint_names
    return settings.limits.torque[names.index(subject)] if subject in names else math.inf


def tilt_left(degrees: float) -> str:
    """Return in words how much tilt is left, or how far the robot is past its tipping point."""
    if degrees >= 0.0:
        return f'{degrees:.1f} degrees of tilt left before it tips'
    return f'{-degrees:.1f} degrees past its tipping point'


def advice(code: str) -> str:
    """Return what to do in general about an alert of this code."""
    return WORDS[code][1]
