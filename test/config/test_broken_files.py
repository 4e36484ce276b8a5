"""Files that are no YAML, or no text: one sentence that tells what to mend, and the line."""

from pathlib import Path

import pytest
from config.robot_files import write_robot

from ugv_acceptance import AcceptanceError, BadConfig
from ugv_acceptance.config import load
from ugv_acceptance.config.criteria import load_criteria
from ugv_acceptance.config.document import read_document
from ugv_acceptance.config.identity import identity_from
from ugv_acceptance.drill.record import read_record
from ugv_acceptance.plan.plan import read_plan


@pytest.mark.parametrize(
    ('text', 'line', 'words'),
    [
        ('robot:\n\tname: x\n', 2, 'a tab: indent with spaces'),
        ('robot:\n  name: x\n urdf: y\n', 3, 'neither as those beside it nor below them'),
        ('robot: name: x\n', 1, 'a second ":" in one line'),
        ('robot: {name: x}\nurdf y\njoints: {}\n', 3, 'a line without ":"'),
        ('robot: {name: x\nurdf: y\n', 2, 'a bracket that is not closed'),
        ('robot:\n  name: "x\nurdf: y\n', 4, 'a quote or bracket that is not closed'),
    ],
)
def test_usual_mistakes_in_yaml_are_said_in_plain_words(text: str, line: int, words: str) -> None:
    """What the parser calls a block end or a token, nobody knows."""
    with pytest.raises(BadConfig) as caught:
        read_document(text, 'my.yaml')
    assert str(caught.value).startswith(f'my.yaml:{line}: expected YAML, got ')
    assert words in str(caught.value)


def test_another_encoding_is_told_with_its_line_by_every_file(tmp_path: Path) -> None:
    """Configuration, criteria, plan and identity."""
    settings = load(write_robot(tmp_path)).settings
    path = tmp_path / 'latin.yaml'
    path.write_bytes('robot:\n  name: Rüdiger\n'.encode('latin-1'))
    readers = (
        load,
        lambda one: load_criteria(one, settings),
        read_plan,
        lambda one: identity_from(str(one)),
    )
    for reader in readers:
        with pytest.raises(BadConfig, match=r'latin.yaml:2: expected UTF-8 text, got another enc'):
            reader(path)


def test_an_empty_plan_is_told_in_words_of_yaml(tmp_path: Path) -> None:
    """Not in those of the library that checks it."""
    path = tmp_path / 'plan.yaml'
    path.write_text('', 'utf-8')
    with pytest.raises(BadConfig, match=r'plan.yaml:1: expected keys with values, got nothing'):
        read_plan(path)


def test_a_link_to_nowhere_is_told_as_that(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its name is there, so that a person would look for the fault elsewhere."""
    monkeypatch.chdir(tmp_path)
    Path('robot.yaml').symlink_to('gone.yaml')
    with pytest.raises(BadConfig, match=r'got a link to gone.yaml, which is not there'):
        load('robot.yaml')


@pytest.mark.parametrize(('content', 'got'), [('', 'an empty file'), ('a: 1', 'no JSON')])
def test_a_record_of_a_drill_that_is_no_json(tmp_path: Path, content: str, got: str) -> None:
    """It says what makes such a record."""
    path = tmp_path / 'ada.json'
    path.write_text(content, 'utf-8')
    with pytest.raises(AcceptanceError, match=rf'from drill --out\), got {got}'):
        read_record(path)


@pytest.mark.parametrize(
    ('old', 'new', 'words'),
    [
        ('{name: two}', '{name: 5}', 'robot.name: expected a text, got 5'),
        ('{name: two}', "{name: ''}", 'robot.name: expected a text that is not empty, got ""'),
        (
            '{name: two}',
            '{name: two}\ntopics: {imu: {name: imu 1}}',
            'expected a topic such as /arm/',
        ),
    ],
)
def test_a_value_of_another_kind_is_told_without_words_of_a_library(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    """No pattern, no valid string: what is expected, and what came."""
    text = write_robot(tmp_path).read_text('utf-8')
    assert old in text
    (tmp_path / 'two.yaml').write_text(text.replace(old, new, 1), 'utf-8')
    with pytest.raises(BadConfig) as caught:
        load(tmp_path / 'two.yaml')
    assert words in str(caught.value)
