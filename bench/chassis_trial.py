"""Brakes, turns, arm swings and rattle of a simulated PackBot, judged from its messages alone.

Truth is MuJoCo's: where the corners of the chassis are, and the static margin of the pose that the
robot really had. The simulated robot differs from the configured one as a real one would: centre of
gravity and IMU by 3 mm, inertia by 20 %.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np

from ugv_acceptance.evaluation.alerts.state_machine import ERROR, Alert
from ugv_acceptance.evaluation.chassis.examination import ChassisExamination
from ugv_acceptance.evaluation.criteria.statement import Statement
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.samples import Batch, ImuColumns, JointStateColumns
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Matrix, Payload, Robot, Vector
from ugv_acceptance.model.stability import stability
from ugv_acceptance.processes import Workers
from ugv_acceptance.simulation.engine import mujoco
from ugv_acceptance.simulation.scenario import Noise
from ugv_acceptance.simulation.stretches import Rows, Sensors
from ugv_acceptance.simulation.tip_cases import clear_of_ground
from ugv_acceptance.simulation.vehicle import (
    SERVO,
    Build,
    Vehicle,
    drive,
    gravity_on_slope,
    vehicle_of,
)
from ugv_acceptance.type_aliases import Floats

BUILD = Build(
    wheels=True,
    bulk=True,
    armature=0.01,
    friction=1.2,
    timestep=0.00125,
    contact_time=0.004,
    impratio=300.0,
)
# Samples of the IMU (Hz), and of the joints: every so many of these.
RATE, STRIDE = 200.0, 4
# Time (s) to come to rest, to stand before the drive, and to watch after it.
SETTLE, STAND, WATCH = 1.0, 1.0, 1.5
KINDS = ('brake', 'turn', 'swing', 'rattle')
# Height (m) of both corners of an end: lifted, and not lifted at all.
LIFTED, GROUNDED = 0.02, 0.002
# Static margin (rad) in which trials begin: nothing tips a robot that is far from it.
NEAREST, FURTHEST = math.radians(5.0), math.radians(28.0)
# Longest time (ns) without margins that a verdict allows, and that of the start.
LONGEST = 500_000_000
CODES = ('TIP_MOVING', 'ACCELERATION', 'TRACK_LIFT')
START = 1_700_000_000_000_000_000


@dataclass(frozen=True, slots=True)
class Trial:
    """A run: posture (rad), load (kg), slope (rad, rad), and what is done.

    `push` is the brake (m/s2), yaw rate (rad/s), peak joint speed (rad/s) or rattle (m/s2); `hold`
    (s) how long; `speed` (m/s) that before a brake or in a turn; `pitch` (Hz) of the rattle.
    """

    kind: str
    seed: int
    q: tuple[float, ...]
    load: float
    slope: tuple[float, float]
    push: float
    hold: float
    speed: float = 0.0
    pitch: float = 0.0


@dataclass(frozen=True, slots=True)
class Run:
    """What a trial gave: messages, and the truth at each of the IMU's.

    `least` (rad) is the least static margin of the real pose, `lift` (m) the most that both corners
    of an end rose, `tipped_at` (s) when the margin became negative; infinite if it never did.
    """

    batch: Batch
    least: float
    lift: float
    tipped_at: float


def trials(robot: Robot, count: int, seed: int) -> list[Trial]:
    """Return random trials, as many of each kind."""
    rng = np.random.default_rng(seed)
    vehicle = vehicle_of(robot, Build(base='fixed', motors=False))
    return [_trial(robot, vehicle, rng, KINDS[k % len(KINDS)], k) for k in range(count)]


def _trial(robot: Robot, vehicle: Vehicle, rng: np.random.Generator, kind: str, k: int) -> Trial:
    while True:
        turret, shoulder, elbow = rng.uniform([-math.pi, 0.0, -2.6], [math.pi, 2.0, 1.2]).tolist()
        if kind == 'brake' and rng.random() < 0.7:
            turret = float(rng.choice([0.0, math.pi]) + rng.normal(0.0, 0.2))
        values = {'turret_joint': turret, 'shoulder_joint': shoulder, 'elbow_joint': elbow}
        q = np.array([values.get(name, math.pi) for name in robot.joint_names])
        load = float(rng.choice([0.0, rng.uniform(0.0, 4.0)]))
        steep = {'brake': 10.0, 'turn': 22.0, 'swing': 15.0, 'rattle': 15.0}[kind]
        slope = (math.radians(rng.uniform(0.0, steep)), float(rng.uniform(-math.pi, math.pi)))
        gravity = gravity_on_slope(robot.gravity, *slope)
        left = min(stability(robot, q, gravity, Payload(load)).angle)
        if NEAREST < left < FURTHEST and clear_of_ground(vehicle, q):
            break
    push, hold, speed, pitch = 0.0, float(rng.uniform(0.1, 1.0)), 0.0, 0.0
    if kind == 'brake':
        push = float(rng.uniform(1.0, 8.0))
        speed = push * hold * float(rng.choice([-1.0, 1.0]))
    elif kind == 'turn':
        push, speed = (float(rng.uniform(*ends)) for ends in ((-2.0, 2.0), (-1.5, 1.5)))
    elif kind == 'swing':
        push = float(rng.uniform(0.5, 3.0) * rng.choice([-1.0, 1.0]))
    else:
        push, pitch = float(rng.uniform(0.5, 4.0)), float(rng.uniform(10.0, 30.0))
        hold, speed = 3.0, float(rng.uniform(-0.6, 0.6))
    return Trial(kind, k, tuple(q.tolist()), load, slope, push, hold, speed, pitch)


def braking(robot: Robot, push: float, hold: float, load: float, arm: Sequence[float]) -> Trial:
    """Return a brake on level ground: m/s2 (backwards if negative), s, kg, and the arm (rad)."""
    named = dict(zip(('turret_joint', 'shoulder_joint', 'elbow_joint'), arm, strict=True))
    q = tuple(named.get(name, math.pi) for name in robot.joint_names)
    return Trial('brake', 0, q, load, (0.0, 0.0), abs(push), hold, push * hold)


def as_built(robot: Robot, trial: Trial) -> Robot:
    """Return the robot as it really is in a trial: not quite as it is configured."""
    rng = np.random.default_rng([trial.seed, 1])
    links = tuple(
        replace(
            link,
            cog=_vector(np.array(link.cog) + rng.normal(0.0, 0.003, 3)),
            inertia=_matrix(np.array(link.inertia) * rng.uniform(0.8, 1.2)),
        )
        if link.mass
        else link
        for link in robot.links
    )
    joints = tuple(replace(joint, effort=math.inf) for joint in robot.joints)
    return replace(robot, links=links, joints=joints, payload=Payload(trial.load))


def _vector(v: Floats) -> Vector:
    x, y, z = v.tolist()
    return x, y, z


def _matrix(m: Floats) -> Matrix:
    x, y, z = m
    return _vector(x), _vector(y), _vector(z)


def simulate(settings: Settings, trial: Trial) -> Run:
    """Run a trial in MuJoCo; the same trial gives the same run."""
    robot, rng = as_built(settings.robot, trial), np.random.default_rng([trial.seed, 2])
    place = np.array(settings.imu.position) + rng.normal(0.0, 0.003, 3)
    vehicle = vehicle_of(robot, replace(BUILD, imu_position=tuple(place.tolist())))
    data = mujoco.MjData(vehicle.model)
    vehicle.model.opt.gravity[:] = gravity_on_slope(robot.gravity, *trial.slope)
    data.qpos[vehicle.position] = data.ctrl[vehicle.motor] = trial.q
    mujoco.mj_step(vehicle.model, data, nstep=round(SETTLE / BUILD.timestep))
    data.time = 0.0
    return _watch(robot, vehicle, data, trial, rng)


def _watch(
    robot: Robot,
    vehicle: Vehicle,
    data: mujoco.MjData,
    trial: Trial,
    rng: np.random.Generator,
) -> Run:
    steer, end = _course(robot, vehicle, data, trial)
    names = ('orientation', 'gyro', 'accelerometer')
    orientation, gyro, force = (data.sensor(name).data for name in names)
    rows, poses = Rows(), []
    steps = round(1.0 / (RATE * BUILD.timestep))
    for k in range(round(end * RATE)):
        felt = np.zeros(3)
        for _ in range(steps):
            steer(data.time)
            mujoco.mj_step(vehicle.model, data)
            felt += force
        world = _in_world(orientation, trial.slope)
        rows.imu.append((data.time, world, gyro.copy(), felt / steps))
        q = data.qpos[vehicle.position].copy()
        if k % STRIDE == 0:
            rate, effort = data.qvel[vehicle.rate].copy(), data.actuator_force[vehicle.motor].copy()
            rows.joints.append((data.time, q, rate, effort))
        attitude = data.xmat[vehicle.root].reshape(3, 3).copy()
        poses.append((q, data.xpos[vehicle.root].copy(), attitude))
    least, lift, tipped_at = _truth(robot, vehicle, poses)
    sensors = Sensors(Noise(), rng)
    return Run(_batch(robot, sensors, rows), least, lift, tipped_at)


def _course(
    robot: Robot, vehicle: Vehicle, data: mujoco.MjData, trial: Trial
) -> tuple[Callable[[float], None], float]:
    """Return what sets wheels, motors and rattle at a time (s), and when the trial ends (s)."""
    gentle = abs(trial.speed) / 0.8
    cruise = STAND + gentle + 0.4
    over = cruise + trial.hold
    arm = vehicle.motor[
        robot.joint_names.index('shoulder_joint' if trial.seed % 2 else 'turret_joint')
    ]
    start, weight = float(data.ctrl[arm]), float(vehicle.model.body_subtreemass[0])

    def forward(t: float) -> float:
        speed = trial.speed * min(max(t - STAND, 0.0) / max(gentle, 1e-9), 1.0)
        if trial.kind == 'brake' and t > cruise:
            return math.copysign(max(abs(speed) - trial.push * (t - cruise), 0.0), trial.speed)
        return (
            speed
            if t < over
            else 0.0
            if trial.kind == 'brake'
            else speed * max(1 - (t - over) * 2, 0.0)
        )

    def steer(t: float) -> None:
        speed, yaw = forward(t), 0.0
        if trial.kind == 'turn' and cruise < t < over:
            yaw = trial.push * min((t - cruise) / 0.2, (over - t) / 0.2, 1.0)
        drive(vehicle, data.ctrl, speed, yaw)
        if trial.kind == 'swing' and cruise < t:
            way, rate = _swing(min(t, over) - cruise, trial.hold)
            data.ctrl[arm] = start + trial.push * (way + rate * 2.0 / SERVO)
        if trial.kind == 'rattle' and t > STAND:
            wave = 2.0 * math.pi * trial.pitch * t
            push = weight * trial.push * np.array([math.sin(wave), 0.0, math.sin(1.3 * wave)])
            data.xfrc_applied[vehicle.root, :3] = push

    return steer, over + WATCH


def _swing(t: float, length: float) -> tuple[float, float]:
    """Return way (s) and rate of a swing that comes up to unit speed and down again in `length`."""
    phase = 2.0 * math.pi * t / length
    return (t - math.sin(phase) * length / (2.0 * math.pi)) / 2.0, (1.0 - math.cos(phase)) / 2.0


def _in_world(orientation: Floats, slope: tuple[float, float]) -> Floats:
    tilt, heading = slope
    s = math.sin(tilt / 2.0)
    ground = np.array([math.cos(tilt / 2.0), -s * math.sin(heading), s * math.cos(heading), 0.0])
    world = np.empty(4)
    mujoco.mju_mulQuat(world, ground, orientation)
    return world[[1, 2, 3, 0]]


def _truth(
    robot: Robot, vehicle: Vehicle, poses: Sequence[tuple[Floats, Floats, Floats]]
) -> tuple[float, float, float]:
    q, position, attitude = (np.array(part) for part in zip(*poses, strict=True))
    down = np.einsum('nij,i->nj', attitude, vehicle.model.opt.gravity)
    angle = np.array(stability(robot, q, down).angle).min(axis=0)
    feet = np.array([c.position for c in robot.contacts if c.link == robot.root])
    height = (position[:, None] + np.einsum('nij,kj->nki', attitude, feet))[:, :, 2]
    height -= height[: round(STAND * RATE / 2)].mean(axis=0)
    ends = [feet[:, axis] * sign > 0 for axis in (0, 1) for sign in (1, -1)]
    lift = max(float(height[:, end].min(axis=1).max()) for end in ends)
    gone = np.flatnonzero(angle < 0.0)
    return float(np.nanmin(angle)), lift, float(gone[0] / RATE) if len(gone) else math.inf


def _batch(robot: Robot, sensors: Sensors, rows: Rows) -> Batch:
    joints, imu = sensors.joints(rows), sensors.imu(rows)
    at, when = (START + np.round(log.stamp * 1e9).astype(np.int64) for log in (joints, imu))
    zero = np.zeros(len(when))
    return Batch(
        joints=[
            JointStateColumns(
                robot.joint_names, at + 1, at, joints.position, joints.velocity, joints.effort
            )
        ],
        imu=[
            ImuColumns(
                'imu_link',
                when,
                when,
                imu.orientation,
                imu.angular_velocity,
                imu.linear_acceleration,
                zero,
                zero,
                zero,
            )
        ],
    )


def halved(batch: Batch) -> Batch:
    """Return the messages of an IMU of half the rate, whose filter takes the mean of two."""
    (imu,) = batch.imu
    m = len(imu.log_time) // 2 * 2
    some = slice(1, m, 2)
    force = (imu.linear_acceleration[0:m:2] + imu.linear_acceleration[1:m:2]) / 2.0
    zero = np.zeros(len(force))
    kept = ImuColumns(
        imu.frame_id,
        imu.log_time[some],
        imu.stamp[some],
        imu.orientation[some],
        imu.angular_velocity[some],
        force,
        zero,
        zero,
        zero,
    )
    return Batch(batch.joints, [kept])


def judged(settings: Settings, load: float, batch: Batch) -> tuple[Statement, list[Alert], float]:
    """Return the statement of the examination, the alerts, and the least static margin (rad).

    The margin is NaN if over half a second of it is not known.
    """
    robot = replace(settings.robot, payload=Payload(load))
    evaluator = RecordedEvaluator(replace(settings, robot=robot))
    start = int(batch.imu[0].log_time[0])
    end = int(batch.imu[0].log_time[-1])
    evaluator.start(start)
    rows = evaluator.batch(batch)
    evaluator.finish(end)
    examination = ChassisExamination()
    examination.add(rows)
    least = float(np.nanmin(rows.angle)) if rows.known.any() else math.nan
    unseen = float((rows.until - rows.time)[~rows.known & (rows.time > start + LONGEST)].sum())
    if unseen > LONGEST:
        least = math.nan  # an unseen stretch: never a PASS
    return examination.statement(start, end), evaluator.watch.log, least


@dataclass(frozen=True, slots=True)
class Said:
    """What is said of a trial from its messages.

    `verdict` is that of static margin and chassis acceleration together, `chassis` of the latter
    alone; `danger`, `caution` (s) are the first such alerts of the chassis, infinite if none.
    """

    verdict: str
    chassis: str
    danger: float
    caution: float


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of a trial: the truth (see Run), and what is said at 200 and at 100 Hz."""

    trial: Trial
    least: float
    lift: float
    tipped_at: float
    fast: Said
    slow: Said


def tried(settings: Settings, trial: Trial) -> Verdict:
    """Run a trial and judge it with the IMU at 200 and at 100 Hz."""
    run = simulate(settings, trial)
    found = [judged(settings, trial.load, batch) for batch in (run.batch, halved(run.batch))]
    fast, slow = (_said(*one) for one in found)
    return Verdict(trial, run.least, run.lift, run.tipped_at, fast, slow)


def _said(statement: Statement, alerts: Sequence[Alert], least: float) -> Said:
    kinds = [objection.verdict for objection in statement.objections]
    said = 'FAIL' if 'FAIL' in kinds else 'INCONCLUSIVE' if kinds else 'PASS'
    mine = [a for a in alerts if a.rule.code in CODES]
    danger = [a for a in mine if a.rule.level == ERROR]
    unseen = 'INCONCLUSIVE' if math.isnan(least) else said
    return Said('FAIL' if least <= 0.0 else unseen, said, _first(danger), _first(mine))


def _first(alerts: Sequence[Alert]) -> float:
    return min(((a.start - START) / 1e9 for a in alerts), default=math.inf)


def tried_all(settings: Settings, some: Sequence[Trial], workers: int = 2) -> list[Verdict]:
    """Return what became of each trial, in their order, computed by `workers` processes."""
    with Workers(workers, mp_context=get_context('spawn')) as pool:
        return list(pool.map(tried, [settings] * len(some), some, chunksize=4))
