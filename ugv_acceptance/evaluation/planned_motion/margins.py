"""The margins of a robot at the moments of a motion, the reaction of the moving links included."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.planned_motion.path import Samples
from ugv_acceptance.model.clearance import Face, clearance
from ugv_acceptance.model.expressions import Number
from ugv_acceptance.model.mechanics import Mechanics
from ugv_acceptance.model.moving_arm import moving
from ugv_acceptance.model.reactions import carry
from ugv_acceptance.model.robot import Payload, Vector
from ugv_acceptance.model.row_selection import pick
from ugv_acceptance.model.stability import (
    SIDES,
    UNKNOWN,
    many_stances,
    many_standing,
    tip_angles_of,
)
from ugv_acceptance.type_aliases import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Margins:
    """Margins at s moments: `torque` (j, s) N m (N), `angle` (4, s) rad to SIDES, `state` (s,).

    `height` (s,) m is the clearance of the arm above the ground, infinite without an arm.
    `carrying` are the numbers of the joints that carry the robot at some moment.
    """

    torque: Floats
    angle: Floats
    state: NDArray[np.int8]
    height: Floats
    carrying: set[int] = field(default_factory=set)


def margins_of(
    mechanics: Mechanics,
    motion: Sequence[Sequence[Number]],
    count: int,
    gravity: Vector,
    payload: Payload,
) -> Margins:
    """Return the margins at `count` moments of a motion: positions, rates, accelerations (j).

    Each is an array (count,), or a number for joints that do not move. `gravity` m/s2, base axes.
    """
    q, rate, acceleration = motion
    found = moving(mechanics, (q, rate, acceleration), gravity, payload)
    torque = np.array([np.broadcast_to(tau, count) for tau in found.torque]).reshape(-1, count)
    down: Any = tuple(np.broadcast_to(x, count) for x in found.gravity)
    angle = np.full((len(SIDES), count), np.nan)
    state, height = np.full(count, UNKNOWN, np.int8), np.full(count, np.nan)
    carrying: set[int] = set()
    heights: dict[Face, Floats] = {}
    # An arm that falls faster than the robot presses down gives infinite numbers: free fall.
    with np.errstate(all='ignore'):
        stances = many_stances(mechanics, found.posture, count)
        every = np.arange(count)
        for rows, stance in many_standing(stances, count, every, down):
            under, points = pick(down, rows), stance.points
            carrying |= carry(torque, rows, found.posture, rows, mechanics, points, under)
            angles, state[rows] = tip_angles_of(stance, under)
            for line, value in zip(angle, angles, strict=True):
                line[rows] = value
            face = stance.ground_face
            if face not in heights:
                above = clearance(mechanics, face, q, payload.cog)
                heights[face] = np.broadcast_to(np.asarray(above, np.float64), count)
            height[rows] = heights[face][rows]
    return Margins(torque, angle, state, height, carrying)


def columns_of(
    samples: Samples, moved: Sequence[int], posture: Sequence[float]
) -> tuple[list[Number], list[Number], list[Number]]:
    """Return positions, rates and accelerations of all joints (j).

    `moved` says which joints are those of the samples; the others stay in `posture` (j).
    """
    q: list[Number] = list(posture)
    rate: list[Number] = [0.0] * len(q)
    acceleration: list[Number] = [0.0] * len(q)
    for k, joint in enumerate(moved):
        q[joint] = samples.position[:, k]
        rate[joint] = samples.rate[:, k]
        acceleration[joint] = samples.acceleration[:, k]
    return q, rate, acceleration
