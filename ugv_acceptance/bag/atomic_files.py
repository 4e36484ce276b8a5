"""What an evaluation writes, whole or not at all: the result as JSON, the margins as CSV."""

import io
import json
import os
import re
import secrets
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from math import isfinite
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, TextIO

import numpy as np

from ugv_acceptance import AcceptanceError
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.stability import SIDES, STATES

# Units of columns, of a joint that turns and of one that slides.
POSITION, TORQUE = ('rad', 'm'), ('nm', 'n')
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


class CsvSink:
    """Takes margins and writes one line a message; without a path it does nothing.

    Angles in degrees, all else in SI; unknown margins are empty fields.
    """

    def __init__(self, path: Path | None, settings: Settings, start: int) -> None:
        self._path = path
        self._settings = settings
        self._start = start
        self._file: TextIO | None = None
        self._stack = ExitStack()

    def __enter__(self) -> 'CsvSink':  # noqa: PYI034 - Self is Python 3.11
        """Open the file under a name that says it is not whole."""
        if self._path is not None:
            binary = self._stack.enter_context(whole(self._path))
            self._file = io.TextIOWrapper(binary, encoding='utf-8', newline='\n')
            self._file.write(','.join(self._header()) + '\n')
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Give the file its name if it is whole."""
        if self._file is not None and kind is None:
            self._stack.callback(self._told, self._file.flush)
        self._stack.__exit__(kind, error, trace)

    @property
    def sinks(self) -> list[Callable[[MarginRows], None]]:
        """Return the sink, if there is a file to write."""
        return [] if self._file is None else [self._write]

    def _header(self) -> list[str]:
        robot = self._settings.robot
        return [
            'time_s',
            'stamp_ns',
            'state',
            *joint_columns(robot, 'position', POSITION),
            *joint_columns(robot, 'static_torque', TORQUE),
            *joint_columns(robot, 'torque_margin', TORQUE),
            *(f'{side}_angle_deg' for side in SIDES),
            *(f'{side}_moment_nm' for side in SIDES),
            *(f'{side}_energy_j' for side in SIDES),
            'zmp_m',
        ]

    def _write(self, rows: MarginRows) -> None:
        limits = np.array(self._settings.limits.torque)
        table = np.column_stack(
            (
                rows.q,
                rows.torque,
                limits - np.abs(rows.torque),
                np.degrees(rows.angle),
                rows.moment,
                rows.energy,
                rows.zmp,
            )
        )
        times = (rows.time - self._start) / 1e9
        states = [STATES[s] for s in rows.state.tolist()]
        lines = zip(times.tolist(), rows.stamp.tolist(), states, table.tolist(), strict=True)
        file = self._file
        if file is not None:
            text = (
                f'{time:.9f},{stamp},{state},{",".join(map(_cell, numbers))}\n'
                for time, stamp, state, numbers in lines
            )
            self._told(lambda: file.writelines(text))

    def _told(self, write: Callable[[], None]) -> None:
        """Write; of a disk that is full say which file was to be written."""
        try:
            write()
        except OSError as error:
            raise unwritable(self._path or Path(), error.strerror) from None


def joint_columns(robot: Robot, what: str, units: tuple[str, str]) -> list[str]:
    """Return the name of a column for each joint, with the unit of one that turns or slides."""
    turns, slides = units
    return [
        f'{name}_{what}_{slides if robot.joint(name).kind == "prismatic" else turns}'
        for name in robot.joint_names
    ]


def _cell(number: Any) -> str:  # noqa: ANN401 - a float
    return repr(number) if isfinite(number) else ''
