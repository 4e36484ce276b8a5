"""Numbers in what a client sent: checked, never trusted."""

import sys
from collections.abc import Mapping

from ugv_acceptance import BadSample


def number_in(values: Mapping[str, object], name: str) -> float:
    """Return a finite number of a command. Raises BadSample where there is none."""
    value = values.get(name)
    # JSON's whole numbers have no end, floats have.
    most = sys.float_info.max
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= most:
        raise BadSample(f'{name}: expected a finite number, got {value!r:.60}')
    return float(value)
