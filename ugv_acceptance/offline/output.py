"""Writes margins over time to files, part by part: CSV, and Parquet if PyArrow is installed."""

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

from ugv_acceptance import AcceptanceError, pip_install
from ugv_acceptance.bag.atomic_files import naming, whole
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.offline.csv_text import csv_lines, header_line
from ugv_acceptance.offline.margins import (
    NOT_IN_CSV,
    arrow_table,
    csv_columns,
    named_columns,
)


class CsvSink:
    """Writes margins to a CSV file, one line a message; without a path it does nothing.

    Angles in degrees, all else in SI; unknown margins are empty fields. A context manager: the file
    gets its name only if the block succeeds.
    """

    def __init__(self, path: Path | None, settings: Settings, start: int) -> None:
        self._path = path
        self._settings = settings
        self._start = start
        self._file: BinaryIO | None = None
        self._stack = ExitStack()

    def __enter__(self) -> 'CsvSink':  # noqa: PYI034 - Self is Python 3.11
        """Open a temporary file beside the path and write the header line."""
        if self._path is not None:
            file = self._file = self._stack.enter_context(whole(self._path))
            header = header_line(csv_columns(self._settings))
            _written(self._path, lambda: file.write(header))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Rename the temporary file to the path if the block succeeded, else delete it."""
        if self._file is not None and kind is None:
            self._stack.callback(_written, self._path, self._file.flush)
        self._stack.__exit__(kind, error, trace)

    @property
    def sinks(self) -> list[Callable[[MarginRows], None]]:
        """The function that writes margins, as a list; empty without a file to write."""
        return [] if self._file is None else [self._write]

    def _write(self, rows: MarginRows) -> None:
        file, columns = self._file, named_columns(rows, self._settings, self._start)
        if file is not None:
            wanted = {name: c for name, c in columns.items() if name not in NOT_IN_CSV}
            _written(self._path, lambda: file.write(csv_lines(wanted)))


class ParquetSink:
    """Writes margins to a Parquet file, one row a message; without a path it does nothing.

    The columns are those of the CSV and `log_time_ns`; unknown margins are nulls. A context manager
    as CsvSink. Raises AcceptanceError if PyArrow is not installed.
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
        """Open nothing yet: the columns are known only with the first margins."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Rename the temporary file to the path if the block succeeded, else delete it."""
        if self._writer is not None:
            self._stack.callback(_written, self._path, self._writer.close)
        self._stack.__exit__(kind, error, trace)

    @property
    def sinks(self) -> list[Callable[[MarginRows], None]]:
        """The function that writes margins, as a list; empty without a file to write."""
        return [] if self._path is None else [self._write]

    def _write(self, rows: MarginRows) -> None:
        # Even if it is empty the first part creates the file, so that no older one stays.
        if not len(rows.time) and self._writer is not None:
            return
        columns = named_columns(rows, self._settings, self._start)
        table = arrow_table(self._arrow, columns)
        if self._writer is None:
            file = self._stack.enter_context(whole(self._path or Path()))
            self._writer = self._parquet.ParquetWriter(file, table.schema)
        _written(self._path, lambda: self._writer.write_table(table))


def _written(path: Path | None, write: Callable[[], object]) -> None:
    with naming(path or Path()):
        write()
