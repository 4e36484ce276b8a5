"""Names of types that stand in many signatures: arrays of numbers and times, and plain JSON."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

# Numbers in SI units and radians; the shape stands where one is used.
Floats = NDArray[np.float64]
# Moments in ns: of receipt, of the log, of a header's stamp.
Times = NDArray[np.int64]
# What json.dumps takes.
Json = dict[str, Any]
