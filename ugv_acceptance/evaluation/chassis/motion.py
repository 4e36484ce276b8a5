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
from ugv_acceptance.evaluation.chassis.filters import PUSH, ChassisFilter
from ugv_acceptance.evaluation.settings import ImuInput, Settings
from ugv_acceptance.model.edges import SIDES, corners_of
from ugv_acceptance.model.kernels import Kernel
from ugv_acceptance.model.mechanics import Mechanics, mechanics_of
from ugv_acceptance.model.robot import IDENTITY, Payload, Vector
from ugv_acceptance.model.stability import Stance
from ugv_acceptance.model.tipping import inertia_of, tipping_of
from ugv_acceptance.model.tree import body_positions, drives_of, point_of, pose_of

Four = tuple[float, ...]

# The accelerometer is believed while it measures gravity in the mean (filters.py), and through an
# episode that began so for at most HELD (ns).
HELD = 2_000_000_000
# Less specific force against gravity than this share of g tells no direction.
FALL = 0.3
# Margins (rad) of a moving robot: caution, and where caution ends.
CAUTION, CALM = math.radians(5.0), math.radians(6.0)
# A turn or a push counts if it takes this much (rad) of the static margin: else TIP_OVER says it.
MATTERS = math.radians(1.0)
# An edge under effective gravity below LOW (rad) begins an episode, which lasts BACK (ns) longer. A
# turn towards it of LIFT (rad) meanwhile is a lift, one below NONE (rad) is none.
LOW, BACK = math.radians(3.0), 100_000_000
LIFT, NONE = math.radians(1.0), math.radians(0.5)
# A closer look is taken where the rate may leave less than CALM of the least tip angle: its square
# is above SPIN angle^2 - SPIN_LESS, as 1 - cos(angle) > 0.4 angle^2, and as the square of the
# natural frequency is above 2 / s2 on any robot whose centre of gravity is less than 4 m from the
# edge.
SPIN, SPIN_LESS = 2.0 * 2.0 * 0.4, 2.0 * 2.0 * (1.0 - math.cos(CALM))
# And only where it may take MATTERS of any tip angle: by model/tipping.py its square is then above
# 4 wn^2 (sin^2(angle / 2) - sin^2((angle - MATTERS) / 2)), which is 4 wn^2 sin(angle - MATTERS / 2)
# sin(MATTERS / 2) from an angle of MATTERS on, and never less than TURN; STEEP is far from flat.
TURN, TURNS = 16.0 * math.sin(MATTERS / 4.0) ** 2, 8.0 * math.sin(MATTERS / 2.0)
STEEP = 0.5
# So it is where the push may leave less than LOW: it is above 0.8 g (angle - LOW), which is below
# g sin(angle - LOW) up to 1.1 rad. (Gravity's z is negative.)
HARD, HARD_UP_TO = -0.8, 1.1
# How the rate of a message is known: not measured or not to be trusted; without an orientation of
# the IMU's own to compare it with; with one, which must turn by this share of the rate at least.
NO_RATE, UNWITNESSED, WITNESSED = range(3)
WITNESS = 0.25
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
        return all(signal.quiet for kind in self.all() for signal in kind)


@dataclass(slots=True)
class Episodes:
    """How far the robot turned towards each side while effective gravity was near tipping there.

    `turn` (rad), `past` (s) how long the margin has been below 0, each to one of SIDES. The times
    (ns) are `elapsed` of the filters: when the margin to a side and when any was last low, when the
    push was last hard enough to look closer, and when the mean force was last gravity.
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
        """Return whether the accelerometer is believed now, or was when this episode began."""
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
            near = elapsed - self.low_at[k] < BACK
            turn = self.turn[k] if near else 0.0
            if margin < LOW:
                self.low_at[k] = self.newest = elapsed
                near = True
            self.turn[k] = max(turn - w * dt, 0.0) if near else 0.0
            self.past[k] = self.past[k] + dt if margin < 0.0 else 0.0

    def contradicted(self, frequency: Sequence[float]) -> list[bool]:
        """Return to which sides it was past tipping for longer than 1 / wn and did not turn.

        `frequency` is wn^2 (1/s2).
        """
        found = zip(self.past, self.turn, frequency, strict=True)
        return [past * past * wn2 > 1.0 and turn < NONE for past, turn, wn2 in found]


# What the inertia depends on: joint positions (rad, m), payload.
Pose = tuple[tuple[float, ...], Payload]


@dataclass(slots=True)
class ChassisMotion:
    """What live and recorded forms share: filters, episodes, signals, compiled mechanics.

    `pose` is that of the newest joint state, `stance` how the robot stands by the newest margins,
    None while that is not known.
    `busy` says that a signal is not quiet,
    `turned` that the gyro showed any number but 0: one that never does is none.
    """

    settings: Settings
    signals: ChassisSignals
    filter: ChassisFilter = field(init=False)
    mechanics: Mechanics = field(init=False)
    episodes: Episodes = field(default_factory=Episodes)
    pose: Pose | None = None
    stance: Stance | None = None
    busy: bool = False
    turned: bool = False
    _inertia: tuple[Pose | None, Four] = (None, ())

    def __post_init__(self) -> None:
        self.mechanics = mechanics_of(self.settings.robot)
        self.filter = ChassisFilter(IDENTITY, 0.0)
        self.place(self.settings)

    def place(self, settings: Settings) -> None:
        """Take settings with another place of the IMU."""
        self.settings, imu = settings, settings.imu
        self.filter.mounting = IDENTITY if imu.mounting == IDENTITY else imu.mounting
        self.filter.reach = reach_of(self.mechanics, imu.position)

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
        found = felt.step(now, stamp, omega, force, gravity)
        if not self.turned:
            self.turned = any(omega)
        if found is None:
            if not felt.blocks.known:
                self.episodes.begin()
            return
        stance = self.stance
        if stance is None or angles is None or not rate or not self.turned:
            return
        least = min(angles)
        if stance.edges is None or not least > 0.0:  # past tipping at rest: TIP_OVER says it all
            return
        square, up, off = found
        if stance.state:  # not flat on its tracks
            square += up
        spins = square > SPIN * least * abs(least) - SPIN_LESS and square > turn_bound(least)
        if off > HARD * gravity[2] * min(least - LOW, HARD_UP_TO):
            self.episodes.hard_at = felt.elapsed
        if spins or felt.elapsed - self.episodes.hard_at < BACK:
            self._look(now, gravity, angles, (spins, rate))
        elif self.busy:
            self._feed(now, (CALMEST,) * 4)

    def _look(self, now: int, gravity: Vector, angles: Four, which: tuple[bool, int]) -> None:
        """Look closer at a message: `which` says whether the robot spins, and how that is known."""
        spins, rate = which
        felt, of = self.filter, self.episodes
        pushed = felt.elapsed - of.hard_at < BACK and self._pushed(gravity)
        if not (spins or pushed):
            if self.busy:
                self._feed(now, (CALMEST,) * 4)
            return
        margin, effective, against, _ = self.margins(gravity)
        turning = certain = unloaded = lift = CALMEST
        if spins:
            turning = tuple(
                [-m if a - m > MATTERS else NOTHING for m, a in zip(margin, angles, strict=True)]
            )
            if (
                rate == UNWITNESSED
                or no_witness(self.settings.imu)
                or witnessed(felt.state[6:9], gravity, felt.state[12:])
            ):
                certain = turning
        if pushed:
            effective = tuple(
                [e if a - e > MATTERS else math.inf for e, a in zip(effective, angles, strict=True)]
            )
            of.step(felt.elapsed, felt.step_s, effective, against)
            unloaded, lift = tuple([-x for x in effective]), tuple(of.turn)
        self._feed(now, (turning, certain, unloaded, lift))

    def _pushed(self, gravity: Vector) -> bool:
        """Return whether to believe the push: the ground presses, and gravity is measured."""
        felt, of = self.filter, self.episodes
        vx, vy, vz = felt.state[3:6]
        gx, gy, gz = gravity
        if vx * gx + vy * gy + vz * gz > (1.0 - FALL) * self.settings.robot.gravity**2:
            return False
        if felt.blocks.true:
            of.trusted_at = felt.elapsed
        return of.believed(felt.elapsed)

    def margins(self, gravity: Vector) -> tuple[Four, ...]:
        """Return the four results of model/tipping.py for the newest message and stance."""
        stance = self.stance
        if self.pose is None or stance is None:
            return (UNKNOWN4,) * 4
        q, load = self.pose
        if self._inertia[0] is not self.pose:
            self._inertia = self.pose, inertia_of(self.mechanics).one(*q, load.mass, *load.cog)
        kernel = stance_kernel(self.mechanics, stance, self.settings.imu.position)
        _, _, _, vx, vy, vz, px, py, pz, qx, qy, qz, _, _ = self.filter.state
        gx, gy, gz = gravity
        alpha = ((px - qx) / PUSH, (py - qy) / PUSH, (pz - qz) / PUSH)
        felt = (*gravity, vx - gx, vy - gy, vz - gz, px, py, pz, *alpha)
        return run_tipping(kernel, stance, self._inertia[1], felt)

    def moving(self, gravity: Vector, angles: Four) -> Four | None:
        """Return the tilt left (rad) to each side with the energy of the turn; None: no gyro."""
        if not (self.turned and self.filter.blocks.fast):
            return None
        if self.stance is None or self.stance.edges is None:
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


def turn_bound(least: float) -> float:
    """Return the squared rate (rad2/s2) up to which no margin loses MATTERS of its tip angle."""
    return TURN if least < MATTERS else TURNS * math.sin(min(least, STEEP) - MATTERS / 2.0)


def witnessed(rate: Sequence[Any], gravity: Sequence[Any], before: Sequence[Any]) -> Any:  # noqa: ANN401 - bool or array
    """Return whether the orientation turns as the gyro says: by WITNESS of its rate or more.

    `rate` (rad/s) and `gravity` (m/s2, both three floats or arrays), and the x and y of gravity
    filtered `before`, in base axes. A gyro in other units, or an orientation that is stuck, differ
    by far more.
    """
    (px, py, _), (gx, gy, gz), (lx, ly) = rate, gravity, before
    along = (py * (gx - lx) - px * (gy - ly)) * -gz
    return along >= WITNESS * PUSH * (gx * gx + gy * gy + gz * gz) * (px * px + py * py)


def reach_of(mechanics: Mechanics, imu: Vector) -> float:
    """Return the distance (m) from the IMU to the furthest contact, all joints at zero."""
    robot, tree = mechanics.robot, mechanics.tree
    zero = body_positions(drives_of(robot, tree), [0.0] * len(robot.joint_names))
    pose = pose_of(tree, zero)
    feet: Any = [point_of(tree, pose, c.link, c.position)[1] for c in robot.contacts]
    return max((math.dist(foot, imu) for foot in feet), default=0.0)


def no_witness(imu: ImuInput) -> bool:
    """Return whether gravity comes from the accelerometer: no orientation witnesses the rate."""
    return imu.attitude == 'accelerometer' or imu.specific_force


def stance_kernel(mechanics: Mechanics, stance: Stance, imu: Vector) -> Kernel:
    """Return the kernel of model/tipping.py for the edges of a stance (which has some)."""
    footing, edges = stance.footing, stance.edges
    assert footing is not None and edges is not None  # noqa: S101, PT018 - for the type checker
    corners = corners_of(mechanics, footing.polygon)
    return tipping_of(mechanics, corners, stance.sides, imu, rocks=edges.rocks)


def run_tipping(
    kernel: Kernel, stance: Stance, inertia: Sequence[Any], felt: Sequence[Any]
) -> tuple[Any, ...]:
    """Return what the kernel of a stance says: floats or arrays. `felt` is what comes last."""
    rocking = (stance.rocking,) if stance.edges and stance.edges.rocks else ()
    return kernel.run(*stance.terms, stance.mass, *inertia, *felt, *rocking)
