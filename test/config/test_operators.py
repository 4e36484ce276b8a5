"""The key `operators` of a robot's configuration: the nodes that may command its monitor."""

from pathlib import Path

import pytest
from config.robot_files import YAML, write_robot

from ugv_acceptance import BadConfig
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.permitted_limits import limits_hash


def test_without_the_key_anybody_may(tmp_path: Path) -> None:
    """As the files of robots that know nothing of it say."""
    assert load(write_robot(tmp_path, YAML)).operators is None


def test_names_are_kept_as_written(tmp_path: Path) -> None:
    """Full names, and names in the namespace that the monitor will have."""
    names = '[/site/panel, acceptance_tell]'
    config = load(write_robot(tmp_path, f'{YAML}operators: {names}\n'))
    assert config.operators == ('/site/panel', 'acceptance_tell')


def test_it_is_part_of_the_file_and_no_limit(tmp_path: Path) -> None:
    """Another list is another configuration, by which the same is judged."""
    (tmp_path / 'one').mkdir()
    (tmp_path / 'two').mkdir()
    one = load(write_robot(tmp_path / 'one', f'{YAML}operators: [/panel]\n'))
    two = load(write_robot(tmp_path / 'two', f'{YAML}operators: [/other]\n'))
    assert one.sha256 != two.sha256
    assert limits_hash(one.settings) == limits_hash(two.settings)


@pytest.mark.parametrize('wrong', ['[]', 'null_', '/panel', '[3]', '[""]', '[/a, "b c"]', '[~/x]'])
def test_what_names_no_nodes_is_refused(tmp_path: Path, wrong: str) -> None:
    """An empty list too: it could be read as nobody or as anybody. One line names file and key."""
    with pytest.raises(BadConfig, match=r'yaml:\d+: operators: expected the n') as error:
        load(write_robot(tmp_path, f'{YAML}operators: {wrong}\n'))
    assert '\n' not in str(error.value)
