"""Runs given to workers: processes of this machine, or those of a dask.distributed scheduler.

Results come as they are ready. A worker that dies (no memory, a crash in a library) takes only the
run down that killed it.
"""

import multiprocessing
import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path
from threading import Thread
from typing import Any

from ugv_acceptance import AcceptanceError
from ugv_acceptance.campaign.sources import Source
from ugv_acceptance.campaign.work import Brief, Done, judge_source

DIED = 'the process that judged it died (out of memory, or a crash in a library)'
# Batches given out ahead, a worker: few runs are to be looked at again where one dies.
_AHEAD = 2
# A batch is so many runs or bytes at most: short runs cost less than the way to a worker and back.
_BATCH, _BATCH_BYTES = 16, 4 << 20

Work = Callable[[Source], Done]
Runs = list[Source]


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


def in_processes(work: Work, sources: Sequence[Source], workers: int) -> Iterator[Done]:
    """Yield the outcome of `work` for every source, done by processes."""
    waiting = deque(batches(sources, workers))
    suspects: Runs = []
    while waiting:
        yield from _round(work, waiting, workers, suspects)
    for source in suspects:
        alone: Runs = []
        yield from _round(work, deque([[source]]), 1, alone)
        yield from (Done(one, error=DIED) for one in alone)


def batches(sources: Sequence[Source], workers: int) -> Iterator[Runs]:
    """Yield the sources in batches, small enough for all workers to have some until the end."""
    most = max(1, min(_BATCH, len(sources) // (8 * workers)))
    batch: Runs = []
    size = 0
    for source in sources:
        batch.append(source)
        size += _BATCH_BYTES if source.remote else _bytes(source)
        if len(batch) >= most or size >= _BATCH_BYTES:
            yield batch
            batch, size = [], 0
    if batch:
        yield batch


def _bytes(source: Source) -> int:
    return sum(Path(file).stat().st_size for file in source.files if Path(file).is_file())


def _each(work: Work, batch: Runs) -> list[Done]:
    return [work(source) for source in batch]


def _end_with_parent() -> None:
    """Ask this worker to end when the campaign does, even one that was killed."""

    def watch() -> None:
        if parent := multiprocessing.parent_process():
            parent.join()
            os._exit(1)

    Thread(target=watch, daemon=True).start()


def _round(work: Work, waiting: deque[Runs], workers: int, suspects: Runs) -> Iterator[Done]:
    """Work until nothing waits or a process dies; then those given out are the suspects."""
    # Forked by a server that has all imported: a fork of this process, which has threads, may hang,
    # and spawned processes would each import everything anew.
    context = multiprocessing.get_context('forkserver')
    context.set_forkserver_preload([judge_source.__module__])
    given: dict[Future[list[Done]], Runs] = {}
    with ProcessPoolExecutor(workers, mp_context=context, initializer=_end_with_parent) as pool:
        try:
            while waiting or given:
                while waiting and len(given) < _AHEAD * workers:
                    given[pool.submit(_each, work, waiting[0])] = waiting[0]
                    waiting.popleft()
                ready, _ = wait(given, return_when=FIRST_COMPLETED)
                for future in ready:
                    found = future.result()
                    del given[future]
                    yield from found
        except BrokenProcessPool:
            suspects += [source for batch in given.values() for source in batch]


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
