"""Who and what was tested: entered on the command line or in a file."""

from pathlib import Path

import pytest

from ugv_acceptance import BadConfig
from ugv_acceptance.config.identity import identity_from


def test_pairs_may_hold_commas() -> None:
    """A comma begins a new pair only where KEY= follows."""
    found = identity_from('operator=A. Smith, PhD,place=hall 3, bay 2,robot_serial=12')
    assert found == {'operator': 'A. Smith, PhD', 'place': 'hall 3, bay 2', 'robot_serial': '12'}


def test_a_file_holds_the_same(tmp_path: Path) -> None:
    """Numbers and dates become texts."""
    path = tmp_path / 'identity.yaml'
    path.write_text('operator: A. Smith\nrobot_serial: 1042\ndate: 2025-06-02\n', 'utf-8')
    assert identity_from(str(path)) == {
        'operator': 'A. Smith',
        'robot_serial': '1042',
        'date': '2025-06-02',
    }


def test_nothing_entered_is_nothing() -> None:
    """Without an identity every part of it is marked as missing."""
    assert identity_from(None) == {}


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('operater=x', 'operater: unknown key; did you mean operator?'),
        ('operator=x,operator=y', 'operator: given twice'),
        ('no_such_file.yaml', r'no_such_file\.yaml: expected KEY=VALUE'),
        ('x,operator=y', 'expected KEY=VALUE, got "x"'),
        (f'operator={"x" * 3000}', 'operator: expected a text up to 2000 letters'),
    ],
)
def test_a_wrong_identity_is_refused(text: str, words: str) -> None:
    """A wrong identity is refused with one line of what was expected."""
    with pytest.raises(BadConfig, match=words):
        identity_from(text)


def test_a_file_of_lists_is_refused(tmp_path: Path) -> None:
    """An identity file whose values are lists is refused."""
    path = tmp_path / 'identity.yaml'
    path.write_text('operator: [a, b]\n', 'utf-8')
    with pytest.raises(BadConfig, match='operator: expected a text'):
        identity_from(str(path))
