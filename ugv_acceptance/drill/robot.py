"""The simulated robot of a drill, with a monitor that hears it: advanced by simulated time.

The monitor is the real one: its session takes the robot's serialised messages, judges them and
advises. Nothing here reads a clock, so the same seed and the same acts give the same numbers.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from ugv_acceptance.bag.encode import inertia_cdr
from ugv_acceptance.config import Config
from ugv_acceptance.console.alert_list import AlertBook
from ugv_acceptance.drill.situation import Setup
from ugv_acceptance.evaluation.alerts.alarms import Change
from ugv_acceptance.evaluation.least_margins import least_tilt
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import margins
from ugv_acceptance.monitoring.background import AtOnce
from ugv_acceptance.monitoring.diagnostics import Status, alert_status, verdict_of
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.run.messages import EPOCH
from ugv_acceptance.run.simulated_robot import VirtualRobot
from ugv_acceptance.simulation.scenario import Command
from ugv_acceptance.simulation.simulation import Simulation
from ugv_acceptance.type_aliases import Floats

# Messages a second: half of what the live simulator sends, so that a drill by script is quick.
JOINT_RATE, IMU_RATE = 50.0, 100.0
# Seconds between two looks of the monitor at the time, and of the drill at the robot; how many
# looks lie between two pieces of advice, and between what a monitor does each second.
LOOK, ADVISED, SECOND = 0.05, 5, 20
# Seconds in which the robot comes to rest on its slope before the monitor hears it.
_REST = 1.0
# How fast (rad/s) the ground is tilted before that.
_AT_ONCE = 10.0
# Share of a motor's limit from which it counts as at its limit.
_ALL = 1.0 - 1e-9
# How far (rad, m) a joint is from where it should be once it has given in.
SINKS = math.radians(5.0)


@dataclass(slots=True)
class SimulatedClock:
    """A clock that shows the time (ns) it was set to."""

    time: int = EPOCH

    def now(self) -> int:
        """Return the time (ns since the epoch)."""
        return self.time


@dataclass(frozen=True, slots=True)
class Truth:
    """What the robot really does at `time` (s); no sensor and no monitor is asked.

    `lean` (rad) is the angle between its z axis and that of the ground, `place` (3,) m its base on
    the ground, `q` (j,) its joints. `least` (rad) is the tilt left to `side` with the real load
    (NaN, '': it does not stand), `yielding` the joints whose motors give all they have and are not
    where they should be, `known` whether the monitor knows the margins.
    """

    time: float
    lean: float
    place: Floats
    q: Floats
    side: str
    least: float
    yielding: tuple[str, ...]
    known: bool


@dataclass(slots=True)
class DrillRobot:
    """A simulated robot in a situation, and the session of a monitor that hears its messages.

    `alerts` are those the monitor published, `verdict` its newest. Raises AcceptanceError where the
    robot cannot be simulated.
    """

    config: Config
    setup: Setup
    seed: int
    virtual: VirtualRobot = field(init=False)
    session: Session = field(init=False)
    clock: SimulatedClock = field(default_factory=SimulatedClock)
    alerts: AlertBook = field(default_factory=AlertBook)
    verdict: Status = field(init=False)
    _upright: Floats = field(init=False)
    _looks: int = 0

    def __post_init__(self) -> None:
        setup, robot = self.setup, self.config.settings.robot
        at = dict(setup.posture)
        home = tuple(at.get(name, 0.0) for name in robot.joint_names)
        self.virtual = VirtualRobot(
            self.config, self.seed, (), home, JOINT_RATE, IMU_RATE, blocks=setup.blocks
        )
        _, self._upright = self.simulation.base()
        load = Payload(setup.load, robot.payload.cog)
        self.simulation.apply(Command(0.0, slope=setup.slope, slope_rate=_AT_ONCE, payload=load))
        self.virtual.remote.advance(_REST)
        self._set_clock()
        self.session = self._session()
        self.declare(setup.load)
        if setup.ground is not None:
            self.take_ground(setup.ground)
        self.verdict = verdict_of(self.session)

    def _session(self) -> Session:
        return Session(
            self.config.settings,
            lambda _stamp, _margins: None,
            self._changed,
            _ignore,
            self.clock,
            pool=AtOnce(),
        )

    @property
    def simulation(self) -> Simulation:
        """The simulation of the robot and its ground."""
        return self.virtual.remote.simulation

    @property
    def time(self) -> float:
        """Simulated time (s)."""
        return self.virtual.elapsed

    def _set_clock(self) -> None:
        self.clock.time = EPOCH + round(self.virtual.elapsed * 1e9)

    def _changed(self) -> None:
        self.tell(self.session.alarm_tracker.take())

    def tell(self, changes: Iterable[Change]) -> None:
        """Enter changes of alarms in the list of alerts, as a monitor publishes them."""
        for change in changes:
            status = alert_status(change, self.session)
            values = {key: str(value) for key, value in status.values.items()}
            self.alerts.take(values, status.message)

    def declare(self, mass: float) -> None:
        """Tell the monitor that the gripper holds `mass` (kg)."""
        robot = self.config.settings.robot
        now, frame = self.clock.now(), robot.payload_link or ''
        self.session.take_payload(inertia_cdr(now, frame, mass, robot.payload.cog))

    def take_ground(self, kind: str) -> None:
        """Tell the monitor what the robot drives on: one of evaluation.ground.KINDS."""
        settings, load = self.session.settings, self.session.evaluator.payload
        ground, robot = (
            replace(settings.ground, kind=kind),
            replace(settings.robot, payload=load),
        )
        self.session.adopt(replace(settings, ground=ground, robot=robot))

    def look(self) -> Truth:
        """Let LOOK (s) pass; return what the robot does then."""
        virtual, session = self.virtual, self.session
        take = {'joint_states': session.take_joint_state, 'imu': session.take_imu}
        for _ in range(round(LOOK * IMU_RATE)):
            virtual.step()
            self._set_clock()
            for source, data in virtual.due(virtual.elapsed):
                take[source](data)
        self._looks += 1
        session.tick()
        self.tell(session.alarm_tracker.alarms.advance(self.clock.now()))
        if self._looks % ADVISED == 0:
            session.advisory.renew(self.clock.now(), session.active)
            session.advisory.arrived()
        if self._looks % SECOND == 0:
            session.measure_rates()
            session.feel()
            session.tick()
        self.verdict = verdict_of(session)
        return self.truth()

    def truth(self) -> Truth:
        """Return what the robot really does now."""
        simulation, names = self.simulation, self.simulation.robot.joint_names
        (place, up), (q, _, force) = simulation.base(), simulation.joints()
        limits = [simulation.robot.joint(name).effort for name in names]
        full = np.abs(force) >= np.array(limits) * _ALL
        sinks = full & (np.abs(q - simulation.targets()) > SINKS)
        side, least = self._least(q.copy())
        return Truth(
            self.time,
            math.acos(min(max(float(up @ self._upright), -1.0), 1.0)),
            place,
            q.copy(),
            side,
            least,
            tuple(name for name, yields in zip(names, sinks.tolist(), strict=True) if yields),
            self.session.evaluator.margins is not None,
        )

    def _least(self, q: Floats) -> tuple[str, float]:
        """Return the side with the least tilt left, and how much (rad), with the real load."""
        simulation, vehicle = self.simulation, self.simulation.vehicle
        turned = simulation.data.xmat[vehicle.root].reshape(3, 3)
        load = Payload(simulation.load, simulation.robot.payload.cog)
        found = margins(simulation.robot, q, turned.T @ np.array(vehicle.model.opt.gravity), load)
        return least_tilt(found.angle.tolist())


def _ignore(_text: str) -> None:
    """Take a line for the log of a monitor: a drill keeps none."""
