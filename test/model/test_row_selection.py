"""Rows of nested tuples of arrays."""

import gc
import weakref

import numpy as np

from ugv_acceptance.model.row_selection import pick


def test_what_was_picked_is_gone_when_nobody_holds_it() -> None:
    """At once, not when the garbage collector comes by: memory must not hang on that."""
    rows = np.array([2, 0])
    gc.disable()
    try:
        picked = pick((np.arange(3.0), (1.5, np.ones(3))), rows)
        arrays = [weakref.ref(array) for array in (picked[0], picked[1][1], rows)]
        del picked, rows
        assert [array() for array in arrays] == [None, None, None]
    finally:
        gc.enable()


def test_rows_are_picked_once_from_an_array_that_occurs_twice() -> None:
    """It stays one object; floats stay floats."""
    twice = np.array([1.0, 2.0, 3.0])
    first, (number, second) = pick((twice, (4.0, twice)), np.array([2, 0]))
    assert first is second
    assert first.tolist() == [3.0, 1.0]
    assert number == 4.0
