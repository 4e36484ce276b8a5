"""Names of new recordings, and which old ones of the same robot are deleted to make room."""

import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path

from ugv_acceptance import BadBag
from ugv_acceptance.bag.metadata import NAME

_TIME = r'_\d{8}T\d{6}Z(_\d+)?'


@dataclass(frozen=True, slots=True)
class Keep:
    """How many recordings of a robot stay, the present one included, or how many bytes of them."""

    count: int | None = None
    size: int | None = None


def new_folder(robot: str, now: int, place: Path = Path()) -> Path:
    """Return the folder of a new recording: the robot's name and the time (ns since the epoch)."""
    when = datetime.fromtimestamp(now // 1_000_000_000, timezone.utc)
    return unused(place / f'{_stem(robot)}_{when:%Y%m%dT%H%M%SZ}')


def unused(path: Path) -> Path:
    """Return a path that does not exist: the one given, or with a number behind it."""
    number, found = 1, path
    while found.exists():
        number += 1
        found = path.with_name(f'{path.name}_{number}')
    return found


def _stem(robot: str) -> str:
    return ''.join(c if c.isalnum() or c in '-.' else '_' for c in robot).lstrip('.') or 'robot'


def prune(robot: str, keep: Keep, present: Path) -> Sequence[Path]:
    """Delete the oldest recordings of a robot beside the `present` one; return which.

    Only folders with a name as `new_folder` gives it that hold nothing but a recording. BadBag
    where one cannot be deleted.
    """
    older = [path for path in _recordings(robot, present.parent) if path != present]
    gone = []
    while older and _too_much(keep, [*older, present]):
        try:
            shutil.rmtree(older[0])
        except OSError as error:
            raise BadBag(f'{older[0]}: cannot be deleted: {error.strerror}') from None
        gone.append(older.pop(0))
    return gone


def _too_much(keep: Keep, recordings: Sequence[Path]) -> bool:
    if keep.count is not None and len(recordings) > keep.count:
        return True
    return keep.size is not None and sum(map(_size, recordings)) > keep.size


def _recordings(robot: str, place: Path) -> list[Path]:
    """Return the recordings of a robot in a folder, the oldest first."""
    named = re.compile(re.escape(_stem(robot)) + _TIME)
    return sorted(p for p in place.iterdir() if named.fullmatch(p.name) and _is_recording(p))


def _is_recording(path: Path) -> bool:
    if path.is_symlink() or not path.is_dir():
        return False
    names = [file.name for file in path.iterdir()]
    return all(name == NAME or name.endswith('.mcap') for name in names)


def _size(path: Path) -> int:
    try:
        return sum(file.stat().st_size for file in path.iterdir())
    except OSError:  # it is being deleted by somebody else
        return 0
