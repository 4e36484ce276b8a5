"""How often efforts are named rightly: falsified robots against the truth, with many seeds.

`python -m bench.effort_meanings [--seeds N] [--postures P] [--robots DIR]`
"""

import argparse
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))

from evaluation.effort.falsified import (
    MEANINGS,
    SHARED,
    Falsified,
    Off,
    falsified,
    others,
    own_robots,
)

from ugv_acceptance.evaluation.effort.facts import UNKNOWN
from ugv_acceptance.evaluation.effort.meaning import name_meanings
from ugv_acceptance.model.robot import Robot

# What is tried: name, meanings mixed in one arm, how far the truth is off.
TRIED = (
    ('one meaning an arm', False, Off()),
    ('mixed', True, Off()),
    ('friction 8 to 25 %', False, Off(friction=(0.08, 0.25))),
)


@dataclass(slots=True)
class Count:
    """Joints by (truth, name), wrong ones, seconds of processor."""

    joints: Counter[tuple[str, str]] = field(default_factory=Counter)
    wrong: list[tuple[str, str, str, str]] = field(default_factory=list)
    runs: int = 0
    seconds: float = 0.0

    def take(self, robot: str, names: tuple[str, ...], run: Falsified) -> None:
        """Name a run's efforts and count what came."""
        began = time.process_time()
        found = name_meanings(run.arm)
        self.seconds += time.process_time() - began
        self.runs += 1
        for name, truth, one in zip(names, run.truth, found, strict=True):
            self.joints[truth, one.meaning] += 1
            if one.meaning not in (truth, UNKNOWN):
                self.wrong.append((robot, name, truth, one.meaning))

    def told(self, title: str) -> str:
        """Return the figures as text."""
        total = self.joints.total()
        right = sum(n for (truth, name), n in self.joints.items() if truth == name)
        unknown = sum(n for (_, name), n in self.joints.items() if name == UNKNOWN)
        named = max(total - unknown, 1)
        first = (
            f'{title}: {self.runs} runs, {total} joints; of the named right {right / named:.2%}, '
            f'unknown {unknown / total:.1%}; {self.seconds / max(self.runs, 1):.3f} s a run'
        )
        lines = [
            f'  {truth}: ' + ', '.join(
                f'{name} {n}' for (t, name), n in sorted(self.joints.items()) if t == truth
            )
            for truth in MEANINGS
        ]  # fmt: skip
        return '\n'.join([first, *lines, f'  wrong: {self.wrong[:10]}'])


def trial(robots: list[tuple[str, Robot]], seeds: range, postures: int) -> None:
    """Try every kind on every robot, and print the figures."""
    for title, mixed, off in TRIED:
        count = Count()
        for k, (name, robot) in enumerate(robots):
            for seed in seeds:
                for m, meaning in enumerate(MEANINGS):
                    rng = np.random.default_rng((seed, k, m, mixed))
                    meanings = MEANINGS if mixed else (meaning,)
                    run = falsified(robot, meanings, postures, rng, off=off)
                    count.take(name, robot.joint_names, run)
        print(count.told(title), flush=True)


def main() -> None:
    """Print how often efforts are named rightly."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seeds', type=int, default=4)
    parser.add_argument('--first', type=int, default=0)
    parser.add_argument('--postures', type=int, default=8)
    parser.add_argument('--trees', type=int, default=4)
    parser.add_argument('--robots', type=Path, default=SHARED)
    asked = parser.parse_args()
    robots = [*own_robots(asked.first, asked.trees), *others(asked.robots)]
    trial(robots, range(asked.first, asked.first + asked.seeds), asked.postures)


if __name__ == '__main__':
    main()
