"""The launch files against what they start: read as syntax trees, for launch has no wheel.

What they start is started here as launch would, where it is no node of its own.
"""

import ast
import json
import re
from collections.abc import Iterator
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path

import pytest
from console.servers import COMMAND, address_of, running
from robot_recipe import launched

from ugv_acceptance.cli.node_programs import MODULES

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
    spec = find_spec(MODULES.get(executable, script.module))
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


def tables(path: Path) -> Iterator[dict[str, ast.expr]]:
    """Yield the tables of a launch file whose keys are texts."""
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
        if isinstance(node, ast.Dict):
            keys = [key.value for key in node.keys if isinstance(key, ast.Constant)]
            if len(keys) == len(node.values):
                yield dict(zip(map(str, keys), node.values, strict=True))


def typed(path: Path) -> dict[str, str]:
    """Return the arguments of a launch file that are parameters by its table of types."""
    found = (t for t in tables(path) if t and all(isinstance(v, ast.Name) for v in t.values()))
    return {name: ast.unparse(kind) for table in found for name, kind in table.items()}


def parameters_of(path: Path) -> dict[str, str]:
    """Return the parameters a launch file may set, each with the name of its type."""
    given = typed(path)
    for table in tables(path):
        for name, value in table.items():
            if isinstance(value, ast.Call) and ast.unparse(value.func) == 'ParameterValue':
                given[name] = ast.unparse(keywords(value)['value_type'])
    return given


@each_file
def test_every_parameter_is_one_of_the_node(path: Path) -> None:
    """A launch file sets only parameters its node declares, in the type of their default."""
    (call,) = calls(path, NODES)
    declared = declared_parameters(ast.literal_eval(keywords(call)['executable']))
    given = parameters_of(path)
    assert given
    assert given == {name: declared[name].__name__ for name in given}


@each_file
def test_every_argument_is_declared_and_used(path: Path) -> None:
    """What a launch file takes it uses, and what it uses it takes."""
    declared = first_arguments(path, 'DeclareLaunchArgument')
    literal = {
        str(call.args[0].value)
        for call in calls(path, {'LaunchConfiguration'})
        if isinstance(call.args[0], ast.Constant)
    }
    assert declared == literal | typed(path).keys()


def defaults(path: Path) -> dict[str, str]:
    """Return the arguments of a launch file that have a default, with it."""
    found = calls(path, {'DeclareLaunchArgument'})
    return {
        ast.literal_eval(call.args[0]): ast.literal_eval(keywords(call)['default_value'])
        for call in found
        if 'default_value' in keywords(call)
    }


def test_an_argument_that_is_not_given_leaves_the_parameter_to_the_file() -> None:
    """Of the monitor: by default each is empty, and what is empty is no parameter.

    So a file of parameters counts before the node's defaults, and an argument before the file.
    """
    path = LAUNCH_FILES[0].with_name('monitor.launch.py')
    assert {defaults(path)[name] for name in parameters_of(path)} == {''}
    (words,) = launched(path, {'params_file': '/robot.yaml'})
    assert words[-3:] == ['--params-file', '/robot.yaml', '{}']
    given = {'publish_rate': '10', 'black_box': '/data', 'lock_parameters': 'true'}
    (words,) = launched(path, {'params_file': '/robot.yaml', **given})
    told = {'publish_rate': 10.0, 'black_box': '/data', 'lock_parameters': True}
    assert json.loads(words[-1]) == {'/**': {'ros__parameters': told}}


@pytest.mark.parametrize('name', ['params_file', 'black_box', 'publish_rate', 'respawn'])
def test_the_monitors_launch_file_takes_what_a_robot_needs(name: str) -> None:
    """Off or as the node has it unless given."""
    assert defaults(LAUNCH_FILES[0].with_name('monitor.launch.py'))[name] in {'', 'false'}


def test_a_monitor_and_its_console_can_be_started_again() -> None:
    """`respawn` is handed to launch, which takes its delay as a number."""
    for name in ('monitor', 'console'):
        (node,) = calls(LAUNCH_FILES[0].with_name(f'{name}.launch.py'), NODES)
        assert ast.unparse(keywords(node)['respawn']) == "LaunchConfiguration('respawn')"
        assert re.match(r'float\(|[0-9.]+$', ast.unparse(keywords(node)['respawn_delay']))


@each_file
def test_every_argument_is_described(path: Path) -> None:
    """`ros2 launch --show-args` says what each argument is for."""
    for call in calls(path, {'DeclareLaunchArgument'}):
        assert ast.literal_eval(keywords(call)['description'])


@each_file
def test_an_included_launch_file_takes_what_it_is_given(path: Path) -> None:
    """The arguments handed on are arguments of the file included, which is one of ours."""
    tree = ast.parse(path.read_text(encoding='utf-8'))
    handed = {
        ast.unparse(node.targets[0]): [k for k in getattr(node.value, 'keys', ()) if k]
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign)
    }
    for call in calls(path, {'IncludeLaunchDescription'}):
        table = ast.unparse(keywords(call)['launch_arguments']).removesuffix('.items()')
        given = {ast.literal_eval(key) for key in handed['robot'] + handed[table]}
        texts = [n.value for n in ast.walk(call) if isinstance(n, ast.Constant)]
        (name,) = (t for t in texts if isinstance(t, str) and re.fullmatch(r'\w+\.launch\.py', t))
        assert given
        assert given <= first_arguments(path.with_name(name), 'DeclareLaunchArgument')


def words_of(path: Path, **given: str) -> list[str]:
    """Return the command-line words of a launch file's only node, by the arguments' defaults."""
    values = defaults(path) | given
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
