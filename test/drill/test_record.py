"""The record of a drill: what it says, that it can be read again, and that an edit is noticed."""

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from drill.drills import ALL, ONE_FAILED, drill, outcome

from ugv_acceptance import AcceptanceError, __version__
from ugv_acceptance.bag.atomic_files import write_json
from ugv_acceptance.drill.record import (
    SITUATIONS,
    is_edited,
    read_record,
    record_json,
    record_lines,
)

NAN = float('nan')
KINDS = {
    'passed': drill(*ALL),
    'to repeat': drill(*ONE_FAILED),
    'incomplete': drill(ALL[0]),
}


@pytest.mark.parametrize('word', KINDS)
def test_a_record_has_the_layout_of_its_schema(word: str, repository: Path) -> None:
    """What a drill leaves, whatever came of it, validates against schema/drill.schema.json."""
    schema = json.loads((repository / 'schema' / 'drill.schema.json').read_text('utf-8'))
    record = record_json(KINDS[word])
    jsonschema.validate(record, schema)
    assert record['outcome'] == word
    assert schema['properties']['situations']['items']['properties']['situation']['enum'] == [
        *SITUATIONS
    ]


def test_a_drill_without_any_situation_is_no_pass() -> None:
    """Who did nothing passed nothing."""
    record = record_json(drill())
    assert (record['outcome'], record['not_done']) == ('incomplete', [*SITUATIONS])


@pytest.mark.parametrize('word', KINDS)
def test_a_record_is_read_as_it_was_written(word: str, tmp_path: Path) -> None:
    """A record read from its file is the same, and not taken for an edited one."""
    record = record_json(KINDS[word])
    write_json(tmp_path / 'record.json', record)
    found = read_record(tmp_path / 'record.json')
    assert found == record
    assert not is_edited(found)


@pytest.mark.parametrize('name', ['', '  ', 'Ada\nBob', '\x1b[31mAda', '\ud800'])
def test_no_name_makes_a_record_that_cannot_be_read(name: str, tmp_path: Path) -> None:
    """Whatever somebody enters as the operator, the record is read again, and prints no escape."""
    write_json(tmp_path / 'record.json', record_json(drill(*ALL, operator=name)))
    record = read_record(tmp_path / 'record.json')
    assert not is_edited(record)
    assert all(line.isprintable() for line in record_lines(record))


def test_a_record_laid_out_anew_is_no_edited_one(tmp_path: Path) -> None:
    """Other spaces, another order, or `24` for `24.0`, as other tools write, change nothing."""
    record = record_json(KINDS['passed'])
    turned = dict(reversed(record.items())) | {'minutes': 24}
    (tmp_path / 'record.json').write_text(json.dumps(turned), 'utf-8')
    assert not is_edited(read_record(tmp_path / 'record.json'))


def values(part: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the path of every single value in a record."""
    if isinstance(part, dict):
        return [at for key, value in part.items() for at in values(value, (*path, key))]
    if isinstance(part, list) and part:
        return [at for key, value in enumerate(part) for at in values(value, (*path, key))]
    return [path]


def changed(record: Any, path: tuple[Any, ...], value: Any) -> Any:
    """Return a copy of a record with one value replaced."""
    copy = json.loads(json.dumps(record))
    *way, last = path
    place = copy
    for key in way:
        place = place[key]
    place[last] = value
    return copy


def other(value: Any) -> Any:
    """Return another value of the same kind."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int | float):
        return value + 1
    return f'{value}x' if isinstance(value, str) else ['slope']


def test_no_value_of_a_record_can_be_changed_unnoticed(tmp_path: Path) -> None:
    """Whatever one value is changed to: the record is refused, or said to be edited."""
    record, path = record_json(KINDS['to repeat']), tmp_path / 'record.json'
    places = values(record)
    assert len(places) > 10 * len(SITUATIONS)
    for at in places:
        value = record
        for key in at:
            value = value[key]
        write_json(path, changed(record, at, other(value)))
        try:
            found = read_record(path)
        except AcceptanceError:
            continue
        assert is_edited(found), at
        assert record_lines(found)[0].startswith('[X] EDITED'), at


BAD: dict[str, tuple[tuple[Any, ...], Any, str]] = {
    'another file': (('kind',), 'plan', "kind: expected 'ugv_acceptance drill', got 'plan'"),
    'later layout': (('version',), 2, 'version: expected 1, got 2'),
    'nobody': (('operator',), ' ', "operator: expected a name, got ' '"),
    'an escape': (('operator',), 'Ada\x1b[31m', "operator: expected a name, got 'Ada\\x1b[31m'"),
    'no time': (('started',), 'May', 'started: expected a time such as 2026-05-04T09:30:00Z, got'),
    'no number': (('minutes',), '24', "minutes: expected minutes from 0 on, got '24'"),
    'not finite': (('minutes',), NAN, 'minutes: expected minutes from 0 on, got nan'),
    'endless': (('minutes',), 10**400, 'minutes: expected minutes from 0 on, got 1000'),
    'no robot': (('robot',), 'packbot', "robot: expected a robot: name and sha256, got 'packbot'"),
    'no hash': (('robot', 'sha256'), 'abc', 'robot.sha256: expected 64 hexadecimal digits, got'),
    'no list': (('situations',), {}, 'situations: expected a list, got {}'),
    'no situation': (('situations', 1), None, 'situations[1]: expected a situation, got None'),
    'unknown': (('situations', 1, 'situation'), 'x', 'situations[1].situation: expected one of sl'),
    'says yes': (('situations', 1, 'passed'), 'yes', 'situations[1].passed: expected true or fals'),
    'early': (('situations', 0, 'answers', 0, 'after_s'), -1, 'situations[0].answers: expected a'),
    'claims': (('outcome',), 'passed', "outcome: expected 'to repeat', as the situations say, got"),
    'more': (('trained',), True, 'trained: expected no such field (known: kind, version, operator'),
}


@pytest.mark.parametrize('name', BAD)
def test_what_is_no_record_is_refused_with_its_field(name: str, tmp_path: Path) -> None:
    """The error is one line: file, field, what was expected and what came."""
    path, (at, value, text) = tmp_path / 'record.json', BAD[name]
    record = changed(record_json(KINDS['to repeat']), at, value)
    path.write_text(json.dumps(record), 'utf-8')
    with pytest.raises(AcceptanceError) as error:
        read_record(path)
    assert str(error.value).startswith(f'{path}: {text}')
    assert '\n' not in str(error.value)
    assert str(error.value).isprintable()


def test_a_missing_field_is_named(tmp_path: Path) -> None:
    """Whichever field of the record is missing, the error names it."""
    record, path = record_json(KINDS['passed']), tmp_path / 'record.json'
    for name in record:
        left = {key: value for key, value in record.items() if key != name}
        path.write_text(json.dumps(left), 'utf-8')
        with pytest.raises(AcceptanceError, match=f'{name}: expected'):
            read_record(path)


@pytest.mark.parametrize('content', ['', '[' * 5000, 'null', '[]', '"x"', '\xff', '9' * 5000])
def test_a_file_of_something_else_is_refused(content: str, tmp_path: Path) -> None:
    """A file that is no JSON object, or none of ours, is refused, never taken for a record."""
    (tmp_path / 'x').write_text(content, 'latin-1')
    with pytest.raises(AcceptanceError, match=r'expected the record of a drill|kind: expected'):
        read_record(tmp_path / 'x')


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    """The error says which file, and that it is none."""
    with pytest.raises(AcceptanceError, match=r'nowhere\.json: expected the record of a drill: No'):
        read_record(tmp_path / 'nowhere.json')


def test_the_lines_say_what_is_to_be_repeated_and_why() -> None:
    """First how it ended, then each situation with the times of the answers, then the robot."""
    lines = record_lines(record_json(drill(outcome('slope', passed=False), *ALL[1:3])))
    assert lines[0] == (
        '[X] TO REPEAT  Ada, 2025-05-04 09:30 UTC: 2 of 7 situations passed, 24 min'
    )
    assert lines[1:6] == [
        '  to repeat  slope        stop after 3.2 s, lower after 5.0 s',
        '    it tipped to the right',
        '    lower the arm before you drive on',
        '  passed     load         stop after 3.2 s, lower after 5.0 s',
        '  passed     sensor       stop after 3.2 s, lower after 5.0 s',
    ]
    assert lines[6:-1] == [f'  not done   {name}' for name in SITUATIONS[3:]]
    assert lines[-1].startswith('robot packbot (configuration ')
    assert lines[-1].endswith(f'seed 3, ugv_acceptance {__version__}')
    assert all(len(line) <= 80 for line in lines)


def test_the_last_try_of_a_situation_counts() -> None:
    """Who repeats a situation and passes it has passed it; the number of tries stays visible."""
    record = record_json(drill(outcome('slope', passed=False), *ALL))
    assert record['outcome'] == 'passed'
    assert record_lines(record)[1].endswith(', try 2')
    turned = record_json(drill(*ALL, outcome('slope', passed=False)))
    assert turned['to_repeat'] == ['slope']
