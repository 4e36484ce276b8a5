"""Finds the runs of a campaign: folders, files and URLs, sorted into recordings.

A rosbag2 folder is one recording; elsewhere files of one folder that differ only in their number
are. URLs are those fsspec knows (file, s3, gs, sftp, http, ...): it is imported for them only.
"""

import os
import posixpath
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ugv_acceptance import AcceptanceError, BadBag, pip_install
from ugv_acceptance.bag.foreign import LEFT_BESIDE
from ugv_acceptance.bag.metadata import NAME as METADATA
from ugv_acceptance.bag.metadata import SUFFIXES, numbered
from ugv_acceptance.campaign.marks import listed_mark, local_mark
from ugv_acceptance.campaign.not_judged import words


@dataclass(frozen=True, slots=True, order=True)
class Source:
    """One recording: its name (path or URL as found), its files, and whether fsspec fetches them.

    The files of a rosbag2 folder include metadata.yaml. `marks` tell, for each file, whether it
    changes (`marks.py`), '' where nothing tells that; () if nobody looked.
    """

    name: str
    files: tuple[str, ...]
    remote: bool = False
    marks: tuple[str, ...] = field(default=(), compare=False)

    @property
    def marked(self) -> bool:
        """Whether every file has a mark."""
        return len(self.marks) == len(self.files) and all(self.marks)


def is_url(place: str) -> bool:
    """Return whether a place is a URL, not a path."""
    return '://' in place


def find_sources(places: Iterable[str]) -> list[Source]:
    """Return the recordings in folders, files and URLs, each once, sorted by name.

    Raises AcceptanceError where a place does not exist, cannot be listed, or holds no recording.
    """
    found: set[Source] = set()
    for place in places:
        now_ns = time.time_ns()
        if is_url(place):
            marks = _remote_files(place, now_ns)
            sources = sorted_out(list(marks), remote=True)
            marked = [replace(s, marks=tuple(marks[file] for file in s.files)) for s in sources]
        else:
            marked = [
                replace(source, marks=_local_marks(source, now_ns))
                for source in sorted_out(_local_files(place))
            ]
        if not marked:
            raise AcceptanceError(
                f'{place}: expected recordings ({", ".join(SUFFIXES)}), found none'
            )
        found.update(marked)
    return sorted(found)


def is_unchanged(source: Source) -> bool:
    """Return whether every file still is as it was when the source was found; False if unknown."""
    if not source.marked:
        return False
    now_ns = time.time_ns()
    if not source.remote:
        return _local_marks(source, now_ns) == source.marks
    try:
        return all(
            _looked_up(url, now_ns) == mark
            for url, mark in zip(source.files, source.marks, strict=True)
        )
    except Exception:  # noqa: BLE001 - every protocol has its own errors
        return False


def _local_marks(source: Source, now_ns: int) -> tuple[str, ...]:
    return tuple(local_mark(file, now_ns) for file in source.files)


def _looked_up(url: str, now_ns: int) -> str:
    system, path = _opened(url)
    system.invalidate_cache(path)
    return listed_mark(system.info(path), now_ns)


def sorted_out(files: Sequence[str], *, remote: bool = False) -> list[Source]:
    """Return the recordings that files make up; files that are no recording are left out."""
    folders: dict[str, list[str]] = {}
    for file in sorted(files):
        folders.setdefault(posixpath.dirname(file), []).append(file)
    sources = []
    for folder, members in folders.items():
        parts = [file for file in members if file.lower().endswith(SUFFIXES)]
        if parts and f'{folder}/{METADATA}' in members:
            sources.append(Source(folder, (*parts, f'{folder}/{METADATA}'), remote))
        else:
            sources += [Source(run[0], tuple(run), remote) for run in numbered(parts)]
    return sources


def _local_files(place: str) -> list[str]:
    if Path(place).is_file():
        return [place]
    if not Path(place).is_dir():
        raise AcceptanceError(f'{place}: expected a folder, a file or a URL, found nothing there')
    return [
        posixpath.join(folder, name)
        for folder, _, names in os.walk(place)
        for name in sorted(names)
    ]


def _remote_files(url: str, now_ns: int) -> dict[str, str]:
    """Return the mark of every file below a URL, from its listing alone: no request a file."""
    system, path = _opened(url)
    try:
        system.invalidate_cache()  # what this process listed before may have changed
        listed = (
            {path: system.info(path)} if system.isfile(path) else system.find(path, detail=True)
        )
    except Exception as error:  # noqa: BLE001 - every protocol has its own errors
        raise AcceptanceError(f'{url}: cannot be listed ({words(error)})') from None
    return {
        str(system.unstrip_protocol(file)): listed_mark(info, now_ns)
        for file, info in listed.items()
    }


def _opened(url: str) -> tuple[Any, str]:
    """Return the fsspec file system of a URL and the path in it."""
    try:
        import fsspec  # noqa: PLC0415 - an extra

        system, path = fsspec.core.url_to_fs(url)
    except ImportError as error:
        name = error.name or 'fsspec'
        raise AcceptanceError(
            f'{url}: expected {name} for this URL ({pip_install("cluster")})'
        ) from None
    except Exception as error:  # noqa: BLE001 - every protocol has its own errors
        raise AcceptanceError(f'{url}: expected a URL that fsspec knows ({words(error)})') from None
    return system, path


@contextmanager
def local_paths(source: Source) -> Iterator[Path | list[Path]]:
    """Give the paths that `open_bag` takes; remote files are copied to a temporary folder.

    Raises BadBag where a remote file does not exist; AcceptanceError where it cannot be fetched.
    """
    if not source.remote:
        yield _openable(source, [Path(file) for file in source.files])
        return
    with tempfile.TemporaryDirectory(prefix='campaign-') as folder:
        yield _openable(source, _copied(source, Path(folder)))


def _copied(source: Source, folder: Path) -> list[Path]:
    run = folder / posixpath.basename(source.name)
    run.mkdir()
    copies = []
    for url in source.files:
        system, path = _opened(url)
        copy = run / posixpath.basename(url)
        try:
            system.get_file(path, str(copy))
            if url.lower().endswith('.db3'):
                _copy_beside(system, path, copy)
        except FileNotFoundError as error:
            if run.is_dir():
                raise BadBag(f'{url}: cannot be read ({words(error)})') from None
            raise AcceptanceError(f'{url}: cannot be copied ({words(error)})') from None
        except Exception as error:  # noqa: BLE001 - every protocol has its own errors
            raise AcceptanceError(f'{url}: cannot be fetched ({words(error)})') from None
        copies.append(copy)
    return copies


def _copy_beside(system: Any, path: str, copy: Path) -> None:  # noqa: ANN401 - of fsspec
    """Fetch what a killed recorder left beside an SQLite file, as its end is in that."""
    for end in LEFT_BESIDE:
        if system.exists(path + end):
            system.get_file(path + end, f'{copy}{end}')


def _openable(source: Source, files: list[Path]) -> Path | list[Path]:
    return files[0].parent if source.files[-1].endswith(f'/{METADATA}') else files
