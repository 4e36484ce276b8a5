"""Turns messages of an IMU on a moving link into those of one at the base's origin."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.inputs.joint_rows import JointRows
from ugv_acceptance.evaluation.inputs.low_pass import NOWHERE
from ugv_acceptance.evaluation.samples import ImuColumns
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.carried import carried_kernel
from ugv_acceptance.model.kernels import Kernel
from ugv_acceptance.model.robot import Matrix, Vector
from ugv_acceptance.type_aliases import Floats, Times

Mask = NDArray[np.bool_]
# Of a message: orientation x y z w, its covariance_0, rate (rad/s), specific force (m/s2).
Felt: TypeAlias = tuple[Sequence[float], float, Sequence[float], Sequence[float]]
# Orientation, rate and force of a message in the sensor's axes.
Raw: TypeAlias = tuple[Sequence[float], Sequence[float], Sequence[float]]
# A joint that may have turned by more than this (rad) since its position came tells no attitude.
LATE = 0.05
# The numbers of a message that vary: orientation, rate, force.
WIDTH = 10


@dataclass(slots=True)
class Turn:
    """Turns messages by the positions and rates of `joints` (numbers), which move the IMU's `link`.

    A message cannot be turned before these joints are known, nor while they may have turned by more
    than LATE since the oldest of their positions. `raised(now)` is the base's z in the
    sensor's axes at the message received at `now` (ns), NaN where it is not known.
    """

    settings: Settings
    joints: tuple[int, ...]
    link: str
    mounting: Matrix
    position: Vector
    kernel: Kernel = field(init=False)
    _turning: tuple[int, ...] = field(init=False)
    _times: Times = field(default_factory=lambda: np.zeros(1, np.int64))
    _raised: Sequence[Sequence[float]] | Floats = (NOWHERE,)

    def __post_init__(self) -> None:
        of = self.link, self.mounting, self.position
        robot = self.settings.robot
        self.kernel = carried_kernel(robot, *of)
        slides = [robot.joint(name).slides for name in robot.joint_names]
        self._turning = tuple(j for j in self.joints if not slides[j])

    def one(
        self, age: float, felt: Felt, q: Sequence[float], rates: Sequence[float]
    ) -> Felt | None:
        """Take a message with the newest positions and rates (j,); None where it cannot be turned.

        `age` (s) is that of the oldest position.
        """
        orientation, covariance_0, omega, force = felt
        self._raised = (NOWHERE,)
        if not all(math.isfinite(q[j]) for j in self.joints):
            return None
        if not age * sum(abs(rates[j]) for j in self._turning) <= LATE:
            return None
        raw = (*orientation, *omega, *force)
        turned, spin, push, *self._raised = self.kernel.one(
            *map(_number, q), *map(_number, rates), *raw
        )
        x, y, z, _ = orientation
        if self.settings.imu.attitude == 'auto' and x == y == z == 0.0:
            turned = orientation  # it may be only a default
        return turned, covariance_0, spin, push

    def raised(self, now: int) -> Vector:
        """Return the base's z in the sensor's axes at a message received at `now` (ns)."""
        at = int(np.searchsorted(self._times, now, side='right')) - 1
        x, y, z = self._raised[max(at, 0)]
        return float(x), float(y), float(z)

    def columns(self, every: ImuColumns, joints: JointRows) -> tuple[ImuColumns, Mask]:
        """Take messages (n,) in order of receipt; return them turned, and which could be.

        `joints` are joint states in order of receipt, the first of them older than all messages.
        """
        raw = raw_of(every)
        at = np.searchsorted(joints.time, every.log_time, side='right') - 1
        q, rates = joints.q[at], joints.qd[at]
        known = np.logical_and.reduce(np.isfinite(q[:, list(self.joints)]), axis=1)
        age = (every.log_time - joints.oldest[at]) * 1e-9
        # Added one after the other, as in `one`.
        known &= age * sum(np.abs(rates[:, j]) for j in self._turning) <= LATE
        numbers = [np.where(np.isfinite(x), x, 0.0) for x in (*q.T, *rates.T)]
        turned = np.empty((len(raw), WIDTH + 3))
        with np.errstate(all='ignore'):
            found = self.kernel.many(*numbers, *raw.T)
        for k, column in enumerate(value for part in found for value in part):
            turned[:, k] = column
        if self.settings.imu.attitude == 'auto':
            untold = ~every.orientation[:, :3].any(axis=1)
            turned[untold, :4] = every.orientation[untold]
        covariance = np.where(known, every.orientation_covariance_0, -1.0)
        turned[~known] = np.nan
        turned[~known, :4] = 0.0
        self._times, self._raised = every.log_time, turned[:, WIDTH:]
        return _with(every, turned, covariance), known


def raw_of(every: ImuColumns) -> Floats:
    """Return orientation, rate and force of messages as rows (n, WIDTH)."""
    return np.column_stack((every.orientation, every.angular_velocity, every.linear_acceleration))


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
        np.ascontiguousarray(turned[:, 7:WIDTH]),
        covariance,
        every.angular_velocity_covariance_0,
        every.linear_acceleration_covariance_0,
    )


def _number(value: float) -> float:
    """Return a number with 0 in place of one that is not known: only joints of others are."""
    return value if math.isfinite(value) else 0.0
