"""Values of options that cannot be: one line with the option, what was expected and what came."""

from pathlib import Path

import pytest
from cli.here import ugv
from configure.init_robots import rover


@pytest.mark.parametrize(
    ('words', 'line'),
    [
        (('risk', '--seed', 'x'), 'risk: --seed: expected a whole number, got x;'),
        (('risk', '--samples', '5'), '--samples: expected greater than or equal to 100, got 5;'),
        (('replay', 'run', '--rate', 'x'), 'replay: --rate: expected a number, got x;'),
        (('model', '--tilt', 'roll=400deg'), '--tilt roll=400deg: expected at most 180 deg'),
        (('model', '--tilt', 'roll=1deg,roll=2deg'), '--tilt: expected each name once, got roll'),
    ],
)
def test_a_wrong_value_is_one_line(words: tuple[str, ...], line: str) -> None:
    """Exit code 2, nothing on standard output, no words of the library that parses."""
    done = ugv(*words)
    assert (done.returncode, done.stdout) == (2, '')
    assert line in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize('words', [('evaluate', ''), ('model', '-c', ''), ('map', 'x', '--out=')])
def test_an_empty_path_is_not_the_current_folder(words: tuple[str, ...]) -> None:
    """As an unset variable of a shell leaves it: another recording would be judged than meant."""
    done = ugv(*words)
    assert (done.returncode, done.stdout) == (2, '')
    assert f'{words[0]}: expected a path, got ""' in done.stderr


def test_an_answer_that_nobody_asked_for_has_to_be_one(tmp_path: Path) -> None:
    """A misspelt --tilt is refused, also where no tilt is in doubt."""
    (tmp_path / 'my.urdf').write_text(rover(), 'utf-8')
    out = tmp_path / 'robot.yaml'
    done = ugv('init', tmp_path / 'my.urdf', '-o', out, '--tilt', 'maybe')
    assert done.returncode == 2
    assert '--tilt: expected real or not-real, got maybe' in done.stderr
    assert not out.exists()
