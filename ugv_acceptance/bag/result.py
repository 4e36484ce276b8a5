"""What an evaluation writes: the result as JSON, the margins over time as CSV. Whole or not at all."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

import numpy as np

from ugv_acceptance import AcceptanceError
from ugv_acceptance.evaluation.rows import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import SIDES, STATES


def write_json(path: Path, result: object) -> None:
    """Write a result; a reader never meets half of it."""
    part = path.with_name(path.name + '.part')
    try:
        part.write_text(json.dumps(result, indent=2, allow_nan=False, default=str) + '\n', 'utf-8')
        os.replace(part, path)
    except OSError as error:
        raise AcceptanceError(f'{path}: cannot be written: {error.strerror}') from None


class CsvSink:
    """Takes margins and writes one line a message; without a path it does nothing.

    Angles in degrees, all else in SI; unknown margins are empty fields.
    """

    def __init__(self, path: Path | None, settings: Settings, start: int) -> None:
        self._path = path
        self._settings = settings
        self._start = start
        self._file: TextIO | None = None

    def __enter__(self) -> 'CsvSink':
        """Open the file under a name that says it is not whole."""
        if self._path is not None:
            try:
                self._file = self._path.with_name(self._path.name + '.part').open('w')
            except OSError as error:
                raise AcceptanceError(
                    f'{self._path}: cannot be written: {error.strerror}'
                ) from None
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
            os.replace(self._file.name, self._path)

    @property
    def sinks(self) -> list[Callable[[MarginRows], None]]:
        """Return the sink, if there is a file to write."""
        return [] if self._file is None else [self._write]

    def _header(self) -> list[str]:
        names = self._settings.robot.joint_names
        return [
            'time_s',
            'stamp_ns',
            'state',
            *(f'{name}_position' for name in names),
            *(f'{name}_static_torque' for name in names),
            *(f'{name}_torque_margin' for name in names),
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
        states = ['unknown' if not k else STATES[s] for k, s in zip(rows.known, rows.state)]  # noqa: B905 - same rows
        lines = zip(times.tolist(), rows.stamp.tolist(), states, table.tolist(), strict=True)
        if self._file is not None:
            self._file.writelines(
                f'{time:.9f},{stamp},{state},{",".join(map(_cell, numbers))}\n'
                for time, stamp, state, numbers in lines
            )


def _cell(number: Any) -> str:  # noqa: ANN401 - a float
    return repr(number) if np.isfinite(number) else ''
