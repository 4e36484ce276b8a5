"""Numbers in what a client sent: checked, never trusted."""

import math
from collections.abc import Mapping

from ugv_acceptance import BadSample


def number_in(values: Mapping[str, object], name: str) -> float:
    """Return a finite number of a command. Raises BadSample where there is none."""
    value = values.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise BadSample(f'{name}: expected a finite number, got {value!r:.60}')
    return float(value)
