"""A simulated robot with the interface of a real one: it obeys commands and sends messages.

Free of clocks and ROS: the caller advances the time.
"""

import heapq
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ugv_acceptance import BadConfig
from ugv_acceptance.config import Config
from ugv_acceptance.run.catalogue import check_drives
from ugv_acceptance.run.messages import EPOCH, Driver
from ugv_acceptance.run.record import build_of, real_robot
from ugv_acceptance.simulation.corruption import Corruption, overload
from ugv_acceptance.simulation.drive_by_wire import RemoteRobot
from ugv_acceptance.simulation.faults import Fault
from ugv_acceptance.simulation.poses import stowed_of
from ugv_acceptance.simulation.scenario import Scenario, noise_of
from ugv_acceptance.simulation.shape import Block
from ugv_acceptance.simulation.stretches import Rows, Sensors, stride_of

# Source ('joint_states' or 'imu') and serialised content of a message.
Sent = tuple[str, bytes]


@dataclass(slots=True)
class VirtualRobot:
    """A simulated robot with sensors, driver and faults; `step` simulates one IMU period.

    `home` are positions (rad) at the start in the order of the configuration, none: stowed. Stamps
    begin at `epoch` (ns); `blocks` lie on the ground. Raises BadConfig where rates or positions do
    not fit.
    """

    config: Config
    seed: int = 1
    faults: tuple[Fault, ...] = ()
    home: tuple[float, ...] = ()
    joint_rate: float = 100.0
    imu_rate: float = 200.0
    epoch: int = EPOCH
    blocks: tuple[Block, ...] = ()
    tick: float = field(init=False)
    remote: RemoteRobot = field(init=False)
    _driver: Driver = field(init=False)
    _stride: int = field(init=False)
    _count: int = 0
    _waiting: list[tuple[float, int, str, bytes]] = field(default_factory=list)
    _rng: np.random.Generator = field(init=False)
    _sensors: Sensors = field(init=False)

    def __post_init__(self) -> None:
        robot = self.config.settings.robot
        build = replace(build_of(self.config), blocks=self.blocks)
        check_drives(robot)
        rates = Scenario('live', 1.0, joint_rate=self.joint_rate, imu_rate=self.imu_rate)
        self._stride = stride_of(rates, build)
        self.tick = 1.0 / self.imu_rate
        real = real_robot(self.config, self.faults)
        self.remote = RemoteRobot(real, build, self._start(), overload(self.faults))
        corruption = Corruption(self.faults, robot.joint_names)
        self._driver = Driver(self.config, corruption, noise_of(robot), self.epoch)
        self._rng = np.random.default_rng(self.seed)
        self._sensors = Sensors(noise_of(robot), np.random.default_rng(self.seed))

    def _start(self) -> tuple[tuple[str, float], ...]:
        robot = self.config.settings.robot
        names, stowed = robot.joint_names, {} if self.home else dict(stowed_of(robot))
        home = self.home or tuple(stowed.get(name, 0.0) for name in names)
        if len(home) != len(names):
            raise BadConfig(f'home: expected {len(names)} positions, got {len(home)}')
        return tuple(zip(names, home, strict=True))

    @property
    def elapsed(self) -> float:
        """Simulated time (s) since the start."""
        return self.remote.elapsed

    def shift(self, nanoseconds: int) -> None:
        """Move all later stamps by an offset (ns): real time the simulation could not follow."""
        self.epoch += nanoseconds
        self._driver = replace(self._driver, epoch=self.epoch)

    def tilt(self, tilt: float, heading: float, rate: float) -> None:
        """Tilt the ground (rad) down towards `heading` (rad from the robot's front), at a rate.

        `rate` is the peak in rad/s. A robot that has turned is put onto the ramp as a person would.
        """
        self.remote.tilt(tilt, heading + self._yaw(), rate)

    def suffer(self, faults: tuple[Fault, ...]) -> None:
        """Have these faults of sensors and messages from now on instead of those before."""
        self._driver.corruption.faults = faults

    def pull(self, force: float, height: float) -> None:
        """Pull backwards with a force (N) at a hitch, `height` (m) above the middle of the base."""
        simulation, yaw = self.remote.simulation, self._yaw()
        back = (-force * math.cos(yaw), -force * math.sin(yaw), 0.0)
        base = simulation.data.body(simulation.vehicle.root)
        arm = base.xpos + np.array((0.0, 0.0, height)) - base.xipos
        base.xfrc_applied[:] = (*back, *np.cross(arm, back))

    def _yaw(self) -> float:
        """Return the direction (rad) of the robot's front on the ground."""
        x, y, z, w = self.remote.simulation.imu()[0]
        return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))

    def step(self) -> None:
        """Simulate one period of the IMU; its messages are kept until they are due."""
        self.remote.advance(self.tick)
        simulation, now = self.remote.simulation, self.remote.elapsed
        rows = Rows(imu=[(now, *simulation.imu())])
        self._count += 1
        if self._count % self._stride == 0:
            rows.joints.append((now, *simulation.joints()))
            self._send('joint_states', self._driver.joint_states(self._sensors.joints(rows)))
        self._send('imu', self._driver.imu(self._sensors.imu(rows)))

    def _send(self, source: str, messages: Iterable[tuple[float, bytes]]) -> None:
        corruption = self._driver.corruption
        for at, data in messages:
            due = corruption.arrivals(source, at, self._rng) if corruption.faults else (at,)
            for when in due:
                heapq.heappush(self._waiting, (when, self._count, source, data))

    def due(self, now: float = math.inf) -> Iterator[Sent]:
        """Yield the messages that arrive until `now` (s, simulated)."""
        while self._waiting and self._waiting[0][0] <= now:
            _, _, source, data = heapq.heappop(self._waiting)
            yield source, data
