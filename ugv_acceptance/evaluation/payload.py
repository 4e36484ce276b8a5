"""What is carried: a declared payload, where it can be believed."""

import math
from collections.abc import Sequence

from ugv_acceptance.model.robot import Payload, Robot


def payload_from(robot: Robot, mass: float, com: Sequence[float], frame: str) -> Payload | None:
    """Return the payload of a message, None where it cannot be used.

    The mass (kg) must be finite and not negative, the centre of gravity finite, and given in the
    axes of the robot's payload link (an empty frame is taken for that).
    """
    x, y, z = (float(c) for c in com)
    numbers = (float(mass), x, y, z)
    known = robot.payload_link is not None and frame.lstrip('/') in ('', robot.payload_link)
    if not known or mass < 0 or not all(map(math.isfinite, numbers)):
        return None
    return Payload(float(mass), (x, y, z))
