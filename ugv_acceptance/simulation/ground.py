"""How large a robot is against PackBot where it stands on the ground: for obstacles of its size."""

from dataclasses import dataclass

import numpy as np

from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.roles import place_of
from ugv_acceptance.simulation.rolling import casters_of, driven_wheels

# PackBot: half the length of its tracks and how far ahead of its middle its front wheels reach (m).
HALF, NOSE = 0.25, 0.25 + 0.09
# A wheel climbs a step of this share of its radius.
CLIMBS = 0.4
# Half the length (m) of a robot whose contact points are in one place along it.
SHORT = 0.02


@dataclass(frozen=True, slots=True)
class Ground:
    """The size of a robot on the ground.

    `half` (m) is half the length of its stance and `size` that over PackBot's; `away` is how much
    farther off than PackBot's its obstacles are, at least 1, `front` (m) where it ends ahead.
    `highest` (m) is the highest step it climbs; `steps` is false where it rolls on casters.
    """

    half: float
    size: float
    away: float
    front: float
    highest: float
    steps: bool


def ground_of(robot: Robot) -> Ground:
    """Return the size of a robot on the ground; it has to have contact points."""
    places = np.array([place_of(robot, c.link, c.position) for c in robot.contacts])
    low = places[places[:, 2] <= robot.ground + robot.contact_tolerance]
    along = (low if len(low) else places)[:, 0]
    half = max(float(along.max() - along.min()) / 2.0, SHORT)
    radii = [wheel.radius for wheel in driven_wheels(robot)]
    front = float(along.max()) + max(radii, default=NOSE - HALF)
    away = max(front / NOSE, 1.0)
    highest = CLIMBS * min(radii) if radii else float('inf')
    return Ground(half, half / HALF, away, front, highest, not casters_of(robot))
