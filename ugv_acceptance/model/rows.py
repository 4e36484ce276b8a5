"""Rows of columns: samples that go together are picked, worked on and put back."""

from collections.abc import Iterator
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Rows: TypeAlias = slice | NDArray[np.intp]
# Floats, arrays of samples, or tuples of them.
Values: TypeAlias = Any

# All rows: nothing is picked, nothing copied.
ALL = slice(None)


def pick(values: Values, rows: Rows) -> Values:
    """Return the rows of nested tuples of floats and arrays; floats stay floats.

    What comes twice is picked once and stays one object.
    """
    if rows is ALL:
        return values
    picked: dict[int, Values] = {}

    def take(x: Values) -> Values:
        if isinstance(x, tuple):
            return tuple([take(part) for part in x])
        if not isinstance(x, np.ndarray):
            return x
        if id(x) not in picked:
            picked[id(x)] = x[rows]
        return picked[id(x)]

    return take(values)


def groups(codes: NDArray[Any]) -> Iterator[tuple[int, Rows, int]]:
    """Return each value of `codes` with its rows and their number."""
    if codes.size and codes.min() == codes.max():
        yield int(codes[0]), ALL, codes.size
        return
    for code in np.unique(codes):
        rows = np.flatnonzero(codes == code)
        yield int(code), rows, rows.size


def inner(rows: Rows, part: Rows) -> Rows:
    """Return the rows that are `part` of `rows`."""
    if isinstance(part, slice):
        return rows
    return part if isinstance(rows, slice) else rows[part]
