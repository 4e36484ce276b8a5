"""The fixed scenarios for robots other than PackBot, by the roles of their joints."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.statics import payload_capacity
from ugv_acceptance.simulation.arm_grid import ArmGrid, grid_of, limits_of
from ugv_acceptance.simulation.ground import ground_of
from ugv_acceptance.simulation.poses import Joints, Poses, motion_time, named, way
from ugv_acceptance.simulation.scenario import Command, Scenario
from ugv_acceptance.simulation.shape import ramp
from ugv_acceptance.type_aliases import Floats

RIGHT = -math.pi / 2.0
# Time (s) for a motion of the arm, and its fastest (rad/s).
MOVE, FASTEST = 5.0, 0.5
# How much heavier the load is that the outstretched arm cannot hold.
TOO_HEAVY = 1.3
# Postures that are tried for a motion.
TRIED = 20
# Tilt (rad) of the ramp, and how far (m) ahead of the robot it begins.
RAMP, AHEAD = math.radians(10.0), 0.35


def gentle(robot: Robot) -> Scenario:
    """On level ground: lift, look around, drive, fold again; without an arm: drive and turn."""
    grid = grid_of(robot)
    load = Payload(grid.capacity / 2.0, robot.payload.cog)
    if len(grid.rows) == 1:
        drives = ((2.0, 0.3, 0.0), (7.0, 0.0, 0.0), (9.0, 0.0, 0.4), (13.0, 0.0, 0.0))
        back = ((15.0, 0.0, -0.4), (19.0, 0.0, 0.0), (21.0, -0.3, 0.0), (25.0, 0.0, 0.0))
        commands = tuple(Command(t, drive=(v, yaw)) for t, v, yaw in (*drives, *back))
        return _run('gentle', 28.0, grid, load, commands)
    folded, lifted = grid.stowed, lift_of(robot, load)
    aside = grid.turned(lifted[None], _heading(grid, lifted) + math.radians(30.0))[0]
    commands = (
        _move(2.0, robot, folded, lifted),
        _move(8.0, robot, lifted, aside, 2.5),
        _move(12.0, robot, aside, lifted, 2.5),
        Command(16.0, drive=(0.15, 0.0)),
        Command(18.5, drive=(0.0, 0.0)),
        _move(20.0, robot, lifted, folded),
    )
    return _run('gentle', 28.0, grid, load, commands)


def overreach(robot: Robot) -> Scenario:
    """On a side slope with too heavy a load: the arm reaches out, then turns downhill with it."""
    grid = grid_of(robot)
    out, down = grid.outstretched, (0.0, 0.0, -robot.gravity)
    holds = float(payload_capacity(robot, out, down, limits_of(robot)))
    mass = holds if 0.0 < holds < math.inf else grid.capacity
    load = Payload(TOO_HEAVY * max(mass, grid.capacity), robot.payload.cog)
    _, share = grid.looked(grid.rows[:, None, :], 0.0, load)
    near = grid.rows[int(share.argmin())]
    ahead, across = (grid.turned(out[None], heading)[0] for heading in (0.0, RIGHT))
    turned = grid.turned(near[None], RIGHT)[0]
    commands = (
        Command(2.0, payload=load),
        Command(3.0, slope=(math.radians(12.0), RIGHT), slope_rate=0.06),
        _move(7.5, robot, near, ahead, 4.0),
        _move(12.5, robot, ahead, near, 4.0),
        _move(17.0, robot, near, turned, 3.0),
        _move(21.0, robot, turned, across, 4.0),
    )
    empty = Payload(0.0, robot.payload.cog)
    return replace(_run('overreach', 29.0, grid, empty, commands), start=named(robot, near))


def fetch(robot: Robot) -> Scenario:
    """On level ground: reach down, lift a load, climb a ramp with it, come back, set it down."""
    grid, ground = grid_of(robot), ground_of(robot)
    load, none = (Payload(m, robot.payload.cog) for m in (grid.capacity / 2.0, 0.0))
    folded, low, lifted = grid.stowed, down_of(robot, load), lift_of(robot, load)
    commands = (
        _move(2.0, robot, folded, low, 4.0),
        Command(6.5, payload=load, payload_time=1.0),
        _move(8.0, robot, low, lifted, 4.5),
        Command(13.0, drive=(0.2, 0.0)),
        Command(20.0, drive=(0.0, 0.0)),
        Command(22.0, drive=(-0.2, 0.0)),
        Command(29.0, drive=(0.0, 0.0)),
        _move(31.0, robot, lifted, low, 4.5),
        Command(36.0, payload=none),
        _move(37.0, robot, low, folded, 3.0),
    )
    blocks = ramp(ground.front + AHEAD, RAMP)
    return _run('fetch', 40.0, grid, none, commands, blocks=blocks, lean=RAMP + 0.01)


FIXED: dict[str, Callable[[Robot], Scenario]] = {
    'gentle': gentle,
    'overreach': overreach,
    'fetch': fetch,
}


def lift_of(robot: Robot, load: Payload) -> Floats:
    """Return the highest posture (j,) near the folded one that is reached with large margins."""
    grid = grid_of(robot)
    return _reached(grid, load, -grid.grip[:, 2], np.ones(len(grid.rows), bool))


def down_of(robot: Robot, load: Payload) -> Floats:
    """Return the lowest posture (j,) in front of the robot that is reached with large margins."""
    grid, ground = grid_of(robot), ground_of(robot)
    turned = grid.turned(grid.rows, 0.0)
    reached = grid.pillar[0] + grid.reach
    ahead = (reached > ground.front) & grid.clear(turned)
    return _reached(grid, load, grid.grip[:, 2], ahead, 0.0)


def _reached(
    grid: ArmGrid,
    load: Payload,
    score: Floats,
    rows: np.ndarray[tuple[int, ...], np.dtype[np.bool_]],
    heading: float | None = None,
) -> Floats:
    """Return the posture (j,) with the least score that is reached with large margins.

    Among `rows` (n,), turned to `heading` (rad) if given; without one the folded posture.
    """
    poses = Poses(grid.robot, np.random.default_rng(0))
    folded = grid.stowed
    order = np.argsort(np.where(rows & grid.near(folded), score, np.inf), kind='stable')
    for k in order[:TRIED]:
        row = grid.rows[k] if heading is None else grid.turned(grid.rows[k][None], heading)[0]
        if rows[k] and poses.passes(folded, row) and poses.keeps(way(folded, row), load, 0.0):
            found: Floats = row
            return found
    return folded


def _heading(grid: ArmGrid, q: Floats) -> float:
    """Return where the arm points in a posture (j,), rad."""
    row = int(np.abs(grid.rows - q).max(axis=1, initial=0.0).argmin())
    x, y = (grid.grip[row] - grid.pillar)[:2]
    return math.atan2(float(y), float(x))


def _move(time: float, robot: Robot, start: Floats, end: Floats, length: float = MOVE) -> Command:
    """Return a motion of the arm that takes about `length` (s), more where it would be fast."""
    speed = min(max(motion_time(start, end, 1.0) / length, 0.05), FASTEST)
    return Command(time, joints=named(robot, end), speed=speed)


def _run(
    name: str,
    seconds: float,
    grid: ArmGrid,
    load: Payload,
    commands: tuple[Command, ...],
    **ground: object,
) -> Scenario:
    start: Joints = named(grid.robot, grid.stowed)
    return Scenario(
        name,
        seconds,
        start,
        payload=load,
        commands=commands,
        joint_rate=100.0,
        imu_rate=200.0,
        **ground,  # type: ignore[arg-type]  # blocks and lean
    )
