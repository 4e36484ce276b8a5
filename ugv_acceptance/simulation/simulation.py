"""Steps a robot through time: servos with limits, wheels, slopes, a load.

The ground is the plane z = 0 of the simulation; a slope is a change of gravity's direction, so the
attitude a gravity-aligned world would see is the ground's own times the robot's on it. The ground
tilts slowly: the accelerations that its turning causes are left out.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ugv_acceptance import BadConfig
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.simulation.engine import mujoco
from ugv_acceptance.simulation.scenario import Command
from ugv_acceptance.simulation.vehicle import (
    SERVO,
    Build,
    drive,
    gravity_on_slope,
    set_brakes,
    set_payload,
    vehicle_of,
)
from ugv_acceptance.type_aliases import Floats

BUILD = Build(
    wheels=True,
    bulk=True,
    armature=0.01,
    timestep=0.0025,
    contact_time=0.006,
    impratio=1000.0,
)
# Steps between two looks at commands and targets.
STEPS = 2
SENSORS = ('orientation', 'gyro', 'accelerometer')
# Time (s) over which the turn of tilting ground is taken.
INSTANT = 1e-4
# Time (s) to come to rest before the run begins.
SETTLE = 1.0
# Load (kg) that is added at a time: each takes MuJoCo as long as some steps.
_NOTICED = 0.02
# Slack (s) of sums of time steps.
_EARLY = 1e-9


@dataclass(slots=True)
class _Move:
    """A smooth change of a value by `change` from `start`, beginning at `begin` (s).

    It takes `length` (s).
    """

    start: float
    change: float = 0.0
    begin: float = 0.0
    length: float = 0.0

    def at(self, time: float) -> tuple[float, float]:
        """Return value and rate at a time: a cosine ramp, whose peak rate is pi / 2 of the mean."""
        if time >= self.begin + self.length:
            return self.start + self.change, 0.0
        phase = math.pi * max((time - self.begin) / self.length, 0.0)
        rate = self.change * math.pi / (2.0 * self.length) * math.sin(phase)
        return self.start + self.change * (1.0 - math.cos(phase)) / 2.0, rate


def _move(start: float, target: float, speed: float, time: float) -> _Move:
    length = max(abs(target - start) * math.pi / (2.0 * speed), 1e-9)
    return _Move(start, target - start, time, length)


class Simulation:
    """One robot on its ground: `advance` moves it on; the other functions read its state.

    `payload` is in the gripper from the start. Raises BadConfig where a robot cannot be simulated.
    """

    def __init__(
        self,
        robot: Robot,
        start: tuple[tuple[str, float], ...] = (),
        slope: tuple[float, float] = (0.0, 0.0),
        payload: Payload | None = None,
        build: Build = BUILD,
    ) -> None:
        load = robot.payload if payload is None else payload
        try:
            self.vehicle = vehicle_of(replace(robot, payload=load), build)
        except ValueError as error:
            raise BadConfig(f'{robot.name}: expected a robot MuJoCo takes, got: {error}') from error
        self.robot = self.vehicle.robot
        self.data = mujoco.MjData(self.vehicle.model)
        first = dict(start)
        _check_joints(robot, first)
        self._wheels = {roller.joint for _, roller in self.vehicle.wheels}
        self._moves = [_Move(first.get(name, 0.0)) for name in robot.joint_names]
        self._slope = [_Move(part) for part in _parts(*slope)]
        self._load, self._mass = load, _Move(load.mass)
        self._drive = [_Move(0.0), _Move(0.0)]
        self._steered_until = 0.0
        self._braked = False
        self._sensors = [self.data.sensor(name).data for name in SENSORS]
        self._felt = np.zeros(3)
        self._settle()

    def _settle(self) -> None:
        """Let the robot come to rest, so that a run starts without a drop, and set time to 0."""
        data, vehicle = self.data, self.vehicle
        data.qpos[vehicle.position] = [move.start for move in self._moves]
        self._steer(0.0)
        mujoco.mj_forward(vehicle.model, data)
        mujoco.mj_step(vehicle.model, data, nstep=round(SETTLE / vehicle.model.opt.timestep))
        data.time = 0.0
        self._steered_until = 0.0
        self._steer(0.0)
        mujoco.mj_forward(vehicle.model, data)
        self._felt = self._sensors[-1].copy()

    @property
    def time(self) -> float:
        """Simulated time (s) since the start."""
        return float(self.data.time)

    def apply(self, command: Command) -> None:
        """Carry out a command now; a wheel's target is left out, as `drive` turns it.

        Raises BadConfig for a joint that the robot does not move.
        """
        targets = dict(command.joints)
        _check_joints(self.robot, targets)
        now = self.time
        self._steered_until = now
        for k, name in enumerate(self.robot.joint_names):
            if name in targets and name not in self._wheels:
                at = self._moves[k].at(now)[0]
                self._moves[k] = _move(at, targets[name], command.speed, now)
        for k, speed in enumerate(command.drive or ()):
            before = self._drive[k]
            # The same speed repeated, as by remote controls, does not begin a new ramp.
            if speed != before.start + before.change:
                self._drive[k] = _move(before.at(now)[0], speed, command.drive_rate, now)
        if command.slope is not None:
            parts = zip(self._slope, _parts(*command.slope), strict=True)
            self._slope = [_move(m.at(now)[0], to, command.slope_rate, now) for m, to in parts]
        if command.payload is not None:
            self._take(command.payload, command.payload_time)

    def _take(self, payload: Payload, length: float) -> None:
        """Lift a load off the ground within `length` (s); a load set down is gone at once."""
        before = self.load
        if length <= 0.0 or payload.mass <= before:
            before, length = payload.mass, 0.0
        self._mass = _Move(before, payload.mass - before, self.time, length)
        self._load = payload
        set_payload(self.vehicle, replace(payload, mass=before))

    @property
    def load(self) -> float:
        """Return the mass (kg) that the gripper bears now."""
        return self._mass.at(self.time)[0]

    def advance(self, duration: float) -> None:
        """Simulate `duration` (s), a multiple of the time step."""
        model, data = self.vehicle.model, self.data
        count = round(duration / model.opt.timestep)
        felt = np.zeros(3)
        for _ in range(count):
            if self.time >= self._steered_until:
                self._steer(self.time + STEPS * model.opt.timestep)
            mujoco.mj_step(model, data)
            felt += self._sensors[-1]
        self._felt = felt / count

    def _steer(self, time: float) -> None:
        """Set the servos' targets and gravity for `time` (s); unchanged while nothing moves."""
        moves = (*self._moves, *self._slope, *self._drive, self._mass)
        over = all(m.begin + m.length <= time for m in moves)
        self._steered_until = math.inf if over else time - _EARLY
        control, vehicle = self.data.ctrl, self.vehicle
        for motor, move in zip(vehicle.motor, self._moves, strict=True):
            target, rate = move.at(time)
            # The damper of a critically damped servo then brakes only what differs from this rate.
            control[motor] = target + rate * 2.0 / SERVO
        forward, yaw = (move.at(time)[0] for move in self._drive)
        if self._braked != (forward == yaw == 0.0):
            self._braked = not self._braked
            set_brakes(vehicle, on=self._braked)
        drive(vehicle, control, forward, yaw)
        if vehicle.payload >= 0:
            self._bear(self._mass.at(time)[0], over=over)
        gravity = gravity_on_slope(self.robot.gravity, *self._slope_at(time))
        vehicle.model.opt.gravity[:] = gravity

    def _bear(self, mass: float, *, over: bool) -> None:
        """Put a mass (kg) into the gripper, if it differs enough or all changes are `over`."""
        borne = self.vehicle.model.body_mass[self.vehicle.payload]
        if abs(mass - borne) > _NOTICED or (over and mass != borne):
            set_payload(self.vehicle, replace(self._load, mass=mass))

    def slope(self) -> tuple[float, float]:
        """Return tilt and heading (rad) of the ground."""
        return self._slope_at(self.time)

    def _slope_at(self, time: float) -> tuple[float, float]:
        x, y = (move.at(time)[0] for move in self._slope)
        return math.hypot(x, y), math.atan2(y, x)

    def joints(self) -> tuple[Floats, Floats, Floats]:
        """Return position, rate and motor force (j,) of the joints: rad, rad/s, N m (m, m/s, N)."""
        data, vehicle = self.data, self.vehicle
        return (
            data.qpos[vehicle.position],
            data.qvel[vehicle.rate],
            data.actuator_force[vehicle.motor],
        )

    def targets(self) -> Floats:
        """Return where the joints are to be now (j,): rad, m. An arm that sinks is elsewhere."""
        return np.array([move.at(self.time)[0] for move in self._moves])

    def imu(self) -> tuple[Floats, Floats, Floats]:
        """Return the IMU's orientation (4,) x y z w, rate (3,) rad/s, specific force (3,) m/s2.

        The force is the mean over the last `advance`: a real IMU filters vibration likewise.
        """
        orientation, gyro, _ = self._sensors
        ground = _ground(*self._slope_at(self.time))
        world = np.empty(4)
        mujoco.mju_mulQuat(world, ground, orientation)
        return world[[1, 2, 3, 0]], gyro + self._turn_of_ground(ground), self._felt.copy()

    def _turn_of_ground(self, ground: Floats) -> Floats:
        """Return what the gyro feels of ground that tilts (3,) rad/s, in the sensor's axes."""
        if all(move.at(self.time)[1] == 0.0 for move in self._slope):
            return np.zeros(3)
        back, turned, rate = np.empty(4), np.empty(4), np.empty(3)
        mujoco.mju_negQuat(back, ground)
        mujoco.mju_mulQuat(turned, back, _ground(*self._slope_at(self.time + INSTANT)))
        mujoco.mju_negQuat(back, self._sensors[0])
        mujoco.mju_rotVecQuat(rate, 2.0 * turned[1:] / INSTANT, back)
        return rate

    def base(self) -> tuple[Floats, Floats]:
        """Return position (3,) m of `base_link` on the ground, and its z axis there (3,)."""
        root = self.vehicle.root
        return self.data.xpos[root].copy(), self.data.xmat[root].reshape(3, 3)[:, 2].copy()


def _ground(tilt: float, heading: float) -> Floats:
    """Return how sloping ground is turned against level ground, as a quaternion w x y z (4,)."""
    s = math.sin(tilt / 2.0)
    return np.array([math.cos(tilt / 2.0), -s * math.sin(heading), s * math.cos(heading), 0.0])


def _parts(tilt: float, heading: float) -> tuple[float, float]:
    """Return a slope as tilts along x and y (rad), in which it can change direction smoothly."""
    return tilt * math.cos(heading), tilt * math.sin(heading)


def _check_joints(robot: Robot, targets: dict[str, float]) -> None:
    for name in targets:
        if name not in robot.joint_names:
            raise BadConfig(f'{robot.name}: expected a joint of {robot.joint_names}, got {name!r}')
