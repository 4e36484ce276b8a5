"""Positions that step once, from one message to the next, and stay: an encoder that was homed.

Either the positions before or those after are wrong. Two sources that alternate, a joint that moves
fast, and a single wrong reading do not step once.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ugv_acceptance.type_aliases import Floats, Times

# A step is at least LEAST (rad, m), and SHARE of it more than the ways before and after it.
LEAST, SHARE = 0.05, 0.2
# Two messages more than LONGEST (ns) apart tell no step between them; AROUND (ns) a step, rates are
# not those of a motion.
LONGEST, AROUND = 500_000_000, 400_000_000


@dataclass(frozen=True, slots=True)
class PositionStep:
    """A step of joint number `joint` by `way` (rad, m) at `time` (ns)."""

    joint: int
    time: int
    way: float


def steps_in(
    time: Times, q: Floats, turns: Sequence[float], fastest: Sequence[float]
) -> list[PositionStep]:
    """Return the steps in messages (n,) with positions (n, j), without their first and last two.

    `turns` (j,) are angles (rad) after which positions may be wrapped (0: not), `fastest` (j,) the
    rates (rad/s, m/s) above which a joint cannot move.
    """
    found: list[PositionStep] = []
    seconds = np.maximum(np.diff(time), 1) / 1e9
    for j, (turn, most) in enumerate(zip(turns, fastest, strict=True)):
        way = np.diff(q[:, j])
        if turn:
            way = way - turn * np.round(way / turn)
        size = np.abs(way)
        far = (size > LEAST) & (size > most * np.maximum(seconds, 0.01)) & (seconds < LONGEST / 1e9)
        alone = np.zeros(len(far), np.bool_)
        alone[1:-1] = np.maximum(size[:-2], size[2:]) < SHARE * size[1:-1]
        rows = np.flatnonzero(far & alone).tolist()
        found += [PositionStep(j, int(time[k + 1]), float(way[k])) for k in rows]
    return found
