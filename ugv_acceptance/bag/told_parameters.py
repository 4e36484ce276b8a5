"""The monitor's parameters in force, as a recording tells them: a DiagnosticStatus, without ROS.

`ugv-acceptance record` writes one at its start and after each change, on the monitor's topic
`parameters_in_force`: every parameter with its value as JSON, and the hash of the limits.
"""

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass

from ugv_acceptance import BadSample
from ugv_acceptance.bag.encode_views import Diagnosis, diagnosis_cdr
from ugv_acceptance.bag.layout import Cursor
from ugv_acceptance.bag.recording import Recording
from ugv_acceptance.bag.told_robot import messages_of_few

TOPIC, TYPE = 'parameters_in_force', 'diagnostic_msgs/msg/DiagnosticStatus'
HASH = 'limits_hash'
# No monitor has so many parameters; no value is so long (bytes).
_MOST = 10_000


@dataclass(frozen=True, slots=True)
class ToldParameters:
    """The parameters of a monitor from `time_ns` (log time) on: its topic, values by name.

    `limits_hash` is that of everything its alerts are judged by; '' where it was not known.
    """

    time_ns: int
    topic: str
    values: Mapping[str, object]
    limits_hash: str = ''


def parameters_message(monitor: str, values: Mapping[str, object], limits_hash: str = '') -> bytes:
    """Return parameters as a serialised message; `monitor` is the full name of its node."""
    texts = {name: json.dumps(value, default=list) for name, value in values.items()}
    told = ({HASH: limits_hash} if limits_hash else {}) | texts
    name = f'{monitor.lstrip("/")}: parameters in force'
    return diagnosis_cdr(Diagnosis(0, name, '', '', told))


def parameters_of(time_ns: int, topic: str, data: bytes) -> ToldParameters:
    """Return the parameters in a message. Raises BadSample where it holds none."""
    cursor = Cursor(data, 'cdr')
    cursor.skip(1, 'level')
    for field in ('name', 'message', 'hardware_id'):
        cursor.text(field)
    number = cursor.count('values')
    if number > _MOST:
        raise BadSample(f'values: expected at most {_MOST} parameters, got {number}')
    texts = {}
    for k in range(number):
        key = cursor.text(f'values[{k}].key')
        texts[key] = cursor.text(f'values[{k}].value')
    limits_hash = texts.pop(HASH, '')
    return ToldParameters(time_ns, topic, {k: _value(v) for k, v in texts.items()}, limits_hash)


def _value(text: str) -> object:
    try:
        value: object = json.loads(text)
    except (ValueError, RecursionError):
        return text
    return value


def parameters_in(recording: Recording) -> tuple[ToldParameters, ...]:
    """Return the parameters that a recording tells, in order of time; unreadable ones left out."""
    topics = [
        name
        for name, topic in recording.topics.items()
        if topic.type == TYPE and topic.count and name.rpartition('/')[2] == TOPIC
    ]
    found = []
    for message in messages_of_few(recording.bag, topics):
        with suppress(BadSample):
            found.append(parameters_of(message.log_time, message.topic, message.data))
    return tuple(sorted(found, key=lambda told: told.time_ns))
