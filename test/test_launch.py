"""The launch files against what they start: read as syntax trees, for launch has no wheel.

What they start is started here as launch would, where it is no node of its own.
"""

import ast
import re
from collections.abc import Iterator
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path

import pytest
from console.servers import COMMAND, address_of, running

LAUNCH_FILES = sorted((Path(__file__).resolve().parents[1] / 'launch').glob('*.launch.py'))
NODES = {'Node', 'LifecycleNode'}

each_file = pytest.mark.parametrize('path', LAUNCH_FILES, ids=lambda path: path.name)


def calls(path: Path, names: set[str]) -> Iterator[ast.Call]:
    """Yield every call of a function or class of one of these names."""
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in names:
            yield node


def first_arguments(path: Path, name: str) -> set[str]:
    """Return the first argument of every call of `name`, all of them plain strings."""
    return {ast.literal_eval(call.args[0]) for call in calls(path, {name})}


def keywords(call: ast.Call) -> dict[str, ast.expr]:
    """Return the keyword arguments of a call by name."""
    return {keyword.arg: keyword.value for keyword in call.keywords if keyword.arg is not None}


@each_file
def test_what_a_launch_file_starts_is_installed(path: Path) -> None:
    """Every executable of this package that a launch file names is one of its console scripts."""
    installed = {script.name for script in entry_points(group='console_scripts')}
    started = {
        ast.literal_eval(keywords(call)['executable'])
        for call in calls(path, NODES)
        if ast.literal_eval(keywords(call)['package']) == 'ugv_acceptance'
    }
    assert started
    assert started <= installed


def declared_parameters(executable: str) -> dict[str, type]:
    """Return the parameters a node declares by name, each with its default's type."""
    (script,) = entry_points(group='console_scripts', name=executable)
    spec = find_spec(script.module)
    assert spec is not None
    assert spec.origin is not None
    declared: dict[str, type] = {'use_sim_time': bool}
    own = Path(spec.origin)
    for path in {own, *own.parent.glob('parameters.py')}:
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(node, ast.Call) and 'declare' in ast.unparse(node.func):
                match node.args:
                    case [ast.Constant(str() as name), ast.Constant(value), *_]:
                        declared[name] = type(value)
    return declared


@each_file
def test_every_parameter_is_one_of_the_node(path: Path) -> None:
    """A launch file sets only parameters its node declares, in the type of their default."""
    for call in calls(path, NODES):
        declared = declared_parameters(ast.literal_eval(keywords(call)['executable']))
        (given,) = (n for n in ast.walk(keywords(call)['parameters']) if isinstance(n, ast.Dict))
        for key, value in zip(given.keys, given.values, strict=True):
            assert isinstance(key, ast.Constant)
            assert isinstance(value, ast.Call)
            assert ast.unparse(keywords(value)['value_type']) == declared[str(key.value)].__name__


@each_file
def test_every_argument_is_declared_and_used(path: Path) -> None:
    """What a launch file takes it uses, and what it uses it takes."""
    declared = first_arguments(path, 'DeclareLaunchArgument')
    assert declared == first_arguments(path, 'LaunchConfiguration')


@each_file
def test_every_argument_is_described(path: Path) -> None:
    """`ros2 launch --show-args` says what each argument is for."""
    for call in calls(path, {'DeclareLaunchArgument'}):
        assert ast.literal_eval(keywords(call)['description'])


@each_file
def test_an_included_launch_file_takes_what_it_is_given(path: Path) -> None:
    """The arguments handed on are arguments of the file included, which is one of ours."""
    tree = ast.parse(path.read_text(encoding='utf-8'))
    given = {
        key.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == 'robot'
        for key in getattr(node.value, 'keys', ())
    }
    for call in calls(path, {'IncludeLaunchDescription'}):
        assert ast.unparse(keywords(call)['launch_arguments']) == 'robot.items()'
        texts = [n.value for n in ast.walk(call) if isinstance(n, ast.Constant)]
        (name,) = (t for t in texts if isinstance(t, str) and re.fullmatch(r'\w+\.launch\.py', t))
        assert given
        assert given <= first_arguments(path.with_name(name), 'DeclareLaunchArgument')


def words_of(path: Path, **given: str) -> list[str]:
    """Return the command-line words of a launch file's only node, by the arguments' defaults."""
    values = {
        ast.literal_eval(call.args[0]): ast.literal_eval(keywords(call)['default_value'])
        for call in calls(path, {'DeclareLaunchArgument'})
    } | given
    (node,) = calls(path, NODES)
    words = []
    for word in getattr(keywords(node)['arguments'], 'elts', ()):
        parts = getattr(word, 'elts', [word])
        words.append(
            ''.join(
                values[ast.literal_eval(part.args[0])]
                if isinstance(part, ast.Call)
                else ast.literal_eval(part)
                for part in parts
            )
        )
    return words


def test_the_console_starts_as_launched() -> None:
    """The words of console.launch.py and what launch adds to them give a page that is served."""
    (path,) = (path for path in LAUNCH_FILES if path.name == 'console.launch.py')
    added = [
        '--ros-args',
        '-r',
        '__node:=console',
        '-r',
        '__ns:=/robot1',
        '-p',
        'use_sim_time:=true',
    ]
    with running(*COMMAND, *words_of(path, port='0'), *added) as process:
        assert address_of(process).startswith('http://127.0.0.1:')
