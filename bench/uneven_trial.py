"""Drives of a simulated PackBot over uneven ground: what its sensors say, and what is true.

The true margin is the least tilt about the hull of the points where the ground really bears the
robot, at its real attitude; a true tip-over is one that goes on until the robot lies.
"""

import math
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np

from bench.uneven_scenes import (
    ANGLE,
    BUILD,
    COUNT,
    RISE,
    RUN,
    SLIP,
    SLIP_FLAT,
    Belts,
    drive_step,
    scene,
    touching,
    tracked,
)
from ugv_acceptance.model.hull import hull, pairs
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.stability import margins
from ugv_acceptance.processes import Workers
from ugv_acceptance.simulation.engine import mujoco
from ugv_acceptance.simulation.vehicle import SERVO, Vehicle, gravity_on_slope
from ugv_acceptance.type_aliases import Floats

SCENES = ('flat', 'stairs_up', 'stairs_down', 'ramps', 'stepfield', 'hurdle', 'drop', 'stair_top')
# Scenes in which the ground ends ahead: what no rule without a map sees.
EDGES = ('drop', 'stair_top')
# Time (s) between two looks, to come to rest, and of a drive.
LOOK, SETTLE, DRIVE = 0.05, 0.8, 14.0
# Angle (rad) of the robot's z axis against the vertical from which it lies.
LIES = math.radians(75.0)
# Contacts closer than this (m), seen from above, are one; steepest edge (rad) taken as it is.
APART, STEEP = 0.005, math.radians(60.0)
# Turn (rad) up to which a robot has come to rest at its start; a tip-over before FIRST (s) is no
# drive; trials from which one is taken.
ROCKED, FIRST, ATTEMPTS = math.radians(10.0), 1.0, 12
# Attitude noise (rad) of the IMU at each look.
NOISE = 0.0005
# Flippers (rad): stowed, raised, straight on, and the pitch at which an operator lowers them.
STOWED, UP, AHEAD, LOWER = math.pi, math.radians(45.0), 0.0, math.radians(18.0)
# Highest speeds (rad/s) of flippers, and gain (1/s) with which the heading is held.
FLIP, HOLD = 1.0, 0.8


@dataclass(frozen=True, slots=True)
class Trial:
    """A drive: scene, arm (turret, shoulder, elbow; rad), load (kg), speed (m/s, backwards < 0).

    `place` (m) is x and y of the start, `pitch` and `heading` (rad) its attitude there, `height`
    (m) of the ground under it. `flippers` is stowed, up, ahead or used: up until the robot pitches.
    At `move` (s) the arm goes to `arm_then` at `rate` (rad/s). `slope` is that of flat ground.
    """

    scene: str
    seed: int
    arm: tuple[float, float, float]
    load: float
    speed: float
    place: tuple[float, float, float]
    pitch: float
    heading: float
    flippers: str
    move: float
    arm_then: tuple[float, float, float]
    rate: float
    slope: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Drive:
    """What a trial gave, at each look (n): `time` (s), joints (n, j), gravity (n, 3) as measured.

    `truth` (n,) rad is the true margin, NaN without contact; `lean` (n,) rad the z axis against the
    vertical. `over` (s) is when the robot lay, infinite if it never did.
    """

    trial: Trial
    time: Floats
    q: Floats
    gravity: Floats
    truth: Floats
    lean: Floats
    over: float

    @property
    def tips_at(self) -> float:
        """The last moment (s) with a true margin, before a robot that tipped over lay."""
        if not math.isfinite(self.over):
            return math.inf
        stands = (self.truth > 0.0) & (self.time < self.over)
        both = stands[1:] & stands[:-1]
        return float(self.time[1:][both][-1]) if both.any() else float(self.time[0])


def trial(robot: Robot, name: str, seed: int) -> Trial:
    """Return a random trial on a scene; the same seed gives the same one."""
    return _trial(robot, np.random.default_rng([seed, SCENES.index(name)]), name, seed)


def _trial(robot: Robot, rng: np.random.Generator, name: str, k: int) -> Trial:
    load = float(rng.uniform(0.0, 6.0))
    slope = (0.0, 0.0)
    if name == 'flat':
        slope = (math.radians(rng.uniform(0.0, 20.0)), float(rng.uniform(-math.pi, math.pi)))
    x, y, z, pitch, heading, forward, flippers = _start(name, rng)
    stands = (abs(pitch), 0.0 if pitch > 0.0 else math.pi) if pitch else slope
    arm, then = (_arm(robot, rng, load, stands) for _ in range(2))
    moves = rng.random() < 0.5
    speed = forward * float(rng.uniform(0.1, 0.5))
    return Trial(
        name,
        k,
        arm,
        load,
        speed,
        (x, y, z),
        pitch,
        heading + float(rng.normal(0.0, 0.12)),
        flippers,
        float(rng.uniform(1.0, 6.0)) if moves else math.inf,
        then,
        float(rng.uniform(0.2, 0.8)),
        slope,
    )


def _arm(
    robot: Robot, rng: np.random.Generator, load: float, slope: tuple[float, float]
) -> tuple[float, float, float]:
    """Return an arm off the ground with 10 to 50 deg left on the level, half of them below 30."""
    gravity = gravity_on_slope(robot.gravity, *slope)
    while True:
        below = math.radians(float(rng.choice([30.0, 55.0])))
        turret, shoulder, elbow = rng.uniform([-math.pi, 0.3, -2.7], [math.pi, 2.6, 0.5]).tolist()
        height = 0.26 + 0.55 * math.sin(shoulder), 0.64 * math.sin(shoulder + elbow)
        if height[0] < 0.3 or sum(height) < 0.3:
            continue
        named = {'turret_joint': turret, 'shoulder_joint': shoulder, 'elbow_joint': elbow}
        q = [named.get(name, math.pi) for name in robot.joint_names]
        level = np.array(margins(robot, q, [0.0, 0.0, -robot.gravity], Payload(load)).angle).min()
        left = np.array(margins(robot, q, gravity, Payload(load)).angle).min()
        if math.radians(10.0) < level < below and left > math.radians(
            14.0 if slope[0] > STEEP / 2.0 else 2.0
        ):
            return turret, shoulder, elbow


def _start(
    name: str, rng: np.random.Generator
) -> tuple[float, float, float, float, float, float, str]:
    """Return x, y, height, pitch, heading, direction of driving and use of the flippers."""
    y = float(rng.uniform(-0.15, 0.15))
    flippers = str(rng.choice(['used', 'used', 'used', 'ahead', 'stowed']))
    back = rng.random() < 0.3
    forward, heading = (-1.0, math.pi) if back else (1.0, 0.0)
    if name == 'flat':
        use = str(rng.choice(['stowed', 'up']))
        return 0.0, 0.0, 0.0, 0.0, 0.0, float(rng.choice([-1.0, 1.0])), use
    if name in {'stairs_up', 'stairs_down', 'stair_top'}:
        return _on_stairs(name, rng, y, flippers)
    if name == 'drop':
        return -1.2, y, 1.0, 0.0, heading, forward, str(rng.choice(['ahead', 'stowed', 'used']))
    if name == 'ramps':
        return -0.8, y, 0.0, 0.0, heading, forward, str(rng.choice(['used', 'ahead', 'stowed']))
    if name == 'stepfield':
        return -0.8, 2.0 * y, 0.0, 0.0, 0.0, 1.0, flippers
    return -1.2 + float(rng.uniform(0.0, 0.3)), y, 0.0, 0.0, 0.0, 1.0, flippers


def _on_stairs(
    name: str, rng: np.random.Generator, y: float, flippers: str
) -> tuple[float, float, float, float, float, float, str]:
    top = (COUNT - 1) * RUN
    if name == 'stairs_up' and rng.random() < 0.5:
        return -0.9, y, 0.0, 0.0, 0.0, 1.0, 'used'
    if name == 'stair_top' and rng.random() < 0.5:
        back = rng.random() < 0.4
        heading, forward = (0.0, -1.0) if back else (math.pi, 1.0)
        return top + 0.7, y, COUNT * RISE, 0.0, heading, forward, flippers
    low, high = {'stairs_up': (0.4, 1.0), 'stairs_down': (1.4, 1.9), 'stair_top': (1.6, 1.9)}[name]
    x = float(rng.uniform(low, high))
    faces_up = name != 'stairs_down' or rng.random() < 0.5
    forward = -1.0 if (name == 'stairs_down') == faces_up else 1.0
    # On the line through the noses; a robot that faces up has its nose up.
    pitch, heading = (-ANGLE, 0.0) if faces_up else (ANGLE, math.pi)
    return x, y, RISE + x * math.tan(ANGLE), pitch, heading, forward, flippers


def simulate(robot: Robot, trial: Trial) -> Drive | None:
    """Run a trial; None if the robot does not come to rest where it starts."""
    load = Payload(trial.load, robot.payload.cog)
    place = scene(trial.scene, trial.seed)
    vehicle = tracked(replace(robot, payload=load), place)
    data = mujoco.MjData(vehicle.model)
    vehicle.model.opt.gravity[:] = gravity_on_slope(robot.gravity, *trial.slope)
    data.qpos[vehicle.position] = data.ctrl[vehicle.motor] = _posture(vehicle, trial, trial.arm)
    x, y, z = trial.place
    if trial.scene == 'drop':
        z = place.blocks[0].half[2]
    attitude = attitude_of(trial.heading, trial.pitch)
    mujoco.mju_mat2Quat(data.qpos[3:7], attitude.reshape(9))
    data.qpos[:3] = np.array([x, y, z]) + 0.01 * attitude[:, 2]
    belts = Belts.of(vehicle.model, SLIP_FLAT if trial.scene == 'flat' else SLIP)
    for _ in range(round(SETTLE / BUILD.timestep)):
        drive_step(vehicle, data, belts, (0.0, 0.0))
    data.time = 0.0
    return _Watch(robot, vehicle, trial, belts).drive(data, place.ends)


def _posture(vehicle: Vehicle, trial: Trial, arm: tuple[float, float, float]) -> list[float]:
    flippers = {'stowed': STOWED, 'up': UP, 'used': UP, 'ahead': AHEAD}[trial.flippers]
    named = dict(zip(('turret_joint', 'shoulder_joint', 'elbow_joint'), arm, strict=True))
    return [named.get(name, flippers) for name in vehicle.robot.joint_names]


def attitude_of(heading: float, pitch: float) -> Floats:
    """Return the attitude (3, 3) of a robot with its nose down by `pitch` (rad)."""
    s, c, t, d = math.sin(heading), math.cos(heading), math.sin(pitch), math.cos(pitch)
    return np.array([[c * d, -s, c * t], [s * d, c, s * t], [-t, 0.0, d]])


@dataclass(slots=True)
class _Watch:
    """Drives a robot as an operator would, and keeps what it sees and what is true."""

    robot: Robot
    vehicle: Vehicle
    trial: Trial
    belts: Belts
    flipper: float = math.nan

    def drive(self, data: mujoco.MjData, ends: tuple[float, float]) -> Drive | None:
        """Return the whole drive; it ends where the scene does, or when the robot lies."""
        trial, vehicle = self.trial, self.vehicle
        rng = np.random.default_rng([trial.seed, 3])
        looks: list[tuple[float, Floats, Floats, float, float]] = []
        start = max(abs(trial.pitch), trial.slope[0])
        over, steps = math.inf, round(LOOK / BUILD.timestep)
        for k in range(round(DRIVE / LOOK)):
            for _ in range(steps):
                drive_step(vehicle, data, self.belts, self._steer(data))
            attitude = data.xmat[vehicle.root].reshape(3, 3)
            down = vehicle.model.opt.gravity / self.robot.gravity
            lean = math.acos(float(np.clip(-(down @ attitude[:, 2]), -1.0, 1.0)))
            left = true_margin(touching(data), data.subtree_com[vehicle.root], down)
            if k == 0 and abs(lean - start) > ROCKED:
                return None
            measured = attitude.T @ vehicle.model.opt.gravity + np.cross(
                rng.normal(0.0, NOISE, 3), attitude.T @ vehicle.model.opt.gravity
            )
            q = data.qpos[vehicle.position].copy()
            looks.append((float(data.time), q, measured, left, lean))
            if lean > LIES:
                over = float(data.time)
                break
            if self._done(data, ends):
                break
        time, joints, gravity, truth, leans = (np.array(x) for x in zip(*looks, strict=True))
        drive = Drive(trial, time, joints, gravity, truth, leans, over)
        return drive if drive.tips_at >= FIRST else None

    def _done(self, data: mujoco.MjData, ends: tuple[float, float]) -> bool:
        x = float(data.qpos[0])
        if self.trial.scene == 'stairs_up' and x > (COUNT - 1) * RUN - 0.45:
            return True
        return not ends[0] < x < ends[1]

    def _steer(self, data: mujoco.MjData) -> tuple[float, float]:
        trial, t = self.trial, float(data.time)
        if t == 0.0:
            self.flipper = float(data.ctrl[self.vehicle.motor][self._joint('flipper_joint')])
        attitude = data.xmat[self.vehicle.root].reshape(3, 3)
        if trial.flippers == 'used':
            nose_up = math.asin(float(np.clip(attitude[2, 0], -1.0, 1.0)))
            target = AHEAD if abs(nose_up) > LOWER else UP
            way = FLIP * BUILD.timestep
            self.flipper += float(np.clip(target - self.flipper, -way, way))
            data.ctrl[self.vehicle.motor[self._joint('flipper_joint')]] = self.flipper
        if t >= trial.move:
            self._move_arm(data, t)
        heading = math.atan2(attitude[1, 0], attitude[0, 0])
        off = math.remainder(trial.heading - heading, 2.0 * math.pi)
        if trial.scene == 'flat':
            wave = math.sin(0.7 * t + trial.seed)
            return trial.speed * float(np.clip(3.0 * wave, -1.0, 1.0)), 0.4 * math.sin(1.1 * t)
        return trial.speed * min(t / 0.5, 1.0), HOLD * off

    def _joint(self, name: str) -> int:
        return self.vehicle.robot.joint_names.index(name)

    def _move_arm(self, data: mujoco.MjData, t: float) -> None:
        trial = self.trial
        names = ('turret_joint', 'shoulder_joint', 'elbow_joint')
        for name, first, last in zip(names, trial.arm, trial.arm_then, strict=True):
            length = max(abs(last - first) * math.pi / 2.0 / trial.rate, 0.01)
            phase = math.pi * min((t - trial.move) / length, 1.0)
            rate = (last - first) * math.pi / (2.0 * length) * math.sin(phase)
            way = (last - first) * (1.0 - math.cos(phase)) / 2.0
            data.ctrl[self.vehicle.motor[self._joint(name)]] = first + way + rate * 2.0 / SERVO


def true_margin(points: Floats, cog: Floats, down: Floats) -> float:
    """Return the least tilt (rad) about the hull of the points (n, 3) that bear; NaN without any.

    `cog` (3,) m and `down` (3,), a unit vector, are in the axes of the points. About a single line
    or point the robot turns by itself: then it is 0 or less.
    """
    if not len(points):
        return math.nan
    across = np.cross(down, [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    # Seen along gravity from the centre of gravity: horizontal x and y, z up.
    seen = (points - cog) @ np.stack([np.cross(across, -down), across, -down]).T
    flat = _apart(seen)
    corners = hull(tuple((x, y, z) for x, y, z in flat.tolist()), tuple(range(len(flat))))
    if len(corners) < 3:
        return -abs(_tilt(*_ends(flat)))
    return min(_tilt(flat[a], flat[b]) for a, b in pairs(corners))


def _apart(points: Floats) -> Floats:
    """Return the points without those close above another: of a wall the foot counts."""
    kept: list[Floats] = []
    for point in points[np.argsort(points[:, 2])]:
        if all(np.hypot(*(point - other)[:2]) > APART for other in kept):
            kept.append(point)
    return np.array(kept)


def _ends(flat: Floats) -> tuple[Floats, Floats]:
    """Return the ends of points in a line."""
    far = flat[np.argmax(np.hypot(*(flat - flat[0])[:, :2].T))]
    return flat[np.argmax(np.hypot(*(flat - far)[:, :2].T))], far


def _tilt(p: Floats, q: Floats) -> float:
    """Return the angle (rad) left about the edge from p to q, seen from the centre of gravity.

    Where the edge ends before it comes nearest, the robot tips over its end.
    """
    way = q - p
    length = float(np.hypot(*way[:2]))
    inside = float(p[0] * q[1] - p[1] * q[0]) / length if length > APART else 0.0
    share = -float(p[:2] @ way[:2]) / length**2 if length > APART else 0.0
    if not 0.0 < share < 1.0:
        end = q if share >= 1.0 else p
        return math.atan2(math.copysign(float(np.hypot(*end[:2])), inside), float(-end[2]))
    level = math.cos(min(abs(math.atan2(way[2], length)), STEEP))
    return math.atan2(inside, float(-(p + share * way)[2]) * level)


def driven(robot: Robot, name: str, seed: int) -> Drive | None:
    """Return the first drive that begins as it should, of ATTEMPTS trials from a seed on."""
    for attempt in range(ATTEMPTS):
        drive = simulate(robot, trial(robot, name, seed * ATTEMPTS + attempt))
        if drive is not None:
            return drive
    return None


def driven_all(robot: Robot, count: int, seed: int, workers: int = 2) -> list[Drive]:
    """Return `count` drives on each scene, in the order of scenes and seeds."""
    some = [(name, seed + k) for k in range(count) for name in SCENES]
    with Workers(workers, mp_context=get_context('spawn')) as pool:
        names, seeds = zip(*some, strict=True)
        found = pool.map(driven, [robot] * len(some), names, seeds, chunksize=4)
        return [drive for drive in found if drive is not None]
