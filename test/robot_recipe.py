"""README's recipe "On a robot", followed: `make recipe` runs this with the system's Python.

It takes the commands from README.md and runs them in one shell, in a new folder, with apt's colcon
and in the recipe's own virtual environment. What no Debian without ROS has is replaced by the table
STAND_INS, said aloud: rosdep and ROS from apt by wheels of the versions apt has, `ros2 run` and
`ros2 launch` by the executables they start, with what launch hands them. Nothing but the standard
library is imported, for /usr/bin/python3 runs this, and the recipe's Python in its `hear`.
"""

import json
import os
import re
import runpy
import shlex
import signal
import socket
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

REPOSITORY = Path(__file__).resolve().parents[1]
HEADING = '## On a robot'
SYSTEM_PATH = '/usr/sbin:/usr/bin:/sbin:/bin'
NUMPY = '1.26.4'
# Versions of Ubuntu 24.04's packages beside those of requirements/jazzy.txt; it keeps what is too
# old to start with out of the other runs, here the recipe is to replace it.
APT_HAS = {'matplotlib': '3.6.3', 'pydantic': '1.10.14', 'typer': '0.9.0'}
# By pip's name where a rosdep key is not python3-<that name>.
PIP_NAME = {'yaml': 'PyYAML'}
# What shows that a node works: a message on this topic, of this type.
SHOWN_BY = {
    'acceptance_monitor': ('/diagnostics', 'diagnostic_msgs.msg:DiagnosticArray'),
    'packbot_simulator': ('/joint_states', 'sensor_msgs.msg:JointState'),
}
PATIENCE = 60.0  # s


@dataclass(frozen=True)
class StandIn:
    """What a command of the recipe is replaced by here; `why` is printed."""

    command: str
    by: str
    why: str


COPY = (
    f'mkdir ugv_acceptance && git -C {shlex.quote(str(REPOSITORY))} ls-files -z'
    f' | tar -C {shlex.quote(str(REPOSITORY))} --null -T - -c | tar -C ugv_acceptance -x'
)
STAND_INS = (
    StandIn(
        r'sudo apt install .*', '', "Debian has no ros-dev-tools; .ci/run installs apt's colcon"
    ),
    StandIn(r'sudo rosdep init|rosdep update', '', "rosdep's index is not on this machine"),
    StandIn(r'source /opt/ros/jazzy/setup\.bash', '', 'no ROS from apt: wheels of it, see below'),
    StandIn(r'git clone <this repository> ugv_acceptance', COPY, 'this checkout'),
    StandIn(
        r'rosdep install .*', '', 'its packages come as wheels of the same versions, see below'
    ),
    StandIn(
        r'\. venv/bin/activate',
        '. venv/bin/activate && pip install -q -c ../apt.txt -r ../rosdep.txt',
        'and what apt and rosdep bring on a robot',
    ),
)


def commands(readme: str) -> list[str]:
    """Return the commands of the recipe's code block, one by one and without comments."""
    section = readme.split(f'\n{HEADING}', 1)[1]
    block = section.split('```', 2)[1]
    lines = [re.sub(r'\s+#.*', '', line).strip() for line in block.splitlines()]
    return [command for line in lines if line for command in line.split(' && ')]


def replaced(command: str) -> tuple[str, str]:
    """Return what is run for a command, and why it is another one; the reason is often empty."""
    for stand_in in STAND_INS:
        if re.fullmatch(stand_in.command, command):
            return stand_in.by, stand_in.why
    return command, ''


def apt_versions() -> dict[str, str]:
    """Return the versions that stand for apt's, by pip's names."""
    lines = (REPOSITORY / 'requirements/jazzy.txt').read_text(encoding='utf-8').splitlines()
    pinned = [line.partition('==') for line in lines if not line.startswith('#')]
    return {name: version for name, _, version in pinned} | APT_HAS


def from_rosdep() -> list[str]:
    """Return what `rosdep install` brings besides ROS, by pip's names."""
    root = ET.parse(REPOSITORY / 'package.xml').getroot()  # noqa: S314 - our own file
    keys = [str(depend.text) for depend in root.iter('depend')]
    names = [key.removeprefix('python3-') for key in keys if key.startswith('python3-')]
    return [PIP_NAME.get(name, name) for name in names]


def prepare(folder: Path) -> dict[str, str]:
    """Write pip's lists for the stand-ins; return the environment of a fresh login shell."""
    versions = [f'{name}=={version}\n' for name, version in apt_versions().items()]
    (folder / 'apt.txt').write_text(''.join(versions), encoding='utf-8')
    ros = f'-r {REPOSITORY}/requirements/ros.txt\n'
    (folder / 'rosdep.txt').write_text(ros + '\n'.join(from_rosdep()), encoding='utf-8')
    foreign = re.compile(r'_?(ROS|PYTHON|AMENT|COLCON|VIRTUAL_ENV|RMW|MAKE|MFLAGS|PYENV)')
    kept = {name: value for name, value in os.environ.items() if not foreign.match(name)}
    kept |= {'PATH': SYSTEM_PATH, 'ROS_LOG_DIR': str(folder / 'ros_log')}
    kept |= {'PIP_QUIET': '1', 'PIP_NO_COMPILE': '1'}
    return kept | {'ROS_DOMAIN_ID': free_domain(), 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}


def free_domain() -> str:
    """Return a ROS domain on whose discovery port nobody listens."""
    for domain in range(101, 0, -1):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(('', 7400 + 250 * domain))
            except OSError:
                continue
            return str(domain)
    raise SystemExit('expected a free ROS domain in 1..101, all are taken')


def shell(recipe: list[str], folder: Path, env: dict[str, str]) -> dict[str, str]:
    """Run commands in one bash, the first that fails ends it; return the environment it leaves."""
    script = ['set -eo pipefail']
    for command in recipe:
        run, why = replaced(command)
        run, told = (
            run.replace('~/', f'{folder}/'),
            f'$ {command}' + (f'   # HERE: {why}' * bool(why)),
        )
        script += [f'echo {shlex.quote(told)}', *([run] if run else [])]
    script += ['env -0 > "$LEFT"']
    left = folder / 'environment'
    bash = ['/bin/bash', '--norc', '-c', '\n'.join(script)]
    subprocess.run(bash, cwd=folder, env=env | {'LEFT': str(left)}, check=True)
    pairs = left.read_text(encoding='utf-8').split('\0')
    return dict(pair.split('=', 1) for pair in pairs if pair)


def say(text: str) -> None:
    """Print a line at once: other processes write to the same place."""
    sys.stdout.write(f'{text}\n')
    sys.stdout.flush()


class Written:
    """Stands for every class of launch while a launch file is read: keeps what it was given."""

    def __init__(self, *words: Any, **named: Any) -> None:
        self.words, self.named = words, named


def read_launch_file(path: Path) -> list[Any]:
    """Return the entities of a launch file, without launch, of which there is no wheel."""

    class Stand(ModuleType):
        def __getattr__(self, name: str) -> Any:
            if name.startswith('__'):
                raise AttributeError(name)
            made = type(name, (Written,), {})
            setattr(self, name, made)
            return made

    text = path.read_text(encoding='utf-8')
    names = re.findall(r'^from (launch\S*) import', text, re.MULTILINE)
    before = dict(sys.modules)
    sys.modules.update({name: Stand(name) for name in names})
    try:
        described = runpy.run_path(str(path))['generate_launch_description']()
    finally:
        for name in names:
            del sys.modules[name]
        sys.modules.update(before)
    return list(described.words[0])


def value_of(given: Any, values: Mapping[str, str]) -> Any:
    """Return what launch makes of an argument: text and configurations, joined, in their type."""
    if isinstance(given, Written):
        of = value_of(given.words[0], values)
        match type(given).__name__:
            case 'LaunchConfiguration':
                return values[of]
            case 'ParameterValue' if given.named['value_type'] is bool:
                return of == 'true'
            case 'ParameterValue':
                return given.named['value_type'](of)
            case _:
                return of
    return ''.join(value_of(part, values) for part in given) if isinstance(given, list) else given


def launched(path: Path, given: Mapping[str, str]) -> Iterator[list[str]]:
    """Yield the words of every executable of ours that a launch file starts, includes included."""
    values = dict(given)
    for entity in read_launch_file(path):
        named = entity.named
        match type(entity).__name__:
            case 'DeclareLaunchArgument':
                values.setdefault(entity.words[0], named.get('default_value', ''))
            case 'IncludeLaunchDescription':
                share = entity.words[0].words[0]
                handed = {key: value_of(v, values) for key, v in named['launch_arguments']}
                yield from launched(path.with_name(share.words[0][-1]), handed)
            case 'OpaqueFunction':
                nodes = named['function'](Context(values))
                yield from (node_words(node.named, values) for node in nodes)
            case _:
                yield node_words(named, values)


@dataclass(frozen=True)
class Context:
    """Stands for launch's context, which knows the arguments of a launch file."""

    values: Mapping[str, str]

    def perform_substitution(self, given: Any) -> str:
        """Return what is told for an argument."""
        return str(value_of(given, self.values))


def node_words(named: Mapping[str, Any], values: Mapping[str, str]) -> list[str]:
    """Return the words that start a node; the last are its parameters, as JSON."""
    parameters: dict[str, Any] = {}
    files: list[str] = []
    for given in named['parameters']:
        if isinstance(given, dict):
            parameters |= {k: value_of(v, values) for k, v in given.items()}
        else:
            files += ['--params-file', given]
    wild = {'/**': {'ros__parameters': parameters}} if parameters else {}
    words = [str(value_of(word, values)) for word in named.get('arguments', ())]
    name = f'__node:={named["name"]}'
    return [named['executable'], *words, '--ros-args', '-r', name, *files, json.dumps(wild)]


def started(command: str, folder: Path) -> list[list[str]]:
    """Return the words of what `ros2 run` or `ros2 launch` starts, with the paths they find."""
    _, verb, package, name, *rest = shlex.split(command)
    prefix = folder / 'ws/install' / package
    if verb == 'run':
        return [[str(prefix / 'lib' / package / name), *rest]]
    given = dict(word.split(':=', 1) for word in rest)
    found = list(launched(prefix / 'share' / package / 'launch' / name, given))
    for number, words in enumerate(found):
        words[0] = str(prefix / 'lib' / package / words[0])
        file = folder / f'parameters_{number}.yaml'
        told = words.pop()
        if json.loads(told):
            file.write_text(told, encoding='utf-8')  # JSON is YAML
            words += ['--params-file', str(file)]
    return found


def follow(command: str, folder: Path, env: dict[str, str]) -> None:
    """Start what a ros2 command starts; nodes until they are seen to work, verbs to their end."""
    say(f'$ {command}')
    running: list[tuple[list[str], subprocess.Popen[bytes]]] = []
    try:
        for words in started(command, folder):
            say(f'  {shlex.join(words)}'.replace(f'{folder}/', '~/'))
            running.append((words, subprocess.Popen(words, cwd=folder / 'ws', env=env)))
        for words, process in running:
            wait_until_it_works(words, process, env)
    finally:
        for _, process in running:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
        ends = [(words, end_of(process)) for words, process in running]
    bad = [f'{Path(words[0]).name}: exit code {code}' for words, code in ends if code]
    if bad:
        raise SystemExit(f'{command}: expected exit code 0, got {", ".join(bad)}')


def end_of(process: 'subprocess.Popen[bytes]') -> int:
    """Return the exit code of a process that was asked to end; one that does not is killed."""
    try:
        return process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


def wait_until_it_works(
    words: list[str], process: 'subprocess.Popen[bytes]', env: dict[str, str]
) -> None:
    """Return when a node's message or a console's page is there, or a verb has ended."""
    name = Path(words[0]).name
    if name in SHOWN_BY:
        hear = [sys.argv[0], 'hear', *SHOWN_BY[name]]
        subprocess.run(['python3', *hear], env=env, check=True)
        say(f'  {name}: a message on {SHOWN_BY[name][0]}')
    elif '--ros-args' in words:
        port = int(next(w for w in words if w.startswith('--port=')).removeprefix('--port='))
        until = time.monotonic() + PATIENCE
        while process.poll() is None and time.monotonic() < until:
            with socket.socket() as client:
                if client.connect_ex(('127.0.0.1', port)) == 0:
                    say(f'  {name} console: answers on port {port}')
                    return
            time.sleep(0.1)
        raise SystemExit(f'{name}: expected a page on port {port}, got none')
    else:
        process.wait(PATIENCE)
    if name in SHOWN_BY and process.poll() is not None:
        raise SystemExit(f'{name}: expected it to run on, it ended with {process.returncode}')


def hear(topic: str, kind: str) -> None:
    """Wait for one message on a topic; the recipe's own Python runs this."""
    rclpy = import_module('rclpy')
    module, name = kind.split(':')
    rclpy.init()
    heard: list[Any] = []
    node = rclpy.create_node('recipe')
    quality = import_module('rclpy.qos').qos_profile_sensor_data
    kind_of = getattr(import_module(module), name)
    node.create_subscription(kind_of, topic, heard.append, quality)
    until = time.monotonic() + PATIENCE
    while not heard and time.monotonic() < until:
        rclpy.spin_once(node, timeout_sec=0.5)
    if not heard:
        raise SystemExit(f'{topic}: expected a message within {PATIENCE:g} s, got none')


def main() -> None:
    """Follow the recipe from its first line to its last."""
    recipe = commands((REPOSITORY / 'README.md').read_text(encoding='utf-8'))
    set_up = [command for command in recipe if not command.startswith('ros2 ')]
    start = time.monotonic()
    with tempfile.TemporaryDirectory(prefix='recipe_', ignore_cleanup_errors=True) as made:
        folder = Path(made)
        env = shell(set_up, folder, prepare(folder))
        # apt's message packages are compiled against this one.
        check = f'import numpy; assert numpy.__version__ == {NUMPY!r}, numpy.__version__'
        subprocess.run(['python3', '-c', check], env=env, check=True)
        for command in recipe[len(set_up) :]:
            follow(command, folder, env)
    say(f'The recipe works: {len(recipe)} commands, {time.monotonic() - start:.0f} s.')


if __name__ == '__main__':
    if sys.argv[1:2] == ['hear']:
        hear(*sys.argv[2:])
    else:
        main()
