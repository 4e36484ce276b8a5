"""The paper's Figure 6: orientations of the chassis from which an arm's whole range is tested."""

import math
from dataclasses import dataclass

from ugv_acceptance.model.robot import Vector


@dataclass(frozen=True, slots=True)
class Orientation:
    """A tilt: `heading` (rad) is the side that is low, 0 the front, pi/2 the left; `words` names it."""

    words: str
    heading: float | None


# A right tilt rolls the robot to its right: its right side is low.
ORIENTATIONS: dict[str, Orientation] = {
    'level': Orientation('level ground', None),
    'right': Orientation('right tilt', -math.pi / 2.0),
    'left': Orientation('left tilt', math.pi / 2.0),
    'nose-up': Orientation('nose-up', math.pi),
    'nose-down': Orientation('nose-down', 0.0),
    'nose-up-right': Orientation('nose-up and right', -0.75 * math.pi),
    'nose-up-left': Orientation('nose-up and left', 0.75 * math.pi),
    'nose-down-right': Orientation('nose-down and right', -0.25 * math.pi),
    'nose-down-left': Orientation('nose-down and left', 0.25 * math.pi),
}


def gravity_of(orientation: str, tilt: float, size: float = 9.81) -> Vector:
    """Return gravity (m/s2) in `base_link` for a named orientation tilted by `tilt` (rad)."""
    heading = ORIENTATIONS[orientation].heading
    if heading is None:
        return (0.0, 0.0, -size)
    low = size * math.sin(tilt)
    return (low * math.cos(heading), low * math.sin(heading), -size * math.cos(tilt))
