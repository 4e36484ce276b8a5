"""How often the checks of an IMU in motion find a fault, how soon, and how often they raise one.

Simulated runs of a minute, all drawn from seeds: good ones in several forms, and each kind of
fault. Alerts of the checks at rest are left out.

    python -m bench.imu_checks_trial [runs of each kind]
"""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))

from evaluation.imu_runs import (
    FAULTS,
    NS,
    ImuRun,
    bursty,
    good_run,
    jittery,
    lossy,
    shocked,
)

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.alerts.rules import RuleSet
from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.inputs.imu import ImuTracker

AT_REST = ('IMU_GRAVITY', 'IMU_INCONSISTENT', 'IMU_ORIENTATION', 'IMU_FRAME', 'IMU_NO_GRAVITY')
GOOD: dict[str, Callable[[int], ImuRun]] = {
    'as it is': good_run,
    '30 % lost': lambda seed: lossy(good_run(seed), seed),
    '20 ms jitter': lambda seed: jittery(good_run(seed), seed),
    'bursts of 100 ms': lambda seed: bursty(good_run(seed)),
    'shocks of 60 m/s2': lambda seed: shocked(good_run(seed), seed),
    '50 Hz': lambda seed: good_run(seed, hz=50.0),
    '25 Hz': lambda seed: good_run(seed, hz=25.0),
    'clipped at 2 g': lambda seed: clipped(good_run(seed)),
}


def clipped(run: ImuRun) -> ImuRun:
    """Return a run of an accelerometer that ends at 2 g."""
    return ImuRun(run.time, run.stamp, run.q, run.w, np.clip(run.a, -19.6, 19.6), run.frame)


def alerts_of(run: ImuRun) -> list[Alert]:
    """Return the alerts of the checks in motion."""
    settings = load().settings
    watch = RuleSet(settings)
    with np.errstate(all='ignore'):
        ImuTracker(settings, watch.attitude).columns(run.columns())
    return [alert for alert in watch.log if alert.rule.code not in AT_REST]


def main() -> None:
    """Print false alarms of good runs, and detection of faulty ones."""
    count = int(sys.argv[1]) if sys.argv[1:] else 20
    for name, make in GOOD.items():
        found = [[a.rule.code for a in alerts_of(make(seed))] for seed in range(count)]
        wrong = [codes for codes in found if codes]
        print(f'good, {name:20} {len(wrong):3} of {count} runs with an alert {wrong[:3] or ""}')
    for name, (fault, codes) in FAULTS.items():
        delays = []
        for seed in range(count):
            run = fault(good_run(1000 + seed), np.random.default_rng(seed))
            starts = [a.start for a in alerts_of(run) if a.rule.code in codes]
            if starts:
                delays.append((min(starts) - int(run.time[0])) / NS - run.bad_from)
        times = f'median {np.median(delays):.1f} s, at most {max(delays):.1f} s' if delays else ''
        print(f'{name:20} found in {len(delays):3} of {count} {times}')


if __name__ == '__main__':
    main()
