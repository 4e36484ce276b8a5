"""What an evaluation writes, whole or not at all: the result as JSON, the margins as CSV."""

import json
import os
from collections.abc import Callable
from math import isfinite
from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

import numpy as np

from ugv_acceptance import AcceptanceError
from ugv_acceptance.evaluation.rows import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.stability import SIDES, STATES

# Units of columns, of a joint that turns and of one that slides.
POSITION, TORQUE = ('rad', 'm'), ('nm', 'n')


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
    part = path.with_name(path.name + '.part')
    try:
        part.write_bytes(content)
        part.replace(path)
    except OSError as error:
        raise unwritable(path, error.strerror) from None


def unwritable(path: Path, why: str | None) -> AcceptanceError:
    """Return the error of a file that cannot be written."""
    return AcceptanceError(f'{path}: cannot be written: {why or "unknown reason"}')


def check_writable(path: Path | None) -> None:
    """Raise AcceptanceError where a result could not be written: better before than after."""
    if path is None:
        return
    if path.is_dir():
        raise unwritable(path, 'expected a file, it is a folder')
    if not path.parent.is_dir():
        raise unwritable(path, f'there is no folder {path.parent}')
    if not os.access(path.parent, os.W_OK):
        raise unwritable(path, f'no permission in {path.parent}')


class CsvSink:
    """Takes margins and writes one line a message; without a path it does nothing.

    Angles in degrees, all else in SI; unknown margins are empty fields.
    """

    def __init__(self, path: Path | None, settings: Settings, start: int) -> None:
        self._path = path
        self._settings = settings
        self._start = start
        self._file: TextIO | None = None

    def __enter__(self) -> 'CsvSink':  # noqa: PYI034 - Self is Python 3.11
        """Open the file under a name that says it is not whole."""
        if self._path is not None:
            try:
                self._file = self._path.with_name(self._path.name + '.part').open('w')
            except OSError as error:
                raise unwritable(self._path, error.strerror) from None
            self._file.write(','.join(self._header()) + '\n')
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Give the file its name if it is whole."""
        if self._file is None or self._path is None:
            return
        self._file.close()
        if kind is None:
            Path(self._file.name).replace(self._path)

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
        if self._file is not None:
            self._file.writelines(
                f'{time:.9f},{stamp},{state},{",".join(map(_cell, numbers))}\n'
                for time, stamp, state, numbers in lines
            )


def joint_columns(robot: Robot, what: str, units: tuple[str, str]) -> list[str]:
    """Return the name of a column for each joint, with the unit of one that turns or slides."""
    turns, slides = units
    return [
        f'{name}_{what}_{slides if robot.joint(name).kind == "prismatic" else turns}'
        for name in robot.joint_names
    ]


def _cell(number: Any) -> str:  # noqa: ANN401 - a float
    return repr(number) if isfinite(number) else ''
