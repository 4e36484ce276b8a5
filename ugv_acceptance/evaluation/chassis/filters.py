"""What the chassis feels: rate, angular acceleration and specific force, filtered, in base axes.

All filters are of first order and recursive: y = x + keep (y - x). They are written for one message
and for columns; a property test holds that both give the same.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.inputs.low_pass import BELIEVABLE
from ugv_acceptance.model.expressions import rotate
from ugv_acceptance.model.robot import IDENTITY, Matrix, Vector
from ugv_acceptance.type_aliases import Floats, Times

# Time constants (s): of the force (twice in a row), of the rate, and of the mean that shows whether
# the accelerometer measures gravity at all.
FORCE, RATE, MEAN = 0.03, 0.02, 2.0
# A longer step (ns) between two messages starts the filters anew; they are settled after SETTLED
# (ns) and the mean tells something after LEARNT (ns).
LONGEST_STEP, SETTLED, LEARNT = 200_000_000, 100_000_000, 500_000_000
# Mean step (s) above which an IMU is too slow: 50 Hz, with some messages lost.
SLOWEST = 0.0221
# Stamps (ns) that step further than this say nothing about time.
STAMP_STEP = 1_000_000_000

_NO_STATE = (0.0,) * 19


@dataclass(slots=True)
class ChassisFilter:
    """Filters IMU messages one at a time (`step`) or many (`columns`), in any mixture.

    After a step: `elapsed` (ns) since the filters began, 0 while they have nothing; `step_s` (s)
    since the message before; `state` are 19 numbers: the force filtered once and twice, the rate
    (RATE), that filtered again (FORCE), the mean difference between force and gravity, gravity
    filtered (FORCE) (each 3), and the mean step (s).
    """

    mounting: Matrix
    elapsed: int = 0
    step_s: float = 0.0
    state: tuple[float, ...] = _NO_STATE
    running: bool = False
    _stamp: int = 0
    _time: int = 0
    _keep: tuple[float, float] = (0.0, 0.0)

    def step(
        self,
        now: int,
        stamp: int,
        omega: Sequence[float],
        force: Sequence[float],
        gravity: Vector,
    ) -> bool:
        """Take one message; `omega` and `force` in sensor axes, `gravity` in base axes.

        Return False if a number is missing or absurd: the filters then begin anew.
        """
        step = stamp - self._stamp
        if not 0 < step <= STAMP_STEP:
            step = now - self._time
        self._stamp, self._time = stamp, now
        wx, wy, wz = omega
        ax, ay, az = force
        size = wx * wx + wy * wy + wz * wz + ax * ax + ay * ay + az * az
        gx, gy, gz = gravity
        if not size + abs(gx) <= BELIEVABLE * BELIEVABLE:
            self.running, self.elapsed = False, 0
            return False
        if self.mounting is not IDENTITY:
            wx, wy, wz = rotate(self.mounting, (wx, wy, wz))  # type: ignore[assignment]  # numbers
            ax, ay, az = rotate(self.mounting, (ax, ay, az))  # type: ignore[assignment]
        if not (self.running and 0 < step <= LONGEST_STEP):
            self.running, self.elapsed, self.step_s = True, 0, 0.0
            of = (ax, ay, az, ax, ay, az, wx, wy, wz, wx, wy, wz)
            self.state = (*of, ax + gx, ay + gy, az + gz, gx, gy, gz, 0.0)
            return True
        dt = step * 1e-9
        if dt != self.step_s:
            self._keep = math.exp(-dt / FORCE), math.exp(-dt / RATE)
        first = self.elapsed == 0
        self.elapsed, self.step_s = self.elapsed + step, dt
        new = dt / min(self.elapsed * 1e-9 + dt, MEAN)
        keep = (*self._keep, new, dt, 1.0 if first else new)
        self.state = _filtered(self.state, (wx, wy, wz, ax, ay, az), gravity, keep)
        return True

    def columns(
        self, time: Times, stamp: Times, omega: Floats, force: Floats, gravity: Floats
    ) -> 'FeltRows':
        """Take many messages: vectors as (3, n); the same numbers as `step` for each."""
        steps, fresh, good = self._steps(time, stamp, omega, force, gravity)
        elapsed, began = self._since(steps, fresh)
        step = steps * 1e-9
        x = np.where(good, np.vstack((self._turned(force), self._turned(omega), gravity)), 0.0)
        with np.errstate(under='ignore'):
            f = np.where(fresh, 0.0, np.exp(-step / FORCE))
            r = np.where(fresh, 0.0, np.exp(-step / RATE))
        new = np.where(
            fresh, 1.0, step / np.maximum(np.minimum(elapsed * 1e-9 + step, MEAN), 1e-12)
        )
        before = np.array(self.state)
        slowed = recursion(f, x[[0, 1, 2, 6, 7, 8]], np.concatenate((before[:3], before[15:18])))
        once = np.concatenate((slowed[:3], recursion(r, x[3:6], before[6:9])))
        twice = recursion(f, once, np.concatenate((before[3:6], before[9:12])))
        second = np.concatenate(([self.running and self.elapsed == 0], fresh[:-1])) & ~fresh
        mean = recursion(1.0 - new, x[:3] + x[6:], before[12:15])
        slow = np.where(second, 0.0, 1.0 - new)
        pace = recursion(slow, step[None], before[18:])
        self.elapsed, self.step_s = int(elapsed[-1]), float(step[-1])
        self.running = bool(good[-1])
        last = (once[:3], twice[:3], once[3:], twice[3:], mean, slowed[3:], pace)
        self.state = tuple(np.concatenate([part[:, -1] for part in last]).tolist())
        self._stamp, self._time = int(stamp[-1]), int(time[-1])
        return FeltRows(
            good, step, elapsed, began, twice[:3], once[3:], twice[3:], mean, slowed[3:], pace[0]
        )

    def _steps(
        self, time: Times, stamp: Times, omega: Floats, force: Floats, gravity: Floats
    ) -> tuple[Times, NDArray[np.bool_], NDArray[np.bool_]]:
        """Return the steps (ns), where the filters begin anew, and which messages can be used."""
        stepped = np.diff(stamp, prepend=self._stamp)
        received = np.diff(time, prepend=self._time)
        usable = (stepped > 0) & (stepped <= STAMP_STEP)
        step = np.where(usable, stepped, received)
        size = (omega * omega).sum(axis=0) + (force * force).sum(axis=0)  # inf where absurd
        good: NDArray[np.bool_] = size + np.abs(gravity[0]) <= BELIEVABLE * BELIEVABLE
        running = np.concatenate(([self.running], good[:-1]))
        fresh = ~(running & (step > 0) & (step <= LONGEST_STEP) & good)
        return np.where(fresh, 0, step), fresh, good

    def _since(self, step: Times, fresh: NDArray[np.bool_]) -> tuple[Times, NDArray[np.intp]]:
        """Return the time (ns) since the filters began, and the row of that beginning (-1: before)."""
        total = np.cumsum(step)
        began = np.maximum.accumulate(np.where(fresh, np.arange(len(step)), -1))
        return np.where(began < 0, self.elapsed + total, total - total[began]), began

    def _turned(self, v: Floats) -> Floats:
        turned: Floats = v if self.mounting is IDENTITY else np.array(self.mounting) @ v
        return turned


def _filtered(
    state: tuple[float, ...], new: tuple[float, ...], gravity: Vector, keep: tuple[float, ...]
) -> tuple[float, ...]:
    """Return the state after a message: rate and force, and what is kept of the state before.

    Of force and rate (shares), of the mean the new share, and the step (s) for its own mean.
    """
    ux, uy, uz, fx, fy, fz, px, py, pz, qx, qy, qz, mx, my, mz, lx, ly, lz, pace = state
    wx, wy, wz, ax, ay, az = new
    gx, gy, gz = gravity
    f, r, m, dt, paced = keep
    ux = ax + f * (ux - ax)
    uy = ay + f * (uy - ay)
    uz = az + f * (uz - az)
    px = wx + r * (px - wx)
    py = wy + r * (py - wy)
    pz = wz + r * (pz - wz)
    return (
        ux,
        uy,
        uz,
        ux + f * (fx - ux),
        uy + f * (fy - uy),
        uz + f * (fz - uz),
        px,
        py,
        pz,
        px + f * (qx - px),
        py + f * (qy - py),
        pz + f * (qz - pz),
        mx + m * (ax + gx - mx),
        my + m * (ay + gy - my),
        mz + m * (az + gz - mz),
        gx + f * (lx - gx),
        gy + f * (ly - gy),
        gz + f * (lz - gz),
        pace + paced * (dt - pace),
    )


@dataclass(frozen=True, slots=True)
class FeltRows:
    """The filters' output, one column a message; vectors (3, n) in base axes.

    `good` says which messages could be used, `step` (n,) s is since the message before, `elapsed`
    (n,) ns since the filters began, in row `began` (n,) (-1: before these rows). `force` (m/s2)
    filtered twice, `rate` (rad/s) once, `lagging` the rate filtered once more, `mean` the mean
    difference between force and gravity (m/s2), `gravity` filtered (m/s2), `pace` (n,) the mean step (s).
    """

    good: NDArray[np.bool_]
    step: Floats
    elapsed: Times
    began: NDArray[np.intp]
    force: Floats
    rate: Floats
    lagging: Floats
    mean: Floats
    gravity: Floats
    pace: Floats


def recursion(keep: Floats, x: Floats, before: Floats) -> Floats:
    """Return y[k] = x[k] + keep[k] (y[k - 1] - x[k]) along the last axis, shape (r, n).

    `keep` (n,), `x` (r, n), `before` (r,) is y[-1]. The rows are cut into about sqrt(n) pieces that
    run side by side, and what each carries on into the next is added after.
    """
    n = len(keep)
    length = max(1, math.isqrt(n))
    count = -(-n // length)
    pad = count * length - n
    kept = np.concatenate((keep, np.ones(pad))).reshape(count, length).T.copy()
    gain = x * (1.0 - keep)
    gain = np.concatenate((gain, np.zeros((len(x), pad))), axis=1)
    y = gain.reshape(len(x), count, length).transpose(2, 0, 1).copy()
    product = kept.copy()
    for k in range(1, length):
        y[k] += kept[k] * y[k - 1]
        product[k] *= product[k - 1]
    carried = np.empty((len(x), count))
    value = before
    for c in range(count):
        carried[:, c] = value
        value = y[-1, :, c] + product[-1, c] * value
    y += product[:, None, :] * carried
    return y.transpose(1, 2, 0).reshape(len(x), -1)[:, :n]
