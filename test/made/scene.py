"""A robot's true motion for a while, what its sensors would say of it, and how near it came.

A scene is made first and is the truth; its messages follow from it. Faults change one or the other.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from made.run import EPOCH, NS, Imu, Joints, Part, Payloads, Times
from made.subjects import Subject
from made.truth import NONE, G, Load, tilts_left, torques
from scipy.spatial.transform import Rotation

from ugv_acceptance.config import Config
from ugv_acceptance.type_aliases import Floats

# Rates (Hz) of the messages, and of the grid on which the truth is looked at.
JOINTS_HZ, IMU_HZ, TRUTH_HZ = 50, 100, 10


@dataclass(frozen=True, slots=True)
class Noise:
    """What sensors add (one sigma) in rad, rad/s, m/s2; to efforts as a share of their limit."""

    attitude: float = 0.001
    gyro: float = 0.005
    force: float = 0.06
    encoder: float = 2e-5
    effort: float = 0.003


QUIET = Noise()


@dataclass(frozen=True)
class Scene:
    """The true motion: joints `q` (n, j) at 50 Hz, the chassis (m,) at 100 Hz, and the load.

    `roll`, `pitch`, `yaw` in rad (z-y-x), `accel` (m, 3) of the IMU's place in m/s2, in base axes.
    `torque` (n, j) is what the motors give.
    """

    subject: Subject
    config: Config
    q: Floats
    roll: Floats
    pitch: Floats
    yaw: Floats
    accel: Floats
    load: Load = NONE
    torque: Floats = field(default_factory=lambda: np.zeros(0))

    @property
    def joint_time(self) -> Floats:
        """Times of the joint states (s)."""
        return np.arange(len(self.q)) / JOINTS_HZ

    @property
    def imu_time(self) -> Floats:
        """Times of the IMU's messages (s)."""
        return np.arange(len(self.roll)) / IMU_HZ

    @property
    def turn(self) -> Rotation:
        """How base_link is turned in the world at the IMU's times."""
        return Rotation.from_euler('ZYX', np.stack([self.yaw, self.pitch, self.roll], 1))

    def up(self) -> Floats:
        """Return the unit vector against gravity in base_link (n, 3) at the joints' times."""
        at = np.searchsorted(self.imu_time, self.joint_time, side='right') - 1
        found: Floats = self.turn.inv().apply((0.0, 0.0, 1.0))[at]
        return found

    def static_torque(self) -> Floats:
        """Return the torques at rest (n, j) by the brute force of truth.py."""
        return torques(self.config.settings.robot, self.q, self.up(), self.load)

    def truth(self) -> 'Truth':
        """Return how near the run really came to its limits, ten times a second."""
        rows, robot = slice(None, None, JOINTS_HZ // TRUTH_HZ), self.config.settings.robot
        q, up = self.q[rows], self.up()[rows]
        tau = torques(robot, q, up, self.load) if len(self.torque) == 0 else self.torque[rows]
        share = np.abs(tau) / np.array(self.config.settings.limits.torque)
        left, outward = tilts_left(robot, q, up, self.load)
        return Truth(np.degrees(left.min(1)), share, np.degrees(left[0]), outward)


@dataclass(frozen=True, slots=True)
class Truth:
    """Tilt left (n,) in deg, share of the torque limit (n, j); at the start, left to each edge."""

    tip: Floats
    share: Floats
    edges: Floats
    outward: Floats

    def good(self, tip: float, share: float) -> bool:
        """Return whether more than `tip` (deg) was left, and `share` of no limit used."""
        return bool(self.tip.min() > tip and self.share.max() < share)


def level(subject: Subject, config: Config, seconds: float, load: Load = NONE) -> Scene:
    """Return a robot that rests on level ground with its arm folded."""
    n, m = round(seconds * JOINTS_HZ), round(seconds * IMU_HZ)
    q = np.tile(np.array(subject.calm), (n, 1))
    zeros = np.zeros(m)
    return Scene(subject, config, q, zeros, zeros, zeros, np.zeros((m, 3)), load)


def eased(time: Floats, knots: Sequence[tuple[float, float]]) -> Floats:
    """Return a value that goes smoothly through (time, value), at rest at each of them."""
    at, value = np.array(knots, np.float64).T
    k = np.clip(np.searchsorted(at, time, side='right') - 1, 0, len(at) - 2)
    part = np.clip((time - at[k]) / np.maximum(at[k + 1] - at[k], 1e-9), 0.0, 1.0)
    found: Floats = value[k] + (value[k + 1] - value[k]) * (1.0 - np.cos(np.pi * part)) / 2.0
    return found


def wander(
    scene: Scene, rng: np.random.Generator, reach: float, rate: float, first: float = 2.0
) -> Scene:
    """Return the scene with an arm that visits poses within `reach` (rad) of its own, at `rate`."""
    subject, seconds = scene.subject, len(scene.q) / JOINTS_HZ
    low, high = travel(scene)
    knots = [(0.0, np.array(subject.calm)), (first, np.array(subject.calm))]
    while knots[-1][0] < seconds and subject.arm:
        pose = np.array(subject.calm)
        pose[list(subject.arm)] += rng.uniform(-reach, reach, len(subject.arm))
        pose = np.clip(pose, low, high)
        takes = float(np.abs(pose - knots[-1][1]).max()) * np.pi / 2.0 / rate
        arrived = knots[-1][0] + takes
        knots += [(arrived, pose), (arrived + rng.uniform(2.0, 5.0), pose)]
    return replace(scene, q=through(scene.joint_time, knots))


def travel(scene: Scene) -> tuple[Floats, Floats]:
    """Return the least and the most position of each joint (rad, m), a little inside its range."""
    robot = scene.config.settings.robot
    ends = np.array([robot.joint(name).travel(1.0) for name in robot.joint_names])
    endless = [robot.joint(name).kind == 'continuous' for name in robot.joint_names]
    ends[endless] = (-1e3, 1e3)
    return ends[:, 0] + 0.02, ends[:, 1] - 0.02


def through(time: Floats, knots: Sequence[tuple[float, Floats]]) -> Floats:
    """Return poses (n, j) that go smoothly through poses at times."""
    columns = np.array([pose for _, pose in knots]).T
    when = [at for at, _ in knots]
    return np.stack([eased(time, list(zip(when, c, strict=True))) for c in columns.tolist()], 1)


def driving(scene: Scene, rng: np.random.Generator, accel: float, turning: float) -> Scene:
    """Return the scene while the robot drives: speed up, hold, slow down, turn, again and again."""
    time, knots, turns = scene.imu_time, [(0.0, 0.0)], [(0.0, 0.0)]
    while knots[-1][0] < time[-1]:
        at, before = knots[-1]
        goal = float(rng.uniform(-0.3, 1.0))
        takes = max(abs(goal - before) * np.pi / 2.0 / accel, 0.3)
        hold = float(rng.uniform(1.0, 4.0))
        knots += [(at + takes, goal), (at + takes + hold, goal)]
        turns += [(at + takes, turns[-1][1])]
        turns += [(at + takes + hold, turns[-1][1] + float(rng.uniform(-turning, turning)) * hold)]
    speed, yaw = eased(time, knots), scene.yaw + eased(time, turns)
    ahead = np.gradient(speed, time)
    aside = speed * np.gradient(yaw, time)
    moved = scene.accel + np.stack([ahead, aside, np.zeros_like(ahead)], 1)
    found = replace(scene, yaw=yaw, accel=moved)
    if scene.subject.arm:
        return found
    wheels = np.interp(scene.joint_time, time, np.cumsum(speed) / IMU_HZ) / 0.1
    return replace(found, q=np.tile(wheels[:, None], (1, scene.q.shape[1])))


def sensed(scene: Scene, rng: np.random.Generator, noise: Noise = QUIET) -> tuple[Joints, Imu]:
    """Return the messages of joints and IMU, in time and whole."""
    time = ns(scene.joint_time)
    torque = scene.torque if len(scene.torque) else scene.static_torque()
    limits = np.array(scene.config.settings.limits.torque)
    scale = np.where(np.isfinite(limits), limits, 10.0) * noise.effort
    position = scene.q + noise.encoder * rng.normal(size=scene.q.shape)
    joints = Joints(
        tuple(j.topic_name for j in scene.config.settings.joints),
        time,
        time,
        position,
        np.gradient(scene.q, 1.0 / JOINTS_HZ, axis=0) if len(scene.q) > 1 else scene.q * 0.0,
        torque + scale * rng.normal(size=torque.shape),
    )
    return joints, imu_of(scene, rng, noise)


def imu_of(scene: Scene, rng: np.random.Generator, noise: Noise) -> Imu:
    """Return the IMU's messages in the axes in which it is mounted."""
    count, mounting, turn = len(scene.roll), scene.subject.mounting, scene.turn
    rate = np.zeros((count, 3))
    rate[1:] = (turn[:-1].inv() * turn[1:]).as_rotvec() * IMU_HZ
    force = turn.inv().apply((0.0, 0.0, G)) + scene.accel
    seen = turn * mounting
    if noise.attitude:
        seen = seen * Rotation.from_rotvec(slow(rng, count, noise.attitude))
    back = mounting.inv()
    return Imu(
        ns(scene.imu_time),
        ns(scene.imu_time),
        seen.as_quat(),
        back.apply(rate) + noise.gyro * rng.normal(size=rate.shape),
        back.apply(force) + noise.force * rng.normal(size=rate.shape),
        (scene.config.topics.imu.frame_id or 'imu_link').lstrip('/'),
    )


def slow(rng: np.random.Generator, count: int, sigma: float) -> Floats:
    """Return noise (count, 3) of this size that a filter has smoothed, as attitudes have it."""
    raw = rng.normal(size=(count, 3))
    smooth = np.stack([np.convolve(c, np.ones(8) / 8.0, mode='same') for c in raw.T], 1)
    found: Floats = sigma * (smooth * np.sqrt(8.0) + 0.1 * rng.normal(size=(count, 3)))
    return found


def told(scene: Scene, mass: float, start: float = 0.0, period: float = 1.0) -> list[Part]:
    """Return messages that tell a payload from a time (s) on; none where nothing can be carried."""
    robot = scene.config.settings.robot
    if robot.payload_link is None:
        return []
    when = np.arange(start, len(scene.q) / JOINTS_HZ, period)
    return [
        Payloads(ns(when), np.full(len(when), mass), np.zeros((len(when), 3)), robot.payload_link)
    ]


def ns(seconds: Floats) -> Times:
    """Return log times (ns) of seconds since the start."""
    return EPOCH + np.round(seconds * NS).astype(np.int64)
