"""Random runs with a seed: quiet work, and every kind of motion that may tip or saturate.

Each kind is a function of robot, random numbers and length (s). None says what will happen: that
is found by simulating it.
"""

from collections.abc import Callable
from math import atan, pi, radians

import numpy as np

from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.simulation.ground import ground_of
from ugv_acceptance.simulation.poses import LOWEST, Poses, Region, Rng, motion_time
from ugv_acceptance.simulation.scenario import Command, Scenario
from ugv_acceptance.simulation.shape import Block, ramp, stairs, step

# Share of quiet shifts with a low obstacle ahead, and how high (m) it is at most.
_UNEVEN, _TOP = 0.3, 0.1
# Where the arm is: a load held up high, ready to swing, swung out, drawn in, stretched out ahead,
# to a side, held up while driving, and while climbing.
UP = Region((60.0, 95.0), (-60.0, 0.0), (0.0, 0.7), (0.75, 1.0))
READY = Region((80.0, 80.0), (-60.0, -60.0), (0.0, 0.5), (0.6, 1.0))
SWUNG = Region((20.0, 70.0), (-60.0, 0.0), (0.6, 1.0), (0.2, 0.8))
DRAWN_IN = Region((75.0, 110.0), (-120.0, -120.0), (0.0, 0.4), (0.2, 0.8))
STRETCHED = Region((15.0, 60.0), (-40.0, 10.0), (0.75, 1.0), (0.0, 0.9))
ASIDE = Region((20.0, 60.0), (-50.0, 0.0), (0.7, 1.0), (0.0, 0.8))
HELD_UP = Region((70.0, 90.0), (-40.0, 0.0), (0.0, 0.7), (0.75, 1.0))
BACK = Region((40.0, 80.0), (-60.0, 0.0), (0.4, 0.9), (0.4, 1.0))

Kind = Callable[[Robot, Rng, float], Scenario]


def work(robot: Robot, rng: Rng, seconds: float) -> Scenario:
    """A quiet shift: arm, drive, load and ground change, and every margin stays large."""
    blocks, lean = _obstacle(robot, rng, 0.03) if rng.random() < _UNEVEN else ((), 0.0)
    poses = Poses(robot, rng, LOWEST + (_TOP if blocks else 0.0))
    full = poses.load(0.0, 1.5)
    tilt = float(rng.uniform(0.0, radians(6.0)))
    load, now, q = full, 2.0, poses.folded()
    commands: list[Command] = []
    while now < seconds - 12.0:
        act = rng.integers(5 if poses.has_arm else 2)
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
                now += motion_time(q, end, speed) + 0.5
                q = end
    return Scenario(
        'work', seconds, poses.stowed, (0.0, 0.0), full, tuple(commands), blocks=blocks, lean=lean
    )


def _obstacle(robot: Robot, rng: Rng, height: float) -> tuple[tuple[Block, ...], float]:
    """Return a step, stairs or a ramp up to `height` (m) a stair, and the lean (rad) it causes.

    They are as large against the robot as against PackBot; what has casters gets a ramp.
    """
    ground = ground_of(robot)
    rise = float(rng.uniform(0.5, 1.0)) * height * ground.size
    at = float(rng.uniform(0.5, 0.8)) * ground.away
    rise = min(rise, ground.highest)
    lean = atan(rise / ground.half) + radians(1.0)
    run, long = 0.35 * ground.size, 0.75 * ground.size
    made = ((step(at, rise),), stairs(at, rise, run, 3), ramp(at, lean, long))
    return made[rng.integers(3) if ground.steps else 2], lean


def tilt(robot: Robot, rng: Rng, seconds: float) -> Scenario:
    """Holds a load up while the ground tilts until something fails or the robot nearly slides."""
    poses = Poses(robot, rng)
    load = poses.load(1.0, 5.0)
    q = poses.at(UP, rng.uniform(-pi, pi))
    slope = radians(38.0), float(rng.uniform(-pi, pi))
    rate = float(rng.uniform(0.03, 0.12))
    ramp = Command(2.0, slope=slope, slope_rate=rate)
    return Scenario('tilt', seconds, poses.named(q), (0.0, 0.0), load, (ramp,))


def swing(robot: Robot, rng: Rng, seconds: float) -> Scenario:
    """Swings a load downhill and outwards with the arm, on a slope."""
    poses = Poses(robot, rng)
    load = poses.load(1.0, 4.5)
    heading = float(rng.uniform(-pi, pi))
    q = poses.at(READY, heading + pi)
    end = poses.at(SWUNG, heading + rng.uniform(-0.4, 0.4))
    go = Command(2.0, joints=poses.named(end), speed=float(rng.uniform(0.25, 0.8)))
    slope = radians(rng.uniform(8.0, 24.0)), heading
    return Scenario('swing', seconds, poses.named(q), slope, load, (go,))


def reach(robot: Robot, rng: Rng, seconds: float) -> Scenario:
    """Stretches the arm forward with a load on level ground until a motor is saturated."""
    poses = Poses(robot, rng)
    load = poses.load(1.5, 5.0)
    q, out = poses.at(DRAWN_IN), poses.at(STRETCHED)
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
    q = poses.at(ASIDE, side)
    take = Command(5.0, payload=poses.load(1.0, 6.0), payload_time=lifting)
    empty, slope = Payload(0.0, robot.payload.cog), (radians(rng.uniform(0, 12)), side)
    return Scenario('grasp', seconds, poses.named(q), slope, empty, (take,))


def dash(robot: Robot, rng: Rng, seconds: float) -> Scenario:
    """Drives fast and stops dead, again and again, on a slope with a load held up."""
    poses = Poses(robot, rng)
    load = poses.load(1.0, 5.0)
    q = poses.at(HELD_UP)
    slope = radians(rng.uniform(5.0, 24.0)), float(rng.choice([0.0, pi]))
    commands: list[Command] = []
    for begin in np.arange(3.0, seconds - 2.0, 3.0).tolist():
        speed = float(rng.uniform(0.5, 1.8)) * float(rng.choice([-1.0, 1.0]))
        commands.append(Command(begin, drive=(speed, 0.0), drive_rate=3.0))
        commands.append(Command(begin + 1.0, drive=(0.0, 0.0), drive_rate=15.0))
    return Scenario('dash', seconds, poses.named(q), slope, load, tuple(commands))


def climb(robot: Robot, rng: Rng, seconds: float) -> Scenario:
    """Climbs a step, stairs or a ramp with a load held back or to a side."""
    poses = Poses(robot, rng)
    load = poses.load(1.0, 6.0)
    q = poses.at(BACK, rng.uniform(radians(90), radians(270)))
    blocks, lean = _obstacle(robot, rng, 0.075)
    go = Command(2.0, drive=(float(rng.uniform(0.15, 0.35)), 0.0))
    return Scenario(
        'climb', seconds, poses.named(q), (0.0, 0.0), load, (go,), blocks=blocks, lean=lean
    )


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
