"""Judges runs on several workers: processes here, or a dask.distributed cluster.

Results come as they are ready. A worker that dies (no memory, a crash in a library) loses only the
run that killed it; that run counts as not judged, which says nothing about it.
"""

import multiprocessing
import os
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from threading import Thread

from ugv_acceptance.campaign.batches import AHEAD, DIED, Runs, Work, batches, each
from ugv_acceptance.campaign.cluster import WAIT_S, on_cluster
from ugv_acceptance.campaign.sources import Source
from ugv_acceptance.campaign.work import Brief, Done, judge_source
from ugv_acceptance.processes import Workers


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity') else os.cpu_count() or 1


def judge_all(
    sources: Sequence[Source],
    brief: Brief,
    workers: int,
    scheduler: str | None = None,
    wait_s: float = WAIT_S,
) -> Iterator[Done]:
    """Yield the outcome of every run, in the order in which they are ready.

    A dask `scheduler` or its workers, once gone, are waited for up to `wait_s`.
    """
    if scheduler is not None:
        yield from on_cluster(partial(judge_source, brief=brief), sources, scheduler, wait_s)
    elif min(workers, len(sources)) == 1:
        yield from (judge_source(source, brief) for source in sources)
    else:
        yield from in_processes(
            partial(judge_source, brief=brief), sources, min(workers, len(sources))
        )


def in_processes(work: Work, sources: Sequence[Source], workers: int) -> Iterator[Done]:
    """Yield the outcome of `work` for every source, computed by processes of this machine."""
    waiting = deque(batches(sources, workers))
    suspects: Runs = []
    while waiting:
        yield from _round(work, waiting, workers, suspects)
    for source in suspects:
        alone: Runs = []
        yield from _round(work, deque([[source]]), 1, alone)
        yield from (Done(one, lost=DIED) for one in alone)


def _end_with_parent() -> None:
    """Make this worker end when the campaign's process ends, even if that was killed."""

    def watch() -> None:
        if parent := multiprocessing.parent_process():
            parent.join()
            os._exit(1)

    Thread(target=watch, daemon=True).start()


def _round(work: Work, waiting: deque[Runs], workers: int, suspects: Runs) -> Iterator[Done]:
    """Work until all is done or a process dies; the runs then in work are added to `suspects`."""
    # Forked by a server that has all imported: a fork of this process, which has threads, may hang,
    # and spawned processes would each import everything anew.
    context = multiprocessing.get_context('forkserver')
    context.set_forkserver_preload([judge_source.__module__])
    given: dict[Future[list[Done]], Runs] = {}
    with Workers(workers, mp_context=context, initializer=_end_with_parent) as pool:
        try:
            while waiting or given:
                while waiting and len(given) < AHEAD * workers:
                    given[pool.submit(each, work, waiting[0])] = waiting[0]
                    waiting.popleft()
                ready, _ = wait(given, return_when=FIRST_COMPLETED)
                for future in ready:
                    found = future.result()
                    del given[future]
                    yield from found
        except BrokenProcessPool:
            suspects += [source for batch in given.values() for source in batch]
