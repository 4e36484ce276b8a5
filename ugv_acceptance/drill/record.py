"""The record of a drill: written as JSON, read again, and said in lines.

Its layout is schema/drill.schema.json. The record carries a hash of its own content, so that a
record somebody changed is noticed. That is no signature: who can compute a hash can make one.
"""

import hashlib
import json
from collections.abc import Callable, Iterable
from datetime import datetime, timezone
from math import isfinite
from pathlib import Path
from typing import Any

from ugv_acceptance import AcceptanceError, __version__
from ugv_acceptance.drill.outcome import Drill, Outcome
from ugv_acceptance.offline.training import TrainingRecord
from ugv_acceptance.type_aliases import Json

KIND = 'ugv_acceptance drill'
RECORD_VERSION = 1
# The situations of a whole drill, in order.
SITUATIONS = ('slope', 'load', 'sensor', 'braking', 'false_alarm', 'fall', 'stairs')
# How a drill ended: every situation passed; one to do again; none failed, but not all were done.
PASSED, TO_REPEAT, INCOMPLETE = 'passed', 'to repeat', 'incomplete'
# Letters of a value that an error shows, and bytes of a file that may still be a record.
SHOWN = 60
LARGEST = 1 << 20
# No number of a drill is larger; NaN and infinity are not within either.
MOST = 1e9


def record_json(drill: Drill) -> Json:
    """Return the record of a drill, laid out as schema/drill.schema.json says.

    What is not finite (an unknown margin) becomes None. `sha256` is of all else in the record.
    """
    situations = [_situation(outcome) for outcome in drill.outcomes]
    record: Json = {
        'kind': KIND,
        'version': RECORD_VERSION,
        'operator': _one_line(drill.operator),
        'started': drill.started,
        'minutes': drill.minutes,
        'robot': {'name': drill.robot, 'sha256': drill.configuration_sha256},
        'software': __version__,
        'seed': drill.seed,
        'scripted': drill.scripted,
        'situations': situations,
        **_sums(situations),
    }
    return {**record, 'sha256': content_sha256(record)}


def _one_line(name: str) -> str:
    """Return a name as a line that can be printed and read again."""
    return ''.join(x if x.isprintable() else '?' for x in name).strip() or '?'


def _situation(outcome: Outcome) -> Json:
    return {
        'situation': outcome.situation,
        'title': outcome.title,
        'seed': outcome.seed,
        'passed': outcome.passed,
        'answers': [{'key': key, 'after_s': seconds} for key, seconds in outcome.answers],
        'happened': outcome.happened,
        'lesson': outcome.lesson,
        'least_deg': outcome.least_deg if isfinite(outcome.least_deg) else None,
    }


def _sums(situations: list[Json]) -> Json:
    """Return what follows from the situations: the last try of each counts."""
    last = {one['situation']: one['passed'] for one in situations}
    to_repeat = [name for name, passed in last.items() if not passed]
    not_done = [name for name in SITUATIONS if name not in last]
    outcome = TO_REPEAT if to_repeat else INCOMPLETE if not_done else PASSED
    return {'outcome': outcome, 'to_repeat': to_repeat, 'not_done': not_done}


def content_sha256(record: Json) -> str:
    """Return the hash of a record's content, whatever its order, spaces or `5` for `5.0`."""
    content = {key: value for key, value in record.items() if key != 'sha256'}
    text = json.dumps(_plain(content), sort_keys=True, separators=(',', ':'))
    return hashlib.sha256(text.encode()).hexdigest()


def _plain(value: Any) -> Any:  # noqa: ANN401 - JSON
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_plain(one) for one in value]
    return int(value) if isinstance(value, float) and value.is_integer() else value


def is_edited(record: Json) -> bool:
    """Return whether the content of a record is not what its drill wrote."""
    return bool(record['sha256'] != content_sha256(record))


def read_record(path: Path) -> Json:
    """Return a record that a drill wrote. AcceptanceError: file, field, what was expected, came.

    A record that was edited, yet is whole, is returned: ask `is_edited`.
    """
    return _read(path, _content(path))


def training_record(path: Path) -> TrainingRecord:
    """Return a record as `evaluate` takes it. AcceptanceError as `read_record`."""
    content = _content(path)
    record = _read(path, content)
    sha256 = hashlib.sha256(content).hexdigest()
    return TrainingRecord(path, sha256, record, time_of(record['started']), is_edited(record))


def _content(path: Path) -> bytes:
    try:
        with path.open('rb') as file:
            return file.read(LARGEST)
    except OSError as error:
        raise AcceptanceError(f'{path}: expected the record of a drill: {error.strerror}') from None


def _read(path: Path, content: bytes) -> Json:
    try:
        record = json.loads(content)
    except (ValueError, RecursionError):
        got = 'an empty file' if not content.strip() else 'no JSON'
        raise AcceptanceError(
            f'{path}: expected the record of a drill (JSON, from drill --out), got {got}'
        ) from None
    if not isinstance(record, dict) or record.get('kind') != KIND:
        raise AcceptanceError(f"{path}: kind: expected '{KIND}', got {_kind_of(record)}")
    if record.get('version') != RECORD_VERSION:
        got = _short(record.get('version'))
        raise AcceptanceError(f'{path}: version: expected {RECORD_VERSION}, got {got}')
    _check(path, '', record, FIELDS)
    _check(path, 'robot.', record['robot'], ROBOT)
    for number, one in enumerate(record['situations']):
        at = f'situations[{number}]'
        if not isinstance(one, dict):
            raise AcceptanceError(f'{path}: {at}: expected a situation, got {_short(one)}')
        _check(path, f'{at}.', one, SITUATION)
    for name, expected in _sums(record['situations']).items():
        if record[name] != expected:
            text = f'expected {expected!r}, as the situations say, got {_short(record[name])}'
            raise AcceptanceError(f'{path}: {name}: {text}')
    return record


def _kind_of(record: object) -> str:
    return _short(record.get('kind')) if isinstance(record, dict) else _short(record)


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= SHOWN else f'{text[:SHOWN]}...'


def _is_text(value: object) -> bool:
    return isinstance(value, str) and bool(value.strip()) and value.isprintable()


def _is_number(value: object) -> bool:
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    return -MOST <= value <= MOST


def _is_duration(value: object) -> bool:
    return isinstance(value, int | float) and _is_number(value) and value >= 0


def _is_integer(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_hash(value: object) -> bool:
    hexadecimal = '0123456789abcdef'
    return isinstance(value, str) and len(value) == 64 and set(value) <= set(hexadecimal)


def _is_time(value: object) -> bool:
    try:
        return isinstance(value, str) and bool(time_of(value))
    except (ValueError, OverflowError):
        return False


def _is_list(value: object) -> bool:
    return isinstance(value, list)


def _is_answers(value: object) -> bool:
    return isinstance(value, list) and all(
        isinstance(one, dict)
        and set(one) == {'key', 'after_s'}
        and _is_text(one['key'])
        and _is_duration(one['after_s'])
        for one in value
    )


# Field -> what is expected, in words, and whether a value is it.
Fields = dict[str, tuple[str, Callable[[object], bool]]]
FIELDS: Fields = {
    'kind': (f"'{KIND}'", _is_text),
    'version': (f'{RECORD_VERSION}', _is_integer),
    'operator': ('a name', _is_text),
    'started': ('a time such as 2026-05-04T09:30:00Z', _is_time),
    'minutes': ('minutes from 0 on', _is_duration),
    'robot': ('a robot: name and sha256', lambda value: isinstance(value, dict)),
    'software': ('the version of the software', _is_text),
    'seed': ('a whole number', _is_integer),
    'scripted': ('true or false', lambda value: isinstance(value, bool)),
    'situations': ('a list', _is_list),
    'outcome': (f'{PASSED}, {TO_REPEAT} or {INCOMPLETE}', _is_text),
    'to_repeat': ('a list', _is_list),
    'not_done': ('a list', _is_list),
    'sha256': ('64 hexadecimal digits', _is_hash),
}
ROBOT: Fields = {
    'name': ('the name of the robot', _is_text),
    'sha256': ('64 hexadecimal digits', _is_hash),
}
SITUATION: Fields = {
    'situation': (f'one of {", ".join(SITUATIONS)}', lambda value: value in SITUATIONS),
    'title': ('a line of text', _is_text),
    'seed': ('a whole number', _is_integer),
    'passed': ('true or false', lambda value: isinstance(value, bool)),
    'answers': ('a list of key and after_s (seconds from 0 on)', _is_answers),
    'happened': ('a line of text', _is_text),
    'lesson': ('a line of text', _is_text),
    'least_deg': ('degrees, or null', lambda value: value is None or _is_number(value)),
}


def _check(path: Path, at: str, told: Json, fields: Fields) -> None:
    """Raise AcceptanceError at the first field that is missing, unknown or none of its kind."""
    for name, (expected, fits) in fields.items():
        if name not in told:
            raise AcceptanceError(f'{path}: {at}{name}: expected {expected}, got nothing')
        if not fits(told[name]):
            text = f'expected {expected}, got {_short(told[name])}'
            raise AcceptanceError(f'{path}: {at}{name}: {text}')
    unknown = next((name for name in told if name not in fields), None)
    if unknown is not None:
        text = f'expected no such field (known: {", ".join(fields)})'
        raise AcceptanceError(f'{path}: {at}{_short(unknown)[1:-1]}: {text}')


def time_of(started: str) -> datetime:
    """Return a time from its ISO 8601 text, in UTC where it names no zone; else ValueError."""
    time = datetime.fromisoformat(started.removesuffix('Z') + '+00:00' * started.endswith('Z'))
    return time.astimezone(timezone.utc) if time.tzinfo else time.replace(tzinfo=timezone.utc)


def day_of(started: str) -> str:
    """Return a time of a record for people: 2026-05-04 09:30 UTC."""
    return f'{time_of(started):%Y-%m-%d %H:%M} UTC'


def record_lines(record: Json) -> list[str]:
    """Return a record as lines of text: how it ended, then each situation, then what it was of."""
    tries = by_situation(record['situations'])
    width = max(len(name) for name in [*tries, *record['not_done'], ''])
    lines = [headline(record)]
    for name, of in tries.items():
        word = PASSED if of[-1]['passed'] else TO_REPEAT
        again = f', try {len(of)}' if len(of) > 1 else ''
        lines.append(f'  {word:<9}  {name:<{width}}  {answered(of[-1])}{again}')
        if not of[-1]['passed']:
            lines += [f'    {of[-1]["happened"]}', f'    {of[-1]["lesson"]}']
    lines += [f'  {"not done":<9}  {name}' for name in record['not_done']]
    robot = record['robot']
    lines.append(
        f'robot {robot["name"]} (configuration {robot["sha256"][:12]}), seed {record["seed"]}, '
        f'ugv_acceptance {record["software"]}'
    )
    return lines


def headline(record: Json) -> str:
    """Return in one line how a drill ended, whose it was, and when. An edited one is not believed.

    Such as '[OK] PASSED  Ada, 2026-05-04 09:30 UTC: 7 of 7 situations passed, 24 min'.
    """
    whose = f'{record["operator"]}, {day_of(record["started"])}'
    if is_edited(record):
        return f'[X] EDITED  {whose}: this is not what the drill wrote, so it counts for nothing'
    tries = by_situation(record['situations'])
    passed = sum(of[-1]['passed'] for of in tries.values())
    mark = '[OK]' if record['outcome'] == PASSED and not record['scripted'] else '[X]'
    total = len(tries) + len(record['not_done'])
    return (
        f'{mark} {record["outcome"].upper()}  {whose}: {passed} of {total} situations passed, '
        f'{record["minutes"]:.0f} min{", by a script" * record["scripted"]}'
    )


def by_situation(situations: Iterable[Json]) -> dict[str, list[Json]]:
    """Return the tries of each situation, in the order in which they were made."""
    found: dict[str, list[Json]] = {}
    for one in situations:
        found.setdefault(one['situation'], []).append(one)
    return found


def answered(one: Json) -> str:
    """Return the answers of a try with their seconds, such as 'stop after 3.2 s'."""
    said = [f'{answer["key"]} after {answer["after_s"]:.1f} s' for answer in one['answers']]
    return ', '.join(said) or 'no answer'
