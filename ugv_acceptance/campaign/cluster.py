"""Judges runs on a dask.distributed cluster, whose workers and scheduler may die or disconnect.

Every batch is sent to one worker by its address, a few batches ahead: so it is known which runs
were lost with a worker. Those are tried again one at a time, after all others, so that a run
that kills its worker takes no other run with it. Where the scheduler goes away, a new connection
is tried.
"""

import logging
import time
from asyncio import CancelledError
from collections import Counter, deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from ugv_acceptance import AcceptanceError, pip_install
from ugv_acceptance.campaign.batches import AHEAD, DIED, Runs, Work, batches, each
from ugv_acceptance.campaign.not_judged import words
from ugv_acceptance.campaign.sources import Source
from ugv_acceptance.campaign.work import Done

# How long (s) to wait for a scheduler or workers that are gone.
WAIT_S = 60.0
# Workers a run may fail on while it has them for itself; and how often it may be lost at all.
_FAULTS, _LOSSES = 2, 8
# Times (s): between checks of the workers; limits to connect, for an answer, for a result.
_LOOK_S, _CONNECT_S, _ANSWER_S, _FETCH_S = 0.5, 5.0, 30.0, 10.0
# dask raises whatever its parts raise: OSError, ValueError, RuntimeError, its own cancellation.
_ANY = (Exception, CancelledError)


@dataclass(frozen=True, slots=True)
class _Given:
    """A batch sent to a worker, by its address; `alone`: as the only one that worker has."""

    future: Any
    worker: str
    runs: Runs
    alone: bool


def on_cluster(
    work: Work, sources: Sequence[Source], address: str, wait_s: float = WAIT_S
) -> Iterator[Done]:
    """Yield the outcome of `work` for every source, computed by the workers of a dask scheduler.

    The workers need this package, and the same paths: shared disks, or URLs. Without a scheduler or
    a worker for `wait_s` the rest is not judged. Raises AcceptanceError where there is no scheduler
    to begin with, or no dask.
    """
    distributed = _distributed()
    try:
        client = _connected(distributed, address, _CONNECT_S)
    except (OSError, ValueError) as error:
        raise AcceptanceError(
            f'--scheduler {address}: expected a dask scheduler, got: {words(error)}'
        ) from None
    given_out = _GivenOut(distributed, work, address, wait_s, list(sources), client)
    with _quiet():
        try:
            yield from given_out.judged()
        finally:
            given_out.disconnect()


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence dask's own log about lost work: each lost run is reported by us."""
    logs = [logging.getLogger(name) for name in ('distributed', 'distributed.client')]
    before = [log.level for log in logs]
    for log in logs:
        log.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for log, level in zip(logs, before, strict=True):
            log.setLevel(level)


def _connected(distributed: Any, address: str, patience: float) -> Any:  # noqa: ANN401 - an extra
    return distributed.Client(address, timeout=patience, set_as_default=False)


@dataclass(slots=True)
class _GivenOut:
    """The state of a campaign on a cluster: batches that wait, are sent out, and have come back."""

    distributed: Any
    work: Work
    address: str
    wait_s: float
    unsorted: list[Source]
    client: Any
    waiting: deque[Runs] = field(default_factory=deque)
    suspects: deque[Source] = field(default_factory=deque)
    given: dict[str, _Given] = field(default_factory=dict)
    ready: 'SimpleQueue[str]' = field(default_factory=SimpleQueue)
    ended: list[Done] = field(default_factory=list)
    losses: Counter[Source] = field(default_factory=Counter)
    faults: Counter[Source] = field(default_factory=Counter)
    workers: dict[str, int] = field(default_factory=dict)
    next_look: float = 0.0
    trouble: str = ''
    call: Any = None

    def judged(self) -> Iterator[Done]:
        """Yield the outcome of every run, last those left unjudged because all workers are gone."""
        gone_since: float | None = None
        while self.unsorted or self.waiting or self.suspects or self.given:
            self.look()
            if self.workers:
                gone_since = None
            else:
                gone_since = gone_since or time.monotonic()
                if time.monotonic() - gone_since > self.wait_s:
                    break
            self.take_back()
            self.give()
            yield from self.collected()
            yield from self.ended
            self.ended.clear()
        left = [run for given in self.given.values() for run in given.runs]
        left += [*self.unsorted, *self.suspects, *(run for runs in self.waiting for run in runs)]
        yield from (Done(run, lost=f'{self.trouble} for {self.wait_s:g} s') for run in left)

    def look(self) -> None:
        """Update the list of workers, at most every `_LOOK_S`; connect again where needed."""
        if time.monotonic() < self.next_look:
            return
        try:
            if self.client is None:
                patience = min(_CONNECT_S, max(1.0, self.wait_s))
                self.client = _connected(self.distributed, self.address, patience)
            if self.client.status != 'running':
                raise ConnectionError(self.client.status)
            found: Mapping[str, int] = self.client.sync(
                self.client.scheduler.ncores, callback_timeout=_ANSWER_S
            )
            self.workers = {worker: max(1, threads) for worker, threads in found.items()}
            self.trouble = f'the dask scheduler at {self.address} had no workers'
            # A cluster that scales with demand starts a worker for this call.
            self.call = None if found else self.call or self.client.submit(int, pure=False)
        except _ANY:
            self.trouble = f'no dask scheduler answered at {self.address}'
            self.disconnect()
        self.next_look = time.monotonic() + _LOOK_S

    def disconnect(self) -> None:
        """Close the connection even if it is broken; batches that were sent out wait again."""
        client, self.client, self.call, self.workers = self.client, None, None, {}
        for key in list(self.given):
            self.back(key, self.trouble, blamed=False)
        if client is not None:
            with suppress(*_ANY):
                client.close(timeout=_CONNECT_S)

    def take_back(self) -> None:
        """Take back the batches that were sent to workers that are gone."""
        lost: dict[str, list[str]] = {}
        for key, given in self.given.items():
            if given.worker not in self.workers:
                lost.setdefault(given.worker, []).append(key)
        for keys in lost.values():
            for key in keys:
                self.back(key, DIED, blamed=len(keys) == 1, suspect=True)

    def back(self, key: str, why: str, *, blamed: bool, suspect: bool = False) -> None:
        """Put the runs of a batch back in the queue; give up those that were lost too often.

        `blamed`: a batch of one run counts as that run's fault; `suspect`: try each run alone.
        """
        given = self.given.pop(key)
        with suppress(*_ANY):
            given.future.release()
        self.losses.update(given.runs)
        if blamed and len(given.runs) == 1:
            self.faults.update(given.runs)
        left = []
        for run in given.runs:
            if self.faults[run] >= _FAULTS or self.losses[run] >= _LOSSES:
                self.ended.append(Done(run, lost=f'{why}; tried {self.losses[run]} times'))
            else:
                left.append(run)
        if suspect or given.alone:
            # Runs that already failed alone come last.
            self.suspects = deque(sorted((*self.suspects, *left), key=lambda one: self.faults[one]))
        elif left:
            self.waiting.appendleft(left)

    def give(self) -> None:
        """Send waiting batches to workers, a few ahead; a suspect only to an otherwise idle one."""
        if self.unsorted and self.workers:
            self.waiting.extend(batches(self.unsorted, sum(self.workers.values())))
            self.unsorted = []
        load = Counter(given.worker for given in self.given.values())
        while self.waiting and self.workers:
            worker = min(self.workers, key=lambda one: load[one] / self.workers[one])
            if load[worker] >= AHEAD * self.workers[worker]:
                return
            self.submit(worker, self.waiting.popleft(), alone=False)
            load[worker] += 1
        for worker in list(self.workers):
            if self.suspects and not load[worker]:
                self.submit(worker, [self.suspects.popleft()], alone=True)

    def submit(self, worker: str, runs: Runs, *, alone: bool) -> None:
        """Send runs to a worker with all data they need: what a worker stores is lost with it."""
        try:
            future = self.client.submit(each, self.work, runs, workers=[worker], pure=False)
        except _ANY:
            # The connection is closed: the next look will find that out.
            self.workers, self.next_look = {}, 0.0
            if alone:
                self.suspects.extend(runs)
            else:
                self.waiting.appendleft(runs)
            return
        self.given[future.key] = _Given(future, worker, runs, alone)
        future.add_done_callback(lambda done: self.ready.put(done.key))

    def collected(self) -> Iterator[Done]:
        """Yield the runs that are ready, after waiting for the first for `_LOOK_S` at most."""
        with suppress(Empty):
            yield from self.outcome(self.ready.get(timeout=_LOOK_S))
            while True:
                yield from self.outcome(self.ready.get_nowait())

    def outcome(self, key: str) -> list[Done]:
        """Return the outcomes of a batch; none if it was lost, and its runs then wait again."""
        given = self.given.get(key)
        if given is None:
            return []
        why, blamed = 'its result was lost with its worker', False
        try:
            if given.future.status == 'finished':
                found: list[Done] = given.future.result(timeout=_FETCH_S)
                del self.given[key]
                given.future.release()
                return [_seen_here(done) for done in found]
            if given.future.status == 'error':
                error = given.future.exception(timeout=_FETCH_S)
                killed = isinstance(error, self.distributed.KilledWorker)
                why = DIED if killed else f'its worker failed: {words(error)}'
                blamed = not killed or self.only(given.worker)
            else:
                # Cancelled: mostly since the scheduler is another one.
                why, self.workers, self.next_look = 'the dask scheduler lost it', {}, 0.0
        except _ANY:
            self.next_look = 0.0
        self.back(key, why, blamed=blamed, suspect=given.future.status != 'cancelled')
        return []

    def only(self, worker: str) -> bool:
        """Return whether a worker has just one batch."""
        return sum(given.worker == worker for given in self.given.values()) == 1


def _seen_here(done: Done) -> Done:
    """Return a run's outcome; not judged if its worker lacks files that exist here."""
    if done.missing and all(Path(file).exists() for file in done.source.files):
        why = 'its worker cannot read this path, this machine can'
        return replace(done, error='', lost=f'{why}: {done.error}')
    return done


def _distributed() -> Any:  # noqa: ANN401 - a module of an extra
    try:
        import distributed  # noqa: PLC0415 - an extra
    except ImportError:
        raise AcceptanceError(
            f'--scheduler: expected dask.distributed ({pip_install("cluster")})'
        ) from None
    return distributed
