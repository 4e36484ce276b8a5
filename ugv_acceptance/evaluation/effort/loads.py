"""What the arm carried, by efforts of known scale: stretches of constant load, and contacts.

Torques of all such joints together, e = tau + l x, with the model's error common to all of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.effort.arm import Arm
from ugv_acceptance.evaluation.effort.evidence import OFFSET
from ugv_acceptance.type_aliases import Floats

# Uncertainty of a scale of 1; friction as a share of the joint's largest torque: assumed, least and
# most.
GAIN, FRICTION, LEAST, LARGEST = 0.02, 0.10, 0.004, 0.3
# Scatter is told by this many numbers, a load by this many.
FEW, TOLD = 3, 2
# A change of the load must explain this much (chi-square); so many changes at most.
CHANGE, CHANGES = 16.0, 8
# A load differs from the declared one if 99 % of its distribution do, and by more than this share
# of what the arm itself weighs to the joint; it is not told if it is known worse than this share
# of the largest load.
MATTERS, SURE, VAGUE = 0.05, 2.58, 0.33
# A joint that is off by more than this many standard deviations of the others pushes.
PUSHES = 4.0
# Least torque per kg, as a share of the arm's largest, by which a joint weighs.
FEELS = 0.05


@dataclass(frozen=True, slots=True)
class Load:
    """A stretch of constant load: rows `first` to `last`; `mass` kg and half its 95 % interval.

    `declared` is the mean declared load (kg); `differs` says that it is surely another.
    """

    first: int
    last: int
    mass: float
    half: float
    declared: float
    differs: bool


@dataclass(frozen=True, slots=True)
class Contact:
    """A rest (`row`) in which joint number `joint` holds `extra` N m (N) that no load explains."""

    row: int
    joint: int
    extra: float


@dataclass(frozen=True, slots=True)
class Weighed:
    """What was carried and touched; nothing where no joint's scale is known."""

    loads: tuple[Load, ...] = ()
    contacts: tuple[Contact, ...] = ()


@dataclass(frozen=True, slots=True)
class _Stack:
    """The rows of all weighing joints in one column (n,): difference, lever, rest and joint."""

    open: Floats
    lever: Floats
    row: NDArray[np.intp]
    joint: NDArray[np.intp]
    shared: Floats
    size: Floats

    def weight(self, friction: Floats) -> Floats:
        """Return the inverse covariance (n, n), for a friction (n,) in N m (N)."""
        return np.asarray(np.linalg.inv(self.shared + np.diag(friction**2)), np.float64)


def weigh(arm: Arm, signs: Sequence[float | None]) -> Weighed:
    """Return what was carried, from joints whose effort times `signs` is their torque."""
    lever = np.abs(arm.lever).max(axis=0, initial=0.0)
    feels = lever > FEELS * lever.max(initial=0.0)
    joints = [j for j, sign in enumerate(signs) if sign is not None]
    if not any(feels[j] for j in joints):
        return Weighed()
    stack = _stack(arm, joints, signs)
    if not len(stack.open):
        return Weighed()
    least = MATTERS * float(min(arm.sizes[j] / lever[j] for j in joints if feels[j]))
    # What loads cannot explain in any posture is friction, however often the load changed.
    friction, every = FRICTION * stack.size, np.unique(stack.row)[1:].tolist()
    for _ in range(2):
        friction = _friction(stack, every, friction)
    cuts = _cuts(stack, stack.weight(friction), len(arm.effort), least)
    friction = np.maximum(friction, _friction(stack, cuts, friction))
    cuts = _kept(stack, stack.weight(friction), cuts, least)
    return _told(arm, stack, cuts, stack.weight(friction), least)


def _stack(arm: Arm, joints: Sequence[int], signs: Sequence[float | None]) -> _Stack:
    effort = arm.effort[:, joints] * np.array([signs[j] for j in joints], np.float64)
    row, column = np.nonzero(np.isfinite(effort))
    joint = np.array(joints, np.intp)[column]
    errors = arm.errors[:, row, joint]
    torque, size = arm.torque[row, joint], arm.sizes[joint]
    same = joint[:, None] == joint
    gain = GAIN * torque
    offset = OFFSET * size
    shared = errors.T @ errors + same * (np.outer(gain, gain) + np.outer(offset, offset))
    return _Stack(effort[row, column] - torque, arm.lever[row, joint], row, joint, shared, size)


def _columns(stack: _Stack, cuts: Sequence[int]) -> Floats:
    """Return the lever (n, s) of each stretch between cuts."""
    stretch = np.searchsorted(np.array(cuts, np.intp), stack.row, side='right')
    return np.where(stretch[:, None] == np.arange(len(cuts) + 1), stack.lever[:, None], 0.0)


def _fit(stack: _Stack, weight: Floats, cuts: Sequence[int]) -> tuple[Floats, Floats, Floats]:
    """Return the loads (s,), their covariance (s, s) and the weight (n, n) less their columns."""
    columns = _columns(stack, cuts)
    weighted = weight @ columns
    variance = np.asarray(np.linalg.pinv(columns.T @ weighted), np.float64)
    left = weight - weighted @ variance @ weighted.T
    return variance @ (weighted.T @ stack.open), variance, left


def _misfit(stack: _Stack, weight: Floats, cuts: Sequence[int]) -> float:
    columns = _columns(stack, cuts)
    weighted = weight @ columns
    felt = weighted.T @ stack.open
    gain = felt @ np.linalg.pinv(columns.T @ weighted) @ felt
    return float(stack.open @ weight @ stack.open - gain)


def _cuts(stack: _Stack, weight: Floats, rows: int, least: float) -> list[int]:
    """Return before which rests the load changed, found one after another."""
    cuts: list[int] = []
    before = _misfit(stack, weight, cuts)
    while len(cuts) < CHANGES:
        tried = [sorted([*cuts, k]) for k in range(1, rows) if k not in cuts]
        if not tried:
            break
        misfits = [_misfit(stack, weight, one) for one in tried]
        best = int(np.argmin(misfits))
        if before - misfits[best] < CHANGE:
            break
        cuts, before = tried[best], misfits[best]
    return _kept(stack, weight, cuts, least)


def _kept(stack: _Stack, weight: Floats, cuts: list[int], least: float) -> list[int]:
    """Return the cuts without those that explain too little or change the load by less."""
    while cuts:
        before = _misfit(stack, weight, cuts)
        loads = _fit(stack, weight, cuts)[0]
        gains = [
            _misfit(stack, weight, cuts[:k] + cuts[k + 1 :]) - before for k in range(len(cuts))
        ]
        small = [
            (gain, k) for k, gain in enumerate(gains)
            if gain < CHANGE or abs(loads[k + 1] - loads[k]) < least
        ]  # fmt: skip
        if not small:
            break
        cuts = [cut for k, cut in enumerate(cuts) if k != min(small)[1]]
    return cuts


def _friction(stack: _Stack, cuts: Sequence[int], friction: Floats) -> Floats:
    """Return the friction (n,) that the scatter of each joint tells, within its bounds."""
    left = _fit(stack, stack.weight(friction), cuts)[2]
    z = _deviations(stack, left)
    found = friction.copy()
    for j in np.unique(stack.joint):
        mine = stack.joint == j
        told = z[mine][np.isfinite(z[mine])]
        if len(told) >= FEW:
            found[mine] *= np.sqrt(np.median(told**2) / 0.455)
    return np.clip(found, LEAST * stack.size, LARGEST * stack.size)


def _deviations(stack: _Stack, left: Floats) -> Floats:
    """Return by how many standard deviations each number (n,) is off what the others tell."""
    power = np.diag(left)
    # Where nothing but the number itself tells its load, rounding is left.
    good = power > 1e-6 / np.maximum(stack.size**2, 1e-12)
    found: Floats = np.where(good, left @ stack.open, np.nan) / np.sqrt(np.where(good, power, 1.0))
    return found


def _told(arm: Arm, stack: _Stack, cuts: Sequence[int], weight: Floats, least: float) -> Weighed:
    extra, variance, left = _fit(stack, weight, cuts)
    deviation = np.sqrt(np.maximum(np.diag(variance), 0.0))
    z = _deviations(stack, left)
    loads, contacts = [], _contacts(stack, left, z)
    touched = {contact.row for contact in contacts}
    for k, (first, after) in enumerate(pairwise((0, *cuts, len(arm.effort)))):
        declared = float(arm.declared[first:after].mean())
        mass, sigma = declared + float(extra[k]), float(deviation[k])
        told = int(((stack.row >= first) & (stack.row < after)).sum())
        if not 0.0 < sigma * SURE < VAGUE * arm.most or told < TOLD:
            continue
        if mass + SURE * sigma < 0.0:
            # No load weighs less than nothing: the arm rests on something.
            contacts += _leaning(arm, stack, first, after, touched)
            continue
        differs = abs(extra[k]) - SURE * sigma > least
        loads.append(Load(first, after - 1, mass, 1.96 * sigma, declared, bool(differs)))
    return Weighed(tuple(loads), tuple(contacts))


def _contacts(stack: _Stack, left: Floats, z: Floats) -> list[Contact]:
    """Return the rests in which a joint is off by more than loads and errors explain."""
    found: dict[int, tuple[float, int]] = {}
    for k in np.flatnonzero(np.abs(np.nan_to_num(z)) > PUSHES).tolist():
        row, size = int(stack.row[k]), float(abs(z[k]))
        if size > found.get(row, (0.0, 0))[0]:
            found[row] = (size, k)
    power = np.diag(left)
    off = left @ stack.open
    return [
        Contact(row, int(stack.joint[k]), float(off[k] / power[k]))
        for row, (_, k) in sorted(found.items())
    ]


def _leaning(arm: Arm, stack: _Stack, first: int, after: int, touched: set[int]) -> list[Contact]:
    """Return the contacts of a stretch whose load would weigh less than nothing."""
    found = []
    for row in range(first, after):
        mine = np.flatnonzero(stack.row == row)
        if row in touched or not len(mine):
            continue
        lightened = stack.open[mine] + arm.declared[row] * stack.lever[mine]
        k = int(np.argmax(np.abs(lightened) / stack.size[mine]))
        found.append(Contact(row, int(stack.joint[mine[k]]), float(lightened[k])))
    return found
