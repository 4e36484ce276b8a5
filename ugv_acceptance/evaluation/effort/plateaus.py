"""Compares measured effort with static torque while joints rest, and estimates the payload."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.downsampling import Sampler
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.type_aliases import Floats, Times

# A joint slower than this (rad/s or m/s) is at rest; samples are taken this far apart (ns).
REST = 0.02
SPACING = 50_000_000
# Medians of bins this long (ns) are compared; a plateau ends where they differ by more than this
# share of the effort (and at least this much, N m or N).
BIN = 1_000_000_000
STEP_SHARE = 0.05
STEP_LEAST = 1.0
# A joint with less torque per kg of payload than this (N m or N) does not determine the payload.
SLOPE_LEAST = 1.0
# An effort this close to a limit (as a share of it) is clipped there.
CLIPPED = 0.999
# The sign of an effort is checked if the static torque is at least this share of the limit; it is
# opposite if effort and minus the torque differ by at most this share of the torque.
TELLING, ALIKE = 0.1, 0.5


@dataclass(frozen=True, slots=True)
class Plateau:
    """A period at rest with constant effort: medians of measured effort and static torque (N m; N).

    `start`, `end` in ns; `slope` is the torque per kg of payload (N m or N); `payload` (kg) would
    explain the difference, None if the joint does not determine it. `saturated`: the effort was
    clipped at a limit.
    """

    start: int
    end: int
    measured: float
    model: float
    slope: float
    payload: float | None
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


def opposed_joints(
    settings: Settings, torque: Sequence[float], rates: Sequence[float], effort: Sequence[float]
) -> list[str]:
    """Return the joints at rest whose effort is about minus their static torque: a wrong sign.

    `torque` and `effort` in N m (N), `rates` in rad/s (m/s); unknown rates or efforts are NaN.
    """
    joints = zip(
        settings.robot.joint_names, settings.limits.torque, torque, rates, effort, strict=True
    )
    return [
        name
        for name, limit, tau, rate, measured in joints
        if TELLING * limit <= abs(tau)
        and not abs(rate) > REST
        and abs(measured + tau) <= ALIKE * abs(tau)
    ]


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
        robot = self.settings.robot
        cog = robot.payload.cog
        loads = [static_torque(robot, q, gravity, Payload(m, cog))[j] for m in (0.0, 1.0)]
        slope = float(loads[1] - loads[0])
        saturated = self._saturated(j, effort, model, most)
        tells = abs(slope) >= SLOPE_LEAST and not saturated
        payload = (measured - model) / slope if tells else None
        return Plateau(int(time[0]), int(time[-1]), measured, model, slope, payload, saturated)

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
                    'payload_kg_that_explains_it': p.payload,
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


# An estimate needs at least FELT torque per kg over all joints (N m/kg); a load that differs by
# less than DIFFERS (kg) counts as the declared one; the estimate must explain the share EXPLAINED
# of the difference.
FELT, DIFFERS, EXPLAINED = 1.0, 0.5, 0.75


@dataclass(frozen=True, slots=True)
class PayloadEstimate:
    """The payload `mass` (kg) that explains the measured efforts, and the declared one."""

    mass: float
    declared: float

    @property
    def differs(self) -> bool:
        """Whether the estimate differs from the declared payload by at least DIFFERS."""
        return abs(self.mass - self.declared) >= DIFFERS

    @property
    def sentence(self) -> str:
        """The sentence for the operator."""
        return (
            f'measured efforts suggest a payload of {max(self.mass, 0.0):.1f} kg, '
            f'but {self.declared:.1f} kg is declared'
        )


def payload_estimate(
    settings: Settings,
    q: Sequence[float],
    qd: Sequence[float],
    effort: Sequence[float],
    gravity: Sequence[float],
    payload: Payload,
) -> PayloadEstimate | None:
    """Return the payload that best explains the measured `effort` (j,): declared or another.

    None while a joint moves, if no effort is known, if the posture does not determine it, or if no
    payload explains the efforts. rad, rad/s, N m (N), m/s2.
    """
    measured, rates = np.array(effort, dtype=np.float64), np.nan_to_num(np.array(qd))
    # Many drivers that measure no effort send zeros.
    known = np.isfinite(measured) & (measured != 0.0)
    known &= np.isfinite(np.array(settings.limits.torque))
    if not known.any() or (np.abs(rates) > REST).any():
        return None
    loads = [Payload(mass, payload.cog) for mass in (payload.mass, payload.mass + 1.0)]
    model, heavier = (static_torque(settings.robot, q, gravity, load)[known] for load in loads)
    felt, open_ = heavier - model, measured[known] - model
    if not felt @ felt >= FELT**2:
        return None
    more = float(felt @ open_ / (felt @ felt))
    rest = open_ - more * felt
    # A difference that no load explains says nothing about the load.
    if rest @ rest > max((1.0 - EXPLAINED) * (open_ @ open_), DIFFERS**2 * (felt @ felt)):
        return None
    # A load cannot have a negative mass: the arm leans on something, or a sign is wrong.
    return (
        None
        if payload.mass + more < -DIFFERS
        else PayloadEstimate(payload.mass + more, payload.mass)
    )
