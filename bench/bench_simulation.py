"""How much faster than real time a vehicle is simulated and recorded: one core, and both.

CPU seconds for one run, wall seconds for a batch on two processes; medians of rounds in turn.

    python bench/bench_simulation.py [seconds]
"""

import statistics
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import mujoco

from ugv_acceptance.config import load
from ugv_acceptance.simulation.run import run
from ugv_acceptance.simulation.scenarios import SCENARIOS
from ugv_acceptance.simulation.simulation import BUILD
from ugv_acceptance.simulation.vehicle import vehicle_of

ROUNDS = 5
BATCH = 8


def recorded(name: str, seconds: float, seed: int) -> float:
    """Return CPU seconds of one run with the IMU at 400 Hz and the joints at 200 Hz recorded."""
    scenario = replace(SCENARIOS[name](), duration=seconds, joint_rate=200.0, imu_rate=400.0)
    robot = load().settings.robot
    start = time.process_time()
    run(robot, scenario, seed)
    return time.process_time() - start


def bare(seconds: float) -> float:
    """Return CPU seconds of the vehicle stepped in one call: what recording adds to."""
    vehicle = vehicle_of(load().settings.robot, BUILD)
    data = mujoco.MjData(vehicle.model)
    start = time.process_time()
    mujoco.mj_step(vehicle.model, data, nstep=round(seconds / vehicle.model.opt.timestep))
    return time.process_time() - start


def main() -> None:
    """Print real-time factors."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 20.0
    rows: dict[str, list[float]] = {'bare stepping': [], **{name: [] for name in SCENARIOS}}
    for k in range(ROUNDS):
        rows['bare stepping'].append(bare(seconds))
        for name in SCENARIOS:
            rows[name].append(recorded(name, seconds, k))
    print('one core: simulated seconds a CPU second (median, worst)')
    for name, times in rows.items():
        print(f'  {name:14} {seconds / statistics.median(times):6.0f} {seconds / max(times):6.0f}')
    with ProcessPoolExecutor(2, mp_context=get_context('spawn')) as pool:
        list(pool.map(recorded, ['gentle'] * 2, [1.0] * 2, range(2)))  # imports
        start = time.perf_counter()
        cpu = sum(pool.map(recorded, ['gentle'] * BATCH, [seconds] * BATCH, range(BATCH)))
        wall = time.perf_counter() - start
    print(f'two processes: {BATCH * seconds / wall:.0f} simulated seconds a wall second,')
    print(f'  {2 * BATCH * seconds / cpu:.0f} by their CPU time: had they two cores to themselves')


if __name__ == '__main__':
    main()
