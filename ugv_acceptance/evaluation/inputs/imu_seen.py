"""What the messages of an IMU in a recording showed, for what was not checked on it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.samples import ImuColumns
from ugv_acceptance.type_aliases import Floats, Times

# A stretch at rest (ns) in which the accelerometer can be verified.
RESTED = 500_000_000


@dataclass(slots=True)
class ImuSeen:
    """What the messages of a recording showed: how many of them, and of those how many at rest.

    `rested`: in stretches at rest of RESTED and more, in which the acceleration could be held
    against gravity; a robot that shakes is at rest by chance now and then. `no_rate` and `no_force`
    declare the rate or the acceleration as not measured (covariance -1), `turned` have a rate other
    than 0.
    """

    messages: int = 0
    rested: int = 0
    no_rate: int = 0
    no_force: int = 0
    turned: int = 0

    def take(self, columns: Sequence[ImuColumns], omega: Floats) -> None:
        """Take messages, with the rates (3, n) of all of them."""
        for s in columns:
            self.messages += len(s.log_time)
            self.no_rate += int(np.count_nonzero(s.angular_velocity_covariance_0 == -1.0))
            self.no_force += int(np.count_nonzero(s.linear_acceleration_covariance_0 == -1.0))
        x, y, z = omega != 0.0
        self.turned += int(np.count_nonzero(x | y | z))


def rested_messages(time: Times, rest: NDArray[np.bool_]) -> int:
    """Return the number of messages (n,) in stretches at rest that last for RESTED."""
    ends = np.flatnonzero(np.diff(np.concatenate(([False], rest, [False]))))
    begin, end = ends[::2], ends[1::2]
    long = time[end - 1] - time[begin] >= RESTED
    return int((end - begin)[long].sum())
