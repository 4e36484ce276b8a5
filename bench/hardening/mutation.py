"""Mutation testing: one small change of the code at a time, and whether the tests notice it.

`python -m bench.hardening.mutation --budget 600 [FILE ...]` prints each survivor. A sample, drawn
with a seed: all mutants of a file take hours.
"""

import argparse
import ast
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path
from random import Random
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
# File -> the tests that are about it.
TESTS = {
    'model/statics.py': ['model/test_statics.py', 'model/test_against_pinocchio.py'],
    'model/support.py': ['model/test_support.py'],
    'model/hull.py': ['model/test_support.py', 'model/test_stability.py'],
    'model/stability.py': ['model/test_stability.py', 'studies/test_planar.py'],
    'evaluation/alerts.py': ['evaluation/test_alerts.py', 'evaluation/test_chatter.py'],
    'evaluation/freshness.py': ['evaluation/test_freshness.py'],
}
_COMPARE: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn,
}  # fmt: skip
_BINARY: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
    ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.FloorDiv: ast.Mult,
}  # fmt: skip


def places(source: str) -> list[int]:
    """Return the numbers of the nodes, in ast.walk's order, that can be changed."""
    nodes = enumerate(ast.walk(ast.parse(source)))
    return [k for k, node in nodes if isinstance(node, ast.expr) and _change(node)]


def mutant(source: str, place: int) -> tuple[str, str]:
    """Return what was changed at a place, and the changed source."""
    tree = ast.parse(source)
    node: Any = list(ast.walk(tree))[place]
    before = ast.unparse(node)
    _change(node)
    return f'{node.lineno}: {before} -> {ast.unparse(node)}', ast.unparse(tree)


def _change(node: ast.expr) -> bool:
    """Change a node in place; return whether there was a change to make."""
    if isinstance(node, ast.Compare) and type(node.ops[0]) in _COMPARE:
        node.ops[0] = _COMPARE[type(node.ops[0])]()
    elif isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        node.op = _BINARY[type(node.op)]()
    elif isinstance(node, ast.BoolOp):
        node.op = ast.Or() if isinstance(node.op, ast.And) else ast.And()
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        node.op = ast.UAdd()
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        node.value = not node.value
    elif isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        node.value += 1
    elif isinstance(node, ast.IfExp):
        node.body, node.orelse = node.orelse, node.body
    else:
        return False
    return True


def killed(copy: Path, name: str, source: str) -> bool:
    """Return whether the tests of a file fail with this source in its place."""
    path = copy / 'ugv_acceptance' / name
    whole = path.read_text(encoding='utf-8')
    path.write_text(source, encoding='utf-8')
    command = [sys.executable, '-m', 'pytest', '-x', '-q', '-p', 'no:cacheprovider']
    command += [str(Path('test', test)) for test in TESTS[name]]
    env = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    try:
        done = subprocess.run(
            command, cwd=copy, capture_output=True, check=False, timeout=120, env=env
        )
    except subprocess.TimeoutExpired:  # a loop without end is noticed
        return True
    finally:
        path.write_text(whole, encoding='utf-8')
    return done.returncode != 0


def try_some(names: Iterable[str], budget: float, seed: int) -> dict[str, tuple[int, int]]:
    """Try mutants of each file in turn until `budget` (s) is used; return (killed, tried)."""
    rng, found = Random(seed), dict.fromkeys(names, (0, 0))
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        for part in ('ugv_acceptance', 'test', 'msg_configs', 'urdf', 'bags'):
            shutil.copytree(ROOT / part, copy / part)
        shutil.copy(ROOT / 'pyproject.toml', copy)
        waiting, sources = dict[str, list[int]](), dict[str, str]()
        for name in found:
            source = (copy / 'ugv_acceptance' / name).read_text(encoding='utf-8')
            if killed(copy, name, source):
                raise SystemExit(f'{name}: its tests fail without a mutant')
            waiting[name] = places(source)
            rng.shuffle(waiting[name])
            sources[name] = source
        end = time.monotonic() + budget
        while any(waiting.values()) and time.monotonic() < end:
            for name in (name for name, rest in waiting.items() if rest):
                what, source = mutant(sources[name], waiting[name].pop())
                dead = killed(copy, name, source)
                found[name] = (found[name][0] + dead, found[name][1] + 1)
                if not dead:
                    print(f'survived: {name}:{what}', flush=True)
    return found


def main() -> None:
    """Print survivors and rates."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('files', nargs='*', default=list(TESTS))
    parser.add_argument('--budget', type=float, default=600.0, help='seconds')
    parser.add_argument('--seed', type=int, default=0)
    asked = parser.parse_args()
    for name, (dead, tried) in try_some(asked.files, asked.budget, asked.seed).items():
        print(f'{name}: {dead} of {tried} killed', flush=True)


if __name__ == '__main__':
    main()
