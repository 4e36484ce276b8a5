"""What `init` is given: a URDF, a xacro that is expanded, a recording; and where meshes are found.

A xacro is a program: its expressions are evaluated as Python. So expand only one that you trust.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from ugv_acceptance import BadConfig, pip_install
from ugv_acceptance.config.units import cut

# A description is XML of one of these endings; everything else that is given is a recording.
DESCRIPTIONS = ('.urdf', '.xacro', '.xml')
# What only a xacro holds: its elements, its expressions.
_XACRO = re.compile(rb'<\s*xacro:|\$\{|\$\(')
_PACKAGE_NAME = re.compile(r'<name>\s*([^<\s]+)\s*</name>')
# Levels of folders above a description, and below a folder, in which packages are looked for.
_ABOVE, _BELOW = 4, 2
# A larger description (bytes) is none.
_LARGEST = 20_000_000
# Seconds that the program xacro may take.
_PATIENCE = 120.0
MeshFinder = Callable[[str], Path | None]


@dataclass(frozen=True, slots=True)
class Sources:
    """A robot's description (None: a recording has to tell it), its file, and the recordings.

    `path` is the file that was given; `made` is whether `urdf` was made from it by xacro.
    """

    urdf: bytes | None
    path: Path | None
    made: bool
    recordings: tuple[Path, ...]


def sources_of(
    paths: Sequence[Path], folders: Sequence[Path] = (), arguments: Mapping[str, str] | None = None
) -> Sources:
    """Return what the paths are: at most one description, any number of parts of one recording.

    `folders` are looked through for packages that a xacro includes, `arguments` are the xacro's.
    Raises BadConfig for a path that is not there, two descriptions, and a xacro that fails.
    """
    for path in (*paths, *folders):
        if not path.exists():
            raise BadConfig(f'{path}: expected a URDF, a xacro or a recording, found nothing there')
    described = [path for path in paths if path.suffix.lower() in DESCRIPTIONS]
    recordings = tuple(path for path in paths if path not in described)
    if len(described) > 1:
        names = ', '.join(map(str, described))
        raise BadConfig(f'{described[1]}: expected one URDF or xacro, got {names}')
    if not described:
        return Sources(None, None, made=False, recordings=recordings)
    path = described[0]
    content = _content(path)
    if path.suffix.lower() == '.xacro' or _XACRO.search(content):
        text = expanded(path, folders, arguments or {})
        return Sources(text, path, made=True, recordings=recordings)
    return Sources(content, path, made=False, recordings=recordings)


def _content(path: Path) -> bytes:
    try:
        if path.stat().st_size > _LARGEST:
            raise BadConfig(f'{path}: expected a URDF below 20 MB, got a larger file')
        return path.read_bytes()
    except OSError as error:
        raise BadConfig(f'{path}: expected a URDF, got: {error.strerror}') from None


def expanded(path: Path, folders: Sequence[Path], arguments: Mapping[str, str]) -> bytes:
    """Return the URDF of a xacro, by the Python package xacro, else by the program of that name.

    Raises BadConfig where neither is there, a package is missing, or the xacro has an error.
    """
    program = None
    try:
        import xacro  # noqa: PLC0415 - an extra
    except ImportError:
        xacro = None  # type: ignore[assignment]
        program = shutil.which('xacro')
    if xacro is None and program is None:
        raise BadConfig(f'{path}: expected xacro, which expands it: {pip_install("init")}')
    with _packages_found(packages_in(_around(path, folders))):
        if program is not None:
            return _by_program(program, path, arguments)
        try:
            # It prints about files it does not find; what it makes is returned.
            with redirect_stdout(sys.stderr):
                document = xacro.process_file(str(path), mappings=dict(arguments))
        except Exception as error:  # noqa: BLE001 - the xacro is a program: it can raise anything
            raise BadConfig(f'{path}: {_why(error)}') from None
        text: str = document.toprettyxml(indent='  ')
        return text.encode()


def _by_program(program: str, path: Path, arguments: Mapping[str, str]) -> bytes:
    words = [program, str(path), *(f'{name}:={value}' for name, value in arguments.items())]
    try:
        done = subprocess.run(  # noqa: S603 - the user's own xacro
            words, capture_output=True, check=False, timeout=_PATIENCE
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise BadConfig(f'{path}: xacro failed: {cut(str(error))}') from None
    if done.returncode:
        raise BadConfig(f'{path}: {_why(done.stderr.decode("utf-8", "replace"))}')
    return done.stdout


def _why(error: Exception | str) -> str:
    """Return in one line why a xacro could not be expanded; a package that is missing is named."""
    text = ' '.join(str(error).split())
    chain: list[object] = [error]
    while isinstance(at := getattr(chain[-1], 'exc', None), Exception) and at not in chain:
        chain.append(at)
    missing = [e for e in chain if type(e).__name__ == 'PackageNotFoundError']
    name = str(missing[0].args[0]) if missing else ''  # type: ignore[attr-defined]
    found = re.search(r"package '([^']+)' not found", text) or re.search(
        r"PackageNotFoundError[^']*'([^']+)'", text
    )
    name = name.partition("'")[2].partition("'")[0] if "'" in name else name
    name = found[1] if found else name
    if name:
        return (
            f'the xacro needs the package {cut(name)}, which was not found: give a folder that '
            'holds it with --meshes'
        )
    return f'xacro could not expand it: {cut(text) or type(error).__name__}'


def _around(path: Path, folders: Sequence[Path]) -> tuple[Path, ...]:
    """Return the folders in which packages are looked for: those given, then those above a file."""
    above = list(path.resolve().parents)[:_ABOVE]
    return (*(folder.resolve() for folder in folders), *above)


@cache
def packages_in(folders: tuple[Path, ...]) -> dict[str, Path]:
    """Return the ROS packages (name -> folder) in folders and two levels below; the first counts.

    A package is a folder with a package.xml, which tells its name.
    """
    found: dict[str, Path] = {}
    for folder in folders:
        for place in _below(folder, _BELOW):
            try:
                text = (place / 'package.xml').read_text('utf-8', 'replace')
            except OSError:
                continue
            match = _PACKAGE_NAME.search(text)
            found.setdefault(match[1] if match else place.name, place)
    return found


def _below(folder: Path, levels: int) -> Iterator[Path]:
    yield folder
    if not levels:
        return
    try:
        inside = sorted(place for place in folder.iterdir() if not place.name.startswith('.'))
    except OSError:
        return
    for place in inside:
        if place.is_dir() and not place.is_symlink():
            yield from _below(place, levels - 1)


@contextmanager
def _packages_found(packages: Mapping[str, Path]) -> Iterator[None]:
    """Let ROS's index of packages hold these ones too, for $(find NAME) of a xacro."""
    before = os.environ.get('AMENT_PREFIX_PATH')
    with tempfile.TemporaryDirectory(prefix='ugv_acceptance_packages_') as folder:
        index = Path(folder, 'share', 'ament_index', 'resource_index', 'packages')
        index.mkdir(parents=True)
        for name, place in packages.items():
            if name == Path(name).name and name not in {'', '.', '..', 'ament_index'}:
                (index / name).touch()
                Path(folder, 'share', name).symlink_to(place)
        os.environ['AMENT_PREFIX_PATH'] = os.pathsep.join(filter(None, (folder, before)))
        try:
            yield
        finally:
            if before is None:
                del os.environ['AMENT_PREFIX_PATH']
            else:
                os.environ['AMENT_PREFIX_PATH'] = before


def mesh_finder(described: Path | None, folders: Sequence[Path]) -> MeshFinder:
    """Return a function that finds the file of a mesh as a URDF names it; None: it is not here.

    package://NAME/PATH is looked for in the packages of `folders`, in those around the description,
    in the folders themselves, and in ROS's index.
    """
    around = _around(described, folders) if described else tuple(f.resolve() for f in folders)

    def find(name: str) -> Path | None:
        return next((place for place in _places(name, around) if place.is_file()), None)

    return find


def _places(name: str, around: tuple[Path, ...]) -> Iterator[Path]:
    scheme, found, rest = name.partition('://')
    if not found:
        yield from (folder / name for folder in around)
        return
    if scheme == 'file':
        yield Path(rest)
        return
    package, _, inside = rest.partition('/')
    packages = packages_in(around)
    if package in packages:
        yield packages[package] / inside
    yield from (folder / package / inside for folder in around)
    yield from (folder / inside for folder in around)
    share = _share_of(package)
    if share is not None:
        yield share / inside


def _share_of(package: str) -> Path | None:
    try:
        from ament_index_python.packages import (  # noqa: PLC0415 - ROS may be absent
            get_package_share_directory,
        )

        return Path(get_package_share_directory(package))
    except (ImportError, LookupError, OSError, ValueError):
        return None
