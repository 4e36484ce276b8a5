"""Speed of simulating and recording a vehicle, as a factor of real time: on one core, and on both.

A run is recorded with the IMU at 400 Hz and the joints at 200 Hz into a rosbag2 folder (MCAP, zstd,
CRC). CPU seconds for one run, wall seconds for a batch on two processes; medians of rounds in turn.

    python -m bench.bench_simulation [seconds]
"""

import statistics
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache
from multiprocessing import get_context
from pathlib import Path

import mujoco

from ugv_acceptance.config import Config, load
from ugv_acceptance.run.catalogue import Case
from ugv_acceptance.run.record import record
from ugv_acceptance.simulation.scenario import Scenario
from ugv_acceptance.simulation.scenarios import SCENARIOS
from ugv_acceptance.simulation.simulation import BUILD
from ugv_acceptance.simulation.stretches import run
from ugv_acceptance.simulation.vehicle import vehicle_of

ROUNDS = 3
BATCH = 6
# Goals: simulated seconds a CPU second on one core, a wall second on two.
ONE, TWO = 40.0, 80.0


@cache
def config() -> Config:
    """Return the configuration that ships, once a process."""
    return load()


def scenario(name: str, seconds: float) -> Scenario:
    """Return a run at full rates."""
    return replace(SCENARIOS[name](), duration=seconds, joint_rate=200.0, imu_rate=400.0)


def recorded(name: str, seconds: float, seed: int) -> float:
    """Return CPU seconds of one run that is recorded."""
    loaded, case = config(), Case(scenario(name, seconds))
    with tempfile.TemporaryDirectory() as folder:
        start = time.process_time()
        record(loaded, case, seed, Path(folder) / 'run')
        return time.process_time() - start


def kept(name: str, seconds: float, seed: int) -> float:
    """Return CPU seconds of one run whose samples are kept as arrays."""
    robot = config().settings.robot
    start = time.process_time()
    run(robot, scenario(name, seconds), seed)
    return time.process_time() - start


def bare(seconds: float) -> float:
    """Return CPU seconds of the vehicle alone, stepped in one call without sensors or recording."""
    vehicle = vehicle_of(config().settings.robot, BUILD)
    data = mujoco.MjData(vehicle.model)
    start = time.process_time()
    mujoco.mj_step(vehicle.model, data, nstep=round(seconds / vehicle.model.opt.timestep))
    return time.process_time() - start


def main() -> None:
    """Print real-time factors."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 20.0
    rows: dict[str, list[float]] = {}
    for k in range(ROUNDS):
        rows.setdefault('bare stepping', []).append(bare(seconds))
        for name in SCENARIOS:
            rows.setdefault(f'{name}, arrays', []).append(kept(name, seconds, k))
            rows.setdefault(f'{name}, recorded', []).append(recorded(name, seconds, k))
    print(f'one core: simulated seconds a CPU second (median, worst); goal {ONE:.0f} recorded')
    for name, times in rows.items():
        print(f'  {name:20} {seconds / statistics.median(times):6.0f} {seconds / max(times):6.0f}')
    with ProcessPoolExecutor(2, mp_context=get_context('spawn')) as pool:
        list(pool.map(recorded, ['gentle'] * 2, [1.0] * 2, range(2)))  # imports
        start = time.perf_counter()
        cpu = sum(pool.map(recorded, ['gentle'] * BATCH, [seconds] * BATCH, range(BATCH)))
        wall = time.perf_counter() - start
    print(
        f'two processes, recorded: {BATCH * seconds / wall:.0f} simulated seconds a wall second; '
        f'goal {TWO:.0f}'
    )
    print(f'  {2 * BATCH * seconds / cpu:.0f} by their CPU time: had they two cores to themselves')


if __name__ == '__main__':
    main()
