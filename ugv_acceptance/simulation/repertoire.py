"""Random runs with a seed: quiet work, and every kind of motion that may tip or saturate.

Each kind is a function of robot, random numbers and length (s). None says what will happen: that
is found by simulating it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import atan, pi, radians

import numpy as np

from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.stability import margins
from ugv_acceptance.model.statics import gripper_point
from ugv_acceptance.simulation.scenario import Command, Scenario
from ugv_acceptance.simulation.scenarios import STOWED
from ugv_acceptance.simulation.shape import Block, ramp, stairs, step, wheel_contacts
from ugv_acceptance.simulation.vehicle import gravity_on_slope
from ugv_acceptance.type_aliases import Floats

# Margins that a quiet shift keeps: tilt left (rad), share of the torque limit, grip height (m).
CALM_TILT, CALM_TORQUE, LOWEST = radians(18.0), 0.62, 0.08
# Postures of a motion that are looked at.
_PATH = 49
# Share of quiet shifts with a low obstacle ahead, and how high (m) it is at most.
_UNEVEN, _TOP = 0.3, 0.1

Rng = np.random.Generator
Kind = Callable[[Robot, Rng, float], Scenario]


@dataclass(frozen=True, slots=True)
class Poses:
    """Draws random postures of the arm as (name, rad) pairs; the flippers stay folded back.

    The gripper stays `lowest` (m) above the ground.
    """

    robot: Robot
    rng: Rng
    lowest: float = LOWEST

    def anywhere(self) -> Floats:
        """Return a random posture (j,) with the gripper above the ground and clear of the deck."""
        while True:
            q = self.vector(
                turret_joint=self.rng.uniform(-pi, pi),
                shoulder_joint=self.rng.uniform(radians(10), radians(150)),
                elbow_joint=self.rng.uniform(radians(-150), radians(90)),
            )
            if gripper_point(self.robot, q)[2] > self.lowest:
                return q

    def vector(self, **angles: float) -> Floats:
        """Return the stowed posture (j,) with the given joint angles (rad) put in."""
        known = dict(STOWED) | angles
        return np.array([known.get(name, 0.0) for name in self.robot.joint_names])

    def named(self, q: Floats) -> tuple[tuple[str, float], ...]:
        """Return a posture (j,) as the joint targets of a command."""
        return tuple(zip(self.robot.joint_names, q.tolist(), strict=True))

    def calm(self, start: Floats, load: Payload, tilt: float) -> Floats | None:
        """Return a posture (j,) reached from `start` with large margins; None: none was found."""
        for _ in range(40):
            end = self.anywhere()
            path = _way(start, end)
            if (gripper_point(self.robot, path)[:, 2] < self.lowest).any():
                continue
            if self.keeps(path, load, tilt):
                return end
        return None

    def keeps(self, path: Floats, load: Payload, tilt: float) -> bool:
        """Return whether postures (n, j) keep large margins on a slope (rad) to any side."""
        heads = np.array([gravity_on_slope(self.robot.gravity, tilt, h) for h in _headings()])
        limit = np.array([self.robot.joint(n).effort for n in self.robot.joint_names])
        found = margins(self.robot, path[:, None, :], heads, load)
        share = (np.abs(found.torque) / limit).max()
        return bool(found.angle.min() > CALM_TILT and share < CALM_TORQUE)


def _way(start: Floats, end: Floats) -> Floats:
    """Return postures (n, j) of a motion in which each joint takes its own time."""
    change = end - start
    took = np.maximum(np.abs(change), 1e-9)
    phase = np.pi * np.minimum(np.linspace(0.0, took.max(), _PATH)[:, None] / took, 1.0)
    path: Floats = start + change * (1.0 - np.cos(phase)) / 2.0
    return path


def _headings() -> Floats:
    return np.linspace(-pi, pi, 8, endpoint=False)


def work(robot: Robot, rng: Rng, seconds: float) -> Scenario:
    """A quiet shift: arm, tracks, load and ground change, and every margin stays large."""
    blocks, lean = _obstacle(robot, rng, 0.03) if rng.random() < _UNEVEN else ((), 0.0)
    poses = Poses(robot, rng, LOWEST + (_TOP if blocks else 0.0))
    full = Payload(float(rng.uniform(0.0, 1.5)), robot.payload.cog)
    tilt = float(rng.uniform(0.0, radians(6.0)))
    load, now, q = full, 2.0, poses.vector()
    commands: list[Command] = []
    while now < seconds - 12.0:
        act = rng.integers(5)
        if act == 0:
            drive = float(rng.uniform(-0.3, 0.3)), float(rng.uniform(-0.3, 0.3))
            commands += [Command(now, drive=drive), Command(now + 2.0, drive=(0.0, 0.0))]
            now += 3.5
        elif act == 1:
            heading = float(rng.uniform(-pi, pi))
            commands.append(Command(now, slope=(0.0, 0.0), slope_rate=0.04))
            commands.append(Command(now + 4.5, slope=(tilt, heading), slope_rate=0.04))
            now += 9.0
        elif act == 2 and poses.keeps(q[None], full, tilt + lean):
            load = Payload(0.0, full.cog) if load.mass else full
            commands.append(Command(now, payload=load, payload_time=1.0))
            now += 2.0
        else:
            end = poses.calm(q, load, tilt + lean)
            speed = float(rng.uniform(0.15, 0.5))
            if end is not None:
                commands.append(Command(now, joints=poses.named(end), speed=speed))
                now += float(np.abs(end - q).max()) * pi / (2.0 * speed) + 0.5
                q = end
    return Scenario(
        'work', seconds, STOWED, (0.0, 0.0), full, tuple(commands), blocks=blocks, lean=lean
    )


def _obstacle(robot: Robot, rng: Rng, height: float) -> tuple[tuple[Block, ...], float]:
    """Return a step, stairs or a ramp up to `height` (m) a stair, and the lean (rad) it causes."""
    half = max(c.position[0] for c in wheel_contacts(robot))
    rise, at = float(rng.uniform(0.5, 1.0)) * height, float(rng.uniform(0.5, 0.8))
    lean = atan(rise / half) + radians(1.0)
    made = ((step(at, rise),), stairs(at, rise, 0.35, 3), ramp(at, lean, 0.75))
    return made[rng.integers(3)], lean


def tilt(robot: Robot, rng: Rng, seconds: float) -> Scenario:
    """Holds a load up while the ground tilts until something fails or the robot nearly slides."""
    poses, load = Poses(robot, rng), _load(robot, rng, 1.0, 5.0)
    q = poses.vector(
        turret_joint=rng.uniform(-pi, pi),
        shoulder_joint=radians(rng.uniform(60, 95)),
        elbow_joint=radians(rng.uniform(-60, 0)),
    )
    slope = radians(38.0), float(rng.uniform(-pi, pi))
    rate = float(rng.uniform(0.03, 0.12))
    ramp = Command(2.0, slope=slope, slope_rate=rate)
    return Scenario('tilt', seconds, poses.named(q), (0.0, 0.0), load, (ramp,))


def swing(robot: Robot, rng: Rng, seconds: float) -> Scenario:
    """Swings a load downhill and outwards with the arm, on a slope."""
    poses, load = Poses(robot, rng), _load(robot, rng, 1.0, 4.5)
    heading = float(rng.uniform(-pi, pi))
    q = poses.vector(
        turret_joint=heading + pi, shoulder_joint=radians(80), elbow_joint=radians(-60)
    )
    end = poses.vector(
        turret_joint=heading + rng.uniform(-0.4, 0.4),
        shoulder_joint=radians(rng.uniform(20, 70)),
        elbow_joint=radians(rng.uniform(-60, 0)),
    )
    go = Command(2.0, joints=poses.named(end), speed=float(rng.uniform(0.25, 0.8)))
    slope = radians(rng.uniform(8.0, 24.0)), heading
    return Scenario('swing', seconds, poses.named(q), slope, load, (go,))


def reach(robot: Robot, rng: Rng, seconds: float) -> Scenario:
    """Stretches the arm forward with a load on level ground until a motor is saturated."""
    poses, load = Poses(robot, rng), _load(robot, rng, 1.5, 5.0)
    q = poses.vector(shoulder_joint=radians(rng.uniform(75, 110)), elbow_joint=radians(-120))
    out = poses.vector(
        shoulder_joint=radians(rng.uniform(15, 60)), elbow_joint=radians(rng.uniform(-40, 10))
    )
    go = Command(2.0, joints=poses.named(out), speed=float(rng.uniform(0.15, 0.6)))
    return Scenario('reach', seconds, poses.named(q), (0.0, 0.0), load, (go,))


def grasp(robot: Robot, rng: Rng, seconds: float) -> Scenario:
    """Lifts a load with the arm stretched out to the side; the load is declared when gripped."""
    return _grasp(robot, rng, seconds, float(rng.uniform(0.5, 1.5)))


def snatch(robot: Robot, rng: Rng, seconds: float) -> Scenario:
    """Holds the arm stretched out to the side; suddenly a load is in the gripper."""
    return _grasp(robot, rng, seconds, 0.0)


def _grasp(robot: Robot, rng: Rng, seconds: float, lifting: float) -> Scenario:
    poses = Poses(robot, rng)
    side = float(rng.choice([-1.0, 1.0])) * rng.uniform(radians(60), radians(120))
    q = poses.vector(
        turret_joint=side,
        shoulder_joint=radians(rng.uniform(20, 60)),
        elbow_joint=radians(rng.uniform(-50, 0)),
    )
    take = Command(5.0, payload=_load(robot, rng, 1.0, 6.0), payload_time=lifting)
    empty, slope = Payload(0.0, robot.payload.cog), (radians(rng.uniform(0, 12)), side)
    return Scenario('grasp', seconds, poses.named(q), slope, empty, (take,))


def dash(robot: Robot, rng: Rng, seconds: float) -> Scenario:
    """Drives fast and stops dead, again and again, on a slope with a load held up."""
    poses, load = Poses(robot, rng), _load(robot, rng, 1.0, 5.0)
    q = poses.vector(
        shoulder_joint=radians(rng.uniform(70, 90)), elbow_joint=radians(rng.uniform(-40, 0))
    )
    slope = radians(rng.uniform(5.0, 24.0)), float(rng.choice([0.0, pi]))
    commands: list[Command] = []
    for begin in np.arange(3.0, seconds - 2.0, 3.0).tolist():
        speed = float(rng.uniform(0.5, 1.8)) * float(rng.choice([-1.0, 1.0]))
        commands.append(Command(begin, drive=(speed, 0.0), drive_rate=3.0))
        commands.append(Command(begin + 1.0, drive=(0.0, 0.0), drive_rate=15.0))
    return Scenario('dash', seconds, poses.named(q), slope, load, tuple(commands))


def climb(robot: Robot, rng: Rng, seconds: float) -> Scenario:
    """Climbs a step, stairs or a ramp with a load held back or to a side."""
    poses, load = Poses(robot, rng), _load(robot, rng, 1.0, 6.0)
    q = poses.vector(
        turret_joint=rng.uniform(radians(90), radians(270)),
        shoulder_joint=radians(rng.uniform(40, 80)),
        elbow_joint=radians(rng.uniform(-60, 0)),
    )
    blocks, lean = _obstacle(robot, rng, 0.075)
    go = Command(2.0, drive=(float(rng.uniform(0.15, 0.35)), 0.0))
    return Scenario(
        'climb', seconds, poses.named(q), (0.0, 0.0), load, (go,), blocks=blocks, lean=lean
    )


def _load(robot: Robot, rng: Rng, low: float, high: float) -> Payload:
    return Payload(float(rng.uniform(low, high)), robot.payload.cog)


KINDS: dict[str, Kind] = {
    'work': work,
    'tilt': tilt,
    'swing': swing,
    'reach': reach,
    'grasp': grasp,
    'snatch': snatch,
    'dash': dash,
    'climb': climb,
}
# Usual lengths (s).
SECONDS = {
    'work': 120.0,
    'tilt': 22.0,
    'swing': 12.0,
    'reach': 14.0,
    'grasp': 10.0,
    'snatch': 10.0,
    'dash': 15.0,
    'climb': 14.0,
}
