"""The operator's commands: acknowledge, shelve, unshelve, reset; each with a name and a note.

They come on `~/operator` as a DiagnosticStatus: `name` is the command, `hardware_id` who, `message`
the note, `values` the alert: code, subject, level, and for shelve seconds. Without an alert: all.
"""

from dataclasses import dataclass
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node

from ugv_acceptance import BadSample
from ugv_acceptance.bag.description import TYPE
from ugv_acceptance.bag.told_robot import description_message
from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.alerts.alarms import Change, Key, State
from ugv_acceptance.evaluation.alerts.state_machine import LEVELS
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.nodes.monitor.black_box import DESCRIPTION, BlackBox, Channel

# Says whether the arm may touch the ground; value: allowed, true or false.
HAND = 'hand_may_touch'
DOINGS = ('acknowledge', 'shelve', 'unshelve', 'reset')
# The name for acknowledgements by the service, which gives none.
SERVICE = 'service'
LONGEST_TEXT = 500
# Seconds of shelving where none are given.
SHELVED = 300.0


@dataclass(frozen=True, slots=True)
class Operation:
    """A command: what, by whom, on which alarm (None: all), a note, and for how long (s)."""

    do: str
    who: str
    key: Key | None = None
    note: str = ''
    seconds: float = SHELVED


def operation_from(message: DiagnosticStatus) -> Operation:
    """Return the command in a message. Raises BadSample saying what is wrong with it."""
    values = {pair.key: pair.value for pair in message.values}
    if message.name not in DOINGS:
        raise BadSample(f'name: expected one of {", ".join(DOINGS)}, got {message.name[:80]!r}')
    key = None
    if 'code' in values:
        level = values.get('level', '')
        if level not in LEVELS:
            raise BadSample(f'level: expected one of {", ".join(LEVELS)}, got {level[:80]!r}')
        key = (values['code'], values.get('subject', ''), LEVELS.index(level))
    try:
        seconds = float(values.get('seconds', SHELVED))
    except ValueError:
        raise BadSample(f'seconds: expected a number, got {values["seconds"][:80]!r}') from None
    if not 0.0 <= seconds <= 1e6:
        raise BadSample(f'seconds: expected a number from 0 on, got {seconds:g}')
    who, note = message.hardware_id[:LONGEST_TEXT], message.message[:LONGEST_TEXT]
    return Operation(message.name, who or 'unknown', key, note, seconds)


def hand_allowed(message: DiagnosticStatus) -> bool:
    """Return what a command HAND says. Raises BadSample unless `allowed` is true or false."""
    value = {pair.key: pair.value for pair in message.values}.get('allowed', '')
    if value not in ('true', 'false'):
        raise BadSample(f'{HAND}: expected allowed: true or false, got {value[:80]!r}')
    return bool(value == 'true')


def by_service(session: Session) -> list[Change]:
    """Acknowledge all alarms; a service of type Trigger does not say who called it."""
    return session.alarm_tracker.alarms.acknowledge(session.clock.now(), SERVICE)


def operate(session: Session, message: DiagnosticStatus) -> list[Change]:
    """Carry out the command in a message; return the changes. Raises AcceptanceError if refused."""
    alarms, now, o = session.alarm_tracker.alarms, session.clock.now(), operation_from(message)
    if o.do == 'acknowledge':
        return alarms.acknowledge(now, o.who, o.note, o.key)
    if o.do == 'reset':
        return alarms.reset(now, o.who, o.note, o.key)
    if o.key is None:
        raise BadSample(f'{o.do}: expected the code, subject and level of an alert')
    if o.do == 'shelve':
        return alarms.shelve(now, o.key, int(o.seconds * 1e9), o.who, o.note)
    return alarms.unshelve(now, o.key, o.who)


def all_reset(session: Session) -> list[Change]:
    """Return the changes to publish when an evaluation ends: every alarm reset."""
    now, table = session.clock.now(), session.alarm_tracker.alarms.table
    return [Change(now, alarm.alert, 'reset', State.NORMAL) for alarm in table.values()]


def black_box_of(node: Node, config: Config, session: Session) -> BlackBox:
    """Return a black box for the inputs of a session; without a folder it does nothing."""
    topics = config.topics
    channels = {
        name: Channel(
            node.resolve_topic_name(topic.name),
            topic.type,
            topic.reliability,
            lasting=name == 'payload',
        )
        for name, topic in topics.used.items()
    }
    alerts = node.resolve_topic_name('~/alerts')
    channels['alerts'] = Channel(alerts, 'diagnostic_msgs/msg/DiagnosticArray', 'reliable')
    own = node.resolve_topic_name(topics.robot_description)
    channels[DESCRIPTION] = Channel(own, TYPE, 'reliable', lasting=True, latched=True)
    folder = node.get_parameter('black_box').value
    path = Path(folder).expanduser() if folder else None
    robot = description_message(config.urdf_text)
    box = BlackBox(path, channels, session.clock.now, session.on_problem, robot=robot)
    session.take_joint_state = box.tap('joint_states', session.take_joint_state)
    session.take_imu = box.tap('imu', session.take_imu)
    session.take_payload = box.tap('payload', session.take_payload)
    return box
