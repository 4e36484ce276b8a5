"""README's recipe for a robot and the advice to install, against what they bring and need.

`make recipe` follows the recipe; here is what needs no installation.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
from importlib.metadata import entry_points, requires
from pathlib import Path

import pytest
from catkin_pkg.package import parse_package
from packaging.requirements import Requirement
from robot_recipe import STAND_INS, apt_versions, commands, from_rosdep, launched, replaced

from ugv_acceptance import EXTRAS, pip_install

# One statement for each extra that asks for it; without `fast` all works, only slower.
ASKS_FOR: dict[str, tuple[list[str], str]] = {
    'cluster': (
        ['fsspec'],
        'from ugv_acceptance.campaign.sources import _opened as f; f("s3://b/")',
    ),
    'console': (['textual'], 'from ugv_acceptance.cli.watch import need; need("textual")'),
    'foxglove': (
        ['foxglove'],
        'from ugv_acceptance.nodes.foxglove_bridge import _foxglove as f; f()',
    ),
    'init': (
        ['xacro', 'trimesh'],
        # No program of that name on the path either.
        (
            'import os; from pathlib import Path; os.environ["PATH"] = "";'
            'from ugv_acceptance.configure.sources import expanded as f; f(Path("r.xacro"), (), {})'
        ),
    ),
    'pdf': (['weasyprint'], 'from ugv_acceptance.report.acceptance import pdf_of; pdf_of("")'),
    'sim': (['mujoco'], 'from ugv_acceptance.nodes.packbot_simulator import main; main([])'),
    'table': (
        ['pyarrow'],
        'from ugv_acceptance.offline.output import ParquetSink as P; P("m.parquet", None, 0)',
    ),
}


def installed_by_pip(recipe: list[str]) -> dict[str, Requirement]:
    """Return what the recipe's `pip install` commands name, by name."""
    words = [shlex.split(line)[2:] for line in recipe if line.startswith('pip install ')]
    return {Requirement(word).name: Requirement(word) for line in words for word in line}


@pytest.fixture(scope='module')
def recipe(repository: Path) -> list[str]:
    """Return the commands of README.md."""
    return commands((repository / 'README.md').read_text(encoding='utf-8'))


def test_every_rosdep_key_is_one_of_apt(repository: Path) -> None:
    """Each key of package.xml is apt's on Ubuntu 24.04: one of pip stops `rosdep install`."""
    package = parse_package(repository / 'package.xml')
    keys = {depend.name for depend in [*package.exec_depends, *package.test_depends]}
    lines = (repository / 'requirements/rosdep-noble.txt').read_text('utf-8').splitlines()
    apt = {line.split(':')[0] for line in lines if not line.startswith('#')}
    assert keys == apt


def test_pip_brings_what_apt_has_not_or_only_older(recipe: list[str]) -> None:
    """After rosdep and the recipe's pip every requirement of setup.py is there, new enough."""
    named = installed_by_pip(recipe)
    from_apt = {name.lower() for name in from_rosdep()}
    with_them = {Requirement(line).name for name in named for line in requires(name) or []}
    versions = {name.lower(): version for name, version in apt_versions().items()}
    for line in requires('ugv_acceptance') or []:
        needed = Requirement(line)
        name = needed.name.lower()
        if 'extra' in line or name in named or name in with_them:
            continue
        assert name in from_apt, line
        assert name not in versions or versions[name] in needed.specifier, line


def test_pip_brings_what_the_launch_files_need(recipe: list[str]) -> None:
    """Console and simulator, which the launch files start, find their libraries."""
    assert {*EXTRAS['console'], *EXTRAS['sim']} <= installed_by_pip(recipe).keys()


def test_every_stand_in_stands_for_a_command(recipe: list[str]) -> None:
    """What `make recipe` replaces is in the recipe, so that no command escapes it by a new word."""
    for stand_in in STAND_INS:
        assert any(re.fullmatch(stand_in.command, command) for command in recipe), stand_in
    assert not [c for c in recipe if re.match('sudo|rosdep|git', c) and replaced(c)[0] == c]


@pytest.mark.parametrize('command', ['simulator', 'replay', 'monitor', 'console'])
def test_what_is_started_for_a_launch_file_is_ours(repository: Path, command: str) -> None:
    """`make recipe` takes from a launch file what it starts: scripts of this package."""
    scripts = {script.name for script in entry_points(group='console_scripts')}
    found = list(launched(repository / f'launch/{command}.launch.py', {'bag': 'run1'}))
    assert found
    assert {words[0] for words in found} <= scripts


@pytest.mark.parametrize('verb', ['install', 'develop'])
def test_scripts_of_a_colcon_build_take_the_active_python(
    repository: Path, tmp_path: Path, verb: str
) -> None:
    """A build, --symlink-install too, does not write the interpreter of colcon into scripts."""
    source, prefix = tmp_path / 'source', tmp_path / 'install'
    ignored = ('.*', '__pycache__', 'out', 'build', 'install', 'log', '*.egg-info')
    shutil.copytree(repository, source, ignore=shutil.ignore_patterns(*ignored))
    version = f'{sys.version_info.major}.{sys.version_info.minor}'
    site = prefix / f'lib/python{version}/site-packages'
    site.mkdir(parents=True)
    options: dict[str, list[str | Path]] = {
        'install': ['--record', tmp_path / 'log', '--single-version-externally-managed'],
        'develop': ['--editable', '--build-directory', tmp_path / 'build', '--no-deps'],
    }
    words: list[str | Path] = [
        sys.executable,
        '-W',
        'ignore',
        'setup.py',
        '-q',
        verb,
        '--prefix',
        prefix,
    ]
    env = os.environ | {'PYTHONPATH': str(site)}
    subprocess.run([*words, *options[verb]], cwd=source, env=env, check=True)
    scripts = list((prefix / 'lib/ugv_acceptance').iterdir())
    assert len(scripts) == 4
    for script in scripts:
        assert script.read_text(encoding='utf-8').startswith('#!/usr/bin/env python3\n')


def test_the_extras_are_those_the_messages_tell() -> None:
    """What `pip install .[EXTRA]` brings is what the message of that extra tells to install."""
    lines = [Requirement(line) for line in requires('ugv_acceptance') or []]
    for extra, names in EXTRAS.items():
        told = {
            f'{line.name}{line.specifier}'
            for line in lines
            if line.marker is not None
            and line.marker.evaluate({'extra': extra})
            and not line.marker.evaluate({'extra': ''})
        }
        assert told == set(names), extra


def test_each_extra_has_a_message() -> None:
    """Every extra but `fast`, which only saves time, is asked for somewhere."""
    assert ASKS_FOR.keys() == EXTRAS.keys() - {'fast'}


@pytest.mark.parametrize('extra', sorted(ASKS_FOR))
def test_without_an_extra_the_message_tells_what_to_install(extra: str) -> None:
    """The command that installs what is missing is told, by names that are on the index."""
    modules, statement = ASKS_FOR[extra]
    code = (
        f'import importlib.util, sys\n'
        f'sys.modules.update(dict.fromkeys({modules}))\n'
        f'find = importlib.util.find_spec\n'
        f'importlib.util.find_spec = lambda name: None if name in {modules} else find(name)\n'
        f'{statement}'
    )
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=False)
    assert done.returncode
    assert pip_install(extra) in done.stderr


def test_no_advice_names_this_package_to_pip(repository: Path) -> None:
    """ugv_acceptance is on no index: neither code nor documents tell to install it by name."""
    paths = [
        *(repository / 'ugv_acceptance').rglob('*.py'),
        *repository.glob('*.md'),
        *(repository / 'docs').rglob('*.md'),
    ]
    wrong = re.compile(r'pip install[^`\n]*\bugv[_-]acceptance|ugv[_-]acceptance\[[a-z]')
    assert not [path.name for path in paths if wrong.search(path.read_text(encoding='utf-8'))]


@pytest.mark.parametrize('page', ['console', 'ros_interface', 'report', 'campaign'])
def test_documents_tell_the_same_as_the_messages(repository: Path, page: str) -> None:
    """A command with pip in the documents of an extra is the one of its message."""
    text = (repository / f'docs/{page}.md').read_text(encoding='utf-8')
    told = set(
        re.findall(r'^pip install [^\n]+?$|(?<=`)pip install [^`]+(?=`)', text, re.MULTILINE)
    )
    assert told
    assert told <= {pip_install(extra) for extra in EXTRAS}
