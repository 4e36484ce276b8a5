"""A simulated robot under live commands: joint trajectories, a drive with a time-out, a reset."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ugv_acceptance import BadSample
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.simulation.scenario import Command
from ugv_acceptance.simulation.simulation import Simulation
from ugv_acceptance.simulation.vehicle import Build

# Without a new drive command for this long (s) the tracks stop, as on the robot.
DRIVE_TIMEOUT = 0.5
# Joint speed (rad/s, m/s) where the robot's description gives no limit, and the slowest.
FASTEST, SLOWEST = 1.5, 1e-3
_PEAK = math.pi / 2.0  # peak rate of a smooth motion over its mean rate


@dataclass(frozen=True, slots=True)
class Point:
    """A point of a trajectory: joint targets (rad, m), due `time` (s) after its start."""

    time: float
    targets: tuple[tuple[str, float], ...]


@dataclass(slots=True)
class RemoteRobot:
    """A simulated robot that takes commands while it runs; times (s) are those of its simulation.

    `start` pairs joint names with positions; `factor` is how much heavier loads are than declared.
    """

    robot: Robot
    build: Build
    start: tuple[tuple[str, float], ...] = ()
    factor: float = 1.0
    simulation: Simulation = field(init=False)
    elapsed: float = 0.0
    _segments: list[tuple[float, float, Point]] = field(default_factory=list)
    _drive_until: float = math.inf

    def __post_init__(self) -> None:
        self.simulation = self._fresh()

    def _fresh(self) -> Simulation:
        load = replace(self.robot.payload, mass=0.0)
        return Simulation(self.robot, self.start, (0.0, 0.0), load, self.build)

    def reset(self) -> None:
        """Put the robot back on level ground as at the start, without a load."""
        self.simulation = self._fresh()
        self._segments.clear()
        self._drive_until = math.inf

    def follow(self, names: Sequence[str], points: Sequence[tuple[float, Sequence[float]]]) -> None:
        """Move through trajectory `points` (s from now; a position per name); none: hold still.

        It replaces a trajectory under way. Raises BadSample where it cannot be followed.
        """
        unknown = [n for n in names if n not in self.robot.joint_names]
        if unknown:
            raise BadSample(
                f'trajectory: expected joints of {self.robot.joint_names}, got {unknown}'
            )
        if not points:
            self.freeze()
            return
        before, segments = 0.0, []
        for time, positions in points:
            if len(positions) != len(names) or not all(map(math.isfinite, (time, *positions))):
                raise BadSample(f'trajectory: expected {len(names)} finite positions a point')
            if time < before:
                raise BadSample(f'trajectory: expected rising times, got {time} after {before}')
            point = Point(time, tuple(zip(names, positions, strict=True)))
            segments.append((self.simulation.time + before, time - before, point))
            before = time
        self._segments = segments

    def freeze(self) -> None:
        """Stop arm and tracks where they are."""
        self._segments.clear()
        position = dict(
            zip(self.robot.joint_names, self.simulation.joints()[0].tolist(), strict=True)
        )
        now = self.simulation.time
        self.simulation.apply(Command(now, tuple(position.items()), FASTEST, drive=(0.0, 0.0)))
        self._drive_until = math.inf

    def drive(self, forward: float, yaw: float) -> None:
        """Drive at `forward` (m/s) and `yaw` (rad/s) until told otherwise or until the time-out."""
        if not (math.isfinite(forward) and math.isfinite(yaw)):
            raise BadSample(f'cmd_vel: expected finite speeds, got {forward}, {yaw}')
        self.simulation.apply(Command(self.simulation.time, drive=(forward, yaw)))
        self._drive_until = self.simulation.time + DRIVE_TIMEOUT

    def tilt(self, tilt: float, heading: float, rate: float) -> None:
        """Tilt the ground to `tilt` (rad), down towards `heading` (rad), at a peak rate (rad/s)."""
        if not (abs(tilt) <= math.pi / 2.0 and math.isfinite(heading) and rate > 0.0):
            raise BadSample(
                f'ground: expected a tilt up to pi/2 and a rate above 0, got {tilt}, {rate}'
            )
        self.simulation.apply(Command(self.simulation.time, slope=(tilt, heading), slope_rate=rate))

    def take(self, payload: Payload) -> None:
        """Put a load into the gripper: the declared one, times the overload of the faults."""
        numbers = (payload.mass, *payload.cog)
        if not all(map(math.isfinite, numbers)) or payload.mass < 0.0:
            raise BadSample(f'load: expected a mass of at least 0 kg and its place, got {numbers}')
        if self.robot.payload_link is None and payload.mass > 0.0:
            raise BadSample(f'load: {self.robot.name} has no payload.link in its configuration')
        load = Payload(payload.mass * self.factor, payload.cog)
        self.simulation.apply(Command(self.simulation.time, payload=load))

    def advance(self, duration: float) -> None:
        """Simulate `duration` (s)."""
        self._begin_segments()
        if self.simulation.time >= self._drive_until:
            self.simulation.apply(Command(self.simulation.time, drive=(0.0, 0.0)))
            self._drive_until = math.inf
        self.simulation.advance(duration)
        self.elapsed += duration

    def _begin_segments(self) -> None:
        now = self.simulation.time
        while self._segments and self._segments[0][0] <= now:
            _, length, point = self._segments.pop(0)
            position: Mapping[str, Any] = dict(
                zip(self.robot.joint_names, self.simulation.joints()[0], strict=True)
            )
            for name, target in point.targets:
                way = abs(target - float(position[name]))
                speed = self._speed(name, way, length)
                self.simulation.apply(Command(now, ((name, target),), speed))

    def _speed(self, name: str, way: float, length: float) -> float:
        """Return the peak speed that covers a distance within `length` (s), at most the joint's."""
        limit = self.robot.joint(name).velocity
        fastest = limit if math.isfinite(limit) else FASTEST
        wanted = _PEAK * way / length if length > 0.0 else fastest
        return min(max(wanted, SLOWEST), fastest)
