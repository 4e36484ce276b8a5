"""Evaluates a running robot: every joint or IMU message at once gives new margins and alerts.

The counterpart for recordings is recorded.py, which gives the same margins and alerts.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from ugv_acceptance.evaluation.alerts.rules import InputSignals, RuleSet
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, OK, STALE, Signal
from ugv_acceptance.evaluation.alerts.tipping_watch import NOT_KNOWN as NO_TREND
from ugv_acceptance.evaluation.chassis.motion import (
    NO_RATE,
    UNWITNESSED,
    WITNESSED,
    ChassisMotion,
)
from ugv_acceptance.evaluation.ground_contact import FREE, PERMITTED, UNSUPPORTED, GroundContact
from ugv_acceptance.evaluation.inputs import joint_state_words as words
from ugv_acceptance.evaluation.inputs.frames import without_prefix
from ugv_acceptance.evaluation.inputs.imu import ORIENTATIONS, ImuTracker
from ugv_acceptance.evaluation.inputs.imu_mount import ImuMount
from ugv_acceptance.evaluation.inputs.joint_rows import NEVER
from ugv_acceptance.evaluation.inputs.joints import JointMerger
from ugv_acceptance.evaluation.inputs.low_pass import NOWHERE
from ugv_acceptance.evaluation.inputs.payload import payload_fault, payload_from
from ugv_acceptance.evaluation.inputs.timeouts import FOREVER, STARTUP, InputTimeout, clock_words
from ugv_acceptance.evaluation.sample_margins import LEVEL, Margins
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.mechanics import Mechanics, Posture, mechanics_of, posture_at
from ugv_acceptance.model.reactions import standing_torque
from ugv_acceptance.model.robot import Payload, Vector
from ugv_acceptance.model.shortened_tracks import has_tracks
from ugv_acceptance.model.sliding import slides_first
from ugv_acceptance.model.stability import (
    NO_CONTACT,
    NOT_KNOWN,
    RAISED,
    Stance,
    stances_of,
    standing,
    tip_angles_at,
)
from ugv_acceptance.model.statics import torque_of


@dataclass(slots=True)
class LiveEvaluator:
    """Takes messages as numbers with their receipt time (ns); holds the newest margins and alerts.

    `margins` is None while they are unknown: an input is missing, stale or unusable. `watch` holds
    the alert rules and the log of alerts, `evaluated` counts the margins computed. `payload` is the
    newest that could be used; while not `load_known`, the newest declared could not. `ground` says
    whether the arm touches the ground, `chassis` what its IMU feels, `joints` merges joint states,
    `fresh` has the inputs' timeouts. The margins rest on `posture` and `chassis.stance`.
    """

    settings: Settings
    watch: RuleSet = field(init=False)
    payload: Payload = field(init=False)
    load_known: bool = True
    margins: Margins | None = None
    evaluated: int = 0
    _mechanics: Mechanics = field(init=False)
    joints: JointMerger = field(init=False)
    mount: ImuMount = field(init=False)
    _imu: ImuTracker = field(init=False)
    chassis: ChassisMotion = field(init=False)
    ground: GroundContact = field(init=False)
    fresh: tuple[InputTimeout, InputTimeout] = field(init=False)
    posture: Posture | None = None
    _oldest: int = field(init=False)
    _q: tuple[float, ...] = ()
    _stances: tuple[Stance, ...] = ()
    _judged: tuple[Posture | None, Vector, tuple[float, ...], tuple[float, ...], int] = (
        None,
        NOWHERE,
        (),
        (),
        0,
    )
    _loud: bool = True
    _gravity: Vector = NOWHERE
    _began: int | None = None
    _known_until: int | None = None
    _level: bool = field(init=False)

    def __post_init__(self) -> None:
        self.watch = RuleSet(self.settings)
        self.payload = self.settings.robot.payload
        self._mechanics = mechanics_of(self.settings.robot)
        self.joints = JointMerger(self.settings, self.watch.jump_signals)
        self._oldest = min(self.joints.seen, default=FOREVER)
        self.mount = ImuMount(self.settings, *self.watch.mounting)
        placed = self.mount.applied(self.settings)
        self._imu = ImuTracker(placed, self.watch.attitude)
        self.chassis = ChassisMotion(placed, self.watch.chassis)
        self.mount.serve(self._imu, self.chassis.place)
        self.ground = GroundContact(self.settings, self._mechanics, self.watch.ground)
        delays = self.settings.delays
        self.fresh = (InputTimeout(delays), InputTimeout(delays))
        self._level = not self.settings.hears_imu
        if self._level:
            self._gravity = (0.0, 0.0, -self.settings.robot.gravity)
            self.fresh[1].last = FOREVER
        if not self.settings.hears_joints:
            self.fresh[0].last = FOREVER
            self._stand()

    def start(self, now: int) -> None:
        """Begin to listen at `now` (ns): an input of which no message comes will become stale."""
        for fresh in self.fresh:
            fresh.started = now
        self._began = self.ground.start = now

    def joint_state(
        self,
        now: int,
        stamp: int,
        names: tuple[str, ...],
        position: Sequence[float],
        velocity: Sequence[float],
        effort: Sequence[float],
    ) -> Margins | None:
        """Take a JointState message; return the new margins, None if they are unknown.

        A message that names none of the robot's joints is ignored.
        """
        joints, watch = self.joints, self.watch
        if not joints.merge(now, names, position, velocity, effort, stamp):
            return self.margins
        self._arrived(0, now, stamp, watch.joints)
        known = all(map(math.isfinite, joints.q))
        unusable = not known and any(
            t != NEVER and math.isnan(q) for q, t in zip(joints.q, joints.seen, strict=True)
        )
        # Here and below: a small value cannot change a quiet signal, so most calls are saved.
        if unusable or not watch.joints.invalid.quiet:
            if unusable and not watch.joints.invalid.raw:
                watch.joints.invalid.detail = words.why_unusable(joints)
            watch.joints.invalid.step(now, 1.0 if unusable else 0.0)
        limit = self.fresh[0].limit
        self._oldest = oldest = min(joints.seen)
        # A joint that was never told has STARTUP to come: another node may tell it, more slowly.
        late = oldest != NEVER or now - joints.began > STARTUP
        old = (late and now - oldest > limit) or joints.doubted
        if old or not watch.missing.quiet:
            if old and not watch.missing.raw:
                watch.missing.detail = words.what_is_missing(joints, now, limit)
            watch.missing.step(now, 1.0 if old else 0.0)
        if joints.repeated or not watch.repeated.quiet:
            watch.repeated.step(now, joints.repeated)
        for signal, rate in zip(watch.speed, joints.speed, strict=True):
            if rate >= signal.on or rate <= -signal.on or not signal.quiet:
                signal.step(now, abs(rate))
        if known:
            self._stand()
        else:
            self.posture, self._stances = None, ()
        return self._evaluate(now, stamp)

    def _stand(self) -> None:
        """Take the newest joint positions, which are known, with the newest payload."""
        load, q = self.payload, tuple(self.joints.q)
        if not self.load_known:
            self.posture, self._stances = None, ()
            return
        pose = self.chassis.pose
        if self.posture is not None and pose is not None and load is pose[1] and q == self._q:
            return  # nothing moved
        self._q = q
        self.posture = posture_at(self._mechanics, q, load.mass, load.cog)
        self._stances = stances_of(self._mechanics, self.posture)
        self.chassis.pose = q, load
        self.ground.stands(q, load.cog)

    def imu(  # noqa: PLR0913, PLR0917 - the fields of the message
        self,
        now: int,
        stamp: int,
        orientation: Sequence[float],
        covariance_0: float,
        omega: Sequence[float],
        acceleration: Sequence[float],
        frame: str = '',
        omega_covariance_0: float = 0.0,
    ) -> Margins | None:
        """Take an Imu message (axes of the sensor `frame`); return as `joint_state` does.

        A covariance_0 of -1 says that the orientation, or the rate, was not measured (REP-145). The
        message is ignored where the base was declared level.
        """
        if self._level:
            return self.margins
        self._arrived(1, now, stamp, self.watch.imu)
        mount = self.mount
        if mount.busy:
            felt = orientation, covariance_0, omega, acceleration
            felt = mount.one(now, frame, felt, self.joints)
            orientation, covariance_0, omega, acceleration = felt
        gravity, unusable = self._imu.step(
            now, stamp, orientation, covariance_0, omega, acceleration, frame, mount.raw
        )
        if not mount.told:
            gravity, unusable = NOWHERE, False
        invalid = self.watch.imu.invalid
        if unusable or not invalid.quiet:
            invalid.step(now, 1.0 if unusable else 0.0)
        self._gravity = gravity
        margins = self._evaluate(now, stamp)
        angles = margins.angle if margins else None
        unknown = omega_covariance_0 == -1.0 or not self._imu.motion.gyro_trusted
        seen = UNWITNESSED if covariance_0 == -1.0 else WITNESSED
        rate = NO_RATE if unknown else seen
        self.chassis.step(now, stamp, omega, acceleration, gravity, angles, rate)
        return margins

    @property
    def moving(self) -> tuple[float, ...] | None:
        """Tilt left (rad) to each side with the energy of the turn the robot is in now.

        None while margins are unknown, or the IMU's rate cannot be used.
        """
        if self.margins is None:
            return None
        return self.chassis.moving(self.margins.gravity, self.margins.angle)

    def carry(self, now: int, mass: float, com: Sequence[float], frame: str) -> None:
        """Take a declared payload (kg, m), in force from the next joint state on.

        After one that cannot be used margins are unknown until a good one comes.
        """
        robot, frame = self.settings.robot, without_prefix(frame, self.settings.frame_prefix)
        payload = payload_from(robot, mass, com, frame)
        self.watch.declared(now, '' if payload else payload_fault(robot, mass, com, frame))
        self.load_known = payload is not None
        if payload:
            self.payload = payload
        if not self.settings.hears_joints:
            self._stand()

    def adopt(self, settings: Settings) -> None:
        """Judge by other limits, delays and payload from now on; the robot's joints are the same.

        Learnt periods and active alerts stay; an active alert keeps the rule it was raised by.
        """
        carried = settings.robot.payload
        if carried not in (self.settings.robot.payload, self.payload):
            self.payload, self.load_known = carried, True
        self.settings = self.ground.settings = settings
        self.mount.learn(settings)
        self._imu.adopt(self.mount.applied(settings))
        self.watch.adopt(settings)
        for fresh in self.fresh:
            fresh.judge_by(settings.delays)
        if not settings.hears_joints:
            self._stand()

    def tick(self, now: int) -> None:
        """Let time pass to `now` (ns) without a message: judge silence, delays and predictions."""
        for which, signals in enumerate((self.watch.joints, self.watch.imu)):
            self._silent(which, now, signals.stale)
        if self.load_known and self.watch.payload.raw:  # a person declared another since
            self.watch.declared(now, '')
        self.watch.relax(now if self._began is None else self._began)
        self._began = None
        if now > self._alive_until():
            self._lose(now)
        self.watch.predict()
        self.watch.advance(now)

    @property
    def measured(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Newest rates and efforts of the joints (rad/s, N m; m/s, N); NaN where not reported."""
        return tuple(self.joints.qd), tuple(self.joints.effort)

    @property
    def orientations(self) -> dict[str, int]:
        """Number of IMU messages by how their orientation was treated, see inputs/imu.py."""
        return dict(zip(ORIENTATIONS, self._imu.taken, strict=True))

    @property
    def level(self) -> int:
        """The most severe level of the active alerts; at least STALE while margins are unknown.

        Also while a trend to tip is not known yet, and where a value is said to be unknown.
        """
        active = [alert.rule.level for alert in self.watch.active]
        known = self.margins is not None and not self.waits_for_trend
        worst = max([*active, OK if known else STALE])
        return worst if worst >= ERROR or not self.settings.unknown else STALE

    @property
    def carried(self) -> bool:
        """Whether points below the tracks (flippers) carry a robot now that has tracks."""
        raised = self.margins is not None and self.margins.state == RAISED
        return raised and has_tracks(self.settings.robot)

    @property
    def waits_for_trend(self) -> bool:
        """Whether the ground is not flat, and it is not known yet if the robot begins to tip."""
        judged = self.settings.ground.rough and self.settings.judges_tilt
        return judged and self.watch.trend.level == NO_TREND

    def _arrived(self, which: int, now: int, stamp: int, signals: InputSignals) -> None:
        fresh = self.fresh[which]
        stale, clock, slow = signals.stale, signals.clock, signals.slow
        self._silent(which, now, stale)
        if not stale.quiet:
            stale.clear(now)
        wrong = fresh.clock(now, stamp)
        if wrong or not clock.quiet:
            if wrong and not clock.raw:
                clock.detail = clock_words(now, stamp)
            clock.step(now, wrong)
        if fresh.last is not None:
            apart = (now - fresh.last) / 1e9
            if apart >= slow.on or not slow.quiet:
                slow.step(now, apart)
        fresh.message(now)

    def _silent(self, which: int, now: int, stale: Signal) -> None:
        """Judge whether an input has been silent for too long at `now` (ns)."""
        due = self.fresh[which].deadline
        if due is not None and now > due:
            if which == 0 and not stale.raw:
                stale.detail = words.why_foreign(self.joints, due)
            stale.set(due, 1.0)

    def _alive_until(self) -> int:
        """Return the time (ns) until which the newest messages count; NEVER if one is missing."""
        joints, imu = self.fresh
        if self._oldest == NEVER or imu.last is None or self.joints.repeating:
            return NEVER
        one, other = self._oldest + joints.limit, imu.last + imu.limit
        return min(other, one)

    def _lose(self, now: int) -> None:
        """Take that margins are unknown at `now` (ns): since they were stale, or from now on."""
        self.margins = None
        if self._known_until is not None:
            self.watch.lose(min(now, self._known_until))
            self._known_until = None

    def _evaluate(self, now: int, stamp: int) -> Margins | None:
        posture, gravity, until = self.posture, self._gravity, self._alive_until()
        unknown = posture is None or gravity[0] != gravity[0] or now > until
        stance = self.chassis.stance = None if unknown else standing(self._stances, gravity)
        touch = FREE
        if stance is not None:
            touch = self.ground.step(now, None if self._level else stance.ground_face)
        unknown = unknown or touch == UNSUPPORTED
        if unknown or (self._known_until is not None and now > self._known_until):
            self._lose(now)
        if posture is None or stance is None or unknown:
            return None
        self._known_until = until
        if posture is not self._judged[0] or gravity != self._judged[1]:
            self._judged = posture, gravity, *self._judge(posture, stance)
        _, _, torque, angle, state = self._judged
        if touch == PERMITTED:
            torque = (math.nan,) * len(torque)
        self._watch(now, torque, angle, state)
        q, stands = self._q, NOT_KNOWN if self._level else stance
        self.margins = Margins(now, stamp, q, gravity, torque, angle, state, stands)
        self.evaluated += 1
        prediction = self.watch.prediction
        if now >= prediction.due:
            prediction.keep(now, angle, torque, self.joints.effort, q)
            pose = self.chassis.pose
            if pose is not None and not self._level:
                self.watch.trend.keep(now, angle, q, gravity, pose[1])
        return self.margins

    def _judge(
        self, posture: Posture, stance: Stance
    ) -> tuple[tuple[float, ...], tuple[float, ...], int]:
        """Return static torques, tip angles and state under the newest gravity."""
        gravity, points = self._gravity, stance.points
        hanging = torque_of(posture, gravity)
        torque: Any = standing_torque(self._mechanics, posture, points, gravity, hanging)
        return torque, *(LEVEL if self._level else tip_angles_at(stance, gravity))

    def _watch(
        self, now: int, torque: tuple[float, ...], angles: tuple[float, ...], state: int
    ) -> None:
        watch, tips = self.watch, self.settings.judges_tilt
        if self._loud or not watch.is_small(torque, angles):
            self._loud = watch.step(now, torque, angles if tips else ())
        if not tips:
            return
        if watch.slide.on < math.inf:
            friction = self.settings.limits.friction
            watch.slide.step(now, float(slides_first(self._gravity, min(angles), friction)))
        fallen = state >= NO_CONTACT
        if fallen or not watch.support.quiet:
            watch.support.step(now, 1.0 if fallen else 0.0)
