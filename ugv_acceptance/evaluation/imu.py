"""IMU messages to the gravity vector in `base_link`, and what is wrong with them.

The orientation is used where the message claims it and it is a rotation that says something; else
the low-passed accelerometer. Orientation and accelerometer must agree at rest. The same steps are
written for one message and for columns; a property test holds that both give the same rows.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts import Signal, feed
from ugv_acceptance.evaluation.samples import ImuColumns
from ugv_acceptance.evaluation.settings import ImuInput, Settings
from ugv_acceptance.model.attitude import (
    angle_between,
    up_from_acceleration,
    up_from_orientation,
)
from ugv_acceptance.model.expressions import add, cross, rotate, scale
from ugv_acceptance.model.rows import Values

Floats = NDArray[np.float64]
Times = NDArray[np.int64]
Vector = tuple[float, float, float]

NOWHERE: Vector = (math.nan, math.nan, math.nan)
# Seconds between stamps over which the low-pass may be carried; else it starts again.
LONGEST_STEP = 1.0
# A unit quaternion's norm may be this far from 1 (single precision, rounding).
NORM_SLACK = 0.01
# Share of g by which the accelerometer may differ from g and still show where up is.
GRAVITY_SLACK = 0.15
# Larger than any acceleration (m/s2) or rate (rad/s) of a vehicle: the number is something else.
BELIEVABLE = 1e3


@dataclass(frozen=True, slots=True)
class ImuRows:
    """One row a message: `gravity` (n, 3) m/s2 in `base_link`, NaN where it cannot be told.

    `disagreement` (n,) is the angle (rad) between orientation and accelerometer, NaN while moving;
    `strange` (n,) the share of g by which acceleration differs from g at rest, NaN while moving;
    `unusable` (n,) says that gravity cannot be told or that a number cannot be believed.
    """

    time: Times
    stamp: Times
    gravity: Floats
    disagreement: Floats
    strange: Floats
    unusable: NDArray[np.bool_]


@dataclass(slots=True)
class ImuTracker:
    """The low-pass filter's state, and the fault that orientation and acceleration disagree.

    While `fault` has an active alert there is no gravity.
    """

    settings: Settings
    fault: Signal
    smooth: Vector = NOWHERE
    stamp: int = 0

    def step(
        self,
        now: int,
        stamp: int,
        orientation: Sequence[float],
        covariance_0: float,
        omega: Sequence[float],
        acceleration: Sequence[float],
    ) -> tuple[Vector, float, bool]:
        """Take one message; return its gravity, strange and unusable as in ImuRows."""
        size = self._filter(stamp, acceleration)
        imu, g = self.settings.imu, self.settings.robot.gravity
        x, y, z, w = orientation
        spin = _norm(omega)
        still = spin <= imu.rest_rate
        told = _orientation_tells(x, y, z, w, covariance_0, imu.attitude)
        shown = abs(size - g) <= GRAVITY_SLACK * g
        by_orientation = up_from_orientation(x, y, z, w, imu.mounting) if told else NOWHERE
        by_acceleration = up_from_acceleration(*self.smooth, imu.mounting) if shown else NOWHERE
        disagreement = math.nan
        if told and shown and still and abs(size - g) <= imu.rest_acceleration:
            disagreement = angle_between(by_orientation, by_acceleration)
        self.fault.step(now, disagreement)
        self.fault.advance(now)
        strange = abs(size - g) / g if still else math.nan
        believable = size == size and spin <= BELIEVABLE  # noqa: PLR0124 - not NaN
        if self.fault.alert is not None:
            return NOWHERE, strange, True
        if imu.specific_force:
            if not believable or size == 0.0:
                return NOWHERE, strange, True
            return _force(self.smooth, omega, imu), strange, False
        up = by_orientation if told and imu.attitude != 'accelerometer' else by_acceleration
        return (-g * up[0], -g * up[1], -g * up[2]), strange, not believable or up[0] != up[0]

    def _filter(self, stamp: int, acceleration: Sequence[float]) -> float:
        """Low-pass an acceleration; return the size of what comes out, NaN if that is unknown."""
        ax, ay, az = acceleration
        if not ax * ax + ay * ay + az * az <= BELIEVABLE * BELIEVABLE:
            ax = ay = az = math.nan
        step = (stamp - self.stamp) * 1e-9
        self.stamp = stamp
        sx, sy, sz = self.smooth
        if 0.0 < step <= LONGEST_STEP and sx == sx:  # noqa: PLR0124 - not NaN
            keep = math.exp(-step / self.settings.imu.low_pass)
            ax, ay, az = ax + keep * (sx - ax), ay + keep * (sy - ay), az + keep * (sz - az)
        self.smooth = (ax, ay, az)
        return math.sqrt(ax * ax + ay * ay + az * az)

    def columns(self, segments: Sequence[ImuColumns]) -> ImuRows:
        """Take many messages: the same rows as `step` one at a time, in order of receipt."""
        columns = [s for s in segments if len(s.log_time)]
        if not columns:
            none, nothing = np.empty(0, np.int64), np.empty(0)
            return ImuRows(none, none, np.empty((0, 3)), nothing, nothing, nothing != 0.0)
        time = np.concatenate([s.log_time for s in columns])
        order = np.argsort(time, kind='stable') if (np.diff(time) < 0).any() else slice(None)
        time, stamp = time[order], np.concatenate([s.stamp for s in columns])[order]
        q = _lines([s.orientation for s in columns])[:, order]
        covariance_0 = np.concatenate([s.orientation_covariance_0 for s in columns])[order]
        omega = _lines([s.angular_velocity for s in columns])[:, order]
        acceleration = _lines([s.linear_acceleration for s in columns])[:, order]
        with np.errstate(all='ignore'):
            smooth = self._filter_columns(stamp, acceleration)
            return self._rows(time, stamp, (q, covariance_0, omega), smooth)

    def _rows(
        self, time: Times, stamp: Times, told_by: tuple[Floats, Floats, Floats], smooth: Floats
    ) -> ImuRows:
        """Return the rows of orientation, its covariance and rate, and the smooth acceleration."""
        imu, g = self.settings.imu, self.settings.robot.gravity
        q, covariance_0, omega = told_by
        size, spin = _norms(smooth), _norms(omega)
        still = spin <= imu.rest_rate
        told = _orientation_tells(q[0], q[1], q[2], q[3], covariance_0, imu.attitude)
        shown = np.abs(size - g) <= GRAVITY_SLACK * g
        oriented = np.where(told, up_from_orientation(q[0], q[1], q[2], q[3], imu.mounting), np.nan)
        up = up_from_acceleration(smooth[0], smooth[1], smooth[2], imu.mounting)
        leaning = np.where(shown, up, np.nan)
        rest = still & (np.abs(size - g) <= imu.rest_acceleration)
        disagreement = np.where(rest, angle_between(tuple(oriented), tuple(leaning)), np.nan)
        strange = np.where(still, np.abs(size - g) / g, np.nan)
        believable = (size == size) & (spin <= BELIEVABLE)  # noqa: PLR0124 - not NaN
        if imu.specific_force:
            force = np.array(_force(tuple(smooth), tuple(omega), imu))
            gravity = np.where(believable & (size != 0.0), force, np.nan)
        else:
            use = told if imu.attitude != 'accelerometer' else np.zeros(len(time), np.bool_)
            gravity = -g * np.where(use, oriented, leaning)
        self._judge(time, disagreement, gravity)
        unusable = ~believable | np.isnan(gravity[0])
        return ImuRows(time, stamp, gravity.T, disagreement, strange, unusable)

    def _judge(self, time: Times, disagreement: Floats, gravity: Floats) -> None:
        """Feed the fault and take gravity away while it is active."""
        before, seen = self.fault.alert, len(self.fault.log)
        feed(self.fault, time, disagreement)
        for alert in [before, *self.fault.log[seen:]]:
            if alert is not None and alert.rule is self.fault.rule:
                end = np.inf if alert.end is None else alert.end
                gravity[:, (time >= alert.start) & (time < end)] = np.nan

    def _filter_columns(self, stamp: Times, x: Floats) -> Floats:
        """Low-pass many accelerations (3, n): the recursion of `_filter` in closed form.

        Stretches of a few time constants at a time, so that the products of the decay factors stay
        far from the ends of the number range.
        """
        step = np.diff(stamp, prepend=self.stamp) * 1e-9
        self.stamp = int(stamp[-1])
        finite = x[0] * x[0] + x[1] * x[1] + x[2] * x[2] <= BELIEVABLE * BELIEVABLE
        if not finite.all():
            x = np.where(finite, x, np.nan)
        carried = (step > 0.0) & (step <= LONGEST_STEP) & np.concatenate(([True], finite[:-1]))
        decay = np.where(carried, step / self.settings.imu.low_pass, 0.0)
        elapsed = np.cumsum(decay)
        starts = ~carried
        starts[1:] |= np.diff(np.floor(elapsed / 8.0)) > 0
        starts[0] = True
        edges = np.append(np.flatnonzero(starts), len(stamp))
        y = np.empty_like(x)
        last = np.array(self.smooth)
        for first, end in pairwise(edges.tolist()):
            part, w = x[:, first:end], y[:, first:end]
            # What the output lacks of the input decays, and grows by each step of the input.
            fresh = not carried[first] or not np.isfinite(last).all()
            since = elapsed[first] if fresh else elapsed[first] - decay[first]
            keep = np.exp(since - elapsed[first:end])
            w[:, 0] = 0.0 if fresh else last - part[:, 0]
            w[:, 1:] = (part[:, :-1] - part[:, 1:]) / keep[:-1]
            y[:, first:end] = part + keep * np.cumsum(w, axis=1)
            last = y[:, end - 1]
        self.smooth = (float(last[0]), float(last[1]), float(last[2]))
        return y


def _orientation_tells(
    x: Values, y: Values, z: Values, w: Values, covariance_0: Values, attitude: str
) -> Values:
    """Return whether a quaternion is claimed, is a rotation, and is not just a default identity."""
    size = x * x + y * y + z * z + w * w
    told = (abs(size - 1.0) <= 2.0 * NORM_SLACK) & (covariance_0 != -1.0)
    if attitude == 'auto':
        told = told & ((x != 0.0) | (y != 0.0) | (z != 0.0))
    return told


def _norm(v: Sequence[float]) -> float:
    x, y, z = v
    return math.sqrt(x * x + y * y + z * z)


def _lines(tables: Sequence[Floats]) -> Floats:
    """Return tables (n, k) one after the other as k contiguous lines."""
    out = np.empty((tables[0].shape[1], sum(map(len, tables))))
    return np.concatenate([table.T for table in tables], axis=1, out=out)


def _norms(v: Floats) -> Floats:
    x, y, z = v
    size: Floats = np.sqrt(x * x + y * y + z * z)
    return size


def _force(smooth: Values, omega: Values, imu: ImuInput) -> Values:
    """Return minus the specific force at base_link's origin (m/s2, base axes)."""
    force = rotate(imu.mounting, smooth)
    spin = rotate(imu.mounting, omega)
    arm = scale(imu.position, -1.0)
    return scale(add(force, cross(spin, cross(spin, arm))), -1.0)
