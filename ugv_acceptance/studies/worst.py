"""Worst and safe positions of one joint in closed form: equations (3) to (8).

Over one rotary joint every static torque is c + R cos(x - phase); three postures determine it.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ugv_acceptance import BadConfig
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.studies.bilinear import check_alone
from ugv_acceptance.studies.intervals import TURN, Intervals, intersect, where_cosine_between
from ugv_acceptance.type_aliases import Floats

# An amplitude below this (N m) counts as none: the moved joint does not load the other.
_FLAT = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Waves:
    """Each joint's torque over one joint's position x: mean + radius cos(x - phase).

    All (j,): `mean` and `radius` in N m (N if prismatic), `phase` in rad.
    """

    mean: Floats
    radius: Floats
    phase: Floats


def torque_waves(
    robot: Robot, q: ArrayLike, joint: str, gravity: ArrayLike, payload: Payload | None = None
) -> Waves:
    """Return every joint's torque as a sinusoid of the position of `joint`, others as in `q` (j,).

    Raises BadConfig if the joint is prismatic: its torques are not sinusoidal.
    """
    if robot.joint(joint).slides:
        raise BadConfig(f'joint {joint}: expected a turning joint, it slides')
    check_alone(robot, joint)
    nodes = np.array([0.0, TURN / 3.0, -TURN / 3.0])
    postures = np.tile(np.asarray(q, dtype=np.float64), (3, 1))
    postures[:, robot.joint_names.index(joint)] = nodes
    torque = static_torque(robot, postures, gravity, payload)
    cosine, sine = (2.0 / 3.0 * f(nodes) @ torque for f in (np.cos, np.sin))
    return Waves(torque.mean(axis=0), np.hypot(cosine, sine), np.arctan2(sine, cosine))


def worst_positions(waves: Waves, loaded: int) -> tuple[float, ...]:
    """Return the positions in [0, 2 pi) at which joint number `loaded` has the largest |torque|.

    One, or two if both signs are equally bad; none if the moved joint does not load it.
    """
    mean, radius, phase = (float(x[loaded]) for x in (waves.mean, waves.radius, waves.phase))
    if radius < _FLAT:
        return ()
    roots = [phase] if mean > -_FLAT else []
    roots += [phase + math.pi] if mean < _FLAT else []
    return tuple(sorted(root % TURN for root in roots))


def safe_positions(waves: Waves, limits: ArrayLike) -> Intervals:
    """Return the positions in [0, 2 pi] at which no |torque| exceeds its limit (j,), N m."""
    safe: Intervals = ((0.0, TURN),)
    bounds = np.broadcast_to(np.asarray(limits, dtype=np.float64), waves.mean.shape)
    rows = zip(bounds, waves.mean, waves.radius, waves.phase, strict=True)
    for bound, mean, radius, phase in rows:
        if radius >= _FLAT:
            low, high = (-bound - mean) / radius, (bound - mean) / radius
            safe = intersect(safe, where_cosine_between(float(low), float(high), float(phase)))
        elif abs(mean) > bound:
            return ()
    return safe
