"""A dask scheduler and its workers as processes of their own, which a test can kill."""

import os
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import distributed

TEST = Path(__file__).parents[1]
PATH = os.pathsep.join((str(TEST.parent), str(TEST)))


class Cluster:
    """A scheduler on loopback, at the same port when it is started again, and plain workers."""

    def __init__(self, folder: Path) -> None:
        """Take a free port; nothing runs yet. Processes work in `folder`."""
        self.folder = folder
        self.scheduler: subprocess.Popen[bytes] | None = None
        self.workers: list[subprocess.Popen[bytes]] = []
        with socket.socket() as probe:
            probe.bind(('127.0.0.1', 0))
            self.port: int = probe.getsockname()[1]

    @property
    def address(self) -> str:
        """Where the scheduler listens."""
        return f'tcp://127.0.0.1:{self.port}'

    def start(self, workers: int) -> None:
        """Start the scheduler, if none runs, and workers until so many live; wait for all."""
        if self.scheduler is None:
            words = ('dask_scheduler', '--host', '127.0.0.1', '--port', str(self.port))
            self.scheduler = self._process(*words, '--no-dashboard', '--no-show')
        options = ('--no-nanny', '--nthreads', '1', '--memory-limit', '0', '--no-dashboard')
        self.workers = [worker for worker in self.workers if worker.poll() is None]
        while len(self.workers) < workers:
            self.workers.append(self._process('dask_worker', self.address, *options))
        connect: Any = distributed.Client
        with connect(self.address, timeout='60s', set_as_default=False) as client:
            if workers:
                client.wait_for_workers(workers, timeout=60)

    def _process(self, module: str, *words: str) -> 'subprocess.Popen[bytes]':
        command = [sys.executable, '-m', f'distributed.cli.{module}', *words]
        kept = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
        return subprocess.Popen(
            command,
            env={**kept, 'PYTHONPATH': PATH},
            cwd=self.folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def kill_workers(self) -> None:
        """Kill all workers: kill -9."""
        for worker in self.workers:
            worker.kill()
            worker.wait()
        self.workers.clear()

    def kill_scheduler(self) -> None:
        """Kill the scheduler: kill -9. Its workers end, as they do by themselves."""
        if self.scheduler is not None:
            self.scheduler.kill()
            self.scheduler.wait()
        self.scheduler = None
        self.kill_workers()
