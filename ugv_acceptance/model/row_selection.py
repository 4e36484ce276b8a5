"""Selects and groups rows of nested tuples of arrays, such as the samples that share a polygon."""

from collections.abc import Iterator
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Rows: TypeAlias = slice | NDArray[np.intp]
# Floats, arrays of samples, or tuples of them.
Values: TypeAlias = Any

# All rows; selecting them copies nothing.
ALL = slice(None)
# Codes within a range this small are counted by bincount, which is faster than sorting.
_FEW = 4096


def pick(values: Values, rows: Rows) -> Values:
    """Return the given rows of nested tuples of floats and arrays; floats stay floats.

    An array that occurs twice is indexed once and stays one object.
    """
    if isinstance(rows, slice):
        return values
    return _picked(values, rows, {})


def _picked(x: Values, rows: NDArray[np.intp], done: dict[int, Values]) -> Values:
    """Return rows as `pick` does; `done` has what was picked of an array, by its id."""
    # Not inside `pick`: a nested function that calls itself is a cycle, which holds the arrays.
    if isinstance(x, tuple):
        return tuple([_picked(part, rows, done) for part in x])
    if not isinstance(x, np.ndarray):
        return x
    if id(x) not in done:
        done[id(x)] = x.take(rows, axis=0)  # faster than x[rows]
    return done[id(x)]


def blank(values: NDArray[np.float64], rows: NDArray[np.bool_]) -> None:
    """Make some rows of values (..., n) unknown, in place."""
    if rows.any():
        values[..., rows] = np.nan


def groups(codes: NDArray[np.integer[Any]]) -> Iterator[tuple[int, Rows, int]]:
    """Yield each distinct value of `codes` with its rows and their count."""
    if not codes.size:
        return
    low, high = int(codes.min()), int(codes.max())
    if low == high:
        yield low, ALL, codes.size
        return
    if high - low < _FEW:
        values = low + np.flatnonzero(np.bincount(codes - low))
    else:
        values = np.unique(codes)
    for code in values:
        rows = np.flatnonzero(codes == code)
        yield int(code), rows, rows.size


def inner(rows: Rows, part: Rows) -> Rows:
    """Return rows[part]: a selection within a selection, as rows of the whole."""
    if isinstance(part, slice):
        return rows
    return part if isinstance(rows, slice) else rows[part]
