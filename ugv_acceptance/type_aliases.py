"""Types that many signatures share: arrays of floats, arrays of times in ns, and JSON objects."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

# Numbers in SI units and radians; each use says the shape.
Floats = NDArray[np.float64]
# Times in ns: of receipt, of logging, or of a header's stamp.
Times = NDArray[np.int64]
# A JSON object, as json.dumps accepts it.
Json = dict[str, Any]
