"""Guards every output: it must not replace an input, another output or somebody else's file.

An output is never an input of the same command, nor another output of it, by whatever name or
link. An existing file stays, unless it is a file of the same kind that this program wrote, or
--overwrite is given. All is checked before any work begins.
"""

import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import TYPE_CHECKING

from ugv_acceptance import AcceptanceError

if TYPE_CHECKING:
    from ugv_acceptance.cli.output_kinds import FolderKind, Kind
    from ugv_acceptance.config import Config


@dataclass(frozen=True, slots=True)
class Input:
    """A file or folder that is read, and its name for the user, such as 'the recording'."""

    what: str
    path: Path


@dataclass(frozen=True, slots=True)
class Output:
    """A file that an option asks for; `path` None: the option was not given."""

    option: str
    path: Path | None
    kind: 'Kind'


def inputs_of(
    config: 'Config | Path | None' = None, bags: Iterable[Path] = (), **files: Path | None
) -> list[Input]:
    """Return all files a verb reads: the robot's, recordings with their folders, others by name.

    `config` is a path where a recording tells the URDF.
    """
    found = [Input(f'the {name}', path) for name, path in files.items() if path is not None]
    if isinstance(config, Path):
        found.append(Input('the configuration', config))
    elif config is not None:
        found += [Input('the configuration', config.path), Input('the URDF', config.urdf_path)]
    return [*found, *(Input('the recording', path) for bag in bags for path in _parts(bag))]


def _parts(bag: Path) -> Iterator[Path]:
    """Yield a recording, the files it is made of, and the rosbag2 folder they are in."""
    from ugv_acceptance.bag.metadata import NAME, files_of

    yield bag
    try:
        files = files_of(bag).files
    except (AcceptanceError, OSError):  # reported when it is read
        return
    for file in files:
        yield file
        if (file.parent / NAME).is_file():
            yield file.parent


def check_outputs(
    outputs: Sequence[Output], inputs: Sequence[Input], *, overwrite: bool = False
) -> None:
    """Raise AcceptanceError with option, file and reason if an output must not be written."""
    from ugv_acceptance.bag.atomic_files import check_writable, is_stream

    earlier: list[tuple[str, Path]] = []
    for output in outputs:
        option, path, kind = output.option, output.path, output.kind
        if path is None:
            continue
        _check_no_input(option, path, inputs)
        fits = path.suffix.lower() in kind.endings or (is_stream(path) and not kind.by_ending)
        if not fits:
            raise _refused(option, path, f'expected {_ending(output, outputs)}')
        twice = next((other for other, seen in earlier if same(path, seen)), None)
        # Two may go to one pipe: it keeps nothing that could be lost.
        if twice is not None and (not is_stream(path) or path.is_file()):
            raise _refused(
                option, path, f'expected a different file, this one is also the output of {twice}'
            )
        earlier.append((option, path))
        try:
            check_writable(path)
        except AcceptanceError as error:
            raise AcceptanceError(f'{option} {error}') from None
        if not (overwrite or is_stream(path) or _is_empty(path) or _is_ours(path, kind)):
            text = f'it exists {kind.else_it_is}; only --overwrite replaces it'
            raise _refused(option, path, text)


def check_folder(
    option: str,
    path: Path,
    kind: 'FolderKind',
    inputs: Sequence[Input],
    *,
    overwrite: bool = False,
) -> None:
    """Raise AcceptanceError if a folder must not be made or written into."""
    _check_no_input(option, path, inputs)
    for item in inputs:
        inside = _real(item.path)
        if _real(path) in inside.parents:
            name = inside.relative_to(_real(path)).as_posix()
            if any(fnmatch(name, pattern) for pattern in kind.files):
                text = f'expected a folder without inputs, got {item.what} {name} in it'
                raise _refused(option, path, text)
    there = next(p for p in (_real(path), *_real(path).parents) if p.exists())
    if not there.is_dir():
        raise _refused(option, path, f'cannot be written: {there} is not a folder')
    if not os.access(there, os.W_OK):
        raise _refused(option, path, f'cannot be written: no permission in {there}')
    if not path.is_dir() or not any(path.iterdir()) or _is_ours(path, kind):
        return
    if not kind.may_fill:
        raise _refused(option, path, 'expected a new or empty folder, it is not empty')
    if not overwrite:
        text = f'it is not empty and is not a {kind.what}; only --overwrite adds to it'
        raise _refused(option, path, text)


def same(one: Path, other: Path) -> bool:
    """Return whether two paths are the same file: by name, symbolic link or hard link."""
    try:
        return _real(one) == _real(other) or one.samefile(other)
    except OSError:
        return False


def _check_no_input(option: str, path: Path, inputs: Sequence[Input]) -> None:
    for item in inputs:
        if same(path, item.path):
            raise _refused(option, path, f'expected a new place, got {item.what} itself')
    for item in inputs:
        if item.path.is_dir() and _real(item.path) in _real(path).parents:
            text = f'expected a place outside the folder of {item.what}, {item.path}'
            raise _refused(option, path, text)


def _ending(output: Output, outputs: Sequence[Output]) -> str:
    """Return the endings that fit, and the option for which the given one would fit, as text."""
    path, endings = output.path or Path(), output.kind.endings
    told = ', '.join(endings[:-1]) + ' or ' * (len(endings) > 1) + endings[-1]
    others = (o for o in outputs if path.suffix.lower() in o.kind.endings)
    other = next((f'; for {o.kind.format} use {o.option}' for o in others), '')
    return f'{told}{other}'


def _is_empty(path: Path) -> bool:
    """Return whether nothing can be lost: there is no file, or an empty one."""
    return not path.exists() or not path.stat().st_size


def _is_ours(path: Path, kind: 'Kind | FolderKind') -> bool:
    """Return whether this program wrote what is there, as this kind; False if it cannot be read."""
    try:
        return kind.ours(path)
    except OSError:
        return False


def _real(path: Path) -> Path:
    return Path(os.path.realpath(path))


def _refused(option: str, path: Path, text: str) -> AcceptanceError:
    return AcceptanceError(f'{option} {path}: {text}')
