"""Random postures of a simulated robot's arm for the runs with a seed, and the loads it takes.

PackBot's are drawn from fixed ranges of its joints, so that its runs stay as they are; those of any
other robot from a grid of its arm's postures.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from math import pi, radians

import numpy as np

from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.roles import roles_of
from ugv_acceptance.model.stability import margins
from ugv_acceptance.model.statics import gripper_point
from ugv_acceptance.simulation.arm_grid import ArmGrid, grid_of, limits_of
from ugv_acceptance.simulation.vehicle import gravity_on_slope
from ugv_acceptance.type_aliases import Floats

Rng = np.random.Generator
# Joint names and positions.
Joints = tuple[tuple[str, float], ...]
# Margins that a quiet shift keeps: tilt left (rad), share of the torque limit, grip height (m); and
# the share of the tilt left when folded that a robot keeps that never has so much.
CALM_TILT, CALM_TORQUE, LOWEST, OF_FOLDED = radians(18.0), 0.62, 0.08, 0.6
# Postures of a motion that are looked at.
_PATH = 49
# The joints of the PackBot that ships, and its folded posture: flippers back along the tracks, arm
# over the deck.
PACKBOT = frozenset({'turret_joint', 'shoulder_joint', 'elbow_joint', 'flipper_joint'})
STOWED: Joints = (
    ('flipper_joint', pi),
    ('shoulder_joint', radians(115)),
    ('elbow_joint', radians(-140)),
)
# The load (kg) that PackBot's outstretched arm holds: other robots' loads are to theirs as its.
PACKBOT_CAPACITY = 1.87


@dataclass(frozen=True, slots=True)
class Region:
    """Where the arm is drawn from: PackBot's ranges of its axes (deg), shares of others' ranges.

    `reach` is how far the load is from the pillar, `height` how high: 0 and 1 are the least and the
    most of the arm's postures. A range of no width is a number that is not drawn.
    """

    shoulder: tuple[float, float]
    elbow: tuple[float, float]
    reach: tuple[float, float] = (0.0, 1.0)
    height: tuple[float, float] = (0.0, 1.0)


def is_packbot(robot: Robot) -> bool:
    """Return whether the robot has the joints of the PackBot that ships."""
    return {*robot.joint_names} == PACKBOT


def stowed_of(robot: Robot) -> Joints:
    """Return the folded posture of a robot, in which it starts."""
    return STOWED if is_packbot(robot) else named(robot, grid_of(robot).stowed)


def named(robot: Robot, q: Floats) -> Joints:
    """Return a posture (j,) as targets of a command, without the wheels."""
    wheels = roles_of(robot).wheels
    pairs = zip(robot.joint_names, q.tolist(), strict=True)
    return tuple((name, at) for name, at in pairs if name not in wheels)


@dataclass(frozen=True)
class Poses:
    """Draws random postures of the arm; the flippers stay folded.

    The gripper stays `lowest` (m) above the ground.
    """

    robot: Robot
    rng: Rng
    lowest: float = LOWEST

    @property
    def has_arm(self) -> bool:
        """Whether the robot has an arm that lifts."""
        return bool(roles_of(self.robot).axes)

    @cached_property
    def grid(self) -> ArmGrid | None:
        """The arm's postures; None for PackBot, whose joints are drawn from fixed ranges."""
        return None if is_packbot(self.robot) else grid_of(self.robot)

    @property
    def stowed(self) -> Joints:
        """The folded posture as a run's start."""
        return stowed_of(self.robot)

    def folded(self) -> Floats:
        """Return the folded posture (j,)."""
        return self._vector() if self.grid is None else self.grid.stowed

    def at(self, region: Region, heading: float = 0.0) -> Floats:
        """Return a random posture (j,) of a region with the arm towards `heading` (rad)."""
        if self.grid is not None:
            return self._from_grid(self.grid, region, heading)
        shoulder, elbow = (
            radians(low if low == high else self.rng.uniform(low, high))
            for low, high in (region.shoulder, region.elbow)
        )
        return self._vector(turret_joint=heading, shoulder_joint=shoulder, elbow_joint=elbow)

    def anywhere(self) -> Floats:
        """Return a random posture (j,) with the gripper above the ground and clear of the deck."""
        if self.grid is not None:
            heading = float(self.rng.uniform(-pi, pi))
            return self._from_grid(self.grid, Region((0.0, 0.0), (0.0, 0.0)), heading)
        while True:
            q = self._vector(
                turret_joint=self.rng.uniform(-pi, pi),
                shoulder_joint=self.rng.uniform(radians(10), radians(150)),
                elbow_joint=self.rng.uniform(radians(-150), radians(90)),
            )
            if gripper_point(self.robot, q)[2] > self.lowest:
                return q

    def _vector(self, **angles: float) -> Floats:
        """Return PackBot's folded posture (j,) with the given joint angles (rad) put in."""
        known = dict(STOWED) | angles
        return np.array([known.get(name, 0.0) for name in self.robot.joint_names])

    def _from_grid(self, grid: ArmGrid, region: Region, heading: float) -> Floats:
        if len(grid.rows) == 1:
            return grid.rest
        reach, height = (_shares(x) for x in (grid.reach, grid.grip[:, 2]))
        off = _outside(reach, region.reach) + _outside(height, region.height)
        turned = grid.turned(grid.rows, heading)
        off = off + np.where(grid.clear(turned), 0.0, 10.0)
        best = np.flatnonzero(off <= off.min() + 1e-9)
        row: Floats = turned[int(best[self.rng.integers(len(best))])]
        return row

    def named(self, q: Floats) -> Joints:
        """Return a posture (j,) as the joint targets of a command."""
        return named(self.robot, q)

    def load(self, low: float, high: float) -> Payload:
        """Return a random load: between `low` and `high` (kg) for PackBot, of others' as much.

        Without an arm it is what the configuration declares.
        """
        declared = self.robot.payload
        if self.grid is None:
            return Payload(float(self.rng.uniform(low, high)), declared.cog)
        if not self.has_arm or self.robot.payload_link is None:
            return declared
        scale = self.grid.capacity / PACKBOT_CAPACITY
        return Payload(float(self.rng.uniform(low, high)) * scale, declared.cog)

    def calm(self, start: Floats, load: Payload, tilt: float) -> Floats | None:
        """Return a posture (j,) reached from `start` with large margins; None: none was found."""
        for _ in range(40):
            end = self.anywhere()
            if self.passes(start, end) and self.keeps(way(start, end), load, tilt):
                return end
        return None

    def passes(self, start: Floats, end: Floats) -> bool:
        """Return whether a motion between two postures (j,) stays above the ground."""
        path = way(start, end)
        if self.grid is None:
            return not (gripper_point(self.robot, path)[:, 2] < self.lowest).any()
        return bool(self.grid.clear(path).all())

    def keeps(self, path: Floats, load: Payload, tilt: float) -> bool:
        """Return whether postures (n, j) keep large margins on a slope (rad) to any side."""
        heads = np.array([gravity_on_slope(self.robot.gravity, tilt, h) for h in _headings()])
        limit = limits_of(self.robot)
        found = margins(self.robot, path[:, None, :], heads, load)
        share = (np.abs(found.torque) / limit).max(initial=0.0)
        return bool(found.angle.min() > self.calm_tilt and share < CALM_TORQUE)

    @cached_property
    def calm_tilt(self) -> float:
        """The tilt (rad) that a quiet shift keeps, less where the folded robot has little."""
        if self.grid is None:
            return CALM_TILT
        load = Payload(self.grid.capacity / 2.0 if self.has_arm else 0.0, self.robot.payload.cog)
        folded, _ = self.grid.looked(self.grid.stowed[None, None, :], 0.0, load)
        return min(CALM_TILT, OF_FOLDED * float(folded[0]))


def way(start: Floats, end: Floats) -> Floats:
    """Return postures (n, j) of a motion in which each joint takes its own time."""
    change = end - start
    took = np.maximum(np.abs(change), 1e-9)
    phase = np.pi * np.minimum(np.linspace(0.0, took.max(initial=0.0), _PATH)[:, None] / took, 1.0)
    path: Floats = start + change * (1.0 - np.cos(phase)) / 2.0
    return path


def _headings() -> Floats:
    return np.linspace(-pi, pi, 8, endpoint=False)


def _shares(values: Floats) -> Floats:
    """Return values as shares of their range, 0 to 1."""
    shares: Floats = (values - values.min()) / max(float(np.ptp(values)), 1e-9)
    return shares


def _outside(values: Floats, between: tuple[float, float]) -> Floats:
    """Return how far values are outside of a range; inside: 0."""
    low, high = between
    outside: Floats = np.maximum(np.maximum(low - values, values - high), 0.0)
    return outside


def motion_time(start: Floats, end: Floats, speed: float) -> float:
    """Return how long (s) a motion between postures (j,) takes at a peak speed (rad/s)."""
    return float(np.abs(end - start).max(initial=0.0)) * math.pi / (2.0 * speed)
