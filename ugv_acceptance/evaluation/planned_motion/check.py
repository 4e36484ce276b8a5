"""Judges a planned motion: the answer to `May the arm move so?`.

Refused is what the live monitor would call DANGER at any moment of the motion, the reaction of the
moving links included, and what passes a joint's own range or speed. Whatever is missing makes the
answer NOT_KNOWN, unless the motion is refused in any case.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from ugv_acceptance.evaluation.ground import with_ground
from ugv_acceptance.evaluation.permitted_limits import relaxed_words
from ugv_acceptance.evaluation.planned_motion import words
from ugv_acceptance.evaluation.planned_motion.answer import (
    NOT_KNOWN,
    PERMITTED,
    REFUSED,
    CheckedMotion,
    JointUse,
    TiltLeft,
    worst_of,
)
from ugv_acceptance.evaluation.planned_motion.asked import (
    MOST_WAYS,
    begin_of,
    drives,
    farthest,
    joints_of,
    knots_of,
    not_configured,
    not_known,
    standing_joints,
    undefined,
)
from ugv_acceptance.evaluation.planned_motion.margins import Margins, columns_of, margins_of
from ugv_acceptance.evaluation.planned_motion.path import (
    MOST_IN_ALL,
    Path,
    Samples,
    path_of,
    samples_of,
    steps_of,
)
from ugv_acceptance.evaluation.planned_motion.request import Conditions, Trajectory
from ugv_acceptance.evaluation.rough_ground import cautious_mechanics
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.clearance import nearness_of
from ugv_acceptance.model.mechanics import Mechanics, mechanics_of
from ugv_acceptance.model.robot import Joint, Payload, Vector
from ugv_acceptance.model.roles import roles_of
from ugv_acceptance.model.sliding import slides_first
from ugv_acceptance.model.stability import INVERTED, NO_CONTACT, SIDES, STATES, UNKNOWN
from ugv_acceptance.type_aliases import Floats

# Share of a torque limit that is kept: no drive follows its plan exactly.
RESERVE = 0.02
# Least tilt left (rad) whatever the limit: nearer to its edge a robot rocks, and nobody knows what
# the motors need then.
ROCKS = math.radians(2.0)
# A plan at its joint's range or speed is not past it: rad or m, share of the speed.
AT_RANGE, AT_SPEED = 1e-3, 1.01


def check_motion(
    settings: Settings, trajectory: Trajectory, conditions: Conditions
) -> CheckedMotion:
    """Return whether the robot may carry out a motion; it raises nothing, whatever is asked.

    `settings` are those by which the robot is judged. Who asks often keeps a MotionChecker.
    """
    return MotionChecker(settings).check(trajectory, conditions)


@dataclass(slots=True)
class MotionChecker:
    """Answers for one robot; `settings` may be replaced by others of the same robot."""

    settings: Settings
    mechanics: Mechanics = field(init=False)
    wheels: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        self.mechanics = mechanics_of(self.settings.robot)
        self.wheels = roles_of(self.settings.robot).wheels

    def check(self, trajectory: Trajectory, conditions: Conditions) -> CheckedMotion:
        """Return whether the robot may carry out a motion under these conditions."""
        missing = undefined(trajectory)
        if missing:
            return CheckedMotion(NOT_KNOWN, tuple(missing))
        moved, unknown = joints_of(self.settings, trajectory.names)
        if unknown:
            names = ', '.join(unknown[:4])
            return CheckedMotion(NOT_KNOWN, (f'{names}: no joint that the robot is known by',))
        start, missing = standing_joints(self.settings, conditions, moved)
        missing += [
            *not_known(self.settings, conditions),
            *drives(self.settings, moved, self.wheels),
        ]
        if missing or conditions.gravity is None or conditions.payload is None:
            return CheckedMotion(NOT_KNOWN, tuple(missing))
        at = None if conditions.from_first_point else [start[j] for j in moved]
        begin = begin_of(self.settings, knots_of(self.settings, trajectory, moved), moved, at)
        if len(begin.ways) > MOST_WAYS:
            return CheckedMotion(NOT_KNOWN, (words.too_many_ways_words(),))
        load = conditions.gravity, conditions.payload
        most = farthest(self.settings, self.mechanics, moved)
        answers = []
        for knots in begin.ways:
            path = path_of(knots)
            steps = steps_of(path, most)
            moments = int(steps.sum())
            if moments > MOST_IN_ALL:
                return CheckedMotion(NOT_KNOWN, (words.too_long_words(moments, MOST_IN_ALL),))
            samples = samples_of(path, steps, conditions.corner)
            work = _Work(self, path, samples, moved, start, load)
            work.refusals += begin.jumps
            work.cautions += begin.cautions
            answers.append(work.answer(conditions, len(trajectory.times)))
        return worst_of(answers)


@dataclass(slots=True)
class _Work:
    """One answer on its way: what was found so far."""

    checker: MotionChecker
    path: Path
    samples: Samples
    moved: Sequence[int]
    start: Sequence[float]
    load: tuple[Vector, Payload]
    points: int = 0
    refusals: list[str] = field(default_factory=list)
    unknown: list[str] = field(default_factory=list)
    cautions: list[str] = field(default_factory=list)
    not_checked: list[str] = field(default_factory=list)

    @property
    def settings(self) -> Settings:
        """The settings that the answer is by."""
        return self.checker.settings

    @property
    def _tip_error(self) -> float:
        """The tilt left (rad) from which a motion is refused."""
        return max(self.settings.limits.tip_error, ROCKS)

    def answer(self, conditions: Conditions, points: int) -> CheckedMotion:
        """Return the answer of a trajectory of so many points."""
        self.points = points
        self.unknown.extend(not_configured(self.settings))
        self._judge_joints()
        found = self._margins(self.checker.mechanics)
        joints = self._judge_torques(found)
        tilt = self._judge_tilt(found)
        self._judge_state(found)
        self._judge_ground(found)
        cautious = self._judge_rough(conditions)
        self._tell(conditions)
        why = tuple(self.refusals) or tuple(self.unknown)
        verdict = REFUSED if self.refusals else NOT_KNOWN if self.unknown else PERMITTED
        return CheckedMotion(
            verdict, why, tuple(self.cautions), tilt, cautious, joints,
            (*self.not_checked, *words.NEVER_CHECKED),
            float(self.path.knots.time[-1]), len(self.samples.time),
        )  # fmt: skip

    def _margins(self, mechanics: Mechanics) -> Margins:
        motion = columns_of(self.samples, self.moved, self.start)
        return margins_of(mechanics, motion, len(self.samples.time), *self.load)

    def _joint(self, j: int) -> Joint:
        robot = self.settings.robot
        return robot.joint(robot.joint_names[j])

    def _when(self, k: int) -> str:
        return words.when(float(self.samples.time[k]), int(self.samples.point[k]), self.points)

    def _judge_joints(self) -> None:
        """Refuse what is outside of a joint's range, or faster than it can move."""
        for k, j in enumerate(self.moved):
            joint = self._joint(j)
            for position, place in self._outside(k, joint):
                self.refusals.append(words.range_words(joint, position, place))
            rate = np.abs(self.samples.rate[:, k])
            row = int(rate.argmax())
            if rate[row] > AT_SPEED * joint.velocity:
                told = words.rate_words_of(joint, float(rate[row]), self._when(row))
                self.refusals.append(told)
            limits = self.settings.limits.speed
            if limits and rate[row] > limits[j]:
                speed = f'{joint.name} moves faster than the monitor holds its margins for valid'
                self.cautions.append(f'{speed} {self._when(row)}: expect its CAUTION STATIC_MODEL')

    def _outside(self, k: int, joint: Joint) -> Iterator[tuple[float, str]]:
        """Yield the position furthest outside of its range, of the motion of column k, and when.

        Where a joint stands at the start is no plan: a way back from outside is none out.
        """
        first = float(self.path.knots.position[0, k])
        low, high = min(joint.lower, first) - AT_RANGE, max(joint.upper, first) + AT_RANGE
        hull = self.path.hull[:, :, k]
        position, row = self.samples.position[:, k], 0
        if hull.size and low <= hull.min() and hull.max() <= high:
            return
        beyond = np.maximum(low - position, position - high)
        row = int(beyond.argmax())
        if beyond[row] > 0.0:
            yield float(position[row]), self._when(row)

    def _judge_torques(self, found: Margins) -> tuple[JointUse, ...]:
        """Refuse where a joint needs its limit; return how much each needs, most used first."""
        limits, names = self.settings.limits, self.settings.robot.joint_names
        uses, unlimited = [], []
        for j, name in enumerate(names):
            size = np.abs(found.torque[j])
            if np.isnan(size).any():
                self.unknown.append(f'the torque of {name} cannot be computed')
                continue
            row, limit = int(size.argmax()), limits.torque[j]
            joint = self._joint(j)
            if not math.isfinite(limit):
                if size[row] > 0.0:
                    unlimited.append(f'{name} (up to {size[row]:.1f} {joint.units.effort})')
                continue
            time, point = float(self.samples.time[row]), int(self.samples.point[row])
            uses.append(JointUse(name, float(size[row]), limit, time, point, joint.slides))
        uses.sort(key=lambda use: -use.share)
        most = limits.torque_error - RESERVE
        for use in uses:
            if use.share >= most:
                self.refusals.append(words.use_words(use, most, self.points))
            elif use.share >= limits.torque_warn:
                self.cautions.append(words.use_words(use, limits.torque_warn, self.points))
        if unlimited:
            self.not_checked.append(f'torque of {", ".join(unlimited)}: no limit is configured')
        carrying = [names[j] for j in sorted(found.carrying) if math.isfinite(limits.torque[j])]
        if carrying:
            told = 'how the contact points share the weight, which is taken as even, on'
            self.not_checked.append(f'{told} {", ".join(carrying)}')
        return tuple(uses)

    def _least(self, angle: Floats) -> TiltLeft | None:
        """Return the least tilt left of angles (4, s); None where none is known."""
        known = np.where(np.isnan(angle), np.inf, angle)
        if not known.size or not np.isfinite(known.min()):
            return None
        side, row = divmod(int(known.argmin()), known.shape[1])
        time, point = float(self.samples.time[row]), int(self.samples.point[row])
        return TiltLeft(float(known[side, row]), SIDES[side], time, point)

    def _judge_tilt(self, found: Margins) -> TiltLeft | None:
        """Refuse where too little tilt is left; return the least."""
        limits, tilt = self.settings.limits, self._least(found.angle)
        if tilt is None:
            return None
        if tilt.angle <= self._tip_error:
            self.refusals.append(words.tilt_words(tilt, self._tip_error, self.points))
        elif tilt.angle <= limits.tip_warn:
            self.cautions.append(words.tilt_words(tilt, limits.tip_warn, self.points))
        worse = slides_first(self.load[0], tilt.angle, limits.friction)
        if float(worse) >= -limits.tip_warn:
            self.cautions.append('the tracks slide down the slope before the robot tips')
        return tilt

    def _judge_state(self, found: Margins) -> None:
        """Refuse where the robot does not stand; say where that is not known."""
        for bad in (found.state == INVERTED, found.state >= NO_CONTACT):
            if not bad.any():
                continue
            row = int(bad.argmax())
            state = int(found.state[row])
            if state == UNKNOWN:
                self.unknown.append(f'how the robot stands cannot be computed {self._when(row)}')
            else:
                told = f'the robot does not stand on its contact points ({STATES[state]})'
                self.refusals.append(f'{told} {self._when(row)}')

    def _judge_ground(self, found: Margins) -> None:
        """Refuse where the arm would stand on the ground: no margin is valid then."""
        row = int(np.where(np.isnan(found.height), -np.inf, found.height).argmin())
        height = float(found.height[row])
        if not height <= nearness_of(self.checker.mechanics).touches:
            return
        side = 'above' if height > 0.0 else 'below'
        told = (
            f'the arm comes to the ground: {abs(height):.3f} m {side} the plane on which the robot '
            f'stands {self._when(row)}'
        )
        if self.settings.hand_may_touch:
            self.unknown.append(f'{told}; it may touch it, and torques are not known then')
        else:
            self.refusals.append(f'{told}, so no margin is valid')

    def _judge_rough(self, conditions: Conditions) -> TiltLeft | None:
        """Take ground that is not flat cautiously: with shortened tracks."""
        ground = with_ground(self.settings.ground, conditions.ground)
        if not ground.rough:
            return None
        short = cautious_mechanics(self.settings.robot, ground.pitch)
        tilt = self._least(self._margins(short).angle)
        limit = self._tip_error
        if tilt is None or tilt.angle <= limit:
            told = 'no tilt is known'
            if tilt is not None:
                told = words.tilt_words(tilt, limit, self.points)
            self.unknown.append(f'taken cautiously on {ground.taken} ground: {told}')
        self.not_checked.append(f'which part of the tracks touches the ground ({ground.taken})')
        return tilt

    def _tell(self, conditions: Conditions) -> None:
        """Say what a reader has to know of how this was judged."""
        relaxed = relaxed_words(self.settings)
        if relaxed:
            self.cautions.append(relaxed)
        if conditions.from_first_point:
            self.not_checked.append('the way to the first point: the joints are taken to be there')
        corners = int((self.path.degree == 1).sum())
        if corners and self.path.knots.time[-1] > self.path.knots.time[0]:
            self.not_checked.append(words.corner_words(corners + 1, conditions.corner))
