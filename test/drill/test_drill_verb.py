"""The verb `drill`: what it prints, its record, its exit codes."""

import json
from pathlib import Path

import jsonschema
from cli.here import ugv

from ugv_acceptance.drill.record import read_record
from ugv_acceptance.drill.situations import SITUATIONS


def test_a_scripted_drill_prints_the_outcome_and_leaves_a_record(
    tmp_path: Path, repository: Path
) -> None:
    """Exit code 0 where all passed; the record is whole, and says whose drill it was."""
    script, out = tmp_path / 'answers.txt', tmp_path / 'ada.json'
    script.write_text('fall: follow-advice at 1 s\n', 'utf-8')
    told = '--only', 'fall', '--seed', 5, '--operator', 'Ada', '--out', out, '--script', script
    done = ugv('drill', *told)
    assert (done.returncode, done.stderr) == (0, '')
    assert '[OK] passed: After a fall (advice after 1.0 s)' in done.stdout
    assert done.stdout.endswith(f'1 passed, 0 to repeat\nWrote {out}\n')
    assert max(map(len, done.stdout.splitlines()[:-1])) < 80
    record = read_record(out)
    schema = json.loads((repository / 'schema/drill.schema.json').read_text('utf-8'))
    jsonschema.validate(record, schema)
    assert (record['operator'], record['seed'], record['outcome']) == ('Ada', 5, 'incomplete')
    assert record['scripted'] is True
    again = ugv('drill', *told)
    assert again.returncode == 2
    assert f'--out {out}: it exists' in again.stderr


def test_a_drill_with_something_to_repeat_ends_with_1(tmp_path: Path) -> None:
    """What is to be repeated is named in the last line."""
    script = tmp_path / 'answers.txt'
    script.write_text('all: push it up\n', 'utf-8')
    done = ugv('drill', '--only', 'fall', '--script', script)
    assert done.returncode == 1
    assert '[X] to repeat: After a fall (push after 2.0 s)' in done.stdout
    assert done.stdout.endswith('0 passed, 1 to repeat: fall\n')


def test_what_cannot_be_played_is_refused_in_one_line(tmp_path: Path) -> None:
    """No terminal, an answer that is not offered, no script: exit code 2, and the file is named."""
    script = tmp_path / 'answers.txt'
    script.write_text('fall: dance\n', 'utf-8')
    refused = {
        'expected a terminal; without one use --script FILE or --page': (),
        f'--script {script}: fall: expected one of: ': ('--script', script),
        f'--script {tmp_path}: expected a text file': ('--script', tmp_path),
    }
    for expected, arguments in refused.items():
        done = ugv('drill', '--only', 'fall', *arguments)
        assert done.returncode == 2
        assert expected in done.stderr
        assert done.stderr.count('\n') == 1


def test_the_situations_are_listed_in_the_order_in_which_they_are_played() -> None:
    """--list prints a line for each, with the name that --only takes."""
    lines = ugv('drill', '--list').stdout.splitlines()
    assert [line.split()[0] for line in lines] == list(SITUATIONS)
