"""How often a noisy margin about its limit raises an alert: our rules against a bare threshold.

A tilt that swings one degree about the warning limit for ten minutes at 50 Hz, measured with a
noise of half a degree. The number of alerts raised is counted.

    python -m bench.bench_chatter [swings a minute ...]
"""

import math
import sys
from dataclasses import replace

import numpy as np

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.alerts.rules import RuleSet
from ugv_acceptance.evaluation.alerts.state_machine import Alert, Rule, Signal
from ugv_acceptance.evaluation.settings import Settings

RATE, LENGTH = 50, 600.0
NOISE, SWING = math.radians(0.5), math.radians(1.0)
SEED = 6


def hovering(limit: float, swings: float) -> np.ndarray:
    """Return the watched value, minus the tilt left (rad), swinging about its limit."""
    time = np.arange(0.0, LENGTH, 1.0 / RATE)
    swing = SWING * np.sin(2.0 * math.pi * swings / 60.0 * time)
    return limit + swing + np.random.default_rng(SEED).normal(0.0, NOISE, len(time))


def activations(rule: Rule, values: np.ndarray) -> int:
    """Return how many alerts a rule raises."""
    log: list[Alert] = []
    signal = Signal(rule, log)
    for k, value in enumerate(values.tolist()):
        signal.step(int(k * 1e9 / RATE), value)
    return len(log)


def rules(settings: Settings) -> dict[str, Rule]:
    """Return the bare threshold and what is added to it, step by step, up to our own rule."""
    ours = RuleSet(settings).tip[0][0].rule
    bare = replace(ours, off=ours.on, on_delay=0, off_delay=0)
    deadband = replace(ours, on_delay=0, off_delay=0)
    return {
        'bare threshold': bare,
        'with the deadband': deadband,
        'with the on-delay too': replace(deadband, on_delay=ours.on_delay),
        'ours, with the off-delay': ours,
    }


def main() -> None:
    """Print the table."""
    swings = [float(a) for a in sys.argv[1:]] or [3.0, 6.0, 12.0, 30.0]
    print(f'alerts in {LENGTH / 60:.0f} min; swings a minute: {swings}')
    for name, rule in rules(load().settings).items():
        counts = [activations(rule, hovering(rule.on, s)) for s in swings]
        print(f'{name:28}' + ''.join(f'{count:8}' for count in counts))


if __name__ == '__main__':
    main()
