"""The package as pip, colcon, rosdep and a reader of the repository meet it."""

import ast
import re
import shutil
import subprocess
import sys
import tarfile
from importlib.metadata import requires
from pathlib import Path
from zipfile import ZipFile

import pytest
from catkin_pkg.changelog import get_changelog_from_path
from catkin_pkg.package import Package, parse_package

import ugv_acceptance

DATA_FOLDERS = [
    'bags',
    'config',
    'launch',
    'layouts',
    'msg_configs',
    'rviz',
    'schema',
    'urdf',
]

# What the source archive has besides, so that what came out of it can be tested and read.
BESIDE = [
    'bench',
    'docs',
    'requirements',
    'sros2',
    'test',
    'CHANGELOG.rst',
    'CONTRIBUTING.md',
    'LICENSE',
    'Makefile',
    'README.md',
    'SECURITY.md',
]

# A requirement's rosdep key is python3-<its name>, except:
ROSDEP_KEY = {'pyyaml': 'python3-yaml'}
# pip brings them, by README.md: rosbags' key is one of pip's, the others have none.
WITHOUT_ROSDEP_KEY = {'mcap', 'rosbags', 'lz4', 'zstandard'}

# Nobody else's machine has these. Written in two halves, so that this file does not name them.
NOT_OURS = [
    '/' + 'root/',
    '/' + 'tmp/',
    '/' + 'work/',
    '/' + 'home/',
    'pypi' + '.org',
    'python' + 'hosted',
    'npmjs' + '.org',
    'deb' + '.debian',
]


@pytest.fixture(scope='module')
def package_xml(repository: Path) -> Package:
    """Return package.xml as catkin_pkg, colcon and bloom read it."""
    return parse_package(repository / 'package.xml')


def core_requirements() -> set[str]:
    """Return the lower-case names of what the package needs without any extra."""
    needed = [line for line in requires('ugv_acceptance') or [] if 'extra ==' not in line]
    return {re.split(r'[^A-Za-z0-9_-]', line, maxsplit=1)[0].lower() for line in needed}


def tracked_files(repository: Path) -> list[Path]:
    """Return the files under version control; of an unpacked source archive, all."""
    if not (repository / '.git').exists():
        return [path for path in repository.rglob('*') if path.is_file()]
    done = subprocess.run(
        ['git', 'ls-files', '-z'], cwd=repository, capture_output=True, text=True, check=True
    )
    paths = [repository / name for name in done.stdout.split('\0') if name]
    return [path for path in paths if path.is_file()]


def test_package_xml_has_the_version_of_the_code(package_xml: Package) -> None:
    """package.xml and the code name one version."""
    assert package_xml.version == ugv_acceptance.__version__


def test_changelog_has_the_version_on_top(repository: Path) -> None:
    """The newest entry of CHANGELOG.rst, which stands as REP-132 asks, is the code's version."""
    changelog = get_changelog_from_path(str(repository))
    newest = next(iter(changelog.foreach_version()))
    assert newest[0] == ugv_acceptance.__version__


def test_package_xml_is_one_for_ament_python(package_xml: Package) -> None:
    """Format 3, build type ament_python, the licence as SPDX names it."""
    assert package_xml.package_format == 3
    assert package_xml.get_build_type() == 'ament_python'
    assert package_xml.licenses == ['Apache-2.0']


def test_rosdep_brings_what_pip_brings(package_xml: Package) -> None:
    """Every requirement of setup.py stands in package.xml, save those that have no key."""
    keys = {depend.name for depend in package_xml.exec_depends}
    wanted = {
        ROSDEP_KEY.get(name, f'python3-{name}') for name in core_requirements() - WITHOUT_ROSDEP_KEY
    }
    assert wanted <= keys


def test_package_xml_names_every_ros_package_imported(
    package_xml: Package, repository: Path
) -> None:
    """What the nodes import of ROS is a dependency."""
    imported = set()
    for path in (repository / 'ugv_acceptance').rglob('*.py'):
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(node, ast.ImportFrom) and node.module and not node.level:
                imported.add(node.module.split('.')[0])
            elif isinstance(node, ast.Import):
                imported |= {alias.name.split('.')[0] for alias in node.names}
    ros = {name for name in imported if re.fullmatch(r'rclpy|std_srvs|\w+_(msgs|interfaces)', name)}
    assert ros <= {depend.name for depend in package_xml.exec_depends}


def test_a_wheel_made_from_the_source_archive_is_whole(repository: Path, tmp_path: Path) -> None:
    """The package's files, configurations, robots, launch files and runs all come along."""
    source = tmp_path / 'source'
    shutil.copytree(
        repository,
        source,
        # Tests beside this one write __pycache__.
        ignore=shutil.ignore_patterns(
            '.*', '__pycache__', 'out', 'build', 'install', 'log', '*.egg-info'
        ),
    )
    subprocess.run([sys.executable, 'setup.py', '-q', 'sdist'], cwd=source, check=True)
    (archive,) = (source / 'dist').glob('*.tar.gz')
    with tarfile.open(archive) as packed:
        held = {name.partition('/')[2] for name in packed.getnames()}
    assert files_below(source, ['ugv_acceptance', *DATA_FOLDERS, *BESIDE]) <= held
    pip = [sys.executable, '-m', 'pip', 'wheel', '-q', '--no-index', '--no-deps']
    subprocess.run([*pip, '--no-build-isolation', '-w', tmp_path, archive], check=True)
    (wheel,) = tmp_path.glob('*.whl')
    inside = {
        name.partition('/data/share/ugv_acceptance/')[2] or name
        for name in ZipFile(wheel).namelist()
    }
    expected = files_below(source, ['ugv_acceptance', *DATA_FOLDERS])
    assert expected <= inside


def files_below(source: Path, places: list[str]) -> set[str]:
    """Return the files in these folders, and these files, as seen from the source."""
    return {
        path.relative_to(source).as_posix()
        for place in places
        for path in [source / place, *(source / place).rglob('*')]
        if path.is_file() and '__pycache__' not in path.parts
    }


def test_no_file_names_a_machine_or_a_registry(repository: Path) -> None:
    """Nothing under version control holds a path of somebody's machine or a registry's host."""
    found = [
        f'{path.relative_to(repository)}: {text}'
        for path in tracked_files(repository)
        for text in NOT_OURS
        if text.encode() in path.read_bytes()
    ]
    assert not found


def test_files_that_pages_name_are_there(repository: Path) -> None:
    """Tests and modules in backticks, and the targets of links, on every page."""
    tracked = [f'/{path.relative_to(repository).as_posix()}' for path in tracked_files(repository)]
    missing = []
    for page in [repository / 'README.md', *repository.glob('docs/**/*.md')]:
        text = page.read_text('utf-8')
        named = re.findall(r'`((?:[a-z_]+/)*\w+\.py)`', text)
        missing += [n for n in named if not any(path.endswith(f'/{n}') for path in tracked)]
        targets = re.findall(r'\]\((?!http)([^)#:]+)[^)]*\)', text)
        missing += [f'{page.name}: {at}' for at in targets if not (page.parent / at).exists()]
    assert not missing


def test_the_benches_start_as_it_is_written(repository: Path) -> None:
    """Each command that names one finds it, from the root of the checkout, with what it imports."""
    pages = [*repository.glob('docs/**/*.md'), *repository.glob('bench/**/*.py')]
    text = '\n'.join(page.read_text('utf-8') for page in pages)
    assert 'python bench' + '/' not in text
    named = set(re.findall(r'python -m (bench(?:\.[a-z_]+)+)', text))
    assert len(named) > 20
    code = 'import importlib, sys; [importlib.import_module(name) for name in sys.argv[1:]]'
    subprocess.run([sys.executable, '-c', code, *named], check=True, cwd=repository, timeout=120)
