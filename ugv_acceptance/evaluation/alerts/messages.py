"""The sentences of alerts for people: what happened, what to do, and which part to suspect."""

import math

from ugv_acceptance.evaluation.alerts.alert_text import AlertText
from ugv_acceptance.evaluation.alerts.failure_source import FailureSource
from ugv_acceptance.evaluation.alerts.imu_alerts import IMU_ALERTS
from ugv_acceptance.evaluation.alerts.imu_words import found, seems, window
from ugv_acceptance.evaluation.alerts.level_words import (
    LEVELS_FOR_PEOPLE,
    level_words,
    pattern_words,
)
from ugv_acceptance.evaluation.alerts.robot_words import (
    height,
    moving,
    of_robot,
    relaxed_limit,
)
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, WARN, Alert, Rule
from ugv_acceptance.evaluation.margin_words import (
    degrees_words,
    excess_words,
    number_beside,
    rate_beside,
    rate_words,
    share_words,
    tipping_words,
)
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import TURNING, JointUnits, Robot

ALERTS = {
    'TORQUE_LIMIT': AlertText(
        '{subject} {share} of its limit{at}: it needs {need} of {limit:.1f} {unit}',
        'bring the load closer to the joint, or set it down',
        FailureSource.EFFECTOR,
        'The load on the joint named is near, or above, what its motor can hold.',
    ),
    'TIP_OVER': AlertText(
        '{tilt}{at}; {level} from {limit} on',
        'lower the arm over the tracks, face the slope; if the robot stands well, check the IMU',
        FailureSource.INTERACTION,
        'The robot is close to tipping over to the side named.',
    ),
    'TIP_TREND': AlertText(
        '{detail}',
        'stop, and drive back slowly; bring the arm low and to the high side',
        FailureSource.INTERACTION,
        'Not on flat ground: the tilt left shrinks fast, or is small when taken cautiously.',
    ),
    'TIP_MOVING': AlertText(
        '{moving}{at}',
        'stop smoothly; lower the arm over the tracks before you drive on',
        FailureSource.INTERACTION,
        'The robot turns over its edge so fast that it may not come to rest before it tips.',
    ),
    'ACCELERATION': AlertText(
        'braking, turning or a push is {excess} more than the robot stands before it lifts and'
        ' tips: {side}{at}',
        'brake and turn more gently; lower the arm over the tracks, bring the load closer',
        FailureSource.INTERACTION,
        'The robot is accelerated so hard that one side carries no weight.',
    ),
    'TRACK_LIFT': AlertText(
        'an end of the tracks lifts: a push turned the robot by {excess}: {side}{at}',
        'brake and turn more gently; lower the arm over the tracks, bring the load closer',
        FailureSource.INTERACTION,
        'Braking or turning lifts an end of the tracks off the ground.',
    ),
    'NO_SUPPORT': AlertText(
        'no support polygon: the contact points span no area on the ground, or carry no load',
        'stop; check that the robot stands on its tracks',
        FailureSource.INTERACTION,
        'The robot does not stand on its contact points: it is tipping or hanging.',
    ),
    'ARM_ON_GROUND': AlertText(
        'the arm stands on the ground, or so it seems: {height} the plane on which the robot'
        ' stands{at}, so no margin is valid',
        'lift the arm; if it is to touch the ground, say so (hand_may_touch); if it does not,'
        ' check the zeros of its joints and the contact points',
        FailureSource.INTERACTION,
        'The arm touches the ground, which then carries a part of the robot: no margin is valid.',
    ),
    'STATIC_MODEL': AlertText(
        '{subject} moves at {rate}{at}; margins are valid only up to {limit}',
        'move the joint more slowly',
        FailureSource.INTERACTION,
        'The joint moves too fast: the margins shown may be too large.',
    ),
    'SLIDE': AlertText(
        'the tracks will slide before the robot tips: {slope} of slope left{at}',
        'stop; drive straight up or down the slope to where it is less steep',
        FailureSource.INTERACTION,
        'The robot is about to slide down the slope, before it tips.',
    ),
    'TIP_AHEAD': AlertText(
        'it tips within {seconds:.1f} s if this motion continues: {side}',
        'stop the motion',
        FailureSource.INTERACTION,
        'At this rate the robot tips to the side named within a second.',
    ),
    'TORQUE_AHEAD': AlertText(
        '{subject} is at its limit within {seconds:.1f} s if this motion continues',
        'stop the motion',
        FailureSource.INTERACTION,
        'At this rate the joint named is at its limit within a second.',
    ),
    'EFFORT_LIMIT': AlertText(
        'the measured effort of {subject} is {share} of its limit{at}: '
        '{need} of {limit:.1f} {unit}',
        'move the joint more slowly, bring the load closer, or set it down',
        FailureSource.EFFECTOR,
        'The motor named is near its torque limit, by its own measurement.',
    ),
    'MOTOR_WEAK': AlertText(
        'the motor of {subject} saturates below its limit: its posture needs more than it delivers',
        'set the load down; check power supply, motor, and the torque limit in the configuration',
        FailureSource.EFFECTOR,
        'The motor named saturates below its limit and cannot hold its posture.',
    ),
    'ENCODER_FROZEN': AlertText(
        'the position of {subject} does not change while its effort does',
        'check its encoder; if that works, something blocks the joint or pulls on it',
        FailureSource.SENSOR,
        'The reported position of a joint does not change: check its encoder.',
    ),
    'INPUT_STALE': AlertText(
        'no message from {subject}',
        'check that its driver is running, its topic name and its quality of service (QoS)',
        FailureSource.COMMUNICATIONS,
        'Messages of a sensor have stopped: no margin is known.',
    ),
    'JOINTS_REPEATED': AlertText(
        '{subject} repeats one message: its stamp and all positions stand still for {peak:.1f} s',
        'check its driver: it sends old positions, or does not set its header stamp',
        FailureSource.SENSOR,
        'The same joint positions come again and again: no margin is known.',
    ),
    'INPUT_SLOW': AlertText(
        'the rate of {subject} is low: messages come up to {peak:.2f} s apart, margins are as old',
        'raise the rate of its driver to at least 10 Hz; check the network',
        FailureSource.COMMUNICATIONS,
        'Too few messages come: margins may be old when they are shown.',
    ),
    'INPUT_INCOMPLETE': AlertText(
        'at least one joint is missing from {subject}, or is no longer updated',
        'compare the joint names in the configuration with those on the topic',
        FailureSource.SENSOR,
        'A joint is missing from the messages: margins are not known, or in doubt.',
    ),
    'INPUT_INVALID': AlertText(
        '{subject} contains values that cannot be used',
        'check for NaN, degrees instead of radians, raw encoder counts, an invalid quaternion',
        FailureSource.SENSOR,
        'A sensor sends numbers that cannot be true.',
    ),
    'CLOCK': AlertText(
        'header stamps of {subject} are over 1 s off the time of receipt, jump, or stand still',
        'synchronise the clocks; check use_sim_time',
        FailureSource.CONTROL_SYSTEM,
        'Clocks disagree: times of messages cannot be trusted.',
    ),
    'POSITION_LEAP': AlertText(
        'implausible jump of {subject}: {rate}{at}, over ten times the speed it can move at',
        'check its unit (rad, not degrees), its name, and that only one node publishes it',
        FailureSource.SENSOR,
        'A joint position jumps: wrong unit, or two sources publish it.',
    ),
    **IMU_ALERTS,
    'PAYLOAD_INVALID': AlertText(
        'the declared payload cannot be used: {detail}',
        'declare a mass of 0 kg or more, in the frame of the payload link',
        FailureSource.INTERACTION,
        'The load that was declared cannot be used: no margin is known until a good one comes.',
    ),
    'LIMITS_RELAXED': AlertText(
        '{relaxed}',
        'keep people away; restore the permitted limit as soon as the reason is gone',
        FailureSource.INTERACTION,
        'Somebody set the limit named outside its safe range, and gave a reason.',
    ),
    # What only a live node sees; {detail} says who or why.
    'SECOND_PUBLISHER': AlertText(
        '{subject} has {peak:.0f} publishers: {detail}',
        "stop all but the robot's own driver: data of two sources are mixed",
        FailureSource.CONTROL_SYSTEM,
        level=WARN,
    ),
    'FOREIGN_PUBLISHER': AlertText(
        '{subject} is published by {detail}, which allowed_publishers does not name',
        'stop that node, or add it to allowed_publishers',
        FailureSource.CONTROL_SYSTEM,
        level=WARN,
    ),
    'CONFIG_DIFFERS': AlertText(
        'the robot is not the configured one, by its own description: {detail}',
        "configure the robot's own URDF, or none, and activate the monitor again",
        FailureSource.DESIGN,
        level=WARN,
    ),
    'INPUT_MALFORMED': AlertText(
        '{subject}: {peak:.0f} messages could not be decoded; the last: {detail}',
        'check the type and the version of the node that publishes it',
        FailureSource.COMMUNICATIONS,
        level=ERROR,
    ),
    'INPUT_QOS': AlertText(
        'a publisher of {subject} offers a quality of service that does not match: {detail}',
        'set the reliability and durability of the topic in the configuration to what is offered',
        FailureSource.DESIGN,
        level=ERROR,
    ),
    'MESSAGES_LOST': AlertText(
        '{peak:.0f} messages of {subject} were lost before the monitor could take them',
        'raise the parameter depth, or reduce the processor load',
        FailureSource.COMMUNICATIONS,
        level=WARN,
    ),
    'EFFORT_SIGN': AlertText(
        'the effort of {subject} has the opposite sign of what its load requires',
        'set effort_sign of this joint in the configuration, if nothing supports the arm',
        FailureSource.DESIGN,
        level=WARN,
    ),
    'NO_CLOCK': AlertText(
        'use_sim_time is true, but no message arrives on /clock',
        'start the simulation, or set use_sim_time to false',
        FailureSource.CONTROL_SYSTEM,
        level=WARN,
    ),
    'PAYLOAD_DIFFERS': AlertText(
        '{detail}',
        'declare the payload that is carried; if it is right, check what the arm touches',
        FailureSource.INTERACTION,
        level=WARN,
    ),
    'MARGIN_UNCERTAIN': AlertText(
        '{detail}',
        'treat this margin as used up: bring the load closer, lower the arm, face the slope',
        FailureSource.INTERACTION,
        level=WARN,
    ),
    'MONITOR_FAULT': AlertText(
        'the monitor could not evaluate a message of {subject}: {detail}',
        'internal error of the program: report it with the log of the node',
        FailureSource.CONTROL_SYSTEM,
        level=ERROR,
    ),
}
# The faults only a live node sees, with their levels; the other alerts a recording shows as well.
LIVE = {code: text.level for code, text in ALERTS.items() if text.level is not None}
RECORDED = tuple(code for code in ALERTS if code not in LIVE)
# The alerts whose sentence has a worst value, so that its own time is worth telling.
HAVE_WORST = frozenset(code for code, text in ALERTS.items() if '{at}' in text.happened)


def describe(alert: Alert, settings: Settings, start: int | None = None) -> str:
    """Return one sentence that says what happened in an alert.

    With the `start` (ns) of a recording the worst value stands beside its own time.
    """
    rule, robot = alert.rule, settings.robot
    text = of_robot(ALERTS[rule.code].happened, robot)
    if alert.detail and '{detail}' not in text:
        text += ': {detail}'
    known = rule.subject in robot.joint_names
    units = robot.joint(rule.subject).units if known else TURNING
    return text.format(
        subject=rule.subject,
        side=rule.subject.upper(),
        peak=alert.peak,
        unit=units.effort,
        at=_worst_time(alert, start),
        level=level_words(rule.level),
        seconds=-rule.on,
        window=window(alert),
        found=found(alert),
        seems=seems(alert),
        relaxed=relaxed_limit(rule.subject, settings) if rule.code == 'LIMITS_RELAXED' else '',
        detail=alert.detail,
        **_numbers(alert, units, settings),
    )


def _worst_time(alert: Alert, start: int | None) -> str:
    """Return when the worst value came in a recording that began at `start` (ns); '': unknown."""
    if start is None or alert.worst_at is None:
        return ''
    return f' at {(alert.worst_at - start) / 1e9:.2f} s'


def _numbers(alert: Alert, units: JointUnits, settings: Settings) -> dict[str, float | str]:
    """Return the worst value of an alert and its limit in the words that fit its kind."""
    rule, peak = alert.rule, alert.peak
    torque = _torque(rule.subject, settings)
    return {
        'limit': _limit(rule, units, torque),
        'share': share_words(peak / torque) if torque > 0.0 else share_words(math.nan),
        'need': number_beside(peak, torque),
        'rate': rate_beside(peak, rule.on, units.rate),
        'tilt': tipping_words(rule.subject, -peak),
        'moving': moving(rule.subject, -peak),
        'height': height(-peak),
        'excess': excess_words(peak),
        'slope': degrees_words(max(-peak, 0.0)),
        'off': share_words(peak),
    }


def _limit(rule: Rule, units: JointUnits, torque: float) -> float | str:
    """Return the limit that an alert is about: a torque as a number, others in words."""
    if rule.code == 'TIP_OVER':
        return degrees_words(-rule.on)
    return rate_words(rule.on, units.rate) if rule.code == 'STATIC_MODEL' else torque


def _torque(subject: str, settings: Settings) -> float:
    """Return the limit (N m; N) of a joint; infinite for a subject that is not a joint."""
    names = settings.robot.joint_names
    return settings.limits.torque[names.index(subject)] if subject in names else math.inf


def advice(code: str, robot: Robot | None = None) -> str:
    """Return what to do about an alert, of `robot` or of a tracked one with an arm."""
    return of_robot(ALERTS[code].to_do, robot) if robot else ALERTS[code].to_do


def suspect_of(code: str) -> str:
    """Return where to look first for the failure behind an alert, such as "physical / sensor"."""
    return ALERTS[code].suspect.path


__all__ = [
    'ALERTS',
    'HAVE_WORST',
    'LEVELS_FOR_PEOPLE',
    'LIVE',
    'RECORDED',
    'advice',
    'describe',
    'level_words',
    'pattern_words',
    'suspect_of',
]
