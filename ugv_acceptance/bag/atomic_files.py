"""Writes files completely or not at all, by way of a temporary file that is renamed."""

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
    """Write a result as JSON, completely or not at all; AcceptanceError if it cannot be written."""
    write_text(path, json_text(result))


def json_text(result: object) -> str:
    """Return a result as indented JSON text; ValueError for NaN or infinity."""
    return json.dumps(result, indent=2, allow_nan=False, default=str) + '\n'


def write_text(path: Path, text: str) -> None:
    """Write a text as UTF-8, completely or not at all; unencodable characters become '?'."""
    write_bytes(path, text.encode('utf-8', 'replace'))


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all."""
    with naming(path), whole(path) as file:
        file.write(content)


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Say of an OSError of the block, such as a full disk, what was to be written."""
    try:
        yield
    except OSError as error:
        raise unwritable(path, error.strerror) from None


@contextmanager
def whole(path: Path) -> Iterator[BinaryIO]:
    """Yield a temporary file that is renamed to `path` when the block ends without an error.

    Until then an older file stays as it is. Links are followed. A device or a pipe (`is_stream`) is
    written directly. Raises AcceptanceError if the file cannot be created or renamed; errors of the
    block pass unchanged.
    """
    part: Path | None = None
    try:
        if is_stream(path):
            file = _stream(path)
        else:
            # A random name, so that no other file in the folder is overwritten.
            path = Path(os.path.realpath(path))
            part = path.with_name(f'.{secrets.token_hex(8)}.part')
            file = part.open('xb')
    except OSError as error:
        raise unwritable(path, error.strerror) from None
    try:
        yield file
        with naming(path):
            file.close()
            if part is not None:
                part.replace(path)
    finally:
        with suppress(OSError):
            file.close()
        if part is not None:
            with suppress(OSError):
                part.unlink(missing_ok=True)


def is_stream(path: Path) -> bool:
    """Return whether a path is a device, pipe or socket, or names one of our own open files."""
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
    """Return the AcceptanceError for a file that cannot be written, and why."""
    return AcceptanceError(f'{path}: cannot be written: {why or "unknown reason"}')


def check_writable(path: Path | None) -> None:
    """Raise AcceptanceError if a file could not be written, to be called before long work."""
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
