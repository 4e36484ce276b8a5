"""Finds the runs of a campaign: folders, files and URLs, sorted into recordings.

A rosbag2 folder is one recording; elsewhere files of one folder that differ only in their number
are. URLs are those fsspec knows (file, s3, gs, sftp, http, ...): it is imported for them only.
"""

import os
import posixpath
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ugv_acceptance import AcceptanceError, BadBag, pip_install
from ugv_acceptance.bag.foreign import LEFT_BESIDE
from ugv_acceptance.bag.metadata import NAME as METADATA
from ugv_acceptance.bag.metadata import SUFFIXES, numbered, part_of
from ugv_acceptance.campaign.marks import listed_mark, local_mark
from ugv_acceptance.campaign.not_judged import words


@dataclass(frozen=True, slots=True, order=True)
class Source:
    """One recording: its name (path or URL as found), its files, and whether fsspec fetches them.

    The files of a rosbag2 folder include metadata.yaml. `marks` tell, for each file, whether it
    changes (`marks.py`) or what a killed recorder left beside it, '' where nothing tells that; ()
    if nobody looked.
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
            marked = [
                replace(s, marks=tuple(_listed_with_beside(marks, file) for file in s.files))
                for s in sources
            ]
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
    return tuple(
        _joined(
            local_mark(file, now_ns),
            {
                end: local_mark(file + end, now_ns)
                for end in _beside(file)
                if os.path.lexists(file + end)
            },
        )
        for file in source.files
    )


def _looked_up(url: str, now_ns: int) -> str:
    system, path = _opened(url)
    system.invalidate_cache(path)
    ends = [end for end in _beside(url) if system.exists(path + end)]
    left = {end: listed_mark(system.info(path + end), now_ns) for end in ends}
    return _joined(listed_mark(system.info(path), now_ns), left)


def _listed_with_beside(marks: Mapping[str, str], url: str) -> str:
    """Return the mark of a listed file, with those of what a killed recorder left beside it."""
    left = {end: marks[url + end] for end in _beside(url) if url + end in marks}
    return _joined(marks[url], left)


def _joined(mark: str, left: Mapping[str, str]) -> str:
    """Return a file's mark with those of what is `left` beside it, by the ends of their names."""
    if not all((mark, *left.values())):
        return ''
    return ' '.join([mark, *(f'{end} {other}' for end, other in left.items())])


def _beside(file: str) -> Iterable[str]:
    """Return by the ends of their names what a killed recorder may leave beside a file."""
    return LEFT_BESIDE if file.lower().endswith('.db3') else ()


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
        if system.isfile(path):
            beside = (path + end for end in _beside(path))
            files = [path, *(file for file in beside if system.exists(file))]
            listed = {file: system.info(file) for file in files}
        else:
            listed = system.find(path, detail=True)
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
    # Named as where the files are: the name of a folder tells whether one file is a part.
    run = folder / (posixpath.basename(posixpath.dirname(source.files[0])) or 'run')
    run.mkdir()
    copies = []
    for url in source.files:
        system, path = _opened(url)
        copy = run / posixpath.basename(url)
        try:
            system.get_file(path, str(copy))
            for end in _beside(url):  # a part of the recording is in that
                if system.exists(path + end):
                    system.get_file(path + end, f'{copy}{end}')
        except FileNotFoundError as error:
            if run.is_dir():
                raise BadBag(f'{url}: cannot be read ({words(error)})') from None
            raise AcceptanceError(f'{url}: cannot be copied ({words(error)})') from None
        except Exception as error:  # noqa: BLE001 - every protocol has its own errors
            raise AcceptanceError(f'{url}: cannot be fetched ({words(error)})') from None
        copies.append(copy)
    return copies


def _openable(source: Source, files: list[Path]) -> Path | list[Path]:
    folder = files[0].parent
    whole = source.files[-1].endswith(f'/{METADATA}')
    return folder if whole or _is_left_over(files) else files


def _is_left_over(files: Sequence[Path]) -> bool:
    """Return whether a file may be the only part of a recording that is left in its folder."""
    part, folder = part_of(files[0].name), files[0].parent
    if len(files) > 1 or part is None or part[0] != folder.name:
        return False
    return sum(path.name.lower().endswith(SUFFIXES) for path in folder.iterdir()) == 1
