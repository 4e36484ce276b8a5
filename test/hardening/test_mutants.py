"""The mutator: what it changes, what it leaves, and that each mutant is another program."""

import ast
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]

SOURCE = '''
@dataclass(slots=True)
class A:
    x: int = 3

    def f(self, a: float) -> float:
        """Text with 1 < 2 in it."""
        return -a if a < 2000.0 and True else a * 2 + 1
'''


@pytest.fixture
def mutator(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return the module; benches are scripts, on no path of their own."""
    monkeypatch.syspath_prepend(str(ROOT))
    return import_module('bench.hardening.mutants')


def test_each_kind_of_change_is_made_once(mutator: Any) -> None:
    """Signs, comparisons, both constants, and, or, choices, operators; decorators and text stay."""
    found = [(m.function, m.change) for m in mutator.mutants('a.py', SOURCE)]
    whole = '-a if a < 2000.0 and True else a * 2 + 1'
    assert sorted(found) == sorted(
        [
            ('A', '3 -> 4'),
            ('A.f', f'{whole} -> a * 2 + 1 if a < 2000.0 and True else -a'),
            ('A.f', 'a < 2000.0 and True -> a < 2000.0 or True'),
            ('A.f', 'a < 2000.0 -> a <= 2000.0'),
            ('A.f', '2000.0 -> 4000.0'),
            ('A.f', 'True -> False'),
            ('A.f', '-a -> +a'),
            ('A.f', 'a * 2 + 1 -> a * 2 - 1'),
            ('A.f', 'a * 2 -> a / 2'),
            ('A.f', '2 -> 3'),
            ('A.f', '1 -> 2'),
        ]
    )


def test_every_mutant_is_another_program(mutator: Any) -> None:
    """It parses, and differs from the source and from all others."""
    texts = [mutator.mutated(SOURCE, m.place) for m in mutator.mutants('a.py', SOURCE)]
    assert len({ast.dump(ast.parse(text)) for text in [*texts, SOURCE]}) == len(texts) + 1


def test_what_is_left_out_is_still_there(mutator: Any) -> None:
    """A line of the list of equivalent mutants that fits no code any more has to go."""
    for file, function, change in mutator.EQUIVALENT:
        source = (ROOT / 'ugv_acceptance' / file).read_text('utf-8')
        made = [(m.function, m.change) for m in mutator.mutants(file, source)]
        assert (function, change) in made, f'{file} {function}: {change}'
