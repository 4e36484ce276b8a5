"""Throughput of a campaign: `python -m bench.bench_campaign [FOLDER]`, one worker against several.

FOLDER holds recordings, such as make_fleet.py writes; without it one-minute bags with the rates of
a real robot are written: joint states at 200 Hz, IMU at 400 Hz, zstd. The campaign runs in a fresh
folder each time, one worker on one core alone. Wall times tell something on a quiet machine only,
CPU times on any; starting the workers takes about a second. Says what 100,000 one-hour bags would
cost, from the time a recorded hour takes. With `--resume RUNS` it measures instead what resuming a
campaign costs, beside listing its recordings alone: campaign_resume.py.
"""

import argparse
import os
import shutil
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from bench.campaign_resume import print_resume
from ugv_acceptance.campaign.carry_out import Place, carry_out
from ugv_acceptance.campaign.pool import cores
from ugv_acceptance.campaign.sources import find_sources
from ugv_acceptance.campaign.work import Brief
from ugv_acceptance.config import load
from ugv_acceptance.run.catalogue import case_of
from ugv_acceptance.run.record import record

BAGS = 100_000


@dataclass(frozen=True, slots=True)
class Measured:
    """The cost of a campaign: wall and CPU seconds (of judging alone), bags, bytes, hours."""

    wall: float
    cpu: float
    bags: int
    size: int
    hours: float


def measure(folder: Path, workers: int) -> Measured:
    """Run a campaign from nothing and return what it took."""
    out = Path(tempfile.mkdtemp(prefix='campaign-'))
    sources, brief = find_sources([str(folder)]), Brief(load())
    began = time.perf_counter()
    rows, effort = carry_out(sources, brief, Place(out, workers))
    took = time.perf_counter() - began
    shutil.rmtree(out)
    hours = sum(row.duration_s * (1 + len(row.also)) for row in rows) / 3600.0
    return Measured(took, effort.cpu, effort.judged, effort.size, hours)


def write_bags(folder: Path, count: int, seconds: float) -> None:
    """Write one simulated shift and copies of it; each is judged as if it were another run."""
    config = load()
    case = case_of('work', config.settings.robot, 1, seconds)
    record(config, case, 1, folder / 'run_0')
    for k in range(1, count):
        shutil.copytree(folder / 'run_0', folder / f'run_{k}')


def line(name: str, found: Measured) -> str:
    """Return one line of the table."""
    rate = 3600.0 / found.wall
    return (
        f'{name:12s} {found.wall:7.1f} {found.cpu:7.1f} {found.bags * rate:10.0f}'
        f' {found.size / 1e9 * rate:8.2f} {found.hours * rate:10.0f}'
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('folder', type=Path, nargs='?', help='recordings; made if left out')
    parser.add_argument('--workers', type=int, default=cores())
    parser.add_argument('--bags', type=int, default=8, help='how many to make')
    parser.add_argument('--seconds', type=float, default=60.0, help='how long each')
    parser.add_argument('--resume', type=int, metavar='RUNS', help='measure resuming so many')
    arguments = parser.parse_args()
    if arguments.resume:
        print_resume(arguments.resume, min(arguments.seconds, 5.0))
        return
    with tempfile.TemporaryDirectory(prefix='bags-') as made:
        folder = arguments.folder or Path(made)
        if arguments.folder is None:
            write_bags(folder, arguments.bags, arguments.seconds)
        every = os.sched_getaffinity(0)
        os.sched_setaffinity(0, {min(every)})
        one = measure(folder, 1)
        os.sched_setaffinity(0, every)
        several = measure(folder, arguments.workers)
    print(f'{"workers":12s} {"wall s":>7} {"CPU s":>7} {"bags/h":>10} {"GB/h":>8} {"h/h":>10}')
    print(line('1', one))
    print(line(str(arguments.workers), several))
    gain = one.wall / several.wall
    print(f'gain {gain:.2f}, efficiency {gain / arguments.workers:.0%}, 1-minute load', end=' ')
    print(f'{os.getloadavg()[0]:.1f} on {cores()} cores')
    print(f'CPU of one worker over that of {arguments.workers}: {one.cpu / several.cpu:.0%}')
    core_hours = BAGS * one.cpu / 3600.0 / one.hours
    wall_hours = BAGS * several.wall / 3600.0 / several.hours
    print(f'{BAGS} one-hour bags: {core_hours:.0f} core hours, {wall_hours:.0f} h on this machine,')
    print(f'{BAGS * one.size / one.hours / 1e12:.1f} TB to read')


if __name__ == '__main__':
    main()
