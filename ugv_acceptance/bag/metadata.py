"""Reads the metadata.yaml of a rosbag2 folder (any version) and finds the folder's files."""

import os
import posixpath
import re
import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from ugv_acceptance import BadBag

NAME = 'metadata.yaml'
_MAX_BYTES = 64 << 20
SUFFIXES = ('.mcap', '.mcap.zstd', '.db3', '.db3.zstd', '.bag')
_PACKED = '.zstd'
# Depth of folders that is searched for runs, and number of runs named in an error.
_DEEP, _NAMED = 3, 3
_ODD = (yaml.YAMLError, KeyError, TypeError, ValueError, AttributeError, RecursionError)
# The key of the topics, followed by the first of them; of a topic, a plain name and count.
_TOPICS = re.compile(r'^(?P<key> +)topics_with_message_count:\n(?=(?P<item> +)- )', re.MULTILINE)
_NAME = re.compile(r'name: (/[A-Za-z0-9_/]+)\n')
_COUNT = re.compile(r'message_count: (0|[1-9][0-9]{0,17})\n')
_Loader: Any = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)


@dataclass(frozen=True, slots=True)
class Metadata:
    """The content of metadata.yaml: files in order, number of messages in all and by topic.

    None where it does not say.
    """

    files: tuple[str, ...] = ()
    message_count: int | None = None
    counts: dict[str, int] | None = None


def read_metadata(folder: Path) -> Metadata:
    """Read the metadata.yaml of a rosbag2 folder; BadBag if it cannot be parsed."""
    path = folder / NAME
    if path.stat().st_size > _MAX_BYTES:
        raise BadBag(f'{path}: {path.stat().st_size} bytes are too many for {NAME}')
    content = path.read_bytes()
    try:
        return _alike(content) or _metadata(content)
    except (yaml.YAMLError, KeyError, TypeError, ValueError, AttributeError) as error:
        text = ' '.join(str(error).split())
        raise BadBag(f'{path}: not the metadata of a rosbag2 folder ({text})') from error
    except RecursionError as error:
        raise BadBag(f'{path}: nested too deeply') from error


def _metadata(content: bytes) -> Metadata:
    info = yaml.load(content, Loader=_Loader)['rosbag2_bagfile_information']  # noqa: S506 (safe)
    files = tuple(str(name) for name in info.get('relative_file_paths') or ())
    topics = _counts(info.get('topics_with_message_count') or ())
    return Metadata(files, int(info['message_count']), topics)


def _counts(topics: Iterable[Any]) -> dict[str, int]:
    return {str(t['topic_metadata']['name']): int(t['message_count']) for t in topics}


def _alike(content: bytes) -> Metadata | None:
    """Read the metadata of many topics, most of which differ from another only in name and count.

    Of those alike only one is parsed as YAML, which takes nearly all the time. None where the text
    is not as rosbag2 writes it, or not valid: then it has to be parsed as a whole.
    """
    text = content.decode('ascii', 'replace')
    start = _TOPICS.search(text)
    once = text.count('topics_with_message_count') == 1 and content.isascii()
    if not start or not once or start['key'] > start['item']:
        return None
    item = start['item']
    end = re.compile(rf'^(?!{item}[- ] )', re.MULTILINE).search(text, start.end())
    stop = end.start() if end else len(text)
    counts: dict[str, int] = {}
    parsed = set[str]()
    try:
        for topic in re.split(rf'^(?={item}- )', text[start.end() : stop], flags=re.MULTILINE)[1:]:
            one, alike = _plain(topic)
            if alike not in parsed and _counts(yaml.load(topic, Loader=_Loader)) != one:  # noqa: S506 (safe)
                return None
            parsed.add(alike)
            counts |= one
        rest = _metadata((text[: start.end()] + text[stop:]).encode())
    except _ODD:
        return None
    return replace(rest, counts=counts) if rest.counts == {} else None


def _plain(topic: str) -> tuple[dict[str, int], str]:
    """Return name and count of a topic's YAML, and the text without them; ValueError if unusual."""
    (name,), (count,) = _NAME.findall(topic), _COUNT.findall(topic)
    if topic.count('name:') != 1 or topic.count('message_count:') != 1:
        raise ValueError(topic)
    alike = topic.replace(f'name: {name}\n', 'name:\n').replace(f'count: {count}\n', 'count:\n')
    return {name: int(count)}, alike


@dataclass(frozen=True, slots=True)
class Found:
    """The files of a recording in order, its metadata, and sentences about what is odd with them.

    `missing` are sentences about files that metadata.yaml lists and that are not there. `listed`
    says whether it names the files that are read.
    """

    files: list[Path]
    metadata: Metadata = field(default_factory=Metadata)
    findings: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    listed: bool = False


def files_of(path: Path) -> Found:
    """Return the files of a recording; BadBag without files.

    `path` is a file or a rosbag2 folder; a folder with several recordings is refused.
    """
    if not path.exists():
        raise BadBag(f'{path}: no such file or folder')
    if path.is_file():
        return Found([path])
    present = sorted(p for p in path.iterdir() if p.is_file() and p.name.lower().endswith(SUFFIXES))
    findings: list[str] = []
    metadata = Metadata()
    if (path / NAME).is_file():
        try:
            metadata = read_metadata(path)
        except BadBag as error:
            findings.append(f'{error}: not used')
    else:
        findings.append(f'{path.name}: no {NAME}')
    listed, told, missing = _listed(path, metadata.files, present)
    findings += told
    files = listed or present
    several = not listed and len(numbered([p.name for p in files])) > 1
    if several and (path / NAME).is_file():
        held = ', '.join(p.name for p in files)
        expected = f'expected the files that {NAME} lists'
        raise BadBag(f'{path}: {expected}, found others: {held}; give one of them')
    if several or not files:
        _refuse_several(path)
    if not files:
        wanted = ', '.join(SUFFIXES)
        raise BadBag(f'{path}: expected a rosbag2 folder, found no {wanted} file in it')
    return Found(files, metadata, findings, missing, bool(listed))


def part_of(name: str) -> tuple[str, int] | None:
    """Return stem and number of a file's name where it may be a part: run_3.mcap is 3 of run."""
    stem, _, number = name.partition('.')[0].rpartition('_')
    return (stem, int(number)) if stem and number.isdecimal() else None


def numbered(files: Sequence[str]) -> list[list[str]]:
    """Group files into recordings: names that differ only in _NUMBER are parts of one."""
    groups: dict[str, list[tuple[int, str]]] = {}
    for file in files:
        part = part_of(posixpath.basename(file))
        key, number = (f'{part[0]}/', part[1]) if part else (file, 0)
        groups.setdefault(key, []).append((number, file))
    return [[file for _, file in sorted(group)] for group in groups.values()]


def runs_in(folder: Path) -> list[Path]:
    """Return the recordings in a folder and below: rosbag2 folders, else each one's first file."""
    found: list[Path] = []
    for place, folders, names in os.walk(folder):
        here = Path(place)
        if len(here.relative_to(folder).parts) >= _DEEP:
            folders.clear()
        files = sorted(name for name in names if name.lower().endswith(SUFFIXES))
        if files and NAME in names:
            found.append(here)
        else:
            found += [here / run[0] for run in numbered(files)]
    return sorted(found)


def _refuse_several(folder: Path) -> None:
    """Raise BadBag if a folder holds recordings but is not one; it says how to judge them."""
    runs = runs_in(folder)
    if not runs:
        return
    if len(runs) == 1:
        run = shlex.quote(str(runs[0]))
        raise BadBag(
            f'{folder}: expected a recording, found one below it: `ugv-acceptance evaluate {run}`'
        )
    names = ', '.join(str(run.relative_to(folder)) for run in runs[:_NAMED])
    more = f' and {len(runs) - _NAMED} more' if len(runs) > _NAMED else ''
    few = ' '.join(shlex.quote(str(run)) for run in runs[:2])
    raise BadBag(
        f'{folder}: expected one recording, found {len(runs)} in it ({names}{more}): '
        f'`ugv-acceptance campaign {shlex.quote(str(folder))}` judges all of them, '
        f'`ugv-acceptance evaluate {few}` single ones'
    )


def _listed(
    folder: Path, names: Sequence[str], present: Sequence[Path]
) -> tuple[list[Path], list[str], list[str]]:
    """Return the files that metadata.yaml lists, findings, and what is missing, in sentences.

    No files means: use `present`.
    """
    files, findings, missing = [], [], []
    listed = {Path(name).name for name in names}
    for name in names:
        # Old versions prefix the folder's name; files outside the folder are never read.
        file = folder / Path(name).name
        packed = folder / f'{file.name}{_PACKED}'
        other = file.with_suffix('') if file.suffix == _PACKED else packed
        if file.is_file():
            files.append(file)
        elif other in present and other.name not in listed:
            files.append(other)
            findings.append(f'{NAME}: file {name!r} does not exist, {other.name} was read instead')
        else:
            missing.append(name)
    unlisted = ', '.join(p.name for p in present if p not in files)
    if missing and not files and unlisted:
        gone = ', '.join(map(repr, missing))
        return [], [f'{NAME} lists {gone}, which does not exist; {unlisted} was read instead'], []
    if names and unlisted:
        findings.append(f'{NAME} does not list {unlisted}: it was not read')
    return files, findings, [f'{NAME}: file {name!r} is missing' for name in missing]
