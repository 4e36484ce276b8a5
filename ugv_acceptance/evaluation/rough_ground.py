"""The cautious margin on ground that is not flat: that of a robot with shortened tracks."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.ground import FLAT, KINDS
from ugv_acceptance.evaluation.margin_table import NO_GROUND_ROWS, GroundRows, MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.mechanics import Mechanics, mechanics_of, posture_of, with_contacts
from ugv_acceptance.model.robot import Payload, Robot, Vector
from ugv_acceptance.model.shortened_tracks import shortened
from ugv_acceptance.model.stability import margins, stability_of, stances_of, standing
from ugv_acceptance.type_aliases import Floats


@lru_cache(maxsize=8)
def cautious_mechanics(robot: Robot, pitch: float) -> Mechanics:
    """Return the mechanics of the robot with half a pitch (m) cut from each end of its tracks.

    Keep them where they are needed often: to look a robot up takes long.
    """
    return with_contacts(mechanics_of(robot), shortened(robot, pitch / 2.0).contacts)


def cautious_angles(
    mechanics: Mechanics, q: Sequence[float], gravity: Vector, load: Payload
) -> tuple[float, ...]:
    """Return the tilt left (rad) to each of SIDES of a robot with shortened tracks.

    `q` (j) rad or m, `gravity` m/s2 in `base_link`; infinite without an edge, NaN where not known.
    """
    posture = posture_of(mechanics, q, load.mass, load.cog)
    stance = standing(stances_of(mechanics, posture), gravity)
    angle: Any = stability_of(stance, gravity).angle
    return tuple(map(float, angle))


def ground_rows(
    settings: Settings, start: int, rows: MarginRows, load: Sequence[Floats | float]
) -> GroundRows:
    """Return the kind of ground of each row of margins, and the cautious margins where not flat.

    `start` (ns) is when the recording began, `load` the payload (mass and place) of each joint row.
    """
    ground = settings.ground
    if not ground.ever_rough:
        return NO_GROUND_ROWS
    kind = ground.numbers_of(rows.time, start)
    cautious = np.full((len(kind), 4), np.nan)
    some = np.flatnonzero((kind != KINDS.index(FLAT)) & rows.known)
    of_joints = rows.pairs.of_joints[some]
    loads = np.empty((len(some), 4))
    for k, number in enumerate(load):
        loads[:, k] = number if isinstance(number, float) else number[of_joints]
    short = shortened(settings.robot, ground.pitch / 2.0)
    cautious[some] = _cautious(short, rows.q[some], rows.gravity[some], loads)
    return GroundRows(kind, cautious)


def _cautious(robot: Robot, q: Floats, gravity: Floats, loads: Floats) -> Floats:
    """Return the tilt left (n, 4) of a robot for postures, gravities and payloads (n, ...)."""
    found = np.empty((len(q), 4))
    kinds, which = np.unique(loads, axis=0, return_inverse=True)
    for k, (mass, x, y, z) in enumerate(kinds.tolist()):
        some: NDArray[np.intp] = np.flatnonzero(which.reshape(-1) == k)
        found[some] = margins(robot, q[some], gravity[some], Payload(mass, (x, y, z))).angle
    return found
