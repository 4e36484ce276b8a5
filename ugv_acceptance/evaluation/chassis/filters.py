"""What the chassis feels: rate, angular acceleration and push, filtered, in base axes.

The push is what the accelerometer feels beside gravity: specific force plus gravity, 0 at rest.
All filters are of first order and recursive, y = x + keep (y - x). Whether the accelerometer
measures gravity at all, and the IMU is fast enough, is known from blocks of half a second.
filter_columns.py does the same for columns; a property test holds that both give the same.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from ugv_acceptance.evaluation.inputs.low_pass import BELIEVABLE
from ugv_acceptance.model.expressions import rotate
from ugv_acceptance.model.robot import IDENTITY, Matrix, Vector

# Time constants (s): of the push (twice in a row) and of the rate.
PUSH, RATE = 0.03, 0.02
# A longer step (ns) between two messages starts the filters anew.
LONGEST_STEP = 200_000_000
# Length (ns) of a block, and the number of blocks before this one whose mean push tells whether the
# accelerometer measures gravity: it is below TRUE (m/s2) then.
BLOCK, BLOCKS, TRUE = 500_000_000, 4, 1.0
# Messages in a block (mean) below which an IMU is too slow: 50 Hz, with some messages lost.
FEWEST = 22.5
# A force (m/s2) beyond this is a shock, which tips nothing: it counts as one of this size.
SHOCK = 20.0
# Stamps (ns) that step further than this say nothing about time.
STAMP_STEP = 1_000_000_000

# Sum of the push (3) and number of messages of a block.
Block = tuple[float, float, float, int]


@dataclass(slots=True)
class Blocks:
    """The newest whole blocks, and what they tell: `known` once there is one."""

    whole: list[Block] = field(default_factory=list)
    known: bool = False
    true: bool = False
    fast: bool = False

    def add(self, block: Block) -> None:
        """Take a block that is over."""
        whole = self.whole
        if len(whole) == BLOCKS:
            del whole[0]
        whole.append(block)
        x = y = z = 0.0
        count = 0
        for bx, by, bz, many in whole:
            x, y, z, count = x + bx, y + by, z + bz, count + many
        self.known = True
        self.true = x * x + y * y + z * z <= (TRUE * count) ** 2
        self.fast = count >= FEWEST * len(whole)

    def forget(self) -> None:
        """Begin anew."""
        self.whole.clear()
        self.known = self.true = self.fast = False


@dataclass(slots=True)
class ChassisFilter:
    """Filters IMU messages one at a time.

    `reach` (m) is how far from the IMU the push counts. After a step: `elapsed` (ns) since the
    filters began, `step_s` (s) since the message before; `state` are 14 numbers: the push filtered
    once and twice, the rate (RATE), that filtered again (PUSH) (each 3), and the x and y of gravity
    filtered (PUSH). `sums` is the block that goes on.
    """

    mounting: Matrix
    reach: float
    elapsed: int = 0
    step_s: float = 0.0
    state: tuple[float, ...] = (0.0,) * 14
    running: bool = False
    blocks: Blocks = field(default_factory=Blocks)
    sums: Block = (0.0, 0.0, 0.0, 0)
    _over: int = BLOCK
    _stamp: int = 0
    _time: int = 0
    _keep: tuple[float, float] = (0.0, 0.0)

    def step(  # noqa: PLR0915 - every message would pay for another call
        self,
        now: int,
        stamp: int,
        omega: Sequence[float],
        force: Sequence[float],
        gravity: Vector,
    ) -> tuple[float, float, float] | None:
        """Take one message; `omega` and `force` in sensor axes, `gravity` in base axes.

        Return the squared rate about level axes and about z (rad2/s2), and the size of the push
        anywhere within `reach` (m/s2); None in the first block and while the IMU is too slow. The
        filters begin anew where a number is missing or absurd.
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
            self.blocks.forget()
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
            self.state = (ax, ay, az, ax, ay, az, wx, wy, wz, wx, wy, wz, gx, gy)
            self.blocks.forget()
            self.sums, self._over = (ax, ay, az, 1), BLOCK
            return None
        dt = step * 1e-9
        if dt != self.step_s:
            self.step_s, self._keep = dt, (math.exp(-dt / PUSH), math.exp(-dt / RATE))
        f, r = self._keep
        self.elapsed += step
        sx, sy, sz, count = self.sums
        if self.elapsed >= self._over:
            self.blocks.add(self.sums)
            sx, sy, sz, count = 0.0, 0.0, 0.0, 0
            self._over = self.elapsed - self.elapsed % BLOCK + BLOCK
        self.sums = (sx + ax, sy + ay, sz + az, count + 1)
        ux, uy, uz, vx, vy, vz, px, py, pz, qx, qy, qz, lx, ly = self.state
        ux, uy, uz = ax + f * (ux - ax), ay + f * (uy - ay), az + f * (uz - az)
        vx, vy, vz = ux + f * (vx - ux), uy + f * (vy - uy), uz + f * (vz - uz)
        px, py, pz = wx + r * (px - wx), wy + r * (py - wy), wz + r * (pz - wz)
        qx, qy, qz = px + f * (qx - px), py + f * (qy - py), pz + f * (qz - pz)
        lx, ly = gx + f * (lx - gx), gy + f * (ly - gy)
        self.state = (ux, uy, uz, vx, vy, vz, px, py, pz, qx, qy, qz, lx, ly)
        if not self.blocks.fast:
            return None
        flat, up = px * px + py * py, pz * pz
        off = math.sqrt(vx * vx + vy * vy + vz * vz)
        alpha = (abs(px - qx) + abs(py - qy) + abs(pz - qz)) / PUSH
        return flat, up, off + self.reach * (alpha + flat + up)
