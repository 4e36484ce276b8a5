"""What a rosbag2 folder's metadata.yaml says, of any version, and the files of a recording."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from ugv_acceptance import BadBag

NAME = 'metadata.yaml'
_MAX_BYTES = 64 << 20
_SUFFIXES = ('.mcap', '.mcap.zstd', '.db3', '.db3.zstd', '.bag')
_Loader: Any = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)


@dataclass(frozen=True, slots=True)
class Metadata:
    """Files in order, messages in all and a topic; None where metadata.yaml does not say."""

    files: tuple[str, ...] = ()
    message_count: int | None = None
    counts: dict[str, int] | None = None


def read_metadata(folder: Path) -> Metadata:
    """Metadata of a rosbag2 folder; BadBag where metadata.yaml cannot be understood."""
    path = folder / NAME
    if path.stat().st_size > _MAX_BYTES:
        raise BadBag(f'{path}: {path.stat().st_size} bytes are too many for {NAME}')
    try:
        data = yaml.load(path.read_bytes(), Loader=_Loader)  # noqa: S506 (a safe loader)
        info = data['rosbag2_bagfile_information']
        topics = {
            str(t['topic_metadata']['name']): int(t['message_count'])
            for t in info.get('topics_with_message_count') or ()
        }
        files = tuple(str(name) for name in info.get('relative_file_paths') or ())
        return Metadata(files, int(info['message_count']), topics)
    except (yaml.YAMLError, KeyError, TypeError, ValueError, AttributeError) as error:
        text = ' '.join(str(error).split())
        raise BadBag(f'{path}: not the metadata of a rosbag2 folder ({text})') from error
    except RecursionError as error:
        raise BadBag(f'{path}: nested too deeply') from error


def files_of(path: Path) -> tuple[list[Path], Metadata, list[str]]:
    """Files of a recording in order, its metadata, and findings; BadBag where there are none."""
    if not path.exists():
        raise BadBag(f'{path}: no such file or folder')
    if path.is_file():
        return [path], Metadata(), []
    present = sorted(
        p for p in path.iterdir() if p.is_file() and p.name.lower().endswith(_SUFFIXES)
    )
    findings: list[str] = []
    metadata = Metadata()
    if (path / NAME).is_file():
        try:
            metadata = read_metadata(path)
        except BadBag as error:
            findings.append(f'{error}: not used')
    else:
        findings.append(f'{path.name}: no {NAME}')
    files = []
    for name in metadata.files:
        # Old versions put the folder's own name in front; nothing outside the folder is a part.
        file = path / Path(name).name
        if file.is_file():
            files.append(file)
        else:
            findings.append(f'{NAME}: file {name!r} is missing')
    unlisted = [p for p in present if p not in files]
    if metadata.files and unlisted:
        findings.append(f'{NAME} does not list {", ".join(p.name for p in unlisted)}: not read')
    files = files or unlisted
    if not files:
        wanted = ', '.join(_SUFFIXES)
        raise BadBag(f'{path}: expected a rosbag2 folder, found no {wanted} file in it')
    return files, metadata, findings
