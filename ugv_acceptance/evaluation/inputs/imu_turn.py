"""Turns messages of an IMU on a moving link into those of one at the base's origin."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.inputs.joint_rows import JointRows
from ugv_acceptance.evaluation.samples import ImuColumns
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.carried import carried_kernel
from ugv_acceptance.model.kernels import Kernel
from ugv_acceptance.model.robot import Matrix, Vector
from ugv_acceptance.type_aliases import Floats

Mask = NDArray[np.bool_]
# Of a message: orientation x y z w, its covariance_0, rate (rad/s), specific force (m/s2).
Felt: TypeAlias = tuple[Sequence[float], float, Sequence[float], Sequence[float]]
# The numbers of a message that vary: orientation, rate, force.
WIDTH = 10


@dataclass(slots=True)
class Turn:
    """Turns messages by the positions and rates of `joints` (numbers), which move the IMU's `link`.

    What an IMU repeats to the last digit is repeated here as well, so that a frozen one is found
    although its joints move. A message before these joints are known cannot be turned.
    """

    settings: Settings
    joints: tuple[int, ...]
    link: str
    mounting: Matrix
    position: Vector
    kernel: Kernel = field(init=False)
    _raw: tuple[float, ...] = ()
    _turned: Felt | None = None

    def __post_init__(self) -> None:
        of = self.link, self.mounting, self.position
        self.kernel = carried_kernel(self.settings.robot, *of)

    def one(self, felt: Felt, q: Sequence[float], rates: Sequence[float]) -> Felt | None:
        """Take a message with the newest positions and rates (j,); None where they are unknown."""
        orientation, covariance_0, omega, force = felt
        raw = (*orientation, *omega, *force)
        if raw == self._raw and self._turned is not None and self._holds(raw):
            turned, _, spin, push = self._turned
            return turned, covariance_0, spin, push
        self._raw, self._turned = raw, None
        if not all(math.isfinite(q[j]) and math.isfinite(rates[j]) for j in self.joints):
            return None
        turned, spin, push = self.kernel.one(*map(_number, q), *map(_number, rates), *raw)
        if self._untold(orientation):
            turned = orientation
        self._turned = turned, covariance_0, spin, push
        return self._turned

    def _holds(self, raw: Sequence[float]) -> bool:
        """Return whether a message that is repeated stands still: without noise it may not."""
        return not self.settings.imu.noise_free and all(map(math.isfinite, raw))

    def _untold(self, orientation: Sequence[float]) -> bool:
        """Return whether an orientation may be only a default: it is left as it is."""
        x, y, z, _ = orientation
        return self.settings.imu.attitude == 'auto' and x == y == z == 0.0

    def columns(self, every: ImuColumns, joints: JointRows) -> tuple[ImuColumns, Mask]:
        """Take messages (n,) in order of receipt; return them turned, and which could be.

        `joints` are joint states in order of receipt, the first of them older than all messages.
        """
        raw = np.column_stack(
            (every.orientation, every.angular_velocity, every.linear_acceleration)
        )
        at = np.searchsorted(joints.time, every.log_time, side='right') - 1
        q, rates = joints.q[at], joints.qd[at]
        mine = list(self.joints)
        whole = np.isfinite(np.column_stack((q[:, mine], rates[:, mine])))
        known = np.logical_and.reduce(whole, axis=1)
        numbers = [np.where(np.isfinite(x), x, 0.0) for x in (*q.T, *rates.T)]
        turned = np.empty((len(raw), WIDTH))
        with np.errstate(all='ignore'):
            found = self.kernel.many(*numbers, *raw.T)
        for k, column in enumerate(value for part in found for value in part):
            turned[:, k] = column
        if self.settings.imu.attitude == 'auto':
            untold = ~every.orientation[:, :3].any(axis=1)
            turned[untold, :4] = every.orientation[untold]
        turned, known = self._repeated(raw, turned, known)
        covariance = np.where(known, every.orientation_covariance_0, -1.0)
        turned[~known] = np.nan
        turned[~known, :4] = 0.0
        return _with(every, turned, covariance), known

    def _repeated(self, raw: Floats, turned: Floats, known: Mask) -> tuple[Floats, Mask]:
        """Let what is repeated be repeated: the counterpart of the first lines of `one`."""
        before = self._turned
        last = self._raw
        rows = np.arange(len(raw))
        if not self.settings.imu.noise_free:
            other = np.append(False, (raw[1:] != raw[:-1]).any(axis=1))
            begins = other | ~np.isfinite(raw).all(axis=1)
            again = before is not None and not begins[0] and tuple(raw[0].tolist()) == last
            begins[0] = True
            starts = np.flatnonzero(begins)
            first = np.minimum.reduceat(np.where(known, rows, len(rows)), starts)
            source = np.minimum(np.repeat(first, np.diff(np.append(starts, len(rows)))), rows)
            if again and before is not None:
                end = int(starts[1]) if len(starts) > 1 else len(rows)
                turned[:end] = (*before[0], *before[2], *before[3])
                known[:end], source[:end] = True, rows[:end]
            turned, known = turned[source], known[source]
        self._raw = tuple(raw[-1].tolist())
        x = turned[-1].tolist()
        self._turned = (tuple(x[:4]), 0.0, tuple(x[4:7]), tuple(x[7:])) if known[-1] else None
        return turned, known


def in_order(columns: Sequence[ImuColumns]) -> tuple[NDArray[np.str_], ImuColumns]:
    """Return the messages of all columns in order of receipt, and the frame that each names."""
    names = np.repeat([s.frame_id for s in columns], [len(s.log_time) for s in columns])
    time = np.concatenate([s.log_time for s in columns])
    order = np.argsort(time, kind='stable')
    every = ImuColumns(
        '', *(np.concatenate([getattr(s, name) for s in columns])[order] for name in _FIELDS)
    )
    return names[order], every


def rows_of(every: ImuColumns, rows: slice, frame: str = '') -> ImuColumns:
    """Return some of the messages."""
    return ImuColumns(frame, *(getattr(every, name)[rows] for name in _FIELDS))


def runs_of(names: NDArray[np.str_], every: ImuColumns) -> list[ImuColumns]:
    """Return messages as columns of one frame each, in order of receipt."""
    edges = [0, *(np.flatnonzero(names[1:] != names[:-1]) + 1).tolist(), len(names)]
    return [rows_of(every, slice(a, b), str(names[a])) for a, b in pairwise(edges)]


_FIELDS = tuple(f.name for f in fields(ImuColumns) if f.name != 'frame_id')


def _with(every: ImuColumns, turned: Floats, covariance: Floats) -> ImuColumns:
    return ImuColumns(
        every.frame_id,
        every.log_time,
        every.stamp,
        np.ascontiguousarray(turned[:, :4]),
        np.ascontiguousarray(turned[:, 4:7]),
        np.ascontiguousarray(turned[:, 7:]),
        covariance,
        every.angular_velocity_covariance_0,
        every.linear_acceleration_covariance_0,
    )


def _number(value: float) -> float:
    """Return a number with 0 in place of one that is not known: only joints of others are."""
    return value if math.isfinite(value) else 0.0
