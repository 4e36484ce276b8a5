"""Lists what a joint's effort was while it rested, beside the static torque, for a person to read.

It lists; what the numbers mean is said by model_check.py.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.downsampling import Sampler
from ugv_acceptance.evaluation.effort.model_errors import levers
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.type_aliases import Floats, Times

# A joint slower than this (rad/s or m/s) is at rest; samples are taken this far apart (ns).
REST = 0.02
SPACING = 50_000_000
# Medians of bins this long (ns) are compared; a plateau ends where they differ by more than this
# share of the effort (and at least this much, N m or N).
BIN = 1_000_000_000
STEP_SHARE = 0.05
STEP_LEAST = 1.0
# An effort this close to a limit (as a share of it) is clipped there.
CLIPPED = 0.999


@dataclass(frozen=True, slots=True)
class Plateau:
    """A period at rest with constant effort: medians of measured effort and static torque (N m; N).

    `start`, `end` in ns; `slope` is the torque per kg of payload (N m or N). `saturated`: the
    effort was clipped at a limit.
    """

    start: int
    end: int
    measured: float
    model: float
    slope: float
    saturated: bool


@dataclass(frozen=True, slots=True)
class _Held:
    """Samples of a joint at rest: its static torque (n,), postures (n, j) and gravity (n, 3)."""

    torque: Floats
    q: Floats
    gravity: Floats

    def rows(self, rows: slice) -> '_Held':
        """Return the given samples."""
        return _Held(self.torque[rows], self.q[rows], self.gravity[rows])


@dataclass(slots=True)
class EffortComparison:
    """Collects samples of a run, at most twenty a second, and finds its plateaus of effort."""

    settings: Settings
    _samples: Sampler = field(default_factory=lambda: Sampler(SPACING))

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording."""
        self._samples.add(rows)

    def plateaus(self, j: int) -> list[Plateau]:
        """Return the plateaus of joint number j; none if no effort was recorded."""
        time, (effort, torque, rate, q, gravity) = self._samples.samples(len(self.settings.joints))
        moving = np.abs(np.nan_to_num(rate[:, j])) > REST
        good = np.isfinite(effort[:, j]) & ~moving
        told, held = effort[good, j], _Held(torque[good, j], q[good], gravity[good])
        most = float(np.abs(told).max(initial=0.0))
        time = time[good]
        return [
            self._plateau(j, time[rows], told[rows], held.rows(rows), most)
            for rows in _split(time, told)
        ]

    def _plateau(self, j: int, time: Times, effort: Floats, held: '_Held', most: float) -> Plateau:
        """Return a plateau; `most` is the largest effort (N m; N) of the whole run."""
        measured, model = float(np.median(effort)), float(np.median(held.torque))
        q, gravity = np.median(held.q, axis=0), np.median(held.gravity, axis=0)
        slope = float(levers(self.settings.robot, q, gravity)[j])
        saturated = self._saturated(j, effort, model, most)
        return Plateau(int(time[0]), int(time[-1]), measured, model, slope, saturated)

    def _saturated(self, j: int, effort: Floats, model: float, most: float) -> bool:
        """Return whether an effort stands at a known limit, or at the largest of the run."""
        name = self.settings.robot.joint_names[j]
        level = abs(float(np.median(effort)))
        limits = (self.settings.limits.torque[j], self.settings.robot.joint(name).effort)
        if any(0.0 < limit < np.inf and level >= CLIPPED * limit for limit in limits):
            return True
        far = level > 10.0 * max(abs(model), STEP_LEAST)
        return far and bool(np.mean(np.abs(effort) == most) >= 0.25)

    def result(self, start: int) -> dict[str, Any]:
        """Return every joint's plateaus for JSON; times in seconds since `start` (ns)."""
        return {
            name: [
                {
                    'start_s': (p.start - start) / 1e9,
                    'end_s': (p.end - start) / 1e9,
                    'measured': p.measured,
                    'model': p.model,
                    'difference': p.measured - p.model,
                    'unit': self.settings.robot.joint(name).units.effort,
                    'effort_per_kg': p.slope,
                    'saturated': p.saturated,
                }
                for p in self.plateaus(j)
            ]
            for j, name in enumerate(self.settings.robot.joint_names)
        }


def _split(time: NDArray[np.int64], effort: Floats) -> Iterator[slice]:
    """Yield the rows of each plateau of at least three bins."""
    if not len(time):
        return
    _, bins = np.unique((time - time[0]) // BIN, return_index=True)
    edges = [*bins.tolist(), len(time)]
    medians = [float(np.median(effort[a:b])) for a, b in pairwise(edges)]
    first = 0
    for k in range(1, len(medians) + 1):
        level = float(np.median(medians[first:k]))
        step = max(STEP_LEAST, STEP_SHARE * abs(level))
        if k == len(medians) or abs(medians[k] - level) > step:
            if k - first >= 3:
                yield slice(edges[first], edges[k])
            first = k
