"""Moments at which the margins of a recording became unknown, among the rows that are known."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.type_aliases import Times


@dataclass(frozen=True, slots=True)
class Lost:
    """When margins became unknown: `time` (k,) in ns, and before which known row, `place` (k,)."""

    place: NDArray[np.intp]
    time: Times


def with_lost(values: NDArray[Any], lost: Lost, inserted: Times | float = -np.inf) -> NDArray[Any]:
    """Return values of known rows with one inserted wherever margins became unknown."""
    return np.insert(values, lost.place, inserted) if len(lost.place) else values
