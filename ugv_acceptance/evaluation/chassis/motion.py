"""Holds what the chassis feels against the edges it stands on: live, one IMU message at a time.

columns.py does the same for recordings. A message in which the robot neither turns nor is pushed
hard costs the filters and one comparison; the margins are computed for the others alone.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

from ugv_acceptance.evaluation.alerts.state_machine import Signal
from ugv_acceptance.evaluation.chassis.filters import (
    FORCE,
    LEARNT,
    SETTLED,
    SLOWEST,
    ChassisFilter,
)
from ugv_acceptance.evaluation.settings import ImuInput, Settings
from ugv_acceptance.model.edges import SIDES, corners_of
from ugv_acceptance.model.kernels import Kernel
from ugv_acceptance.model.mechanics import Mechanics, mechanics_of
from ugv_acceptance.model.robot import IDENTITY, Payload, Vector
from ugv_acceptance.model.stability import Stance
from ugv_acceptance.model.tipping import inertia_of, tipping_of
from ugv_acceptance.model.tree import pose_of, point_of

Four = tuple[float, ...]

# The accelerometer is believed while its mean is so near (m/s2) to gravity, and through an episode
# that began so for at most HELD (ns).
TRUE, HELD = 1.0, 2_000_000_000
# Less specific force than this share of g tells no direction.
FALL = 0.3
# Margins (rad) of a moving robot: caution, and where caution ends.
CAUTION, CALM = math.radians(5.0), math.radians(6.0)
# The turn counts if it takes this much (rad) of the static margin: else TIP_OVER says it all.
MATTERS = math.radians(1.0)
# An edge under effective gravity below LOW (rad) begins an episode, which lasts BACK (ns) longer. A
# turn towards it of LIFT (rad) meanwhile is a lift, one below NONE (rad) is none.
LOW, BACK = math.radians(3.0), 100_000_000
LIFT, NONE = math.radians(1.0), math.radians(0.5)
# The square of the natural frequency (1/s2) is above this on any robot that one man can stand
# beside (its centre of gravity less than 4 m from the edge): rates far below need no closer look.
SLOW_PENDULUM = 2.0
# How the rate of a message is known: not measured or not to be trusted; without an orientation of
# the IMU's own to compare it with; with one, which must turn by this share of the rate at least.
NO_RATE, UNWITNESSED, WITNESSED = range(3)
WITNESS = 0.25
RIGHT = math.pi / 2
COS_CALM = math.cos(CALM)
LONG_AGO = -(2**62)
# The value of a signal where nothing is the matter.
NOTHING = -math.inf
CALMEST: Four = (NOTHING,) * len(SIDES)
UNKNOWN4: Four = (math.nan,) * len(SIDES)


@dataclass(frozen=True, slots=True)
class ChassisSignals:
    """The signals of a chassis in motion, one to each of SIDES.

    `caution`, `danger`: minus the margin with the energy of the turn (rad); `push`: minus the
    margin under effective gravity (rad); `lift`: the turn since that was low (rad).
    """

    caution: Sequence[Signal]
    danger: Sequence[Signal]
    push: Sequence[Signal]
    lift: Sequence[Signal]

    def all(self) -> tuple[Sequence[Signal], ...]:
        """Return the signals of each kind in a fixed order."""
        return self.caution, self.danger, self.push, self.lift

    def quiet(self) -> bool:
        """Return whether all signals are quiet."""
        return all([signal.quiet for kind in self.all() for signal in kind])


@dataclass(slots=True)
class Episodes:
    """How far the robot turned towards each side while effective gravity was near tipping there.

    `turn` (rad), `past` (s) how long the margin has been below 0, each to one of SIDES. The times
    (ns) are `elapsed` of the filters: when the margin to a side and when any was last low, when the push
    was last hard enough to look closer, and when the mean force was last gravity.
    """

    turn: list[float] = field(default_factory=lambda: [0.0] * len(SIDES))
    past: list[float] = field(default_factory=lambda: [0.0] * len(SIDES))
    low_at: list[int] = field(default_factory=lambda: [LONG_AGO] * len(SIDES))
    newest: int = LONG_AGO
    hard_at: int = LONG_AGO
    trusted_at: int = LONG_AGO
    clock: int = LONG_AGO

    def begin(self) -> None:
        """Forget everything: the filters began anew."""
        self.low_at = [LONG_AGO] * len(SIDES)
        self.newest = self.hard_at = self.trusted_at = self.clock = LONG_AGO

    def believed(self, elapsed: int) -> bool:
        """Return whether the accelerometer is believed: now, or since before this episode."""
        if self.trusted_at == elapsed:
            return True
        return elapsed - self.newest < BACK and elapsed - self.trusted_at <= HELD

    def step(
        self, elapsed: int, dt: float, effective: Sequence[float], against: Sequence[float]
    ) -> None:
        """Take the margins under effective gravity (rad) and minus the rates to the edges (rad/s).

        `dt` (s) is since the message before.
        """
        if not 0 <= elapsed - self.clock <= BACK:
            self.turn, self.past = [0.0] * len(SIDES), [0.0] * len(SIDES)
        self.clock = elapsed
        for k, (margin, w) in enumerate(zip(effective, against, strict=True)):
            if margin < LOW:
                self.low_at[k] = self.newest = elapsed
            near = elapsed - self.low_at[k] < BACK
            self.turn[k] = max(self.turn[k] - w * dt, 0.0) if near else 0.0
            self.past[k] = self.past[k] + dt if margin < 0.0 else 0.0

    def contradicted(self, frequency: Sequence[float]) -> list[bool]:
        """Return to which sides it was past tipping for longer than 1 / wn and did not turn.

        `frequency` is wn^2 (1/s2).
        """
        found = zip(self.past, self.turn, frequency, strict=True)
        return [past * past * wn2 > 1.0 and turn < NONE for past, turn, wn2 in found]


# What a posture determines: stance, joint positions (rad, m), payload.
Standing = tuple[Stance, tuple[float, ...], Payload]


@dataclass(slots=True)
class ChassisMotion:
    """What live and recorded forms share: filters, episodes, signals, compiled mechanics.

    `stands` is how the robot stands since the newest joint state, None while that is not known.
    `reach` (m) is how far the contacts are from the IMU. `busy` says that a signal is not quiet,
    `turned` that the gyro showed any number but 0: one that never does is none.
    """

    settings: Settings
    signals: ChassisSignals
    filter: ChassisFilter = field(init=False)
    mechanics: Mechanics = field(init=False)
    reach: float = field(init=False)
    episodes: Episodes = field(default_factory=Episodes)
    stands: Standing | None = None
    busy: bool = False
    turned: bool = False
    _inertia: tuple[Standing | None, Four] = (None, ())

    def __post_init__(self) -> None:
        imu, robot = self.settings.imu, self.settings.robot
        self.mechanics = mechanics_of(robot)
        self.filter = ChassisFilter(IDENTITY if imu.mounting == IDENTITY else imu.mounting)
        self.reach = reach_of(self.mechanics, imu.position)

    def step(
        self,
        now: int,
        stamp: int,
        omega: Sequence[float],
        force: Sequence[float],
        gravity: Vector,
        angles: Four | None,
        rate: int,
    ) -> None:
        """Take an IMU message: rate and specific force in sensor axes, `gravity` in base axes.

        `angles` are the tip angles now (rad), None while they are not known; `rate` is
        NO_RATE, UNWITNESSED or WITNESSED.
        """
        felt = self.filter
        felt.step(now, stamp, omega, force, gravity)
        if felt.elapsed < SETTLED:
            self.episodes.begin()
        if not self.turned:
            self.turned = any(omega)
        if angles is not None and rate and self.turned and felt.elapsed >= SETTLED:
            self._judge(now, gravity, angles, rate)

    def _judge(self, now: int, gravity: Vector, angles: Four, rate: int) -> None:
        _, _, _, fx, fy, fz, px, py, pz, qx, qy, qz, mx, my, mz, *_, pace = self.filter.state
        least, stands = min(angles), self.stands
        if stands is None or stands[0].edges is None or pace > SLOWEST or least != least:  # noqa: PLR0124 - NaN
            return
        square = flat = px * px + py * py
        if stands[0].state:  # not flat on its tracks
            square += pz * pz
        spins = square > 2.0 * SLOW_PENDULUM * (COS_CALM - math.cos(least))
        pushed = False
        elapsed, of = self.filter.elapsed, self.episodes
        if mx * mx + my * my + mz * mz <= TRUE * TRUE and elapsed >= LEARNT:
            of.trusted_at = elapsed
        fall = FALL * self.settings.robot.gravity
        if elapsed - of.trusted_at <= HELD and fx * fx + fy * fy + fz * fz >= fall * fall:
            gx, gy, gz = gravity
            dx, dy, dz = fx + gx, fy + gy, fz + gz
            alpha = (abs(px - qx) + abs(py - qy) + abs(pz - qz)) / FORCE
            off = math.sqrt(dx * dx + dy * dy + dz * dz) + self.reach * (alpha + flat + pz * pz)
            if off > -gz * math.sin(min(least - LOW, RIGHT)):
                of.hard_at = elapsed
            pushed = elapsed - of.hard_at < BACK
        if spins or pushed:
            self._look(now, gravity, angles, (spins, pushed, rate))
        elif self.busy:
            self._feed(now, (CALMEST,) * 4)

    def _look(self, now: int, gravity: Vector, angles: Four, which: tuple[bool, bool, int]) -> None:
        """Compute the margins; `which`: whether it spins, is pushed, and how the rate is known."""
        spins, pushed, rate = which
        margin, effective, against, _ = self.margins(gravity)
        turning = certain = unloaded = lift = CALMEST
        if spins:
            turning = tuple(
                [-m if a - m > MATTERS else NOTHING for m, a in zip(margin, angles, strict=True)]
            )
            _, _, _, _, _, _, *spin, _, _, _, _, _, _, lx, ly, lz, _ = self.filter.state
            if rate == UNWITNESSED or witnessed(spin[:3], gravity, (lx, ly, lz)):
                certain = turning
        of = self.episodes
        if pushed and of.believed(self.filter.elapsed):
            of.step(self.filter.elapsed, self.filter.step_s, effective, against)
            unloaded, lift = tuple([-x for x in effective]), tuple(of.turn)
        self._feed(now, (turning, certain, unloaded, lift))

    def margins(self, gravity: Vector) -> tuple[Four, ...]:
        """Return the four results of model/tipping.py for the newest message and stance."""
        if self.stands is None:
            return (UNKNOWN4,) * 4
        stance, q, load = self.stands
        if self._inertia[0] is not self.stands:
            self._inertia = self.stands, inertia_of(self.mechanics).one(*q, load.mass, *load.cog)
        kernel = stance_kernel(self.mechanics, stance, self.settings.imu.position)
        _, _, _, fx, fy, fz, px, py, pz, qx, qy, qz, *_ = self.filter.state
        alpha = ((px - qx) / FORCE, (py - qy) / FORCE, (pz - qz) / FORCE)
        felt = (*gravity, fx, fy, fz, px, py, pz, *alpha)
        return kernel.one(*stance.terms, stance.mass, *self._inertia[1], *felt)

    def moving(self, gravity: Vector, angles: Four) -> Four | None:
        """Return the tilt left (rad) to each of SIDES with the energy of the turn; None: no gyro."""
        felt = self.filter
        if not (self.turned and felt.elapsed >= SETTLED and felt.state[-1] <= SLOWEST):
            return None
        if self.stands is None or self.stands[0].edges is None:
            return None
        return tuple(map(min, self.margins(gravity)[0], angles))

    def _feed(self, now: int, values: Sequence[Four]) -> None:
        """Feed the signals: CAUTION and DANGER of the turn, push, lift, each to SIDES."""
        for signals, some in zip(self.signals.all(), values, strict=True):
            for signal, value in zip(signals, some, strict=True):
                signal.step(now, value)
        self.busy = not self.signals.quiet()

    def lose(self, now: int) -> None:
        """Take that margins are unknown from `now` (ns) on: nothing is held by them."""
        for signal in chain.from_iterable(self.signals.all()):
            if not signal.quiet:
                signal.clear(now)


def witnessed(rate: Sequence[Any], gravity: Sequence[Any], before: Sequence[Any]) -> Any:  # noqa: ANN401 - bool or array
    """Return whether the orientation turns as the gyro says: by WITNESS of its rate or more.

    `rate` (rad/s), gravity now and filtered (m/s2), each three floats or arrays, in base axes. A
    gyro in other units, or an orientation that is stuck, differ by far more.
    """
    (px, py, _), (gx, gy, gz), (lx, ly, lz) = rate, gravity, before
    dx, dy, dz = gx - lx, gy - ly, gz - lz
    along = px * (dy * gz - dz * gy) + py * (dz * gx - dx * gz)
    size = FORCE * (gx * gx + gy * gy + gz * gz)
    return along >= WITNESS * size * (px * px + py * py)


def reach_of(mechanics: Mechanics, imu: Vector) -> float:
    """Return the distance (m) from the IMU to the furthest contact, all joints at zero."""
    tree = mechanics.tree
    pose = pose_of(tree, [0.0] * (len(tree.bodies) - 1))
    feet: Any = [point_of(tree, pose, c.link, c.position)[1] for c in mechanics.robot.contacts]
    return max((math.dist(foot, imu) for foot in feet), default=0.0)


def rate_of(omega_covariance_0: float, covariance_0: float, imu: ImuInput) -> int:
    """Return how the rate of a message is known, from the covariances of rate and orientation."""
    if omega_covariance_0 == -1.0:
        return NO_RATE
    alone = covariance_0 == -1.0 or imu.attitude == 'accelerometer' or imu.specific_force
    return UNWITNESSED if alone else WITNESSED


def stance_kernel(mechanics: Mechanics, stance: Stance, imu: Vector) -> Kernel:
    """Return the kernel of model/tipping.py for the edges of a stance (which has some)."""
    return tipping_of(mechanics, corners_of(mechanics, stance.support.polygon), stance.sides, imu)
