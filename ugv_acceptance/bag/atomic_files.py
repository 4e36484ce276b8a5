"""Files written whole or not at all, under a name of their own until they are."""

import json
import os
import re
import secrets
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from ugv_acceptance import AcceptanceError

# Names of files that this process holds open: 1 and 2, or those a shell made for us, as in >(gzip).
_OPEN = re.compile(r'/dev/(?:(stdout)|(stderr)|fd/(\d+))|/proc/self/fd/(\d+)')


def write_json(path: Path, result: object) -> None:
    """Write a result; a reader never meets half of it."""
    write_text(path, json_text(result))


def json_text(result: object) -> str:
    """Return a result as JSON for people and programs."""
    return json.dumps(result, indent=2, allow_nan=False, default=str) + '\n'


def write_text(path: Path, text: str) -> None:
    """Write a text as UTF-8; names of a recording may hold what UTF-8 cannot."""
    write_bytes(path, text.encode('utf-8', 'replace'))


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all."""
    try:
        with whole(path) as file:
            file.write(content)
    except OSError as error:
        raise unwritable(path, error.strerror) from None


@contextmanager
def whole(path: Path) -> Iterator[BinaryIO]:
    """Give a file to write that has its name only once it is whole; an older one stays till then.

    Links are followed. A device or a pipe (`is_stream`) is written as it is. AcceptanceError where
    the file cannot be made or named; errors of the block are not changed.
    """
    part: Path | None = None
    try:
        if is_stream(path):
            file = _stream(path)
        else:
            # A name of its own: whatever lies beside the file is somebody else's.
            path = Path(os.path.realpath(path))
            part = path.with_name(f'.{secrets.token_hex(8)}.part')
            file = part.open('xb')
    except OSError as error:
        raise unwritable(path, error.strerror) from None
    try:
        yield file
        try:
            file.close()
            if part is not None:
                part.replace(path)
        except OSError as error:
            raise unwritable(path, error.strerror) from None
    finally:
        with suppress(OSError):
            file.close()
        if part is not None:
            with suppress(OSError):
                part.unlink(missing_ok=True)


def is_stream(path: Path) -> bool:
    """Return whether a path is a device, a pipe or a socket, or names one of our own open files."""
    if _OPEN.fullmatch(str(path)):
        return True
    return os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path)  # noqa: PTH110, PTH112, PTH113 - these raise nothing


def _stream(path: Path) -> BinaryIO:
    found = _OPEN.fullmatch(str(path))
    if found is None:
        return path.open('wb')
    sys.stdout.flush()
    number = 1 if found[1] else 2 if found[2] else int(found[3] or found[4])
    return os.fdopen(os.dup(number), 'wb')


def unwritable(path: Path, why: str | None) -> AcceptanceError:
    """Return the error of a file that cannot be written."""
    return AcceptanceError(f'{path}: cannot be written: {why or "unknown reason"}')


def check_writable(path: Path | None) -> None:
    """Raise AcceptanceError where a result could not be written: better before than after."""
    if path is None or is_stream(path):
        return
    if os.path.isdir(path):  # noqa: PTH112 - it raises nothing
        raise unwritable(path, 'expected a file, it is a folder')
    linked = os.path.islink(path)  # noqa: PTH114 - it raises nothing
    folder = Path(os.path.realpath(path)).parent if linked else path.parent
    if not folder.is_dir():
        raise unwritable(path, f'there is no folder {folder}')
    try:
        path.lstat()
    except FileNotFoundError:
        pass
    except OSError as error:
        raise unwritable(path, error.strerror) from None
    if not os.access(folder, os.W_OK):
        raise unwritable(path, f'no permission in {folder}')
