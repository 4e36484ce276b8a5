"""Compares the model's tip-over margin with simulated tip-overs in random cases."""

from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np
from numpy.typing import ArrayLike

from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.stability import stability, stances_of, standing
from ugv_acceptance.model.tree import tree_of
from ugv_acceptance.processes import Workers
from ugv_acceptance.simulation.engine import mujoco
from ugv_acceptance.simulation.oracle import LAST, Truth, tip_truth
from ugv_acceptance.simulation.vehicle import (
    Build,
    Vehicle,
    body_name,
    gravity_on_slope,
    vehicle_of,
)
from ugv_acceptance.type_aliases import Floats

# Step (rad) of the grid of tilts on which the model's tilt is looked for, then interpolated.
GRID = np.radians(0.1)


@dataclass(frozen=True, slots=True)
class TipCase:
    """A case: posture `q` (rad, m), payload, and a slope of `tilt` down towards `heading` (rad)."""

    q: tuple[float, ...]
    payload: Payload
    heading: float
    tilt: float


@dataclass(frozen=True, slots=True)
class Judged:
    """A case with the tilt (rad) at which the robot tips by the model and by the simulation.

    0: it does not stand on the level; infinite: it stands at any tilt looked at; NaN: the model
    gives no margin. `margin` (rad) is the model's margin on the slope of the case; `left` (rad)
    what it still was when the simulated robot tipped on a slope, else NaN.
    """

    case: TipCase
    model: float
    margin: float
    truth: Truth
    left: float

    @property
    def error(self) -> float:
        """Tilt of the model minus that of the simulation (rad); NaN unless both tip on a slope.

        Where the slope runs along the edge, a small error of the margin is a large one of the tilt.
        """
        both = 0.0 < self.model < np.inf and 0.0 < self.truth.tilt < np.inf
        return self.model - self.truth.tilt if both else float('nan')


def random_cases(
    robot: Robot, count: int, seed: int, heaviest: float = 6.0, steepest: float = 1.2
) -> list[TipCase]:
    """Return random cases: joints anywhere in their range (a full turn at most), any heading.

    No arm or load reaches below the ground of the level robot; flippers may: they raise it.
    """
    rng = np.random.default_rng(seed)
    vehicle = vehicle_of(robot, Build(base='fixed', motors=False))
    joints = [robot.joint(name) for name in robot.joint_names]
    low = [max(j.lower, -np.pi) for j in joints]
    high = [min(j.upper, np.pi) for j in joints]
    cases: list[TipCase] = []
    while len(cases) < count:
        q = rng.uniform(low, high)
        load, heading, tilt = rng.uniform([0.0, -np.pi, 0.0], [heaviest, np.pi, steepest]).tolist()
        if clear_of_ground(vehicle, q):
            case = TipCase(tuple(q.tolist()), Payload(load, robot.payload.cog), heading, tilt)
            cases.append(case)
    return cases


def clear_of_ground(vehicle: Vehicle, q: Floats) -> bool:
    """Return whether all links that joints move, but those with contacts, are above the ground."""
    model, robot = vehicle.model, vehicle.robot
    data = mujoco.MjData(model)
    data.qpos[vehicle.position] = q
    mujoco.mj_kinematics(model, data)
    feet, frames = {c.link for c in robot.contacts}, tree_of(robot).frames
    names = [link.name for link in robot.links if frames[link.name][0] and link.name not in feet]
    bodies = [model.body(body_name(name)).id for name in names]
    return bool((data.xpos[bodies, 2] > 0.0).all() and (data.xipos[bodies, 2] > 0.0).all())


def judge(robot: Robot, case: TipCase) -> Judged:
    """Return the results of the model and of the simulation for one case."""
    rest = expected_rest(robot, case)
    model, margin = model_tilt(robot, case, rest)
    truth = tip_truth(robot, case.q, case.payload, case.heading, rest)
    left = float('nan')
    if 0.0 < truth.tilt < np.inf:
        down = gravity_on_slope(robot.gravity, truth.tilt, case.heading) @ rest
        left = float(least_angle(robot, case.q, down, case.payload))
    return Judged(case, model, margin, truth, left)


def judge_all(robot: Robot, cases: Sequence[TipCase], workers: int = 2) -> list[Judged]:
    """Return the results for all cases, in their order, computed by `workers` processes."""
    with Workers(workers, mp_context=get_context('spawn')) as pool:
        return list(pool.map(judge, [robot] * len(cases), cases, chunksize=8))


def expected_rest(robot: Robot, case: TipCase) -> Floats:
    """Return the attitude (3, 3) in which the robot stands on the level by the model."""
    load = case.payload
    posture = posture_of(mechanics_of(robot), case.q, load.mass, load.cog)
    stance = standing(stances_of(mechanics_of(robot), posture), (0.0, 0.0, -robot.gravity))
    if stance.footing is None or not stance.footing.raised:
        return np.eye(3)
    a, b, c = (np.array(posture.contacts[k]) for k in stance.footing.face)
    up = np.cross(b - a, c - a)
    up *= np.sign(up[2]) / np.linalg.norm(up)
    x = np.array([1.0, 0.0, 0.0]) - up[0] * up
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(up, x), up])


def least_angle(
    robot: Robot, q: ArrayLike, gravity: ArrayLike, payload: Payload | None = None
) -> Floats:
    """Return the least force-angle (rad) over all edges, shape (...), for `q` (..., j)."""
    angles = stability(robot, q, gravity, payload).angle
    least: Floats = np.min(np.array(angles, dtype=np.float64), axis=0)
    return least


def model_tilt(robot: Robot, case: TipCase, rest: Floats) -> tuple[float, float]:
    """Return the tilt (rad) at which it tips by the model, and its margin (rad) on the slope."""
    tilts = np.append(np.arange(0.0, LAST, GRID), case.tilt)
    down = np.array([gravity_on_slope(robot.gravity, t, case.heading) for t in tilts]) @ rest
    least = least_angle(robot, np.tile(case.q, (len(tilts), 1)), down, case.payload)
    margin, least = float(least[-1]), least[:-1]
    if not np.isfinite(margin):
        return float('nan'), margin
    if (least > 0.0).all():
        return float('inf'), margin
    k = int(np.argmax(least <= 0.0))
    if k == 0:
        return 0.0, margin
    return float(tilts[k - 1] + GRID * least[k - 1] / (least[k - 1] - least[k])), margin


@dataclass(frozen=True, slots=True)
class Confusion:
    """Confusion matrix: does a robot tip on the slope of its case, by model and by simulation.

    `far` counts the disagreements further than `band` (rad) from the boundary that the simulation
    found and from the model's own: those that no inaccuracy of the boundary explains.
    """

    both_tip: int
    both_stand: int
    only_model: int
    only_truth: int
    no_margin: int
    far: int
    band: float


def confusion(judged: Sequence[Judged], band: float = float(np.radians(1.0))) -> Confusion:
    """Return the confusion matrix of judged cases on the slopes of the cases."""
    known = [j for j in judged if not np.isnan(j.model)]
    table = np.zeros((2, 2), dtype=int)
    far = 0
    for j in known:
        says, tips = j.case.tilt >= j.model, j.case.tilt >= j.truth.tilt
        table[int(says), int(tips)] += 1
        far += says != tips and min(abs(j.margin), abs(j.case.tilt - j.truth.tilt)) > band
    return Confusion(
        both_tip=int(table[1, 1]),
        both_stand=int(table[0, 0]),
        only_model=int(table[1, 0]),
        only_truth=int(table[0, 1]),
        no_margin=len(judged) - len(known),
        far=int(far),
        band=band,
    )
