"""How often `ugv-acceptance model --power-loss` is right, on light robots with heavy arms.

Truth is the same floating base with what nobody knows beforehand: a damping of its own for every
joint, the friction of the ground, a posture that is off by a degree. It shows what three dampings
miss of these, not what MuJoCo misses of the world.

    python -m bench.bench_power_loss [true tips wanted] [seed]
"""

import math
import sys
from collections import Counter
from dataclasses import replace

import numpy as np

from ugv_acceptance.model.robot import Contact, Joint, Link, Matrix, Payload, Robot, Vector
from ugv_acceptance.simulation.oracle import OVER
from ugv_acceptance.simulation.power_loss import (
    DAMPINGS,
    MAY_TIP,
    NOT_SEEN_TO_TIP,
    TIPS,
    Released,
    let_go,
    power_loss,
)
from ugv_acceptance.simulation.vehicle import gravity_on_slope

SEED = 2024
# Standard deviation (rad) of the posture's error.
OFF = math.radians(1.0)
LIFT: Vector = (0.0, -1.0, 0.0)


def bar(mass: float, length: float) -> Matrix:
    """Return the inertia of a thin bar along x (kg, m) about its centre."""
    long, thin = mass * length**2 / 12.0, mass * 0.05**2 / 12.0
    return ((thin, 0.0, 0.0), (0.0, long, 0.0), (0.0, 0.0, long))


def light_robot(rng: np.random.Generator) -> Robot:
    """Return a random base of 3 to 10 kg with an arm of 3 to 10 kg and a load."""
    x, y = rng.uniform(0.15, 0.35), rng.uniform(0.1, 0.25)
    base, upper, fore = rng.uniform(3.0, 10.0), rng.uniform(1.5, 5.0), rng.uniform(1.5, 5.0)
    long, far = rng.uniform(0.25, 0.6), rng.uniform(0.25, 0.6)
    box = tuple(
        tuple(base / 12.0 * v if k == m else 0.0 for m in range(3))
        for k, v in enumerate((4 * y * y + 0.02, 4 * x * x + 0.02, 4 * (x * x + y * y)))
    )
    links = (
        Link('base_link', base, (0.0, 0.0, 0.08), box),  # type: ignore[arg-type]
        Link('turret', 0.5, (0.0, 0.0, 0.05), bar(0.5, 0.1)),
        Link('upper', upper, (long / 2, 0.0, 0.0), bar(upper, long)),
        Link('fore', fore, (far / 2, 0.0, 0.0), bar(fore, far)),
        Link('hand'),
    )
    place = (float(rng.uniform(-0.5, 0.8)) * x, 0.0, 0.18)
    joints = (
        Joint('turret', 'continuous', 'base_link', 'turret', place, axis=(0.0, 0.0, 1.0)),
        Joint('shoulder', 'revolute', 'turret', 'upper', (0, 0, 0.05), axis=LIFT,
              lower=-0.8, upper=3.6),
        Joint('elbow', 'revolute', 'upper', 'fore', (long, 0, 0), axis=LIFT, lower=-2.7, upper=2.7),
        Joint('wrist', 'fixed', 'fore', 'hand', (far, 0.0, 0.0)),
    )  # fmt: skip
    feet = tuple(
        Contact(f'{front}_{side}', 'base_link', (front * x, side * y, 0.0))
        for front in (-1, 1)
        for side in (-1, 1)
    )
    load = Payload(float(rng.uniform(0.0, 4.0)))
    names = ('turret', 'shoulder', 'elbow')
    return Robot('light', links, joints, names, feet, payload_link='hand', payload=load)


def random_release(rng: np.random.Generator) -> Released:
    """Return a light robot in a random posture on a slope of up to 15 deg."""
    robot = light_robot(rng)
    q = (rng.uniform(-math.pi, math.pi), rng.uniform(0.0, 2.8), rng.uniform(-2.4, 2.4))
    down = gravity_on_slope(9.81, math.radians(rng.uniform(0, 15)), rng.uniform(-3.2, 3.2))
    return Released(robot, tuple(map(float, q)), robot.payload, tuple(down.tolist()))


def truth(released: Released, rng: np.random.Generator) -> tuple[bool, bool]:
    """Return whether it tips with what is not known beforehand, and whether it stood before."""
    q = np.array(released.q) + rng.normal(0.0, OFF, len(released.q))
    damping = np.exp(rng.uniform(np.log(DAMPINGS[0]), np.log(DAMPINGS[-1]), len(q)))
    real = replace(released, q=tuple(q.tolist()))
    turned, stood = let_go(real, damping.tolist(), float(rng.uniform(0.5, 1.0)))
    return turned > OVER, stood


def main() -> None:
    """Print how often each answer was given and was right."""
    wanted, seed = ([int(a) for a in sys.argv[1:]] + [100, SEED][len(sys.argv) - 1 :])[:2]
    rng = np.random.default_rng(seed)
    counts: Counter[tuple[str, bool]] = Counter()
    fell_before = 0
    while sum(n for (_, tipped), n in counts.items() if tipped) < wanted:
        released = random_release(rng)
        tipped, stood = truth(released, rng)
        if not stood:  # with power too
            fell_before += 1
            continue
        found = power_loss(released)
        if not found.stood:  # which the verb says: it is no answer about the power
            fell_before += 1
            continue
        counts[found.answer, tipped] += 1
    print(f'seed {seed}: {counts.total()} that stood ({fell_before} others fell with power)')
    for answer in (TIPS, MAY_TIP, NOT_SEEN_TO_TIP):
        print(f'{answer:16} tipped {counts[answer, True]:4}, not {counts[answer, False]:4}')
    told = counts[TIPS, True] + counts[MAY_TIP, True]
    all_tips = counts[TIPS, False] + counts[TIPS, True]
    print(f'TIPS or MAY TIP found {told} of {told + counts[NOT_SEEN_TO_TIP, True]} tips')
    print(f'TIPS was right {counts[TIPS, True]} of {all_tips} times')


if __name__ == '__main__':
    main()
