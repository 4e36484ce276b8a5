"""Moments at which the margins of a recording became unknown, among the rows that are known."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.type_aliases import Times


@dataclass(frozen=True, slots=True)
class Lost:
    """When margins became unknown: `time` (k,) in ns, and before which known row, `place` (k,)."""

    place: NDArray[np.intp]
    time: Times


def with_lost(values: NDArray[Any], lost: Lost, inserted: Times | float = -np.inf) -> NDArray[Any]:
    """Return values of known rows with one inserted wherever margins became unknown."""
    return np.insert(values, lost.place, inserted) if len(lost.place) else values


def lost_in(rows: MarginRows, before: int | None) -> tuple[Lost, int | None]:
    """Return when margins that were known became unknown, and until when (ns) the last are known.

    `before` is the latter of the rows before; None: they were unknown.
    """
    if not len(rows.time):
        return Lost(np.empty(0, np.intp), rows.time), before
    known, until = rows.known, rows.until
    ends = np.flatnonzero(known[:-1] & (~known[1:] | (until[:-1] < rows.time[1:])))
    place = np.cumsum(known, dtype=np.intp)[ends]
    time = until[ends]
    if before is not None and (rows.time[0] > before or not known[0]):
        first = min(before, int(rows.time[0]))
        place, time = np.append(0, place), np.append(first, time)
    return Lost(place, time), int(until[-1]) if known[-1] else None
