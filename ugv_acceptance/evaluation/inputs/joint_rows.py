"""What joint states hold: merged rows, where joints stand in messages, and what batches told."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.inputs.repeats import Repeats
from ugv_acceptance.type_aliases import Floats, Times

Mask = NDArray[np.bool_]
Indices = NDArray[np.intp]

NEVER = -1


@dataclass(frozen=True, slots=True)
class JointRows:
    """Merged joint states, one row a message that names at least one of the robot's joints.

    `q` (n, j) in rad (m) is NaN where a joint is unknown or its value unusable; `qd` in rad/s (m/s)
    and `effort` in N m (N) where not reported or implausible; `oldest` (n,) is the receipt time
    (ns) of the oldest position in the row; `unusable` (n,) marks a value that cannot be used.
    Rates that are not reported, or contradict the positions, are those of the positions.
    """

    time: Times
    stamp: Times
    q: Floats
    qd: Floats
    effort: Floats
    oldest: Times
    unusable: Mask


@dataclass(slots=True)
class Layout:
    """Where the robot's joints stand in messages with one list of names.

    `pairs` are (joint number, place in the message); `second` is the last second in which their
    positions were checked for jumps, `cell` the last cell of time (joint_rates.py) with a message,
    `first` and `last` when such a message first and last came (ns).
    """

    pairs: list[tuple[int, int]]
    second: int = NEVER
    cell: int = NEVER
    first: int = NEVER
    last: int = NEVER
    repeats: Repeats = field(default_factory=Repeats)


@dataclass(frozen=True, slots=True)
class Told:
    """What messages (n,) of a batch told, beside their JointRows.

    `repeated` (n,) are the seconds for which the message is repeated (0: it is new), `repeating`
    says that some joint's newest message is; `speed` (n, j) are rates to be believed, NaN where
    unknown; `doubted` says that a joint is taken as held which may be elsewhere. The rest is for
    words: positions (n, j), and as told (j, n), which were named, those told before the batch, and
    when each was received.
    """

    repeated: Floats
    repeating: Mask
    speed: Floats
    q: Floats
    raw: Floats
    named: Mask
    before: list[float]
    seen: list[Times]
    doubted: Mask

    def told_at(self, j: int, row: int) -> float:
        """Return the position of joint number j that was told last at a row of the batch."""
        rows = np.flatnonzero(self.named[j, : row + 1])
        return float(self.raw[j, rows[-1]]) if len(rows) else self.before[j]
