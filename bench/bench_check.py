"""How long the check of a planned motion takes, for 100 points, beside Pinocchio's rnea in a loop.

The loop gives the torques of the 100 points alone, once each; ours gives torque, tilt left and
clearance at all moments in between as well. CPU milliseconds, best of rounds; the ratio counts.

    python -m bench.bench_check [points]
"""

import sys
import time
from collections.abc import Callable

import numpy as np
import pinocchio as pin

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.planned_motion import (
    CheckedMotion,
    Conditions,
    MotionChecker,
    Trajectory,
)
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.type_aliases import Floats

ROUNDS, STEP = 300, 0.1
NAMES = ('turret_joint', 'shoulder_joint', 'elbow_joint')
START = (0.0, 1.9, -1.5, np.pi)


def motion(kind: str, count: int) -> Trajectory:
    """Return a slow wave of the arm through so many points, 0.1 s apart."""
    time: Floats = STEP * np.arange(1, count + 1, dtype=np.float64)
    phase = 2.0 * np.pi * time / time[-1]
    q = np.stack([np.sin(phase), 1.9 - 0.3 * np.sin(phase), -1.5 + 0.3 * np.sin(phase)], axis=1)
    rates = np.gradient(q, time, axis=0)
    more = np.gradient(rates, time, axis=0)
    return Trajectory(NAMES, time, q, None if kind == 'linear' else rates,
                      more if kind == 'quintic' else None)  # fmt: skip


def best(run: Callable[[], object]) -> float:
    """Return the least CPU time (ms) of one of many runs."""
    found = np.inf
    for _ in range(ROUNDS):
        begin = time.process_time()
        run()
        found = min(found, time.process_time() - begin)
    return 1e3 * found


def rnea_of(path: str, given: Trajectory) -> Callable[[], object]:
    """Return a loop over the points in Pinocchio: torques only."""
    model = pin.buildModelFromUrdf(path)
    data, flat = model.createData(), np.zeros(model.nv)
    points = [
        pin.integrate(model, pin.neutral(model), np.resize(q, model.nv)) for q in given.positions
    ]

    def run() -> None:
        for q in points:
            pin.rnea(model, data, q, flat, flat)

    return run


def main() -> None:
    """Print a row for each way of interpolation."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    loaded = load()
    checker = MotionChecker(loaded.settings)
    conditions = Conditions((0.0, 0.0, -9.81), Payload(1.0), None, START)
    print(f'{count} points: {"moments":>10}{"ms":>8}{"ms/100":>8}{"Pinocchio ms":>14}{"ratio":>8}')
    for kind in ('linear', 'cubic', 'quintic'):
        given = motion(kind, count)

        def ask(given: Trajectory = given) -> CheckedMotion:
            return checker.check(given, conditions)

        found, ours, loop = ask(), best(ask), best(rnea_of(str(loaded.urdf_path), given))
        print(f'{kind:12}{found.samples:8}{ours:8.2f}{100.0 * ours / count:8.2f}', end='')
        print(f'{loop:14.2f}{ours / loop:8.1f}  {found.verdict}')


if __name__ == '__main__':
    main()
