"""What the chassis feels: rate, angular acceleration and push, filtered, in base axes.

The push is what the accelerometer feels beside gravity: specific force plus gravity, 0 at rest.
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

# Time constants (s): of the push (twice in a row), of the rate, and of the mean push that shows
# whether the accelerometer measures gravity at all.
PUSH, RATE, MEAN = 0.03, 0.02, 2.0
# A longer step (ns) between two messages starts the filters anew; they are settled after SETTLED
# (ns) and the mean tells something after LEARNT (ns).
LONGEST_STEP, SETTLED, LEARNT = 200_000_000, 100_000_000, 500_000_000
# Mean step (s) above which an IMU is too slow: 50 Hz, with some messages lost.
SLOWEST = 0.0221
# A force (m/s2) beyond this is a shock, which tips nothing: it counts as one of this size.
SHOCK = 20.0
# Stamps (ns) that step further than this say nothing about time.
STAMP_STEP = 1_000_000_000

_NO_STATE = (0.0,) * 18


@dataclass(slots=True)
class ChassisFilter:
    """Filters IMU messages one at a time (`step`) or many (`columns`), in any mixture.

    `reach` (m) is how far from the IMU the push counts. After a step: `elapsed` (ns) since the filters began, 0 while they have nothing; `step_s` (s)
    since the message before; `state` are 18 numbers: the push filtered once and twice, the rate
    (RATE), that filtered again (PUSH), the mean push (each 3), the x and y of gravity filtered
    (PUSH), and the mean step (s).
    """

    mounting: Matrix
    reach: float
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
    ) -> tuple[float, float, float] | None:
        """Take one message; `omega` and `force` in sensor axes, `gravity` in base axes.

        Return the squared rate about level axes and about z (rad2/s2), and the size of the push
        anywhere within `reach` (m/s2); None while the filters are not settled or the IMU is too
        slow. They begin anew where a number is missing or absurd.
        """
        step = stamp - self._stamp
        if not 0 < step <= STAMP_STEP:
            step = now - self._time
        self._stamp, self._time = stamp, now
        wx, wy, wz = omega
        ax, ay, az = force
        size = ax * ax + ay * ay + az * az
        gx, gy, gz = gravity
        if not wx * wx + wy * wy + wz * wz + size + abs(gx) <= BELIEVABLE * BELIEVABLE:
            self.running, self.elapsed = False, 0
            return None
        if size > SHOCK * SHOCK:
            share = SHOCK / math.sqrt(size)
            ax, ay, az = share * ax, share * ay, share * az
        if self.mounting is not IDENTITY:
            wx, wy, wz = rotate(self.mounting, (wx, wy, wz))  # type: ignore[assignment]  # numbers
            ax, ay, az = rotate(self.mounting, (ax, ay, az))  # type: ignore[assignment]
        ax, ay, az = ax + gx, ay + gy, az + gz
        if not (self.running and 0 < step <= LONGEST_STEP):
            self.running, self.elapsed, self.step_s = True, 0, 0.0
            first = (ax, ay, az, ax, ay, az, wx, wy, wz, wx, wy, wz)
            self.state = (*first, ax, ay, az, gx, gy, 0.0)
            return None
        dt = step * 1e-9
        if dt != self.step_s:
            self.step_s, self._keep = dt, (math.exp(-dt / PUSH), math.exp(-dt / RATE))
        f, r = self._keep
        paced = m = dt / min(self.elapsed * 1e-9 + dt + dt, MEAN)
        if not self.elapsed:
            paced = 1.0
        self.elapsed += step
        ux, uy, uz, vx, vy, vz, px, py, pz, qx, qy, qz, mx, my, mz, lx, ly, pace = self.state
        ux = ax + f * (ux - ax)
        uy = ay + f * (uy - ay)
        uz = az + f * (uz - az)
        px = wx + r * (px - wx)
        py = wy + r * (py - wy)
        pz = wz + r * (pz - wz)
        vx, vy, vz = ux + f * (vx - ux), uy + f * (vy - uy), uz + f * (vz - uz)
        qx, qy, qz = px + f * (qx - px), py + f * (qy - py), pz + f * (qz - pz)
        mx, my, mz = mx + m * (ux - mx), my + m * (uy - my), mz + m * (uz - mz)
        lx, ly, pace = gx + f * (lx - gx), gy + f * (ly - gy), pace + paced * (dt - pace)
        of = (ux, uy, uz, vx, vy, vz, px, py, pz, qx, qy, qz, mx, my, mz, lx, ly, pace)
        self.state = of
        if pace > SLOWEST or self.elapsed < SETTLED:
            return None
        flat, up = px * px + py * py, pz * pz
        off = math.sqrt(vx * vx + vy * vy + vz * vz)
        alpha = (abs(px - qx) + abs(py - qy) + abs(pz - qz)) / PUSH
        return flat, up, off + self.reach * (alpha + flat + up)

    def columns(
        self, time: Times, stamp: Times, omega: Floats, force: Floats, gravity: Floats
    ) -> 'FeltRows':
        """Take many messages: vectors as (3, n); the same numbers as `step` for each."""
        steps, fresh, good = self._steps(time, stamp, omega, force, gravity)
        elapsed, began = self._since(steps, fresh)
        step = steps * 1e-9
        size = np.sqrt((force * force).sum(axis=0))
        force = np.where(size > SHOCK, force * (SHOCK / size), force)
        push = self._turned(force) + gravity
        x = np.where(good, np.concatenate((push, gravity[:2], self._turned(omega))), 0.0)
        f = np.where(fresh, 0.0, np.exp(-step / PUSH))
        r = np.where(fresh, 0.0, np.exp(-step / RATE))
        new = np.where(fresh, 1.0, step / np.minimum(elapsed * 1e-9 + step, MEAN))
        before = np.array(self.state)
        once = recursion(f, x[:5], before[[0, 1, 2, 15, 16]])
        rate = recursion(r, x[5:], before[6:9])
        push, lagging = once[:3], np.concatenate((once[:3], rate))
        twice = recursion(f, lagging, before[[3, 4, 5, 9, 10, 11]])
        mean = recursion(1.0 - new, push, before[12:15])
        second = np.concatenate(([self.running and self.elapsed == 0], fresh[:-1])) & ~fresh
        pace = recursion(np.where(second, 0.0, 1.0 - new), step[None], before[17:])
        last = (push, twice[:3], rate, twice[3:], mean, once[3:], pace)
        self.state = tuple(np.concatenate([part[:, -1] for part in last]).tolist())
        self.elapsed, self.running = int(elapsed[-1]), bool(good[-1])
        self._stamp, self._time = int(stamp[-1]), int(time[-1])
        return FeltRows(step, elapsed, began, twice[:3], rate, twice[3:], mean, once[3:], pace[0])

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


@dataclass(frozen=True, slots=True)
class FeltRows:
    """The filters' output, one column a message; vectors (3, n) in base axes.

    `step` (n,) s is since the message before, `elapsed` (n,) ns since the filters began, in row
    `began` (n,) (-1: before these rows). `push` (m/s2) filtered twice, `rate` (rad/s) once,
    `lagging` the rate filtered once more, `mean` the mean push (m/s2), `level` the x and y of
    gravity filtered (m/s2), `pace` (n,) the mean step (s).
    """

    step: Floats
    elapsed: Times
    began: NDArray[np.intp]
    push: Floats
    rate: Floats
    lagging: Floats
    mean: Floats
    level: Floats
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
