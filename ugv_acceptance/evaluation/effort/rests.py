"""Finds where a robot rests, and what its efforts were there: one row a posture and load."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.criteria.uncertainty import Source
from ugv_acceptance.evaluation.effort.arm import Arm
from ugv_acceptance.evaluation.effort.model_errors import (
    Sizes,
    levers,
    loaded,
    model_errors,
    sizes_of,
    sources_for,
    spread_errors,
)
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.type_aliases import Floats, Times

# A joint slower than this (rad/s, m/s) is at rest; a rest lasts at least this long (ns), and
# samples further apart than this are two rests.
REST, LASTS, APART = 0.02, 400_000_000, 1_500_000_000
# Postures closer than this (rad; m) in every joint, and in the direction of gravity, are one.
TURNED, MOVED = np.radians(4.0), 0.02
# Efforts of one stretch differ by less than this share of their level, of the largest, and this
# many times their scatter.
LEVEL_SHARE, MOST_SHARE, SCATTER = 0.05, 0.04, 1.5
# Rows of one posture whose efforts differ by more than this share of the largest stay apart.
SAME = 0.15
# Efforts are compared over bins of this length (ns), or this many bins in all.
BIN, BINS = 1_000_000_000, 2000
# So many rows at most.
MOST = 30


@dataclass(frozen=True, slots=True)
class Rests:
    """Rests in order of time: `start`, `end` (R,) ns, the others (R, j), `gravity` (R, 3).

    Medians of the samples; `torque` is static, with the declared load; NaN: no effort reported.
    """

    start: Times
    end: Times
    effort: Floats
    torque: Floats
    q: Floats
    gravity: Floats

    def rows(self, rows: NDArray[np.intp] | Sequence[int]) -> 'Rests':
        """Return the given rows."""
        at = np.asarray(rows, dtype=np.intp)
        return Rests(
            self.start[at], self.end[at], self.effort[at], self.torque[at], self.q[at],
            self.gravity[at],
        )  # fmt: skip


Samples = tuple[Floats, Floats, Floats, Floats, Floats]


def reaches(settings: Settings) -> Floats:
    """Return how far each joint (j,) may move within one posture (rad; m)."""
    robot = settings.robot
    slides = [robot.joint(name).slides for name in robot.joint_names]
    return np.where(slides, MOVED, TURNED)


def find_rests(time: Times, samples: Samples, reach: Floats) -> Rests:
    """Return the rests of a run from samples: effort, torque, rate, q (n, j) and gravity (n, 3)."""
    effort, torque, rate, q, gravity = samples
    still = _still(time, rate, q)
    edges = np.flatnonzero(np.diff(still.astype(np.int8), prepend=0, append=0))
    found: list[tuple[int, int]] = []
    most = np.nanmax(np.abs(effort), axis=0, initial=0.0, where=np.isfinite(effort))
    for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        cuts = np.flatnonzero(np.diff(time[first:last]) > APART) + first + 1
        for a, b in pairwise((first, *cuts.tolist(), last)):
            found += _stretches(time[a:b], effort[a:b], q[a:b], gravity[a:b], most, reach, a)
    table = [(a, b) for a, b in found if time[b - 1] - time[a] >= LASTS]
    parts = (effort, torque, q, gravity)
    medians = [[_median(part[a:b]) for a, b in table] for part in parts]
    shaped = [
        np.array(m).reshape(len(table), p.shape[1]) for m, p in zip(medians, parts, strict=True)
    ]
    start = np.array([time[a] for a, _ in table], np.int64)
    return Rests(start, np.array([time[b - 1] for _, b in table], np.int64), *shaped)


def _still(time: Times, rate: Floats, q: Floats) -> NDArray[np.bool_]:
    """Return at which samples (n,) all joints rest; where no rate is told, by their positions."""
    fast: NDArray[np.bool_] = np.asarray(np.nan_to_num(np.abs(rate)) > REST)
    if len(time) > 1:
        passed = np.maximum(np.diff(time), 1)[:, None] / 1e9
        moved = np.nan_to_num(np.abs(np.diff(q, axis=0))) > REST * np.maximum(passed, 0.1)
        untold = np.isnan(rate)
        fast[1:] |= moved & untold[1:]
        fast[:-1] |= moved & untold[:-1]
    return np.asarray(~fast.any(axis=1), np.bool_)


def _median(values: Floats) -> Floats:
    """Return the median of each column over what is known; NaN where nothing is."""
    known = np.isfinite(values).sum(axis=0)
    ordered = np.sort(values, axis=0)
    middle = np.take_along_axis(ordered, np.maximum(known - 1, 0)[None] // 2, 0)[0]
    other = np.take_along_axis(ordered, np.maximum(known, 1)[None] // 2, 0)[0]
    found: Floats = np.where(known > 0, 0.5 * (middle + other), np.nan)
    return found


def _stretches(
    time: Times,
    effort: Floats,
    q: Floats,
    gravity: Floats,
    most: Floats,
    reach: Floats,
    offset: int,
) -> Iterator[tuple[int, int]]:
    """Yield (first, after last) sample of each stretch of one posture and one level of effort."""
    width = max(BIN, int(time[-1] - time[0]) // BINS)
    _, bins = np.unique((time - time[0]) // width, return_index=True)
    edges = [*bins.tolist(), len(time)]
    first, level = 0, np.empty(0)
    for k, (a, b) in enumerate(pairwise(edges)):
        here = _median(effort[a:b])
        at = edges[first]
        scatter = _median(np.abs(effort[a:b] - here)) * 1.48
        allowed = np.maximum(MOST_SHARE * most, SCATTER * np.nan_to_num(scatter))
        if k > first:
            allowed = np.maximum(allowed, LEVEL_SHARE * np.abs(np.nan_to_num(level)))
            leaps = np.nan_to_num(np.abs(here - level)) > allowed
            apart = not is_near(q[a], q[at], gravity[a], gravity[at], reach)
            if apart or leaps.any():
                yield offset + at, offset + a
                first = k
        level = here if first == k else level
    yield offset + edges[first], offset + len(time)


def is_near(q: Floats, p: Floats, gravity: Floats, other: Floats, reach: Floats) -> bool:
    """Return whether two postures are one: joints and direction of gravity differ by little."""
    if (np.abs(q - p) > reach).any():
        return False
    size = float(np.linalg.norm(gravity) * np.linalg.norm(other))
    return bool(float(gravity @ other) >= np.cos(TURNED) * size)


def distinct(rests: Rests, reach: Floats) -> list[int]:
    """Return the rows of one rest a posture and level of effort, the longest, in order of time.

    A posture that is taken again with the same efforts says nothing new.
    """
    most = np.nanmax(np.abs(rests.effort), axis=0, initial=0.0, where=np.isfinite(rests.effort))
    length, kept = rests.end - rests.start, list[int]()
    for k in np.argsort(-length, kind='stable').tolist():
        if not any(
            is_near(rests.q[k], rests.q[i], rests.gravity[k], rests.gravity[i], reach)
            and not (np.abs(rests.effort[k] - rests.effort[i]) > SAME * most).any()
            for i in kept
        ):
            kept.append(k)
        if len(kept) == MOST:
            break
    return sorted(kept)


def arm_of(
    settings: Settings, sources: Sequence[Source], rests: Rests, declared: Floats | None = None
) -> tuple[Arm, Sizes]:
    """Return rests as the model sees them, and how large the robot's torques are.

    `declared` (R,) kg; by default it follows from the static torques.
    """
    robot, _ = loaded(settings.robot)
    sizes = sizes_of(settings.robot, settings.limits.torque)
    lever = levers(robot, rests.q, rests.gravity)
    if declared is None:
        empty = static_torque(robot, rests.q, rests.gravity, Payload(0.0, robot.payload.cog))
        power = (lever**2).sum(axis=1)
        felt = ((rests.torque - empty) * lever).sum(axis=1)
        declared = np.where(power > 0.0, felt / np.where(power > 0.0, power, 1.0), 0.0)
    load = float(declared.mean()) if len(declared) else 0.0
    known = sources_for(robot, sources)
    at = (rests.q, rests.gravity, max(load, 0.0))
    errors = np.concatenate((model_errors(robot, known, *at), spread_errors(robot, *at)))
    arm = Arm(rests.effort, rests.torque, lever, declared, errors, sizes.torque, sizes.most)
    return arm, sizes
