"""Does the advice help: random cases with too small a margin, in which the robot follows it.

Prints the share of cases in which the margin the advice is for is larger afterwards, in the
simulation; how many robots tipped on the way, and how near the others came to it; how far the gain
came out as promised; and what it costs to find the advice.

    python -m bench.bench_advice [trials of each kind] [kinds]
"""

import math
import sys
import time
from collections.abc import Sequence

import numpy as np

from bench.advice_trial import Trial, trials
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.advice.search import advise
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.simulation.tip_cases import random_cases
from ugv_acceptance.simulation.vehicle import gravity_on_slope

SEED = 41


def main() -> None:
    """Print the table."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 150
    settings = load().settings
    print('advice    trials  margin larger  tipped   tip: promised, came   torque: promised, came')
    for kind in sys.argv[2:] or ('joint', 'turn', 'payload'):
        found = list(trials(settings, count, SEED, (kind,)))
        helped, tipped = (sum(getattr(t, name) for t in found) for name in ('helped', 'tipped'))
        print(
            f'{kind:8} {count:7} {helped:7} ({helped / count:.1%}) {tipped:6}'
            f'   {gains(found, tips=True):>17}   {gains(found, tips=False):>20}'
        )
        for trial in found:
            if trial.tipped or not trial.helped:
                print(
                    f'    {"tipped" if trial.tipped else "not"}: {trial.advice.sentence}; '
                    f'{trial.before:.3f} -> {trial.after:.3f}, least {trial.least:.3f} rad'
                )
        print(f'{"":8} least tilt left on the way: {least_of(found)}', flush=True)
    print(f'one advice: {cost(settings):.1f} ms (median)')


def gains(found: Sequence[Trial], *, tips: bool) -> str:
    """Return the median gain that was promised, and the one that was measured, as text."""
    chosen = [t for t in found if (t.advice.margin in SIDES) is tips]
    if not chosen:
        return '-'
    promised = float(np.median([t.advice.gain for t in chosen]))
    came = float(np.median([t.after - t.before for t in chosen]))
    if tips:
        return f'{math.degrees(promised):.1f}, {math.degrees(came):.1f} deg'
    return f'{promised:.1f}, {came:.1f} N m'


def least_of(found: Sequence[Trial]) -> str:
    """Return the least tilt of all trials on the way, and at their start, as text."""
    worst = min(found, key=lambda t: t.least)
    began = (
        f', {math.degrees(worst.before):.1f} at its start' if worst.advice.margin in SIDES else ''
    )
    return f'{math.degrees(worst.least):.1f} deg{began}'


def cost(settings: Settings) -> float:
    """Return the time one advice takes (ms), the median of random cases that need one."""
    times = []
    for case in random_cases(settings.robot, 200, SEED, steepest=0.5):
        down = gravity_on_slope(settings.robot.gravity, case.tilt, case.heading).tolist()
        start = time.perf_counter()
        if advise(settings, case.q, down, case.payload):
            times.append(1e3 * (time.perf_counter() - start))
    return float(np.median(times))


if __name__ == '__main__':
    main()
