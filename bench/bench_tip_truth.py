"""The static margins against simulated truth: PackBot on a tilting plane, and with its arm moving.

First table: random postures, payloads, flipper angles and slopes, quasi-static. Second: joints
moved at speed on slopes, spread evenly over the static margin; each cell is the share that tips.

    python -m bench.bench_tip_truth [cases] [motions]
"""

import math
import sys
import time
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from bench.arm_motion import MARGINS, random_motions, static_margin, tips_all
from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.simulation.tip_cases import Judged, confusion, judge_all, random_cases

ARM = ('turret_joint', 'shoulder_joint', 'elbow_joint')
# Speeds (deg/s) and times (s) to reach them and to stop.
MOTIONS = ((7.2, 0.2), (36.0, 1.0), (36.0, 0.2), (180.0, 1.0), (180.0, 0.2))
FEW = 0.5  # deg: an error worth a line of its own
SEED = 2024


def main() -> None:
    """Print both tables."""
    counts = [int(a) for a in sys.argv[1:]]
    cases, motions = (counts + [600, 360][len(counts) :])[:2]
    robot = load().settings.robot
    quasi_static(robot, cases)
    moving(robot, motions)


def quasi_static(robot: Robot, count: int) -> None:
    """Print the confusion matrix and the distribution of the tilt's error."""
    start = time.perf_counter()
    judged = judge_all(robot, random_cases(robot, count, SEED))
    took = time.perf_counter() - start
    found = confusion(judged)
    print(f'{count} random cases on a tilting plane, {took:.0f} s on two cores')
    print('                      simulation: tips   stands')
    print(f'  model says: tips    {found.both_tip:16} {found.only_model:8}')
    print(f'  model says: stands  {found.only_truth:16} {found.both_stand:8}')
    print(f'  no margin (fewer than three contacts, degenerate): {found.no_margin}')
    print(
        f'  disagreements further than {math.degrees(found.band):.0f} deg from the boundary: ',
        end='',
    )
    print(found.far)
    print_errors(judged)


def print_errors(judged: Sequence[Judged]) -> None:
    """Print the model's margin when the simulation tips, and the cases far from zero."""
    left, tilt = (np.degrees([getattr(j, name) for j in judged]) for name in ('left', 'error'))
    print(f'when the simulated robot tips ({np.isfinite(left).sum()} cases), deg:')
    print_spread('margin the model still shows', left[np.isfinite(left)])
    print_spread('tilt, model less simulation', tilt[np.isfinite(tilt)])
    level = sum((j.model == 0.0) != (j.truth.tilt == 0.0) for j in judged)
    caught = sum(np.isfinite(j.truth.tilt) and not j.truth.over for j in judged)
    print(f'  differ about standing on the level: {level}; tipped but caught at once: {caught}')
    for j, far in zip(judged, left, strict=True):
        if abs(far) > FEW:
            q = ' '.join(f'{math.degrees(x):.1f}' for x in j.case.q)
            print(f'  {far:+.2f} deg left: model tips at {math.degrees(j.model):.1f}, ', end='')
            print(f'simulation at {math.degrees(j.truth.tilt):.1f}; posture {q} deg, ', end='')
            print(f'{j.case.payload.mass:.1f} kg, heading {math.degrees(j.case.heading):.0f} deg')


def print_spread(what: str, values: np.ndarray) -> None:
    """Print percentiles of values (deg)."""
    low, first, middle, last, high = np.percentile(values, [0, 1, 50, 99, 100])
    spread = f'min {low:.2f}  p1 {first:.2f}  p50 {middle:.2f}  p99 {last:.2f}  max {high:.2f}'
    print(f'  {what:29} {spread}  within 1 deg: {np.mean(abs(values) < 1.0):.1%}')


def moving(robot: Robot, count: int) -> None:
    """Print the share of motions that tip, by static margin, and how wrong the static map is."""
    motions = random_motions(robot, ARM, count, SEED)
    margin = np.degrees([static_margin(robot, m) for m in motions])
    edges = np.degrees(MARGINS)
    print(f'\n{count} motions of one arm joint by 30 to 150 deg on slopes: share that tips')
    heads = ' '.join(f'{a:4.0f}..{b:<3.0f}' for a, b in pairwise(edges))
    print(f'  {"deg/s":>6} {"ramp s":>6}  margin {heads}  wrong  safe at')
    for speed, ramp in MOTIONS:
        tips = np.array(tips_all(robot, motions, math.radians(speed), ramp))
        which = np.searchsorted(edges, margin) - 1
        shares = ' '.join(f'{tips[which == k].mean():8.0%} ' for k in range(len(edges) - 1))
        wrong = np.mean(tips != (margin < 0.0))
        worst = margin[tips].max()
        print(f'  {speed:6.1f} {ramp:6.1f}        {shares} {wrong:6.1%}  > {worst:.1f} deg')
    print('  wrong: share of these motions whose outcome is not the static one')
    print('  safe at: no motion with more static margin than this tipped')


if __name__ == '__main__':
    main()
