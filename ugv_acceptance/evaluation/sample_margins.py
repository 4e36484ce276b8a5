"""The margins of a robot at one message."""

from typing import NamedTuple

from ugv_acceptance.model.robot import Vector
from ugv_acceptance.model.stability import NOT_KNOWN, Stability, Stance, stability_of

# Tip angles and state where nobody measures the attitude.
LEVEL = NOT_KNOWN.angle, NOT_KNOWN.state


class Margins(NamedTuple):
    """The margins of the newest joint positions and gravity at one message.

    `time` is that of receipt, `stamp` that of the header (ns). `q` (j,) rad or m, `gravity` (3,)
    m/s2 in `base_link`, `torque` (j,) static (N m; N), with the ground's reaction spread evenly on
    joints that carry the robot. `angle` (4,) rad and `state` are those of Stability; the others of
    its margins are computed when asked for, by how the robot stands: most messages only need these.
    """

    time: int
    stamp: int
    q: tuple[float, ...]
    gravity: Vector
    torque: tuple[float, ...]
    angle: tuple[float, ...]
    state: int
    stands: Stance | Stability

    @property
    def stability(self) -> Stability:
        """All tip-over margins."""
        stands = self.stands
        return stands if isinstance(stands, Stability) else stability_of(stands, self.gravity)
