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
# Rows of a piece of a recursion, and of a block: what fits the processor's cache.
PIECE, BLOCK = 12, 2048
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
        self.elapsed += step
        m = dt / min(self.elapsed * 1e-9 + dt, MEAN)
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
        lx, ly, pace = gx + f * (lx - gx), gy + f * (ly - gy), pace + m * (dt - pace)
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
        y = np.empty((len(_NO_STATE), len(step)))
        for first in range(0, len(step), BLOCK):
            part = slice(first, first + BLOCK)
            x = (self._pushes(force[:, part], gravity[:, part]), gravity[:2, part])
            x = np.concatenate((*x, self._turned(omega[:, part]), step[None, part]))
            if not good[part].all():
                x = np.where(good[part], x, 0.0)
            keep = np.empty((3, x.shape[1]))
            keep[0], keep[1] = np.exp(step[part] / -PUSH), np.exp(step[part] / -RATE)
            keep[2] = 1.0 - step[part] / np.minimum(elapsed[part] * 1e-9 + step[part], MEAN)
            keep[:, fresh[part]] = 0.0
            y[:, part] = _filtered(keep, x, np.array(self.state))
            self.state = tuple(y[:, part][:, -1].tolist())
        self.elapsed, self.running = int(elapsed[-1]), bool(good[-1])
        self._stamp, self._time = int(stamp[-1]), int(time[-1])
        return FeltRows(step, elapsed, began, y[3:6], y[6:9], y[9:12], y[12:15], y[15:17], y[17])

    def _pushes(self, force: Floats, gravity: Floats) -> Floats:
        """Return what the accelerometer feels beside gravity (3, n), in base axes."""
        size = (force * force).sum(axis=0)
        if (size > SHOCK * SHOCK).any():
            force = np.where(size > SHOCK * SHOCK, force * (SHOCK / np.sqrt(size)), force)
        push: Floats = self._turned(force) + gravity
        return push

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


def _filtered(keep: Floats, x: Floats, before: Floats) -> Floats:
    """Return all filters' outputs (18, n), as ChassisFilter's `state`, for a part of the messages.

    `keep` (3, n) are the shares kept by filters of PUSH, RATE and MEAN; `x` (9, n) is push (3), x
    and y of gravity, rate (3), and step; `before` (18,) the state before.
    """
    n = len(keep[0])
    f, r, m = (Keep.of(line) for line in keep)
    x = in_pieces(x, 0.0)
    once = f.run(x[:, :5], before[[0, 1, 2, 15, 16]])
    rate = r.run(x[:, 5:8], before[6:9])
    twice = f.run(np.concatenate((once[:, :3], rate), axis=1), before[[3, 4, 5, 9, 10, 11]])
    mean = m.run(np.concatenate((once[:, :3], x[:, 8:]), axis=1), before[[12, 13, 14, 17]])
    push, level = once[:, :3], once[:, 3:]
    parts = (push, twice[:, :3], rate, twice[:, 3:], mean[:, :3], level, mean[:, 3:])
    return in_rows(np.concatenate(parts, axis=1), n)


def recursion(keep: Floats, x: Floats, before: Floats) -> Floats:
    """Return y[k] = x[k] + keep[k] (y[k - 1] - x[k]) along the last axis, shape (r, n).

    `keep` (n,), `x` (r, n), `before` (r,) is y[-1].
    """
    return in_rows(Keep.of(keep).run(in_pieces(x, 0.0), before), len(keep))


def in_pieces(x: Floats, pad: float) -> Floats:
    """Return `x` (r, n) cut into pieces of PIECE rows that run side by side: (PIECE, r, pieces)."""
    rows, n = x.shape
    count = -(-n // PIECE)
    padded = np.full((rows, count, PIECE), pad)
    padded.reshape(rows, -1)[:, :n] = x
    return padded.transpose(2, 0, 1).copy()


def in_rows(y: Floats, n: int) -> Floats:
    """Return the first `n` rows of pieces in their order: the inverse of `in_pieces`, (r, n)."""
    found: Floats = y.transpose(1, 2, 0).reshape(y.shape[1], -1)[:, :n]
    return found


@dataclass(frozen=True, slots=True)
class Keep:
    """What a filter keeps of its last output at each row, in pieces: (PIECE, 1, pieces).

    `product` is that since the beginning of the piece.
    """

    share: Floats
    product: Floats

    @classmethod
    def of(cls, keep: Floats) -> 'Keep':
        """Return it for shares (n,)."""
        share = in_pieces(keep[None], 1.0)
        return cls(share, np.multiply.accumulate(share, axis=0))

    def run(self, x: Floats, before: Floats) -> Floats:
        """Return the filter's output for `x` (PIECE, r, pieces); `before` (r,) is that before.

        What a piece carries on into the next is added after; it is a recursion over the pieces.
        """
        y = x * (1.0 - self.share)
        for k in range(1, PIECE):
            y[k] += self.share[k] * y[k - 1]
        carried = before[:, None]
        if y.shape[2] > 1:
            keep, gain = self.product[-1, 0, :-1], y[-1, :, :-1]
            inner = Keep.of(keep)
            # As an input that, weighted by 1 - keep, gives what the piece adds: 0 where all is kept.
            with np.errstate(all='ignore'):
                given = np.where(keep < 1.0, gain / (1.0 - keep), 0.0)
            carried = np.concatenate((carried, in_rows(inner.run(in_pieces(given, 0.0), before), len(keep))), axis=1)
        y += self.product * carried
        return y
