"""Rows of columns as CSV text, many at a time, each number as Python's `repr` writes it.

`repr` of a float takes half a microsecond, so that a table would cost many times its evaluation.
JSON written by pydantic has the same digits ten times as fast: the fewest that read back as the
same float, the nearest of them. It differs only where one of the two writes an exponent.
"""

import csv
import io
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from pydantic_core import to_json

from ugv_acceptance.type_aliases import Floats, Times

# Sizes of floats that both write without an exponent.
_LEAST, _MOST = 1e-4, 1e16
# Rows made text at a time: their objects stay in the processor's cache.
_ROWS = 2048


def header_line(names: Sequence[str]) -> bytes:
    """Return the line of column names; one with a comma, quote or line break is quoted."""
    text = io.StringIO()
    csv.writer(text, lineterminator='\n').writerow(names)
    return text.getvalue().encode()


def csv_lines(columns: Mapping[str, Floats | Times | NDArray[np.str_]]) -> bytes:
    """Return columns (n,) as n lines; what is not a finite number is an empty field.

    `time_s` has nine decimals, all other floats have as many digits as tell them from any other.
    Texts are names without quotes, commas or characters that JSON escapes.
    """
    count = len(next(iter(columns.values())))
    parts = []
    for start in range(0, count, _ROWS):
        rows = slice(start, start + _ROWS)
        cells = np.empty((len(range(count)[rows]), len(columns)), object)
        for k, (name, column) in enumerate(columns.items()):
            part = column[rows]
            cells[:, k] = [f'{t:.9f}' for t in part.tolist()] if name == 'time_s' else _cells(part)
        text = to_json(cells.tolist())
        parts.append(text[2:-2].replace(b'],[', b'\n').replace(b'"', b'') + b'\n')
    return b''.join(parts)


def _cells(column: Floats | Times | NDArray[np.str_]) -> NDArray[np.object_]:
    """Return values that JSON writes as a CSV field has them: numbers, else texts."""
    cells = column.astype(object)
    if column.dtype.kind != 'f':
        return cells
    size = np.abs(column)
    alike = ((size >= _LEAST) & (size < _MOST)) | (size == 0.0)
    if not alike.all():
        finite = np.isfinite(column)
        cells[~finite] = ''
        odd = finite & ~alike
        cells[odd] = [repr(number) for number in column[odd].tolist()]
    return cells
