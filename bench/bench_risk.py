"""Risk: Monte Carlo against the cost of its random numbers, memory, quadrature.

python -m bench.bench_risk [samples]
"""

import math
import resource
import sys
import time

from bench.quadrature import saturation_probability
from ugv_acceptance.config import load
from ugv_acceptance.studies.planar import PAPER, arm_robot
from ugv_acceptance.studies.risk import BLOCK, Study, run
from ugv_acceptance.studies.spread import Spread, generators, normal, uniform


def mebibytes() -> float:
    """Return the largest resident memory so far (MiB)."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def two_link() -> Study:
    """Return the paper's arm with two angles, the load and both limits uncertain."""
    spreads = {
        'theta1.position': uniform(0.0, math.pi),
        'theta2.position': uniform(0.0, 2.0 * math.pi),
        'payload.mass': normal(4.0, 0.4),
        'theta1.limit': normal(50.0, 5.0),
        'theta2.limit': normal(50.0, 5.0),
    }
    return Study(arm_robot(PAPER), spreads, (0.0, 0.0), (50.0, 50.0))


def packbot() -> Study:
    """Return the PackBot on random slopes: posture, rates, load and masses uncertain."""
    settings = load().settings
    turn = uniform(-math.pi, math.pi)
    spreads: dict[str, Spread] = {
        'slope': uniform(0.0, math.radians(30.0)),
        'heading': turn,
        'turret_joint.position': turn,
        'shoulder_joint.position': uniform(0.0, math.pi),
        'elbow_joint.position': turn,
        'shoulder_joint.rate': normal(0.0, 0.3),
        'elbow_joint.rate': normal(0.0, 0.3),
        'payload.mass': uniform(0.0, 4.0),
        **{f'payload.{axis}': normal(0.0, 0.02) for axis in 'xyz'},
        'chassis_link.mass': uniform(15.0, 20.0),
        'chassis_link.x': normal(0.010, 0.016),
        'chassis_link.y': normal(0.0, 0.010),
        'chassis_link.z': normal(0.094, 0.006),
        'arm_link_1.mass': normal(2.5, 0.05),
        'arm_link_2.mass': normal(2.5, 0.05),
    }
    return Study(settings.robot, spreads, (0.0, 0.0, 0.0, math.pi), settings.limits.torque)


def draw(study: Study, samples: int) -> None:
    """Draw the random numbers of a study and nothing else."""
    (rng,) = generators(1, 1)
    for _ in range(samples // BLOCK):
        for spread in study.spreads.values():
            spread.draw(rng, BLOCK)


def monte_carlo(name: str, study: Study, samples: int) -> float:
    """Print one row and return the CPU seconds a sample."""
    run(study, 10_000, 1, 1)  # compile
    start = time.process_time()
    draw(study, samples)
    drawn, before = time.process_time() - start, mebibytes()
    start, wall = time.process_time(), time.perf_counter()
    found = run(study, samples, 1, 1)
    cpu, wall = time.process_time() - start, time.perf_counter() - wall
    best = found.estimates['either']
    print(
        f'{name:10}{len(study.spreads):4} inputs{drawn / samples * 1e9:8.0f} ns draw'
        f'{cpu / samples * 1e9:8.0f} ns in all{cpu / drawn:6.2f} x'
        f'   memory +{mebibytes() - before:.1f} MiB   P {best.probability:.5f}'
        f' [{best.low:.5f}, {best.high:.5f}]'
    )
    return cpu / samples


def main(samples: int = 4_000_000) -> None:
    """Print the table."""
    print(f'{samples} samples, one thread')
    each = monte_carlo('two-link', two_link(), samples)
    monte_carlo('PackBot', packbot(), samples)
    exact = saturation_probability(
        uniform(0.0, math.pi), normal(4.0, 0.4), normal(50.0, 5.0), nodes=(128, 256, 32)
    )
    spread = math.sqrt(exact * (1.0 - exact))
    print('quadrature, two-link: work against Monte Carlo at the same standard error')
    for nodes in ((16, 32, 6), (24, 48, 8), (48, 96, 12)):
        best = math.inf
        for _ in range(7):
            start = time.process_time()
            found = saturation_probability(
                uniform(0.0, math.pi), normal(4.0, 0.4), normal(50.0, 5.0), nodes=nodes
            )
            best = min(best, time.process_time() - start)
        error = max(abs(found - exact), 1e-12)
        needed = (spread / error) ** 2
        print(
            f'  {nodes!s:14} P {found:.8f} error {error:.1e}{best * 1e3:8.2f} ms'
            f'   {needed:.1e} samples would take {needed * each:.1e} s:'
            f' {needed * each / best:.0f} x'
        )


if __name__ == '__main__':
    main(*(int(a) for a in sys.argv[1:]))
