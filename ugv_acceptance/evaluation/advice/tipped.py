"""Whether a robot has tipped over, and the one thing to say then.

Advice is worked out for a robot that stands on its contact points. Once gravity points far past an
edge of them it does not stand there any more: it is falling, or lies on its side, its back or its
arm. No motion of a joint, no turn and no load set down brings it back, the model knows nothing of
what it lies on, and an arm that moves may roll it further, on to somebody who comes to help.
"""

import math
from collections.abc import Iterable
from typing import SupportsFloat

# Tilt (rad) past tipping from which a robot has tipped. From rest at 20 deg past it, a robot whose
# centre of gravity is 0.3 m from the edge turns by 20 deg more in a quarter of a second, by 50 in
# 0.4 s: no arm is as fast. Up to there the numbers may be those of a robot that stands: one that
# sways comes back from a few degrees past, and an arm at full reach, with a load that was declared
# but is not carried, is 15 deg past on level ground.
TIPPED = math.radians(20.0)

# What to do about any alert of a robot that has tipped.
STAND_CLEAR = (
    'it has tipped: stand clear; do not move the arm; switch it off before anyone comes near'
)


def has_tipped(angle: Iterable[SupportsFloat]) -> bool:
    """Return whether a robot has tipped over, by the tilt left (rad) to each side.

    Infinite where no edge lies, NaN where nothing is known: neither counts.
    """
    return any(float(left) <= -TIPPED for left in angle)
