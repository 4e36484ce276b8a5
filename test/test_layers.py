"""The rules of the code's layers, executed: imports, purity, lengths, docstrings, types.

The table is that of docs/architecture.md. Imports inside functions count too.
"""

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / 'ugv_acceptance'
MODULES = sorted(PACKAGE.rglob('*.py'))

# What a layer may import of ours besides itself and the errors of ugv_acceptance/__init__.py.
BELOW_OFFLINE = {'model', 'studies', 'evaluation', 'config', 'bag', 'monitoring', 'report'}
BELOW_RUN = BELOW_OFFLINE | {'offline', 'simulation', 'plan', 'campaign', 'processes'}
BELOW_DRILL = BELOW_RUN | {'run', 'console'}
BELOW_NODES = BELOW_DRILL | {'configure', 'drill', 'inspection'}
MAY_IMPORT: dict[str, set[str]] = {
    # The front door: for types, and when a name is first used.
    '__init__': {'bag', 'config', 'model', 'monitoring', 'offline'},
    'type_aliases': set(),
    'processes': set(),
    'model': set(),
    'studies': {'model', 'processes'},
    'evaluation': {'model'},
    'config': {'model', 'evaluation'},
    'bag': {'model', 'evaluation'},
    'configure': {'model', 'evaluation', 'config', 'bag', 'report'},
    'monitoring': {'model', 'evaluation', 'config', 'bag'},
    'simulation': {'model', 'processes'},
    'report': {'model', 'studies', 'evaluation'},
    'offline': BELOW_OFFLINE,
    'inspection': BELOW_OFFLINE | {'offline'},
    'campaign': BELOW_OFFLINE | {'offline', 'processes'},
    'console': BELOW_OFFLINE | {'offline'},
    'plan': {'model', 'studies', 'evaluation', 'config', 'report'},
    'run': BELOW_RUN,
    'drill': BELOW_DRILL,
    'nodes': BELOW_NODES,
    'cli': BELOW_NODES | {'nodes'},
}
# Every start of the command loads every module of cli, so they import these inside a verb.
HEAVY = {
    'distributed',
    'foxglove',
    'rclpy',
    'mujoco',
    'matplotlib',
    'starlette',
    'textual',
    'uvicorn',
}

# The layers that may import a foreign library.
HOME_OF = {
    'rclpy': {'nodes'},
    'mujoco': {'simulation'},
    'pydantic': {'config', 'plan'},
    'yaml': {'config', 'bag', 'plan'},
    'defusedxml': {'config'},
    'mcap': {'bag', 'offline'},
    'rosbags': {'bag', 'offline'},
    'distributed': {'campaign'},
    'foxglove': {'nodes'},
    'collada': {'configure'},
    'fsspec': {'campaign'},
    'matplotlib': {'report'},
    'jinja2': {'report', 'plan'},
    'click': {'cli'},
    'rich': {'cli', 'console'},
    'typer': {'cli'},
    'starlette': {'console'},
    'textual': {'console'},
    'trimesh': {'configure'},
    'uvicorn': {'console'},
    'websockets': {'console'},
    'xacro': {'configure'},
}
# The pure part takes time, files and settings as arguments.
PURE = {'model', 'studies', 'evaluation'}
IMPURE_MODULES = {
    'time',
    'datetime',
    'logging',
    'os',
    'sys',
    'io',
    'pathlib',
    'random',
    'subprocess',
    'socket',
}
IMPURE_CALLS = {'open', 'print', 'input'}
# Functions that change nothing, whatever they are given.
PURE_CALLS = {'abs', 'float', 'int', 'len', 'max', 'min', 'sum'}

LONGEST_MODULE = 400
LONGEST_FUNCTION = 40
# 'module' or 'module:function' -> the reason why it is longer.
LONGER: dict[str, str] = {
    'evaluation/chassis/filters.py:step': 'each IMU message would pay for another call',
}


def layer_of(path: Path) -> str:
    """Return the layer a module stands in: its folder, or its own name on the top floor."""
    parts = path.relative_to(PACKAGE).with_suffix('').parts
    return parts[0]


def name_of(path: Path) -> str:
    """Return a short name for test ids and for LONGER."""
    return path.relative_to(PACKAGE).as_posix()


@cache
def source_of(path: Path) -> list[str]:
    """Return the lines of a module."""
    return path.read_text(encoding='utf-8').splitlines()


@cache
def parse(path: Path) -> ast.Module:
    """Return a module's syntax tree."""
    return ast.parse(path.read_text(encoding='utf-8'), filename=str(path))


@cache
def nodes(path: Path) -> list[ast.AST]:
    """Return every node of a module's syntax tree."""
    return list(ast.walk(parse(path)))


@cache
def imports(path: Path) -> list[tuple[str, int]]:
    """Return the full name and the line of everything imported anywhere in a module.

    `from a import b` gives a.b: b may be a module.
    """
    return list(_imports(path))


def _imports(path: Path) -> Iterator[tuple[str, int]]:
    package = ['ugv_acceptance', *path.relative_to(PACKAGE).parent.parts]
    for node in nodes(path):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, node.lineno
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            start = '.'.join([*base, *([node.module] if node.module else [])])
            for alias in node.names:
                yield f'{start}.{alias.name}', node.lineno


def our_layer(name: str) -> str | None:
    """Return the layer of ours that a full imported name belongs to; None for a foreign one."""
    parts = name.split('.')
    if parts[0] != 'ugv_acceptance':
        return None
    known = len(parts) > 1 and parts[1] in MAY_IMPORT
    return parts[1] if known else '__init__'


def homes(name: str) -> set[str]:
    """Return the layers that may import a foreign name: all, unless HOME_OF says otherwise."""
    library = name.split('.', maxsplit=1)[0]
    is_ros = library.endswith(('_msgs', '_srvs', '_interfaces'))
    return HOME_OF.get('rclpy' if is_ros else library, set(MAY_IMPORT))


def functions(path: Path) -> list[ast.FunctionDef | ast.AsyncFunctionDef]:
    """Return every function and method of a module, nested ones included."""
    return [n for n in nodes(path) if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef)]


def public_definitions(tree: ast.Module) -> Iterator[ast.ClassDef | ast.FunctionDef]:
    """Yield the classes and functions a user of the module sees, methods included."""
    bodies: list[list[ast.stmt]] = [tree.body]
    while bodies:
        for node in bodies.pop():
            if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith('_'):
                yield node
                if isinstance(node, ast.ClassDef):
                    bodies.append(node.body)


def code_lines(node: ast.FunctionDef | ast.AsyncFunctionDef, source: list[str]) -> int:
    """Return the lines of a function's body that hold code: no docstring, comment or blank line."""
    body = node.body[1:] if ast.get_docstring(node) is not None else node.body
    if not body:
        return 0
    lines = source[body[0].lineno - 1 : node.end_lineno]
    return sum(bool(line.strip()) and not line.strip().startswith('#') for line in lines)


# A rule is one test of all modules, as each test costs time; it lists what breaks the rule.
def test_every_module_stands_in_a_known_layer() -> None:
    """A folder or a file on the top floor is a layer of the table."""
    assert len(MODULES) > len(MAY_IMPORT)
    assert not [name_of(path) for path in MODULES if layer_of(path) not in MAY_IMPORT]


def test_a_layer_imports_only_layers_below_it() -> None:
    """The table of layers holds for every import, those inside functions too."""
    wrong = [
        f'{name_of(path)}:{line} ({layer}): {name}'
        for path in MODULES
        for layer in [layer_of(path)]
        for name, line in imports(path)
        if (other := our_layer(name)) is not None
        and other not in MAY_IMPORT[layer] | {layer, '__init__', 'type_aliases'}
    ]
    assert not wrong


def test_a_library_stays_in_its_layer() -> None:
    """ROS, mujoco, pydantic and the like are imported in the layers named for them only."""
    wrong = [
        f'{name_of(path)}:{line}: {name}'
        for path in MODULES
        for name, line in imports(path)
        if layer_of(path) not in homes(name)
    ]
    assert not wrong


def test_the_command_starts_without_anything_heavy() -> None:
    """A module of cli and all that it imports do without ROS, MuJoCo, matplotlib, web servers."""
    names = [
        '.'.join(
            part
            for part in path.relative_to(PACKAGE.parent).with_suffix('').parts
            if part != '__init__'
        )
        for path in MODULES
        if layer_of(path) == 'cli'
    ]
    # One after the other in one process: the first that brings something heavy is named.
    code = f"""
import importlib, sys
for name in {names}:
    importlib.import_module(name)
    if heavy := sorted(set(sys.modules) & {HEAVY}):
        sys.exit(f'{{name}} brings {{heavy}}')
"""
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, '')


def test_the_pure_part_reads_no_clock_file_or_logger() -> None:
    """In model and evaluation time, files and settings come in as arguments."""
    pure = [path for path in MODULES if layer_of(path) in PURE]
    calls = [
        f'{name_of(path)}:{node.lineno}: {node.func.id}()'
        for path in pure
        for node in nodes(path)
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id in IMPURE_CALLS
    ]
    modules = [
        f'{name_of(path)}:{line}: {name}'
        for path in pure
        for name, line in imports(path)
        if name.split('.')[0] in IMPURE_MODULES
    ]
    assert not calls + modules


def test_a_module_is_short() -> None:
    """A module has at most 400 lines, unless LONGER gives the reason."""
    assert not long_modules().keys() - LONGER.keys(), long_modules()


def test_a_function_is_short() -> None:
    """A function has at most 40 lines of code, unless LONGER gives the reason."""
    assert not long_functions().keys() - LONGER.keys(), long_functions()


def test_every_allowance_is_still_needed() -> None:
    """LONGER names nothing that has become short or has gone."""
    assert not LONGER.keys() - long_modules().keys() - long_functions().keys()


def long_modules() -> dict[str, int]:
    """Return the lines of each module that is longer than it should be."""
    return {
        name_of(path): lines for path in MODULES if (lines := len(source_of(path))) > LONGEST_MODULE
    }


def long_functions() -> dict[str, int]:
    """Return the lines of code of each function that is longer than it should be."""
    return {
        f'{name_of(path)}:{node.name}': lines
        for path in MODULES
        for node in functions(path)
        if (lines := code_lines(node, source_of(path))) > LONGEST_FUNCTION
    }


def test_no_call_changes_what_it_is_added_to() -> None:
    """In `x.n += f()` Python reads x.n before it calls f: what f adds to x.n would be lost.

    So only calls that change nothing stand there, and no await.
    """
    kinds = (ast.Call, ast.Await, ast.Yield, ast.YieldFrom)
    wrong = [
        f'{name_of(path)}:{node.lineno}: {ast.unparse(node)}'
        for path in MODULES
        for node in nodes(path)
        if isinstance(node, ast.AugAssign) and not isinstance(node.target, ast.Name)
        for part in ast.walk(node.value)
        if isinstance(part, kinds) and not changes_nothing(part)
    ]
    assert not wrong


def changes_nothing(node: ast.AST) -> bool:
    """Return whether this calls a function of numbers or arrays, or an array's own sum or end."""
    if not isinstance(node, ast.Call):
        return False
    name = ast.unparse(node.func)
    return (
        name in PURE_CALLS
        or name.split('.')[0] in {'np', 'math'}
        or name.endswith(('.sum', '.min', '.max'))
    )


def test_every_public_name_has_a_docstring() -> None:
    """A module, a public class, function and method says what it is."""
    bare = [
        f'{name_of(path)}:{node.lineno}: {node.name}'
        for path in MODULES
        for node in public_definitions(parse(path))
        if ast.get_docstring(node) is None
    ]
    bare += [name_of(path) for path in MODULES if not ast.get_docstring(parse(path))]
    assert not bare


def test_every_function_is_annotated() -> None:
    """Every argument but self and cls, and every return, has its type."""
    assert not [
        line for path in MODULES for node in functions(path) for line in bare_of(node, path)
    ]


def bare_of(node: ast.FunctionDef | ast.AsyncFunctionDef, path: Path) -> list[str]:
    """Return what of a function's arguments and return has no type."""
    arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    arguments += [a for a in (node.args.vararg, node.args.kwarg) if a is not None]
    names = [a.arg for a in arguments if a.annotation is None and a.arg not in {'self', 'cls'}]
    place = f'{name_of(path)}:{node.lineno}: {node.name}'
    return [f'{place}({name})' for name in names] + [f'{place} ->'] * (node.returns is None)
