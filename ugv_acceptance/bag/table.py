"""The margins over time as a Parquet file, stretch by stretch; PyArrow is an extra."""

from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from ugv_acceptance import AcceptanceError
from ugv_acceptance.bag.result import POSITION, TORQUE, joint_columns, unwritable
from ugv_acceptance.evaluation.rows import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import SIDES, STATES


class ParquetSink:
    """Takes margins and writes one row a message; without a path it does nothing.

    SI and radians; unknown margins are nulls. Raises AcceptanceError where PyArrow is absent.
    """

    def __init__(self, path: Path | None, settings: Settings, start: int) -> None:
        self._path, self._settings, self._start = path, settings, start
        self._writer: Any = None
        self._arrow: Any = None
        if path is not None:
            try:
                from pyarrow import parquet  # noqa: PLC0415 - an extra
            except ImportError as error:
                raise AcceptanceError(
                    'no Parquet: expected PyArrow (pip install "ugv_acceptance[table]"), got: '
                    f'{error}'
                ) from None
            self._arrow, self._parquet = __import__('pyarrow'), parquet

    def __enter__(self) -> 'ParquetSink':  # noqa: PYI034 - Self is Python 3.11
        """Open nothing yet: the first stretch tells the columns."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Give the file its name if it is whole."""
        if self._writer is not None and self._path is not None:
            self._writer.close()
            if kind is None:
                self._part.replace(self._path)

    @property
    def sinks(self) -> list[Callable[[MarginRows], None]]:
        """Return the sink, if there is a file to write."""
        return [] if self._path is None else [self._write]

    @property
    def _part(self) -> Path:
        path = self._path or Path()
        return path.with_name(path.name + '.part')

    def _write(self, rows: MarginRows) -> None:
        # The first stretch, though it be empty, makes the file: no older one must stay.
        if not len(rows.time) and self._writer is not None:
            return
        table = self._arrow.table(self._columns(rows))
        try:
            if self._writer is None:
                self._writer = self._parquet.ParquetWriter(self._part, table.schema)
            self._writer.write_table(table)
        except OSError as error:
            raise unwritable(self._path or Path(), error.strerror) from None

    def _columns(self, rows: MarginRows) -> dict[str, Any]:
        robot, states = self._settings.robot, np.array(STATES)
        numbers = {
            **_named(rows.q, joint_columns(robot, 'position', POSITION)),
            **_named(rows.torque, joint_columns(robot, 'static_torque', TORQUE)),
            **_named(rows.angle, [f'{side}_angle_rad' for side in SIDES]),
            **_named(rows.moment, [f'{side}_moment_nm' for side in SIDES]),
            **_named(rows.energy, [f'{side}_energy_j' for side in SIDES]),
            'zmp_m': rows.zmp,
        }
        return {
            'time_s': (rows.time - self._start) / 1e9,
            'log_time_ns': rows.time,
            'stamp_ns': rows.stamp,
            'state': states[rows.state],
            **{k: self._arrow.array(v, mask=np.isnan(v)) for k, v in numbers.items()},
        }


def _named(table: Any, names: list[str]) -> dict[str, Any]:  # noqa: ANN401
    return {name: table[:, k] for k, name in enumerate(names)}
