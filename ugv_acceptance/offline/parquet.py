"""The margins over time as a Parquet file, stretch by stretch; PyArrow is an extra."""

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from ugv_acceptance import AcceptanceError, pip_install
from ugv_acceptance.bag.atomic_files import POSITION, TORQUE, joint_columns, unwritable, whole
from ugv_acceptance.evaluation.margin_table import MarginRows
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
        self._stack = ExitStack()
        if path is not None:
            try:
                from pyarrow import parquet  # noqa: PLC0415 - an extra
            except ImportError as error:
                raise AcceptanceError(
                    f'no Parquet: expected PyArrow ({pip_install("table")}), got: {error}'
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
        if self._writer is not None:
            self._stack.callback(self._told, self._writer.close)
        self._stack.__exit__(kind, error, trace)

    @property
    def sinks(self) -> list[Callable[[MarginRows], None]]:
        """Return the sink, if there is a file to write."""
        return [] if self._path is None else [self._write]

    def _write(self, rows: MarginRows) -> None:
        # The first stretch, though it be empty, makes the file: no older one must stay.
        if not len(rows.time) and self._writer is not None:
            return
        table = self._arrow.table(self._columns(rows))
        if self._writer is None:
            file = self._stack.enter_context(whole(self._path or Path()))
            self._writer = self._parquet.ParquetWriter(file, table.schema)
        self._told(lambda: self._writer.write_table(table))

    def _told(self, write: Callable[[], None]) -> None:
        """Write; of a disk that is full say which file was to be written."""
        try:
            write()
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
