"""Resuming a campaign: what a run costs whose files are unchanged, beside the listing alone.

`python -m bench.bench_campaign --resume RUNS` prints it, for a folder and for an S3 server (moto)
in a process of its own. Floor: finding the recordings, which has to list them. `reads all` is
`--rehash`: every recording fetched and hashed, as before hashes were remembered.
"""

import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median

import fsspec

from ugv_acceptance.campaign.carry_out import Place, carry_out
from ugv_acceptance.campaign.marks import RECENT_NS
from ugv_acceptance.campaign.sources import find_sources
from ugv_acceptance.campaign.work import Brief
from ugv_acceptance.config import load
from ugv_acceptance.run.catalogue import case_of
from ugv_acceptance.run.record import record

ROUNDS = 5
BUCKET = 'campaign'


def print_resume(runs: int, seconds: float) -> None:
    """Print CPU and wall time a run, medians of rounds, for a folder and for S3."""
    with tempfile.TemporaryDirectory(prefix='resume-') as made:
        folder = Path(made) / 'runs'
        write_copies(folder, runs, seconds)
        with s3_of(folder) as url:
            time.sleep(2e-9 * RECENT_NS)  # what is too new is not remembered
            print(f'{runs} runs of {seconds:g} s; CPU and wall ms a run, medians of {ROUNDS}')
            print(f'{"where":8}{"what":16}{"CPU":>9}{"wall":>9}{"x the listing (wall)":>22}')
            for where, place in (('folder', str(folder)), ('S3', url)):
                print_place(where, place, Path(made) / where, runs)


def print_place(where: str, place: str, out: Path, runs: int) -> None:
    """Print the lines of one place; its first campaign, from nothing, is not timed."""
    brief, to = Brief(load()), Place(out, 1)
    carry_out(find_sources([place]), brief, to)

    def resumed(*, rehash: bool) -> None:
        _, effort = carry_out(find_sources([place]), brief, to, rehash=rehash)
        if (effort.judged, effort.unchanged) != (0, 0 if rehash else runs):
            raise SystemExit(f'{where}: expected {runs} unchanged runs, got {effort}')

    ways: dict[str, tuple[int, Callable[[], object]]] = {
        'listing alone': (ROUNDS, lambda: find_sources([place])),
        'resumed': (ROUNDS, lambda: resumed(rehash=False)),
        'reads all': (1, lambda: resumed(rehash=True)),
    }
    took: dict[str, list[tuple[float, float]]] = {name: [] for name in ways}
    for k in range(ROUNDS):
        for name, (rounds, way) in ways.items():
            if k < rounds:
                took[name].append(timed(way))
    wall = {name: median(one[1] for one in found) for name, found in took.items()}
    for name, found in took.items():
        cpu = median(one[0] for one in found) / runs * 1e3
        ratio = wall[name] / wall['listing alone']
        print(f'{where:8}{name:16}{cpu:9.3f}{wall[name] / runs * 1e3:9.3f}{ratio:22.1f}')


def timed(way: Callable[[], object]) -> tuple[float, float]:
    """Return CPU and wall seconds."""
    cpu, wall = time.process_time(), time.perf_counter()
    way()
    return time.process_time() - cpu, time.perf_counter() - wall


def write_copies(folder: Path, count: int, seconds: float) -> None:
    """Write one simulated run and copies of it."""
    config = load()
    record(config, case_of('work', config.settings.robot, 1, seconds), 1, folder / 'run_0')
    for k in range(1, count):
        shutil.copytree(folder / 'run_0', folder / f'run_{k}')


@contextmanager
def s3_of(folder: Path) -> Iterator[str]:
    """Give the URL of a folder's copy on an S3 server; fsspec finds it meanwhile."""
    with socket.socket() as free:
        free.bind(('127.0.0.1', 0))
        port = free.getsockname()[1]
    os.environ.update(NO_PROXY='127.0.0.1', AWS_EC2_METADATA_DISABLED='true')
    server = subprocess.Popen(
        [sys.executable, '-m', 'moto.server', '-H', '127.0.0.1', '-p', str(port)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        fsspec.config.conf['s3'] = {
            'endpoint_url': f'http://127.0.0.1:{port}',
            'key': 'nobody',
            'secret': 'secret',
        }
        wait_for(port)
        system = fsspec.filesystem('s3')
        system.mkdir(BUCKET)
        system.put(f'{folder}/', f'{BUCKET}/runs', recursive=True)
        yield f's3://{BUCKET}/runs'
    finally:
        server.terminate()
        server.wait()


def wait_for(port: int) -> None:
    """Wait until somebody listens at a port of this machine."""
    for _ in range(200):
        with socket.socket() as tried:
            if tried.connect_ex(('127.0.0.1', port)) == 0:
                return
        time.sleep(0.1)
    raise SystemExit('the S3 server did not start')
