"""Runs given to workers: processes of this machine, or those of a dask.distributed scheduler.

Results come as they are ready. A worker that dies (no memory, a crash in a library) takes only the
run down that killed it.
"""

import multiprocessing
import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from typing import Any

from ugv_acceptance import AcceptanceError
from ugv_acceptance.campaign.sources import Source
from ugv_acceptance.campaign.work import Brief, Done, judge_source

DIED = 'the process that judged it died (out of memory, or a crash in a library)'
# Runs given out ahead, a worker: few are to be looked at again where one dies.
_AHEAD = 2

Work = Callable[[Source], Done]


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity') else os.cpu_count() or 1


def judge_all(
    sources: Sequence[Source], brief: Brief, workers: int, scheduler: str | None = None
) -> Iterator[Done]:
    """Yield what came of every run, in the order in which they are ready."""
    if scheduler is not None:
        yield from on_cluster(sources, brief, scheduler)
    elif min(workers, len(sources)) == 1:
        yield from (judge_source(source, brief) for source in sources)
    else:
        yield from in_processes(
            partial(judge_source, brief=brief), sources, min(workers, len(sources))
        )


def in_processes(work: Work, sources: Iterable[Source], workers: int) -> Iterator[Done]:
    """Yield the outcome of `work` for every source, done by processes."""
    waiting = deque(sources)
    suspects: list[Source] = []
    while waiting:
        yield from _round(work, waiting, workers, suspects)
    for source in suspects:
        alone: list[Source] = []
        yield from _round(work, deque([source]), 1, alone)
        yield from (Done(one, error=DIED) for one in alone)


def _round(
    work: Work, waiting: deque[Source], workers: int, suspects: list[Source]
) -> Iterator[Done]:
    """Work until nothing waits or a process dies; then those given out are the suspects."""
    # Spawned, not forked: a fork of a process with threads may hang.
    context = multiprocessing.get_context('spawn')
    given: dict[Future[Done], Source] = {}
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        try:
            while waiting or given:
                while waiting and len(given) < _AHEAD * workers:
                    given[pool.submit(work, waiting[0])] = waiting[0]
                    waiting.popleft()
                ready, _ = wait(given, return_when=FIRST_COMPLETED)
                for future in ready:
                    done = future.result()
                    del given[future]
                    yield done
        except BrokenProcessPool:
            suspects += given.values()


def on_cluster(sources: Sequence[Source], brief: Brief, address: str) -> Iterator[Done]:
    """Yield the outcome of every source, done by the workers of a dask.distributed scheduler.

    The workers need this package, and see paths as their own: shared disks, or URLs.
    AcceptanceError where there is no scheduler or no dask.
    """
    distributed = _distributed()
    try:
        client = distributed.Client(address, timeout='5s', set_as_default=False)
    except (OSError, ValueError) as error:
        text = ' '.join(str(error).split())[:200]
        raise AcceptanceError(
            f'--scheduler {address}: expected a dask scheduler, got: {text}'
        ) from None
    with client:
        shared = client.scatter(brief, broadcast=True, hash=False)
        futures = client.map(judge_source, sources, brief=shared, pure=False)
        known = dict(zip(futures, sources, strict=True))
        for future in distributed.as_completed(futures, loop=client.loop):
            yield (
                future.result()
                if future.status == 'finished'
                else Done(known[future], error=f'{DIED}: {future.exception()}')
            )
            future.release()


def _distributed() -> Any:  # noqa: ANN401 - a module of an extra
    try:
        import distributed  # noqa: PLC0415 - an extra
    except ImportError:
        raise AcceptanceError(
            "--scheduler: expected dask.distributed (pip install 'ugv_acceptance[cluster]')"
        ) from None
    return distributed
