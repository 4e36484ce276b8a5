"""The operator's commands about alerts: acknowledge, shelve, unshelve, reset; with name and note.

They come on `~/operator` as a DiagnosticStatus: `name` is the command, `hardware_id` who, `message`
the note, `values` the alert: code, subject, level (without a subject or level: every one that
fits), and for shelve seconds. Without an alert: all. The desk (operator_desk.py) takes them there.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node

from ugv_acceptance import BadSample
from ugv_acceptance.bag.description import TYPE
from ugv_acceptance.bag.told_robot import description_message
from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.alerts.alarms import Alarm, Alarms, Change, State, key_of, latches
from ugv_acceptance.evaluation.alerts.messages import level_words
from ugv_acceptance.evaluation.alerts.state_machine import LEVELS, WARN, Rule
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.nodes.monitor.black_box import DESCRIPTION, BlackBox, Channel

DOINGS = ('acknowledge', 'shelve', 'unshelve', 'reset')
# The name for acknowledgements by the service, which gives none.
SERVICE = 'service'
LONGEST_TEXT = 500
# Seconds of shelving where none are given.
SHELVED = 300.0
# Alerts that a sentence names at most, and letters of a name that a client sent.
_NAMED, _LETTERS = 4, 80
# What is said where a command about all alerts finds none.
_NONE = {
    'acknowledge': 'nothing to acknowledge: every alert has been seen',
    'reset': 'nothing to reset: no alert is latched',
}


@dataclass(frozen=True, slots=True)
class Operation:
    """A command: what, by whom, on which alarms, a note, and for how long (s).

    `code` None: all alarms; `subject` '' and `level` None: every one with that code.
    """

    do: str
    who: str
    code: str | None = None
    subject: str = ''
    level: int | None = None
    note: str = ''
    seconds: float = SHELVED

    def fits(self, rule: Rule) -> bool:
        """Return whether it is about the alarm of a rule; a joint may go without its _joint."""
        subject = rule.subject.lower()
        return (
            self.code in (None, rule.code)
            and self.subject.lower() in ('', subject, subject.removesuffix('_joint'))
            and self.level in (None, rule.level)
        )


def operation_from(message: DiagnosticStatus) -> Operation:
    """Return the command in a message. Raises BadSample saying what is wrong with it."""
    values = {pair.key: pair.value for pair in message.values}
    if message.name not in DOINGS:
        raise BadSample(f'name: expected one of {", ".join(DOINGS)}, got {message.name[:80]!r}')
    level = values.get('level')
    if level is not None and level not in LEVELS:
        raise BadSample(f'level: expected one of {", ".join(LEVELS)}, got {level[:80]!r}')
    try:
        seconds = float(values.get('seconds', SHELVED))
    except ValueError:
        raise BadSample(f'seconds: expected a number, got {values["seconds"][:80]!r}') from None
    if not 0.0 <= seconds <= 1e6:
        raise BadSample(f'seconds: expected a number from 0 on, got {seconds:g}')
    who, note = message.hardware_id[:LONGEST_TEXT], message.message[:LONGEST_TEXT]
    return Operation(
        message.name,
        who or 'unknown',
        values.get('code'),
        values.get('subject', ''),
        None if level is None else LEVELS.index(level),
        note,
        seconds,
    )


def by_service(session: Session) -> list[Change]:
    """Acknowledge all alarms; a service of type Trigger does not say who called it."""
    return session.alarm_tracker.alarms.acknowledge(session.clock.now(), SERVICE)


def operate(session: Session, message: DiagnosticStatus) -> list[Change]:
    """Carry out the command in a message; return the changes. Raises AcceptanceError if refused.

    A command about a named alert that would change nothing is refused, with what its state is.
    """
    alarms, now, o = session.alarm_tracker.alarms, session.clock.now(), operation_from(message)
    if o.code is None:
        return _operate_all(alarms, now, o)
    chosen = [alarm for alarm in alarms.table.values() if o.fits(alarm.rule)]
    if not chosen:
        raise BadSample(f'{o.do}: {_unknown(alarms, o)}')
    changes = [change for alarm in chosen for change in _operate(alarms, now, o, alarm)]
    if o.do == 'shelve' and not changes:
        # Refused with the reason: only a warning can be shelved.
        return alarms.shelve(now, key_of(chosen[0].rule), int(o.seconds * 1e9), o.who, o.note)
    if not changes:
        raise BadSample(f'{o.do}: {_NEEDS[o.do]}: {_words(chosen)}')
    return changes


# What an alert must be for a command that changed nothing.
_NEEDS = {
    'acknowledge': 'nothing is left to acknowledge',
    'reset': 'only what is over and acknowledged can be reset',
    'unshelve': 'not shelved',
}


def _operate_all(alarms: Alarms, now: int, o: Operation) -> list[Change]:
    if o.do == 'acknowledge':
        return alarms.acknowledge(now, o.who, o.note)
    if o.do != 'reset':
        raise BadSample(f'{o.do}: expected the code of an alert, got none')
    changes = alarms.reset(now, o.who, o.note)
    over = [a for a in alarms.table.values() if a.state is State.RETURNED_UNACKNOWLEDGED]
    unseen = [alarm for alarm in over if latches(alarm.rule)]
    if unseen and not changes:
        raise BadSample(f'reset: acknowledge first: {_words(unseen)}')
    return changes


def _operate(alarms: Alarms, now: int, o: Operation, alarm: Alarm) -> list[Change]:
    key = key_of(alarm.rule)
    if o.do == 'acknowledge':
        return alarms.acknowledge(now, o.who, o.note, key)
    if o.do == 'reset':
        return alarms.reset(now, o.who, o.note, key)
    if o.do == 'unshelve':
        return alarms.unshelve(now, key, o.who)
    if alarm.rule.level != WARN:
        return []
    return alarms.shelve(now, key, int(o.seconds * 1e9), o.who, o.note)


def done_words(o: Operation, changes: Sequence[Change]) -> str:
    """Return in a sentence what a command changed: each alarm, and the state it is in now."""
    if not changes:
        return _NONE[o.do]
    first = sorted(changes, key=lambda change: -change.alert.rule.level)
    named = [f'{_alarm(c.alert.rule)}{_after(c)}' for c in first[:_NAMED]]
    more = [f'{len(changes) - _NAMED} more'] * (len(changes) > _NAMED)
    length = f' for {o.seconds / 60:g} min' if o.do == 'shelve' else ''
    return f'{changes[0].how}{length}: {"; ".join(named + more)}'


def _after(change: Change) -> str:
    gone = change.state is State.NORMAL or change.how == 'reset'
    return '' if gone else f', {change.state.value.removesuffix(", acknowledged")}'


def _alarm(rule: Rule) -> str:
    return f'{rule.code} {rule.subject} ({level_words(rule.level)})'


def _words(alarms: Sequence[Alarm]) -> str:
    named = [f'{_alarm(alarm.rule)} is {alarm.state.value}' for alarm in alarms[:_NAMED]]
    return '; '.join(named + [f'{len(alarms) - _NAMED} more'] * (len(alarms) > _NAMED))


def _unknown(alarms: Alarms, o: Operation) -> str:
    """Return that there is no such alert, and which there are."""
    name = f'{o.code} {o.subject}'.strip()[:_LETTERS]
    first = sorted(alarms.table.values(), key=lambda alarm: -alarm.rule.level)
    there = [_alarm(alarm.rule) for alarm in first if alarm.state is not State.NORMAL]
    listed = ', '.join(there[:_NAMED]) + (' ...' if len(there) > _NAMED else '')
    return f'no alert {name!r} is active or waits; there is {listed or "none"}'


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
