"""What people read is plain English: turns of phrase that puzzled readers do not come back."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from ugv_acceptance.simulation.repertoire import KINDS
from ugv_acceptance.simulation.scenarios import SCENARIOS

REPOSITORY = Path(__file__).resolve().parents[1]
PACKAGE = REPOSITORY / 'ugv_acceptance'
# Words that were not understood -> a term that is.
RIDDLES = {
    r'\btells? (of|no)\b': 'contains, names, suggests',
    r'\b(breaks?|broken) off\b': 'is truncated, is interrupted',
    r'\bleapt\b': 'jumped',
    r'\bgives? (all|no more|nearly all)\b': 'saturates',
    r'\b(became|comes?|came) of (it|them)\b': 'the result',
    r'\bmoment that holds\b': 'restoring moment',
    r'\bgoes on like this\b': 'if this motion continues',
    r'\bin the hand\b': 'payload',
    r'\bis it so\b': 'check it',
    r'\bat a stretch\b': 'without a break',
    r'\bgarbled\b': 'damaged',
    r'\bodd(ity|ities)?\b': 'finding, looks wrong',
    r'\blikewise\b': 'say it again',
    r'\bbehind the (colon|option)\b': 'after',
}
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
SOURCES = sorted(PACKAGE.rglob('*.py'))
PAGES = sorted(
    path
    for pattern in ('**/templates/*.html', 'console/static/*.html', 'console/static/*.js')
    for path in PACKAGE.glob(pattern)
)


def is_shown(path: Path, node: ast.AST) -> bool:
    """Return whether people read a docstring: a verb's is its help, a scenario's is listed."""
    if not isinstance(node, ast.FunctionDef):
        return False
    is_scenario = path.parent.name == 'simulation' and node.name in {*SCENARIOS, *KINDS}
    return is_scenario or (path.parent.name == 'cli' and node.name == path.stem)


def texts_of(path: Path) -> Iterator[str]:
    """Yield what a file may say: no comments, no docstrings for programmers."""
    if path.suffix != '.py':
        yield re.sub(r'//.*', '', path.read_text(encoding='utf-8'))
        return
    tree = ast.parse(path.read_text(encoding='utf-8'))
    silent = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, DOCUMENTED) and isinstance(node.body[0], ast.Expr)
        if not is_shown(path, node)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            parts = (v.value if isinstance(v, ast.Constant) else '{}' for v in node.values)
            yield ''.join(map(str, parts))
        elif (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and id(node) not in silent
        ):
            yield node.value


def test_no_riddle_is_told() -> None:
    """Errors, alerts, findings, tables, pages and help use the terms of docs/glossary.md."""
    assert SOURCES
    assert PAGES
    found = [
        f'{path.relative_to(PACKAGE)}: {text[:90]!r}: say {better}'
        for path in [*SOURCES, *PAGES]
        for text in texts_of(path)
        for riddle, better in RIDDLES.items()
        if re.search(riddle, text)
    ]
    assert not found
