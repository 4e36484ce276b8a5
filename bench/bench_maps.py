"""Maps of 2001 x 2001 cells: torque of the paper's arm, rollover of the PackBot.

Each way a few times, all ways in turn, medians; the torque maps must be the same booleans.

    python -m bench.bench_maps [cells a side]
"""

import math
import statistics
import sys
import time
from collections.abc import Callable

import numpy as np

from ugv_acceptance.config import load
from ugv_acceptance.model.stability import stability
from ugv_acceptance.studies.bilinear import grid_of
from ugv_acceptance.studies.maps import (
    rollover_map,
    stands,
    tip_forms,
    torque_forms,
    within_limits,
)
from ugv_acceptance.studies.planar import PAPER, arm_robot
from ugv_acceptance.studies.windows import Mask

LIMIT = 50.0
ROUNDS = 5
REPEATS = 5
TURN = [[-math.pi, math.pi]] * 2


def plain(x: np.ndarray, y: np.ndarray) -> Mask:
    """Return the paper's map written in the simplest way: equations (1) and (2) on a meshgrid."""
    theta1, theta2 = np.meshgrid(x, y, indexing='ij')
    a, b = PAPER.moment1, PAPER.moment2
    tau1 = a * np.cos(theta1) + b * np.cos(theta1 + theta2)
    tau2 = b * np.cos(theta1 + theta2)
    ok: Mask = (np.abs(tau1) <= LIMIT) & (np.abs(tau2) <= LIMIT)
    return ok


def medians(ways: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Return the median wall seconds of each way, taken in turn."""
    times: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(rounds):
        for name, run in ways.items():
            for _ in range(REPEATS):
                start = time.perf_counter()
                run()
                times[name].append(time.perf_counter() - start)
    return {name: statistics.median(found) for name, found in times.items()}


def torque(n: int) -> None:
    """Print the torque map's table."""
    robot, level = arm_robot(PAPER, LIMIT), (0.0, 0.0, -PAPER.gravity)
    grid = grid_of(robot, ('theta1', 'theta2'), TURN, (n, n), np.zeros(2))

    def ours() -> Mask:
        return within_limits(robot, grid, torque_forms(robot, grid, level), LIMIT)

    differ = int((ours() != plain(grid.x, grid.y)).sum())
    found = medians({'plain NumPy': lambda: plain(grid.x, grid.y), 'ours': ours}, ROUNDS)
    print(f'torque map {n} x {n}: {differ} of {n * n} booleans differ from plain NumPy')
    for name, wall in found.items():
        ratio = found['plain NumPy'] / wall
        print(f'  {name:28}{wall * 1e3:10.2f} ms{wall / n**2 * 1e9:8.2f} ns/cell{ratio:8.1f} x')


def rollover(n: int) -> None:
    """Print the rollover map's table, with the general function beside it."""
    robot = load().settings.robot
    tilt = math.radians(30.0)
    gravity = (0.0, -9.81 * math.sin(tilt), -9.81 * math.cos(tilt))
    stowed = np.array([0.0, 0.0, 0.0, math.pi])
    axes = ('shoulder_joint', 'elbow_joint')
    grid, coarse = (grid_of(robot, axes, TURN, (k, k), stowed) for k in (n, 201))

    def boolean() -> Mask:
        forms = tip_forms(robot, grid, gravity)
        if forms is None:
            raise SystemExit('expected one support polygon with stowed flippers, found several')
        return stands(robot, grid, forms)

    general = np.min(np.array(stability(robot, coarse.postures(), gravity).angle), axis=0)
    apart = np.abs(general - rollover_map(robot, coarse, gravity).angle).max()
    found = medians(
        {
            'tips or not': boolean,
            'tilt left and side': lambda: rollover_map(robot, grid, gravity),
        },
        5,
    )
    every = medians({'': lambda: stability(robot, coarse.postures(), gravity, workers=2)}, 3)['']
    print(f'rollover map {n} x {n}, PackBot, right tilt 30 deg, both cores')
    for name, wall in found.items():
        print(f'  {name:28}{wall * 1e3:10.1f} ms{wall / n**2 * 1e9:8.2f} ns/cell')
    print(f'  {"general function of arrays":28}{"":13}{every / 201**2 * 1e9:8.0f} ns/cell')
    print(f'  largest difference to the general function: {apart:.1e} rad')


def main(n: int = 2001) -> None:
    """Print both tables."""
    torque(n)
    rollover(n)


if __name__ == '__main__':
    main(*(int(a) for a in sys.argv[1:]))
