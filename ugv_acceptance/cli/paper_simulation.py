"""The MuJoCo simulations of `paper`: the arm's sweep, and robots on a tilting plane."""

import math

import numpy as np

from ugv_acceptance.cli.terminal_output import status
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.report.paper.joints import PARTS, posture
from ugv_acceptance.report.paper.numbers import DOWN, Simulated
from ugv_acceptance.studies.offsets import OFFSET1, OFFSET2
from ugv_acceptance.studies.orientations import grounding_angle
from ugv_acceptance.studies.planar import paper_arm
from ugv_acceptance.studies.validity import PAPER_SPEEDS_DEG_S, mean_square, paper_sweep
from ugv_acceptance.type_aliases import Floats


def simulated_arm() -> tuple[Simulated, Floats]:
    """Return the torques of Figure 4's sweep and F (8, 2) of Table 2, both from MuJoCo."""
    from ugv_acceptance.simulation.sweep import sweep

    arm, start = paper_arm(OFFSET1, OFFSET2), (math.pi / 6.0, 0.0)
    static = static_torque(paper_arm(), paper_sweep(math.pi / 6.0), DOWN)
    runs = {
        speed: sweep(arm, start, 'theta2', math.radians(speed)).effort
        for speed in PAPER_SPEEDS_DEG_S
    }
    squares = np.array([mean_square(effort - static) for effort in runs.values()])
    return Simulated(paper_sweep(math.pi / 6.0)[:, 1], runs[7.2]), squares / squares[0]


def simulated_joints(robot: Robot, *, free: bool) -> list[list[str]]:
    """Return the least and the largest force, torque, rate and acceleration at each joint.

    The elbow turns once at 7.2 deg/s, the shoulder at 30 deg, flippers forward: the whole vehicle
    on its wheels where `free`, else its chassis held.
    """
    from ugv_acceptance.simulation.sweep import sweep

    flippers = grounding_angle(robot, PARTS.flipper)
    start = posture(robot, shoulder=math.pi / 6.0, flipper=flippers)
    found = sweep(robot, start, PARTS.elbow, math.radians(7.2), free=free)
    turning = np.degrees(np.stack([found.rate, found.acceleration], axis=-1))
    columns = [found.force, found.effort[..., np.newaxis], turning]
    table = np.concatenate(columns, axis=-1)
    head = 'vehicle on its wheels' if free else 'chassis held'
    names = ['longitudinal force, N', 'lateral', 'vertical', 'torque, N m', 'rate, °/s', '°/s²']
    return [[head, *names]] + [
        [name, *(f'{_ends(values)}' for values in table[:, k].T)]
        for k, name in enumerate(robot.joint_names)
    ]


def _ends(values: Floats) -> str:
    low, high = (round(float(x), 2) + 0.0 for x in (values.min(), values.max()))
    return f'{low:.2f}' if low == high else f'{low:.2f} to {high:.2f}'


def simulated_truth(robot: Robot, count: int) -> list[list[str]]:
    """Return the confusion matrix of the rollover map against simulated tipping, as a table."""
    from ugv_acceptance.simulation.tip_cases import confusion, judge_all, random_cases

    with status(f'Tilting the plane under the simulated robot, {count} cases'):
        judged = judge_all(robot, random_cases(robot, count, seed=1))
    found = confusion(judged)
    left = np.abs(np.degrees([case.left for case in judged]))
    left = left[np.isfinite(left)]
    spread = [f'{np.percentile(left, share):.2f}°' for share in (50, 95, 100)] if len(left) else []
    return [
        [f'{count} random cases', 'MuJoCo: stands', 'MuJoCo: tips'],
        ['model: stands', str(found.both_stand), str(found.only_truth)],
        ['model: tips', str(found.only_model), str(found.both_tip)],
        ['no margin to compare', str(found.no_margin), ''],
        [f'differ, and over {math.degrees(found.band):.0f}° from the boundary', str(found.far), ''],
        ['margin the model shows as MuJoCo tips: median, 95 %, largest', ', '.join(spread), ''],
    ]
