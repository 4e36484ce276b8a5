"""Probability of saturation and rollover if environment, load and robot are uncertain.

Plain Monte Carlo in blocks: exact binomial intervals, constant memory, and the same counts for a
seed whatever the number of processes.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from multiprocessing import get_context
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.model.mechanics import Posture, mechanics_of
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.stability import many_stances, many_standing, stability_of
from ugv_acceptance.processes import Workers
from ugv_acceptance.studies.risk_kernel import risk_kernel
from ugv_acceptance.studies.spread import Spread, clopper_pearson, generators
from ugv_acceptance.type_aliases import Floats

Columns = tuple[Floats, Floats, Floats]

EVENTS = ('saturation', 'rollover', 'either')
BINS = 20
# Samples drawn from one random generator; samples per block, so that temporaries fit the cache.
CHUNK, BLOCK = 2**18, 2**11
# From this number of samples on, starting processes (half a second each) pays.
WORTH_A_PROCESS = 2**22
# Number of samples from which the sensitivities are computed.
LOOKED_AT = 2**20


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """The input of a risk study: distributions `spreads` by name; all other numbers are nominal.

    `risk_kernel.known_names` lists the names. `q` (j,) is the posture (rad, m) of joints without a
    spread, `limits` (j,) the torque limits (N m), infinite where not judged.
    """

    robot: Robot
    spreads: Mapping[str, Spread]
    q: tuple[float, ...]
    limits: tuple[float, ...]


@dataclass(slots=True)
class Counts:
    """Failures by event (3,), and for each input a histogram of its values at the failures.

    `bins` (inputs, 3, BINS) counts the first `looked_at` samples only.
    """

    samples: int = 0
    failures: NDArray[np.int64] = field(default_factory=lambda: np.zeros(3, np.int64))
    looked_at: int = 0
    bins: NDArray[np.int64] = field(default_factory=lambda: np.zeros((0, 3, BINS), np.int64))

    def add(self, other: 'Counts') -> None:
        """Add the counts of other samples."""
        self.samples += other.samples
        self.failures += other.failures
        self.looked_at += other.looked_at
        if other.bins.size:
            self.bins = other.bins if not self.bins.size else self.bins + other.bins


@dataclass(frozen=True, slots=True)
class Estimate:
    """A probability with its exact confidence interval, from a number of samples."""

    samples: int
    failures: int
    probability: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, eq=False)
class Risk:
    """The result of a risk study: probability of each event, its convergence, and sensitivities.

    `sensitivity[name][event]` is the first-order Sobol index: the share (0 to 1) of the failure
    indicator's variance that the input explains alone; `history` holds the estimates at growing
    numbers of samples.
    """

    estimates: dict[str, Estimate]
    history: dict[str, tuple[Estimate, ...]]
    sensitivity: dict[str, dict[str, float]]
    seed: int


def estimate(failures: int, samples: int, confidence: float = 0.95) -> Estimate:
    """Return failures / samples with its Clopper-Pearson confidence interval."""
    low, high = clopper_pearson(failures, samples, confidence)
    return Estimate(samples, failures, failures / samples, low, high)


def failures_of(study: Study, columns: Mapping[str, Floats], count: int) -> NDArray[np.bool_]:
    """Return which samples fail, shape (3, count): a joint saturates, the robot rolls over, either.

    `columns` holds the drawn values (count,) of each name in SI units.
    """
    robot = study.robot
    limits = _limits(study, columns)
    n = len(limits)
    names = tuple(name for name in columns if not name.endswith('.limit'))
    compiled = risk_kernel(robot, names, study.q, tuple(limits))
    out = compiled.kernel.many(*(columns[name] for name in names))
    found = np.zeros((3, count), dtype=np.bool_)
    for torque, limit in zip(out[:n], limits.values(), strict=True):
        found[0] |= np.abs(torque) > limit
    if compiled.edges:
        for moment in out[n:]:
            found[1] |= ~(moment > 0.0)
    elif robot.contacts:
        posture = Posture((), out[n], tuple(out[n + 1 : n + 4]), _triples(out[n + 7 :]))
        gx, gy, gz = (np.broadcast_to(x, count) for x in out[n + 4 : n + 7])
        found[1] = _tipped(robot, posture, (gx, gy, gz), count)
    found[2] = found[0] | found[1]
    return found


def _limits(study: Study, columns: Mapping[str, Floats]) -> dict[str, Any]:
    """Return the torque limit of each joint that has one: a number, or drawn values (count,)."""
    known = zip(study.robot.joint_names, study.limits, strict=True)
    limits = {name: columns.get(f'{name}.limit', limit) for name, limit in known}
    return {name: limit for name, limit in limits.items() if np.min(limit) < math.inf}


def _triples(values: tuple[Any, ...]) -> tuple[Any, ...]:
    return tuple(values[k : k + 3] for k in range(0, len(values), 3))


def _tipped(robot: Robot, posture: Posture, gravity: Columns, count: int) -> NDArray[np.bool_]:
    """Return which samples (count,) tip: no positive moment holds them, or no margin exists."""
    tipped = np.ones(count, dtype=np.bool_)
    stances = many_stances(mechanics_of(robot), posture, count)
    for rows, stance in many_standing(stances, count, np.arange(count), gravity):
        gx, gy, gz = (g[rows] for g in gravity)
        found = stability_of(stance, (gx, gy, gz))
        least = found.moment[0]
        for moment in found.moment[1:]:
            least = np.minimum(least, moment)
        tipped[rows] = ~(np.asarray(least) > 0.0)
    return tipped


def run(
    study: Study,
    samples: int,
    seed: int = 0,
    workers: int = 2,
    progress: Callable[[int], None] | None = None,
) -> Risk:
    """Return the risk from `samples` draws; `progress` is called with the number done so far."""
    total, step = Counts(), CHUNK
    history: list[tuple[int, NDArray[np.int64]]] = []
    for counts in _chunks(study, samples, seed, workers):
        total.add(counts)
        if progress is not None:
            progress(total.samples)
        if total.samples in (step, samples):  # at every doubling
            history.append((total.samples, total.failures.copy()))
            step *= 2
    return Risk(
        {event: estimate(int(total.failures[k]), samples) for k, event in enumerate(EVENTS)},
        {
            event: tuple(estimate(int(failed[k]), n) for n, failed in history)
            for k, event in enumerate(EVENTS)
        },
        _sensitivity(study, total),
        seed,
    )


def _chunks(study: Study, samples: int, seed: int, workers: int) -> Iterator[Counts]:
    """Yield the counts of each chunk in order; many samples are shared out to worker processes.

    Processes and not threads, because the blocks are too small for threads to pay.
    """
    sizes = [CHUNK] * (samples // CHUNK) + [samples % CHUNK] * (samples % CHUNK > 0)
    looked = range(-(-LOOKED_AT // CHUNK))
    rngs = generators(seed, len(sizes))
    tasks = [
        (study, rng, n, k in looked) for k, (rng, n) in enumerate(zip(rngs, sizes, strict=True))
    ]
    if workers < 2 or samples < WORTH_A_PROCESS:
        yield from map(_chunk, tasks)
        return
    with Workers(workers, mp_context=get_context('spawn')) as pool:
        yield from pool.map(_chunk, tasks)


def _chunk(task: tuple[Study, np.random.Generator, int, bool]) -> Counts:
    study, rng, count, look = task
    counts = Counts(looked_at=count if look else 0)
    for start in range(0, count, BLOCK):
        n = min(BLOCK, count - start)
        columns = {name: spread.draw(rng, n) for name, spread in study.spreads.items()}
        failed = failures_of(study, columns, n)
        bins = _bins(study, columns, failed) if look else np.zeros((0, 3, BINS), np.int64)
        counts.add(Counts(n, failed.sum(axis=1), 0, bins))
    return counts


def _bins(
    study: Study, columns: Mapping[str, Floats], failed: NDArray[np.bool_]
) -> NDArray[np.int64]:
    table = np.zeros((len(columns), 3, BINS), dtype=np.int64)
    rows = np.flatnonzero(failed[2])
    for line, (name, values) in zip(table, columns.items(), strict=True):
        place = np.minimum(study.spreads[name].rank(values[rows]) * BINS, BINS - 1).astype(np.int64)
        for k in range(3):
            line[k] = np.bincount(place[failed[k, rows]], minlength=BINS)
    return table


def _sensitivity(study: Study, counts: Counts) -> dict[str, dict[str, float]]:
    """Return each input's first-order Sobol index of each event.

    The variance of the failure probability over the input's bins, divided by p (1 - p), less
    (BINS - 1) / samples, which is its expected value for an input without influence.
    """
    shares: dict[str, dict[str, float]] = {}
    in_bin = counts.looked_at / BINS
    for name, line in zip(study.spreads, counts.bins, strict=False):
        shares[name] = {}
        for event, hits in zip(EVENTS, line, strict=True):
            p = hits.sum() / counts.looked_at
            whole = p * (1.0 - p)
            share = float(np.var(hits / in_bin) / whole) if whole > 0.0 else 0.0
            shares[name][event] = max(0.0, share - (BINS - 1) / counts.looked_at)
    return shares
